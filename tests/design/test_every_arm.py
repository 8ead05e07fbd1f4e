"""Every kind of arm can be designed: links that bend, backbones, coupled joints, sections."""

import itertools
from pathlib import Path

import numpy as np
import pytest

import cdsm
from cdsm.design.lengths import length_bounds
from tests.support.arms import readme_geometry

pytest.importorskip("pymoo")

LAW = cdsm.LinearElasticity(48e3)
TUBE = {"bending_stiffness": 2.0, "torsion_stiffness": 1.5}
SECTION = {"length": 0.1, "disks": 4, "hole_radius": 6e-3}
HOLES = [np.deg2rad([90.0, 210.0, 330.0]) + turn for turn in (0.0, np.pi / 3.0)]
TWO = {"joints": 2, "disk_offset": 0.01, "hole_radius": 0.02}
ARMS = {
    "universal": readme_geometry(**TWO),
    "hinged": cdsm.Geometry.hinged(
        joints=4, twist=0.6, link_length=0.06, base_length=0.02, disk_offset=0.01,
        hole_radius=0.02, link_mass=0.1,
    ),
    "bending": readme_geometry(**TWO, **TUBE),
    "coupled": cdsm.Geometry.sections([readme_geometry(**TWO, coupled=True)] * 2, spread=0.2),
    "coupled and bending": readme_geometry(**TWO, **TUBE, coupled=True),
    "sections": cdsm.Geometry.sections(
        [readme_geometry(**TWO), readme_geometry(**TWO | {"hole_radius": 0.015})], spread=0.2
    ),
    "backbone": cdsm.Geometry.backbone(
        sections=[SECTION | {"hole_angles": each.tolist()} for each in HOLES],
        bending_stiffness=0.02, mass_per_length=0.5, pieces=2,
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", ARMS)
def test_no_posture_needs_more_wire_than_is_cut(kind: str) -> None:
    """In random postures, at corners of the joint limits, and with the cables pulled one by one."""
    arm, rng = cdsm.Manipulator(ARMS[kind], LAW), np.random.default_rng(0)
    inside = arm.upper * (1.0 - 1e-9)
    q = rng.uniform(-1.0, 1.0, (4000, arm.nv))
    corners = rng.choice([-1.0, 1.0], q.shape)
    mixed = np.where(rng.random(q.shape) < 0.5, q, corners)
    J = arm.at(np.zeros(arm.nv)).length_jacobian
    wound = np.concatenate([np.sign(J), -np.sign(J)])
    q = inside * np.concatenate([q, corners, mixed, wound])
    lengths = cdsm.evaluate(arm, q, outputs=["cable_lengths"])["cable_lengths"]
    low, high = length_bounds(arm)
    assert (low <= np.nanmin(lengths, axis=0) + 1e-8).all()
    assert (high >= np.nanmax(lengths, axis=0) - 1e-8).all()
    assert (low >= 0.0).all()


@pytest.mark.parametrize("beam", [{}, TUBE | {"torsion_stiffness": np.inf}])
def test_lengths_of_one_gap_are_those_of_a_fine_grid(beam: dict[str, float]) -> None:
    """A neck has four angles, a universal joint between rigid links two."""
    one = SECTION | {"disks": 1, "length": 0.025, "hole_angles": [0.0, 1.0, 4.0]}
    neck = cdsm.Geometry.backbone(sections=[one], **beam) if beam else None
    arm = cdsm.Manipulator(neck or readme_geometry(**TWO | {"joints": 1}), LAW)
    axes = np.linspace(arm.lower, arm.upper, 15 if beam else 201).T * (1.0 - 1e-9)
    grid = np.array([*itertools.product(*axes)])
    found = cdsm.evaluate(arm, grid, outputs=["cable_lengths"])["cable_lengths"]
    low, high = length_bounds(arm)
    np.testing.assert_allclose(low, np.nanmin(found, axis=0), rtol=3e-3, atol=1e-5)
    np.testing.assert_allclose(high, np.nanmax(found, axis=0), rtol=3e-3)


@pytest.mark.parametrize("kind", ARMS)
def test_every_kind_of_arm_is_searched_and_written(kind: str, tmp_path: Path) -> None:
    arm = cdsm.Manipulator(ARMS[kind], LAW, gravity=(0.0, 0.0, 0.0))
    rest, R = np.zeros((1, arm.nv)), arm.geometry.hole_radius
    spring = "bending_stiffness" if kind == "backbone" else "joint_stiffness"
    task = cdsm.DesignProblem(
        arm=arm,
        variables=[
            cdsm.Variable("hole_radius", 0.95 * R, 1.05 * R),
            cdsm.Variable(f"end@{arm.cables.names[-1]}", 1, len(arm.geometry.joints)),
            cdsm.Variable(spring, 0.5, 1.0),
        ],
        objectives=[cdsm.Objective("held"), cdsm.Objective("mass")],
        constraints=[cdsm.Constraint("margin", at_least=-1e3)],
        postures=rest,
        minimum=1.0,
    )
    found = cdsm.search_designs(task, generations=1, population=4)
    best = found.arm()
    assert cdsm.Manipulator.read(found.write_arm(tmp_path)[0]) == best
    # of what the joints carry; crosses of universal joints are there for simulators only
    carried = best.body.arrays().mass
    assert found.values()["mass"] == pytest.approx(carried.sum(), abs=2e-5)
    assert found.values()["mass"] > 0.09
    for row, value in zip(found.evaluated.designs, found.evaluated["margin"], strict=True):
        try:
            pull = cdsm.distribute_tension(task.arm_of(row).at(rest[0]), 1.0)
        except cdsm.InfeasibleTension:
            assert np.isnan(value)
            continue
        margin = cdsm.stiffness(pull.posture, pull).margin
        if margin > 0.0:
            assert value == pytest.approx(margin, rel=1e-6)


def test_mass_of_a_backbone_is_that_of_its_rigid_body() -> None:
    arm = cdsm.presets.nitinol_segment()
    found = cdsm.evaluate_designs(
        cdsm.DesignProblem(
            arm=arm,
            variables=[cdsm.Variable("lead", 0.1, 0.2)],
            objectives=[cdsm.Objective("mass")],
            postures=np.zeros((1, arm.nv)),
        ),
        [[0.15]],
    )
    tube = 6450.0 * np.pi / 4.0 * (1.22e-3**2 - 0.954e-3**2)
    # the first sixth of the first of 10 gaps is clamped in the base, but for a hundredth
    clamped = 0.025 * tube * 0.98 / 6.0
    assert found["mass"][0] == pytest.approx(0.25 * tube - clamped, rel=1e-9)
