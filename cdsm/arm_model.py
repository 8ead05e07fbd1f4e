"""What all computations on an arm share: its bodies, tree, cable routing and cable laws.

A :class:`~cdsm.Manipulator` holds one :class:`ArmModel` in ``_model``; every other module that
needs more than the public properties of an arm takes it from there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, final

import numpy as np
from numpy.typing import NDArray

from cdsm.cable import Cable
from cdsm.elasticity import Elasticity, LinearElasticity
from cdsm.errors import CableError, ElasticityRangeError, InvalidInput, UnknownName
from cdsm.kernels import segments
from cdsm.kernels.bodies import Masses
from cdsm.kernels.stiffness import cable_stiffness
from cdsm.kernels.tree import Routing, Tree
from cdsm.rigid_body import RigidBody
from cdsm.support.validation import LARGEST, RANGES
from cdsm.support.values import Array, frozen
from cdsm.wires.continuity import find_jump
from cdsm.wires.laws import StrandElasticity

OriginalLength = Literal["unstrained", "stretched"]

_STEP = 1e-5
"""Relative step of the difference of the slope of EA (1 + ε)."""

_LIMIT_SLACK = 1e-9
"""Angles this far [rad] beyond a limit are rounding, as of a conversion from degrees."""


@final
@dataclass(frozen=True, eq=False)
class ArmModel:
    """An arm as arrays and laws; it does not depend on the joint angles.

    Attributes:
        body: The rigid-body model.
        tree: The joints.
        routing: The cable sites and segments.
        masses: The masses that the joints carry, and the tip.
        laws: The cables' elasticities.
        lowest: Lower joint limits (nv,) [rad], less what rounding may take.
        highest: Upper joint limits (nv,) [rad], likewise.
    """

    body: RigidBody
    tree: Tree
    routing: Routing
    masses: Masses
    laws: CableLaws
    lowest: Array
    highest: Array

    @classmethod
    def of(
        cls, body: RigidBody, cables: tuple[Cable, ...], original_length: OriginalLength
    ) -> ArmModel:
        """From the rigid bodies and the cables on them.

        Raises:
            CableError: A cable on a link that does not exist, or two of its sites coincide.
            InvalidInput: The rigidity of a law jumps.
        """
        tree, laws = body.tree(), CableLaws(cables, original_length)
        laws.require_continuity()
        return cls(
            body=body,
            tree=tree,
            routing=route(body, tree, cables),
            masses=body.masses(),
            laws=laws,
            lowest=frozen(body.lower - _LIMIT_SLACK),
            highest=frozen(body.upper + _LIMIT_SLACK),
        )

    def beyond_limits(self, q: Array) -> NDArray[np.bool_]:
        """Which of the joint angles (nv,) [rad] are beyond their limits."""
        return np.asarray((q < self.lowest) | (q > self.highest))


def route(body: RigidBody, tree: Tree, cables: Sequence[Cable]) -> Routing:
    """Place the sites on the joints, and find for every segment the joints that change it."""
    row, point, fixed = [], [], np.array([cable.lead for cable in cables])
    parts: list[tuple[int, int, int, int, int]] = []
    joints: list[int] = []
    for c, cable in enumerate(cables):
        for i, site in enumerate(cable.sites):
            try:
                joint, rotation, translation = body.locate(site.link)
            except UnknownName as error:
                raise CableError(cable.name, str(error)) from None
            row.append(joint)
            point.append(translation + rotation @ np.array(site.position))
            if i == 0:
                continue
            if row[-2] == row[-1]:  # a segment within one link
                length = math.dist(point[-2], point[-1])
                if length < segments.SHORTEST_SEGMENT:
                    raise CableError(cable.name, f"sites {i} and {i + 1} coincide; leave one out.")
                fixed[c] += length
                continue
            to_a, to_b = _joints_to(tree, row[-2]), _joints_to(tree, row[-1])
            only_a = [j for j in to_a if j not in to_b]
            only_b = [j for j in to_b if j not in to_a]
            first = len(joints)
            parts.append((c, len(row) - 2, len(row) - 1, first, first + len(only_a)))
            joints += [*only_a, *only_b]
    parts.append((0, 0, 0, len(joints), len(joints)))
    return Routing(
        row=frozen(np.array(row, dtype=np.intp)),
        point=frozen(np.array(point)),
        segment=frozen(np.array(parts, dtype=np.intp)),
        joint=frozen(np.array(joints, dtype=np.intp)),
        fixed=frozen(fixed),
    )


def _joints_to(tree: Tree, row: int) -> list[int]:
    """Rows of the joints from the base to a joint, base first, that one included."""
    rows: list[int] = []
    while row:
        rows.insert(0, row)
        row = int(tree.parent[row])
    return rows


class CableLaws:
    """The elasticities of an arm's cables: how stiff the cables are, and what they may carry.

    A locked motor holds the original length l_0 of its wire. Under tension the wire is
    ℓ = l_0 (1 + ε) long, so that its stiffness EA/l_0 is EA (1 + ε)/ℓ.

    Args:
        cables: Those of an arm.
        original_length: ``"unstrained"``: a wire's original length is ℓ/(1 + ε); ``"stretched"``:
            it is ℓ itself, as in the paper.

    Attributes:
        held: Each law of the position-controlled cables, and which cables have it.
        series: 1/k_series of all cables (C,) [m/N].
        rest: Tension at which their springs are at rest (C,) [N]: the low end of each law.
    """

    def __init__(self, cables: tuple[Cable, ...], original_length: OriginalLength) -> None:
        self._cables = cables
        self._unstrained = original_length == "unstrained"
        held = [c for c, cable in enumerate(self._cables) if cable.control == "position"]
        by_law: dict[object, list[int]] = {}
        for c in held:
            by_law.setdefault(_key(self._cables[c].elasticity), []).append(c)
        # one law for all is the usual case, and a slice costs less than indices
        self.held = [
            (
                self._cables[cables[0]].elasticity,
                slice(None) if len(cables) == len(self._cables) else np.array(cables),
            )
            for cables in by_law.values()
        ]
        self._least = frozen(np.array([cable.minimum for cable in self._cables]))
        self._most = frozen(np.array([cable.maximum for cable in self._cables]))
        self._bounded = bool(self._least.any() or np.isfinite(self._most).any())
        series = np.array([cable.series_stiffness for cable in self._cables])
        self.series = frozen(1.0 / series)
        self.rest = frozen(np.array([cable.elasticity.domain.low for cable in self._cables]))
        # EA of the cables where it is always the same; laws that have to be asked
        constant, linear, self._asked = np.zeros(len(self._cables)), np.zeros(len(self._cables)), []
        for law, of in self.held:
            if isinstance(law, LinearElasticity):
                constant[of], linear[of] = law.rigidity(0.0), float(self._unstrained)
            else:
                self._asked.append((law, of))
        self._constant, self._linear = frozen(constant), frozen(linear)

    def require_continuity(self) -> None:
        """Refuse a law whose rigidity jumps.

        Raises:
            InvalidInput: Names a cable and the tension.
        """
        for law, held in self.held:
            jump = find_jump(law)
            if jump is not None:
                name = np.array(self._cables, dtype=object)[held][0].name
                raise InvalidInput(
                    "elasticity",
                    f"the rigidity of {name} jumps at {jump.tension:.6g} N from {jump.below:.6g} "
                    f"to {jump.above:.6g} N, and K_θ with it. Make it continuous, e.g. by a "
                    "TabulatedElasticity through points of its strain.",
                )

    def narrowed(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Bounds of tension (…, C) [N], and those that the cables have of their own."""
        if not self._bounded:
            return low, high
        return frozen(np.maximum(low, self._least)), frozen(np.minimum(high, self._most))

    def stiffness(self, lengths: Array, tension: Array) -> Array:
        """Diagonal of K_L (C,) [N/m]: 1/(l_0/EA(F) + 1/k_series), 0 for force-controlled cables.

        Of checked lengths L (C,) [m] and tensions (C,) [N], which are not negative.

        Raises:
            ElasticityRangeError: Names the cables whose tension is outside their elasticity's
                domain.
            InvalidInput: An elasticity of the user's own gives no positive rigidity, or no strain.
        """
        rigidity = self._constant
        if self._asked:
            rigidity = rigidity.copy()
            for law, held in self._asked:
                try:
                    rigidity[held] = self.stretched_rigidity(law, tension[held])
                except ElasticityRangeError as error:
                    raise self.naming(error, held) from None
        k = cable_stiffness(lengths, tension, rigidity, self._linear, self.series, self.rest)
        return frozen(k)

    def stretched_rigidity(self, law: Elasticity, tension: Array) -> Array:
        """EA (1 + ε) [N] of a law, or EA where the stretched length counts; same shape as F [N].

        Raises:
            ElasticityRangeError: A tension outside the domain of the law.
            InvalidInput: The law gives no positive rigidity, or no strain.
        """
        if isinstance(law, LinearElasticity):
            rigidity = law.rigidity(tension)
            return rigidity + tension if self._unstrained else rigidity
        rigidity = _checked_rigidity(law, tension)
        return rigidity * (1.0 + _checked_strain(law, tension)) if self._unstrained else rigidity

    def original_lengths(self, lengths: Array, tension: Array) -> Array:
        """l_0 (C,) [m] of cables that are L (C,) [m] long under F (C,) [N].

        The series spring counts into the cable: l_0 is negative where it stretches by more than the
        whole cable is long. Of a force-controlled cable, whose motor holds no length, L itself.

        Raises:
            ElasticityRangeError: As for :meth:`stiffness`.
            InvalidInput: As for :meth:`stiffness`.
        """
        wire = np.array(lengths)
        for law, held in self.held:
            F = tension[held]
            wire[held] -= self.series[held] * (F - self.rest[held])
            if self._unstrained:
                try:
                    wire[held] /= 1.0 + _checked_strain(law, F)
                except ElasticityRangeError as error:
                    raise self.naming(error, held) from None
        return frozen(wire)

    def slopes(self, tension: Array, stiffness: Array) -> tuple[Array, Array]:
        """dk/dF (C,) [1/m] and d²k/dF² (C,) [1/(N m)] of cables of stiffness k under F (C,) [N].

        Both at a posture, where l_0 changes with F. With R = EA (1 + ε), G = R′/R and w = 1 −
        k/k_series, the part of the wire in the cable's compliance,

            k′ = k A,  k″ = k (A² + A′),  A = (1 − w)/R + w G,
            A′ = (1 − w) (A/R − G/R − A G) + w G′.

        G′ is a difference, good for some five digits.

        Raises:
            ElasticityRangeError: As for :meth:`stiffness`.
            InvalidInput: An elasticity of the user's own gives no finite slope.
        """
        first, second = np.zeros_like(stiffness), np.zeros_like(stiffness)
        for law, held in self.held:
            F, k = tension[held], stiffness[held]
            last = np.array([*kinks(law), law.domain.high])[np.searchsorted(kinks(law), F)]
            step = _STEP * np.maximum(F, 1.0)
            beside = np.where(F + step <= last, F + step, F - step)
            both = np.stack([F, beside])
            try:
                slopes = np.asarray(law.rigidity_slope(both))
                R = self.stretched_rigidity(law, F)
                if self._unstrained:  # (EA (1 + ε))′ = EA′ (1 + ε) + 1
                    slopes = slopes * (1.0 + _checked_strain(law, both)) + 1.0
            except ElasticityRangeError as error:
                raise self.naming(error, held) from None
            if slopes.shape != (2, F.size) or not np.isfinite(slopes).all():
                raise InvalidInput(
                    "elasticity",
                    f"{law!r} gives the slopes {slopes} of its rigidity at tensions {F} N and "
                    "beside them; one finite number for each is needed.",
                )
            G, spring = slopes[0] / R, k * self.series[held]
            bend = (slopes[1] - slopes[0]) / (beside - F) / R - G**2
            A = spring / R + (1.0 - spring) * G
            first[held] = k * A
            change = spring * (A / R - G / R - A * G) + (1.0 - spring) * bend
            second[held] = k * (A**2 + change)
        return frozen(first), frozen(second)

    def naming(
        self, error: ElasticityRangeError, held: slice | NDArray[np.intp]
    ) -> ElasticityRangeError:
        """The error of a law at the tensions of some cables, with their names and numbers."""
        outside = np.arange(len(self._cables))[held][list(error.indices)].tolist()
        names = [self._cables[c].name for c in outside]
        return ElasticityRangeError(error.problem, error.tension, outside, names)


def kinks(law: Elasticity) -> tuple[float, ...]:
    """Tensions [N], rising, at which the slope of a law's rigidity jumps.

    Slopes at a kink are those of the range below it. The weak kinks at the points of a table are
    not among them.
    """
    return law.joins if isinstance(law, StrandElasticity) else ()


def _checked_rigidity(law: Elasticity, tension: Array) -> Array:
    """EA(F) [N] of a law, same shape as F [N], which need not be the library's own."""
    rigidity = np.asarray(law.rigidity(tension))
    _, least, most = RANGES["rigidity"]
    usable = (rigidity >= least) & (rigidity <= most)  # false for NaN too
    if rigidity.shape != tension.shape or np.count_nonzero(usable) < tension.size:
        raise InvalidInput(
            "elasticity",
            f"{law!r} gives the rigidity {rigidity} N at tensions {tension} N; one positive "
            "number for each is needed.",
        )
    return rigidity


def _checked_strain(law: Elasticity, tension: Array) -> Array:
    """ε(F) [-] of a law, same shape as F [N], which need not be the library's own."""
    strain = np.asarray(law.strain(tension))
    usable = (strain > -1.0) & (strain <= LARGEST)  # false for NaN too
    if strain.shape != tension.shape or np.count_nonzero(usable) < tension.size:
        raise InvalidInput(
            "elasticity",
            f"{law!r} gives the strain {strain} at tensions {tension} N; one number for each, "
            "zero at the low end of its domain and rising, is needed.",
        )
    return strain


def _key(law: Elasticity) -> object:
    """What equal laws share; an elasticity of the user's own need not be hashable."""
    try:
        hash(law)
    except TypeError:
        return id(law)
    return law
