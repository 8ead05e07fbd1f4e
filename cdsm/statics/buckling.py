"""Buckling: tension or load makes the joint stiffness of a fixed posture singular.

Cables stiffen an arm by their elasticity. Their tension mostly softens it (active part of Eq. 16).
With stiff cables the elasticity always wins. With soft springs or long leads (lead: the straight
cable between its actuator and the base disk) there is a critical tension. Above it K_θ is not
positive definite and the arm buckles under any load. This module keeps the posture fixed and takes
the tensions of :func:`~cdsm.distribute_tension`. :func:`~cdsm.equilibrium` computes where an arm
with locked motors moves when it buckles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.posture import Posture
from cdsm.statics.bound_scan import (
    SAMPLES,
    Limit,
    failure_at,
    last_true,
    scan_end,
    stable_ranges,
    tension_domain,
)
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.format import key, plain
from cdsm.support.validation import bound, instance, wrench_vector
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tension import DEFAULT_SOLVER, distribute_tension

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_NOWHERE: Final = 1e6
"""Largest load factor that is tried. If the arm holds it, the critical factor is infinite."""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class CriticalTension(ReadOnlyState):
    """Tension at which an arm buckles at one posture; made by :func:`critical_tension`.

    Attributes:
        posture: The fixed posture.
        wrench: W (6,) at ``tool0``, base axes: force [N], then moment [N m].
        minimum: Lower bound of tension [N] at which the arm, stable below, buckles. It is inf if
            the arm is stable up to the end of :attr:`examined`. It is the low end of
            :attr:`examined` if the arm is stable at no bound.
        mode: Unit joint motion (nv,) of the smallest eigenvalue of K_θ at that bound. If the arm
            does not buckle: at the bound where the arm is softest.
        tension: F (C,) [N] at the bound of ``mode``.
        stable: Ranges (low, high) [N] of the lower bound in which the arm is stable.
        examined: Range [N] of the lower bound that was scanned. It ends where no tensions balance
            the arm within the domains of the elasticities. If tensions balance the arm at every
            bound, it ends where the terms that grow with the tension decide the sign of K_θ.
        bounds: Lower bounds (n,) [N] that were evaluated.
        margins: Smallest eigenvalue of K_θ at each of these bounds (n,) [N m/rad].
    """

    posture: Posture
    wrench: Array
    minimum: float
    mode: Array
    tension: Array
    stable: tuple[tuple[float, float], ...]
    examined: tuple[float, float]
    bounds: Array
    margins: Array

    def __repr__(self) -> str:
        return f"<CriticalTension: {self._verdict}>"

    @property
    def _verdict(self) -> str:
        low, high = self.examined
        if not self.stable:
            return f"UNSTABLE at every lower bound from {low:.4g} N to {high:.4g} N"
        if math.isinf(self.minimum):
            return f"does not buckle at any lower bound up to {high:.4g} N"
        return f"buckles at a lower bound of {self.minimum:.4g} N"

    @property
    def warnings(self) -> tuple[str, ...]:
        """That the arm is UNSTABLE at every lower bound; empty if it is stable at some."""
        return () if self.stable else (self._verdict,)

    def plot(self) -> Figure:
        """Plot the smallest joint stiffness [N m/rad] over the lower bound of tension [N]."""
        from cdsm.plots import plot_critical_tension  # matplotlib imports slowly

        return plot_critical_tension(self)

    def to_dict(self) -> dict[str, object]:
        """Return bounds, mode and margins in SI for JSON, with units in the keys; inf as None."""
        arm = self.posture.arm
        numbers = {
            **self.posture._coordinates,
            "critical_minimum_tension_N": self.minimum,
            "stable_minimum_tension_N": self.stable,
            "examined_minimum_tension_N": self.examined,
            "mode": dict(zip(arm.joint_names, self.mode, strict=True)),
            "tension_N": dict(zip(arm.cables.names, self.tension, strict=True)),
            "minimum_tension_N": self.bounds,
            key("margin", arm.stiffness_unit()): self.margins,
        }
        return dict(plain(numbers))

    def __str__(self) -> str:
        verdict = self._verdict
        spans = ", ".join(f"{a:.4g} to {b:.4g} N" for a, b in self.stable if a < b)
        names = self.posture.arm.joint_names
        lines = [verdict, f"stable from {spans}" if spans else "", _describe_mode(names, self.mode)]
        return "\n".join(line for line in lines if line)


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class CriticalLoad(ReadOnlyState):
    """Multiple of a load at which an arm fails at one posture; made by :func:`critical_load`.

    Attributes:
        posture: The fixed posture.
        wrench: W (6,) that is multiplied by the factor: force [N], then moment [N m].
        carried: Constant wrench (6,) that acts in addition: force [N], then moment [N m].
        factor: Largest factor [-] up to which the arm holds; inf if it holds a million times W.
        limit: Reason of the failure: ``"buckling"``, ``"infeasible"`` (no tensions balance the
            load), ``"elasticity"`` (a tension leaves the domain of its cable) or ``"none"``.
        mode: Unit joint motion (nv,) of the smallest eigenvalue of K_θ at this factor.
        tension: F (C,) [N] at this factor.
    """

    posture: Posture
    wrench: Array
    carried: Array
    factor: float
    limit: Limit
    mode: Array
    tension: Array

    @property
    def warnings(self) -> tuple[str, ...]:
        """That the arm is UNSTABLE without the load already; else empty."""
        return () if self.factor else (f"UNSTABLE without the load: {self}".partition("\n")[0],)

    def to_dict(self) -> dict[str, object]:
        """Return load, factor and mode in SI for JSON, with units in the keys; inf as None."""
        arm = self.posture.arm
        numbers = {
            **self.posture._coordinates,
            "load": self.wrench,
            "carried": self.carried,
            "critical_load_factor": self.factor,
            "limit": self.limit,
            "load_mode": dict(zip(arm.joint_names, self.mode, strict=True)),
            "load_tension_N": dict(zip(arm.cables.names, self.tension, strict=True)),
        }
        return dict(plain(numbers))

    def __repr__(self) -> str:
        return f"<CriticalLoad factor {self.factor:.4g}, {self.limit}>"

    def __str__(self) -> str:
        reason = {
            "buckling": "there it buckles"
            if self.factor
            else "it buckles without the load already",
            "infeasible": "beyond, no tensions balance it",
            "elasticity": "beyond, a tension leaves the domain of its cable's elasticity",
            "none": "nothing happens that far",
        }[self.limit]
        mode = _describe_mode(self.posture.arm.joint_names, self.mode)
        held = f"the load up to a factor of {self.factor:.4g}"
        return f"holds {held if self.factor else 'no part of the load'}; {reason}\n{mode}"


def critical_tension(
    pose: Posture,
    wrench: ArrayLike = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    solver: str = DEFAULT_SOLVER,
) -> CriticalTension:
    """Compute the lower bound of tension at which K_θ becomes singular: det K_θ(F_min) = 0.

    K_θ is that of :func:`~cdsm.stiffness`; its symmetric part decides. F is the result of
    :func:`~cdsm.distribute_tension` with this lower bound on all cables.

    Args:
        pose: The posture, which stays fixed.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m].
        solver: As for :func:`~cdsm.distribute_tension`.

    Raises:
        InvalidInput: ``wrench`` has the wrong shape or is not finite.
        InfeasibleTension: No tensions balance the arm.
        ElasticityRangeError: Even the least tensions are outside the domains of the elasticities.
    """
    arm = instance("pose", pose, Posture).arm
    W = wrench_vector("wrench", wrench)

    def at(minimum: float) -> Stiffness:
        return stiffness(pose, distribute_tension(pose, minimum, wrench=W, solver=solver))

    low, highest = tension_domain(arm)
    at(low)  # raises the reason if no tensions balance the arm
    high = scan_end(at, low, highest)
    places, margins, stable = stable_ranges(at, low, high)
    buckles = [b for _, b in stable if b < high]
    if buckles:
        minimum = where = buckles[0]
    elif stable:
        minimum, where = math.inf, float(places[int(np.argmin(margins))])
    else:
        minimum = where = low
    K = at(where)
    return CriticalTension(
        posture=pose,
        wrench=W,
        minimum=minimum,
        mode=_mode(K),
        tension=K.tension,
        stable=stable,
        examined=(low, high),
        bounds=frozen(places),
        margins=frozen(margins),
    )


def critical_load(
    pose: Posture,
    wrench: ArrayLike,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = math.inf,
    solver: str = DEFAULT_SOLVER,
    *,
    carried: ArrayLike = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
) -> CriticalLoad:
    """Compute the factor λ up to which an arm at a fixed posture holds λ W and the carried wrench.

    Args:
        pose: The posture, which stays fixed. Tensions are distributed again for every load.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]; not zero.
        minimum: Lower bound of the tensions [N], for all cables or (C,).
        maximum: Upper bound of the tensions [N], for all cables or (C,).
        solver: As for :func:`~cdsm.distribute_tension`.
        carried: Constant wrench (6,) at ``tool0`` that always acts, such as the weight of a tool.

    Raises:
        InvalidInput: ``wrench`` is zero; or ``wrench``, ``carried`` or a bound is invalid.
        InfeasibleTension: The arm does not hold its own weight and ``carried``.
        ElasticityRangeError: A tension without the load is outside the domain of its elasticity.
    """
    count = len(instance("pose", pose, Posture).arm.cables)
    W = wrench_vector("wrench", wrench)
    always = wrench_vector("carried", carried)
    low, high = bound("minimum", minimum, count), bound("maximum", maximum, count)
    if not W.any():
        raise InvalidInput("wrench", "is zero, and so is any multiple of it; give a load.")

    def at(factor: float) -> Stiffness:
        return stiffness(pose, distribute_tension(pose, low, high, always + factor * W, solver))

    factor, limit = 0.0, failure_at(at, 0.0)
    at(factor)  # raises the reason if no tensions balance the arm
    if limit == "none":
        end = 1e-3
        while end < _NOWHERE and failure_at(at, end) == "none":
            end *= 2.0
        if end < _NOWHERE:
            # the doubling may have stepped over the first failure
            places = np.linspace(0.0, end, SAMPLES).tolist()
            first = next(i for i, place in enumerate(places) if failure_at(at, place) != "none")
            holds, fails = places[first - 1], places[first]
            factor, beyond = last_true(lambda x: failure_at(at, x) == "none", holds, fails)
            limit = failure_at(at, beyond)
        else:
            factor = math.inf
    K = at(min(factor, _NOWHERE / 2.0))
    return CriticalLoad(
        posture=pose,
        wrench=W,
        carried=always,
        factor=factor,
        limit=limit,
        mode=_mode(K),
        tension=K.tension,
    )


def _mode(K: Stiffness) -> Array:
    """Return the softest joint motion, its largest entry positive (eigenvectors have no sign)."""
    mode = K.critical_direction
    return frozen(mode * np.sign(mode[abs(mode).argmax()]))


def _describe_mode(names: tuple[str, ...], mode: Array) -> str:
    """Name the joints with the largest shares in a mode."""
    order = np.argsort(-abs(mode))[:4]
    shares = ", ".join(f"{names[i]} {mode[i]:+.2f}" for i in order)
    return f"softest joint motion: {shares}" + (", …" if len(mode) > len(order) else "")
