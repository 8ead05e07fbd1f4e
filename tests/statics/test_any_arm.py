"""Equilibria and load cycles of arms with sliding joints, laws of a user, and cables of force."""

import math
from typing import Any

import numpy as np
import pytest

import cdsm
from tests.support.locked import potential

STIFFENING = cdsm.Elasticity.from_rigidity(lambda F: 4e3 * (1.0 + F / 50.0), 0.0, 2000.0)
LAWS = {"linear": cdsm.LinearElasticity(2e4), "user": STIFFENING}

URDF = """<robot name="lift">
  <link name="base"/>
  <link name="carriage"><inertial><origin xyz="0 0 0"/><mass value="0.5"/>
    <inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="arm"><inertial><origin xyz="0.1 0 0"/><mass value="0.2"/>
    <inertia ixx="1e-4" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="tool"/>
  <joint name="slide" type="prismatic"><parent link="base"/><child link="carriage"/>
    <axis xyz="0 0 1"/><limit lower="-0.05" upper="0.05" effort="100" velocity="1"/></joint>
  <joint name="turn" type="revolute"><parent link="carriage"/><child link="arm"/>
    <axis xyz="0 1 0"/><limit lower="-0.6" upper="0.6" effort="100" velocity="1"/></joint>
  <joint name="end" type="fixed"><parent link="arm"/><child link="tool"/>
    <origin xyz="0.2 0 0"/></joint>
</robot>"""


def lift(law: cdsm.Elasticity, forced: tuple[str, ...] = (), friction: float = 0.0) -> Any:
    """A carriage on a slide, held from above and below, and a hinge held by two cables."""

    def cable(name: str, *sites: tuple[str, tuple[float, float, float]]) -> cdsm.Cable:
        places = [cdsm.Site(link, place) for link, place in sites]
        if len(places) > 2:
            places[1] = cdsm.Site(*sites[1], friction=friction)
        control: cdsm.cable.Control = "force" if name in forced else "position"
        return cdsm.Cable(name, tuple(places), law, lead=0.0, control=control)

    cables = [
        cable("up", ("base", (0.0, 0.02, 0.3)), ("carriage", (0.0, 0.02, 0.02))),
        cable("down", ("base", (0.0, -0.02, -0.3)), ("carriage", (0.0, -0.02, -0.02))),
        *(
            cable(
                name,
                ("base", (-0.1, 0.0, s * 0.25)),
                ("carriage", (-0.03, 0.0, s * 0.06)),
                ("arm", (0.12, 0.0, s * 0.02)),
            )
            for name, s in (("over", 1.0), ("under", -1.0))
        ),
    ]
    return cdsm.Manipulator.from_urdf(URDF, cables=cables, tip="tool")


def weight(there: cdsm.Posture) -> float:
    """Potential energy of the carriage and of the arm."""
    height = (there.link_pose("arm") @ [0.1, 0.0, 0.0, 1.0])[2]
    return 9.81 * float(0.5 * there.q[0] + 0.2 * height)


FORCED = {"locked": (), "one force": ("over",), "two forces": ("up", "under")}
CASES = [("linear", "locked"), ("user", "one force"), ("linear", "two forces")]


@pytest.mark.parametrize(("law", "forced"), CASES)
def test_rest_is_the_minimum_of_the_potential(law: str, forced: str) -> None:
    arm = lift(LAWS[law], FORCED[forced])
    pose = arm.at([0.01, 0.1])
    pull = cdsm.distribute_tension(pose, 30.0)
    force = np.array([2.0, 0.0, -6.0])
    rest = cdsm.equilibrium(pose, pull, np.append(force, np.zeros(3)))
    assert rest.stable
    assert abs(rest.residual).max() < 1e-10
    assert abs(rest.pose.q - pose.q).max() > 1e-4
    energy, rng = potential(pose, pull.values, force, weight), np.random.default_rng(2)
    for _ in range(10):
        step = 1e-4 * rng.normal(size=2)
        more = energy(arm.at(rest.pose.q + step)) - energy(rest.pose)
        assert more == pytest.approx(step @ rest.stiffness.joint @ step / 2.0, rel=0.05)


def test_stop_of_a_slide_carries_what_the_cables_do_not() -> None:
    pose = lift(LAWS["linear"]).at([0.045, 0.0])
    pull = cdsm.distribute_tension(pose, 30.0)
    rest = cdsm.equilibrium(pose, pull, [0.0, 0.0, 4000.0, 0.0, 780.0, 0.0])
    assert rest.at_limit == ("slide",)
    assert rest.pose.q[0] == pytest.approx(0.05, abs=1e-15)
    assert rest.stop_torque[0] < 0.0


@pytest.mark.parametrize(("law", "forced"), CASES)
def test_friction_loops_close_and_lose_work(law: str, forced: str) -> None:
    pose = lift(LAWS[law], FORCED[forced], friction=0.2).at([0.01, 0.1])
    pull = cdsm.distribute_tension(pose, 30.0)
    path = np.zeros((40, 6))
    path[:, 2] = 8.0 * np.sin(np.linspace(0.0, 4.0 * math.pi, 41)[1:])
    history = cdsm.load_cycle(pose, pull, path)
    assert not history.snaps.any()
    span = float(np.ptp(history.tip, axis=0).max())
    np.testing.assert_allclose(history.tip[39], history.tip[19], atol=1e-4 * span)
    z, f = history.tip[19:, 2], history.wrenches[19:, 2]
    work = float(np.diff(z) @ (f[1:] + f[:-1]) / 2.0)
    assert work == pytest.approx(history.dissipated[20:].sum(), rel=0.05, abs=1e-9)
    for T, cable in zip(history.tensions, pose.arm.cables, strict=True):
        if cable.control == "force":  # its motor holds the tension
            np.testing.assert_allclose(T[:, 0], pull[cable.name], rtol=1e-12)
