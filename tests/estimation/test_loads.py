"""Loads and tensions from exact readings, their uncertainty by differences, and what is told."""

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm import presets
from cdsm.estimation.balanced_loads import Instruments
from cdsm.estimation.estimate import tip_force
from cdsm.support.values import Array
from tests.pulleys.test_friction import _rough_finger
from tests.support.arms import readme_geometry
from tests.support.rough import rough

Q = np.deg2rad([10.0, 5.0, 10.0, 5.0, -8.0, 0.0, -8.0, 0.0])
TIP = np.array([1.0, -2.0, 3.0])
ELSE = np.array([-1.0, 4.0, 2.0])


def readme(friction: float = 0.0, **changes: Any) -> cdsm.Posture:
    arm = cdsm.Manipulator(readme_geometry(friction=friction, **changes), presets.STRAND_1X19)
    return arm.at(Q[: arm.nv])


def held(pose: cdsm.Posture, loads: Any, lost: Array | None = None, even: float = 90.0) -> Array:
    """Motor tensions that hold loads; those of segment j are F e^{−lost} of its cable."""
    segments = pose.segments
    cable = segments.chains.cable
    share = np.ones(cable.size) if lost is None else np.exp(-lost)
    pull = np.zeros_like(pose.length_jacobian)
    np.add.at(pull, cable, share[:, None] * segments.length_jacobian)
    torque = cdsm.stiffness(pose, np.full(len(pull), even), loads).residual
    torque = pose.length_jacobian.T @ np.full(len(pull), even) - torque
    F = np.full(len(pull), even)
    return F + np.linalg.lstsq(pull.T, torque - F @ pull)[0]


def lost_in_holes(pose: cdsm.Posture, way: float) -> Array:
    """Σ μ β of the holes before each segment (S,), where cables slide ``way``: 1 taken in."""
    segments = pose.segments
    chains = segments.chains
    lost = np.zeros(chains.cable.size)
    for hole, grip in zip(chains.hole, segments.grip, strict=True):
        lost[hole + 1] = lost[hole] + way * grip
    return lost


def test_exact_readings_give_the_load() -> None:
    pose = readme()
    F = cdsm.distribute_tension(pose, minimum=40.0, wrench=[*TIP, 0, 0, 0]).values
    found = cdsm.estimate_load(pose, F, tension_std=0.5)
    np.testing.assert_allclose(found.loads, TIP, atol=1e-9)
    np.testing.assert_allclose(found.segment_tension, F[pose.segments.chains.cable], atol=1e-9)
    assert found.chi_square < 1e-12
    assert found.freedom == 5
    assert not found.band.any()
    assert not found.warnings
    again = cdsm.stiffness(pose, F, found.acting)
    assert abs(again.residual).max() < 1e-9


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("arm", ["holes", "pulleys"])
def test_known_directions_of_sliding_give_the_load(arm: str, way: float) -> None:
    """F e^{∓Σμβ} behind the holes: the sign is that of what the motor did last."""
    pose = readme(0.1) if arm == "holes" else _rough_finger(0.2).at([0.2, 0.4, 0.5, 0.3])
    lost = lost_in_holes(pose, way)
    F = held(pose, [*TIP, 0, 0, 0], lost)
    assert F.min() > 0.0
    found = cdsm.estimate_load(pose, F, tension_std=0.5, sliding=int(way))
    np.testing.assert_allclose(found.loads, TIP, atol=1e-9)
    T = F[pose.segments.chains.cable] * np.exp(-lost)
    for tension in (found.segment_tension, found.segment_low, found.segment_high):
        np.testing.assert_allclose(tension, T, rtol=1e-9)
    assert not found.band.any()
    other = cdsm.estimate_load(pose, F, tension_std=0.5, sliding=-int(way))
    assert abs(other.loads - TIP).max() > 0.05


@pytest.mark.parametrize("arm", ["holes", "pulleys"])
def test_a_followed_history_gives_the_load(arm: str) -> None:
    """Unequal tensions of an arm that was loaded and moved, with the exponents as they are."""
    pose = readme(0.1) if arm == "holes" else _rough_finger(0.2).at([0.2, 0.4, 0.5, 0.3])
    F = held(pose, np.zeros(6))
    loads = np.array([[2.0, 1.0, -3.0, 0, 0, 0], [*TIP, 0, 0, 0]])
    history = cdsm.load_cycle(pose, F, loads)
    there, T = history.pose(-1), history.segment_tensions[-1]
    chains = there.segments.chains
    exponents = np.log(T[chains.hole + 1] / T[chains.hole])
    assert abs(exponents).max() > 0.01
    std = Instruments(np.full(F.size, 0.5), np.zeros(there.q.size))
    felt = tip_force(there, T[chains.start[:-1]], exponents, std)
    np.testing.assert_allclose(felt.force, TIP, atol=1e-6)
    unknown = cdsm.estimate_load(there, T[chains.start[:-1]], tension_std=0.5)
    assert (abs(unknown.loads - TIP) <= unknown.band).all()
    assert (T - unknown.segment_low).min() > -1e-9
    assert (unknown.segment_high - T).min() > -1e-9


def test_loads_on_two_links_are_those_of_each() -> None:
    """Forces across the arm on two links, together and one by one with the other known."""
    pose = readme()
    point = (0.02, 0.005, -0.01)
    loads = [cdsm.Load("tool0", (0.0, -2.0, 3.0)), cdsm.Load("link2", (0.0, 4.0, 2.0), point=point)]
    F = held(pose, loads)
    given: Any = {"tension_std": 0.5, "points": {"link2": point}}
    rows = {"tool0": ["fy", "fz"], "link2": [1, 2]}
    both = cdsm.estimate_load(pose, F, rows, **given)
    np.testing.assert_allclose(both.loads, [-2.0, 3.0, 4.0, 2.0], atol=1e-9)
    for link, known, expected in (("tool0", loads[1], [-2, 3]), ("link2", loads[0], [4, 2])):
        points = given["points"] if link == "link2" else None
        one = cdsm.estimate_load(
            pose, F, {link: rows[link]}, tension_std=0.5, points=points, wrench=[known]
        )
        np.testing.assert_allclose(one.loads, expected, atol=1e-9)
        assert (one.std < both.std[:2] if link == "tool0" else one.std < both.std[2:]).all()
        assert "known " in str(one)
    r = both.correlation
    np.testing.assert_allclose(np.diag(r), 1.0, rtol=1e-12)
    pair = np.unravel_index(abs(r[:2, 2:]).argmax(), (2, 2))
    text = f"correlated at {r[:2, 2:][pair]:+.3f}"
    assert text in str(both)


def test_moments_are_told_beside_forces() -> None:
    pose = readme()
    W = np.array([*TIP, 0.1, -0.05, 0.02])
    found = cdsm.estimate_load(pose, held(pose, W), {"tool0": "wrench"}, tension_std=0.5)
    np.testing.assert_allclose(found.loads, W, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(found.seen, axis=1), 1.0)
    assert (np.diff(found.seen_std) > 0.0).all()
    # the axial force is told worst
    assert abs(found.seen[-1, 0]) > 0.9


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_uncertainty_is_that_of_differences(friction: float) -> None:
    """Errors of load cells, encoders and μ of each cable, one by one, change the estimate so."""
    pose = readme(friction)
    F = held(pose, [*TIP, 0.1, -0.05, 0.02], lost_in_holes(pose, 1.0))
    cells, encoders, tenth = 0.5, np.deg2rad(0.1), 0.1 * friction

    def loads(step_F: Any = 0.0, step_q: Any = 0.0, step_mu: Any = 0.0) -> Array:
        mu = np.broadcast_to(friction + step_mu, F.shape)
        there = rough(pose.arm, lambda c, _: float(mu[c])).at(pose.q + step_q)
        given: Any = {"tension_std": cells, "angle_std": encoders, "sliding": 1}
        return cdsm.estimate_load(there, F + step_F, {"tool0": "wrench"}, **given).loads

    def std(part: float) -> Array:
        """By differences with steps of ``part`` standard deviations."""
        changes = []
        for name, size, count in (
            ("step_F", cells, F.size),
            ("step_q", encoders, pose.q.size),
            ("step_mu", tenth, F.size if friction else 0),
        ):
            for unit in part * size * np.eye(F.size)[:count, :count]:
                high, low = loads(**{name: unit}), loads(**{name: -unit})
                changes.append((high - low) / (2.0 * part))
        return np.asarray(np.linalg.norm(changes, axis=0))

    found = cdsm.estimate_load(
        pose, F, {"tool0": "wrench"}, tension_std=cells, angle_std=encoders, sliding=1
    )
    if friction:  # without the turn of the wrap angles by errors of angles
        np.testing.assert_allclose(found.std, std(0.5), rtol=5e-3)
        return
    one, half = (abs(std(part) / found.std - 1.0) for part in (2.0, 1.0))
    assert half.max() < 1e-3
    np.testing.assert_allclose(np.log2(one / half), 2.0, atol=0.1)


def test_what_is_not_told_is_named_and_gets_no_number() -> None:
    """Link 2 moves on a sphere about joint 1, so that a force along its radius turns nothing."""
    pose = readme()
    F = held(pose, [*TIP, 0, 0, 0])
    found = cdsm.estimate_load(pose, F, {"tool0": "force", "link2": "force"}, tension_std=0.5)
    np.testing.assert_array_equal(np.isfinite(found.std), [True] * 3 + [False] * 3)
    np.testing.assert_allclose(found.loads[:3], TIP, atol=1e-9)
    assert np.isinf(found.seen_std).sum() == 1
    assert abs(found.loads).max() < 10.0
    assert found.warnings[0].startswith("not told by the readings: they do not change with fx at")
    assert str(found).count("not told") == 5
    amounts = found.seen[-1, 3:]
    place = pose.link_pose("link2")[:3, 3] - pose.joint_positions[0]
    np.testing.assert_allclose(abs(amounts @ place), np.linalg.norm(place), rtol=1e-6)
    assert found.to_dict()["std_N_or_Nm"]["fx at link2"] is None  # type: ignore[index]


@pytest.mark.parametrize("angle_std", [0.0, 0.1])
def test_straight_arm_does_not_feel_a_force_along_it(angle_std: float) -> None:
    """With encoders of ±0.1°, an arm bent by less does not either."""
    pose = readme()
    q = np.deg2rad([0.05, -0.1, 0.1, 0.02, -0.06, 0.1, 0.02, 0.0]) * (angle_std > 0.0)
    pose = pose.arm.at(q)
    F = held(pose, [*TIP, 0, 0, 0])
    found = cdsm.estimate_load(pose, F, tension_std=0.5, angle_std=np.deg2rad(angle_std))
    np.testing.assert_array_equal(np.isfinite(found.std), [False, True, True])
    np.testing.assert_allclose(found.loads[1:], TIP[1:], atol=0.02)
    assert "change with fx at tool0 by" in found.warnings[0]
    sharp = cdsm.estimate_load(pose, F, tension_std=0.5, angle_std=np.deg2rad(0.01))
    assert np.isfinite(sharp.std).all() == (angle_std > 0.0)


def test_joint_at_a_stop_gives_no_equation() -> None:
    pose = readme(joint_limit=0.2)
    q = pose.q.copy()
    q[2] = pose.arm.upper[2]
    pose = pose.arm.at(q)
    F = held(pose, [*TIP, 0, 0, 0])
    # the stop bears a torque that the cable of this joint does not know of
    F = F + np.linalg.lstsq(pose.length_jacobian.T, 0.1 * np.eye(8)[2])[0]
    found = cdsm.estimate_load(pose, F, tension_std=0.5)
    np.testing.assert_allclose(found.loads, TIP, atol=1e-9)
    assert found.at_stop == ("joint2_1",)
    assert found.freedom == 4
    assert "at a stop, whose torque is unknown: joint2_1; its equation" in found.warnings[0]
    near = cdsm.estimate_load(
        pose.arm.at(q - np.deg2rad(0.1)), F, tension_std=0.5, angle_std=np.deg2rad(0.1)
    )
    assert near.at_stop == ("joint2_1",)


def test_slack_cables_have_no_friction() -> None:
    pose = readme(0.1)
    F = held(pose, [*TIP, 0, 0, 0])
    F[0] = 0.0
    found = cdsm.estimate_load(pose, F - 0.3 * (F == 0.0), tension_std=0.5)
    assert found.slack == ("cable1_1",)
    mine = pose.segments.chains.cable == 0
    assert not found.segment_high[mine].any()
    assert "slack, by the load cells: cable1_1" in found.warnings
    assert np.isfinite(found.loads).all()
    named = [name for name in pose.arm.cables.names if name != "cable1_1"]
    without = pose.arm.with_cables([c for c in pose.arm.cables if c.name in named]).at(pose.q)
    bare = cdsm.estimate_load(without, F[1:], tension_std=0.5)
    # its load cell may be wrong, too
    np.testing.assert_allclose(found.band, bare.band, rtol=0.2)


def test_much_friction_is_named() -> None:
    pose = readme(1.5)
    found = cdsm.estimate_load(pose, held(pose, [*TIP, 0, 0, 0]), tension_std=0.5)
    assert "friction changes a tension by up to e^±0." in found.warnings[1]
    few = readme(0.1)
    calm = cdsm.estimate_load(few, held(few, [*TIP, 0, 0, 0]), tension_std=0.5)
    assert not any("e^±" in warning for warning in calm.warnings)


def test_coupled_joints_and_springs() -> None:
    arm = cdsm.Manipulator(
        readme_geometry(coupled=True, joint_stiffness=0.8), cdsm.LinearElasticity(2e4)
    )
    pose = arm.at(np.deg2rad([8.0, -5.0]))
    W = [0.0, -2.0, 3.0, 0, 0, 0]
    F = held(pose, W)
    found = cdsm.estimate_load(pose, F, {"tool0": ["fy", "fz"]}, tension_std=0.5)
    np.testing.assert_allclose(found.loads, W[1:3], atol=1e-9)
    assert found.freedom == 0
    with pytest.raises(cdsm.InvalidInput, match=r"3 components sought, but .* 2 equations; seek"):
        cdsm.estimate_load(pose, F, tension_std=0.5)


def test_tensions_alone_are_those_of_the_load_that_is_known() -> None:
    pose = readme(0.1)
    wrench = [*TIP, 0, 0, 0]
    F = held(pose, wrench)
    found = cdsm.estimate_tensions(pose, F, tension_std=0.5, wrench=wrench)
    even = F[pose.segments.chains.cable]
    np.testing.assert_allclose(found.segment_tension, even, atol=1e-9)
    lost = np.exp(lost_in_holes(pose, 1.0))
    np.testing.assert_allclose(found.segment_low, even / lost, rtol=1e-12)
    np.testing.assert_allclose(found.segment_high, even * lost, rtol=1e-12)
    assert found.freedom == 8
    other = cdsm.estimate_tensions(pose, F, tension_std=0.5, sliding={"cable1_1": 1})
    assert not other.is_explained
    assert other.warnings[0].startswith("the readings do not fit: χ² = ")
    loads = cdsm.estimate_load(pose, F, tension_std=0.5)
    # a load that is unknown leaves the balance less to say
    assert (loads.segment_std >= found.segment_std - 1e-12).all()


def test_results_are_kept_and_exported(tmp_path: Any) -> None:
    pose = readme(0.1)
    F = held(pose, [*TIP, 0, 0, 0])
    found = cdsm.estimate_load(pose, F)
    assert found.warnings[-1].startswith("the load cells are taken as ±")
    numbers = found.to_dict()
    assert numbers["loads_N_or_Nm"] == pytest.approx(
        dict(zip(("fx at tool0", "fy at tool0", "fz at tool0"), TIP.tolist(), strict=True))
    )
    assert numbers["segment_tension_N"]["cable4_3 segment 1"] == pytest.approx(F[-1])  # type: ignore[index]
    data = found.to_xarray()
    assert data.segment_tension.sel(segment="cable4_3 segment 1") == pytest.approx(F[-1])
    assert data.loads.units == "N or N m"
    table = found.to_pandas()
    assert table.loc["fz at tool0", "band [N or N m]"] == pytest.approx(found.band[2])
    assert found.write(tmp_path / "load.csv").exists()
    with pytest.raises(AttributeError):
        found.loads = TIP  # type: ignore[misc]
    assert repr(found).startswith("<LoadEstimate loads -2 to 3")
    assert replace(found, chi_square=0.0).loads is found.loads
    again = pickle.loads(pickle.dumps(found))
    assert str(again) == str(found)
    assert not again.loads.flags.writeable
