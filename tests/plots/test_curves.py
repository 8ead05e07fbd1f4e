"""Curves and bars show the numbers of their results, with signs, units, events and names."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgba
from matplotlib.figure import Figure

import cdsm
from cdsm import plots
from cdsm.plots.curves import _MARKS
from cdsm.plots.lines import cable_lines, move_apart
from cdsm.plots.style import DARK, TERM_COLORS, VERMILLION, round_numbers
from tests.support.arms import mixed_arm, random_posture
from tests.support.pictures import (
    artists,
    colors_of,
    labels,
    line,
    named,
    require_look,
    rows,
    words,
)
from tests.support.printed import numbers, require_all
from tests.support.sweeps import short_arm

SHAPE = np.deg2rad([10.0, 5.0, 10.0, 5.0, -8.0, 0.0, -8.0, 0.0])
POSE = random_posture(mixed_arm(), 3)
PULL = cdsm.distribute_tension(POSE, 10.0)
K = cdsm.stiffness(POSE, PULL)


@pytest.fixture(scope="module")
def slender() -> cdsm.Posture:
    """An arm whose cables go slack one after the other under a weight."""
    geometry = cdsm.Geometry.universal(
        joints=4, cables_per_joint=3, link_length=0.06, base_length=0.03, disk_offset=0.012,
        hole_radius=0.025, link_mass=0.12, lead=0.3, joint_limit=0.5,
    )  # fmt: skip
    return cdsm.Manipulator(geometry, elasticity=cdsm.LinearElasticity(48e3)).at(SHAPE)


@pytest.mark.parametrize("direction", ["x", "z"])
def test_curve_over_tension_is_the_stiffness_and_the_sum_of_its_terms(direction: str) -> None:
    levels = [10.0, 20.0, 40.0, 80.0]
    ax = plots.plot_stiffness_over_tension(POSE, levels, direction)
    x, y = line(ax, "along").T
    np.testing.assert_allclose(x, levels)
    along = [
        cdsm.stiffness(POSE, cdsm.distribute_tension(POSE, level)).along(direction)
        for level in levels
    ]
    np.testing.assert_allclose(y, 1e-3 * np.array(along))
    terms = {gid: line(ax, gid)[:, 1] for gid in artists(ax, "term:")}
    np.testing.assert_allclose(sum(terms.values()), y, atol=5e-3 * y.max())  # small ones left out
    K80 = cdsm.stiffness(POSE, cdsm.distribute_tension(POSE, 80.0))
    shares = K80.shares(direction)
    assert terms["term:passive"][-1] == pytest.approx(1e-3 * shares.passive.sum())
    assert terms["term:active"][-1] == pytest.approx(1e-3 * shares.active.sum())
    for gid in terms:  # each has a name, in its colour
        drawn, written = colors_of(ax, gid)
        assert written in (drawn, to_rgba(DARK.get(to_hex(drawn), to_hex(drawn))))
        assert drawn == to_rgba(TERM_COLORS[gid.partition(":")[2]])
    assert ax.get_xlabel() == "least tension of all cables [N]"
    assert ax.get_ylabel() == f"stiffness along {direction} [N/mm]"
    require_look(ax)


def test_curve_begins_at_the_tension_that_held() -> None:
    """A cable asks for 30 N; levels below have no effect, and are no points of the curve."""
    arm = POSE.arm.with_cables([replace(cable, minimum=30.0) for cable in POSE.arm.cables])
    pose = arm.at(POSE.q)
    ax = plots.plot_stiffness_over_tension(pose, [5.0, 10.0, 50.0, 90.0])
    np.testing.assert_allclose(line(ax, "along")[:, 0], [30.0, 50.0, 90.0])


def test_saturation_and_buckling_are_marked_where_they_are() -> None:
    bent = short_arm(cdsm.presets.STRAND_1X19, lead=0.3).at(np.full(6, 0.1))
    saturated = cdsm.saturation(bent, "z")
    ax = saturated.plot()
    assert line(ax, "saturation")[0, 0] == pytest.approx(saturated.bound)
    room = 0.1 * np.ptp(ax.get_ylim())
    for gid in ("term:passive", "term:active"):  # names stand at the ends of their lines
        end = line(ax, gid)[-1, 1]
        assert abs(end - line(ax, gid)[0, 1]) > 2.0 * room or gid == "term:active"
        assert named(ax)[gid.partition(":")[2]].xy[1] == pytest.approx(end, abs=room)
    marked = numbers(words(ax), "{} of the most from {}")
    require_all(zip(marked, (saturated.fraction, saturated.bound), strict=True), digits=3)
    require_look(ax)
    soft = short_arm(spring=1500.0, lead=0.5).at(np.zeros(6))
    critical = cdsm.critical_tension(soft)
    levels = critical.minimum * np.array([0.2, 0.5, 0.8, 0.95, 1.1, 1.3])
    ax = plots.plot_stiffness_over_tension(soft, levels)
    assert np.isnan(line(ax, "along")[4:, 1]).all()
    shade = artists(ax, "unstable")["unstable"]
    assert shade.get_x() == pytest.approx(critical.minimum)
    assert f"buckles from {critical.minimum:.3g} N" in ax.get_title(loc="left")
    require_look(ax)
    most = 100.0 * critical.minimum  # of bounded tensions the buckling is not sought
    ax = plots.plot_stiffness_over_tension(cdsm.saturation(soft, "z", maximum=most), levels)
    assert artists(ax, "unstable")["unstable"].get_x() == pytest.approx(levels[3])
    for text in (ax.get_title(loc="left"), ax.texts[-1].get_text()):
        require_all([(numbers(" ".join(text.split()), "holds up to {}")[0], levels[3])], digits=3)
    require_look(ax)
    ax = critical.plot()
    np.testing.assert_allclose(line(ax, "margin").T, [critical.bounds, critical.margins])
    np.testing.assert_array_equal(line(ax, "event:buckling"), [[critical.minimum, 0.0]])
    require_all([(numbers(words(ax), "it buckles from {}")[0], critical.minimum)])
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        "least tension of all cables [N]", "smallest joint stiffness [N m/rad]"
    )  # fmt: skip
    (span,) = artists(ax, "unstable").values()
    assert span.get_x() == pytest.approx(critical.minimum)
    assert span.get_x() + span.get_width() == pytest.approx(critical.examined[1])
    require_look(ax)


def test_curve_of_a_sweep_has_a_scale_for_each_direction() -> None:
    dataset = cdsm.sweep(POSE.arm, [POSE.q], minimum=[10.0, 20.0, 40.0], progress=False)
    axs = plots.plot_tension_curve(dataset)
    for ax, u in zip(axs, "xyz", strict=True):
        values = dataset.along.sel(direction=u).values.ravel()
        np.testing.assert_allclose(line(ax, f"curve:{u}"), np.c_[[10, 20, 40], 1e-3 * values])
        assert ax.get_ylim()[1] < 1.5e-3 * values.max()
        assert ax.get_xlabel() == "least tension of all cables [N]"
        assert ax.get_ylabel() == f"stiffness along {u} [N/mm]"
    require_look(axs)


def test_curve_of_a_sweep_stands_at_the_least_bound_that_any_cable_has() -> None:
    first, *rest = POSE.arm.cables
    arm = POSE.arm.with_cables([replace(first, minimum=30.0), *rest])
    dataset = cdsm.sweep(arm, [POSE.q], minimum=[10.0, 40.0], progress=False)
    for ax, u in zip(plots.plot_tension_curve(dataset), "xyz", strict=True):
        np.testing.assert_allclose(line(ax, f"curve:{u}")[:, 0], [10.0, 40.0])


def test_weight_goes_up_with_the_displacement_and_events_stand_at_their_loads(
    slender: cdsm.Posture,
) -> None:
    tension = cdsm.distribute_tension(slender, minimum=10.0)
    test = cdsm.weight_test(slender, tension, [0.0, 0.0, -12.0], steps=12)
    ax = test.plot()
    moved, loads = line(ax, "test").T
    np.testing.assert_allclose(loads[1:], test.loads)
    # down, along the weight, is positive
    np.testing.assert_allclose(moved[1:], -1e3 * test.displacements[:, 2])
    assert moved[-1] > 0.0
    slope = np.diff(line(ax, "linear"), axis=0)[0]
    assert slope[1] / slope[0] == pytest.approx(1e-3 * test.tangent)
    require_all([(numbers(words(ax), "linear: {}")[0], test.tangent)], digits=3)
    require_all([(numbers(words(ax), "how far does {} move")[0], 12.0)])
    assert ax.get_xlabel() == "displacement of the tip along −z [mm]"
    assert ax.get_ylabel() == "weight [N]"
    slack = [event for event in test.events if event.kind == "slack"]
    assert slack
    curve = line(ax, "curve")
    assert len(curve) == len(loads) + len(test.events)
    assert (np.diff(curve[:, 1]) >= 0.0).all()
    for event in slack:
        (x, y) = line(ax, f"event:{event}")[0]
        assert y == event.load
        assert [x, y] in curve.tolist()  # the curve has its kink there, not at the next step
        exact = cdsm.weight_test(slender, tension, [0.0, 0.0, -event.load])
        assert x == pytest.approx(-1e3 * exact.displacement[2], rel=1e-9)
        before = cdsm.weight_test(slender, tension, [0.0, 0.0, 0.01 - event.load], steps=2)
        assert before.tensions[-1][slender.arm.cables.names.index(event.place)] > 0.0
        mark = artists(ax, f"event:{event}")[f"event:{event}"]
        assert mark.get_marker() == "o"
    assert f"{slack[0]}" in [text.get_text() for text in ax.texts]
    require_look(ax)


def test_kinds_of_events_are_told_apart_and_names_have_one_colour() -> None:
    markers, colors = zip(*_MARKS.values(), strict=True)
    assert len({*markers}) == len({*colors}) == len(_MARKS)
    assert _MARKS["buckling"] == ("X", VERMILLION)  # what ends the curve is red
    assert len({*TERM_COLORS.values()}) == len(TERM_COLORS)
    bars = K.shares("z").plot()
    legend = {text.get_text(): key for text, key in zip(
        bars.get_legend().get_texts(), bars.get_legend().get_patches(), strict=True)}  # fmt: skip
    soft = short_arm(spring=1500.0, lead=0.5).at(np.zeros(6))
    curve = plots.plot_stiffness_over_tension(soft, [2.0, 5.0, 10.0])
    for name in ("passive", "active"):
        (key,) = (key for text, key in legend.items() if text.startswith(name))
        assert to_rgba(key.get_facecolor()) == colors_of(curve, f"term:{name}")[0]


def test_weight_with_friction_is_drawn_beside_that_without() -> None:
    rough = POSE.arm.with_friction(0.1).at(POSE.q)
    tension = cdsm.distribute_tension(rough, 20.0)
    test = cdsm.weight_test(rough, tension, [0.0, 0.0, -1.0], steps=3)
    ax = test.plot()
    start = test.unloaded.pose.tip[2, 3]
    smooth = [0.0, *(1e3 * (start - state.pose.tip[2, 3]) for state in test.states)]
    drawn = line(ax, "frictionless")
    np.testing.assert_allclose(drawn, np.c_[smooth, [0.0, *test.loads]], atol=1e-12)
    assert (drawn[1:, 0] > line(ax, "test")[1:, 0]).all()  # friction holds it back
    keys = {text.get_text(): key.get_color() for text, key in zip(
        ax.get_legend().get_texts(), ax.get_legend().get_lines(), strict=True)}  # fmt: skip
    assert keys == {
        "no friction": artists(ax, "frictionless")["frictionless"].get_color(),
        "with friction": artists(ax, "curve")["curve"].get_color(),
    }
    require_look(ax)


@pytest.fixture(scope="module")
def history() -> Any:
    rough = cdsm.presets.virtual_prototype(
        cdsm.LinearElasticity(48e3), lead=0.3, friction=0.1, gravity="-z"
    ).at(np.full(10, np.deg2rad(10.0)))
    up = np.linspace(0.0, 6.0, 7)
    force = np.concatenate([up, up[-2::-1], -up[1:], -up[-2::-1], up[1:]])
    wrenches = np.outer(force, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    return cdsm.load_cycle(rough, cdsm.distribute_tension(rough, minimum=50.0), wrenches)


def test_area_of_the_loop_is_the_work_lost(history: Any) -> None:
    ax = history.plot()
    moved, force = line(ax, "loop").T
    np.testing.assert_allclose(force[1:], history.wrenches[:, 2])
    np.testing.assert_allclose(moved[1:], 1e3 * history.displacement[:, 2])
    x, y = artists(ax, "lost")["lost"].get_xy().T
    area = abs(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])) / 2.0  # mJ
    lost = 1e3 * history.dissipated[-24:].sum()
    assert area == pytest.approx(lost, rel=0.1)  # straight between the loads
    require_all([(numbers(words(ax), "{} lost per cycle")[0], 1e-3 * lost)], digits=3)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("displacement along z [mm]", "force [N]")
    slips = [line(ax, gid)[0] for gid in artists(ax, "event:holes slide")]
    first = history.events[0]
    load = np.array([[0.0, 0.0, first.load, 0.0, 0.0, 0.0]])
    there = cdsm.load_cycle(history.reference, history.reference_tension, load)
    np.testing.assert_allclose(slips, [[1e3 * there.displacement[0, 2], first.load]])
    back = [line(ax, gid)[0, 1] for gid in artists(ax, "event:slide back")]
    turned = next(event for event in history.events if (event.step or 0) > 6)
    np.testing.assert_allclose(back, [turned.load])
    require_look(ax)


def test_moments_alone_show_where_the_tip_goes(history: Any) -> None:
    pose = history.reference
    turned = cdsm.load_cycle(
        pose, history.reference_tension, np.outer([0.1, 0.2, 0.0], np.eye(6)[4])
    )
    ax = turned.plot()
    for k, axis in enumerate("xyz"):
        number, moved = line(ax, f"tip:{axis}").T
        np.testing.assert_allclose(number, [-1, 0, 1, 2])
        np.testing.assert_allclose(moved, [0.0, *1e3 * turned.displacement[:, k]], atol=1e-15)
    assert ax.get_ylabel() == "displacement [mm]"


SOFT = short_arm(spring=1500.0, lead=0.5).at(np.full(6, 0.1))


def pairwise_bars(ax: Any, count: int) -> list[tuple[tuple[float, ...], tuple[float, ...]]]:
    """The ends, in order, of the passive and the active bar of each of the first rows."""
    ends = [tuple(sorted((bar.get_x(), bar.get_x() + bar.get_width()))) for bar in ax.patches]
    return [*zip(ends[:count], ends[count : 2 * count], strict=True)]


@pytest.mark.parametrize("K", [K, cdsm.stiffness(SOFT, cdsm.distribute_tension(SOFT, 4.0))])
def test_bars_of_shares_add_up_to_the_stiffness(K: cdsm.Stiffness) -> None:
    """Of the second arm the active part is a third, and negative."""
    shares = K.shares("z")
    ax = shares.plot()
    widths = [bar.get_width() for bar in ax.patches]
    assert sum(widths) == pytest.approx(1e-3 * K.along("z"))
    count = len(K.posture.arm.cables)
    np.testing.assert_allclose(widths[:count], 1e-3 * shares.passive)
    np.testing.assert_allclose(widths[count : 2 * count], 1e-3 * shares.active)
    assert rows(ax) == [*K.posture.arm.cables.names, *shares.others]
    for passive, active in pairwise_bars(ax, count):  # none hides a part of the other
        assert max(passive[0], active[0]) >= min(passive[1], active[1]) - 1e-9
        assert 0.0 in passive
        assert {*active} & {0.0, *passive}
    percents = [text.get_text() for text in ax.texts][:count]
    parts = (shares.passive + shares.active) / shares.total
    assert percents == [f"{100.0 * part:z.1f} %" for part in parts]
    (total,) = numbers(ax.get_xlabel(), "to {} along z")
    require_all([(total, K.along("z"))])
    assert ax.get_xlabel().startswith("contribution [N/mm]")
    rest = dict(zip(shares.others, widths[2 * count :], strict=True))
    for name, value in rest.items():
        assert value == pytest.approx(1e-3 * shares.others[name])
    require_look(ax)


def test_bars_of_tensions_are_tensions_between_their_bounds() -> None:
    ax = PULL.plot(breaking=500.0)
    for name in PULL:
        assert artists(ax, "tension:")[f"tension:{name}"].get_width() == PULL[name]
    texts = [text.get_text() for text in ax.texts]
    first = PULL.values[0]
    assert texts[0] == f"{first:.1f} N, {first / 5.0:.0f} %"
    np.testing.assert_allclose(line(ax, "bound:minimum")[:, 0], 10.0)
    assert rows(ax) == [*PULL]
    centres = [bar.get_y() + bar.get_height() / 2.0 for bar in artists(ax, "tension:").values()]
    np.testing.assert_allclose(ax.get_yticks(), centres)
    require_look(ax)
    most = 1.05 * PULL.values.max()
    capped = cdsm.distribute_tension(POSE, 10.0, most).plot()
    np.testing.assert_allclose(line(capped, "bound:maximum")[:, 0], most)
    np.testing.assert_allclose(line(capped, "bound:minimum")[:, 0], 10.0)
    assert labels(capped) == {
        "bound:minimum": "least that is allowed",
        "bound:maximum": "most that is allowed",
    }
    with pytest.raises(cdsm.InvalidInput, match="breaking: -5 N given"):
        PULL.plot(breaking=-5.0)


def test_bounds_of_tensions_are_those_of_each_cable_that_held() -> None:
    """A cable may ask for more, or allow less, than all of them have to."""
    first, second, *others = POSE.arm.cables
    most = 1.05 * PULL.values.max()
    own = [replace(first, minimum=30.0), replace(second, maximum=most), *others]
    ax = cdsm.distribute_tension(POSE.arm.with_cables(own).at(POSE.q), 10.0).plot()
    least = [30.0] + [10.0] * (len(own) - 1)
    np.testing.assert_allclose(line(ax, "bound:minimum"), np.c_[least, ax.get_yticks()])
    np.testing.assert_allclose(line(ax, "bound:maximum"), [[most, ax.get_yticks()[1]]])


def test_plans_stand_between_the_softest_and_the_stiffest_arm() -> None:
    reach = cdsm.stiffness_range(POSE, "z", 10.0, 200.0)
    plan = cdsm.plan_stiffness(POSE, "z", 0.8 * reach.low + 0.2 * reach.high, 10.0, 200.0)
    for ax in (plan.plot(reach), reach.plot()):
        np.testing.assert_allclose(line(ax, "softest")[:, 0], reach.low_tension.values)
        np.testing.assert_allclose(line(ax, "stiffest")[:, 0], reach.high_tension.values)
        for name, value, marker in (("softest", reach.low, "v"), ("stiffest", reach.high, "^")):
            assert artists(ax, name)[name].get_marker() == marker  # told apart without colours
            require_all([(numbers(labels(ax)[name], f"{name}: {{}}")[0], value)])
        assert ax.get_xlabel() == "tension [N]"
        assert rows(ax) == [*plan.tension]
        require_look(ax)
    between = artists(reach.plot(), "between")["between"].get_segments()
    ends = [segment[:, 0] for segment in between]
    np.testing.assert_allclose(ends, np.c_[reach.low_tension.values, reach.high_tension.values])
    require_all([(numbers(words(plan.plot()), "which tensions give {}")[0], plan.achieved)])
    missed = replace(plan, target=2.0 * np.asarray(plan.target))
    require_all([(numbers(words(missed.plot()), "which tensions give {}")[0], plan.achieved)])
    require_all([(numbers(words(missed.plot()), "missed by {}")[0], missed.misfit)], digits=2)
    bars = artists(plan.plot(), "tension:").values()
    np.testing.assert_allclose([bar.get_width() for bar in bars], plan.tension.values)
    other = cdsm.stiffness_range(POSE, "x", 10.0, 200.0)
    with pytest.raises(cdsm.InvalidInput, match="attainable: is not of the posture"):
        plan.plot(other)


def test_critical_load_is_marked_at_its_factor() -> None:
    ax = cdsm.critical_load(POSE, np.eye(6)[0], 10.0).plot()
    assert "how much of the load does it hold? All" in words(ax)
    assert ax.get_xlabel() == "factor of the load, 1 N along x"
    soft = short_arm(spring=1500.0, lead=0.5).at(np.zeros(6))
    critical = cdsm.critical_load(soft, [-2.0, 0.0, 0.0, 0.0, 0.0, 0.0], 5.0)
    ax = critical.plot()
    np.testing.assert_allclose(line(ax, "margin").T, [critical.factors, critical.margins])
    end = critical.factor, critical.margins[-1]  # where the line ends
    np.testing.assert_array_equal(line(ax, "event:end"), [end])
    ends = {"buckling": "buckles", "infeasible": "no balance", "elasticity": "end of a law"}
    factor = numbers(words(ax), f"{ends[critical.limit]} at {{}} times the load")
    require_all([(factor[0], critical.factor)])
    assert ax.get_xlabel() == "factor of the load, 2 N along −x"
    assert ax.get_ylabel() == "smallest joint stiffness [N m/rad]"
    capped = cdsm.critical_load(soft, [0.0, 0.0, -1.0, 0.0, 0.0, 0.0], 5.0, 12.0)
    assert capped.limit == "infeasible"
    assert f"no balance at {capped.factor:.4g} times" in words(capped.plot())
    require_look(ax)


def test_names_of_cables_stand_in_the_order_of_their_last_tensions() -> None:
    values = np.array([[1.0, 9.0, 5.0], [9.0, 1.0, 6.0], [8.0, 2.0, np.nan]])
    ax = Figure(figsize=(3.0, 3.0)).subplots()
    cable_lines(ax, np.arange(3.0), values, ["falls", "rises", "ends"][::-1])
    heights = {name: named(ax)[name].xy[1] for name in ("ends", "rises", "falls")}
    np.testing.assert_allclose([*heights.values()], [8.0, 2.0, 6.0], atol=0.5)


def test_names_without_room_are_counted() -> None:
    ax = Figure(figsize=(3.0, 2.0)).subplots()
    names = [f"cable{k}" for k in range(40)]
    cable_lines(ax, np.arange(2.0), np.tile(np.arange(1.0, 41.0), (2, 1)), names)
    shown = [name for name in names if name in named(ax)]
    assert shown == [names[0], names[-1]]
    assert f"{len(names) - len(shown)} more between" in named(ax)


def test_names_move_apart_in_their_order_and_ticks_are_round() -> None:
    moved = move_apart(np.array([3.0, 1.0, 1.1]), 0.5, 0.0, 4.0)
    assert moved[1] < moved[2] < moved[0]
    assert np.diff(np.sort(moved)).min() > 0.499
    assert round_numbers(49.7, 95.6) == [50.0, 60.0, 70.0, 80.0, 90.0]


def test_soft_arms_are_drawn_in_newtons_per_metre() -> None:
    rest = cdsm.forward_statics(cdsm.presets.nitinol_segment(), tension=[3.0, 0.0, 0.0])
    soft = cdsm.stiffness(rest.pose, rest.tension)
    shares = soft.shares("y")
    ax = shares.plot()
    assert ax.get_xlabel() == f"contribution [N/m] to {soft.along('y'):.4g} N/m along y"
    assert sum(bar.get_width() for bar in ax.patches) == pytest.approx(soft.along("y"))
