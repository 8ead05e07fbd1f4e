"""What is drawn of cables over pulleys: arcs on circles, dashed where no cable touches."""

import importlib.util

import numpy as np
import pytest

import cdsm
from cdsm import Pulley, Site
from cdsm.view import serve
from tests.support.pictures import artists
from tests.support.pulleys import Link, arm_of, finger

HINGE = [Link("phalanx", "base", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))]
R = 0.006


def _arm(groove: bool = True) -> cdsm.Manipulator:
    path = [
        Site("base", (-0.03, -0.002, 0.0)),
        Pulley("base", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), R, groove),
        Site("phalanx", (0.03, -0.004, 0.0 if groove else 0.01)),
    ]
    return arm_of(HINGE, path)


def test_paths_follow_the_arc_in_steps_of_ten_degrees() -> None:
    for groove in (True, False):
        pose = _arm(groove).at([1.5])
        (path,) = pose.cable_paths
        arc = path[1:-1]
        np.testing.assert_allclose(np.hypot(*arc[:, :2].T), R, rtol=0.0, atol=1e-15)
        steps = np.linalg.norm(np.diff(arc[:, :2], axis=0), axis=1)
        assert steps.max() <= 2.0 * R * np.sin(np.deg2rad(5.0)) + 1e-15
        np.testing.assert_allclose(arc[[0, -1]], [pose.wraps.arrival[0], pose.wraps.departure[0]])
        drawn = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
        assert 0.999 < drawn / pose.cable_lengths[0] < 1.0


def test_a_lifted_cable_is_straight_and_its_pulley_dashed() -> None:
    arm = _arm()
    for angle, style in ((0.5, "-"), (-0.5, "--")):
        pose = arm.at([angle])
        assert (len(pose.cable_paths[0]) == 2) == (style == "--")
        (circle,) = artists(pose.plot(view=(90.0, -90.0)), "pulley:").values()  # from above
        assert circle.get_linestyle() == style
        np.testing.assert_allclose(np.hypot(*circle.get_xydata().T), 1e3 * R, rtol=1e-9)


def test_clearances_count_the_arcs() -> None:
    path = [Site("base", (0.0, -0.02, 0.001)), Site("phalanx", (0.0, 0.02, 0.001))]
    other = cdsm.Cable("other", tuple(path), cdsm.LinearElasticity(1e4))
    arm = _arm()
    both = arm.with_cables([*arm.cables, other])
    near = cdsm.clearance(both.at([1.0]), diameter=1e-4)
    assert near.cables < 0.02


@pytest.mark.skipif(importlib.util.find_spec("viser") is None, reason="needs the extra [view]")
def test_the_view_has_arcs_and_the_rims_that_cables_touch() -> None:
    arm = finger().with_springs({f"to_l{k}": 0.5 for k in range(4)})
    for flexion in (0.1, 1.2):
        q = [0.0, flexion, flexion, flexion]
        pose = arm.at(q)
        with serve(arm, port=0, q=q, minimum=0.0) as view:
            for i, path in enumerate(pose.cable_paths):
                ends = np.stack([path[:-1], path[1:]], axis=1)
                drawn = view._server.scene.get_handle_by_name(f"/cables/{i}")
                np.testing.assert_allclose(drawn.points, ends, atol=1e-7)
            thin = view._server.scene.get_handle_by_name("/brackets").points
            assert len(thin) == len(pose.brackets) + 36 * pose.wraps.touches.sum()
