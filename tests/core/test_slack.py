"""Cables at 0 N only pull: the stiffness against a force along +u, and the words about it."""

from functools import cache

import numpy as np
import pytest

import cdsm
from cdsm import presets
from tests.support.arms import readme_geometry

AXES = np.vstack([np.eye(3), -np.eye(3)])
ARM = presets.virtual_prototype(cdsm.LinearElasticity(rigidity=200e3))
MOMENT = np.array([3.0, -2.0, 4.0, 0.4, -0.3, 0.5])


@cache
def prototype() -> cdsm.Stiffness:
    """Return K of the virtual prototype at 0.1 rad, with five cables at 0 N."""
    pose = ARM.at(np.full(ARM.nv, 0.1))
    return cdsm.stiffness(pose, cdsm.distribute_tension(pose))


@pytest.mark.parametrize(
    ("direction", "measured"),
    [
        ("-y", 168_387.0),
        ("y", 405_057.0),
        ("x", 965_107.0),
        ("-x", 1_274_027.0),
        ("z", 371_794.0),
        ("-z", 283_513.0),
    ],
)
def test_the_stiffness_is_what_a_small_weight_measures_on_that_side(
    direction: str, measured: float
) -> None:
    K = prototype()
    assert K.along(direction) == pytest.approx(measured, rel=2e-6)
    assert K.shares(direction).total == pytest.approx(K.along(direction), rel=1e-12)


@pytest.mark.parametrize("seed", range(30))
def test_weights_of_random_arms_measure_it(seed: int) -> None:
    """A weight of about a thousandth of what the arm holds, with or without a moment in W."""
    random = np.random.default_rng(seed)
    joints = int(random.integers(2, 6))
    geometry = readme_geometry(joints=joints, link_mass=float(random.uniform(0.1, 0.6)))
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(rigidity=random.uniform(5e4, 4e5)))
    wrench = MOMENT if seed % 3 == 0 else np.zeros(6)
    pose = arm.at(random.uniform(-0.15, 0.15, arm.nv))
    tension = cdsm.distribute_tension(pose, wrench=wrench)
    K = cdsm.stiffness(pose, tension)
    assert K.slack
    assert K.margin_without_slack > 0.0
    u = random.normal(size=3)
    u /= np.linalg.norm(u)
    for direction in (u, -u):
        small = 1e-3 * float(K.tension.max()) * 0.01
        more = np.append(small * direction, np.zeros(3))
        rest = cdsm.equilibrium(pose, tension, wrench + more)
        moved = float(direction @ (rest.pose.tip[:3, 3] - pose.tip[:3, 3]))
        assert small / moved == pytest.approx(K.along(direction), rel=1e-3)


def test_without_such_cables_both_sides_are_equal_to_the_last_bit() -> None:
    pose = ARM.at(np.full(ARM.nv, 0.1))
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 5.0))
    C = K.compliance[:3, :3]
    assert (K.slack, K.warnings) == ((), ())
    assert K.margin_without_slack == K.margin
    for u in np.eye(3):
        assert K.along(u) == K.along(-u)
        assert K.along(u) == pytest.approx(1.0 / (u @ C @ u), rel=1e-12)


@pytest.mark.parametrize("wrench", [np.zeros(6), MOMENT])
def test_rows_of_batches_and_sweeps_are_those_of_single_postures(wrench: np.ndarray) -> None:
    q = np.random.default_rng(1).uniform(-0.2, 0.2, (20, ARM.nv))
    names = ["along", "slack"]
    batch = cdsm.evaluate(ARM, q, wrench=wrench, outputs=names, direction=AXES, minimum=0.0)
    sweep = cdsm.sweep(ARM, q, wrench=wrench, outputs=names, direction=AXES)
    assert batch["slack"].dtype == sweep["slack"].dtype == np.bool_
    assert batch["slack"].all()
    np.testing.assert_array_equal(sweep["slack"].values.ravel(), batch["slack"])
    np.testing.assert_allclose(sweep["along"].values.reshape(20, 6), batch["along"], rtol=1e-12)
    for angles, row in zip(q, batch["along"], strict=True):
        pose = ARM.at(angles)
        K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, wrench=wrench))
        np.testing.assert_allclose([K.along(u) for u in AXES], row, rtol=1e-10)


def test_an_arm_that_only_slack_cables_hold_is_unstable_to_one_side() -> None:
    pose = ARM.at(np.zeros(ARM.nv))
    K = cdsm.stiffness(pose, np.zeros(len(ARM.cables)))
    assert K.is_stable
    assert K.verdict.status is cdsm.Status.UNSTABLE_TO_ONE_SIDE
    with pytest.raises(cdsm.SingularStiffness, match="unstable to one side") as error:
        K.along("y")
    worst = ARM.joint_names[int(abs(np.asarray(error.value.direction)).argmax())]
    assert worst in str(error.value)
    assert K.slack[0] in str(error.value)
    row = cdsm.evaluate(
        ARM, [pose.q], np.zeros(len(ARM.cables)), outputs=["along", "slack"], direction="y"
    )
    assert (row.status[0], row["slack"][0]) == (cdsm.Status.UNSTABLE, True)
    assert np.isnan(row["along"][0])


def test_plans_and_their_gradient_take_the_side_of_the_direction() -> None:
    K = prototype()
    pose = K.posture
    found = cdsm.stiffness_range(pose, "-y", 0.0, 300.0)
    assert found.low == pytest.approx(K.along("-y"), rel=1e-6)
    plan = cdsm.plan_stiffness(pose, "-y", 3e5, 0.0, 300.0, at_least=True)
    assert plan.achieved == plan.stiffness.along("-y")
    assert plan.achieved >= 3e5 * (1.0 - 1e-6)
    taut = int(K.tension.argmax())
    gradient = cdsm.stiffness_gradient(K).along("-y")[taut]
    step = 1e-3 * np.eye(len(K.tension))[taut]
    after, before = (cdsm.stiffness(pose, K.tension + way * step).along("-y") for way in (1, -1))
    assert gradient == pytest.approx((after - before) / 2e-3, rel=1e-4, abs=1e-3)


def test_slack_cables_and_tensions_out_of_balance_are_named_wherever_people_read() -> None:
    K = prototype()
    assert K.to_dict()["slack"] == list(K.slack)
    assert K.verdict.status is cdsm.Status.SLACK
    assert (K.verdict.is_held, K.to_dict()["stable"]) == (True, True)
    for text in (str(K), *K.warnings):
        assert K.slack[0] in text
    lines = str(K).splitlines()
    softer = min(K.along("y"), K.along("-y"))
    along = next(line for line in lines if line.startswith("along"))
    assert float(along.split()[-2]) == pytest.approx(softer / 1e3, rel=1e-3)
    assert "softer" in along

    given = cdsm.stiffness(K.posture, np.full(len(ARM.cables), 20.0))
    worst = int(abs(given.residual).argmax())
    sentence = f"{abs(given.residual[worst]):.3g} N m missing at {ARM.joint_names[worst]}"
    assert given.verdict.status is cdsm.Status.UNBALANCED
    assert not given.verdict.is_held
    assert given.to_dict()["stable"] is False
    for text in (str(given), *given.warnings, str(given.to_dict()["warnings"])):
        assert sentence in text
    assert "stable" not in str(given).splitlines()[-1].lower().replace("unstable", "")


def test_the_weakest_joint_stands_in_the_print() -> None:
    K = prototype()
    weakest = ARM.joint_names[int(abs(K.critical_direction).argmax())]
    assert f"{weakest} moves most" in str(K).splitlines()[-1]
