"""Check K_θ by central finite differences at the same posture, in two ways.

First, K_θ is the Hessian of the potential, computed from lengths, poses and energies alone. This
check shares with Eq. 16 only the positions of cables and links. Second, K_θ is the derivative of
the residual torque J_Lᵀ F + g − J_Xᵀ W. This check is more precise, but uses J_L, g and J_X; these
are checked by first differences of the potential. A moment at the tip has no potential: then only
the torque checks the load term.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, NamedTuple, final

import numpy as np

from cdsm.errors import CdsmError, listed
from cdsm.report.differences import Estimates, Noise, Sampled, gradients, hessians
from cdsm.report.facts import torque_size
from cdsm.report.potential import Neighbourhood
from cdsm.support.values import Array, ReadOnlyState

if TYPE_CHECKING:
    from cdsm.stiffness_matrix import Stiffness

Verdict = Literal["agrees", "DIFFERS", "not possible"]

RESOLVED = 1e-6
"""A comparison proves something if its expected error is at most this part of the largest entry."""

_NEGLIGIBLE = 1e-8
"""For a small term it is enough if the error is at most this part of the largest entry of K_θ."""

_TERMS = ("active", "passive", "gravity", "load")

_UNITS = {"torque": "N m", "lengths": "m"}

_UNSETTLED = (
    "the differences do not settle: what they are taken of is not smooth, segments of cable are "
    "too short, or cables so stiff that they leave their law within the rounding of their length."
)

_NAMED = 3  # maximum number of cables listed in a reason

_SUM = 16.0 * float(np.finfo(np.float64).eps)
"""Rounding error of a sum, relative to the sum of the magnitudes of its terms."""


class _SecondValue(NamedTuple):
    """Second value of a term, mostly by finite differences, with its error bound.

    If the value is None, ``reason`` says why.
    """

    value: Array | None
    reason: str = ""
    error: float = 0.0


_NONE = _SecondValue(None)


@final
@dataclass(frozen=True, kw_only=True)
class Difference:
    """Difference between a matrix or vector and the same one computed in another way.

    Attributes:
        found: Largest magnitude of an entry of the difference, in the unit of the entries.
        expected: Bound of ``found`` if both are right: truncation of the central differences (none
            for the lengths of cables), and rounding.
    """

    found: float
    expected: float


@final
@dataclass(frozen=True, kw_only=True)
class Agreement:
    """Comparison of one term of K_θ, the torque residual or the cable lengths with a second value.

    Entries of prismatic joints are multiplied by the arm's length, so that all have one unit.

    Attributes:
        name: ``"active"``, ``"passive"``, ``"gravity"``, ``"load"``, ``"joint"`` (the sum of these
            four terms), ``"torque"`` (the residual of Eq. 13) or ``"lengths"`` of the cables.
        unit: ``"N m/rad"``; for the torque ``"N m"``, for the lengths ``"m"``.
        largest: Largest magnitude of an entry of the term; for the torque, of the torques that it
            sums; for the lengths, the longest one.
        potential: Comparison with finite differences of the potential; for the lengths, with
            distances between sites placed by Pinocchio. None if it is not possible.
        torque: Comparison with finite differences of the torque; None if it is not possible, and
            for the torque and the lengths.
        verdict: ``"DIFFERS"``: a difference is larger than expected, or a term is not the sum of
            its parts. ``"agrees"``: none is larger, and the expected error of a comparison is at
            most 1e-6 (:data:`RESOLVED`) of the largest entry, or 1e-8 of that of K_θ.
            ``"not possible"``: the expected errors of all comparisons are larger.
        reason: Why the check is not possible, or what differs; usually empty.
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
    """Comparison of K_θ and its four terms with central differences at the same posture.

    Attributes:
        terms: Active, passive, gravity and load term, and their sum.
        statics: The torque residual, compared with first finite differences of the potential.
        lengths: The cable lengths, compared with distances between sites placed by Pinocchio.
    """

    terms: tuple[Agreement, ...]
    statics: Agreement
    lengths: Agreement

    @property
    def passed(self) -> bool:
        """Return whether all comparisons were possible and agree."""
        return all(each.verdict == "agrees" for each in self.compared)

    @property
    def compared(self) -> tuple[Agreement, ...]:
        """Return all comparisons: of the terms, the torque residual and the lengths."""
        return (*self.terms, self.statics, self.lengths)

    def __repr__(self) -> str:
        agree = sum(each.verdict == "agrees" for each in self.compared)
        return f"<SelfCheck: {agree} of {len(self.compared)} comparisons agree>"

    def __str__(self) -> str:
        return "\n".join(
            f"{each.name:<8} {each.verdict}{f': {each.reason}' if each.reason else ''}"
            for each in self.compared
        )


def self_check(K: Stiffness) -> SelfCheck:
    """Compare K_θ, its terms and the residual torque (Eq. 13) with finite differences.

    K_θ is compared with second differences of the potential and with first differences of the
    torque. The residual is compared with first differences of the potential. Motors do not move,
    and the tensions need not balance the arm. A comparison that is not possible names the reason.
    """
    near = Neighbourhood(K)
    energies, torques = _recomputed_terms(near)
    if K.wrench[3:].any():
        energies[3] = _SecondValue(None, "a moment has no potential")

    scaled = near.unit[:, None] * near.unit
    given = np.array([getattr(K, name) for name in _TERMS]) * scaled
    joint = K.joint * scaled
    size = float(abs(joint).max())
    terms = [
        _compare(name, matrix, abs(matrix).max(), energy, torque, size)
        for name, matrix, energy, torque in zip(_TERMS, given, energies, torques, strict=True)
    ]
    whole = _compare("joint", joint, size, _summed(energies), _summed(torques), size)
    J, k = K.posture.length_jacobian, K.cable_stiffness[:, None, None]
    by_cable = k * J[:, :, None] * J[:, None, :] * scaled
    terms[1] = _with_sum_checked(terms[1], given[1], by_cable, "J_Lᵀ K_L J_L of its cables")
    terms.append(_with_sum_checked(whole, joint, given, "the sum of its four terms"))

    work = _differentiated(gradients, near, near.work, near.kinematic_noise, near.first_step)
    statics = _compare("torque", K.residual * near.unit, torque_size(K), _summed(work))

    # two programs compute places along the links, so the results differ by some more rounding
    measured = _SecondValue(near.measured_lengths(), error=16.0 * float(near.length_noise.max()))
    lengths = K.posture.cable_lengths
    same = _compare("lengths", lengths, float(lengths.max()), measured)
    return SelfCheck(terms=tuple(terms), statics=statics, lengths=same)


def _recomputed_terms(near: Neighbourhood) -> tuple[list[_SecondValue], list[_SecondValue]]:
    """Compute the terms as second differences of the potential and as first ones of the torque.

    Both lists have the order active, passive, gravity, load.
    """
    step = near.first_step
    moved = _differentiated(hessians, near, near.kinematic, near.kinematic_noise, step)
    turned = _differentiated(
        gradients, near, near.kinematic_torques, near.kinematic_torque_noise, step
    )
    if one_sided := [reason for cable in near.locked for reason in cable.one_sided()]:
        named = listed(one_sided, _NAMED, "; ")
        stored = stretched = [_SecondValue(None, f"K_θ has another value on either side: {named}.")]
    else:
        step = near.first_elastic_step
        stored = _differentiated(hessians, near, near.elastic, near.elastic_noise, step)
        stretched = _differentiated(
            gradients, near, near.elastic_torques, near.elastic_torque_noise, step
        )
    return [moved[0], stored[0], *moved[1:]], [turned[0], stretched[0], *turned[1:]]


def _differentiated(
    derive: Callable[[Sampled, int, float, Noise], Estimates],
    near: Neighbourhood,
    f: Sampled,
    noise: Noise,
    step: float,
) -> list[_SecondValue]:
    """Differentiate each part of the potential, or of the torque, by ``derive``.

    ``f``, a method of ``near``, computes the parts, ``noise`` their rounding errors; ``step`` is
    the largest step. If this fails, each result has the text of the error as its reason.
    """
    try:
        values, errors = derive(f, near.unit.size, step, noise)
    except CdsmError as error:
        return [_SecondValue(None, str(error))] * 3
    return [
        _SecondValue(value, error=float(error))
        if np.isfinite(error)
        else _SecondValue(None, _UNSETTLED)
        for value, error in zip(values, errors, strict=True)
    ]


def _summed(parts: list[_SecondValue]) -> _SecondValue:
    """Add values and error bounds of ``parts``; if one has no value, return its reason instead."""
    values = [each.value for each in parts if each.value is not None]
    if len(values) < len(parts):
        return _SecondValue(None, next(each.reason for each in parts if each.value is None))
    return _SecondValue(np.sum(values, axis=0), error=sum(each.error for each in parts))


def _compare(
    name: str,
    given: Array,
    largest: float,
    potential: _SecondValue,
    torque: _SecondValue = _NONE,
    whole: float = 0.0,
) -> Agreement:
    """Compare the term ``given`` with its second values, from the potential and from the torque.

    ``largest`` is the scale of the term, as in :class:`Agreement`; ``whole`` is the largest entry
    of K_θ.
    """
    unit = _UNITS.get(name, "N m/rad")
    enough = max(RESOLVED * largest, _NEGLIGIBLE * whole)
    differences = [
        Difference(found=float(abs(given - each.value).max()), expected=each.error)
        if each.value is not None
        else None
        for each in (potential, torque)
    ]
    known = [each for each in differences if each is not None]
    verdict: Verdict = "agrees"
    reason = ""
    if not np.isfinite(given).all() or any(each.found > each.expected for each in known):
        verdict = "DIFFERS"
        worst = max((each.found for each in known), default=np.nan)
        reason = f"is off by {worst:.2g} {unit}, with {largest:.4g} {unit} its largest entry"
    elif not any(each.expected <= enough for each in known):
        verdict = "not possible"
        # if the torque gives a value that is too coarse, a missing potential is not the reason
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


def _with_sum_checked(found: Agreement, matrix: Array, parts: Array, what: str) -> Agreement:
    """Change the verdict of ``found`` to DIFFERS if ``matrix`` is not the sum of ``parts``.

    ``what`` names this sum in the reason.
    """
    off = float(abs(matrix - parts.sum(axis=0)).max())
    if off <= _SUM * float(abs(parts).sum(axis=0).max()) or found.verdict == "DIFFERS":
        return found
    return replace(found, verdict="DIFFERS", reason=f"is not {what}, by {off:.2g} {found.unit}")
