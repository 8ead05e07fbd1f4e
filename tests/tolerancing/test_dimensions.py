"""A link is one input, of however many bodies and joints it consists: beams, necks, coupled joints.

Uncertainties are compared with central differences of whole arms that are built anew.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import cdsm

LAW, U = cdsm.LinearElasticity(48e3), np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
BEAM = {"bending_stiffness": 2.0, "torsion_stiffness": 1.5}
SIZES = {"link_length": 0.06, "disk_offset": 0.01, "hole_radius": 0.03, "link_mass": 0.5}
SIZES |= {"lead": 0.1, "joint_stiffness": 5.0}
STEPS = {"lead": 1e-3, "hole_radius": 1e-4, "hole_angle": 1e-3, "disk_offset": 1e-4,
         "link_length": 1e-4, "link_mass": 0.01, "rigidity": 0.05, "spring": 0.1,
         "joint_stiffness": 0.05, "joint_angle": 0.01, "tension": 1.0}  # fmt: skip


def sizes(joints: int, errors: dict[str, float], **more: Any) -> dict[str, Any]:
    changed = {name: size + errors.get(name, 0.0) for name, size in SIZES.items()}
    changed["joint_stiffness"] = SIZES["joint_stiffness"]  # its errors are those of all springs
    return {"joints": joints, "base_length": 0.02, "cables_per_joint": 4, **changed, **more}


def bending(**errors: float) -> cdsm.Geometry:
    return cdsm.Geometry.universal(**sizes(2, errors, **BEAM))


def hinges(**errors: float) -> cdsm.Geometry:
    stiff = {"bending_stiffness": 2.0, "torsion_stiffness": np.inf, "pieces": 2}
    return cdsm.Geometry.hinged(**sizes(2, errors, twist=0.6, **stiff))


def coupled(**errors: float) -> cdsm.Geometry:
    section = cdsm.Geometry.universal(**sizes(3, errors, coupled=True))
    bent = cdsm.Geometry.universal(**sizes(2, errors, coupled=True, **BEAM))
    return cdsm.Geometry.sections([section, bent], spread=0.2)


def backbone(**errors: float) -> cdsm.Geometry:
    """A link is a disk of 0.1 kg and the gap before it, of 0.05 kg."""
    gap, m = 0.03 + errors.get("link_length", 0.0), 1.0 + errors.get("link_mass", 0.0) / 0.15
    section = {"length": 4 * gap, "disks": 4, "hole_angles": [1.5, -0.5, 3.6], "disk_mass": 0.1 * m}
    section |= {"hole_radius": 0.01 + errors.get("hole_radius", 0.0)}
    section |= {"lead": 0.1 + errors.get("lead", 0.0)}
    return cdsm.Geometry.backbone(
        sections=[section], bending_stiffness=0.02, pieces=2, mass_per_length=0.05 * m / gap
    )


Make = Callable[..., cdsm.Geometry]


def arm_of(geometry: cdsm.Geometry, **errors: float) -> cdsm.Manipulator:
    turn, law = errors.get("hole_angle", 0.0), LAW.scaled(1.0 + errors.get("rigidity", 0.0))
    routes = tuple(replace(each, angle=each.angle + turn) for each in geometry.cables)
    geometry = geometry.replace(cables=routes)
    series = 2e5 * (1.0 + errors.get("spring", 0.0))
    cables = cdsm.serpentine_cables(geometry, law, series_stiffness=series)
    arm = cdsm.Manipulator(geometry, cables=cables, gravity=(-7.8, 0.0, -5.9))
    if "joint_stiffness" in errors:
        factor = 1.0 + errors["joint_stiffness"]
        arm = arm.with_springs(
            {name: (factor * k, x) for name, (k, x) in arm.springs.given.items()}
        )
    return arm


def number(arm: cdsm.Manipulator, of: str, q: Any, F: Any) -> float:
    K = cdsm.stiffness(arm.at(q), F)
    tip = float(U @ K.posture.tip[:3, 3])
    return {"along": K.along(U), "margin": K.margin, "tip_along": tip}[of]


def asked(arm: cdsm.Manipulator, of: str) -> dict[str, Any]:
    q = np.random.default_rng(1).uniform(-0.03, 0.03, arm.nv)
    own = {"pose": arm.at(q), "tension": np.linspace(10.0, 20.0, len(arm.cables)), "of": of}
    return own if of == "margin" else own | {"direction": U}


@pytest.mark.parametrize("of", ["along", "margin", "tip_along"])
@pytest.mark.parametrize("make", [bending, hinges, coupled, backbone])
def test_common_errors_are_those_of_arms_built_anew(make: Make, of: str) -> None:
    arm = arm_of(make())
    question = asked(arm, of)
    for source, u in STEPS.items():
        if make is backbone and source == "disk_offset":
            continue  # a common one moves no disk along the gaps of a section, but the last
        tolerance = cdsm.Tolerances(**{source: cdsm.Tolerance(u, correlation=1.0)})
        found = cdsm.uncertainty(**question, tolerances=tolerance).standard_uncertainty
        ends = []
        for x in (u / 10.0, -u / 10.0):
            built = arm_of(make(**{source: x}), **{source: x})
            q = question["pose"].q + x * (source == "joint_angle")
            ends.append(number(built, of, q, question["tension"] + x * (source == "tension")))
        size = abs(number(arm, of, question["pose"].q, question["tension"]))
        expected = abs(ends[0] - ends[1]) * 5.0
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-12 * size), source


def sensitivity(arm: cdsm.Manipulator, of: str, source: str, name: str) -> float:
    budget = cdsm.uncertainty(**asked(arm, of), tolerances=cdsm.Tolerances(**{source: 1e-5}))
    labels = [*budget.measurand.inputs.labels[source]]
    return float(budget.sensitivities[source][labels.index(name)])


@pytest.mark.parametrize("of", ["along", "tip_along"])
def test_one_disk_of_a_backbone_lengthens_one_gap_and_shortens_the_next(of: str) -> None:
    def built(second: float, third: float) -> cdsm.Manipulator:
        gaps = [0.03, 0.03 + second, 0.03 + third, 0.03]
        sections = [
            {"length": gap, "disks": 1, "hole_angles": [0.0], "hole_radius": 0.01} for gap in gaps
        ]
        geometry = cdsm.Geometry.backbone(sections=sections, bending_stiffness=0.02)
        routes = tuple(cdsm.CableRoute(joint=4, angle=x) for x in (1.5, -0.5, 3.6))
        return arm_of(geometry.replace(cables=routes))

    arm, h = built(0.0, 0.0), 1e-6
    for source, name, ends in (
        ("disk_offset", "disk 1 of disk2", (built(h, -h), built(-h, h))),
        ("link_length", "disk2", (built(h, 0.0), built(-h, 0.0))),
    ):
        q, F = asked(arm, of)["pose"].q, asked(arm, of)["tension"]
        up, down = (number(each, of, q, F) for each in ends)
        found = sensitivity(arm, of, source, name)
        assert found == pytest.approx((up - down) / (2.0 * h), rel=1e-5), name


@pytest.mark.parametrize("source", ["link_length", "link_mass", "disk_offset"])
@pytest.mark.parametrize("correlation", [0.0, 1.0])
def test_links_that_hardly_bend_have_the_uncertainty_of_rigid_links(
    source: str, correlation: float
) -> None:
    """The difference falls with 1/EI."""
    tolerances = cdsm.Tolerances(**{source: cdsm.Tolerance(STEPS[source], correlation=correlation)})

    def found(**beam: Any) -> tuple[cdsm.Manipulator, float]:
        arm = cdsm.Manipulator(cdsm.Geometry.universal(**sizes(2, {}, **beam)), LAW, gravity="-x")
        pull = np.full(len(arm.cables), 50.0)
        budget = cdsm.uncertainty(arm.at(np.zeros(arm.nv)), pull, tolerances, direction="z")
        return arm, budget.standard_uncertainty

    rigid, exact = found()
    softer, stiff = (found(bending_stiffness=EI, torsion_stiffness=np.inf) for EI in (1e5, 1e6))
    assert stiff[1] == pytest.approx(exact, rel=1e-3)
    assert abs(stiff[1] - exact) < 0.11 * abs(softer[1] - exact)
    counts = [
        len(cdsm.uncertainty(arm.at(np.zeros(arm.nv)), np.full(8, 50.0), tolerances,
                             direction="z").sensitivities[source])
        for arm in (rigid, stiff[0])
    ]  # fmt: skip
    assert counts[0] == counts[1]


def test_springs_that_are_given_do_not_change_with_lengths() -> None:
    arm = arm_of(bending())
    given = arm.with_springs({name: (2.0 * k, x) for name, (k, x) in arm.springs.given.items()})
    q, F, h = asked(arm, "along")["pose"].q, asked(arm, "along")["tension"], 1e-5
    ends = [
        number(arm_of(bending(link_length=x)).with_springs(given.springs.given), "along", q, F)
        for x in (h, -h)
    ]
    u = cdsm.Tolerances(link_length=cdsm.Tolerance(10 * h, correlation=1.0))
    found = cdsm.uncertainty(**asked(given, "along"), tolerances=u).standard_uncertainty
    assert found == pytest.approx(5.0 * abs(ends[0] - ends[1]), rel=1e-6)


def test_random_backbones_are_those_of_the_budget() -> None:
    question = asked(arm_of(backbone()), "along")
    tolerances = cdsm.Tolerances(link_length=2e-4, disk_offset=2e-4, link_mass=5e-3, rigidity=0.02)
    run = cdsm.monte_carlo(**question, tolerances=tolerances, draws=4000, progress=False)
    assert run.standard_uncertainty == pytest.approx(run.budget.standard_uncertainty, rel=0.05)
