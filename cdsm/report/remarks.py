"""Write remarks on a stiffness: faults say why not to trust it, notes say how to read it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from cdsm.errors import listed
from cdsm.geometry import doubts_about_units
from cdsm.stiffness_matrix.prints import missing_leads

if TYPE_CHECKING:
    from cdsm.report.report import Report
    from cdsm.support.values import Array

BALANCED = 1e-6
"""Tensions balance an arm if the residual is at most this fraction of the torque size."""

APART = 0.1
"""A note is given if the three tip stiffnesses along an axis differ by more than this fraction."""

CLOSE = 0.05
"""A note is given if a tension F is nearer to an end of its law's domain than this times F."""

_SINGULAR = 1e-12  # an eigenvalue of at most this part of the norm of K_θ is rounding
_DIGITS = 1e10  # condition number of K_θ above which K_θ⁻¹ has less than six digits

_LABELS = {"joint": "sum K_θ", "torque": "torque out of balance", "lengths": "length of a cable"}


def faults(report: Report) -> Iterator[str]:
    """Yield the reasons not to trust the stiffness of ``report``; none if it can be trusted."""
    K = report.stiffness
    unchecked: dict[str, list[str]] = {}
    for each in report.self_check.compared:
        label = _LABELS.get(each.name, f"{each.name} term")
        if each.verdict == "DIFFERS":
            yield f"self-check: {label} {each.reason}. Do not use this stiffness."
        elif each.verdict == "not possible":
            unchecked.setdefault(each.reason, []).append(label)
    for reason, labels in unchecked.items():
        yield f"self-check not possible of the {' and '.join(labels)}: {reason}"
    if report.imbalance > BALANCED:
        yield (
            f"the tensions do not balance the arm: the residual is {report.residual:.3g} N m "
            f"at {report.residual_joint}, {report.imbalance:.1e} of the torques ({BALANCED:g} is "
            "allowed). K_θ is right only if another load balances the arm here; distribute_tension "
            "finds tensions that do."
        )
    arm = K.posture.arm
    if not K.is_stable:
        what, how, *remedies = K.warnings
        yield f"{what}; {how} {'; '.join(map(str.strip, remedies))}".rstrip()
    elif K.margin <= _SINGULAR * np.linalg.norm(K.joint, 2):
        yield (
            f"the arm is about to buckle: the smallest eigenvalue of K_θ, {K.margin:.2g} "
            f"{arm.stiffness_unit()}, is rounding."
        )
    found = report.optimality
    if found is not None and not found.optimal:
        least = found.stationarity
        yield (
            f"the tensions of {found.solver} are not optimal: bounds and balance are "
            f"violated by {found.feasibility:.1e}"
            + ("." if least is None else f", stationarity by {least:.1e}.")
        )


def notes(report: Report) -> Iterator[str]:
    """Yield notes for a user of the stiffness of ``report``; they do not mean that it is wrong."""
    yield from doubts_about_units(report.stiffness.posture.arm.length)
    yield from report.stiffness.posture.remarks
    yield from _of_tensions(report)
    yield from _of_ranks(report)
    if report.readings is None:
        yield "K_θ is singular: there is no stiffness at the tip."
        return
    spread = report.readings.spread
    apart = [axis for axis, ratio in zip("xyz", spread, strict=True) if ratio > 1.0 + APART]
    if apart:
        yield (
            f"along, cartesian and pseudoinverse differ in {', '.join(apart)}, by up to "
            f"{spread.max():.3g} times: use along, which is what a small weight measures; "
            "cartesian locks the other two translations, pseudoinverse is the paper's reading."
        )


def _of_tensions(report: Report) -> Iterator[str]:
    K = report.stiffness
    if K.posture.arm.has_friction:
        said = "the cables have friction, and this K is frictionless, as after shaking the arm"
        if report.sticking is None or report.readings is None:
            yield f"{said}. Here no cable is known to stick."
        else:
            below = ", ".join(f"{load:.2g}" for load in report.sticking.below)
            stuck, free = (
                _numbers(each / 1000.0) for each in (report.sticking.along, report.readings.along)
            )
            yield (
                f"{said}. Below about {below} N along x, y, z (exactly: cdsm.breakaway) the cables "
                f"stick, and a load measures {stuck} N/mm, not {free} N/mm: hang more, or shake "
                "the arm."
            )
    if report.optimality is None:
        came = "were given" if K.free_length is None else "follow from an equilibrium"
        yield f"the tensions {came}, not distributed: they need not be the least."
    elif report.optimality.stationarity is None:
        yield "the tensions were chosen for a stiffness: they are not the least."
    locked = [each for each in report.cables if each.control == "position"]
    taut = [each for each in locked if not each.is_slack]
    if slack := [each.name for each in locked if each.is_slack]:
        yield f"slack cables, 0 N: {listed(slack)}. They stiffen one direction; raise minimum=."
    if forced := [each.name for each in report.cables if each.control == "force"]:
        yield f"force-controlled, no passive stiffness: {listed(forced)}."
    low = [each.name for each in taut if each.below <= CLOSE * each.tension]
    high = [each.name for each in taut if each.above <= CLOSE * each.tension]
    for names, end in ((low, "low"), (high, "high")):
        if names:
            yield (
                f"within {100.0 * CLOSE:g} % of the {end} end of their law: {listed(names)}. "
                "The law is not defined beyond it."
            )
    yield from missing_leads(K)
    if K.wrench[3:].any():
        yield (
            "a moment at the tip has no potential: K_θ is not symmetric, stability is judged on "
            "its symmetric part, and the load term is checked by the torque alone."
        )


def _of_ranks(report: Report) -> Iterator[str]:
    cables, tip, jacobian = report.cable_rank, report.translation_rank, report.jacobian_rank
    nv = report.stiffness.posture.arm.nv
    if cables.rank < nv:
        yield f"the cables give {cables.rank} of {nv} joint torques: they cannot balance all."
    elif report.closure == 0.0:
        yield "the cables cannot all be pretensioned without a joint torque."
    if tip.rank < 3:
        yield (
            f"the joints move the tip in {tip.rank} of 3 directions here: in the others it is "
            "rigid, and neither cartesian nor pseudoinverse exists."
        )
    if jacobian.rank < jacobian.full:
        yield f"J_X has rank {jacobian.rank} here, not {jacobian.full}."
    if report.condition > _DIGITS:
        yield f"K_θ has the condition number {report.condition:.1g}: the compliance loses digits."


def _numbers(values: Array) -> str:
    return ", ".join(f"{value:.4g}" for value in values)
