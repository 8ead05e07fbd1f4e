"""Remarks on a stiffness: faults, which forbid to trust it, and notes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cdsm.report.report import Report

BALANCED = 1e-6
"""Tensions balance an arm if the residual is at most this part of the torque size."""

APART = 0.1
"""A note is given if the three tip stiffnesses differ by more than this part."""

CLOSE = 0.05
"""A note is given if a tension is nearer than this part of itself to an end of its law."""

_SINGULAR = 1e-12
"""A margin of at most this part of the norm of K_θ is rounding."""

_DIGITS = 1e10
"""Condition number of K_θ above which K_θ⁻¹ has less than six digits."""

_LONGEST = 30.0
"""The lengths of an arm longer than this [m] are probably in millimetres."""

_NAMED = 4


def faults(report: Report) -> tuple[str, ...]:
    """Return the reasons not to trust the stiffness; empty if it can be trusted."""
    K, texts = report.stiffness, []
    unchecked: dict[str, list[str]] = {}
    for each in report.self_check.compared:
        if each.verdict == "DIFFERS":
            texts.append(
                f"self-check: {_label(each.name)} {each.reason}. Do not use this stiffness."
            )
        elif each.verdict == "not possible":
            unchecked.setdefault(each.reason, []).append(_label(each.name))
    texts += [
        f"self-check not possible of the {' and '.join(names)}: {reason}"
        for reason, names in unchecked.items()
    ]
    if report.imbalance > BALANCED:
        texts.append(
            f"the tensions do not balance the arm: {report.residual:.3g} N m are left, most at "
            f"{report.residual_joint}, {report.imbalance:.1e} of the torques ({BALANCED:g} is "
            "allowed). K_θ is that of an arm held here by something else; distribute_tension "
            "balances it."
        )
    spectrum, unit = np.linalg.norm(K.joint, 2), K.posture.arm.stiffness_unit()
    if not K.is_stable:
        texts.append(
            f"the arm is UNSTABLE: the smallest eigenvalue of K_θ is {K.margin:.4g} {unit}, "
            f"moving {_motion(report)}. It buckles; change tensions, posture or load."
        )
    elif K.margin <= _SINGULAR * spectrum:
        texts.append(
            f"the arm is about to buckle: the smallest eigenvalue of K_θ, {K.margin:.2g} {unit}, "
            "is rounding."
        )
    found = report.optimality
    if found is not None and not found.optimal:
        least = found.stationarity
        texts.append(
            f"the tensions are not what {found.solver} was asked for: bounds and balance are "
            f"missed by {found.feasibility:.1e}"
            + ("." if least is None else f", stationarity by {least:.1e}.")
        )
    return tuple(texts)


def notes(report: Report) -> tuple[str, ...]:
    """Return notes for a user of the stiffness; they do not mean that it is wrong."""
    return (*_of_size(report), *_of_tensions(report), *_of_ranks(report), *_of_readings(report))


def _of_size(report: Report) -> list[str]:
    length = report.stiffness.posture.arm.length
    if length <= _LONGEST:
        return []
    return [f"the arm is {length:.4g} m long: it looks as if its lengths are in mm; give metres."]


def _of_tensions(report: Report) -> list[str]:
    K, texts = report.stiffness, []
    if report.optimality is None:
        came = "were given" if K.free_length is None else "follow from an equilibrium"
        texts.append(f"the tensions {came}, not distributed: nothing says they are the least.")
    elif report.optimality.stationarity is None:
        texts.append("the tensions were chosen for a stiffness: they are not the least.")
    held = [each for each in report.cables if each.control == "position"]
    slack = [each.name for each in held if each.is_slack]
    if slack:
        texts.append(
            f"slack cables, 0 N: {_listed(slack)}. They stiffen one way only; raise minimum=."
        )
    forced = [each.name for each in report.cables if each.control == "force"]
    if forced:
        texts.append(f"force-controlled, no passive stiffness: {_listed(forced)}.")
    pulled = [each for each in held if not each.is_slack]
    low = [each.name for each in pulled if each.below <= CLOSE * each.tension]
    high = [each.name for each in pulled if each.above <= CLOSE * each.tension]
    for names, end in ((low, "low"), (high, "high")):
        if names:
            texts.append(
                f"within {100.0 * CLOSE:g} % of the {end} end of their law: {_listed(names)}. "
                "Beyond it nothing is known."
            )
    pairs = zip(K.posture.arm.cables, K.free_lengths, strict=True)
    lost = [cable.name for cable, l0 in pairs if l0 <= 0.0]
    if lost:
        texts.append(
            f"the series spring stretches by more than the whole cable is long: {_listed(lost)}. "
            "Give a lead that holds the spring; until then K is off by up to F/EA."
        )
    if K.wrench[3:].any():
        texts.append(
            "a moment at the tip has no potential: K_θ is not symmetric, stability is judged on "
            "its symmetric part, and the load term is checked by the torque alone."
        )
    return texts


def _of_ranks(report: Report) -> list[str]:
    texts = []
    cables, tip, jacobian = report.cable_rank, report.translation_rank, report.jacobian_rank
    nv = report.stiffness.posture.arm.nv
    if cables.rank < nv:
        texts.append(f"the cables give {cables.rank} of {nv} joint torques: they do not hold all.")
    elif report.closure == 0.0:
        texts.append("not all tensions can grow together without a torque: no pretension at will.")
    if tip.rank < 3:
        texts.append(
            f"the joints move the tip in {tip.rank} of 3 directions here: in the others it is "
            "rigid, and neither cartesian nor pseudoinverse exists."
        )
    if jacobian.rank < min(6, nv):
        texts.append(f"J_X has rank {jacobian.rank} here, not {min(6, nv)}.")
    if report.condition > _DIGITS:
        texts.append(f"K_θ has the condition {report.condition:.1g}: the compliance loses digits.")
    return texts


def _of_readings(report: Report) -> list[str]:
    if report.readings is None:
        return ["K_θ is singular: there is no stiffness at the tip."]
    spread = report.readings.spread
    apart = [axis for axis, ratio in zip("xyz", spread, strict=True) if ratio > 1.0 + APART]
    if not apart:
        return []
    return [
        f"along, cartesian and pseudoinverse differ in {', '.join(apart)}, by up to "
        f"{spread.max():.3g} times: use along, which is what a small weight measures; cartesian "
        "holds the other two translations, pseudoinverse is the paper's reading."
    ]


def _motion(report: Report) -> str:
    way = report.critical_direction
    i = int(abs(way).argmax())
    return f"{report.stiffness.posture.arm.joint_names[i]} most ({abs(way[i]):.2f} of 1)"


def _label(name: str) -> str:
    return {
        "joint": "sum K_θ",
        "torque": "torque out of balance",
        "lengths": "length of a cable",
    }.get(name, f"{name} term")


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _NAMED
    return ", ".join(names[:_NAMED]) + (f" and {more} more" if more > 0 else "")
