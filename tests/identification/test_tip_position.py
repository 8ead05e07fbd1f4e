"""Positions of the tip: what they identify, and which explanation they leave."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm import TipPosition
from cdsm.identification import Identification
from tests.support.arms import readme_geometry

SECTION = {"length": 0.1, "disks": 3, "hole_angles": [0.0, 2.0, 4.0], "hole_radius": 0.006}
ROD = cdsm.Manipulator(
    cdsm.Geometry.backbone(sections=[SECTION], bending_stiffness=0.01),
    cdsm.LinearElasticity(48e3),
)
SPRUNG = cdsm.Manipulator(
    readme_geometry(joints=2, hole_radius=0.02, link_mass=0.1, lead=0.0, joint_stiffness=[2, 1]),
    cdsm.LinearElasticity(48e3),
)

# D1: pull [m] of one tendon of the Nitinol segment and heights of its tip [mm], measured
HEIGHTS = {0.005: (233, 235, 233), 0.010: (171, 168, 169)}
D1 = [
    TipPosition(
        x=1e-3 * height,
        pull={"cable10_1": pull},
        std=1.354e-3,  # of readings at one pull
        label=f"{1e3 * pull:g} mm, reading {i}",
    )
    for pull, heights in HEIGHTS.items()
    for i, height in enumerate(heights, 1)
]


def test_slack_explains_the_nitinol_segment_and_nothing_else_does() -> None:
    free = {
        "slack": (0.0, 5e-3),
        "hole_radius": (4e-3, 9e-3),
        "gain": (0.5, 1.5),
        "rigidity": (1e-4, 10.0),
    }
    model_of = cdsm.ArmParameters(cdsm.presets.nitinol_segment(), tuple(free))
    found = cdsm.compare_explanations(model_of, D1, free)
    rmse = {
        name: 1e3 * math.sqrt(np.mean((fit.predicted - fit.measured) ** 2))
        for name, fit in zip(found.names, found.alone, strict=True)
    }
    # an independent program: 1.50 mm with a slack of 1.01 mm; 4.20 (6.74 mm), 4.23 (0.89)
    assert rmse == pytest.approx(
        {"slack": 1.50, "rigidity": 4.07, "hole_radius": 4.20, "gain": 4.23}, abs=0.01
    )
    values = dict(zip(found.names, found.values, strict=True))
    assert values["slack"] == pytest.approx(1.01e-3, abs=1e-5)
    assert values["hole_radius"] == pytest.approx(6.74e-3, abs=1e-5)
    assert values["gain"] == pytest.approx(0.89, abs=5e-3)
    assert found.best == "slack"
    assert found.explains == (True, False, False, False)
    assert found.exclusive == ("rigidity",)
    assert "slack explains these measurements." in str(found)
    assert found.to_pandas().shape[0] == 4


def readings(
    arm: cdsm.Manipulator, given: list[dict[str, Any]], axes: str = "xyz"
) -> list[TipPosition]:
    """Simulate readings with errors of 0.2 mm."""
    random, found = np.random.default_rng(0), []
    for each in given:
        tip = cdsm.forward_statics(arm, **each).pose.tip[:3, 3]
        read = dict(zip("xyz", (tip + random.normal(size=3) * 2e-4).tolist(), strict=True))
        found.append(TipPosition(**{axis: read[axis] for axis in axes}, std=2e-4, **each))
    return found


LOOSE = -0.05
PULLED: list[dict[str, Any]] = [
    *({"pull": [x, LOOSE, LOOSE]} for x in (0.002, 0.003, 0.004)),
    *({"tension": [x, 0.0, 0.0]} for x in (1.0, 2.0)),
]
HUNG: list[dict[str, Any]] = [
    {"tension": [x, 0.0, 0.0, 0.0, y, 0.0], "wrench": [0.0, 0.0, z, 0.0, 0.0, 0.0]}
    for x, y, z in ((8.0, 0.0, 0.0), (0.0, 6.0, 0.0), (5.0, 5.0, -1.0), (0.0, 0.0, 2.0))
]


@pytest.mark.parametrize(
    ("arm", "true", "tests"),
    [
        (ROD, {"slack": 7e-4, "bending_stiffness": 0.012}, PULLED),
        (SPRUNG, {"joint_stiffness@1": 2.3, "joint_stiffness@2": 0.8}, HUNG),
    ],
)
def test_slack_and_stiffnesses_are_recovered(
    arm: cdsm.Manipulator, true: dict[str, float], tests: list[dict[str, Any]]
) -> None:
    model_of = cdsm.ArmParameters(arm, tuple(true))
    free = {name: (0.0 if name == "slack" else 0.3 * x, 3.0 * x) for name, x in true.items()}
    found = cdsm.identify(model_of, readings(model_of(**true), tests), free)
    for (name, value), std in zip(found.parameters.items(), found.std, strict=True):
        assert abs(value - true[name]) < 2.58 * std, name  # 99 %
        assert std < 0.05 * true[name], name
    assert found.warnings == ()
    assert found.freedom == 3 * len(tests) - 2


def test_what_readings_cannot_tell_is_said() -> None:
    # one pull: slack and gain take in the same wire
    changed = cdsm.ArmParameters(ROD, ("slack",))(slack=1e-3)
    both = readings(changed, [{"pull": [0.004, LOOSE, LOOSE]}] * 3, "x")
    told = cdsm.compare_explanations(BOTH, both, TWO)
    assert told.explains == (True, True)
    (both_free,) = told.together.values()
    assert both_free.rank == 1
    assert told.exclusive == ()


GOOD = TipPosition(x=0.09, pull={"cable3_1": 0.003}, std=1e-3)


def fitted(bounds: tuple[float, float] = (0.0, 1e-3), **changes: Any) -> Identification:
    model_of = cdsm.ArmParameters(ROD, ("slack",))
    return cdsm.identify(model_of, [replace(GOOD, **changes)], {"slack": bounds})


BOTH, TWO = cdsm.ArmParameters(ROD, ("slack", "gain")), {"slack": (0.0, 2e-3), "gain": (0.5, 1.5)}


def compared(model_of: Any = BOTH, free: Any = TWO, count: int = 3) -> object:
    return cdsm.compare_explanations(model_of, [GOOD] * count, free)


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        (lambda: replace(GOOD, x=None), "x: none of x, y and z given"),
        (lambda: replace(GOOD, y=math.nan), "y: .*nan.* Leave out a coordinate"),
        (lambda: replace(GOOD, std=0.0), "std: 0 m given"),
        (lambda: replace(GOOD, pull=None), "none given"),
        (lambda: replace(GOOD, tension=(1.0,)), "pull and tension given"),
        (lambda: replace(GOOD, pull={"cable3_1": math.nan}), "cable3_1"),
        (lambda: replace(GOOD, pull=[[1.0]]), r"pull: shape \(1, 1\)"),  # type: ignore[arg-type]
        (lambda: fitted(x=90.0), r"\[0\] has the tip 90 m from the base.*mm\?"),
        (lambda: fitted(pull={"cable9_1": 0.0}), "cable9_1"),
        (lambda: fitted(pull=(0.003, 0.0)), r"pull: shape \(2,\)"),
        (lambda: fitted(pull=(3.0, 0.0, 0.0)), "leaves -2.* m of cable3_1"),
        (lambda: fitted((-2e-3, -1e-3)), r"low = -2 mm .*cable3_1.*slack: -0\.002 m given"),
        (lambda: compared(free={"slack": (0.0, 1e-3)}), "two or more parameters"),
        (lambda: compared(count=1), "at least three"),
        (lambda: compared(lambda slack, gain: ROD), "model_of"),
    ],
)
def test_bad_input_is_named(bad: Callable[[], object], said: str) -> None:
    with pytest.raises(cdsm.CdsmError, match=said):
        bad()
