"""K_θ derived a second time, by central differences at this very posture.

Twice, in fact: as the Hessian of the potential, from lengths, places and energies alone, and as the
derivative of the torque out of balance. The first shares nothing with Eq. 16 but where cables and
links are; the second takes the gradients for granted, which are compared by themselves, and is some
digits finer. A moment at the tip has no potential: the load term is then checked by the torque.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, NamedTuple, final

import numpy as np

from cdsm.errors import CdsmError, first_of
from cdsm.report.differences import Estimates, gradients, hessians
from cdsm.report.facts import torque_size
from cdsm.report.potential import Neighbourhood
from cdsm.support.values import Array, ReadOnlyState

if TYPE_CHECKING:
    from cdsm.stiffness_matrix import Stiffness

Verdict = Literal["agrees", "DIFFERS", "not possible"]

RESOLVED = 1e-6
"""An expected error of at most this part of the largest entry is a check; a larger one is none."""

_NEGLIGIBLE = 1e-8
"""So is one of this part of the largest entry of K_θ, for a term that is small beside it."""

_TERMS = ("active", "passive", "gravity", "load")

_UNITS = {"torque": "N m", "lengths": "m"}

_UNSETTLED = (
    "the differences do not settle: what they are taken of is not smooth, segments of cable are "
    "too short, or cables so stiff that they leave their law within the rounding of their length."
)

_NAMED = 3
"""Cables listed in a reason at most."""

_SUM = 16.0 * float(np.finfo(np.float64).eps)
"""Rounding of a sum of some terms, relative to the sum of their magnitudes."""


@final
@dataclass(frozen=True, kw_only=True)
class Difference:
    """What is given against what differences say, the largest entry of it.

    In the unit of what is compared.

    Attributes:
        found: |given − by differences|.
        expected: What truncation and rounding of the differences may make of it.
    """

    found: float
    expected: float


@final
@dataclass(frozen=True, kw_only=True)
class Agreement:
    """How one term of K_θ, or what else is derived a second time, compares.

    Entries of joints that slide are taken with the arm's length, so that all have one unit.

    Attributes:
        name: Which: ``"active"``, ``"passive"``, ``"gravity"``, ``"load"``, ``"joint"`` (their
            sum); ``"torque"``, what is out of balance itself; ``"lengths"`` of the cables.
        unit: ``"N m/rad"``; of the torque ``"N m"``, of the lengths ``"m"``.
        largest: Its largest entry; of the torque that of its parts, of the lengths the longest.
        potential: Against differences of the potential; None where there is none.
        torque: Against differences of the torque, or None.
        verdict: ``"agrees"``: at least one of the two resolves :data:`RESOLVED` of the largest
            entry, and neither is beyond what is expected of it. ``"DIFFERS"``: one is.
            ``"not possible"``: neither resolves it.
        reason: Why it is not possible, or what differs; mostly empty.
    """

    name: str
    unit: str
    largest: float
    potential: Difference | None
    torque: Difference | None
    verdict: Verdict
    reason: str = ""


@final
@dataclass(frozen=True, kw_only=True)
class SelfCheck(ReadOnlyState):
    """K_θ and its four terms against central differences at this very posture.

    Attributes:
        terms: Active, passive, gravity, load, and their sum.
        statics: The torque out of balance, against first differences of the potential.
        lengths: The lengths of the cables, against what is measured between their sites.
    """

    terms: tuple[Agreement, ...]
    statics: Agreement
    lengths: Agreement

    @property
    def passed(self) -> bool:
        """Whether all agree: nothing differs, and nothing could not be checked."""
        return all(each.verdict == "agrees" for each in self.compared)

    @property
    def compared(self) -> tuple[Agreement, ...]:
        """Everything compared."""
        return (*self.terms, self.statics, self.lengths)

    def __str__(self) -> str:
        return "\n".join(
            f"{each.name:<8} {each.verdict}{f': {each.reason}' if each.reason else ''}"
            for each in self.compared
        )


def self_check(K: Stiffness) -> SelfCheck:
    """Derive K_θ, its terms and the torque out of balance anew, and compare.

    Position-controlled cables store energy, force-controlled ones do the work F·L, and all motors
    stay as they are. Nothing is raised: what cannot be derived says why.

    Args:
        K: The stiffness in question, of tensions that need not balance the arm.
    """
    near = Neighbourhood(K)
    energies, torques = _terms_anew(near)
    if K.wrench[3:].any():
        energies[3] = _Anew(None, "a moment has no potential")

    scaled = near.unit[:, None] * near.unit
    given = np.array([K.active, K.passive, K.gravity, K.load]) * scaled
    joint = K.joint * scaled
    size = float(abs(joint).max())
    terms = [
        _compare(name, matrix, abs(matrix).max(), energy, torque, size)
        for name, matrix, energy, torque in zip(_TERMS, given, energies, torques, strict=True)
    ]
    whole = _compare("joint", joint, size, _summed(energies), _summed(torques), size)
    J, k = K.posture.length_jacobian, K.cable_stiffness[:, None, None]
    by_cable = k * J[:, :, None] * J[:, None, :] * scaled
    terms[1] = _adds_up(terms[1], given[1], by_cable, "J_Lᵀ K_L J_L of its cables")
    terms.append(_adds_up(whole, joint, given, "the sum of its four terms"))
    return SelfCheck(terms=tuple(terms), statics=_statics(K, near), lengths=_lengths(K, near))


def _terms_anew(near: Neighbourhood) -> tuple[list[_Anew], list[_Anew]]:
    """Active, passive, gravity and load term by the potential, and by the torque."""
    size, step = near.unit.size, near.first_step
    stored: Estimates | str
    pulled: Estimates | str
    moved = _attempt(lambda: hessians(near.kinematic, size, step, near.kinematic_noise))
    turned = _attempt(
        lambda: gradients(near.kinematic_torques, size, step, near.kinematic_torque_noise)
    )
    if one_sided := near.laws.one_sided():
        named = first_of(one_sided, _NAMED, "cables")
        stored = pulled = f"K_θ has another value on either side: {named}."
    else:
        step = near.first_elastic_step
        stored = _attempt(lambda: hessians(near.elastic, size, step, near.elastic_noise))
        pulled = _attempt(
            lambda: gradients(near.elastic_torques, size, step, near.elastic_torque_noise)
        )
    return _spread(moved, stored), _spread(turned, pulled)


def _statics(K: Stiffness, near: Neighbourhood) -> Agreement:
    """The torque out of balance, which the torques above are of, by first differences."""
    size, step = near.unit.size, near.first_step
    work = _split(_attempt(lambda: gradients(near.work, size, step, near.kinematic_noise)))
    given, largest = K.residual * near.unit, torque_size(K)
    return _compare("torque", given, largest, _summed(work), _Anew(None), largest)


def _lengths(K: Stiffness, near: Neighbourhood) -> Agreement:
    """The lengths that all else is differenced from, by Pinocchio's placements of the links."""
    given = K.posture.cable_lengths
    # ways of two programs through the links round apart by some units more
    measured = _Anew(near.measured_lengths(), error=16.0 * float(near.length_noise.max()))
    longest = float(given.max())
    return _compare("lengths", given, longest, measured, _Anew(None), longest)


class _Anew(NamedTuple):
    """Something by differences, and by how much its entries may be off; or why it is not."""

    value: Array | None
    reason: str = ""
    error: float = 0.0


def _attempt(derive: Callable[[], Estimates]) -> Estimates | str:
    """Derivatives by differences, or why there are none."""
    try:
        return derive()
    except CdsmError as error:
        return str(error)


def _split(derived: Estimates | str) -> list[_Anew]:
    """Each of the three kinematic parts, or the one elastic part, by itself."""
    if isinstance(derived, str):
        return [_Anew(None, derived)] * 3
    return [
        _Anew(value, error=float(error)) if np.isfinite(error) else _Anew(None, _UNSETTLED)
        for value, error in zip(*derived, strict=True)
    ]


def _spread(kinematic: Estimates | str, elastic: Estimates | str) -> list[_Anew]:
    active, gravity, load = _split(kinematic)
    return [active, _split(elastic)[0], gravity, load]


def _summed(parts: list[_Anew]) -> _Anew:
    """Their sum, its error that of all; or why one of them is not."""
    values = [each.value for each in parts if each.value is not None]
    if len(values) < len(parts):
        return _Anew(None, next(each.reason for each in parts if each.value is None))
    return _Anew(np.sum(values, axis=0), error=sum(each.error for each in parts))


def _compare(
    name: str, given: Array, largest: float, potential: _Anew, torque: _Anew, of_all: float
) -> Agreement:
    """What is given against both estimates."""
    unit = _UNITS.get(name, "N m/rad")
    enough = max(RESOLVED * largest, _NEGLIGIBLE * of_all)
    differences = [_difference(given, each) for each in (potential, torque)]
    known = [each for each in differences if each is not None]
    verdict: Verdict = "agrees"
    reason = ""
    if not np.isfinite(given).all() or any(each.found > each.expected for each in known):
        verdict = "DIFFERS"
        worst = max((each.found for each in known), default=np.nan)
        reason = f"is off by {worst:.2g} {unit}, with {largest:.4g} {unit} its largest entry"
    elif not any(each.expected <= enough for each in known):
        verdict = "not possible"
        # a moment that has no potential is no reason, if the torque resolves too little
        alone = "" if torque.value is not None else potential.reason
        reason = torque.reason or alone or _UNSETTLED
    return Agreement(
        name=name,
        unit=unit,
        largest=float(largest),
        potential=differences[0],
        torque=differences[1],
        verdict=verdict,
        reason=reason,
    )


def _difference(given: Array, anew: _Anew) -> Difference | None:
    if anew.value is None:
        return None
    return Difference(found=float(abs(given - anew.value).max()), expected=anew.error)


def _adds_up(found: Agreement, matrix: Array, parts: Array, what: str) -> Agreement:
    """Differs too where a matrix (nv, nv) is not the sum of its parts (n, nv, nv)."""
    off = float(abs(matrix - parts.sum(axis=0)).max())
    if off <= _SUM * float(abs(parts).sum(axis=0).max()) or found.verdict == "DIFFERS":
        return found
    return replace(found, verdict="DIFFERS", reason=f"is not {what}, by {off:.2g} {found.unit}")
