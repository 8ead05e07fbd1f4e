"""What the live view computes for a setting of its controls, and what its page says of it."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.status import Status
from cdsm.support.values import Array
from cdsm.view.saving import python_text
from cdsm.view.scene import SLIDES, STICKS, Scene
from cdsm.view.state import Setting, Shown, show
from cdsm.view.texts import answer_text, head_text, matrix_text, tensions_text
from tests.core.test_posture import ring
from tests.support import foreign
from tests.support.arms import readme_geometry

DEGREES = [10.0, 5.0, -8.0, 12.0, 6.0, -4.0]
STABLE, UNSTABLE, INFEASIBLE = 20.0, 60.0, 150.0
"""Least tensions [N] at which the soft arm is each of them, none above 200 N."""

FORCE = (0.2, -0.3, -0.5)


def soft_arm() -> cdsm.Manipulator:
    """Springs in series: it buckles before the tensions are infeasible."""
    geometry = readme_geometry(joints=3, hole_radius=0.02, link_mass=0.1)
    law = cdsm.LinearElasticity(2e5)
    cables = cdsm.serpentine_cables(geometry, law, series_stiffness=8000.0)
    return cdsm.Manipulator(geometry, cables=cables)


def setting(
    arm: cdsm.Manipulator,
    minimum: float = STABLE,
    force: tuple[float, float, float] = (0.0, 0.0, 0.0),
    q: Array | None = None,
) -> Setting:
    q = np.deg2rad(DEGREES[: arm.nv]) if q is None else q
    return Setting(q=q, minimum=minimum, maximum=200.0, force=np.array(force))


def sagged(
    arm: cdsm.Manipulator, minimum: float = STABLE, force: tuple[float, float, float] = FORCE
) -> Shown:
    return show(arm, replace(setting(arm, minimum, force), sag=True))


def text(shown: Shown) -> str:
    scene = Scene.__new__(Scene)
    scene.cell = 0.01
    return head_text(shown) + answer_text(shown, scene)


def numbers(shown: Shown) -> dict[str, str]:
    """The numbers that the page shows, by what they are."""
    return dict(re.findall(r"<tr><td>(.*?)</td><td[^>]*>(.*?)</td>", text(shown)))


def along(K: cdsm.Stiffness) -> str:
    return ", ".join(f"{K.along(u) / 1e3:.4g}" for u in np.eye(3))


def test_a_stable_arm_is_shown_with_the_numbers_of_the_api() -> None:
    arm = soft_arm()
    shown = show(arm, setting(arm, force=(0.5, -1.0, -2.0)))
    pose = arm.at(np.deg2rad(DEGREES))
    pull = cdsm.distribute_tension(pose, STABLE, 200.0, (0.5, -1.0, -2.0, 0, 0, 0))
    K = cdsm.stiffness(pose, pull)
    said = numbers(shown)
    assert shown.status is Status.OK
    assert said["stiffness along x, y, z"] == along(K)
    assert said["smallest joint stiffness"] == f"{K.margin:.4g}"
    assert said["tip"] == ", ".join(f"{1000.0 * x:.1f}" for x in pose.tip[:3, 3])
    tensions = [value for name, value in said.items() if "tension" in name]
    assert tensions == [f"{end:.4g}" for end in (pull.values.min(), pull.values.max())]
    largest = 1e3 * np.linalg.norm(K.compliance[:3, :3], 2)
    assert said["largest compliance"] == f"{largest:.3g}"
    (softest,) = (float(value) for name, value in said.items() if name.startswith("softest"))
    assert softest == pytest.approx(1.0 / largest, rel=2e-3)
    beyond = show(arm, setting(arm, q=np.full(6, 3.0)))
    assert (beyond.status, numbers(beyond)) == (Status.BEYOND_LIMITS, {})
    assert "joint1_1" in beyond.problem


def test_the_page_tells_loads_that_belong_to_the_arm() -> None:
    arm = soft_arm().with_loads(cdsm.Load("link2", (0.0, 0.0, -0.3)))
    shown = show(arm, setting(arm))
    K = cdsm.stiffness(arm.at(np.deg2rad(DEGREES)), shown.tension or [])
    assert numbers(shown)["stiffness along x, y, z"] == along(K)
    assert "load of the arm on link2, (0, 0, 0) mm in its frame: (0, 0, -0.3) N" in text(shown)
    assert "load of the arm" not in text(show(soft_arm(), setting(arm)))


@pytest.mark.parametrize(
    ("minimum", "force", "status"),
    [
        (UNSTABLE, 0.0, Status.UNSTABLE),
        (STABLE, -20.0, Status.UNSTABLE),
        (INFEASIBLE, 0.0, Status.INFEASIBLE),
        (201.0, 0.0, Status.INVALID_INPUT),
        (STABLE, 1e16, Status.INVALID_INPUT),
    ],
)
def test_where_the_arm_does_not_hold_no_stiffness_of_the_tip_is_said(
    minimum: float, force: float, status: Status
) -> None:
    arm = soft_arm()
    shown = show(arm, setting(arm, minimum, (0.0, 0.0, force)))
    said = numbers(shown)
    assert shown.status is status
    assert status.title in text(shown)
    assert shown.problem
    assert shown.ellipsoid is None
    assert not any(name.startswith(("stiffness", "soft", "stiff", "largest c")) for name in said)
    assert ("smallest joint stiffness" in said) == (status is Status.UNSTABLE)
    if status is Status.UNSTABLE:
        assert float(said["smallest joint stiffness"]) < 0.0
        assert "it would hold with" in shown.problem


def test_names_and_messages_are_text_and_not_markup() -> None:
    law = cdsm.LinearElasticity(3e4)
    cables = [cdsm.Cable(f"<b>*{c.name}*|", c.sites, law) for c in foreign.cables(law)]
    arm = cdsm.Manipulator.from_urdf(foreign.TREE, cables, tip="tip", gravity=(0.0, 0.0, 0.0))
    shown = show(arm, Setting(q=foreign.POSTURE, minimum=0.0, force=np.zeros(3)))
    for written in (text(shown), tensions_text(shown)):
        assert "<b>*" not in written
        assert "&lt;b&gt;*" in written


def test_what_is_shown_is_the_equilibrium_of_the_arm_tensioned_without_the_force() -> None:
    """With friction it sags less, and says which holes slide."""
    arm = soft_arm()
    pose = arm.at(setting(arm).q)
    tension = cdsm.distribute_tension(pose, STABLE, 200.0)
    rest = cdsm.equilibrium(pose, tension, (*FORCE, 0.0, 0.0, 0.0))
    test = cdsm.weight_test(pose, tension, FORCE)
    rough = arm.with_friction(0.1)
    history = cdsm.load_cycle(rough.at(pose.q), tension.values, [[*FORCE, 0.0, 0.0, 0.0]])
    shown, stuck = sagged(arm), sagged(rough)
    # both stop where the imbalance is rounding; the softest mode makes 1e-12 m of it at most
    for each, by in (
        (shown, rest.displacement),
        (shown, test.displacements[-1]),
        (stuck, history.displacement[0]),
    ):
        assert each.status is Status.OK
        assert each.rest is not None
        np.testing.assert_allclose(each.rest.displacement, by, atol=1e-9)
    assert 0.0 < history.displacement[0] @ FORCE < rest.displacement @ FORCE
    said = numbers(shown)
    assert said["displacement"] == ", ".join(f"{1e3 * x:z.1f}" for x in rest.displacement)
    assert said["stiffness along x, y, z"] == along(rest.stiffness)
    listed = re.findall(r"([^>]+) N \w*</span></div>", tensions_text(shown))
    assert listed == [f"{F:.4g}" for F in rest.tension]
    sticking, sliding = stuck.holes
    assert 0 < np.count_nonzero(history.sliding[0]) == len(sliding)
    assert len(sticking) + len(sliding) == len(history.holes)
    swatch = '<span style="background:rgb{};border-radius:0.2em">&emsp;</span>'
    legend = f"{swatch.format(STICKS)} {len(sticking)} holes stick, "
    legend += f"{swatch.format(SLIDES)} {len(sliding)} slide"
    assert legend in text(stuck)
    assert numbers(stuck)["stiffness along x, y, z"] == along(history.stiffness(0))
    moved = sagged(arm, UNSTABLE, (0.0, 0.0, 0.0))
    assert moved.status is Status.MOVED
    assert "moved to another equilibrium" in text(moved)


def ran(arm: cdsm.Manipulator, at: Setting) -> dict[str, Any]:
    """What the lines of Python on the page name."""
    names: dict[str, Any] = {"arm": arm, "cdsm": cdsm}
    exec(python_text(arm, at), names)
    return names


@pytest.mark.parametrize("friction", [0.0, 0.2])
@pytest.mark.parametrize("sag", [False, True])
def test_the_lines_of_python_compute_what_the_page_shows(friction: float, sag: bool) -> None:
    arm = soft_arm().with_friction(friction)
    at = replace(setting(arm, 12.345678, FORCE), sag=sag)
    names = ran(arm, at)
    tensions = show(arm, at).tensions
    assert tensions is not None
    # twelve digits are printed
    np.testing.assert_allclose(names.get("rest", names.get("K")).tension, tensions, rtol=1e-9)


# --- motors that pull ---------------------------------------------------------------------------


def test_the_point_of_a_link_moves_as_the_arm_does() -> None:
    arm = soft_arm()
    pose = arm.at(setting(arm).q)
    shown = show(arm, replace(setting(arm, force=FORCE), sag=True, link="link2"))
    rest = cdsm.equilibrium(
        pose,
        cdsm.distribute_tension(pose, STABLE, 200.0),
        [cdsm.Load("link2", force=FORCE)],
    )
    moved = rest.pose.link_pose("link2")[:3, 3] - pose.link_pose("link2")[:3, 3]
    assert moved @ FORCE > 1e-4
    said = numbers(shown)
    assert said["displacement of link2"] == ", ".join(f"{1e3 * x:z.1f}" for x in moved)
    assert said["displacement"] == ", ".join(f"{1e3 * x:z.1f}" for x in rest.displacement)


def test_tensions_at_their_bounds_are_marked_by_which_it_is() -> None:
    arm = soft_arm()
    pose = arm.at(setting(arm).q)
    most = float(cdsm.distribute_tension(pose, STABLE).values.max()) * (1.0 + 1e-9)
    shown = show(arm, replace(setting(arm), maximum=most))
    F = cdsm.distribute_tension(pose, STABLE, most).values
    marks = re.findall(r"N (\w*)</span></div>", tensions_text(shown))
    low, high = F <= STABLE * (1.0 + 1e-6), most * (1.0 - 1e-6) <= F
    assert low.any()
    assert high.any()
    assert marks == [
        "min" * a + "max" * b for a, b in zip(low.tolist(), high.tolist(), strict=True)
    ]


def test_rows_and_columns_of_the_matrix_have_their_names() -> None:
    said = matrix_text(show(soft_arm(), setting(soft_arm())))
    assert re.findall(r"<tr><th>(\w+)</th>", said) == ["x", "y", "z", "mx", "my", "mz"]
    columns = re.findall(r'<th style="text-align:right">([\w ]*)</th>', said)
    assert columns == ["", "x", "y", "z", "turn x", "turn y", "turn z"]


def rod() -> cdsm.Manipulator:
    section = {"length": 0.3, "disks": 6, "hole_angles": [0.0, 2.1, 4.2], "hole_radius": 0.01}
    geometry = cdsm.Geometry.backbone(sections=[section], bending_stiffness=0.02)
    return cdsm.Manipulator(geometry, cdsm.LinearElasticity(2e4))


def pulled(*pull: float) -> Shown:
    arm = rod()
    q, force = np.zeros(arm.nv), np.array([0.0, 0.0, -0.05])
    return show(arm, Setting(q=q, minimum=0.0, force=force, pull=np.array(pull)))


def test_what_motors_pull_gives_the_posture_and_its_numbers() -> None:
    shown = pulled(0.004, -0.006, 0.0)
    force = [0.0, 0.0, -0.05, 0.0, 0.0, 0.0]
    rest = cdsm.forward_statics(rod(), pull=[0.004, -0.006, 0.0], wrench=force)
    assert shown.status is Status.OK
    assert shown.posture is not None
    np.testing.assert_allclose(shown.posture.tip, rest.pose.tip, atol=1e-12)
    said = numbers(shown)
    assert said["stiffness along x, y, z"] == along(rest.stiffness)
    assert said["tip"] == ", ".join(f"{1e3 * x:z.1f}" for x in rest.pose.tip[:3, 3])
    assert "slack" in tensions_text(shown)
    names = ran(rod(), shown.setting)
    np.testing.assert_allclose(names["rest"].pose.q, rest.pose.q, atol=1e-12)
    beyond = pulled(1.0, 0.0, 0.0)  # more wire than a cable has
    assert beyond.status is Status.INVALID_INPUT
    assert (beyond.tensions, beyond.stiffness) == (None, None)
    assert "leaves" in beyond.problem


def test_an_arm_that_collapsed_onto_a_stop_is_never_stable() -> None:
    """With locked motors it buckles, and rests on a stop: the banner says so."""
    geometry = cdsm.Geometry.universal(
        joints=3, cables_per_joint=3, link_length=0.055, base_length=0.03, disk_offset=0.012,
        hole_radius=0.014, link_mass=0.03, lead=0.3, joint_limit=0.4,
    )  # fmt: skip
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(36.8e3))
    q = np.full(arm.nv, 0.1)
    held = cdsm.payload(arm.at(q), "-z", 10.0).locked
    assert held is not None
    assert held.limit.startswith("buckling")

    def banner(force: float) -> Shown:
        push = np.array([0.0, 0.0, -force])
        return show(arm, Setting(q=q, minimum=10.0, force=push, sag=True))

    beyond = banner(1.2 * held.force)
    assert beyond.verdict is not None
    assert beyond.rest is not None
    assert beyond.heading.startswith(f"BUCKLED at {held.force:.4g} N; rests on the stop of joint")
    assert "STABLE" not in beyond.heading
    assert set(beyond.rest.warnings) < set(beyond.verdict.warnings)
    assert beyond.problem == "\n".join(beyond.verdict.warnings)
    assert (beyond.status, beyond.verdict.is_held) == (Status.MOVED, False)
    assert banner(0.05 * held.force).heading == "STABLE"
    limited = show(arm, replace(banner(1.2 * held.force).setting, maximum=30.0))
    assert "above the maximum" in limited.heading
    assert "(maximum 30 N)" in limited.problem


def test_banner_and_prints_have_one_verdict() -> None:
    """The same words, from the same place."""
    shown = pulled(0.004, -0.006, 0.0)
    rest = shown.rest
    assert rest is not None
    assert shown.verdict is not None
    assert shown.heading == rest.verdict.heading == "STABLE; cable6_2 slack"
    assert shown.problem == "\n".join(rest.warnings)
    closed = ring(50.0)
    through = show(closed.arm, Setting(q=closed.q, minimum=50.0, force=np.zeros(3)))
    assert through.stiffness is not None
    assert through.stiffness.verdict.heading == through.heading
    assert "the arm passes through itself" in through.heading
    assert closed.remarks[0] in through.problem
