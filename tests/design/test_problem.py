"""Problems, their evaluation and searches."""

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.design.evaluation import InfeasibleDesign
from cdsm.design.result import cable_table
from cdsm.support.values import Array
from tests.support.arms import readme_geometry

pytest.importorskip("pymoo")

EXAMPLES = Path(__file__).parents[2] / "examples"
LAW = cdsm.LinearElasticity(48e3)
BENT = np.random.default_rng(2).uniform(-0.25, 0.25, (4, 6))


def small_arm(**changes: Any) -> cdsm.Manipulator:
    own = {"joints": 3, "disk_offset": 0.01, "hole_radius": 0.02, "link_mass": 0.1, "lead": 0.1}
    return cdsm.Manipulator(readme_geometry(**(own | {"friction": 0.05} | changes)), LAW)


def problem(**changes: Any) -> cdsm.DesignProblem:
    whole: dict[str, Any] = {
        "arm": small_arm(),
        "variables": (
            cdsm.Variable("hole_radius", 0.015, 0.03),
            cdsm.Variable("end@cable2_1", 1, 3),
            cdsm.Variable("wire", choices=("solid-1.2mm", 48e3)),
        ),
        "objectives": (cdsm.Objective("tension"), cdsm.Objective("along", "z")),
        "postures": BENT,
        "loads": (0.0, 0.0, -2.0, 0.0, 0.0, 0.0),
        "minimum": 20.0,
        "maximum": 400.0,
    }
    return cdsm.DesignProblem(**{**whole, **changes})


# --- evaluation ------------------------------------------------------------------------------


@pytest.mark.parametrize("rough", [False, True])
def test_quantities_are_those_of_single_postures(rough: bool) -> None:
    names = ["along", "payload"]
    objectives = tuple(cdsm.Objective(name, "z") for name in names)
    others = ("softest", "margin", "deflection", "tension", "tension_factor",
              "cable_clearance", "link_clearance", "disk_clearance", "workspace", "held", "mass",
              "length", "wire_length", "force_radius")  # fmt: skip
    task = problem(
        objectives=(*objectives, *(cdsm.Objective(name) for name in others)),
        diameter=1e-3,
        worst_friction=rough,
    )
    assert task.arm_of([0.025, 3.0, 1.0]).geometry.cables[3].joint == 3
    row = np.array([0.025, 2.0, 1.0])
    arm = task.arm_of(row)
    assert arm.geometry.hole_radii == (0.025,) * 3
    found = cdsm.evaluate_designs(task, [row])
    assert "mass" in found
    assert next(iter(found)) == "along (0, 0, 1)"
    poses = [arm.at(q) for q in BENT]
    bounds, worst = (20.0, 400.0, task.loads[0]), {"worst_friction": rough}
    pulls = [cdsm.distribute_tension(p, *bounds, worst_friction=rough) for p in poses]
    Ks = [cdsm.stiffness(p, pull) for p, pull in zip(poses, pulls, strict=True)]
    bare = [cdsm.distribute_tension(p, 20.0, 400.0, worst_friction=rough) for p in poses]
    unloaded = [cdsm.stiffness(p, pull) for p, pull in zip(poses, bare, strict=True)]
    largest = [F.values * np.exp(rough * cdsm.tension.friction_exponents(F.posture)) for F in pulls]
    clear = [cdsm.clearance(p, 1e-3) for p in poses]
    force = task.loads[0][:3]
    expected = {
        "along (0, 0, 1)": min(K.along("z") for K in Ks),
        "softest": min(1.0 / np.linalg.eigvalsh(K.compliance[:3, :3])[-1] for K in Ks),
        "margin": min(K.margin for K in Ks),
        "deflection": max(np.linalg.norm(K.compliance[:3, :3] @ force) for K in unloaded),
        "tension": np.max(largest),
        "force_radius": min(cdsm.force_polytope(p, *bounds, **worst).radius for p in poses),
        "tension_factor": min(cdsm.tension_factor(p) for p in poses),
        "cable_clearance": min(each.cables for each in clear),
        "link_clearance": min(each.links for each in clear),
        "disk_clearance": min(each.disks for each in clear),
        "payload (0, 0, 1)": min(
            cdsm.payload(p, "z", *bounds, **worst).limits["tension"] for p in poses
        ),
        "held": 1.0,
        "mass": 0.3,
        "length": 0.21,
        "wire_length": np.max([p.cable_lengths for p in poses], axis=0).sum(),
    }
    for key, value in expected.items():
        assert found[key][0] == pytest.approx(value, rel=1e-8), key
    assert found["workspace"][0] > 0.0


def test_deflection_is_that_of_payload_and_of_a_small_weight_on_locked_motors() -> None:
    row = [0.025, 2.0]
    task = problem(
        arm=cdsm.Manipulator(small_arm(friction=0.0).geometry, cdsm.presets.STRAND_1X19),
        variables=problem().variables[:2],
        objectives=(cdsm.Objective("deflection"),),
    )

    def deflection(force: float) -> float:
        loaded = replace(task, loads=np.array([0.0, 0.0, -force, 0.0, 0.0, 0.0]))
        return float(cdsm.evaluate_designs(loaded, [row])["deflection"][0])

    poses = [task.arm_of(row).at(q) for q in BENT]
    largest = deflection(9.0)
    allowed = [cdsm.payload(p, "-z", 20.0, 400.0, deflection=largest) for p in poses]
    assert min(each.limits["deflection"] for each in allowed) == pytest.approx(9.0, rel=1e-9)
    # first order: the error of a weight test falls with the weight
    errors = []
    for force in (0.2, 0.02):
        tensions = [cdsm.distribute_tension(p, 20.0) for p in poses]
        tests = [cdsm.weight_test(F.posture, F, (0.0, 0.0, -force)) for F in tensions]
        sag = max(np.linalg.norm(test.displacements[-1]) for test in tests)
        errors.append(abs(deflection(force) / sag - 1.0))
    assert errors[0] < 5e-3
    assert errors[1] < 0.11 * errors[0]


def test_a_link_keeps_its_mass_per_length_and_joints_have_values_of_their_own() -> None:
    task = problem(
        variables=(
            cdsm.Variable("link_length@2", 0.05, 0.1),
            cdsm.Variable("disk_offset@1", 0.005, 0.02),
            cdsm.Variable("lead", 0.0, 0.5),
            cdsm.Variable("phase@3", -1.0, 1.0),
            cdsm.Variable("hole_angle@cable1_2", 0.0, 6.0),
            cdsm.Variable("minimum", 5.0, 50.0),
        )
    )
    row = np.array([0.09, 0.006, 0.2, 0.5, 1.5, 33.0])
    geometry, old = task.arm_of(row).geometry, task.arm.geometry
    assert [link.length for link in geometry.links] == [0.06, 0.09, 0.06]
    assert geometry.links[1].mass == pytest.approx(0.15)
    assert [joint.disk_offset for joint in geometry.joints] == [0.006, 0.01, 0.01]
    assert {cable.lead for cable in geometry.cables} == {0.2}
    assert geometry.cables[1].angle == 1.5
    assert geometry.cables[8].angle == pytest.approx(old.cables[8].angle + 0.5)
    assert task.minimum_of(row) == 33.0
    start = task.start
    assert start is not None
    assert task.arm_of(start).geometry == old
    count = problem(variables=(cdsm.Variable("cables_per_joint", 3, 5),))
    assert len(count.arm_of([5.0]).cables) == 15
    assert count.arm_of([3.0]).geometry == old


def test_a_posture_that_is_not_held_counts_and_constraints_say_how_far() -> None:
    mass, soft = cdsm.Constraint("mass", at_most=0.2), cdsm.Constraint("along", "z", 1e3)
    found = cdsm.evaluate_designs(
        problem(maximum=22.0, constraints=(mass, soft)), [[0.02, 2.0, 1.0]]
    )
    assert found["held"][0] < 1.0
    assert found.violations[0, 0] == 1.0 - found["held"][0]
    assert found.violations[0, 1] == pytest.approx(0.5)
    assert not found.feasible[0]


def test_a_posture_that_the_worst_friction_takes_is_not_held() -> None:
    row = [[0.025, 2.0, 1.0]]
    free, rough = (problem(maximum=36.0, worst_friction=each) for each in (False, True))
    held = []
    for q in BENT:
        pose = rough.arm_of(row[0]).at(q)
        try:
            cdsm.distribute_tension(pose, 20.0, 36.0, rough.loads[0], worst_friction=True)
            held.append(1.0)
        except cdsm.InfeasibleTension:
            held.append(0.0)
    assert cdsm.evaluate_designs(rough, row)["held"][0] == np.mean(held)
    assert np.mean(held) < cdsm.evaluate_designs(free, row)["held"][0]


# --- searches --------------------------------------------------------------------------------


def test_no_design_of_the_front_is_beaten_and_it_has_the_bits_of_its_seed() -> None:
    found, again = (
        cdsm.search_designs(problem(), generations=4, population=8, seed=3) for _ in "ab"
    )
    np.testing.assert_array_equal(found.evaluated.designs, again.evaluated.designs)
    np.testing.assert_array_equal(found.front, again.front)
    other = cdsm.search_designs(problem(), generations=1, population=8, seed=4)
    assert not np.array_equal(found.evaluated.designs[:8], other.evaluated.designs)
    goals = np.column_stack(
        [each.sign * found.evaluated[each.key] for each in found.problem.objectives]
    )
    usable = found.evaluated.feasible == 1.0
    for i in found.front:
        beats = (goals[usable] <= goals[i]).all(axis=1) & (goals[usable] < goals[i]).any(axis=1)
        assert not beats.any()
    assert (np.diff(goals[found.front, 0]) >= 0.0).all()
    assert "on the front" in str(found)
    best = found.best
    np.testing.assert_array_equal(best["tension"], found.evaluated["tension"][found.front])
    head, *rows = best.to_csv().splitlines()
    assert len(rows) == len(found.front)
    assert head.startswith("design,hole_radius [m],end@cable2_1,wire,tension [N],")


def test_an_infeasible_problem_is_named() -> None:
    task = problem(constraints=(cdsm.Constraint("along", "z", at_least=1e7),))
    with pytest.raises(InfeasibleDesign, match=r"at least 1e\+04 N/mm is asked") as caught:
        cdsm.search_designs(task, generations=2, population=4)
    key = "along (0, 0, 1)"
    assert caught.value.constraints == (key,)
    values = cdsm.evaluate_designs(task, [caught.value.design])
    assert f"{100.0 * (1.0 - values[key][0] / 1e7):.3g} % off" in str(caught.value)
    with pytest.raises(InfeasibleDesign, match=r"not held: posture \d: no tension within"):
        cdsm.search_designs(problem(maximum=21.0), generations=1, population=4)


# --- bad problems ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: cdsm.Variable("hole_radius", 0.03, 0.02), "give low < high"),
        (lambda: cdsm.Variable("hole_radius", -0.03, 0.03), r"-0.03 m given; 0, or 1e-06 to"),
        (lambda: cdsm.Variable("minimum", -5.0, 5.0), "cables only pull"),
        (lambda: cdsm.Variable("end", 1, 3), "name of a cable"),
        (lambda: cdsm.Objective("along"), "direction: is needed"),
        (lambda: cdsm.Constraint("mass"), "at_least or at_most"),
        (lambda: cdsm.Objective("beauty"), "no quantity of a design is called .beauty"),
        (lambda: cdsm.Objective("motor_force"), "did you mean 'tension'"),
        (lambda: cdsm.Objective("stiffness", "z"), "did you mean .*'along'"),
        ({"variables": (cdsm.Variable("end@cable2_1", 1, 4),)}, "end@cable2_1.high: 4"),
        ({"variables": (cdsm.Variable("hole_radius@9", 0.01, 0.02),)}, "joints 1 to 3"),
        ({"variables": (cdsm.Variable("lead", 0.0, 0.1),) * 2}, "lead changes too"),
        (
            {
                "arm": cdsm.presets.nitinol_segment(),
                "variables": (cdsm.Variable("cables_per_joint", 3, 4),),
                "postures": np.zeros((1, 50)),
            },
            "vary hole_angle@cable10_1 or end@cable10_1",
        ),
        (
            {"variables": (cdsm.Variable("minimum", 10.0, 450.0),)},
            "minimum: is a variable of up to 450 N, but the maximum of cable1_1 is 400 N; end it",
        ),
        ({"variables": (cdsm.Variable("minimum", choices=(10, 401)),)}, "of up to 401 N"),
        ({"loads": np.zeros((1, 5))}, "loads: shape"),
        ({"objectives": (cdsm.Objective("force_radius"),), "maximum": np.inf}, "a finite one"),
        (
            {"objectives": (cdsm.Objective("deflection"),), "loads": np.zeros((1, 6))},
            "deflection needs a force",
        ),
    ],
)
def test_bad_problems_name_what_is_wrong(make: Any, said: str) -> None:
    with pytest.raises(cdsm.CdsmError, match=said):
        make() if callable(make) else problem(**make)


@pytest.mark.parametrize("key", ["tolerances = 'tolerances.toml'", "coverage = 2.0"])
def test_margins_of_an_older_problem_are_refused_with_what_to_do(key: str, tmp_path: Path) -> None:
    text = (EXAMPLES / "design.toml").read_text(encoding="utf-8")
    file = tmp_path / "design.toml"
    file.write_text(f"{key}\n{text}", encoding="utf-8")
    name = key.split(" ")[0]
    with pytest.raises(cdsm.FileError, match=f"{name}: is gone.*Tighten the limits"):
        cdsm.DesignProblem.read(file)


# --- files for the workshop ---------------------------------------------------------------


@pytest.mark.parametrize("loads", ["[{ link2 = [0, 0, -1] }]", "{ link2 = [0, 0, -1] }"])
def test_loads_on_links_in_a_file_are_refused_with_what_to_do(loads: str, tmp_path: Path) -> None:
    text = (EXAMPLES / "design.toml").read_text(encoding="utf-8")
    text = text.replace('arm = "arm.toml"', f"arm = '{EXAMPLES / 'arm.toml'}'")
    file = tmp_path / "design.toml"
    file.write_text(text.replace("loads = [[0.0, 0.0, -4.905]]", f"loads = {loads}"), "utf-8")
    said = r"loads: designs take wrenches .* the arm: with_loads, \[\[loads\]\] in its ARM.toml"
    with pytest.raises(cdsm.FileError, match=said):
        cdsm.DesignProblem.read(file)


def test_files_for_the_workshop(tmp_path: Path) -> None:
    found = cdsm.search_designs(problem(), generations=1, population=4)
    arm = found.arm()
    paths = found.write_arm(tmp_path / "best")
    assert [path.name for path in paths] == [
        "arm.toml", "arm.urdf", "arm.xml", "holes.csv", "cables.csv",
    ]  # fmt: skip
    assert cdsm.Manipulator.read(paths[0]) == arm
    assert arm.geometry.hole_radius == found.design()[0]
    # the pretension is that of the problem: every command that reads the arm keeps it
    assert {(cable.minimum, cable.maximum) for cable in arm.cables} == {(20.0, 400.0)}
    holes = [line.split(",") for line in paths[3].read_text().splitlines()]
    assert len(holes) == 1 + sum(2 * cable.joint for cable in arm.geometry.cables)
    radii = {float(row[4]) for row in holes[1:]}
    assert radii == {round(1e3 * arm.geometry.hole_radius, 4)}
    cables = [line.split(",") for line in paths[4].read_text().splitlines()]
    lengths: Array = 1e3 * arm.at(np.zeros(arm.nv)).cable_lengths
    assert [float(row[4]) for row in cables[1:]] == pytest.approx(lengths.tolist(), abs=1e-4)
    for row in cables[1:]:
        assert float(row[5]) <= float(row[4]) <= float(row[6])


def test_a_cable_is_cut_for_all_postures_within_the_joint_limits() -> None:
    arm = small_arm()
    straight = arm.at(np.zeros(arm.nv)).cable_lengths
    # a segment crosses one joint, so a grid over each joint gives all lengths
    low, high = straight.copy(), straight.copy()
    sides = [np.linspace(-end, end, 41) for end in 0.999 * arm.upper[:2]]
    for joint in range(3):
        q = np.zeros((41**2, arm.nv))
        q[:, 2 * joint : 2 * joint + 2] = [*itertools.product(*sides)]
        lengths = cdsm.evaluate(arm, q, minimum=10.0, outputs=["cable_lengths"])["cable_lengths"]
        low, high = low + (lengths - straight).min(axis=0), high + (lengths - straight).max(axis=0)
    rows = [line.split(",")[5:] for line in cable_table(arm).splitlines()[1:]]
    shortest, cut, stroke = np.array(rows, dtype=np.float64).T * 1e-3
    np.testing.assert_allclose(stroke, cut - shortest, atol=1e-7)
    assert (shortest <= low + 1e-7).all()
    assert (cut >= high - 1e-7).all()
    np.testing.assert_allclose(shortest, low, atol=2e-4)  # the grid ends before the limits
    np.testing.assert_allclose(cut, high, atol=2e-4)
