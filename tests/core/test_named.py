"""Results by name: mappings, tables of text, dictionaries for JSON, pandas and xarray."""

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.quantities import names_of
from tests.support.arms import mixed_arm, random_posture

POSE = random_posture(mixed_arm(), 3)
PULL = cdsm.distribute_tension(POSE, 10.0)
K = cdsm.stiffness(POSE, PULL)
NAMES = [cable.name for cable in POSE.arm.cables]


def test_tensions_and_cables_are_found_by_name() -> None:
    assert dict(PULL) == dict(zip(NAMES, PULL.values.tolist(), strict=True))
    assert PULL[NAMES[3]] == PULL.values[3]
    assert NAMES[0] in PULL
    assert "cable9_9" not in PULL
    np.testing.assert_array_equal(np.asarray(PULL), PULL.values)
    with pytest.raises(cdsm.InvalidInput, match=r"By index there is the array tension\.values"):
        _ = PULL[0]  # type: ignore[index]
    cables = POSE.arm.cables
    assert cables[NAMES[2]] is cables[2]
    assert cables.names == tuple(NAMES)
    assert cables[:2] == tuple(cables)[:2]
    assert POSE.arm.with_cables(cables[0]).cables == (cables[0],)
    for of in (PULL, cables, K.shares("z")):
        with pytest.raises(cdsm.InvalidInput, match="did you mean"):
            _ = of["cabel1_1"]


def test_moment_arms_times_tensions_are_the_torque_that_balances_gravity() -> None:
    arms = POSE.moment_arms
    np.testing.assert_allclose(arms.values.T @ PULL.values, POSE.gravity_torque, atol=1e-12)
    # Eq. 13: tau = -J_L^T F; a motion that a cable pulls shortens it
    q = POSE.q.copy()
    q[1] += 1e-6
    shorter = (POSE.cable_lengths - POSE.arm.at(q).cable_lengths) / 1e-6
    np.testing.assert_allclose(arms.values[:, 1], shorter, atol=1e-6)
    joint = POSE.arm.joint_names[1]
    assert arms[NAMES[0], joint] == arms.values[0, 1]
    for wrong in ((NAMES[0], "joint9"), ("cable9", joint), "ab", 0):
        with pytest.raises(cdsm.InvalidInput):
            _ = arms[wrong]  # type: ignore[index]


def test_planar_arms_have_a_cartesian_stiffness_in_their_plane() -> None:
    geometry = cdsm.Geometry.hinged(
        joints=3, twist=0.0, cables_per_joint=2, link_length=0.05, base_length=0.03,
        disk_offset=0.01, hole_radius=0.02, link_mass=0.1,
    )  # fmt: skip
    pose = cdsm.Manipulator(geometry, cdsm.LinearElasticity(5e4)).at([0.2, -0.3, 0.25])
    planar = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 30.0))
    with pytest.raises(cdsm.SingularStiffness):
        _ = planar.cartesian
    matrix = planar.cartesian_in(("x", "z"))
    C = planar.compliance[np.ix_([0, 2], [0, 2])]
    np.testing.assert_allclose(matrix @ C, np.eye(2), atol=1e-12)
    # along a line it is what a weight measures
    assert planar.cartesian_in([[1.0, 0.0, 1.0]])[0, 0] == pytest.approx(planar.along([1, 0, 1]))
    assert "the tip cannot move along (0, 1, 0)" in str(planar)
    with pytest.raises(cdsm.SingularStiffness, match=r"cannot move along \(0, 1, 0\)"):
        planar.cartesian_in(("x", "y"))
    with pytest.raises(cdsm.InvalidInput, match="not orthogonal"):
        planar.cartesian_in([[1, 0, 0], [1, 0, 1]])
    np.testing.assert_allclose(K.cartesian_in(["x", "y", "z"]), K.cartesian, rtol=1e-9)


U = (0.0, 0.3, 1.0)
RESULTS: dict[str, Callable[[], Any]] = {
    "Posture": lambda: POSE,
    "MomentArms": lambda: POSE.moment_arms,
    "Tension": lambda: PULL,
    "Stiffness": lambda: K,
    "Shares": lambda: K.shares(U),
    "KinematicSolution of lengths": lambda: cdsm.solve_joint_angles(POSE.arm, POSE.cable_lengths),
    "Equilibrium": lambda: cdsm.equilibrium(POSE, PULL),
    "WeightTest": lambda: cdsm.weight_test(POSE, PULL, (0.0, 0.0, -1.0), steps=2),
    "StiffnessPlan": lambda: cdsm.plan_stiffness(POSE, U, K.along(U), 10.0, 200.0),
    "PathPlan": lambda: cdsm.plan_path(
        *(POSE.arm, U, [K.along(U), 1e9], 10.0, 200.0),
        angles=[POSE.q, POSE.q],
        max_change_per_sample=50.0,
    ),
    "CriticalLoad": lambda: cdsm.critical_load(POSE, (0.0, 0.0, -1.0, 0.0, 0.0, 0.0), 10.0),
    "Report": lambda: K.report(),
    "ForcePolytope": lambda: cdsm.force_polytope(POSE, 1.0, 200.0),
    "Clearance": lambda: cdsm.clearance(POSE, 1e-3),
}


ROWS = {"Tension": 9, "Shares": 9, "MomentArms": 9, "WeightTest": 2, "PathPlan": 2}


@pytest.mark.parametrize("name", RESULTS)
def test_results_become_strict_json_and_tables_with_units(name: str) -> None:
    result = RESULTS[name]()
    assert "nan" not in str(result)
    found = result.to_dict()
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    if name != "Report":
        assert any(key.endswith(("_N", "_m", "_N_per_m", "_rad", "_Hz")) for key in found)
    if name in ROWS:
        table = result.to_pandas()
        assert len(table) == ROWS[name]
        assert any("[N" in column or "[m" in column for column in table.columns)


def test_batch_has_one_row_for_each_posture_in_pandas_and_labels_in_xarray() -> None:
    q = np.array([POSE.q, 0.5 * POSE.q, 99.0 * POSE.q])
    outputs = [name for name in names_of("batch") if name != "along"]
    batch = cdsm.evaluate(
        POSE.arm, q, minimum=10.0, outputs=[*outputs, "along"], direction=["z", "x"]
    )
    found, table = batch.to_xarray(), batch.to_pandas()
    assert len(table) == 3
    assert table["status"].to_list() == ["ok", "ok", "beyond_limits"]
    np.testing.assert_array_equal(found["tip_position"][0], batch["tip"][0, :3, 3])
    np.testing.assert_array_equal(found["joint_stiffness"], batch["joint"])
    joint = POSE.arm.joint_names[2]
    np.testing.assert_array_equal(
        found["length_jacobian"].sel(cable=NAMES[1], joint=joint), batch["length_jacobian"][:, 1, 2]
    )
    np.testing.assert_array_equal(table[f"tension {NAMES[2]} [N]"], batch["tension"][:, 2])
    np.testing.assert_array_equal(table["along (0, 0, 1) [N/m]"], batch["along"][:, 0])
    pulls = cdsm.distribute_tensions(POSE.arm, q, 10.0)
    np.testing.assert_array_equal(pulls.to_xarray()["tension"], pulls.values)
    np.testing.assert_array_equal(pulls.to_pandas()[f"tension {NAMES[0]} [N]"], pulls.values[:, 0])
