"""Compute the report on a stiffness: is it right, balanced and stable, and how to read it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cdsm.applied import all_loads
from cdsm.errors import CdsmError, SingularStiffness, listed
from cdsm.friction.stick import breakaway
from cdsm.report import checks
from cdsm.report.remedies import find_remedies
from cdsm.status import Status
from cdsm.stiffness_matrix import Report, Stiffness
from cdsm.stiffness_matrix.verdict import TOLERANCE, describe_buckling


def report_on(K: Stiffness) -> Report:
    """Compute the report on a stiffness."""
    scale = K.posture.arm.levers
    condition = float(np.linalg.cond(K.joint * scale[:, None] * scale))
    balance = checks.balance_error(K)
    optimality = checks.optimality(K)
    remedies = () if K.is_stable else tuple(find_remedies(K))
    measured = Report(K, checks.compared(K), *balance, *optimality, condition, remedies)
    return replace(
        measured,
        faults=tuple(_faults(measured)),
        unchecked=tuple(_unchecked(measured)),
        notes=tuple(_notes(measured)),
    )


def _faults(report: Report) -> Iterator[str]:
    """Yield the reasons not to use the stiffness of ``report``."""
    K = report.stiffness
    for comparison in report.comparisons:
        if comparison.verdict == "DIFFERS":
            yield (
                f"{comparison.name}: off by {comparison.off:.2g} {comparison.unit}, where the "
                f"largest entry is {comparison.largest:.4g} {comparison.unit}. Do not use this "
                "stiffness."
            )
    if report.imbalance > TOLERANCE:
        yield (
            "the tensions do not balance the arm: the residual is "
            f"{report.largest_residual:.3g} N m at {report.residual_joint}, "
            f"{report.imbalance:.1e} of the torques; distribute_tension finds tensions that do."
        )
    if not K.is_stable:
        yield ". ".join([describe_buckling(K), *map(str, report.remedies)])
    elif report.condition > 1e12:  # singular but for rounding
        yield f"the arm is about to buckle: K_θ has the condition number {report.condition:.2g}."
    for finding in K.verdict.findings:
        if finding.status in (Status.UNSTABLE_TO_ONE_SIDE, Status.ABOVE_MAXIMUM):
            yield f"{finding.sentence}."
    violation = report.bound_violation or 0.0
    kkt = report.kkt_residual or 0.0
    if max(violation, kkt) > TOLERANCE:
        yield f"the tensions are not optimal: bounds violated by {violation:.1e}, KKT {kkt:.1e}."


def _unchecked(report: Report) -> Iterator[str]:
    """Yield what finite differences cannot decide, and why."""
    checks_of_k = [check for check in report.comparisons if check.name != "batch"]
    for reason in dict.fromkeys(check.reason for check in checks_of_k if check.reason):
        names = [check.name for check in checks_of_k if check.reason == reason]
        yield f"check not possible for {' and '.join(names)}: {reason}."


def _notes(report: Report) -> Iterator[str]:
    """Yield what a user of the stiffness should know; none of it means that it is wrong."""
    K = report.stiffness
    pose = report.stiffness.posture
    arm = report.stiffness.posture.arm
    yield from pose.remarks
    if report.bound_violation is None:
        came = "were given" if K.free_length is None else "follow from an equilibrium"
        yield f"the tensions {came}, not distributed: they need not be the least."
    elif report.kkt_residual is None:
        yield "the tensions were chosen for a stiffness: they are not the least."
    if arm.has_friction:
        yield f"the cables have friction; this K is frictionless, as after shaking. {_stuck(K)}"
    if reason := next(check.reason for check in report.comparisons if check.name == "batch"):
        yield f"not compared with cdsm.evaluate: {reason}."
    if any(load.wrench[3:].any() for load in all_loads(arm, K.applied).loads):
        yield "with a moment K_θ is not symmetric: its symmetric part decides stability."
    yield from _of_limits(K)
    unit = K.posture.arm.levers
    for matrix, full, what in (
        (pose.length_jacobian, arm.nv, "the cables give {} of {} joint torques."),
        (pose.jacobian[:3], 3, "the tip moves in {} of {} directions; in the others it is rigid."),
    ):
        if (rank := np.linalg.matrix_rank(matrix * unit, rtol=1e-9)) < full:
            yield what.format(rank, full)
    try:
        along = [K.along(axis) for axis in np.eye(3)]
        apart = np.diag(K.pseudoinverse()) / along, np.diag(K.cartesian) / along
    except SingularStiffness:
        return
    if (abs(np.array(apart) - 1.0) > 0.1).any():
        yield (
            "along, cartesian and pseudoinverse differ: use along, which a small weight measures; "
            "cartesian locks the other two translations, pseudoinverse is the paper's reading."
        )


def _of_limits(K: Stiffness) -> Iterator[str]:
    """Yield which cables are slack, hold a force, or are near an end of their law; joints alike."""
    arm = K.posture.arm
    q = K.posture.q
    F = K.tension
    low = arm.laws.low
    high = arm.laws.high
    locked = arm.cables.position_controlled
    slack = F == 0.0
    cables = arm.cables.names
    near = np.minimum(q - arm.lower, arm.upper - q) < 0.01 * (arm.upper - arm.lower)
    for what, names, chosen in (
        ("slack, 0 N; they stiffen one direction, raise minimum", cables, locked & slack),
        ("force-controlled, no passive stiffness", cables, ~locked),
        ("within 5 % of the low end of their law", cables, locked & ~slack & (low >= 0.95 * F)),
        ("within 5 % of the high end of their law", cables, locked & (high <= 1.05 * F)),
        ("within 1 % of their range from a joint limit", arm.joint_names, near),
    ):
        if chosen.any():
            yield f"{what}: {listed(np.array(names)[chosen].tolist())}."


def _stuck(K: Stiffness) -> str:
    """Return below which load friction holds all cables, and the stiffness there."""
    try:
        thresholds = [(axis, breakaway(K.posture, K.tension, axis, K.applied)) for axis in "xyz"]
        stuck = ", ".join(
            f"{threshold.stiffness.along(u) / 1e3:.4g}" for u, threshold in thresholds
        )
    except CdsmError as error:  # the stuck arm is singular, or a tension outside its law
        return f"The load below which they stick is not known: {error}"
    if not any(threshold.load for _, threshold in thresholds):
        return "Here no cable sticks."
    loads = ", ".join(f"{threshold.load:.2g}" for _, threshold in thresholds)
    return f"Below {loads} N along x, y, z they stick, and a load measures {stuck} N/mm."
