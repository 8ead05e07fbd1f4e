"""Springs at the joints of an arm: energy, torque and tangent of all of them.

A spring turns a joint back to its angle q_0, by k (θ − q_0) or by the torque of its law. Joints
that follow others have springs, too: torques become Sᵀ M, and tangents Sᵀ diag k S.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from cdsm.errors import InvalidInput, listed
from cdsm.joints import Coupling
from cdsm.springs import SpringLaw
from cdsm.support.format import place, span
from cdsm.support.validation import one_of, scalar, within
from cdsm.support.values import Array, frozen

Spring = float | Sequence[float] | SpringLaw
"""Stiffness of a spring [N m/rad], [N/m] at a prismatic joint; (stiffness, free angle); or law."""

SpringOfJoint = tuple[float, float] | SpringLaw
"""Stiffness [N m/rad] and free angle [rad] of a spring, or its law."""

_NAMED = 3  # most joints that a sentence names


@dataclass(frozen=True, eq=False)
class Springs:
    """Springs of all n joints; nv of them are independent.

    Attributes:
        joints: Names of the joints in Pinocchio's order, those that follow others included.
        stiffness: k (n,) [N m/rad] at rest, [N/m] for prismatic joints; 0: none.
        angle: `q_0` (n,) without torque [rad], [m] for prismatic joints.
        laws: Laws of springs that are not linear, by the number of their joint.
        given: Stiffness and angle, or law, of each spring by the name of its joint.
        units: Unit of the coordinate of each joint (n,): rad, or m for prismatic joints.
    """

    joints: tuple[str, ...]
    stiffness: Array
    angle: Array
    _coupling: Coupling | None = None
    laws: Mapping[int, SpringLaw] = field(default_factory=dict)
    given: Mapping[str, SpringOfJoint] = field(default_factory=dict)
    units: tuple[str, ...] = ()

    @cached_property
    def constant(self) -> Array:
        """Stiffness k (n,) of the linear springs; 0 where there is a law, or none."""
        return self._with_laws_as(0.0)

    @cached_property
    def coefficients(self) -> Array:
        """Stiffness k (n,) of the linear springs, and the factor 1 of those with a law."""
        return self._with_laws_as(1.0)

    def _with_laws_as(self, value: float) -> Array:
        """Return the stiffness (n,) of the linear springs, with a number where there is a law."""
        if not self.laws:
            return self.stiffness
        k = self.stiffness.copy()
        k[[*self.laws]] = value
        return frozen(k)

    @cached_property
    def _alike(self) -> list[tuple[SpringLaw, list[int], Array]]:
        """Each law that is not linear, without its angle; the joints that have it, their q_0."""
        joints = dict[SpringLaw, list[int]]()
        for j, law in self.laws.items():
            joints.setdefault(law.at_angle(0.0), []).append(j)
        return [(law, of, self.angle[of]) for law, of in joints.items()]

    def law_torque(self, angles: Array) -> Array:
        """Compute M (…, n) [N m] of the joints with laws at all angles θ (…, n); 0 elsewhere."""
        torque = np.zeros(angles.shape)
        for law, of, free in self._alike:
            torque[..., of] = law.shape.torque(angles[..., of] - free)
        return torque

    def law_stiffness(self, angles: Array) -> Array:
        """Compute M′ (…, n) [N m/rad] of the joints with laws at all θ (…, n); 0 elsewhere."""
        stiffness = np.zeros(angles.shape)
        for law, of, free in self._alike:
            stiffness[..., of] = law.shape.stiffness(angles[..., of] - free)
        return stiffness

    def torque(self, q: Array) -> Array:
        """Compute the derivative of the energy `Σ E(θ − q_0)` by q (nv,): `k (θ − q_0)`, or M."""
        angles = self._angles(q)
        pulled = self.constant * (angles - self.angle)
        if self.laws:
            pulled = pulled + self.law_torque(angles)
        return pulled if self._coupling is None else np.asarray(pulled @ self._coupling.matrix)

    def energy(self, q: Array) -> float:
        """Compute `Σ E(θ − q_0)` [J]: `½ k (θ − q_0)²` of a linear spring."""
        angles = self._angles(q)
        energy = float(0.5 * self.constant @ (angles - self.angle) ** 2)
        for law, of, free in self._alike:
            energy += float(law.shape.energy(angles[of] - free).sum())
        return energy

    def stiffness_at(self, q: Array) -> Array:
        """Compute the second derivative of the energy (nv, nv) [N m/rad]: diag k, or `Sᵀ diag k S`.

        Of springs with laws, k is the tangent M′ at q (nv,).
        """
        if not self.laws:
            return self.matrix
        return self._matrix(self.constant + self.law_stiffness(self._angles(q)))

    def tangential(self, q: Array) -> dict[str, tuple[float, float]]:
        """Return by joint the linear spring that is tangent at q (nv,): stiffness, free angle."""
        angles = self._angles(q)
        k = self.constant + self.law_stiffness(angles)
        free = self.angle.copy()
        at = [*self.laws]
        free[at] = angles[at] - self.law_torque(angles)[at] / k[at]
        pairs = zip(k.tolist(), free.tolist(), strict=True)
        return dict(zip(self.joints, pairs, strict=True))

    @cached_property
    def matrix(self) -> Array:
        """Second derivative of the energy (nv, nv) [N m/rad] where all springs are at rest."""
        return self._matrix(self.stiffness)

    def _matrix(self, k: Array) -> Array:
        K = np.diag(k)
        return frozen(self._coupling.square(K) if self._coupling else K)

    def _angles(self, q: Array) -> Array:
        return q if self._coupling is None else self._coupling.angles(q)

    @property
    def sprung(self) -> list[int]:
        """Indices of the joints that have a spring."""
        return np.flatnonzero(self.stiffness).tolist()

    @cached_property
    def rest(self) -> Array:
        """Joint angles q (nv,) [rad] where the springs rest; 0 where there are none."""
        if self._coupling is None:
            return self.angle
        S = self._coupling.matrix
        root = np.sqrt(self.stiffness)
        free = root * (self.angle - self._coupling.offset)
        angles: Array = np.linalg.lstsq(S * root[:, None], free, rcond=None)[0].astype(np.float64)
        for j in {int(abs(S[i]).argmax()) for i in self.laws}:
            angles[j] = self._rest_of(j, angles)
        return frozen(angles)

    def _rest_of(self, j: int, q: Array) -> float:
        """Return the angle of the independent joint j at which the springs behind it balance.

        Each joint follows one other. So the torque for q_j rises, and has its zero between the
        angles at which the springs are free one by one.
        """
        from scipy.optimize import brentq  # slow to import

        assert self._coupling is not None
        factor = self._coupling.matrix[:, j]
        behind = np.flatnonzero(factor * self.stiffness)
        free = (self.angle - self._coupling.offset)[behind] / factor[behind]
        low, high = float(free.min()), float(free.max())

        def torque(angle: float) -> float:
            there = q.copy()
            there[j] = angle
            return float(self.torque(there)[j])

        return low if torque(low) >= 0.0 else float(brentq(torque, low, high, xtol=1e-15))

    def doubts(self, q: Array) -> Iterator[str]:
        """Yield a sentence for each law of which no measured point gives the tangent at q (nv,)."""
        x = self._angles(q) - self.angle
        for law, of, _ in self._alike:
            least = law.shape.known_from
            if near := [j for j in of if abs(x[j]) < least]:
                unit = self.units[near[0]]
                names = listed([self.joints[j] for j in near], _NAMED)
                k = f"{span(law.shape.stiffness(x[near]))} {'N/m' if unit == 'm' else 'N m/rad'}"
                spring = "the spring of" if len(near) == 1 else "the springs of"
                where = f"{spring} {names} {'is' if len(near) == 1 else 'are'} within"
                if law.exponent is None:
                    yield (
                        f"{where} {place(least, unit)} of rest, the first point of the table: no "
                        f"point tells the tangent there, {k}"
                    )
                else:
                    yield (
                        f"{where} {place(least, unit)} of rest, the scale of the law, which was "
                        f"given and not found: the tangent there, {k}, follows from it"
                    )


def springs_of(
    springs: object,
    joints: tuple[str, ...],
    coupling: Coupling | None,
    units: tuple[str, ...],
    ends: tuple[Array, Array],
) -> Springs:
    """Check springs by the name of their joint, and return those of all ``joints``.

    ``units`` are those of the coordinates of all joints (n,), ``ends`` the angles (n,) between
    which functions are checked. Raises InvalidInput, also if there is no such joint.
    """
    if not isinstance(springs, Mapping):
        problem = f"{springs!r} given; give a dict of joint names and stiffnesses [N m/rad]."
        raise InvalidInput("springs", problem)
    k = np.zeros(len(joints))
    angle = np.zeros(len(joints))
    laws = dict[int, SpringLaw]()
    given = dict[str, SpringOfJoint]()
    for name, spring in springs.items():
        j = joints.index(one_of("joint", name, joints))
        argument = f"springs[{name!r}]"
        if isinstance(spring, SpringLaw):
            low, high = sorted((ends[0][j], ends[1][j]))
            if fault := spring.fault(low, high):
                raise InvalidInput(argument, f"{fault}.")
            k[j] = spring.stiffness_at_rest
            angle[j] = spring.angle
            given[name] = spring
            if not spring.is_linear:
                laws[j] = spring
            continue
        pair = list(spring) if isinstance(spring, Sequence) else [spring, 0.0]
        if len(pair) != 2:
            problem = "give a stiffness, or (stiffness, angle), or a SpringLaw."
            raise InvalidInput(argument, problem)
        k[j], angle[j] = (scalar(argument, number) for number in pair)
        if fault := within("spring", k[j], zero=True):
            raise InvalidInput(argument, f"{fault}.")
        if k[j] or angle[j]:
            given[name] = float(k[j]), float(angle[j])
    ordered = {name: given[name] for name in joints if name in given}
    return Springs(joints, frozen(k), frozen(angle), coupling, laws, ordered, units)
