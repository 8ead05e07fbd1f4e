"""Slow loading of an arm with friction: equilibrium without it, energies, tangents, numbers."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.paper import law_of_stretched_length
from cdsm.statics.load_cycle import LoadHistory
from cdsm.support.values import Array
from tests.support import arms
from tests.support.locked import hinge

WIRE = cdsm.LinearElasticity(48e3)


def planar(
    mu: float, joints: int = 2, law: cdsm.Elasticity = WIRE
) -> tuple[cdsm.Posture, cdsm.Tension]:
    """Hinges about y at 15°: R 25, h 12, links 60 mm, lead 0.3 m, 50 N."""
    sizes = {"link_length": 0.06, "disk_offset": 0.012, "hole_radius": 0.025, "lead": 0.3}
    arm = hinge(joints=joints, law=law, friction=mu, **sizes)
    pose = arm.at(np.full(joints, np.deg2rad(15.0)))
    return pose, cdsm.distribute_tension(pose, 50.0)


def prototype(mu: float, law: cdsm.Elasticity = WIRE) -> tuple[cdsm.Posture, cdsm.Tension]:
    return arms.prototype(law, lead=0.3, friction=mu)


def along_z(*forces: float) -> Array:
    wrenches = np.zeros((len(forces), 6))
    wrenches[:, 2] = forces
    return wrenches


# --- without friction -----------------------------------------------------------------------


def slender(law: cdsm.Elasticity = WIRE, **cables: Any) -> cdsm.Posture:
    sizes = {"link_length": 0.05, "base_length": 0.02, "disk_offset": 0.01, "hole_radius": 0.03}
    geometry = arms.readme_geometry(joints=2, link_mass=0.2, lead=0.2, **sizes)
    forced = cables.pop("forced", ())
    routed = [
        replace(cable, control="force") if c in forced else cable
        for c, cable in enumerate(cdsm.serpentine_cables(geometry, law, **cables))
    ]
    arm = cdsm.Manipulator(geometry, cables=routed)
    return arm.at(np.deg2rad([5.0, -8.0, 6.0, 4.0]))


@pytest.mark.parametrize(
    ("pose", "tension", "load"),
    [
        (slender(), 60.0, 8.0),
        (slender(cdsm.StrandElasticity.eq19_repaired(), series_stiffness=5e4), 60.0, 8.0),
        (slender(forced=(0, 4)), 60.0, 8.0),
        (slender(), 12.0, 60.0),  # cables go slack
        (slender(series_stiffness=1e3), 12.0, 40.0),  # joints reach their stops
    ],
    ids=["linear", "strand behind springs", "force", "slack", "stops"],
)
def test_without_friction_every_load_gives_the_equilibrium(
    pose: cdsm.Posture, tension: float, load: float
) -> None:
    pull = cdsm.distribute_tension(pose, tension)
    wrenches = load * np.array([[0, 0.3, 1, 0, 0.01, 0], [0, -1, 0.2, 0.01, 0, 0], [0] * 6])
    history = cdsm.load_cycle(pose, pull, wrenches)
    for k, wrench in enumerate(wrenches):
        rest = cdsm.equilibrium(pose, pull, wrench)
        scale = float(np.linalg.norm(rest.displacement))
        # rounding of the lengths times EA over the stiffness
        np.testing.assert_allclose(history.tip[k], rest.pose.tip[:3, 3], atol=1e-8 * scale + 1e-13)
        for T, expected in zip(history.tensions, rest.tension, strict=True):
            np.testing.assert_allclose(T[k], expected, rtol=1e-9, atol=1e-7)
        np.testing.assert_allclose(history.stop_torque[k], rest.stop_torque, rtol=1e-6, atol=1e-9)
    assert not history.sliding.any()
    assert not history.dissipated.any()


# --- energies -------------------------------------------------------------------------------


def loop(history: LoadHistory, since: int) -> tuple[float, float]:
    """Work of the force along z, by trapezoids, and dissipated work [J] of the loads since one."""
    z, f = history.tip[since - 1 :, 2], history.wrenches[since - 1 :, 2]
    return float(np.diff(z) @ (f[1:] + f[:-1]) / 2.0), float(history.dissipated[since:].sum())


def test_closed_loop_loses_its_work_in_the_holes() -> None:
    # one hinge: one hole per cable, so the second cycle ends where it began
    pose, pull = planar(0.3, joints=1)
    off = []
    for n in (10, 40):  # 4 s: a rate needs both
        up = np.linspace(-9.0, 9.0, n + 1)
        path = along_z(*np.concatenate([up, *2 * [up[-2::-1], up[1:]]]))
        history = cdsm.load_cycle(pose, pull, path)
        np.testing.assert_allclose(history.tip[-1], history.tip[n], atol=1e-13)
        work, lost = loop(history, 3 * n + 1)
        assert lost > 1e-5
        off.append(abs(work / lost - 1.0))
    # of first order in the steps, since holes begin and stop to slide within one
    assert off[0] < 0.01
    assert off[1] < 0.3 * off[0]


@pytest.mark.parametrize("law", [WIRE, cdsm.StrandElasticity.eq19_repaired()])
def test_energy_never_comes_from_holes(law: cdsm.Elasticity) -> None:
    pose, pull = prototype(0.15, law)
    rng = np.random.default_rng(4)
    wrenches = np.c_[rng.uniform(-8.0, 8.0, (8, 3)), rng.uniform(-0.1, 0.1, (8, 3))]
    history = cdsm.load_cycle(pose, pull, wrenches)
    assert (history.dissipated >= 0.0).all()
    assert history.dissipated.sum() > 0.0


def test_locked_motors_keep_their_wire() -> None:
    pose, pull = planar(0.3)
    history = cdsm.load_cycle(pose, pull, along_z(*np.tile([7.0, -2.0, 5.0, -7.0], 5)))
    wire = []
    for k, T in enumerate(history.segment_tensions):
        natural = history.pose(k).segments.lengths / (1.0 + T / 48e3)
        wire.append(np.bincount(pose.segments.chains.cable, natural))
    assert np.ptp(wire, axis=0).max() < 1e-14


@pytest.mark.parametrize("control", ["position", "force"])
def test_tension_falls_from_a_motor_that_pulls(control: cdsm.cable.Control) -> None:
    pose, pull = planar(0.2)
    first, *others = pose.arm.cables
    pose = pose.arm.with_cables([replace(first, control=control), *others]).at(pose.q)
    F = pull.values
    # pulls, and lets go again
    taken = [2e-4, 0.0] if control == "position" else [1.3 * F[0], F[0]]
    motors = np.array([[each, 0.0, 0.0, 0.0] for each in taken])
    history = cdsm.load_cycle(pose, F, np.zeros((2, 6)), motors=motors)
    assert history.dissipated.min() > 0.0
    T = history.tensions[0]
    grip = math.exp(0.2 * pose.segments.wrap[0])
    if control == "force":
        assert T[0, 0] == pytest.approx(1.3 * F[0], rel=1e-15)
        assert T[1, 0] == pytest.approx(F[0], rel=1e-15)
    # pulled, the tension falls towards the end, and rises when the motor lets go
    np.testing.assert_array_less(T[0, 1:], T[0, :-1])
    assert T[0, 0] / T[0, 1] == pytest.approx(grip, rel=0.02)
    np.testing.assert_array_less(T[1, :-1], T[1, 1:])


# --- numbers of an independent computation ----------------------------------------------------

PLANAR = {  # μ: secant to −6 N [N/mm], left over at 0 N [mm], loss per cycle of ±6 N [mJ]
    0.05: (29.34, 0.0102, 0.231),
    0.2: (34.39, 0.0405, 0.769),
    0.4: (44.70, 0.0804, 1.128),
}


@pytest.mark.parametrize("mu", PLANAR)
def test_numbers_of_an_independent_program_on_a_planar_arm(mu: float) -> None:
    secant, left, lost = PLANAR[mu]
    pose, pull = planar(mu, law=law_of_stretched_length(WIRE))
    history = cdsm.load_cycle(pose, pull, along_z(-6.0, 0.0, 6.0, -6.0, 6.0, -6.0))
    z = 1000.0 * history.displacement[:, 2]
    assert -6.0 / z[0] == pytest.approx(secant, rel=3e-3)
    assert -z[1] == pytest.approx(left, rel=6e-3)
    assert 1000.0 * history.dissipated[4:].sum() == pytest.approx(lost, rel=6e-3)
    # original lengths, the default, change the secants by 0.2 %
    pose, pull = planar(mu)
    default = cdsm.load_cycle(pose, pull, along_z(-6.0)).displacement[0, 2]
    assert 1000.0 * default == pytest.approx(z[0], rel=2e-3)


# --- errors ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wrenches", "options", "said"),
    [
        (np.zeros(6), {}, r"wrenches.*\(n, 6\)"),
        (np.zeros((2, 3)), {}, r"wrenches.*\(n, 6\)"),
        (np.zeros((0, 6)), {}, r"wrenches.*\(n, 6\)"),
        (along_z(math.nan), {}, "wrenches"),
        (along_z(1.0), {"motors": np.zeros((2, 4))}, r"motors.*\(1, 4\) needed"),
        (along_z(1.0), {"motors": [[0.5, 0.0, 0.0, 0.0]]}, r"motors: 0\.5 m of .* cable1_1"),
        (along_z(1.0), {"substeps": 0}, "substeps"),
    ],
)
def test_bad_input_is_named(wrenches: Array, options: dict[str, Any], said: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=said):
        cdsm.load_cycle(*planar(0.1), wrenches, **options)


def test_load_that_no_law_covers_is_named() -> None:
    pose = slender(cdsm.StrandElasticity.eq19_repaired())
    pull = cdsm.distribute_tension(pose, 50.0)
    with pytest.raises(cdsm.ElasticityRangeError, match="after the step to load 1"):
        cdsm.load_cycle(pose, pull, along_z(1.0, 900.0))


@pytest.mark.long  # a quarter of a minute, on the brink of buckling
def test_snap_through_is_a_warning() -> None:
    geometry = arms.readme_geometry(
        joints=3, link_length=[0.04, 0.048, 0.078], disk_offset=[0.012, 0.0134, 0.0108],
        hole_radius=[0.023, 0.0217, 0.0127], link_mass=0.05, friction=0.054,
    )  # fmt: skip
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(88e3))
    pose = arm.at(np.deg2rad([5.0, -5.0, 10.0, 3.0, 8.0, -6.0]))
    load = np.array([40.0, 15.0, 12.0, 0.0, 0.0, 0.0])
    history = cdsm.load_cycle(pose, cdsm.distribute_tension(pose, 30.0), [load, 0 * load, -load])
    assert history.warnings == ("SNAPS THROUGH at load 2",)
    assert history.snaps.tolist() == [False, False, True]
    # without friction the arm buckles on the same way
    with pytest.raises(cdsm.EquilibriumError, match="buckles at 7"):
        cdsm.weight_test(pose, cdsm.distribute_tension(pose, 30.0), -load[:3], steps=1)


def test_errors_fall_as_the_sub_steps_grow_with_rate_one() -> None:
    """Single errors fall unevenly, as a hole stops within a step; their geometric mean does not."""
    counts = (1, 2, 4, 8, 16)
    tips, works = np.zeros((2, 5, len(counts)))
    for seed in range(len(tips)):
        rng = np.random.default_rng(seed)
        pose, pull = prototype(rng.uniform(0.05, 0.3))
        wrenches = np.hstack([rng.uniform(-8.0, 8.0, (3, 3)), np.zeros((3, 3))])
        fine = cdsm.load_cycle(pose, pull, wrenches, substeps=128)
        size = np.linalg.norm(fine.displacement, axis=1).max()
        for i, n in enumerate(counts):
            coarse = cdsm.load_cycle(pose, pull, wrenches, substeps=n)
            tips[seed, i] = np.linalg.norm(coarse.tip - fine.tip, axis=1).max() / size
            works[seed, i] = abs(coarse.dissipated.sum() / fine.dissipated.sum() - 1.0)
    default = counts.index(4)
    assert tips[:, default].max() < 0.01
    assert np.median(works[:, default]) < 0.003
    for errors in (tips, works):
        rate = -np.polyfit(np.log(counts), np.log(errors).mean(axis=0), 1)[0]
        assert 0.75 < rate < 1.6


@pytest.mark.parametrize("load", [0.5, 5.2, 15.0])
def test_tangent_is_the_derivative_of_the_history(load: float) -> None:
    pose, pull = prototype(0.1)
    step = 1e-3
    path = along_z(load - step, load, load + step)
    history = cdsm.load_cycle(pose, pull, path)
    if (history.sliding[0] != history.sliding[2]).any():
        pytest.fail("a hole begins to slide at this load; choose another one")
    numerical = 2.0 * step / (history.tip[2] - history.tip[0])[2]
    assert history.stiffness(1).along("z") == pytest.approx(numerical, rel=1e-5)


def test_loads_have_one_number_everywhere() -> None:
    history = cdsm.load_cycle(*planar(0.1), along_z(1.0, 2.0, 3.0))
    for k, load in enumerate(history.load):
        np.testing.assert_array_equal(history.pose(load).q, history.angles[k])
        np.testing.assert_array_equal(history.stiffness(load).wrench, history.wrenches[k])
        assert float(history.to_xarray()["tip"].sel(load=load)[2]) == history.tip[k, 2]
        force = str(history).splitlines()[1 + k].split()
        assert (int(force[0]), float(force[3])) == (load, history.wrenches[k, 2])
    with pytest.raises(cdsm.InvalidInput, match="load: 3"):
        history.pose(len(history.load))


PROTOTYPE = {  # μ: secants at 0.25, 1, 2, 20 N [N/mm], left over after 20 N [µm], holes that slide
    0.05: ((257.6, 93.4, 55.9, 39.2), 34.0, 67),
    0.2: ((257.6, 258.0, 250.0, 44.9), 59.0, 53),
}


@pytest.mark.parametrize("mu", [0.05, 0.2])
def test_numbers_of_an_independent_program_on_the_prototype(mu: float) -> None:
    secants, left, holes = PROTOTYPE[mu]
    pose, pull = prototype(mu)
    forces = np.array([0.25, 1.0, 2.0, 20.0])
    history = cdsm.load_cycle(pose, pull, along_z(*forces, 0.0))
    z = 1000.0 * history.displacement[:, 2]
    np.testing.assert_allclose(forces / z[:4], secants, rtol=1e-2)
    assert 1000.0 * z[4] == pytest.approx(left, abs=1.0)
    assert abs(np.count_nonzero(history.sliding[3]) - holes) <= 3
