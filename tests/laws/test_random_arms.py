"""Arms of every kind at random: each number is right, or an error of ours says why there is none.

Derivatives are held against differences, tensions against the conditions of an optimum, an
infeasible load against a proof by Farkas.
"""

import math
import warnings
from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import Phase, given, seed, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

import cdsm
from cdsm.support.values import Array
from tests.support import strategies
from tests.support.differences import EPSILON
from tests.support.strategies import EXTREME, PLAUSIBLE, decades

KINDS: dict[str, st.SearchStrategy[cdsm.Manipulator]] = {
    "uniform": strategies.serpentine_arms(strategies.uniform_geometries(PLAUSIBLE, 6)),
    "mixed": strategies.serpentine_arms(strategies.mixed_geometries(PLAUSIBLE, 6)),
    "extreme": strategies.serpentine_arms(strategies.uniform_geometries(EXTREME, 6)),
    "routed": strategies.routed_arms(strategies.geometries(4)),
    "trees": strategies.trees(),
}


@pytest.mark.parametrize(
    "examples", [10, pytest.param(1000, marks=pytest.mark.long)], ids=["few", "many"]
)
@pytest.mark.parametrize("kind", KINDS)
def test_random_arms_give_right_numbers_or_an_error_that_says_why(kind: str, examples: int) -> None:
    counts: Counter[str] = Counter()

    @seed(examples)
    @settings(database=None, deadline=None, max_examples=examples, phases=[Phase.generate])
    @given(st.data())
    def each(data: st.DataObject) -> None:
        with warnings.catch_warnings(action="ignore", category=cdsm.CdsmWarning):  # odd is wanted
            arm = data.draw(KINDS[kind])
        counts[outcome(arm, data)] += 1

    each()
    early = counts["posture"] + counts["stiffness"]
    assert early < counts.total() / 2, counts  # most get as far as the tensions
    assert counts["right"] or kind in ("routed", "trees"), counts  # which few tensions balance


def outcome(arm: cdsm.Manipulator, data: st.DataObject) -> str:
    """Check all numbers of an arm that is asked at random; say where an error of ours ended it."""
    share, floats = st.floats(0.0, 1.0), st.floats(-1.0, 1.0)
    shares = data.draw(st.lists(share, min_size=1, max_size=6))
    q = arm.lower + np.resize(shares, arm.nv) * (arm.upper - arm.lower)
    q = np.clip(q, arm.lower, arm.upper)
    size = data.draw(st.just(0.0) | decades(1e-3, 10.0))
    wrench = size * np.array(data.draw(st.tuples(*[floats] * 6))) * np.repeat([1.0, 0.1], 3)
    low = data.draw(st.sampled_from([0.0, 5.0, 50.0]) | decades(1e-3, 1e3))
    high = low + data.draw(st.just(math.inf) | decades(1.0, 1e4))
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    stage = "posture"
    try:
        pose = arm.at(q)
        check_derivatives(pose, rng)
        stage = "stiffness"
        F = np.array([given_tension(cable, rng) for cable in arm.cables])
        check_stiffness(cdsm.stiffness(pose, F, wrench), rng)
        stage = "tension"
        lows = np.maximum(low, [cable.minimum for cable in arm.cables])
        highs = np.minimum(high, [cable.maximum for cable in arm.cables])
        try:
            pull = cdsm.distribute_tension(pose, low, high, wrench)
        except cdsm.InfeasibleTension as error:
            check_infeasible(pose, lows, highs, wrench, error)
            raise
        check_least(pull)
        check_stiffness(cdsm.stiffness(pose, pull), rng)
    except cdsm.CdsmError as error:
        check_words(error, arm)
        return stage
    return "right"


def check_words(error: cdsm.CdsmError, arm: cdsm.Manipulator) -> None:
    """The error says what is wrong, and names joints and cables that exist."""
    assert len(str(error).split()) > 4
    if isinstance(error, cdsm.InfeasibleTension):
        assert error.joint in arm.joint_names
        assert set(error.binding) <= set(arm.cables.names)
    if isinstance(error, cdsm.ElasticityRangeError):
        assert set(error.cables) <= set(arm.cables.names)


def given_tension(cable: cdsm.Cable, rng: np.random.Generator) -> float:
    """Any tension within the law of a cable [N]."""
    law = cable.elasticity
    most = min(law.high, 2.0 * law.low + 1e3)
    return min(law.low + float(rng.choice([0.0, 1.0, rng.random()])) * (most - law.low), most)


# --- derivatives ----------------------------------------------------------------------------


def reach(arm: cdsm.Manipulator) -> float:
    """How far anything on the arm can be from its base [m], about."""
    sites = [np.linalg.norm(site.position) for cable in arm.cables for site in cable.sites]
    return arm.length + float(max(sites))


def weight(arm: cdsm.Manipulator) -> float:
    """Of all links [N]."""
    return float(arm.body.arrays().mass.sum() * np.linalg.norm(arm.gravity))


def assert_derivative(
    f: Callable[[float], Array], analytic: Array, rounding: float, largest: float
) -> None:
    """Central differences of f at 0, where they settle, settle on this derivative.

    Two steps h and h/2 give a value with h² extrapolated away. What it differs by from that of the
    steps before bounds its error, together with rounding, which is given for h = 1.
    """
    size = float(abs(analytic).max(initial=0.0)) or 1.0
    before, best, off = None, math.inf, 0.0
    for power in range(0, 20, 2):
        h = largest * 2.0**-power
        if rounding / h > best:  # no smaller step can be known better
            break
        coarse, fine = ((f(s) - f(-s)) / (2.0 * s) for s in (h, h / 2.0))
        value = (4.0 * fine - coarse) / 3.0
        if before is not None:
            uncertain = float(abs(value - before).max(initial=0.0)) + rounding / h
            if uncertain < best:
                best, off = uncertain, float(abs(value - analytic).max(initial=0.0))
        before = value
    if best < 1e-4 * size:
        assert off <= 10.0 * best + 1e-12 * size + 1e-290, f"off by {off:.2e} of {size:.2e}"


def motion(pose: cdsm.Posture, rng: np.random.Generator) -> tuple[Array, float]:
    """A random motion (nv,), and how far along it no segment of a cable turns by 0.1 rad."""
    v = rng.normal(size=pose.q.size)
    v /= abs(v).max()
    step, slight = 2.0**-5, 1e-9
    moved = [pose.arm.at(pose.q + s * v, check_limits=False).cable_paths for s in (-slight, slight)]
    for here, back, ahead in zip(pose.cable_paths, *moved, strict=True):
        segment, rate = np.diff(here, axis=0), np.diff((ahead - back) / (2.0 * slight), axis=0)
        turning = np.linalg.norm(rate, axis=1) / np.linalg.norm(segment, axis=1)
        step = min(step, 0.1 / float(turning.max(initial=1.0)))
    return v, step


def check_derivatives(pose: cdsm.Posture, rng: np.random.Generator) -> None:
    """J_L, J_X and ∂g/∂θ are the derivatives they are said to be, along a random motion."""
    arm, (v, step), eps = pose.arm, motion(pose, rng), 16.0 * EPSILON

    def at(s: float) -> cdsm.Posture:
        return arm.at(pose.q + s * v, check_limits=False)

    longest, way = float(pose.cable_lengths.max()) + reach(arm), pose.jacobian @ v
    assert_derivative(lambda s: at(s).cable_lengths, pose.length_jacobian @ v, eps * longest, step)
    assert_derivative(lambda s: at(s).tip[:3, 3], way[:3], eps * reach(arm), step)
    turning = np.cross(way[3:], pose.tip[:3, :3], axisb=0, axisc=0)
    assert_derivative(lambda s: at(s).tip[:3, :3], turning, eps, step)
    heavy = eps * weight(arm) * reach(arm)
    assert_derivative(lambda s: at(s).gravity_torque, pose.gravity_stiffness @ v, heavy, step)


# --- stiffness ------------------------------------------------------------------------------


def spring(cable: cdsm.Cable, F: float, L: float) -> tuple[float, float]:
    """k of a cable, L long under F: EA/l_0 and its spring in series; and what of it is rounding."""
    if cable.control == "force":
        return 0.0, 0.0
    EA, soft = float(cable.elasticity.rigidity(F)), 1.0 / cable.series_stiffness
    stretched = (F - cable.elasticity.low) * soft
    k = 1.0 / ((L - stretched) / (1.0 + float(cable.elasticity.strain(F))) / EA + soft)
    return k, 1e-12 * k * (1.0 + k * (L + F * soft) / EA)  # L and the spring's stretch may cancel


def check_stiffness(K: cdsm.Stiffness, rng: np.random.Generator) -> None:
    """K_θ is the derivative of the torque that locked motors leave, and C solves with it."""
    pose, arm, F, W = K.posture, K.posture.arm, K.tension, K.wrench
    cables = zip(arm.cables, F.tolist(), pose.cable_lengths.tolist(), strict=True)
    springs, off = np.transpose([spring(*each) for each in cables])
    assert (abs(K.cable_stiffness - springs) <= off).all()
    np.testing.assert_array_equal(K.joint, K.active + K.passive + K.gravity + K.load)
    v, step = motion(pose, rng)

    def torque(s: float) -> Array:
        moved = arm.at(pose.q + s * v, check_limits=False)
        pulled = F + K.cable_stiffness * (moved.cable_lengths - pose.cable_lengths)
        return np.asarray(
            pulled @ moved.length_jacobian + moved.gravity_torque - W @ moved.jacobian
        )

    pulls = (F + K.cable_stiffness * pose.cable_lengths) @ abs(pose.length_jacobian).sum(axis=1)
    loads = abs(W) @ abs(pose.jacobian).sum(axis=1) + (F.sum() + weight(arm)) * reach(arm)
    assert_derivative(torque, K.joint @ v, 32.0 * EPSILON * float(pulls + loads), step)
    singular = np.linalg.svd(K.joint, compute_uv=False)
    if singular[-1] <= 1e-8 * singular[0]:
        return
    J = pose.jacobian
    expected = J @ np.linalg.inv(K.joint) @ J.T
    size = np.linalg.norm(J) ** 2 / singular[-1]
    try:
        compliance = K.compliance
    except cdsm.SingularStiffness:  # its parts cancel, which its singular values do not tell
        return
    np.testing.assert_allclose(compliance, expected, rtol=0.0, atol=1e-6 * size)


# --- tensions -------------------------------------------------------------------------------


def check_least(pull: cdsm.Tension) -> None:
    """Tensions are within their bounds, balance the arm, and none are smaller.

    min ½‖F‖² is convex, so multipliers y of the balance prove it: F_c − (J_L y)_c is zero for a
    cable between its bounds, not negative at the lower and not positive at the upper one. A linear
    program looks for them.
    """
    pose, F = pull.posture, pull.values
    J = pose.length_jacobian
    assert (pull.minimum_held <= F).all()
    assert (pull.maximum_held >= F).all()
    lever = float(abs(J).max())
    if lever <= 1e-14 * reach(pose.arm):
        return
    torque = pose.jacobian.T @ pull.wrench - pose.gravity_torque
    size = max(float(abs(F).max()), float(abs(torque).max()) / lever, 1e-300)
    assert float(abs(F @ J - torque).max()) <= 1e-8 * lever * size
    low, high = F - pull.minimum_held <= 1e-9 * size, pull.maximum_held - F <= 1e-9 * size
    rows, limits = [], []
    for chosen, sign in ((~low | high, 1.0), (~high | low, -1.0)):
        # sign (F − J y) <= t: no gain in lowering what is not at its lower bound, or in raising
        chosen &= ~(low & high)
        chosen &= ~low if sign > 0.0 else ~high
        rows.append(np.hstack([-sign * J / lever, -np.ones((F.size, 1))])[chosen])
        limits.append(-sign * (F / size)[chosen])
    if not sum(map(len, limits)):
        return
    found = linprog(
        np.append(np.zeros(J.shape[1]), 1.0),
        A_ub=np.vstack(rows),
        b_ub=np.concatenate(limits),
        bounds=[*[(None, None)] * J.shape[1], (0.0, None)],
    )
    if found.status == 0:  # HiGHS gives up on some badly scaled ones
        assert found.fun <= 2e-6, f"not the least tensions: multipliers miss by {found.fun:.2e}"


def check_infeasible(
    pose: cdsm.Posture, low: Array, high: Array, wrench: Array, error: cdsm.InfeasibleTension
) -> None:
    """No tensions within the bounds balance the arm: a dual vector proves it (Farkas).

    For every y with |y_i| <= 1, the missing torque Σ|τ − J_Lᵀ F| is at least y·τ − max (J_L y)·F
    over the bounds; the largest of these is the least torque missing, which the error has to tell.
    """
    J, torque = pose.length_jacobian, pose.jacobian.T @ wrench - pose.gravity_torque
    J = np.where(abs(J) < 1e-14 * reach(pose.arm), 0.0, J)  # rounding makes no torque
    lever = float(abs(J).max()) or 1.0
    force = max(float(abs(torque).max()) / lever, float(low.max(initial=0.0)), 1e-300)
    A, b, (count, nv) = J / lever, torque / (lever * force), J.shape
    own = np.maximum(abs(A).max(axis=1), 1e-300)  # HiGHS drops entries below 1e-9
    bounded = np.isfinite(high)
    # y, then p and n with J y = p − n: what the bounds let the cables do is high p − low n
    found = linprog(
        np.concatenate([-b, own * np.where(bounded, high, 0.0) / force, -own * low / force]),
        A_eq=np.hstack([A / own[:, None], -np.eye(count), np.eye(count)]),
        b_eq=np.zeros(count),
        bounds=[
            *[(-1.0, 1.0)] * nv,
            *[(0.0, None if each else 0.0) for each in bounded],
            *[(0.0, None)] * count,
        ],
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    missing = float(abs(error.missing).sum()) / (lever * force)
    assert missing > 0.0
    if found.status == 0:
        np.testing.assert_allclose(missing, -found.fun, rtol=1e-6, atol=1e-8)
