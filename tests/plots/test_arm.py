"""Pictures of arms: what is drawn stands where it is, on ordinary axes."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.animation import PillowWriter
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from PIL import Image
from scipy.spatial import ConvexHull

import cdsm
from cdsm import plots
from cdsm.planning.path_plan import PathPlan
from cdsm.plots.projection import projection
from cdsm.plots.style import TENSION_COLORS, VERMILLION
from tests.core.test_posture import ring
from tests.support.arms import mixed_arm, random_posture
from tests.support.pictures import artists, line, named, require_look, words
from tests.support.printed import numbers, require_all
from tests.support.sweeps import short_arm

POSE = random_posture(mixed_arm(), 3)
PULL = cdsm.distribute_tension(POSE, 10.0)
K = cdsm.stiffness(POSE, PULL)
FRONT = (0.0, -90.0)
"""The eye in −y: x is right, and z is up."""


def one_panel() -> Any:
    return Figure(figsize=(3.0, 3.0)).subplots()


def test_views_are_what_the_eye_sees() -> None:
    np.testing.assert_allclose(projection(*FRONT), [[1, 0, 0], [0, 0, 1], [0, -1, 0]], atol=1e-12)
    top = projection(90.0, -90.0)
    np.testing.assert_allclose(top, np.eye(3), atol=1e-12)  # from above: x right, y up
    for view in ((22.0, -62.0), (-30.0, 140.0)):
        rows = projection(*view)
        np.testing.assert_allclose(rows @ rows.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(rows) == pytest.approx(1.0)  # no mirror


def test_cables_stand_where_they_are_coloured_by_tension_and_nearer_ones_in_front() -> None:
    ax = plots.plot_arm(POSE, PULL, view=FRONT)
    lines = artists(ax, "cable:")
    layers, depths = [], []
    low, high = PULL.values.min(), PULL.values.max()
    for name, path, F in zip(POSE.arm.cables.names, POSE.cable_paths, PULL.values, strict=True):
        for k in range(len(path) - 1):
            segment = lines.pop(f"cable:{name}:{k}")
            np.testing.assert_allclose(segment.get_xydata(), 1e3 * path[k : k + 2, [0, 2]])
            shade = TENSION_COLORS((F - low) / (high - low))
            np.testing.assert_allclose(to_rgba(segment.get_color()), shade, atol=1e-9)
            layers.append(segment.get_zorder())
            depths.append(-path[k : k + 2, 1].mean())
    assert not lines
    assert sum(TENSION_COLORS(1.0)[:3]) > 2.0 * sum(
        TENSION_COLORS(0.0)[:3]
    )  # brighter: pulled more
    assert (np.diff(np.array(layers)[np.argsort(depths)]) > -1e-12).all()
    assert np.ptp(layers) > 0.01
    for k, bone in enumerate(POSE.bones):
        np.testing.assert_allclose(line(ax, f"bone:{k}"), 1e3 * bone[:, [0, 2]])
    for disk in POSE.arm.geometry.disks:
        edge = artists(ax, f"disk:{disk.index}")[f"disk:{disk.index}"].get_xy()
        turn = np.linspace(0.0, 2.0 * np.pi, 73)
        ring = disk.radius * np.array([np.cos(turn), np.sin(turn)])
        placement = POSE.link_pose(disk.link)
        rim = placement[:3, 3] + np.c_[0.0 * turn + disk.x, ring.T] @ placement[:3, :3].T
        np.testing.assert_allclose(np.ptp(edge, axis=0), 1e3 * np.ptp(rim[:, [0, 2]], axis=0))
        np.testing.assert_allclose(edge.min(axis=0), 1e3 * rim[:, [0, 2]].min(axis=0))
    np.testing.assert_allclose(line(ax, "tip"), 1e3 * POSE.tip[None, [0, 2], 3])
    assert ax.get_aspect() == 1.0
    require_look(ax)


def test_base_axes_are_drawn_to_the_scale_that_they_name() -> None:
    ax = plots.plot_arm(POSE, view=(90.0, -90.0))
    (length,) = numbers(words(ax), "axes {}")
    assert length.unit == "mm"
    for name, direction in zip("xy", np.eye(2), strict=True):
        arrow = artists(ax, f"axis:{name}")[f"axis:{name}"]
        moved = np.subtract(arrow.xy, arrow.xyann)
        np.testing.assert_allclose(moved, float(length.text) * direction, atol=1e-9)
        np.testing.assert_allclose(named(ax)[name].xy, arrow.xy)
    np.testing.assert_allclose(named(ax)["z"].xy, artists(ax, "axis:x")["axis:x"].xyann)


@pytest.mark.parametrize("bend", [0.0, 0.05, 0.3])
def test_base_axes_stand_where_no_line_is(bend: float) -> None:
    pose = short_arm().at(np.full(6, bend))
    ax = plots.plot_arm(pose, cdsm.distribute_tension(pose, 10.0))
    require_look(ax)
    (text,) = (text for words, text in named(ax).items() if words.startswith("axes "))
    box = text.get_window_extent()
    for drawn in ax.lines:
        ends = ax.transData.transform(drawn.get_xydata())
        parts = np.linspace(0.0, 1.0, 50)[:, None]
        for start, end in pairwise(ends):
            points = start + parts * (end - start)
            assert not any(box.contains(*point) for point in points)


def test_names_stand_at_the_ends_of_their_cables_and_colours_at_their_tensions() -> None:
    ax = plots.plot_arm(POSE, PULL, view=FRONT, names=True)
    for name, path in zip(POSE.arm.cables.names, POSE.cable_paths, strict=True):
        np.testing.assert_allclose(named(ax)[name].xy, 1e3 * path[-1, [0, 2]])
    (bar,) = (child for child in ax.child_axes if child.get_title(loc="left") == "N")
    np.testing.assert_allclose(bar.get_ylim(), [PULL.values.min(), PULL.values.max()])


def test_links_that_overlap_are_red_and_others_are_not() -> None:
    closed = ring(50.0)
    ax = plots.plot_arm(closed)
    touching = {link for pair in closed.self_contacts for link in pair}
    assert touching
    for disk in closed.arm.geometry.disks:
        color = artists(ax, f"disk:{disk.index}")[f"disk:{disk.index}"].get_edgecolor()
        red = np.allclose(color, to_rgba(VERMILLION))
        assert red == (disk.link in touching)


def test_a_robot_has_its_joints_and_pulleys_as_they_touch() -> None:
    finger = cdsm.Manipulator.read("examples/finger_with_pulleys.toml")
    pose = finger.at(np.deg2rad([0.0, 70.0, 40.0, 20.0]))
    ax = plots.plot_arm(pose, view=FRONT)
    touches = [bool(touch) for touch in pose.wrapping.touches]
    assert {*touches} == {True, False}
    for k, (rim, touch) in enumerate(zip(pose.wrapping.rims, touches, strict=True)):
        drawn = artists(ax, f"pulley:{k}")[f"pulley:{k}"]
        np.testing.assert_allclose(drawn.get_xydata(), 1e3 * rim[:, [0, 2]])
        assert drawn.get_linestyle() == ("-" if touch else "--")
    slides = np.asarray(finger.slides)
    for kind, chosen, marker in (("turns", ~slides, "o"), ("slides", slides, "s")):
        if chosen.any():
            drawn = artists(ax, f"joints:{kind}")[f"joints:{kind}"]
            assert drawn.get_marker() == marker
            np.testing.assert_allclose(
                drawn.get_xydata(), 1e3 * pose.joint_positions[chosen][:, [0, 2]]
            )


def test_no_force_moves_the_tip_beyond_the_outline_and_some_reach_it() -> None:
    view = (22.0, -62.0)
    ax = plots.plot_arm(POSE, PULL, K, view=view, scale=50.0)
    rows = projection(*view)[:2]
    edge = artists(ax, "compliance")["compliance"].get_xy() - 1e3 * rows @ POSE.tip[:3, 3]
    forces = np.random.default_rng(0).normal(size=(20_000, 3))
    forces /= np.linalg.norm(forces, axis=1)[:, None]
    moved = 50.0 * 1e3 * (forces @ K.compliance[:3, :3].T) @ rows.T
    for turn in np.linspace(0.0, 2.0 * np.pi, 17):
        n = np.array([np.cos(turn), np.sin(turn)])
        assert (moved @ n).max() == pytest.approx((edge @ n).max(), rel=1e-2)
    moves = numbers(words(ax), "{} moves it by up to {}, drawn × {}")
    require_all(
        zip(moves, (1.0, np.linalg.norm(K.compliance[:3, :3], 2), 50.0), strict=True), digits=2
    )


def test_load_is_an_arrow_along_the_force() -> None:
    ax = plots.plot_arm(POSE, force=[0.0, 0.0, -4.0], view=FRONT)
    arrow = artists(ax, "force")["force"]
    start, end = arrow._posA_posB
    np.testing.assert_allclose(start, 1e3 * POSE.tip[[0, 2], 3])
    assert end[0] == pytest.approx(start[0])
    assert end[1] < start[1]  # down
    assert "4 N" in [text.get_text() for text in ax.texts]


def test_loads_on_links_are_arrows_where_they_act() -> None:
    pose = short_arm().at(np.full(6, 0.1))
    hung = [
        cdsm.Load("link2", force=(0.0, 0.0, -1.5), point=(0.01, 0.0, 0.02)),
        cdsm.Load("tool0", force=(0.5, 0.0, 0.0)),
    ]
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 10.0, wrench=hung))
    ax = K.plot(view=FRONT)
    arrows = artists(ax, "force")
    assert {*arrows} == {"force", "force:link2"}
    start, end = arrows["force:link2"]._posA_posB
    placement = pose.link_pose("link2")
    place = placement[:3, 3] + placement[:3, :3] @ [0.01, 0.0, 0.02]
    np.testing.assert_allclose(start, 1e3 * place[[0, 2]], atol=1e-6)
    assert end[0] == pytest.approx(start[0])
    assert end[1] < start[1]
    start, end = arrows["force"]._posA_posB
    assert end[0] > start[0]
    assert {"1.5 N", "0.5 N"} <= {*named(ax)}


def test_slack_cables_are_dashed_and_an_unstable_arm_is_called_so() -> None:
    values = PULL.values.copy()
    values[3] = 0.0
    lines = artists(plots.plot_arm(POSE, values), "cable:")
    dashed = {gid.split(":")[1] for gid, path in lines.items() if path.get_linestyle() != "-"}
    assert dashed == {POSE.arm.cables.names[3]}
    assert f"dashed: 1 of {len(values)} cables are slack" in words(plots.plot_arm(POSE, values))
    loose = short_arm(spring=1500.0, lead=0.5).at(np.zeros(6))
    buckled = cdsm.stiffness(loose, cdsm.distribute_tension(loose, 100.0))
    assert not buckled.is_stable
    ax = buckled.plot()
    assert any("UNSTABLE" in text.get_text() for text in ax.texts)
    assert not artists(ax, "compliance")


def test_equilibrium_is_drawn_with_its_load_over_its_reference() -> None:
    rest = cdsm.equilibrium(POSE, PULL, wrench=[0.0, 0.0, -0.3, 0.0, 0.0, 0.0])
    ax = rest.plot(view=FRONT)
    np.testing.assert_allclose(line(ax, "bone:1"), 1e3 * rest.pose.bones[1][:, [0, 2]])
    np.testing.assert_allclose(line(ax, "ghost:1"), 1e3 * POSE.bones[1][:, [0, 2]])
    assert artists(ax, "force")
    assert artists(ax, "compliance")
    require_look(ax)


def test_arms_beside_each_other_have_one_scale() -> None:
    straight = POSE.arm.at(0.5 * POSE.q)
    F = cdsm.distribute_tension(straight, 90.0)
    cases = [(POSE, PULL, K, "a"), (straight, F, cdsm.stiffness(straight, F), "b")]
    first, second = plots.plot_arms(cases)
    assert np.ptp(first.get_xlim()) == pytest.approx(np.ptp(second.get_xlim()))
    assert np.ptp(first.get_ylim()) == pytest.approx(np.ptp(second.get_ylim()))
    both = np.concatenate([PULL.values, F.values])
    for ax, values in ((first, PULL.values), (second, F.values)):
        name = POSE.arm.cables.names[0]
        share = (values[0] - both.min()) / np.ptp(both)
        color = artists(ax, "cable:")[f"cable:{name}:0"].get_color()
        np.testing.assert_allclose(to_rgba(color), TENSION_COLORS(share), atol=1e-9)
    assert (first.get_title(loc="left"), second.get_title(loc="left")) == ("a", "b")
    assert not first.child_axes  # one bar, beside the last
    (bar,) = second.child_axes
    np.testing.assert_allclose(bar.get_ylim(), [both.min(), both.max()])
    assert artists(first, "axis:")
    assert not artists(second, "axis:")
    soft = short_arm(spring=1500.0, lead=0.5).at(np.full(6, 0.1))
    loose = (soft, None, cdsm.stiffness(soft, cdsm.distribute_tension(soft, 5.0)))
    scales = [
        numbers(words([ax]), "drawn × {}")[0].text
        for ax in (*plots.plot_arms([cases[0], loose]), K.plot())
    ]
    assert scales[0] == scales[1] != scales[2]  # alone, the stiff one is enlarged more
    require_look([first, second])


def test_axes_of_the_caller_keep_their_figure_and_neighbours() -> None:
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(7.0, 3.0))
    before = right.spines["top"].get_visible(), dict(pyplot.rcParams)
    assert K.plot(ax=left, title="") is left
    assert (right.spines["top"].get_visible(), dict(pyplot.rcParams)) == before
    assert left.get_title(loc="left") == ""
    assert tuple(figure.get_size_inches()) == (7.0, 3.0)
    assert POSE.plot(PULL, K, ax=right, view=FRONT) is right
    pyplot.close(figure)


@pytest.fixture(scope="module")
def plan() -> PathPlan:
    q = np.linspace(1.0, 0.999, 3)[:, None] * POSE.q
    reach = cdsm.stiffness_range(POSE, "z", 10.0, 200.0)
    target = 0.8 * reach.low + 0.2 * reach.high
    return cdsm.plan_path(POSE.arm, "z", target, 10.0, 200.0, angles=q)


def test_path_has_the_way_of_the_tip_and_a_film(plan: PathPlan, tmp_path: Path) -> None:
    ax = plots.plot_path(plan, view=FRONT, animate=tmp_path / "arm.gif")
    tips = [posture.tip[[0, 2], 3] for posture in (K.posture for K in plan.stiffness)]
    np.testing.assert_allclose(line(ax, "way"), 1e3 * np.array(tips))
    last = plan.stiffness[-1].posture
    np.testing.assert_allclose(line(ax, "bone:1"), 1e3 * last.bones[1][:, [0, 2]])
    for k in (0, 1):
        ghost = line(ax, f"ghost:{k}:1")
        np.testing.assert_allclose(
            ghost, 1e3 * plan.stiffness[k].posture.bones[1][:, [0, 2]], rtol=1e-9
        )
    shades = [to_rgba(artists(ax, f"{name}:1")[f"{name}:1"].get_color())[0] for name in (
        "ghost:0", "ghost:1")]  # fmt: skip
    assert 1.0 > shades[0] > shades[1] > 0.5  # the later, the darker
    require_look(ax)
    with Image.open(tmp_path / "arm.gif") as film:
        assert film.n_frames == 3  # type: ignore[attr-defined]
    F = np.random.default_rng(0).uniform(10.0, 90.0, plan.tensions.shape)
    for pulls, options in ((plan.tensions, {}), (F, {"tensions": F})):
        ax = plots.plot_path(plan, **options)
        for name, pull in zip(plan.arm.cables.names, pulls[-1], strict=True):
            shade = TENSION_COLORS((pull - pulls.min()) / np.ptp(pulls))
            color = artists(ax, f"cable:{name}:0")[f"cable:{name}:0"].get_color()
            np.testing.assert_allclose(to_rgba(color), shade, atol=1e-9)


def test_each_frame_of_a_film_has_its_own_posture_tensions_and_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    poses = [POSE.arm.at(share * POSE.q) for share in (-1.0, 0.0, 1.0)]
    F = np.random.default_rng(1).uniform(10.0, 90.0, (3, len(POSE.arm.cables)))
    tips = np.array([1e3 * pose.tip[[0, 2], 3] for pose in poses])
    grab: Any = PillowWriter.grab_frame
    frames: list[str] = []

    def read(writer: Any, **options: Any) -> None:
        ax, k = writer.fig.axes[0], len(frames)
        frames.append(ax.get_title(loc="left"))
        for i, bone in enumerate(poses[k].bones):
            np.testing.assert_allclose(line(ax, f"bone:{i}"), 1e3 * bone[:, [0, 2]], atol=1e-9)
        for name, path, pull in zip(POSE.arm.cables.names, poses[k].cable_paths, F[k], strict=True):
            cable = artists(ax, f"cable:{name}:0")[f"cable:{name}:0"]
            np.testing.assert_allclose(cable.get_xydata(), 1e3 * path[:2, [0, 2]])
            shade = TENSION_COLORS((pull - F.min()) / np.ptp(F))
            np.testing.assert_allclose(to_rgba(cable.get_color()), shade, atol=1e-9)
        np.testing.assert_allclose(line(ax, "way"), tips[: k + 1], atol=1e-9)
        (bar,) = (child for child in ax.child_axes if child.get_title(loc="left") == "N")
        np.testing.assert_allclose(bar.get_ylim(), [F.min(), F.max()])
        grab(writer, **options)

    monkeypatch.setattr(PillowWriter, "grab_frame", read)
    plots.plot_path(poses, view=FRONT, tensions=F, animate=tmp_path / "arm.gif")
    assert frames == [f"{POSE.arm.name}, posture {k} of 2" for k in range(3)]
    with Image.open(tmp_path / "arm.gif") as film:
        assert film.n_frames == 3  # type: ignore[attr-defined]
        pictures = []
        for k in range(3):
            film.seek(k)
            pictures.append(np.asarray(film.convert("L"), dtype=float)[60:])  # below the title
    grey = [abs(picture - 204.0) < 3.0 for picture in pictures]  # the links
    moved = [np.mean(one != other) / np.mean(one) for one, other in pairwise(grey)]
    assert min(moved) > 0.5


def test_modes_are_drawn_in_their_shapes() -> None:
    modes = cdsm.modes(K)
    ax = modes.plot(view=FRONT)
    legend = ax.get_legend()
    keys = zip(legend.get_lines(), legend.get_texts(), strict=True)
    colors = {text.get_text(): key.get_color() for key, text in keys}
    assert len(colors) == 3
    for k, (frequency, shape) in enumerate(
        zip(modes.frequencies[:3], modes.shapes.T, strict=False)
    ):
        name = f"mode {k + 1}, {frequency:.3g} Hz"
        gid = f"mode:{name}:{len(POSE.bones) - 1}"
        tip = line(ax, gid)[-1] / 1e3 - POSE.tip[[0, 2], 3]
        wanted = (POSE.jacobian[:3] @ shape)[[0, 2]]
        assert tip @ wanted > 0.7 * np.linalg.norm(tip) * np.linalg.norm(wanted)
        assert artists(ax, gid)[gid].get_color() == colors[name]
    require_look(ax)


def test_deflections_that_grow_are_named_by_their_rate() -> None:
    loose = short_arm(spring=1500.0, lead=0.5).at(np.array([0.1, 0.0, 0.08, 0.0, 0.05, 0.02]))
    modes = cdsm.modes(cdsm.stiffness(loose, cdsm.distribute_tension(loose, 100.0)))
    ax = modes.plot(view=FRONT)
    said = [text.get_text() for text in ax.get_legend().get_texts()]
    rates = [f"growth {k}, {rate:.3g}/s" for k, rate in enumerate(modes.growth_rates, 1)]
    swings = [f"mode {k}, {frequency:.3g} Hz" for k, frequency in enumerate(modes.frequencies, 1)]
    assert said == [*rates, *swings][:3]
    assert rates
    assert len({name.partition(", ")[2] for name in rates}) < len(rates)  # some print alike
    assert ax.get_title(loc="left").startswith("UNSTABLE")
    bent = {gid.rpartition(":")[0] for gid in artists(ax, "mode:")}
    assert bent == {f"mode:{name}" for name in said}
    for name, shape in zip(rates[:3], modes.growth_shapes.T, strict=False):
        near = loose.arm.at(loose.q + 1e-4 * shape, check_limits=False).bones
        up = np.array([new[1, 2] - old[1, 2] for new, old in zip(near, loose.bones, strict=True)])
        drawn = [line(ax, f"mode:{name}:{k}")[1, 1] for k in range(len(loose.bones))]
        flat = [1e3 * bone[1, 2] for bone in loose.bones]
        assert np.corrcoef(up, np.subtract(drawn, flat))[0, 1] > 0.9
    require_look(ax)


def test_forces_within_the_outline_are_those_that_cables_balance() -> None:
    polytope = cdsm.force_polytope(POSE, 10.0, 200.0)
    ax = polytope.plot(view=FRONT)
    outline = artists(ax, "outline")["outline"].get_xy()
    corners = polytope.vertices[:, [0, 2]]
    np.testing.assert_allclose(outline.max(axis=0), corners.max(axis=0))
    np.testing.assert_allclose(outline.min(axis=0), corners.min(axis=0))
    worst = polytope.radius * polytope.worst_direction[[0, 2]]
    np.testing.assert_allclose(line(ax, "worst"), [[0.0, 0.0], worst], atol=1e-12)
    np.testing.assert_allclose(line(ax, "no load"), [[0.0, 0.0]])
    hull = ConvexHull(polytope.vertices).equations
    (edges,) = artists(ax, "edges").values()
    assert edges.get_segments()
    for segment in edges.get_segments():  # each is one of a face towards the eye, in −y
        ends = [abs(corners - end).sum(axis=1).argmin() for end in segment]
        np.testing.assert_allclose(corners[ends], segment)
        off = abs(polytope.vertices[ends] @ hull[:, :3].T + hull[:, 3]).max(axis=0)
        assert hull[off < 1e-6 * np.ptp(corners), 1].min() < 0.0
    require_all([(numbers(words(ax), "red: {} in the worst direction")[0], polytope.radius)])
    (length,) = numbers(words(ax), "axes {}")
    assert length.unit == "N"
    require_look(ax)


def test_what_cannot_be_drawn_is_named(tmp_path: Path) -> None:
    other: Any = cdsm.presets.virtual_prototype().at(np.zeros(10))
    jpg, film = tmp_path / "a.jpg", tmp_path / "a.mp4"
    solid = Figure().add_subplot(projection="3d")
    for call, problem in (
        (lambda: plots.plot_arm(3), "pose: 3 given; a Posture is needed"),  # type: ignore[arg-type]
        (lambda: plots.plot_arm(other, PULL), "tension: belongs to another arm"),
        (lambda: plots.plot_arm(other, [1.0]), "tension: "),
        (lambda: plots.plot_arm(other, stiffness=K), "stiffness: belongs to another posture"),
        (lambda: plots.plot_arm(POSE, ax=solid), "ax: axes of the kind '3d' given"),
        (lambda: plots.plot_arms([(POSE,), (POSE,)], [one_panel()]), "axs: has 1 of the 2 axes"),
        (lambda: plots.plot_path([POSE, other]), "path: give postures of one arm"),
        (lambda: plots.plot_path([POSE], animate=film), r"must end in \.gif"),
        (lambda: plots.save_figure(POSE.plot(), jpg), r"path: .*\.pdf, \.svg, \.png"),
    ):
        with pytest.raises(cdsm.InvalidInput, match=problem):
            call()


@pytest.mark.parametrize("suffix", [".pdf", ".svg", ".png"])
def test_figures_have_the_same_bytes_each_time(tmp_path: Path, suffix: str) -> None:
    once, twice = (
        plots.save_figure(PULL.plot(), tmp_path / f"{k}{suffix}").read_bytes() for k in "ab"
    )
    assert once == twice
    assert b"CreationDate" not in once
    assert b"<dc:date>" not in once
