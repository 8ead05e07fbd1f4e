"""Clearances against a direct computation from the poses of the links and the cables."""

from itertools import combinations

import numpy as np
import pytest
from lxml import etree
from scipy.optimize import minimize

import cdsm
from cdsm.measures.clearance import KINDS
from cdsm.support.values import Array
from tests.support.arms import mixed_arm, random_arm, random_posture, readme_geometry


def between(one: Array, other: Array) -> float:
    """Distance of two segments (2, 3) by a search of two places."""

    def square(t: Array) -> float:
        apart = one[0] + t[0] * (one[1] - one[0]) - other[0] - t[1] * (other[1] - other[0])
        return float(1e6 * apart @ apart)

    # convex in both places: one start finds the least
    start, within = (0.5, 0.5), [(0.0, 1.0)] * 2
    found = minimize(square, start, bounds=within, method="L-BFGS-B", options={"ftol": 1e-16})
    return 1e-3 * float(np.sqrt(found.fun))


def segments_of(pose: cdsm.Posture) -> list[tuple[int, Array, int]]:
    """Cable, ends (2, 3) and number of each of its segments."""
    return [
        (c, path[i : i + 2], i)
        for c, path in enumerate(pose.cable_paths)
        for i in range(len(path) - 1)
    ]


def direct_cables_and_links(pose: cdsm.Posture) -> tuple[float, float]:
    """Two clearances of an arm with disks, from its link poses and cable paths alone."""
    geometry, segments = pose.arm.geometry, segments_of(pose)
    cables = min(between(a, b) for (c, a, _), (d, b, _) in combinations(segments, 2) if c != d)
    links = np.inf
    lengths = [geometry.base_length, *(link.length for link in geometry.links)]
    names = ["base_disk", *(f"link{k + 1}" for k in range(len(geometry.links)))]
    for name, length in zip(names, lengths, strict=True):
        placement = pose.link_pose(name)
        if length == 0.0:
            continue
        bone = placement[:3, 3] + np.array([[0.0], [length]]) * placement[:3, 0]
        radius = 0.2 * next(disk.hole_radius for disk in geometry.disks if disk.link == name)
        links = min(links, *(between(path, bone) - radius for _, path, _ in segments))
    return cables, links


def direct_disks(pose: cdsm.Posture) -> float:
    """Least clearance of a cable and a disk's edge, likewise."""
    disks, segments = np.inf, segments_of(pose)
    for number, disk in enumerate(pose.arm.geometry.disks):
        placement = pose.link_pose(disk.link)
        centre = placement[:3, 3] + disk.x * placement[:3, 0]
        for _, path, i in segments:
            local = (path - centre) @ placement[:3, :3]
            if number in (i, i + 1):
                disks = min(disks, disk.radius - np.hypot(*local[number - i, 1:]))
                continue
            t = np.linspace(0.0, 1.0, 20_001)[:, None]
            points = local[0] + t * (local[1] - local[0])
            out = np.hypot(points[:, 1], points[:, 2]) - disk.radius
            if local[0, 0] * local[1, 0] < 0.0:
                crossing = float(np.interp(0.0, *_rising(points[:, 0], out)))
                if crossing < 0.0:
                    disks = min(disks, crossing)
                    continue
            disks = min(disks, float(np.hypot(points[:, 0], np.maximum(out, 0.0)).min()))
    return float(disks)


def _rising(x: Array, y: Array) -> tuple[Array, Array]:
    order = np.argsort(x)
    return x[order], y[order]


@pytest.mark.parametrize(
    ("arm", "reach"),
    [(random_arm(0, 2), 0.5), (random_arm(1, 3, "hinged"), 1.0), (mixed_arm(), 0.85)],
)
def test_clearances_equal_a_direct_computation(arm: cdsm.Manipulator, reach: float) -> None:
    pose = random_posture(arm, 0, reach)
    found = cdsm.clearance(pose)
    expected = (*direct_cables_and_links(pose), direct_disks(pose))
    # the search of two places stops at 1e-7 m
    assert (found.cables, found.links, found.disks) == pytest.approx(expected, abs=2e-7)


@pytest.mark.parametrize("pieces", [1, 4])
def test_bodies_of_a_beam_without_a_disk_are_as_thick_as_in_the_urdf(pieces: int) -> None:
    """Each is a cylinder; the URDF says where it is and how thick."""
    section = {"length": 0.2, "disks": 4, "hole_angles": [0.0, 2.0, 4.0], "hole_radius": 0.01}
    geometry = cdsm.Geometry.backbone(sections=[section], bending_stiffness=0.02, pieces=pieces)
    pose = random_posture(cdsm.Manipulator(geometry, cdsm.presets.ELASTIC_STAGE), 2, 0.4)
    links = np.inf
    for link in etree.fromstring(pose.arm.urdf.encode()).iter("link"):
        for cylinder in link.xpath("visual[material/@name='backbone']/geometry/cylinder"):
            placement = pose.link_pose(link.get("name"))
            length = float(cylinder.get("length"))
            bone = placement[:3, 3] + np.array([[0.0], [length]]) * placement[:3, 0]
            radius = float(cylinder.get("radius"))
            assert radius == 0.2 * 0.01
            distances = [between(path, bone) for _, path, _ in segments_of(pose)]
            links = min(links, min(distances) - radius)
    assert cdsm.clearance(pose).links == pytest.approx(links, abs=2e-7)


def test_batch_is_the_single_posture_and_diameters_count() -> None:
    arm = mixed_arm()
    q = np.random.default_rng(0).uniform(-0.3, 0.3, (5, arm.nv))
    rows = cdsm.sweep(arm, q, outputs=KINDS, diameter=1e-3)
    for n in range(len(q)):
        one, thin = cdsm.clearance(arm.at(q[n]), 1e-3), cdsm.clearance(arm.at(q[n]))
        assert (one.cables, one.links, one.disks) == tuple(rows[kind][n] for kind in KINDS)
        assert thin.cables - one.cables == pytest.approx(1e-3)
        assert thin.links - one.links == pytest.approx(0.5e-3)
        assert thin.disks - one.disks == pytest.approx(0.5e-3)


def test_a_thick_disk_is_nearer_and_a_cut_one_counts_negative() -> None:
    """In a straight arm a cable ends at a disk 20 mm before the next one, beside its axis."""
    geometry = readme_geometry(joints=2, disk_offset=0.01, hole_radius=0.02)
    pose = cdsm.Manipulator(geometry, cdsm.presets.ELASTIC_STAGE).at(np.zeros(4))
    # the rim is 2 mm from the holes; thick disks come nearer along the axis
    assert cdsm.clearance(pose).disks == pytest.approx(2e-3, abs=1e-9)
    assert cdsm.clearance(pose, 0.0, 0.038).disks == pytest.approx(0.02 - 0.019, abs=1e-8)
    # a cable that cuts through disks, 1 mm beside their centres
    ends = [cdsm.Site(link, (0.0, 0.0, 1e-3)) for link in ("base_link", "tool0")]
    through = cdsm.Cable("through", tuple(ends), cdsm.presets.ELASTIC_STAGE)
    cut = pose.arm.with_cables([*pose.arm.cables, through]).at(pose.q)
    assert cdsm.clearance(cut).disks == pytest.approx(1e-3 - 0.022, abs=1e-9)
