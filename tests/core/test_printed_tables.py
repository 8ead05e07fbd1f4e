"""What further results print, read back by names of rows and columns, in the units they name."""

import math
from pathlib import Path
from typing import Any

import numpy as np

import cdsm
from tests.estimation.test_loads import TIP, held, readme
from tests.identification.test_tip_position import compared
from tests.support.printed import Printed, numbers, require_all, table
from tests.support.sweeps import short_arm
from tests.support.tracking import small_path

POSE = short_arm(cdsm.presets.STRAND_1X19, lead=0.3).at(np.full(6, 0.1))
PULL = cdsm.distribute_tension(POSE, 40.0)
NAMES = [*POSE.arm.cables.names]


def test_an_equilibrium_has_its_tensions_beside_those_of_the_reference() -> None:
    rest = cdsm.equilibrium(POSE, PULL, wrench=[0.0, 0.0, -0.5, 0.0, 0.0, 0.0])
    rows = table(str(rest), "cable ")
    assert [*rows] == NAMES
    for cells, F, F0 in zip(rows.values(), rest.tension, PULL.values, strict=True):
        reference = Printed(cells["reference"].text, "N")
        require_all([(cells["tension"], F), (reference, F0)], digits=None)
    moved = numbers(str(rest), "tip moved by ({}, {}, {}) mm", "mm")
    require_all(zip(moved, rest.pose.tip[:3, 3] - POSE.tip[:3, 3], strict=True))


def test_distances_are_those_to_cables_links_and_disks() -> None:
    clear = cdsm.clearance(POSE)
    values = {"cable": clear.cables, "link": clear.links, "disk": clear.disks}
    assert len({*values.values()}) == 3
    lines = str(clear).splitlines()
    pairs = zip(lines, values.items(), clear.nearest, strict=True)
    for line, (what, value), (one, other) in pairs:
        require_all([(numbers(line, f"cable to {what} {{}}, {one} and {other}")[0], value)])


def test_an_arm_that_does_not_buckle_was_looked_at_up_to_a_bound() -> None:
    critical = cdsm.critical_tension(POSE, up_to=60.0)
    assert math.isinf(critical.minimum)
    (end,) = numbers(str(critical), "does not buckle at any lower bound up to {}")
    require_all([(end, 60.0)])


def test_an_assembly_has_its_tensions_and_lengths_of_wire() -> None:
    built = POSE.arm.assemble(POSE, PULL)
    rows = table(str(built), "cable ")
    assert [*rows] == NAMES
    for cells, F, wire in zip(rows.values(), PULL.values, built.free_lengths, strict=True):
        require_all([(cells["tension"], F), (cells["wire"], wire)], digits=None)


def test_an_estimate_has_what_friction_hides_before_the_combined_deviation() -> None:
    pose = readme(0.1)
    tensions = held(pose, [*TIP, 0.1, -0.05, 0.02])
    found = cdsm.estimate_load(pose, tensions, {"tool0": "wrench"}, tension_std=0.5)
    rows = table(str(found), "load  ")
    units = [name.partition(" [")[2].rstrip("]") for name in rows]
    assert units == [*found.components.units]
    for cells, unit, band, u in zip(
        rows.values(), units, found.band, found.uncertainty, strict=True
    ):
        printed = (Printed(cells[name].text, unit) for name in ("friction ±", "combined std"))
        require_all(zip(printed, (band, u), strict=True), digits=2)
    for cells, load in zip(rows.values(), found.loads, strict=True):
        value = cells["value ± std"].text.partition(" ± ")[0]
        require_all([(Printed(value, ""), load)], digits=None)


def test_a_band_is_half_its_width_to_each_side() -> None:
    rough = POSE.arm.with_friction(0.1).at(POSE.q)
    band = cdsm.rest_band(rough, cdsm.distribute_tension(rough, 40.0), "z")
    (half,) = numbers(str(band), "the tip rests within ±{} along (0, 0, 1)")
    (load,) = numbers(str(band), "breakaway load {}")
    require_all([(half, band.half_width), (load, band.breakaway)])


def test_a_posture_that_is_not_reached_says_by_how_much() -> None:
    far = np.eye(4)
    far[:3, 3] = [0.0, 0.0, 0.5]
    found = cdsm.inverse_kinematics(POSE.arm, far)
    rows = table(str(found), "joint ")
    angles = (rows[name]["angle"] for name in POSE.arm.joint_names)
    angles = [Printed(cell.text.removesuffix("°"), "°") for cell in angles]
    require_all(zip(angles, found.angles, strict=True))
    off = numbers(str(found), "the tip is {} off its target and turned by {}")
    require_all(zip(off, (found.position_error, found.orientation_error), strict=True), digits=2)


def test_a_spatial_stiffness_names_its_point() -> None:
    pose = cdsm.presets.virtual_prototype().at(np.linspace(-0.2, 0.3, 10))
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 10.0))
    point = np.array([0.1, 0.02, -0.03])
    text = str(K.spatial(at=point))
    require_all(zip(numbers(text, "at ({}, {}, {}) mm", "mm"), point, strict=True))
    matrix = np.array([[float(cell) for cell in line.split()] for line in text.splitlines()[1:]])
    np.testing.assert_allclose(matrix, K.spatial(at=point).stiffness, rtol=1e-3, atol=1e-3)


def test_moment_arms_have_a_row_for_each_cable() -> None:
    head, *lines = str(POSE.moment_arms).splitlines()
    assert head.split() == [*POSE.arm.joint_names]
    assert lines.pop().startswith("moment arms [mm], positive: the cable turns the joint to")
    for name, line, arms in zip(NAMES, lines, -POSE.length_jacobian, strict=True):
        first, *cells = line.split()
        assert first == name
        require_all(zip((Printed(cell, "mm") for cell in cells), arms, strict=True), digits=None)


def test_a_fitted_spring_is_nearer_to_the_points_than_a_linear_one() -> None:
    fit = cdsm.fit_spring(*cdsm.read_spring_csv(Path("examples/data/SPRING.csv")))
    rms = numbers(str(fit), "rms {} of the mean torque; of a linear spring {}")
    mean = abs(fit.torque).mean()
    require_all(zip(rms, (fit.rms / mean, fit.linear_rms / mean), strict=True), digits=2)
    assert fit.rms < fit.linear_rms


def test_forces_that_are_held_in_any_direction_are_in_newtons() -> None:
    polytope = cdsm.force_polytope(POSE, 10.0, 200.0)
    held_force = numbers(str(polytope), "{} corners; holds {} in any direction")
    require_all([(held_force[1], polytope.radius)])
    least = numbers(str(polytope), "least along ({}, {}, {})")
    require_all(zip(least, polytope.worst_direction, strict=True), digits=3)


def test_motors_have_a_row_each() -> None:
    motors = POSE.arm.motors
    rows = table(str(motors), "motor ")
    assert [*rows] == [*motors.names]
    assert {cells["holds"].text for cells in rows.values()} == {"holds its length"}


def test_wraps_have_their_angles_in_degrees() -> None:
    finger = cdsm.Manipulator.read("examples/finger_with_pulleys.toml")
    wraps = finger.at(np.deg2rad([5.0, 70.0, 40.0, 20.0])).wraps
    lines = str(wraps).splitlines()
    assert lines[0].split("  ")[0] == "cable"
    largest = np.nanmax(abs(np.rad2deg(wraps.fleet_angles)))
    assert largest > 0.1  # else degrees and radians would look alike
    for line, angle, fleet, touches in zip(
        lines[1:], wraps.angle, wraps.fleet_angles, wraps.touches, strict=True
    ):
        wrap, *sides = line.replace(" / ", " ").split()[3:]
        require_all([(Printed(wrap, "°"), angle)], digits=None)
        if touches:
            shown = fleet[np.isfinite(fleet)]
            require_all(zip((Printed(x, "°") for x in sides), shown, strict=True), digits=None)


def test_explanations_say_which_of_them_explain() -> None:
    found: Any = compared()
    rows = table(str(found), "free ")
    assert [*rows] == ["nothing", *found.names]
    for name, fit, explains in zip(found.names, found.alone, found.explains, strict=True):
        cells = rows[name]
        require_all([(cells["χ²"], fit.chi_square)])
        assert cells["explains"].text == ("yes" if explains else "no")
        off = np.sqrt(np.mean((fit.predicted - fit.measured) ** 2))
        require_all([(Printed(cells["RMSE"].text, "mm"), off)], digits=3)
    assert rows["nothing"]["explains"].text == "no"


def test_a_closed_loop_has_its_errors_and_the_ends_of_its_tensions() -> None:
    run = cdsm.track(small_path(0.1), steps=2, minimum=10.0, maximum=250.0)
    text = str(run)
    error = numbers(text, "tip error, mean and largest {}, {} mm", "mm")
    require_all(zip(error, (run.tip_error.mean(), run.tip_error.max()), strict=True), digits=3)
    ends = numbers(text, "true tensions at the motors {} to {}", "N")
    require_all(zip(ends, (run.tension.min(), run.tension.max()), strict=True))
    off = abs(run.stiffness_error)
    share = numbers(text, "stiffness error, mean and largest {}, {} %", "%")
    require_all(zip(share, (np.nanmean(off), np.nanmax(off)), strict=True), digits=3)
    require_all([(numbers(text, "smallest joint stiffness {}")[0], np.nanmin(run.margin))])
