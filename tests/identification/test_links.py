"""Weights that hang on links, and links that are read, in measurements and their files."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from tests.core.test_loads import Q, backbone, universal

HUNG = cdsm.Load("link3", (0.0, 0.0, -4.0))


def _soft(rigidity: float = 2e4, friction: float = 0.0) -> cdsm.Manipulator:
    arm = universal().with_friction(friction)
    law = cdsm.LinearElasticity(rigidity)
    cables = [cdsm.Cable(cable.name, cable.sites, law, lead=0.3) for cable in arm.cables]
    return arm.with_cables(cables)


@pytest.mark.parametrize("force", [0.0, 3.0])
def test_stiffness_measured_on_a_link_finds_the_wire(force: float) -> None:
    arm = _soft(2.3e4)
    pose = arm.at(Q)
    where = {"link": "link2", "point": (0.01, 0.0, 0.02)}
    tension = cdsm.distribute_tension(pose, 30.0, wrench=[HUNG])
    if force:
        u = force * np.array([0.0, 0.0, -1.0])
        value = cdsm.weight_test(pose, tension, u, **where).stiffness  # type: ignore[arg-type]
    else:
        value = cdsm.stiffness(pose, tension).along("-z", **where)  # type: ignore[arg-type]
    measurement = cdsm.Measurement(
        value,
        "-z",
        tuple(Q),
        minimum=30.0,
        std=0.01 * value,
        wrench=(HUNG,),
        force=force,
        link="link2",
        point=(0.01, 0.0, 0.02),
    )
    fit = cdsm.identify(
        lambda EA: _soft(EA), [measurement], {"EA": (1e4, 4e4)}, start={"EA": 1.5e4}
    )
    assert fit.values[0] == pytest.approx(2.3e4, rel=1e-5)
    tip = cdsm.Measurement(value, "-z", tuple(Q), minimum=30.0, std=1.0, force=force)
    assert tip.predict(pose, cdsm.distribute_tension(pose, 30.0))[0] < 0.5 * value


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_a_loop_on_a_link_is_a_load_cycle_there(friction: float) -> None:
    arm = _soft(friction=friction)
    pose = arm.at(Q)
    forces = [0.0, 2.0, 4.0, 2.0, 0.0]
    test: dict[str, Any] = {
        "direction": "-z",
        "angles": tuple(Q),
        "forces": tuple(forces),
        "displacement_std": 1e-5,
        "minimum": 30.0,
    }
    read = cdsm.WeightLoop(**test, wrench=(HUNG,), link="link2").simulated(arm)
    assert read.displacements is not None
    rows = [[HUNG, cdsm.Load("link2", (0.0, 0.0, -f))] for f in forces]
    pull = cdsm.distribute_tension(pose, 30.0, wrench=[HUNG])
    history = cdsm.load_cycle(pose, pull.values, rows, substeps=2)
    place = pose.link_pose("link2")[:3, 3]
    down = [place[2] - history.pose(k).link_pose("link2")[2, 3] for k in range(5)]
    np.testing.assert_allclose(read.displacements, down, atol=1e-7 if friction == 0.0 else 1e-15)
    assert max(down) > 1e-4
    at_tip = cdsm.WeightLoop(**test).simulated(arm)
    assert at_tip.displacements is not None
    assert np.max(at_tip.displacements) > 2.0 * max(down)


def test_a_disk_is_read_while_a_weight_hangs_on_another(tmp_path: Path) -> None:
    """A rod of 81 GPa, found from one disk; the tip is not measured at all."""
    arm = backbone()
    cable = arm.cables.names[0]
    weight = [cdsm.Load("disk4", (0.0, 0.0, -0.05 * 9.81))]
    rest = cdsm.forward_statics(arm, tension={cable: 2.0}, wrench=weight)
    disk = next(disk for disk in arm.geometry.disks if disk.link == "disk7")
    place = (rest.pose.link_pose("disk7") @ [disk.x, 0.0, 0.0, 1.0])[:3]
    text = f"{cable} [N],x [mm],z [mm],link,load_link,mass [g]\n"
    text += f"2,{1e3 * place[0]:.9f},{1e3 * place[2]:.9f},disk7,disk4,50\n"
    path = tmp_path / "disks.csv"
    path.write_text(text)
    (read,) = cdsm.read_tip_positions(path, arm, std=1e-4)
    assert read.link == "disk7"
    (hung,) = read.wrench
    assert isinstance(hung, cdsm.Load)
    assert hung.link == "disk4"
    assert hung.force == pytest.approx((0.0, 0.0, -0.05 * 9.81))
    np.testing.assert_allclose(read.tip_coordinates(rest.pose), place[[0, 2]], atol=1e-12)
    model_of = cdsm.ArmParameters(arm, ("bending_stiffness",))
    exact = float(model_of.values("bending_stiffness")[0])
    bounds = {"bending_stiffness": (0.7 * exact, 1.4 * exact)}
    fit = cdsm.identify(model_of, [read], bounds)
    assert fit.values[0] == pytest.approx(exact, rel=1e-4)


def test_a_file_of_loops_has_a_column_link(tmp_path: Path) -> None:
    arm = _soft()
    path = tmp_path / "loops.csv"
    path.write_text(
        "test,direction,force [N],displacement [mm],link,minimum [N]\n"
        "a,-z,0,0,link2,30\na,,2,0.1,,\nb,-z,0,0,,30\nb,,2,0.3,,\n"
    )
    a, b = cdsm.read_loops(path, arm, displacement_std=1e-5)
    assert (a.link, b.link) == ("link2", None)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("test,direction,force [N],link,minimum [N]\na,-z,0,lnik2,9\na,,2,,\n", "column link: .*"),
        ("test,direction,force [N],link,minimum [N]\na,-z,0,link2,9\na,,2,link3,\n", "'link3' giv"),
        ("test,direction,force [N],link,minimum [N]\na,-z,0,base_link,9\na,,2,,\n", "is the base"),
    ],
)
def test_wrong_links_of_files_are_named(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "loops.csv"
    path.write_text(text)
    with pytest.raises(cdsm.FileError, match=rf"line [23], column link: .*{said}|{said}"):
        cdsm.read_loops(path, _soft(), displacement_std=1e-5)


def test_a_load_link_needs_a_load(tmp_path: Path) -> None:
    path = tmp_path / "tips.csv"
    path.write_text("cable1_1 [N],x [mm],load_link\n2,90,link2\n")
    with pytest.raises(cdsm.FileError, match="column load_link, but no load: add force"):
        cdsm.read_tip_positions(path, _soft(), std=1e-4)
    with pytest.raises(cdsm.InvalidInput, match="point: is a point of a link: give link="):
        cdsm.TipPosition(x=0.1, tension=(1.0,), std=1e-3, point=(0.0, 0.0, 0.0))
    with pytest.raises(cdsm.InvalidInput, match="link: 3 given"):
        cdsm.TipPosition(x=0.1, tension=(1.0,), std=1e-3, link=3)  # type: ignore[arg-type]
