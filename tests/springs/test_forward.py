"""Where an arm comes to rest from what its motors do, and how stiff it is there."""

from functools import partial

import numpy as np
import pytest

import cdsm

LAW = cdsm.LinearElasticity(2e4)
TENSION = np.array([8.0, 0.0, 3.0])
WRENCH = np.array([0.3, 0.2, -0.1, 0.01, 0.0, 0.02])


def section() -> cdsm.Manipulator:
    """Eight universal joints with springs, moved by the three cables of the last one."""
    arm = cdsm.Manipulator(
        cdsm.Geometry.universal(
            joints=8, cables_per_joint=3, link_length=0.05, base_length=0.02, disk_offset=0.01,
            hole_radius=0.01, link_mass=0.01, lead=0.1, joint_stiffness=0.5, joint_limit=1.0,
        ),
        LAW,
    )  # fmt: skip
    return arm.with_cables([each for each in arm.cables if each.name.startswith("cable8")])


ARM = section()


@pytest.mark.parametrize(
    ("given", "motors"),
    [({"tension": TENSION}, "tension"), ({"pull": [0.004, -0.01, 0.0]}, "locked")],
)
def test_compliance_is_the_derivative_of_forward_statics(
    given: dict[str, object], motors: str
) -> None:
    solve = partial(cdsm.forward_statics, ARM, **given)  # type: ignore[arg-type]
    rest = solve(wrench=WRENCH)
    assert (rest.motors, rest.branch) == (motors, 1.0)
    assert abs(rest.residual).max() < 1e-10
    assert (motors == "tension") == (not rest.stiffness.cable_stiffness.any())
    errors = []
    for h in (2e-2, 1e-2):
        columns = []
        for axis in np.eye(6)[:3]:
            ends = [
                solve(wrench=WRENCH + s * h * axis, start=rest.pose.q).pose.tip[:3, 3]
                for s in (1.0, -1.0)
            ]
            columns.append((ends[0] - ends[1]) / (2.0 * h))
        C = rest.compliance[:3, :3]
        errors.append(abs(np.transpose(columns) - C).max() / abs(C).max())
    assert errors[1] < 1e-2
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)


def test_rest_lengths_are_pulls_from_the_straight_arm() -> None:
    pull = np.array([0.004, 0.001, 0.0])
    straight = ARM.at(np.zeros(ARM.nv)).cable_lengths
    one = cdsm.forward_statics(ARM, pull=pull)
    other = cdsm.forward_statics(ARM, rest_lengths=straight - pull)
    np.testing.assert_allclose(one.pose.q, other.pose.q, atol=1e-9)
    # an equilibrium of motors locked there stays there
    again = cdsm.equilibrium(one.pose, one.tension)
    np.testing.assert_allclose(again.pose.q, one.pose.q, atol=1e-9)


def test_the_two_stiffnesses_of_a_posture_differ() -> None:
    held = cdsm.forward_statics(ARM, tension=TENSION)
    locked = cdsm.equilibrium(held.pose, TENSION)
    np.testing.assert_allclose(locked.pose.q, held.pose.q, atol=1e-9)
    assert locked.along("z") > 2.0 * held.along("z")


def test_what_cannot_be_solved_is_named() -> None:
    for given, said in (
        ({}, "none given"),
        ({"tension": TENSION, "pull": TENSION}, "tension and pull given"),
        ({"tension": [1.0, 2.0]}, r"\(3,\) needed"),
        ({"tension": [-1.0, 0.0, 0.0]}, "cables only pull"),
        ({"pull": [1.0, 0.0, 0.0]}, "leaves -0.53 m of cable8_1"),
    ):
        with pytest.raises(cdsm.InvalidInput, match=said):
            cdsm.forward_statics(ARM, **given)
    loose = ARM.with_springs(dict.fromkeys(ARM.joint_names[:-1], 1.0))
    with pytest.raises(cdsm.EquilibriumError, match="nothing holds joint8_2"):
        cdsm.forward_statics(loose, tension=TENSION)
