"""What is right, wrong, refused or too close to call: answers against the truth.

A question that double precision cannot decide is one whose verdict hangs on rounding of its own
numbers: "too close to call", counted apart, within the bands below.
"""

from enum import Enum
from typing import NamedTuple

import numpy as np

from cdsm.support.values import Array
from tests.benchmarks.exact import Least, Motion, Wide, least_tension, smallest_eigenvalue, solve
from tests.benchmarks.questions import Group

MATRIX = 1e-9
"""K_θ and its margin, over the largest entry of the sum of its parts' magnitudes; tensions beyond a
bound or out of balance, over the largest tension: allowed."""

VALUE = 1e-6
"""Compliance, Cartesian stiffness, distance from the least tensions, over the largest: allowed."""

SIGN = 1e-13
"""The smallest eigenvalue of K_θ, likewise: nearer to zero rounding decides its sign."""

EDGE = 1e-8
"""Torque missing, dimensionless, below which the tolerance of balance decides what exists."""

FLAT = 1e-6
"""Least over largest motion of the tip per joint motion for which C_vv has an inverse."""

AXES = np.eye(3)


class Outcome(Enum):
    """What became of a question."""

    RIGHT = "right"
    """An answer, or a named error or status where there is none."""
    REFUSED = "refused"
    """A named error or status, in whole or in part, where there is an answer."""
    CLOSE = "too close to call"
    WRONG = "wrong, not flagged"


class Verdict(NamedTuple):
    """Outcome, the worst error relative to what is allowed, and of what."""

    outcome: Outcome
    error: float = 0.0
    what: str = ""


RIGHT, REFUSED = Verdict(Outcome.RIGHT), Verdict(Outcome.REFUSED)


class Pull(NamedTuple):
    """An answer to a question of tensions: F (C,); or None, and whether none are said to exist."""

    values: Array | None
    infeasible: bool = False


class Reading(NamedTuple):
    """An answer to a question of stiffness; None where it was refused or is not given."""

    joint: Array | None = None
    stable: bool | None = None
    margin: float | None = None
    along: Array | None = None
    compliance: Array | None = None
    cartesian: Array | None = None
    flagged: bool = False


class Truth(NamedTuple):
    """The stiffness of a question, the size of what K_θ is a sum of, and if C_vv has no inverse."""

    joint: Wide
    size: float
    margin: np.longdouble
    compliance: Wide
    flat: bool


def true_stiffness(group: Group, motion: Motion, row: int) -> Truth | None:
    assert group.tension is not None
    law = group.arm.cables[0].elasticity
    F = group.tension[row]
    if not all(law.low <= float(f) <= law.high for f in F):
        return None
    parts = motion.parts(F, group.springs(motion.lengths, F), group.wrench[row])
    K, size = parts.sum(axis=0), float(abs(parts).sum(axis=0).max())
    C = motion.jacobian @ solve(K, motion.jacobian.T)
    values = np.linalg.svd(motion.jacobian[:3].astype(np.float64), compute_uv=False)
    flat = values.size < 3 or bool(values[2] <= 1.001 * FLAT * values[0])
    return Truth(K, size, smallest_eigenvalue(K), C, flat)


def true_tension(group: Group, motion: Motion, row: int) -> tuple[Least, float]:
    """The least tensions, and what they are measured in [N]; infinite bounds stay so."""
    assert group.low is not None
    assert group.high is not None
    A, b = motion.slopes.T, motion.jacobian.T @ group.wrench[row] - motion.torque
    arm = abs(A).max()
    force = max(float(group.low[row].max()), float(abs(b).max() / arm)) or 1.0
    low, high = (np.asarray(x[row] / np.longdouble(force)) for x in (group.low, group.high))
    return least_tension(A / arm, b / (arm * force), low, high), force


def judge_tension(
    group: Group, motion: Motion, row: int, least: Least, force: float, pull: Pull
) -> Verdict:
    assert group.low is not None
    assert group.high is not None
    low, high = group.low[row], group.high[row]
    if least.values is None and least.missing <= EDGE:
        return Verdict(Outcome.CLOSE)
    if pull.values is None:
        if pull.infeasible and least.values is not None:
            return Verdict(Outcome.WRONG, np.inf, "feasible called infeasible")
        return RIGHT if least.values is None else REFUSED
    F = pull.values
    size = max(float(F.max(initial=0.0)), force)
    A, b = motion.slopes.T, motion.jacobian.T @ group.wrench[row] - motion.torque
    beyond = max(float((low - F).max()), float((F - high).max()), 0.0) / size
    missing = float(abs(A @ F - b).max() / abs(A).max()) / size
    if least.values is None:
        return Verdict(Outcome.WRONG, max(beyond, missing), "infeasible called feasible")
    errors = {
        "a bound is crossed": beyond / MATRIX,
        "out of balance": missing / MATRIX,
        "not the least": float(abs(F - least.values * force).max()) / size / VALUE,
    }
    return _worst(errors)


def judge_stiffness(truth: Truth | None, reading: Reading) -> Verdict:
    if truth is None:
        if reading.joint is None:
            return RIGHT
        return Verdict(Outcome.WRONG, np.inf, "outside the domain")
    errors: dict[str, float] = {}
    size = truth.size
    close = bool(abs(truth.margin) <= SIGN * size)
    if reading.joint is not None:
        errors["K_θ"] = float(abs(reading.joint - truth.joint).max()) / size / MATRIX
    if reading.margin is not None:
        errors["margin"] = abs(float(reading.margin - truth.margin)) / size / MATRIX
    if reading.stable is not None and reading.stable != bool(truth.margin > 0) and not close:
        errors["stable" if reading.stable else "unstable"] = np.inf
    C = truth.compliance
    if reading.compliance is not None:
        errors["compliance"] = _relative(reading.compliance, C) / VALUE
    if reading.along is not None:
        for i in range(3):
            # infinite is right where the tip moves less than rounding of its other motions
            if np.isinf(reading.along[i]):
                errors[f"along {i}"] = float(abs(C[i, i]) / abs(C[:3, :3]).max()) / 1e-18
            else:
                errors[f"along {i}"] = float(abs(reading.along[i] * C[i, i] - 1)) / VALUE
    if reading.cartesian is not None:
        errors["cartesian"] = (
            _relative(reading.cartesian, solve(C[:3, :3], np.eye(3, dtype=np.longdouble))) / VALUE
        )
    verdict = _worst(errors)
    if verdict.outcome is Outcome.RIGHT and close:
        return Verdict(Outcome.CLOSE)
    if verdict.outcome is Outcome.RIGHT and reading.flagged:
        missing = reading.compliance is None or not truth.flat
        return REFUSED if missing else RIGHT
    return verdict


def _relative(given: Array, true: Wide) -> float:
    return float(abs(given - true).max() / abs(true).max())


def _worst(errors: dict[str, float]) -> Verdict:
    if not errors:
        return RIGHT
    what = max(errors, key=lambda each: errors[each] if np.isfinite(errors[each]) else 1e300)
    wrong = not errors[what] <= 1.0  # NaN is wrong
    return Verdict(Outcome.WRONG if wrong else Outcome.RIGHT, errors[what], what if wrong else "")
