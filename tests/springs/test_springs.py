"""Springs at joints: in the balance, in K_θ, in batches, and in MuJoCo."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.batch import solution
from cdsm.support.values import Array
from tests.support.arms import readme_geometry
from tests.support.differences import assert_second_order, gravity_energy

WRENCH = np.array([1.0, 2.0, -1.0, 0.1, 0.05, -0.02])
Q = np.array([0.1, -0.2, 0.15, 0.1, -0.1, 0.2])


def sprung(**changes: Any) -> cdsm.Manipulator:
    sizes: dict[str, Any] = {"joints": 3, "link_length": 0.05, "base_length": 0.02}
    sizes |= {"disk_offset": 0.01, "hole_radius": 0.02, "link_mass": 0.05, "lead": 0.1}
    sizes |= {"joint_stiffness": [2.0, 1.0, 0.5], "rest_angle": [0.0, 0.1, 0.0]}
    return cdsm.Manipulator(readme_geometry(**(sizes | changes)), cdsm.LinearElasticity(5e4))


def test_stiffness_is_the_hessian_of_the_potential() -> None:
    """Of the energy of cables, weight, load and springs: written down here once more."""
    arm = sprung()
    pose = arm.at(Q)
    K = cdsm.stiffness(pose, np.linspace(5.0, 20.0, 9), np.append(WRENCH[:3], np.zeros(3)))
    k, free = np.repeat([2.0, 1.0, 0.5], 2), np.repeat([0.0, 0.1, 0.0], 2)

    def potential(q: Array) -> Array:
        there = arm.at(q, check_limits=False)
        longer = there.cable_lengths - pose.cable_lengths
        cables = K.tension @ longer + 0.5 * K.cable_stiffness @ longer**2
        work = K.wrench[:3] @ there.tip[:3, 3]
        return np.array(cables + gravity_energy(there) - work + 0.5 * k @ (q - free) ** 2)

    assert_second_order(potential, K.joint, Q, order=2, tolerance=1e-8)
    np.testing.assert_array_equal(K.springs, np.diag(k))


def test_springs_add_to_the_balance_what_they_are() -> None:
    arm = sprung()
    F = cdsm.distribute_tension(arm.at(Q), 5.0, wrench=WRENCH)
    assert abs(F.residual).max() < 1e-12
    K, bare = cdsm.stiffness(arm.at(Q), F), arm.with_springs({}).at(Q)
    without = cdsm.stiffness(bare, F.values, WRENCH)
    torque = arm.springs.stiffness * (Q - arm.springs.angle)
    np.testing.assert_allclose(K.residual - without.residual, torque, atol=1e-12)
    assert "of it springs" in str(K)
    assert "PASS" in str(K.report())
    # and to that of many postures
    names = ("tension", "joint", "residual", "along")
    rows = cdsm.evaluate(arm, np.tile(Q, (3, 1)), None, WRENCH, names, minimum=5.0, direction="z")
    np.testing.assert_allclose(rows["along"][0], K.along("z"), rtol=1e-10)
    assert abs(rows["residual"]).max() < 1e-11


@pytest.mark.parametrize("of", ["*", "joint2_*"])
@pytest.mark.parametrize("coupled", [False, True])
def test_uncertain_springs_are_springs_of_other_arms(of: str, coupled: bool) -> None:
    alike = {"joint_stiffness": 1.0, "rest_angle": 0.1, "coupled": True}
    arm = sprung(**(alike if coupled else {}))
    q = np.tile(Q[:2], 3)[: arm.nv]

    def along(factor: float, redistribute: bool) -> float:
        own = zip(arm.springs.joints, arm.springs.stiffness, arm.springs.angle, strict=True)
        chosen = "joint2" if of.startswith("joint2") else "joint"
        springs = {name: (k * (factor if chosen in name else 1.0), x) for name, k, x in own}
        pose = arm.with_springs(springs).at(q)
        F = cdsm.distribute_tension(pose if redistribute else arm.at(q), 5.0, wrench=WRENCH)
        return cdsm.stiffness(pose, F.values, WRENCH).along("z")

    least = cdsm.distribute_tension(arm.at(q), 5.0, wrench=WRENCH)
    uncertain = cdsm.Tolerances(joint_stiffness=cdsm.Tolerance(0.05, correlation=1.0, of=of))
    for redistribute in (False, True):
        budget = cdsm.uncertainty(
            arm.at(q), least, uncertain, direction="z", redistribute=redistribute
        )
        rise = abs(along(1.005, redistribute) - along(0.995, redistribute)) / 0.01
        assert budget.standard_uncertainty == pytest.approx(0.05 * rise, rel=1e-5)
    assert budget.contributions.keys() == {"joint_stiffness"}


OVERRIDDEN: tuple[dict[str, Any], ...] = ({"joint1_1": 3.0, "joint2_2": (1.0, 0.2)}, {})


@pytest.mark.parametrize("arm", [sprung(), *map(sprung().with_springs, OVERRIDDEN)])
def test_springs_are_kept_by_files_other_cables_and_dimensions(
    arm: cdsm.Manipulator, tmp_path: Path
) -> None:
    assert cdsm.Manipulator.read(arm.write(tmp_path / "ARM.toml")) == arm
    assert cdsm.Geometry.from_toml(arm.geometry.to_toml()) == arm.geometry
    assert arm.with_springs({"joint1_1": 9.0}) != arm
    rough = arm.with_friction(0.1).with_gravity("-y")
    wider = cdsm.ArmParameters(arm, ("hole_radius",))(hole_radius=0.021)
    for again in (rough, wider):
        np.testing.assert_array_equal(again.springs.stiffness, arm.springs.stiffness)
        np.testing.assert_array_equal(again.springs.angle, arm.springs.angle)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"joint1_1": -1.0}, r"springs\['joint1_1'\]: -1 N m/rad given"),
        ({"joint1_1": (1.0, 2.0, 3.0)}, "stiffness, or"),
        ({"joint1_1": np.nan}, "joint1_1"),
        ([1.0], "dict of joint names"),
        ({"joint9_1": 1.0}, "joint9_1"),
    ],
)
def test_springs_that_cannot_be_are_named(given: Any, said: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=said):
        sprung().with_springs(given)
    with pytest.raises(cdsm.GeometryError, match="joint_stiffness"):
        sprung(joint_stiffness=-1.0)
    bare, uncertain = sprung().with_springs({}).at(Q), cdsm.Tolerances(joint_stiffness=0.05)
    with pytest.raises(cdsm.InvalidInput, match="no springs at its joints"):
        cdsm.uncertainty(bare, [9.0] * 9, uncertain, direction="z")


@pytest.mark.parametrize(
    "outputs", [("joint",), ("joint", "along"), ("joint", "margin", "springs")]
)
def test_a_batch_counts_each_spring_once(outputs: tuple[str, ...]) -> None:
    arm = cdsm.presets.virtual_prototype().with_springs({"joint1_1": 5.0, "joint3_2": 2.0})
    q, F = np.random.default_rng(0).uniform(-0.1, 0.1, (3, arm.nv)), np.full(15, 60.0)
    u = "z" if "along" in outputs else None
    joint = cdsm.stiffness(arm.at(q[1]), F).joint
    for compiled in (solution.numpy_kernels, solution.compiled_kernels):
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(solution, "choose_kernels", lambda *_, kernels=compiled: kernels())
            batch = cdsm.evaluate(arm, q, F, outputs=outputs, direction=u)
        np.testing.assert_allclose(batch["joint"][1], joint, rtol=0.0, atol=1e-10 * joint.max())
