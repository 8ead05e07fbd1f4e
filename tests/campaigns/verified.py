"""What the library says of an arm, each number held against something it was not computed from.

Every check here raises AssertionError if a number is wrong, and lets the library's own errors pass:
whoever calls counts them, once :func:`told` has looked at what they say.
"""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import linprog

import cdsm
from cdsm.stiffness_matrix.value import REGULAR
from cdsm.support.values import Array
from tests.support.differences import EPSILON


def finite(result: Any) -> None:
    """Every number of a result is finite, and its arrays are read-only."""
    for field in dataclasses.fields(result):
        value = getattr(result, field.name)
        for array in value if isinstance(value, tuple) else (value,):
            if isinstance(array, np.ndarray) and array.dtype.kind == "f":
                assert np.isfinite(array[~np.isposinf(array)]).all(), f"{field.name}: {array}"
                assert field.name == "maximum" or np.isfinite(array).all(), f"{field.name}: {array}"
                assert field.name.startswith("_") or not array.flags.writeable, field.name


def told(error: cdsm.CdsmError, arm: cdsm.Manipulator) -> None:
    """The error says in words what is wrong, and names joints and cables that exist."""
    text, cables = str(error), {cable.name for cable in arm.cables}
    assert len(text.split()) > 4, text
    if isinstance(error, cdsm.InfeasibleTension):
        assert error.joint in arm.joint_names
        assert error.joint in text
        assert set(error.binding) <= cables
        assert np.isfinite(error.missing).all()
        assert not math.isnan(error.relaxation)
    if error.status == "COINCIDENT_SITES":
        assert any(repr(name) in text for name in cables)
    if isinstance(error, cdsm.ElasticityRangeError):
        assert error.cables, text
        assert set(error.cables) <= cables
    if isinstance(error, cdsm.EquilibriumError):
        assert error.joint in arm.joint_names
    for value in vars(error).values():
        if isinstance(value, np.ndarray):
            assert np.isfinite(value).all(), text


# --- derivatives ----------------------------------------------------------------------------


def agrees(
    f: Callable[[float], Array], analytic: Array, rounding: float, largest_step: float
) -> bool:
    """Whether central differences of f at 0 settle on a derivative, which then has to be this one.

    Two steps h and h/2 give a value with h² extrapolated away, and what it differs by from that of
    the steps before bounds its error, together with rounding, which is given for h = 1.
    """
    size = float(abs(analytic).max(initial=0.0)) or 1.0
    before, best, off = None, math.inf, 0.0
    for power in range(0, 20, 2):
        h = largest_step * 2.0**-power
        if rounding / h > best:  # no smaller step can be known better
            break
        coarse, fine = ((f(s) - f(-s)) / (2.0 * s) for s in (h, h / 2.0))
        value = (4.0 * fine - coarse) / 3.0
        if before is not None:
            uncertain = float(abs(value - before).max(initial=0.0)) + rounding / h
            if uncertain < best:
                best, off = uncertain, float(abs(value - analytic).max(initial=0.0))
        before = value
    known = best < 1e-4 * size
    if known:
        assert off <= 10.0 * best + 1e-12 * size + 1e-290, (  # below that, digits are lost
            f"off by {off:.2e} of {size:.2e}, known to {best:.1e}"
        )
    return known


def largest_step(pose: cdsm.Posture, v: Array) -> float:
    """How far along a motion v (nv,) differences may reach: no segment of a cable turns by 0.1."""
    step, slight = 2.0**-5, 1e-9
    moved = [pose.arm.at(pose.q + s * v, check_limits=False).cable_paths for s in (-slight, slight)]
    for here, back, ahead in zip(pose.cable_paths, *moved, strict=True):
        segment, rate = np.diff(here, axis=0), np.diff((ahead - back) / (2.0 * slight), axis=0)
        turning = np.linalg.norm(rate, axis=1) / np.linalg.norm(segment, axis=1)
        step = min(step, 0.1 / float(turning.max(initial=1.0)))
    return step


def derivatives(pose: cdsm.Posture, rng: np.random.Generator) -> bool:
    """J_L, J_X, g and ∂g/∂θ are the derivatives they are said to be, along a random motion."""
    arm, v = pose.arm, rng.normal(size=pose.q.size)
    v /= abs(v).max()
    step = largest_step(pose, v)

    def at(s: float) -> cdsm.Posture:
        return arm.at(pose.q + s * v, check_limits=False)

    longest = float(pose.cable_lengths.max()) + reach(arm)
    eps = 16.0 * EPSILON
    sure = agrees(lambda s: at(s).cable_lengths, pose.length_jacobian @ v, eps * longest, step)
    place = pose.jacobian[:3] @ v
    sure &= agrees(lambda s: at(s).tip[:3, 3], place, eps * reach(arm), step)
    turn = pose.jacobian[3:] @ v
    spin = np.array([[0, -turn[2], turn[1]], [turn[2], 0, -turn[0]], [-turn[1], turn[0], 0]])
    sure &= agrees(lambda s: at(s).tip[:3, :3], spin @ pose.tip[:3, :3], eps, step)
    heavy = eps * weight(arm) * reach(arm)
    agrees(lambda s: at(s).gravity_torque, pose.gravity_stiffness @ v, heavy, step)
    return sure


def weight(arm: cdsm.Manipulator) -> float:
    """Of all links [N]."""
    return float(arm._body.arrays().mass.sum() * np.linalg.norm(arm.gravity))


def reach(arm: cdsm.Manipulator) -> float:
    """How far anything on the arm can be from its base [m], about."""
    sites = [np.linalg.norm(site.position) for cable in arm.cables for site in cable.sites]
    return arm.length + float(max(sites))


# --- tensions -------------------------------------------------------------------------------


def least(pull: cdsm.Tension) -> None:
    """Tensions are within their bounds, balance the arm, and none are smaller.

    min ½‖F‖² is convex, so multipliers y of the balance prove it: F_c − (J_L y)_c is zero for a
    cable between its bounds, not negative at the lower and not positive at the upper one. A linear
    program looks for them.
    """
    pose, F = pull.posture, pull.values
    J = pose.length_jacobian
    assert (pull.minimum <= F).all()
    assert (pull.maximum >= F).all()
    arm = float(abs(J).max())
    size = max(float(abs(F).max()), 1e-300)
    residual = F @ J - (pose.jacobian.T @ pull.wrench - pose.gravity_torque)
    np.testing.assert_allclose(
        pull.residual, residual, rtol=0.0, atol=1e-12 * (arm * size + 1e-300)
    )
    load = float(abs(residual - F @ J).max()) / arm if arm else 0.0
    size = max(size, load)
    arm = arm if arm > 1e-14 * reach(pose.arm) else 1.0
    missing = float(abs(residual).max())
    assert missing <= 1e-8 * arm * size, f"unbalanced by {missing:.3g} N m"
    low, high = F - pull.minimum <= 1e-9 * size, pull.maximum - F <= 1e-9 * size
    A, b = [], []
    ones = np.ones((F.size, 1))
    scaled, f = J / arm if arm else J, F / size
    for rows, sign in ((~low, 1.0), (~high, -1.0)):
        # sign (F − J y) <= t: no gain in lowering what is not at its lower bound, or in raising
        rows = rows & ~(low & high)
        A.append(np.hstack([-sign * scaled, -ones])[rows])
        b.append(-sign * f[rows])
    if not sum(map(len, b)) or not arm > 1e-14 * reach(pose.arm):
        return
    free = [(None, None)] * J.shape[1]
    found = linprog(
        np.append(np.zeros(J.shape[1]), 1.0),
        A_ub=np.vstack(A),
        b_ub=np.concatenate(b),
        bounds=[*free, (0.0, None)],
        method="highs",
    )
    if found.status == 0:  # HiGHS gives up on some badly scaled ones
        assert found.fun <= 2e-6, f"not the least tensions: multipliers miss by {found.fun:.2e}"


def infeasible(
    pose: cdsm.Posture, low: Array, high: Array, wrench: Array, error: cdsm.InfeasibleTension
) -> None:
    """No tensions within the bounds balance the arm: a dual vector proves it (Farkas).

    For every y with |y_i| <= 1, the missing torque Σ|τ − J_Lᵀ F| is at least
    y·τ − max over the bounds of (J_L y)·F; the largest of these is the least torque missing, which
    the error has to tell.
    """
    J = pose.length_jacobian
    torque = pose.jacobian.T @ wrench - pose.gravity_torque
    arm = float(abs(J).max()) or 1.0
    force = max(float(abs(torque).max()) / arm, float(low.max(initial=0.0)), 1e-300)
    J = np.where(
        abs(J) < 1e-14 * reach(pose.arm), 0.0, J
    )  # rounding, which no force makes a torque
    A, b = J / arm, torque / (arm * force)
    count, nv = J.shape
    # each cable by its own moment arm, as HiGHS drops entries below 1e-9
    lever = np.maximum(abs(A).max(axis=1), 1e-300)
    # y, then p and n with J y = p − n: what the bounds let the cables do is high p − low n
    finite_high = np.isfinite(high)
    top, bottom = lever * np.where(finite_high, high, 0.0) / force, lever * low / force
    found = linprog(
        np.concatenate([-b, top, -bottom]),
        A_eq=np.hstack([A / lever[:, None], -np.eye(count), np.eye(count)]),
        b_eq=np.zeros(count),
        bounds=[
            *[(-1.0, 1.0)] * nv,
            *[(0.0, None if each else 0.0) for each in finite_high],
            *[(0.0, None)] * count,
        ],
        method="highs",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    missing = float(abs(error.missing).sum()) / (arm * force)
    assert missing > 0.0
    if found.status == 0:
        np.testing.assert_allclose(missing, -found.fun, rtol=1e-6, atol=1e-8)


# --- stiffness ------------------------------------------------------------------------------


def original_length(cable: cdsm.Cable, F: float, L: float) -> float:
    """l_0 [m] of a cable that is L long under F: what its spring leaves of L, unstrained."""
    spring = (F - cable.elasticity.low) / cable.series_stiffness
    return (L - spring) / (1.0 + float(cable.elasticity.strain(F)))


def spring_constants(K: cdsm.Stiffness) -> tuple[Array, Array]:
    """k of each cable, one cable at a time: l_0/EA and the spring in series; 0 if held by force.

    And how much of it is rounding: L and the stretch of the spring may cancel in l_0.
    """
    values, rounding = [], []
    for cable, L, F in zip(
        K.posture.arm.cables, K.posture.cable_lengths.tolist(), K.tension.tolist(), strict=True
    ):
        if cable.control == "force":
            values.append(0.0)
            rounding.append(0.0)
            continue
        EA, series = float(cable.elasticity.rigidity(F)), 1.0 / cable.series_stiffness
        k = 1.0 / (original_length(cable, F, L) / EA + series)
        values.append(k)
        # some 1e-13 of what l_0 is a difference of
        rounding.append(1e-12 * k * (1.0 + k * (L + F * series) / EA))
    return np.array(values), np.array(rounding)


def stiff(K: cdsm.Stiffness, rng: np.random.Generator) -> bool:
    """K_θ is the derivative of the torque that locked motors leave; and what follows from it."""
    pose, arm, F, W = K.posture, K.posture.arm, K.tension, K.wrench
    springs, off = spring_constants(K)
    assert (abs(K.cable_stiffness - springs) <= off).all()
    np.testing.assert_array_equal(K.joint, K.active + K.passive + K.gravity + K.load)
    v = rng.normal(size=pose.q.size)
    v /= abs(v).max()

    def torque(s: float) -> Array:
        moved = arm.at(pose.q + s * v, check_limits=False)
        pulled = F + K.cable_stiffness * (moved.cable_lengths - pose.cable_lengths)
        return np.asarray(
            pulled @ moved.length_jacobian + moved.gravity_torque - W @ moved.jacobian
        )

    way = reach(arm)
    rounding = (
        32.0
        * EPSILON
        * (
            float(
                (F + K.cable_stiffness * pose.cable_lengths) @ abs(pose.length_jacobian).sum(axis=1)
            )
            + float(F.sum()) * way
            + float(abs(W) @ abs(pose.jacobian).sum(axis=1))
            + weight(arm) * way
        )
    )
    sure = agrees(torque, K.joint @ v, rounding, largest_step(pose, v))
    if not W[3:].any():
        largest = abs(K.joint).max()
        off = 1e-12 * largest + 1e-15 * rounded(K)
        np.testing.assert_allclose(K.joint, K.joint.T, rtol=0.0, atol=off)
    symmetric = (K.joint + K.joint.T) / 2.0
    assert K.margin <= v @ symmetric @ v / (v @ v) + 1e-12 * abs(symmetric).max() * v.size
    compliant(K)
    return sure


def refused(K: cdsm.Stiffness, direction: Array) -> None:
    """K_θ, called singular in a joint motion, leaves hardly a torque there of all its parts."""
    parts = abs(K.active) + abs(K.passive) + abs(K.gravity) + abs(K.load)
    if parts.diagonal().min() == 0.0:
        # nothing but the joint that nothing holds moves
        assert abs(direction[parts.diagonal() == 0.0]).max() >= 1.0 - 1e-12
        return
    # each joint in units in which what its own stiffness is a sum of is one
    unit = np.sqrt(parts.diagonal())
    torque, motion = K.joint @ direction / unit, unit * direction
    size = abs(parts / unit / unit[:, None]).max() * np.linalg.norm(motion)
    left = np.linalg.norm(torque) / size
    assert left <= 1.01 * REGULAR, f"called singular, and {left:.2e} of its parts are left"


def compliant(K: cdsm.Stiffness) -> None:
    """The Cartesian readings solve what they are said to solve, or do not exist for a reason."""
    J = K.posture.jacobian
    values = np.linalg.svd(K.joint, compute_uv=False)
    condition = values[0] / values[-1] if values[-1] > 1e-300 * values[0] else math.inf
    try:
        C = K.compliance
    except cdsm.SingularStiffness as error:
        refused(K, error.direction)
        return
    assert np.isfinite(C).all()
    if condition > 1e10:
        return
    expected = J @ np.linalg.inv(K.joint) @ J.T
    size = np.linalg.norm(J) ** 2 / values[-1]
    np.testing.assert_allclose(C, expected, rtol=0.0, atol=1e-14 * condition * size)
    for u in (np.eye(3)[0], np.array([0.3, -0.5, 0.8])):
        along = K.along(u)
        n = u / np.linalg.norm(u)
        moved = np.linalg.norm(n @ J[:3])
        assert not math.isnan(along)
        if math.isinf(along) and moved <= 1e-9 * np.linalg.norm(J[:3]):
            continue
        # a motion that almost cancels has no digits left
        size = moved * np.linalg.norm(J[:3]) / values[-1]
        assert abs(1.0 / along - n @ expected[:3, :3] @ n) <= 1e-13 * condition * size
    try:
        stiff = K.cartesian
    except cdsm.SingularStiffness as error:
        moved = np.linalg.norm(error.direction @ J[:3])
        if moved > 2e-6 * np.linalg.norm(J[:3]):
            raise AssertionError("the tip can move where it is said not to") from error
    else:
        assert np.isfinite(stiff).all()
        spread = np.linalg.cond(J[:3]) ** 2 * condition
        if spread < 1e10:
            np.testing.assert_allclose(
                stiff @ C[:3, :3], np.eye(3), atol=1e-13 * spread * condition
            )


# --- many at once ---------------------------------------------------------------------------

OUTPUTS = (
    *("tip", "jacobian", "cable_lengths", "length_jacobian", "gravity_torque", "tension"),
    *("active", "passive", "gravity", "load", "joint", "cable_stiffness", "margin"),
)


def batched(
    arm: cdsm.Manipulator,
    q: Array,
    low: Array,
    high: Array,
    wrench: Array,
    single: cdsm.Stiffness | cdsm.CdsmError,
) -> None:
    """A batch has the numbers and the status that the single functions have, to 1e-12."""
    rows = np.array([q, q])
    least, most = ([getattr(each, name) for each in arm.cables] for name in ("minimum", "maximum"))
    if (np.maximum(low, least) > np.minimum(high, most)).any():
        return  # bounds that contradict each other are an error for all rows at once
    batch = cdsm.evaluate(arm, rows, None, wrench, OUTPUTS, minimum=low, maximum=high, threads=1)
    for name in batch.outputs:
        missing = np.isnan(batch[name])  # what does not exist, all of it and only in failed rows
        assert not missing.any() or (missing.all() and batch.status.all()), name
        np.testing.assert_array_equal(batch[name][0], batch[name][1])
    if isinstance(single, cdsm.CdsmError):
        if isinstance(single, cdsm.InfeasibleTension):
            slight = abs(arm.at(q).length_jacobian).max(axis=0).min()
            if 0.0 < slight < 1e-8 * reach(arm):
                return  # HiGHS takes moment arms a billionth of the largest for none
        # what one of two algorithms finds on the very edge of the feasible, the other need not
        edge = {cdsm.Status.SOLVER_FAILED, cdsm.Status.INFEASIBLE, cdsm.Status.OUTSIDE_ELASTICITY}
        assert batch.status[0] == cdsm.Status[single.status] or (
            single.status == "SOLVER_FAILED" and batch.status[0] in {*edge, cdsm.Status.OK}
        ), f"{cdsm.Status(batch.status[0])!r} beside {single!r}"
        return
    assert batch.status[0] == cdsm.Status.OK, cdsm.Status(batch.status[0])
    pose = single.posture
    # least tensions depend on the Jacobian as its smallest singular value allows
    values = np.linalg.svd(pose.length_jacobian, compute_uv=False)
    if 0.0 < values[-1] < 1e-8 * values[0]:
        return  # what one counts as balanced to 1e-9, the other balances exactly
    loose = 1e-7 if values[-1] < 1e-6 * values[0] else 1e-12
    F = single.tension
    size = abs(F).max(initial=0.0)
    off = abs(batch["tension"][0] - F).max()
    assert off <= max(loose, 1e-6 * (pose.q.size > 0)) * size + 1e-300, f"tension off by {off:.2e}"
    for name in ("tip", "jacobian", "cable_lengths", "length_jacobian", "gravity_torque"):
        expected_value = getattr(pose, name)
        scale = abs(expected_value).max() + (reach(arm) if name != "gravity_torque" else 0.0)
        if name == "gravity_torque":
            scale += weight(arm) * reach(arm)
        np.testing.assert_allclose(batch[name][0], expected_value, rtol=0.0, atol=1e-12 * scale)
    given = cdsm.evaluate(arm, rows, F, wrench, OUTPUTS, threads=1)
    assert given.status[0] == cdsm.Status.OK
    for name in ("active", "passive", "gravity", "load", "joint", "cable_stiffness"):
        expected_value = getattr(single, name)
        scale = abs(expected_value).max()
        if name == "active":  # of contributions that cancel, within one cable's Hessian too
            scale += reach(arm) * float(F.sum())
        if name in ("gravity", "load", "joint"):
            scale += abs(single.joint).max() + rounded(single)
        np.testing.assert_allclose(
            given[name][0], expected_value, rtol=0.0, atol=1e-12 * scale, err_msg=name
        )


def rounded(K: cdsm.Stiffness) -> float:
    """Magnitude of what the parts of K_θ are sums of [N m]."""
    arm = K.posture.arm
    active = abs(K.posture.length_hessian).max() * float(K.tension.sum())
    return float(
        (weight(arm) + abs(K.wrench[:3]).sum()) * reach(arm) + abs(K.wrench[3:]).sum() + active
    )


# --- loads ----------------------------------------------------------------------------------


def at_rest(pull: cdsm.Tension, wrench: Array) -> None:
    """Where an arm with locked motors comes to rest, every cable pulls as it is stretched."""
    rest = cdsm.equilibrium(pull.posture, pull, wrench)
    finite(rest)
    start, arm = pull.posture, pull.posture.arm
    pose = arm.at(rest.pose.q, check_limits=False)
    assert (pose.q >= np.minimum(arm.lower, start.q) - 1e-9).all()
    assert (pose.q <= np.maximum(arm.upper, start.q) + 1e-9).all()
    for c, cable in enumerate(arm.cables):
        F0, F, L = pull.values[c], rest.tension[c], start.cable_lengths[c]
        longer = pose.cable_lengths[c] - L
        if cable.control == "force":
            assert abs(F - F0) <= 1e-12 * F0
            continue
        if cable.elasticity.low >= F:
            continue  # slack, or at the end of what is known of it
        F, l0 = min(F, cable.elasticity.high), original_length(cable, F0, L)
        stretched = cable.elongation(F, l0) - cable.elongation(F0, l0)
        size = reach(arm) + start.cable_lengths[c] + abs(cable.elongation(F, l0))
        assert abs(stretched - longer) <= 1e-9 * size, f"{cable.name}: {stretched} for {longer}"
    torque = rest.tension @ pose.length_jacobian + pose.gravity_torque - wrench @ pose.jacobian
    scale = abs(rest.tension @ abs(pose.length_jacobian)).max() + abs(pose.gravity_torque).max()
    scale += abs(wrench @ pose.jacobian).max() + rounded(rest.stiffness)
    left = torque - rest.stop_torque
    np.testing.assert_allclose(left, rest.residual, rtol=0.0, atol=1e-11 * scale)
    assert (rest.stop_torque[pose.q <= arm.lower] >= -1e-9 * scale).all()
    assert (rest.stop_torque[pose.q >= arm.upper] <= 1e-9 * scale).all()


def weighed(pull: cdsm.Tension, K: cdsm.Stiffness) -> None:
    """A weight so small that the arm hardly moves measures 1/(uᵀ C u)."""
    u = np.array([0.2, -0.4, -0.9])
    u /= np.linalg.norm(u)
    along = K.along(u)
    if not 0.0 < along < math.inf:
        return
    force = 1e-6 * along * pull.posture.arm.length
    test = cdsm.weight_test(pull.posture, pull, force * u)
    finite(test)
    assert math.isfinite(test.stiffness) or math.isinf(test.stiffness)


def buckles(pose: cdsm.Posture, wrench: Array) -> None:
    """At the critical tension the softest motion changes its sign, and nowhere below."""
    found = cdsm.critical_tension(pose, wrench)
    low, high = found.examined
    assert np.isfinite([low, high]).all()
    assert np.isfinite(found.margins).all()

    def margin(minimum: float) -> float:
        pull = cdsm.distribute_tension(pose, minimum, wrench=wrench)
        return cdsm.stiffness(pose, pull).margin

    inside = (found.bounds > low) & (found.bounds < found.minimum)
    if found.stable and found.stable[0][0] == low:
        assert (found.margins[inside] > 0.0).all()
    if low < found.minimum < high:
        below, above = margin(found.minimum * (1 - 1e-9)), margin(found.minimum * (1 + 1e-9))
        assert below > 0.0 or above < 0.0


# --- files ----------------------------------------------------------------------------------


def travels(arm: cdsm.Manipulator, pose: cdsm.Posture) -> None:
    """The same arm comes back from its URDF and its TOML."""
    again = cdsm.Manipulator.from_urdf(
        arm.urdf, arm.cables, tip=arm.tip_link, gravity=arm.gravity
    ).at(pose.q)
    for name in ("tip", "jacobian", "cable_lengths", "length_jacobian", "gravity_torque"):
        np.testing.assert_array_equal(getattr(again, name), getattr(pose, name))
    if arm.is_serpentine:
        assert cdsm.Geometry.from_toml(arm.geometry.to_toml()) == arm.geometry
        assert cdsm.to_urdf(arm.geometry) == arm.urdf


def simulated(pull: cdsm.Tension) -> None:
    """MuJoCo loads the arm as it is exported, and has its tip and cables in the same places."""
    import mujoco

    pose = pull.posture
    text = cdsm.to_mjcf(pose.arm, pose, pull)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    for name, angle in zip(pose.arm.joint_names, pose.q, strict=True):
        data.joint(name).qpos[:] = angle
    mujoco.mj_forward(model, data)
    size = 1e-10 * reach(pose.arm)
    site = data.site("tool0").xpos
    np.testing.assert_allclose(site, pose.tip[:3, 3], rtol=0.0, atol=size)
    for cable, length in zip(pose.arm.cables, pose.cable_lengths, strict=True):
        found = data.tendon(cable.name).length[0] + cable.lead
        # MuJoCo puts a site that near to the origin of its body there
        away = [float(np.linalg.norm(site.position)) for site in cable.sites]
        size = 1e-10 * reach(pose.arm) + 1e-12 * cable.lead
        size += 2.0 * sum(distance for distance in away if distance < 1e-6)
        np.testing.assert_allclose(found, length, rtol=0.0, atol=size)
