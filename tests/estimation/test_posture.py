"""Postures from tensions, wires and tracked points: a measured rod, exact and noisy readings."""

from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

import cdsm
from cdsm.support.values import Array
from tests.estimation.test_loads import Q, held, lost_in_holes
from tests.support.arms import readme_geometry
from tests.validation.rod import TENSIONS, disk_centres, in_plane, predicted, shapes_in_plane

W = [1.0, -2.0, 3.0, 0, 0, 0]


def off(shapes: Array) -> float:
    """RMS distance [mm] from the measured shapes of the rod, but for the first."""
    distance = np.linalg.norm(in_plane(shapes) - shapes_in_plane(), axis=-1)[1:]
    return float(np.sqrt((distance**2).mean()))


@pytest.mark.parametrize(
    ("E", "mu", "rms"), [(81.0, 0.1, 1.77), (79.5, 0.12, 1.75), (86.0, 0.0, 2.28)]
)
def test_tensions_of_the_measured_rod_give_its_shapes(E: float, mu: float, rms: float) -> None:
    """As the path of pulls does, on which the cable slides in all holes."""
    arm = cdsm.presets.rod_one_tendon(1e9 * E, mu)
    found = [cdsm.estimate_posture(arm, [F], tension_std=0.02, sliding=1) for F in TENSIONS]
    shapes = np.array([disk_centres(each.posture) for each in found])
    np.testing.assert_allclose(shapes, predicted(E, mu), atol=1e-7)
    assert off(shapes) == pytest.approx(rms, abs=0.02)


@pytest.mark.parametrize(
    ("E", "mu", "alone", "tracked"), [(81.0, 0.1, 1.77, 1.63), (50.0, 0.0, 50.9, 4.29)]
)
def test_a_tracked_disk_brings_the_shape_nearer(
    E: float, mu: float, alone: float, tracked: float
) -> None:
    """The last disk, also where E is the nominal one, which is far off; χ² says so then."""
    arm = cdsm.presets.rod_one_tendon(1e9 * E, mu)
    first, last = arm.geometry.disks[0], arm.geometry.disks[-1]
    hanging = cdsm.forward_statics(arm, tension=[0.0]).pose.link_pose(first.link)
    base = (hanging @ [first.x, 0.0, 0.0, 1.0])[:3]
    found = []
    for F, measured in zip(TENSIONS, shapes_in_plane(), strict=True):
        point = base + np.append(1e-3 * measured[-1], 0.0)
        given: Any = {"tension_std": 0.1, "sliding": 1}
        by_tension = cdsm.estimate_posture(arm, [F], **given)
        by_both = cdsm.estimate_posture(arm, [F], points={last.link: point}, **given)
        found.append((by_tension, by_both))
    for k, expected in enumerate((alone, tracked)):
        shapes = np.array([disk_centres(pair[k].posture) for pair in found])
        assert off(shapes) == pytest.approx(expected, rel=0.02)
    doubted = [bool(by_both.warnings) for _, by_both in found]
    assert any(doubted) == (E == 50.0)


def wired(friction: float) -> tuple[cdsm.Manipulator, Array, Array]:
    """An arm without springs, tensions that hold a load, and the wires that motors have left."""
    arm = cdsm.Manipulator(readme_geometry(friction=friction), cdsm.LinearElasticity(2e4))
    pose = arm.at(Q)
    F = held(pose, W, lost_in_holes(pose, 1.0) if friction else None)
    segments = pose.segments
    T = F[segments.chains.cable] * np.exp(-lost_in_holes(pose, 1.0))
    wire = segments.chains.laws.original_lengths(segments.lengths, T)
    return arm, F, np.add.reduceat(wire, segments.chains.start[:-1])


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_exact_wires_give_the_posture(friction: float) -> None:
    arm, F, wire = wired(friction)
    given: Any = {"tension_std": 0.5, "rest_length_std": 1e-5, "wrench": W, "start": Q + 0.03}
    found = cdsm.estimate_posture(arm, F, rest_lengths=wire, sliding=1, **given)
    np.testing.assert_allclose(found.posture.q, Q, atol=1e-9)
    assert found.chi_square < 1e-12
    assert found.freedom == 12
    assert not found.angle_band.any()
    if friction:
        unknown = cdsm.estimate_posture(arm, F, rest_lengths=wire, **given)
        assert (abs(unknown.posture.q - Q) <= unknown.angle_band).all()


def test_uncertainty_holds() -> None:
    arm, F, wire = wired(0.0)
    rng = np.random.default_rng(0)
    inside, left = [], []
    for _ in range(40):
        found = cdsm.estimate_posture(
            arm,
            F + 0.5 * rng.normal(size=F.size),
            tension_std=0.5,
            rest_lengths=wire + 2e-5 * rng.normal(size=F.size),
            rest_length_std=2e-5,
            wrench=W,
            start=Q,
        )
        tip = abs(found.posture.tip[:3, 3] - arm.at(Q).tip[:3, 3]) <= 1.96 * found.tip_std
        inside.append(np.append(abs(found.posture.q - Q) <= 1.96 * found.angle_std, tip))
        left.append(found.chi_square)
    assert 0.9 < np.mean(inside) < 0.985
    assert chi2.ppf(0.001, 480) < sum(left) < chi2.ppf(0.999, 480)


def test_what_is_wrong_is_named() -> None:
    arm, F, wire = wired(0.0)
    given: Any = {"tension_std": 0.5, "start": Q}
    for more, said in (
        ({"rest_lengths": wire[1:]}, r"rest_lengths: shape \(11,\) given"),
        (
            {"rest_lengths": wire, "rest_length_std": 0.0},
            "rest_length_std: 0 given for cable1_1; a wire is not",
        ),
        ({"points": {"link9": (0, 0, 0)}}, "no link is called 'link9'"),
        ({"points": {"link2": (0, 0)}}, r"points\['link2'\]: shape \(2,\) given"),
        ({"points": {"link2": (0, 0, 0)}, "point_std": 0.0}, "point_std: 0 m given"),
        ({"rest_lengths": wire, "rest_length_std": [1e-5] * 3}, r"rest_length_std: shape \(3,\)"),
        ({"rest_lengths": wire, "rest_length_std": "1"}, "rest_length_std: holds <U1 entries"),
        ({"rest_lengths": wire, "rest_length_std": 1e-300}, "rest_length_std: 1e-300 given for"),
        ({"rest_length_std": 1e-5}, "rest_length_std: is of rest_lengths, which are not given"),
        ({"point_std": 1e-3}, "point_std: is of points, which are not given"),
        ({"points": [0, 0, 0]}, r"points: \[0, 0, 0\] given; give a dict of positions"),
        ({"points": ()}, r"points: \(\) given; give a dict"),
        ({"start": Q[1:]}, r"start: shape \(7,\) given"),
        ({"sliding": 3}, "sliding: 3 given"),
        ({"tension_std": -1.0}, "tension_std: -1 given for cable1_1"),
    ):
        with pytest.raises(cdsm.InvalidInput, match=said):
            cdsm.estimate_posture(arm, F, **{**given, **more})
    with pytest.raises(cdsm.EquilibriumError):
        cdsm.estimate_posture(arm, F, tension_std=0.5)
    heavy = cdsm.estimate_posture(arm, F, rest_lengths=wire, rest_length_std=1e-5, **given)
    assert heavy.warnings[-1].startswith("the readings do not fit: χ² = ")
