"""Arms of others: their sizes obey what their sources say of them, and files keep them."""

import math
from pathlib import Path

import numpy as np
import pytest

import cdsm
from cdsm import presets


def test_the_tentacle_is_a_cone() -> None:
    """Its mass is that of two frustums, and a moment turns its end by ∫ M/EI ds."""
    E, density = 400e3, 1200.0
    arm = presets.silicone_tentacle(E, density=density, gravity=(0.0, 0.0, 0.0))
    parts = (0.01541, 0.00642, 0.305), (0.00642, 0.0048, 0.055)
    volume = sum(math.pi / 3.0 * L * (a * a + a * b + b * b) for a, b, L in parts)
    mass = sum(joint.mass for joint in arm.geometry.joints)
    assert mass == pytest.approx(density * volume, rel=1e-3)
    assert arm.length == pytest.approx(0.36)
    M = 1e-6
    rest = cdsm.forward_statics(arm, tension=[0.0, 0.0], wrench=[0.0, 0.0, 0.0, 0.0, 0.0, M])
    turn = math.atan2(rest.pose.tip[1, 0], rest.pose.tip[0, 0])
    lengths = [L / 3.0 / (a - b) * (b**-3 - a**-3) for a, b, L in parts]
    assert turn == pytest.approx(4.0 * M / (math.pi * E) * sum(lengths), rel=2e-3)


def test_cables_of_the_spirob_are_straight_and_its_segments_shrink_evenly() -> None:
    """The cables of its model lie on two straight lines, and each segment is 8.24 % shorter."""
    pose = presets.spirob().at(np.zeros(13))
    for cable, sign in zip(pose.arm.cables, (1.0, -1.0), strict=True):
        sites = cable.only_sites("")
        holes = [pose.link_pose(site.link) @ [*site.position, 1.0] for site in sites]
        x, _, z, _ = np.transpose(holes)
        line = np.polyfit(x, sign * z, 1)
        assert abs(np.polyval(line, x) - sign * z).max() < 2e-6
        assert len(holes) == 28
    links = [f"segment{k}" for k in range(1, 14)] + ["tool0"]
    ends = np.array([0.0, *(pose.link_pose(link)[0, 3] for link in links)])
    lengths = np.diff(ends)
    np.testing.assert_allclose(lengths[1:] / lengths[:-1], 0.9176, atol=2e-4)


@pytest.mark.parametrize(
    "build", [presets.rod_one_tendon, presets.silicone_tentacle, presets.spirob, presets.simplex]
)
def test_files_keep_them(build: type[cdsm.Manipulator], tmp_path: Path) -> None:
    arm = build()
    again = cdsm.Manipulator.read(arm.write(tmp_path / "arm.toml"))
    q = 0.01 * np.arange(1.0, arm.nv + 1.0) / arm.nv
    tension = np.linspace(1.0, 2.0, len(arm.cables))
    one, other = (cdsm.stiffness(each.at(q), tension) for each in (arm, again))
    np.testing.assert_allclose(other.joint, one.joint, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", ["density", "youngs_modulus"])
def test_numbers_of_the_tentacle_are_numbers(name: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=f"{name}: holds <U1 entries, such as 'a'; real"):
        presets.silicone_tentacle(**{name: "a"})  # type: ignore[arg-type]
