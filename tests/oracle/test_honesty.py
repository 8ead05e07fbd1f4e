"""No wrong answer without a flag, where answers go wrong: near singular, infeasible, buckling.

"Near" is a factor of 10 to the power of something uniform, so that every order of magnitude is met,
the last digits included. Every answer is judged against :mod:`tests.oracle.exact`. "Too close" is
what double precision cannot decide, because rounding of the question itself does.
"""

import math
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest
import qpsolvers
import scipy.linalg
from scipy.optimize import linprog

import cdsm
from cdsm.support.values import Array
from tests.oracle.exact import (
    EXTENDED,
    ExactArm,
    Least,
    Motion,
    Wide,
    least_tension,
    smallest_eigenvalue,
    solve,
    wide,
)
from tests.support import arms
from tests.support.differences import assert_second_order

pytestmark = pytest.mark.skipif(not EXTENDED, reason="long double is no longer than double here")

Random = np.random.Generator
ROWS = 10
"""Questions about one arm."""
MATRIX, VALUE = 1e-9, 1e-6
"""Allowed, relative: of K_θ, its margin, bounds, balance; of compliance and the least tensions."""
SIGN, EDGE = 1e-13, 1e-8
"""Smallest eigenvalue and missing torque, relative, nearer to zero than which nothing is asked."""
FLAT = 1e-6
"""Least over largest motion of the tip for which C_vv has an inverse."""


class Group(NamedTuple):
    """Questions about one arm: the stiffness of ``tension``, or the least of tensions in bounds."""

    arm: cdsm.Manipulator
    q: Array
    wrench: Array
    tension: Array | None = None
    low: Array = np.zeros(0)
    high: Array = np.zeros(0)


# --- questions ------------------------------------------------------------------------------


def near(rng: Random, digits: float) -> float:
    return float(rng.choice([-1.0, 1.0]) * 10.0 ** -rng.uniform(0.0, digits))


PULLED = 3000.0
"""Tension [N] up to which the series springs of drawn arms leave wire."""


def drawn(rng: Random, spring: float = np.inf) -> cdsm.Manipulator:
    h = rng.uniform(0.006, 0.012)
    sizes: dict[str, Any] = {
        "link_length": rng.uniform(0.03, 0.08),
        "base_length": rng.uniform(0.0, 0.05),
        "disk_offset": h,
        "hole_radius": h * rng.uniform(1.5, 4.0),
        "link_mass": rng.choice([0.0, rng.uniform(0.02, 0.5)]),
        "lead": rng.uniform(0.0, 0.5) + PULLED / spring,  # a spring leaves wire
    }
    if rng.random() < 0.6:
        sizes["cables_per_joint"] = int(rng.integers(3, 5))
        geometry = cdsm.Geometry.universal(joints=int(rng.integers(1, 4)), **sizes)
    else:
        twist = rng.choice([0.0, near(rng, 11.0), rng.uniform(-1.5, 1.5)])
        geometry = cdsm.Geometry.hinged(joints=int(rng.integers(1, 6)), twist=twist, **sizes)
    law = cdsm.LinearElasticity(10.0 ** rng.uniform(3.5, 5.5))
    cables = cdsm.serpentine_cables(geometry, law, series_stiffness=spring)
    return cdsm.Manipulator(geometry, cables=cables, gravity=rng.normal(0.0, 6.0, 3))


def asked(rng: Random, arm: cdsm.Manipulator) -> tuple[Array, Array, Array]:
    """Postures, loads and tensions, a row for each question."""
    loads = rng.normal(0.0, 3.0, (ROWS, 6)) * np.repeat([1.0, 0.1], 3)
    loads[rng.random(ROWS) < 0.3, 3:] = 0.0
    q = rng.uniform(-0.6, 0.6, (ROWS, arm.nv)) * arm.upper
    return q, loads, rng.uniform(20.0, 120.0, (ROWS, len(arm.cables)))


def singular_posture(rng: Random) -> Group:
    """Arms nearly straight, nearly in a plane, or with joints that nearly agree."""
    arm = drawn(rng)
    q, wrench, tension = asked(rng, arm)
    for row in q:
        kind = rng.integers(3)
        if kind == 0:
            row *= near(rng, 16.0)
        elif kind == 1:
            row[int(rng.integers(2)) :: 2] *= near(rng, 16.0) * rng.integers(2)
        else:
            row[:] = row[0] * (1.0 + near(rng, 16.0) * rng.normal(size=arm.nv) * 0.1)
    return Group(arm, q, wrench, tension)


def edge_of_buckling(rng: Random) -> Group:
    """Soft springs, and tensions or a load just below and just above where K_θ is singular."""
    arm = drawn(rng, spring=10.0 ** rng.uniform(2.0, 4.0))
    q, wrench, tension = asked(rng, arm)
    for r in range(ROWS):
        motion = ExactArm(arm.geometry, arm.gravity).at(q[r])
        springs = spring_constants(arm, motion, tension[r])
        parts = motion.parts(tension[r], springs, wrench[r]).astype(np.float64)
        parts = (parts + parts.transpose(0, 2, 1)) / 2.0
        grows = 0 if rng.random() < 0.6 else 3
        factors = scipy.linalg.eigvals(parts.sum(axis=0) - parts[grows], -parts[grows])
        real = np.real(factors[abs(np.imag(factors)) < 1e-9 * abs(factors)])
        real = real[(real > 0.0) & (real < 1e6)]
        if real.size:
            row = tension if grows == 0 else wrench
            edge = row[r] * real.min() * (1.0 + near(rng, 11.0) * 0.1)
            if grows or edge.max() < PULLED:
                row[r] = edge
    return Group(arm, q, wrench, tension)


def singular_actuation(rng: Random) -> Group:
    """Cables that nearly lie in a plane with the axis: one motion of a joint is hardly held."""
    arm = drawn(rng)
    angle, spread = rng.uniform(0.0, 2.0 * math.pi), near(rng, 5.0)
    routes = [
        replace(route, angle=angle + math.pi * (c % 2) + spread * rng.uniform(-1.0, 1.0))
        for c, route in enumerate(arm.geometry.cables)
    ]
    geometry = replace(arm.geometry, cables=tuple(routes))
    arm = cdsm.Manipulator(geometry, arms.STEEL, gravity=arm.gravity)
    q, wrench, tension = asked(rng, arm)
    low = np.full_like(tension, rng.choice([0.0, 20.0]))
    high = low + np.where(rng.random((ROWS, 1)) < 0.5, np.inf, 10.0 ** rng.uniform(2.0, 6.0))
    return Group(arm, q, wrench * 10.0 ** rng.uniform(-6.0, 0.0, (ROWS, 1)), None, low, high)


def edge_of_feasibility(rng: Random) -> Group:
    """Loads just within and just beyond what some tensions balance."""
    arm = drawn(rng)
    q, wrench, tension = asked(rng, arm)
    q *= 0.7
    low = np.zeros_like(tension) + rng.uniform(0.0, 50.0, (ROWS, 1))
    high = low + 10.0 ** rng.uniform(0.5, 2.5, low.shape)
    for r in range(ROWS):
        pose = arm.at(q[r])
        J, load = pose.length_jacobian, pose.jacobian.T @ wrench[r]
        found = linprog(
            np.append(np.zeros(len(J)), -1.0),
            A_eq=np.column_stack([J.T, -load]) / abs(J).max(),
            b_eq=-pose.gravity_torque / abs(J).max(),
            bounds=[*zip(low[r], high[r], strict=True), (0.0, None)],
        )
        if found.status == 0:
            wrench[r] *= found.x[-1] * (1.0 + near(rng, 8.0) * 0.1)
    return Group(arm, q, wrench, None, low, high)


# --- the judge: an error over what is allowed, or None where there is nothing to judge -------

Verdict = tuple[str, str]


def spring_constants(arm: cdsm.Manipulator, motion: Motion, tension: Array) -> Wide:
    """k (C,) = 1/(l_0/EA + 1/k_s), l_0 the original length of a linear wire."""
    EA = wide(arm.cables[0].elasticity.rigidity(1.0))
    soft, F = 1 / wide(arm.cables[0].series_stiffness), wide(tension)
    return wide(1 / ((motion.lengths - F * soft) / (1 + F / EA) / EA + soft))


def worst(errors: dict[str, float]) -> Verdict:
    for what, error in errors.items():
        if not error <= 1.0:  # NaN is wrong
            return "wrong", what
    return "right", ""


def judge_tension(
    motion: Motion, wrench: Array, low: Array, high: Array, F: Array | None, refused: bool
) -> Verdict:
    """``refused``: none are said to exist."""
    A, b = motion.slopes.T, motion.jacobian.T @ wrench - motion.torque
    lever = abs(A).max()
    force = max(float(low.max()), float(abs(b).max() / lever)) or 1.0
    bounds = (wide(x / np.longdouble(force)) for x in (low, high))
    least: Least = least_tension(A / lever, b / (lever * force), *bounds)
    if least.values is None and least.missing <= EDGE:
        return "close", ""
    if F is None:
        if least.values is None:
            return "right", ""
        return ("wrong", "feasible") if refused else ("refused", "")
    if least.values is None:
        return "wrong", "infeasible"
    size = max(float(F.max()), force)
    return worst(
        {
            "bound": max(float((low - F).max()), float((F - high).max())) / size / MATRIX,
            "balance": float(abs(A @ F - b).max() / lever) / size / MATRIX,
            "least": float(abs(F - least.values * force).max()) / size / VALUE,
        }
    )


def judge_stiffness(
    arm: cdsm.Manipulator, motion: Motion, tension: Array, wrench: Array, said: dict[str, Any]
) -> Verdict:
    """``said``: quantities by name, those that were refused left out."""
    parts = motion.parts(tension, spring_constants(arm, motion, tension), wrench)
    K, size = parts.sum(axis=0), float(abs(parts).sum(axis=0).max())
    margin, C = smallest_eigenvalue(K), motion.jacobian @ solve(K, motion.jacobian.T)
    close = bool(abs(margin) <= SIGN * size)
    values = np.linalg.svd(motion.jacobian[:3].astype(np.float64), compute_uv=False)
    flat = values.size < 3 or bool(values[2] <= 1.001 * FLAT * values[0])
    errors = {}
    if "joint" in said:
        errors["joint"] = float(abs(said["joint"] - K).max()) / size / MATRIX
        errors["margin"] = abs(float(said["margin"] - margin)) / size / MATRIX
        errors["sign"] = 0.0 if close or (said["margin"] > 0.0) == (margin > 0) else np.inf
    if "compliance" in said:
        errors["compliance"] = float(abs(said["compliance"] - C).max() / abs(C).max()) / VALUE
    for i, along in enumerate(said.get("along", ())):
        # infinite is right where the tip moves less than rounding of its other motions
        unmoved = float(abs(C[i, i]) / abs(C[:3, :3]).max()) / 1e-18
        errors[f"along {i}"] = (
            unmoved if np.isinf(along) else float(abs(along * C[i, i] - 1)) / VALUE
        )
    if "cartesian" in said:
        true = solve(C[:3, :3], wide(np.eye(3)))
        errors["cartesian"] = float(abs(said["cartesian"] - true).max() / abs(true).max()) / VALUE
    verdict = worst(errors)
    if verdict[0] == "right" and close:
        return "close", ""
    left_out = "compliance" not in said or ("cartesian" not in said and not flat)
    return ("refused", "") if verdict[0] == "right" and left_out else verdict


# --- answers --------------------------------------------------------------------------------

OUTPUTS = ("joint", "margin", "along", "compliance", "cartesian")


def single(group: Group, r: int) -> dict[str, Any]:
    pose, wrench = group.arm.at(group.q[r]), group.wrench[r]
    if group.tension is None:
        try:
            pull = cdsm.distribute_tension(pose, group.low[r], group.high[r], wrench)
        except cdsm.CdsmError as error:
            return {"F": None, "refused": isinstance(error, cdsm.InfeasibleTension)}
        return {"F": pull.values, "refused": False}
    K = cdsm.stiffness(pose, group.tension[r], wrench)
    said: dict[str, Any] = {"joint": K.joint, "margin": K.margin}
    try:
        said |= {"along": [K.along(u) for u in np.eye(3)], "compliance": K.compliance}
        said |= {"cartesian": K.cartesian}
    except cdsm.SingularStiffness:
        pass
    return said


def batch(group: Group, r: int) -> dict[str, Any]:
    q, wrench = group.q[r : r + 1], group.wrench[r]
    if group.tension is None:
        found = cdsm.distribute_tensions(group.arm, q, group.low[r], group.high[r], wrench)
        F = found.values[0] if found.ok[0] else None
        return {"F": F, "refused": found.status[0] == cdsm.Status.INFEASIBLE}
    rows = cdsm.evaluate(
        group.arm, q, group.tension[r], wrench, OUTPUTS, direction=np.eye(3), threads=1
    )
    return {name: rows[name][0] for name in OUTPUTS if not np.isnan(rows[name]).any()}


def naive(group: Group, r: int) -> dict[str, Any]:
    """OSQP as it comes; the stiffness of the least joint motion for that of a hung weight."""
    pose, wrench = group.arm.at(group.q[r]), group.wrench[r]
    if group.tension is None:
        J, n = pose.length_jacobian, len(group.arm.cables)
        load = pose.jacobian.T @ wrench - pose.gravity_torque
        bounds = {"lb": group.low[r], "ub": group.high[r]}
        with warnings.catch_warnings(action="ignore"):
            F = qpsolvers.solve_qp(
                np.eye(n), np.zeros(n), A=J.T.copy(), b=load, solver="osqp", **bounds
            )
        return {"F": F, "refused": False}
    inverse = np.linalg.pinv(pose.jacobian[:3])
    K = cdsm.stiffness(pose, group.tension[r], wrench).joint
    return {"along": np.diag(inverse.T @ K @ inverse)}


FAMILIES: dict[str, Callable[[Random], Group]] = {
    "singular postures": singular_posture,
    "edge of buckling": edge_of_buckling,
    "singular actuation": singular_actuation,
    "edge of feasibility": edge_of_feasibility,
}


def judged(group: Group, r: int, said: dict[str, Any]) -> Verdict:
    motion = ExactArm(group.arm.geometry, group.arm.gravity).at(group.q[r])
    if group.tension is None:
        return judge_tension(motion, group.wrench[r], group.low[r], group.high[r], **said)
    return judge_stiffness(group.arm, motion, group.tension[r], group.wrench[r], said)


@pytest.mark.parametrize(
    "groups", [4, pytest.param(250, marks=pytest.mark.long)], ids=["few", "ten thousand"]
)
@pytest.mark.parametrize("family", FAMILIES)
def test_cdsm_gives_no_wrong_answer_unflagged_and_naive_routes_do(family: str, groups: int) -> None:
    counts = {route.__name__: Counter[str]() for route in (single, batch, naive)}
    for number in range(groups):
        with warnings.catch_warnings(action="ignore", category=cdsm.CdsmWarning):  # odd is wanted
            group = FAMILIES[family](np.random.default_rng([7, number, len(family)]))
        for route in (single, batch, naive):
            for r in range(ROWS):
                outcome, what = judged(group, r, route(group, r))
                assert outcome != "wrong" or route is naive, (route.__name__, number, r, what)
                counts[route.__name__][outcome] += 1
    print(family, counts)  # pytest -m long -s tests/oracle: the table of docs/reference/validation
    for route in (single, batch):
        # a library that refuses or evades everything is honest, and no use
        assert counts[route.__name__]["right"] > 0.8 * groups * ROWS
    assert counts["naive"]["wrong"] > 0.2 * groups * ROWS


# --- the truth and the judge themselves -----------------------------------------------------


@pytest.mark.parametrize("kind", ["universal", "hinged"])
def test_exact_derivatives_are_those_of_exact_lengths_places_and_energy(kind: str) -> None:
    arm = arms.random_arm(3, 3, kind)
    exact, q = ExactArm(arm.geometry, arm.gravity), arms.random_posture(arm, 3).q
    motion, nv = exact.at(q), arm.nv

    def slopes(q: Array) -> Array:
        motion = exact.at(q)
        parts = (motion.slopes.ravel(), motion.torque, motion.jacobian.ravel())
        return np.concatenate(parts).astype(np.float64)

    bends = (motion.bends.reshape(-1, nv), motion.gravity, motion.turning.reshape(-1, nv))
    lengths = motion.slopes.astype(np.float64)
    assert_second_order(lambda q: exact.at(q).lengths.astype(np.float64), lengths, q)
    assert_second_order(slopes, np.concatenate(bends).astype(np.float64), q)


def test_proofs_of_least_tension_are_those_of_problems_solved_by_hand() -> None:
    A, b = wide([[1.0, -1.0, 0.0]]), wide([1.0])
    low = wide([0.5, 0.5, 0.25])
    found = least_tension(A, b, low, wide([2.0, np.inf, 1.0]))
    assert found.values is not None
    np.testing.assert_allclose(found.values.astype(float), [1.5, 0.5, 0.25], rtol=1e-15)
    # a billionth too little: proven all the same, to the digit
    short = least_tension(A, b, low, wide([1.5 - 1e-9, np.inf, 1.0]))
    assert short.values is None
    assert short.missing == pytest.approx(1e-9, rel=1e-6)


def test_the_judge_notices_every_kind_of_wrong_answer() -> None:
    group = edge_of_buckling(np.random.default_rng(0))
    row = next(r for r in range(ROWS) if "cartesian" in single(group, r))
    said = single(group, row)
    assert judged(group, row, said)[0] == "right"
    scale = abs(said["joint"]).max()
    for name, wrong in (
        ("joint", said["joint"] + 1e-5 * scale),
        ("margin", said["margin"] + 1e-5 * scale),
        ("margin", -said["margin"]),
        *((name, said[name] * np.float64(1.0 + 1e-5)) for name in ("compliance", "cartesian")),
        ("along", np.array(said["along"]) * 1.00001),
        *(("along", np.full(3, value)) for value in (np.inf, np.nan)),
    ):
        assert judged(group, row, said | {name: wrong})[0] == "wrong", name
    group = edge_of_feasibility(np.random.default_rng(1))
    for row in range(ROWS):
        F = single(group, row)["F"]
        if F is None:
            assert judged(group, row, {"F": group.low[row], "refused": False})[0] != "right"
            continue
        for wrong in (F + 1e-5 * F.max(), F * np.nan, None):
            assert judged(group, row, {"F": wrong, "refused": True})[0] == "wrong"
