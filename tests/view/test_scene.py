"""The 3D scene, read back, against positions and colours that are computed here."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib import colormaps

import cdsm
from cdsm.support.values import Array
from cdsm.view import serve
from cdsm.view.live_view import View
from tests.core.test_posture import ring
from tests.support import foreign
from tests.support.printed import numbers, require_all
from tests.view import scene
from tests.view.test_state import DEGREES, STABLE, soft_arm

pytest.importorskip("viser", reason="the extra [view] is not installed")

SINGLE = 2e-7
"""Rounding [m] of the numbers of 32 bits that a browser gets."""


@pytest.fixture(scope="module")
def view() -> Iterator[View]:
    arm = soft_arm().with_friction(0.1)
    with serve(arm, port=0, q=np.deg2rad(DEGREES), minimum=STABLE, maximum=200.0) as page:
        yield page


def turned(axis: int, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    matrix = np.eye(3)
    matrix[[i, i, j, j], [i, j, i, j]] = c, -s, s, c
    return matrix


def links(degrees: list[float]) -> list[tuple[Array, Array]]:
    """Origin and axes of base and links of the soft arm: each joint turns about y, then z."""
    frames = [(np.zeros(3), np.eye(3))]
    step = 0.03  # to the first joint
    for about_y, about_z in np.deg2rad(degrees).reshape(-1, 2):
        origin, axes = frames[-1]
        there = origin + step * axes[:, 0]
        frames.append((there, axes @ turned(1, about_y) @ turned(2, about_z)))
        step = 0.06
    return frames


def test_backbone_and_disks_stand_where_the_joints_put_them(view: View) -> None:
    for k, (origin, axes) in enumerate(links(DEGREES)[1:], start=1):
        backbone, *disks = scene.shapes(view, f"link{k}")
        np.testing.assert_allclose(backbone.centre, origin + 0.03 * axes[:, 0], atol=1e-9)
        assert len(disks) == (2 if k < 3 else 1)
        for disk, x in zip(disks, (0.012, 0.048), strict=False):
            np.testing.assert_allclose(disk.centre, origin + x * axes[:, 0], atol=1e-9)
            np.testing.assert_allclose(abs(disk.rotation[:, 2] @ axes[:, 0]), 1.0, atol=1e-9)
            assert 0.02 <= disk.radius < 0.03  # around the holes


def test_cables_run_through_their_holes_with_the_colours_of_their_tensions(view: View) -> None:
    frames = links(DEGREES)
    pose = view.arm.at(np.deg2rad(DEGREES))
    F = cdsm.distribute_tension(pose, STABLE, 200.0).values
    low, high = F.min(), F.max()
    for i, name in enumerate(view.arm.cables.names):
        joint, j = i // 3, i % 3
        phi = 2.0 * np.pi * (joint + 3 * j) / 9.0
        hole = np.array([0.0, 0.02 * np.cos(phi), 0.02 * np.sin(phi)])
        places = [(0, 0.018)]  # link, and x of its disk
        for link in range(1, joint + 1):
            places += [(link, 0.012), (link, 0.048)]
        places.append((joint + 1, 0.012))
        x = np.eye(3)[0]
        wanted = [frames[k][0] + frames[k][1] @ (hole + at * x) for k, at in places]
        points, color = scene.cable(view, name)
        np.testing.assert_allclose(points, wanted, atol=SINGLE)
        shade = 255.0 * np.array(colormaps["viridis"](0.9 * (F[i] - low) / (high - low))[:3])
        np.testing.assert_allclose(color, shade, atol=3.0)
    brightness = [sum(scene.cable(view, name)[1]) for name in view.arm.cables.names]
    assert np.argmax(brightness) == F.argmax()


def test_the_ellipsoid_is_where_forces_of_one_newton_move_the_tip(view: View) -> None:
    K = view.shown.stiffness
    assert K is not None
    surface = scene.ellipsoid(view)
    drawn = view.shown.ellipsoid
    assert surface is not None
    assert drawn is not None
    moved = (surface - K.posture.tip[:3, 3]) / drawn.scale
    force = np.linalg.solve(K.compliance[:3, :3], moved.T)
    np.testing.assert_allclose(np.linalg.norm(force, axis=0), 1.0, rtol=1e-3)
    assert f"scale {drawn.scale:g}:1" in str(drawn)
    a, b, c = np.moveaxis(surface[scene.node(view, "/ellipsoid").faces], 1, 0)
    outwards = (a + b + c) / 3.0 - K.posture.tip[:3, 3]
    # only the front of a triangle is seen; those at the poles have no area
    assert (np.sum(np.cross(b - a, c - a) * outwards, axis=1) > -1e-12).all()


def test_axes_stand_at_the_base_and_the_arm_above_a_grid_of_the_size_that_is_written(
    view: View,
) -> None:
    for axis, name in zip(np.eye(3), "xyz", strict=True):
        label = scene.node(view, f"/base/{name}")
        assert label.text == name
        place = np.array(label.position)
        np.testing.assert_allclose(place / np.linalg.norm(place), axis, atol=1e-9)
    grid = scene.node(view, "/grid")
    lowest = min(scene.cable(view, name)[0][:, 2].min() for name in view.arm.cables.names)
    assert grid.position[2] < lowest
    written = numbers(view._panel._answer.content, "grid: {}")
    require_all([(written[0], grid.cell_size)])
    assert grid.section_size == pytest.approx(5.0 * grid.cell_size)
    assert written[0].unit == "mm"


def test_the_arrow_is_the_force_where_it_acts(view: View) -> None:
    assert scene.arrow(view) is None
    frames = links(DEGREES)
    push = view._panel._load[2]
    places = {"the tip": frames[3][0] + 0.06 * frames[3][1][:, 0], "link2": frames[2][0]}
    try:
        push.value = 0.4
        for link, start in places.items():
            view._panel._link.value = link  # type: ignore[union-attr]
            _ = view.shown
            drawn = scene.arrow(view)
            assert drawn is not None
            np.testing.assert_allclose(drawn[0], start, atol=SINGLE)
            length = 0.22 * view.arm.length  # as in pictures
            np.testing.assert_allclose(drawn[1] - drawn[0], [0.0, length, 0.0], atol=SINGLE)
            assert list(scene.arrows(view)) == ["0.4 N"]
            assert f"force at {link}: 0.4 N" in view._panel._answer.content
    finally:
        view._panel.reset()


def test_loads_of_the_arm_are_arrows_beside_the_force() -> None:
    own = [
        cdsm.Load("link2", (0.0, 0.0, -1.0)),
        cdsm.Load("link1", (0.2, 0.0, 0.0), point=(0.02, 0.0, 0.0)),
    ]
    arm = soft_arm().with_loads(own)
    options: dict[str, Any] = {"q": np.deg2rad(DEGREES), "minimum": STABLE, "maximum": 200.0}
    frames = links(DEGREES)
    ways = {"0.5 N": (3, (0, -1, 0)), "1 N": (2, (0, 0, -1)), "0.2 N": (1, (1, 0, 0))}
    with serve(arm, port=0, force=(0.0, -0.5, 0.0), link="link3", **options) as page:
        drawn = scene.arrows(page)
        assert {*drawn} == {*ways}
        for size, (k, way) in ways.items():
            start, end = drawn[size]
            np.testing.assert_allclose(
                np.cross(start - frames[k][0], frames[k][1][:, 0]), 0.0, atol=SINGLE
            )
            np.testing.assert_allclose(end - start, 0.22 * arm.length * np.array(way), atol=SINGLE)
        page._panel._load[2].value = 0.0
        _ = page.shown
        assert {*scene.arrows(page)} == {"1 N", "0.2 N"}


def test_the_first_camera_sees_all_cables_too() -> None:
    """Of a finger, cables begin behind the base."""
    path = Path(__file__).parents[2] / "examples" / "finger_with_pulleys.toml"
    arm = cdsm.Manipulator.read(path)
    with serve(arm, port=0) as page:
        camera = page._server.initial_camera
        points = np.vstack(page.arm.at(np.zeros(arm.nv)).cable_paths)
        centre, radius = page._scene._centre, page._scene._radius
        assert (abs(points - centre).max(axis=1) <= radius).all()
        np.testing.assert_allclose(camera.look_at, centre)
        assert points[:, 0].min() < -0.02


def test_holes_stick_or_slide_and_the_reference_is_pale(view: View) -> None:
    """Each mark is a line along the cable behind its hole, and beads have one length."""
    assert not lines_of_reference(view).size
    push = view._panel._load[3]
    try:
        view._panel._sag.value = True
        push.value = -0.5
        rest = view.shown.rest
        assert rest is not None
        marks = [scene.lines(view, f"/holes/{kind}") for kind in ("stick", "slide")]
        assert min(map(len, marks)) > 0
        sliding = view.shown.sliding
        assert len(marks[1]) == np.count_nonzero(sliding)
        vertices = np.vstack([scene.cable(view, name)[0] for name in view.arm.cables.names])
        for line in np.vstack(marks):
            middle = line.mean(axis=0)
            assert np.linalg.norm(vertices - middle, axis=1).min() < SINGLE
            bead = np.linalg.norm(line[1] - line[0])
            assert bead == pytest.approx(0.026 * view.arm.length, rel=1e-4)
        ghost = lines_of_reference(view)
        tips = [origin for origin, _ in links(DEGREES)]
        np.testing.assert_allclose(ghost[1:, 0], tips[1:], atol=SINGLE)
        moved = rest.pose.tip[:3, 3] - ghost[-1, 1]
        np.testing.assert_allclose(moved, rest.displacement, atol=1e-6)
    finally:
        view._panel.reset()
        assert view.shown.rest is None


def lines_of_reference(view: View) -> Array:
    return scene.lines(view, "/reference")


def test_names_say_the_tensions_at_the_ends_of_the_cables(view: View) -> None:
    assert scene.names(view) == {}
    try:
        view._panel.names.value = True
        F = view.shown.tensions
        assert F is not None
        said = scene.names(view)
        wanted = [f"{name}: {f:.4g} N" for name, f in zip(view.arm.cables.names, F, strict=True)]
        assert list(said) == wanted
        for name, place in zip(view.arm.cables.names, said.values(), strict=True):
            np.testing.assert_allclose(place, scene.cable(view, name)[0][-1], atol=SINGLE)
    finally:
        view._panel.names.value = False


def test_an_arm_without_balance_is_grey_and_says_so(view: View) -> None:
    assert scene.label(view) is None
    least = view._panel._load[0]
    try:
        least.value = 195.0
        assert view.shown.tension is None
        label = scene.label(view)
        assert label is not None
        assert label[0] == view.shown.heading == "INFEASIBLE"
        across, along, above = label[1] - view.arm.at(np.deg2rad(DEGREES)).tip[:3, 3]
        np.testing.assert_allclose([across, along], 0.0, atol=SINGLE)
        assert above > 0.0
        assert {scene.cable(view, name)[1] for name in view.arm.cables.names} == {(150, 150, 150)}
        assert scene.ellipsoid(view) is None
    finally:
        view._panel.reset()


# --- links that overlap, robots, pulleys ---------------------------------------------------------


def test_links_that_overlap_change_their_colour_and_get_it_back() -> None:
    """An arm bent into a ring passes through itself; the straight one does not."""
    closed = ring(50.0)
    with serve(closed.arm, port=0, q=closed.q, minimum=50.0) as view:
        links = ("base_disk", *(f"link{k}" for k in range(1, 9)))

        def red() -> set[str]:
            shown = {link: {disk.color for disk in scene.shapes(view, link)} for link in links}
            return {link for link, colors in shown.items() if colors == {(213, 94, 0)}}

        assert red() == {"base_disk", "link8"}
        assert "2 links overlap" in view._panel._answer.content
        assert "passes through itself" in view._panel._head.content
        before = scene.shapes(view, "link1")[0].color
        for joint in view._panel.joints:
            joint.value = 0.0  # type: ignore[misc]
        assert not view.shown.touching
        assert red() == set()
        assert scene.shapes(view, "link8")[0].color == before
        assert "overlap" not in view._panel._answer.content


def test_a_robot_without_shapes_has_sticks_and_brackets() -> None:
    arm = foreign.crab()
    with serve(arm, port=0, q=foreign.POSTURE, minimum=0.0) as view:
        pose = arm.at(foreign.POSTURE)
        sticks = scene.lines(view, "/sticks")
        np.testing.assert_allclose(sticks, pose.bones, atol=SINGLE)
        brackets = scene.lines(view, "/brackets")
        sites = np.vstack([scene.cable(view, name)[0] for name in arm.cables.names])
        for bracket in brackets:  # from the link to a site of a cable
            gap = np.linalg.norm(sites[:, None] - bracket, axis=2).min()
            assert gap < SINGLE


@pytest.fixture(scope="module")
def finger() -> Iterator[View]:
    """A plane finger with a joint at the origin, and two joints that bend by 0.5 and 0.4 rad."""
    start = cdsm.Site("base", (-0.03, 0.0, 0.008))
    knuckle = cdsm.Pulley("one", (0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0), radius=0.008, friction=0.4)
    hole = cdsm.Site("one", (0.025, 0.0, 0.006), friction=0.2)
    end = cdsm.Site("two", (0.02, 0.0, 0.006))
    law = cdsm.LinearElasticity(2e4)
    mirrored = [
        cdsm.Site("base", (-0.03, 0.0, -0.008)),
        cdsm.Pulley("one", (0.0, 0.0, 0.0), axis=(0.0, -1.0, 0.0), radius=0.008, friction=0.4),
        cdsm.Site("one", (0.025, 0.0, -0.006), friction=0.2),
        cdsm.Site("two", (0.02, 0.0, -0.006)),
    ]
    cables = [
        cdsm.Cable("over", (start, knuckle, hole, end), law),
        cdsm.Cable("under", tuple(mirrored), law),
    ]
    for name, z in (("above", 0.006), ("below", -0.006)):
        short = cdsm.Site("one", (0.03, 0.0, z)), cdsm.Site("two", (0.02, 0.0, z))
        cables.append(cdsm.Cable(name, short, law))
    arm = cdsm.Manipulator.from_urdf(FINGER, cables, tip="two", gravity=(0.0, 0.0, 0.0))
    with serve(arm, port=0, q=[0.5, 0.4], minimum=5.0) as page:
        yield page


FINGER = """<robot name="finger"><link name="base"/>
<link name="one"><inertial><mass value="0.01"/><inertia ixx="1e-6" iyy="1e-6" izz="1e-6" ixy="0"
 ixz="0" iyz="0"/></inertial></link>
<link name="two"><inertial><mass value="0.01"/><inertia ixx="1e-6" iyy="1e-6" izz="1e-6" ixy="0"
 ixz="0" iyz="0"/></inertial></link>
<joint name="a" type="revolute"><parent link="base"/><child link="one"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="b" type="revolute"><parent link="one"/><child link="two"/><origin xyz="0.04 0 0"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""


def test_pulleys_are_circles_and_their_holes_lie_on_the_arcs(finger: View) -> None:
    """The mark of a post is a point of its link, halfway along the arc of the straight finger."""
    points, _ = scene.cable(finger, "over")
    reach = np.linalg.norm(points, axis=1)
    assert reach.min() == pytest.approx(0.008, abs=SINGLE)  # it lies on the post
    rims = scene.lines(finger, "/brackets")
    circles = rims[abs(np.linalg.norm(rims, axis=2) - 0.008).max(axis=1) < 1e-6]
    assert len(circles) == 36  # the other cable has lifted off
    assert abs(circles[:, :, 1]).max() < SINGLE
    marks = scene.lines(finger, "/holes/stick")
    middles = marks.mean(axis=1)
    arm = finger.arm
    straight = arm.at([0.0, 0.0])
    assert straight.wrapping is not None
    posts = middles[np.linalg.norm(middles, axis=1) < 0.0081]
    assert len(posts) == 1
    arc = straight.cable_paths[0]
    on_arc = arc[abs(np.linalg.norm(arc, axis=1) - 0.008) < 1e-9]
    middle = on_arc[[0, -1]].mean(axis=0)
    wanted = turned(1, 0.5) @ (0.008 * middle / np.linalg.norm(middle))
    assert np.linalg.norm(posts - wanted, axis=1).min() < SINGLE
    for line in marks[np.linalg.norm(middles, axis=1) < 0.0081]:  # along the rim
        along = line[1] - line[0]
        assert abs(along @ line.mean(axis=0)) < 1e-8
    # holes of link one, at their places
    sites = [turned(1, 0.5) @ np.array([0.025, 0.0, z]) for z in (0.006, -0.006)]
    for site in sites:
        assert np.linalg.norm(middles - site, axis=1).min() < SINGLE


def test_marks_of_a_sheath_and_of_a_divided_post(finger: View) -> None:
    """A sheath has its holes on the line between its sites; strong friction divides an arc."""
    law = cdsm.LinearElasticity(2e4)
    sheath = cdsm.Sheath(0.1, wrap=1.0, friction=0.3, pieces=4)
    path: list[Any] = [cdsm.Site("base", (-0.08, 0.0, 0.0)), sheath]
    path += [cdsm.Site("base", (-0.04, 0.0, 0.008))]
    path += [cdsm.Pulley("one", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.008, friction=1.9)]
    path += [cdsm.Site("one", (0.005, 0.0, -0.03))]
    cables = [cdsm.Cable("long", tuple(path), law), *finger.arm.cables[1:]]
    arm = cdsm.Manipulator.from_urdf(FINGER, cables, tip="two", gravity=(0.0, 0.0, 0.0))
    pose = arm.at([0.1, 0.1])
    points, along = pose.segments.hole_places(pose.placements)
    chains = pose.segments.chains
    own = np.flatnonzero(chains.cable[chains.hole] == 0)
    np.testing.assert_allclose(points[own[:4], 0], -0.08 + 0.04 * (np.arange(4) + 0.5) / 4)
    np.testing.assert_allclose(points[own[:4], 2], 0.008 * (np.arange(4) + 0.5) / 4, atol=1e-12)
    post = points[own][abs(np.linalg.norm(points[own], axis=1) - 0.008) < 1e-9]
    assert len(post) > 3
    turn = np.unwrap(np.arctan2(-post[:, 2], post[:, 0]))  # as the cable goes, from the top down
    step = pose.segments.wrap[own[4:][: len(post)]]
    np.testing.assert_allclose(np.diff(turn), step[1:], rtol=0.2)  # at the joint's middle: equal
    np.testing.assert_allclose(np.diff(turn), np.diff(turn)[0], rtol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(along[own], axis=1), 1.0)
