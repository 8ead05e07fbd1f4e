"""An arm as a function of parameters by name."""

import math

import pytest

import cdsm

GEOMETRY = cdsm.Geometry.universal(
    joints=2,
    cables_per_joint=3,
    link_length=0.06,
    base_length=0.03,
    disk_offset=0.012,
    hole_radius=[0.025, 0.02],
    link_mass=0.12,
    lead=0.3,
)
ARM = cdsm.Manipulator(GEOMETRY, cdsm.LinearElasticity(48e3), gravity="-y").with_friction(0.1)


def test_nothing_changed_is_the_same_arm() -> None:
    every = ("friction", "rigidity", "lead", "hole_radius@1", "hole_radius@2", "disk_offset@1")
    parameters = cdsm.ArmParameters(ARM, (*every, "link_length", "link_mass@2"))
    same = parameters(**parameters.present)
    assert same.geometry.cables == GEOMETRY.cables
    assert same.cables == ARM.cables
    assert same.at([0.1] * 4).gravity_torque == pytest.approx(ARM.at([0.1] * 4).gravity_torque)


def test_each_parameter_is_where_it_says() -> None:
    names = ("friction@2", "rigidity", "spring@1", "lead@2", "hole_radius@1", "link_mass")
    arm = cdsm.ArmParameters(ARM, names)(
        **{"friction@2": 0.3, "rigidity": 0.5, "spring@1": 2e4, "lead@2": 0.4},
        **{"hole_radius@1": 0.03, "link_mass": 0.2},
    )
    first, second = arm.cables[0], arm.cables[3]
    assert [site.friction for site in first.sites[:-1]] == [0.1]
    assert {site.friction for site in second.sites[:-1]} == {0.3}
    assert (first.series_stiffness, second.series_stiffness) == (2e4, math.inf)
    assert (first.lead, second.lead) == (0.3, 0.4)
    assert all(cable.elasticity == cdsm.LinearElasticity(24e3) for cable in arm.cables)
    assert len({id(cable.elasticity) for cable in arm.cables}) == 1  # computed together
    radii = [math.hypot(*site.position[1:]) for site in second.sites]
    assert radii == pytest.approx([0.03, 0.03, 0.02, 0.02])
    assert [link.mass for link in arm.geometry.links] == [0.2, 0.2]
    assert arm.gravity.tolist() == ARM.gravity.tolist()


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (("hole_radus",), "hole_radus"),
        (("hole_radius@3",), "joints 1 to 2"),
        (("hole_radius@x",), "joints 1 to 2"),
        (("lead", "lead"), "lead: frees lead of a joint twice"),
        (("lead@1", "lead"), "lead: frees lead of a joint twice"),
    ],
)
def test_bad_names_are_refused(names: tuple[str, ...], said: str) -> None:
    with pytest.raises(cdsm.CdsmError, match=said):
        cdsm.ArmParameters(ARM, names)


def test_bad_values_are_refused() -> None:
    parameters = cdsm.ArmParameters(ARM, ("rigidity", "spring", "hole_radius", "friction"))
    for name, value in (("rigidity", -1.0), ("spring", 0.0), ("hole_radius", -1.0)):
        with pytest.raises(cdsm.CdsmError, match=r"-1|positive|0"):
            parameters(**{name: value})
    with pytest.raises(cdsm.InvalidInput, match="friction"):
        parameters(friction=-0.1)
    with pytest.raises(cdsm.InvalidInput, match="lead"):
        parameters(lead=0.1)
    free = cdsm.Manipulator.from_urdf(ARM.urdf, ARM.cables, tip="tool0")
    with pytest.raises(cdsm.InvalidInput, match="geometry"):
        cdsm.ArmParameters(free, ("lead",))


def test_a_cable_has_parameters_of_its_own() -> None:
    names = ("phase@1", "hole_angle@cable2_1", "lead@cable2_1", "friction@cable1_2")
    parameters = cdsm.ArmParameters(ARM, names)
    assert parameters.present["phase@1"] == 0.0
    assert parameters.present["lead@cable2_1"] == 0.3
    values = {"phase@1": 0.1, "hole_angle@cable2_1": 0.2, "lead@cable2_1": 0.5}
    arm = parameters(**values, **{"friction@cable1_2": 0.3})
    routes, old = arm.geometry.cables, GEOMETRY.cables
    assert routes[0].angle == pytest.approx(old[0].angle + 0.1)
    assert (routes[3].angle, routes[3].lead, routes[4].lead) == (0.2, 0.5, 0.3)
    y, z = arm.cables[3].sites[0].position[1:]
    assert math.atan2(z, y) == pytest.approx(0.2)
    assert arm.cables[1].sites[0].friction == 0.3 != arm.cables[0].sites[0].friction
    with pytest.raises(cdsm.InvalidInput, match="twice"):
        cdsm.ArmParameters(ARM, ("lead@2", "lead@cable2_1"))
    with pytest.raises(cdsm.InvalidInput, match="twice"):
        cdsm.ArmParameters(ARM, ("phase", "hole_angle@cable2_1"))
    with pytest.raises(cdsm.InvalidInput, match="cable9_1"):
        cdsm.ArmParameters(ARM, ("lead@cable9_1",))
