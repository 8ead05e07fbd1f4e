"""Radii of pulleys as a parameter: set, identified, designed, and with a tolerance."""

from pathlib import Path

import numpy as np
import pytest

import cdsm
from tests.support.pulleys import finger

SPRINGS = {f"to_l{k}": 0.5 for k in range(4)}
ARM = finger().with_springs(SPRINGS)
POSE = ARM.at([0.05, 0.3, 0.25, 0.2])
PULL = cdsm.distribute_tension(POSE, 5.0)


def along(arm: cdsm.Manipulator) -> float:
    return cdsm.stiffness(arm.at(POSE.q), PULL.values).along("z")


def test_all_pulleys_of_a_cable_become_larger_and_rims_with_them(tmp_path: Path) -> None:
    parameters = cdsm.ArmParameters(ARM, ("pulley_radius",))
    assert parameters.present == {"pulley_radius": 0.0}
    assert parameters(**parameters.present) == ARM
    wider = parameters(pulley_radius=5e-4)
    for cable, other in zip(ARM.cables, wider.cables, strict=True):
        radii = [pulley.radius for pulley in cable.pulleys]
        assert [pulley.radius for pulley in other.pulleys] == pytest.approx(np.add(radii, 5e-4))
    assert wider.cables["cable7"].sites[-1].position == pytest.approx((0.0075, 0.0, 0.0))
    assert wider.cables["cable1"].sites[2] == ARM.cables["cable1"].sites[2]
    # a pulley on the axis of a joint has its radius as moment arm
    flat = [0.0, 0.3, 0.25, 0.2]
    arms = [abs(arm.at(flat).length_jacobian[0, 1]) for arm in (ARM, wider)]
    assert arms[1] - arms[0] == pytest.approx(5e-4, rel=1e-9)
    one = cdsm.ArmParameters(ARM, ("pulley_radius@cable2",))(**{"pulley_radius@cable2": 1e-3})
    assert one.cables["cable1"] == ARM.cables["cable1"]
    assert one.cables["cable2"].pulleys[0].radius == pytest.approx(0.009)
    assert cdsm.Manipulator.read(one.write(tmp_path / "ARM.toml")) == one
    with pytest.raises(cdsm.InvalidInput, match="has no pulleys there"):
        cdsm.ArmParameters(cdsm.presets.virtual_prototype(), ("pulley_radius",))


def test_radii_and_rigidities_have_tolerances() -> None:
    step = 1e-6
    cases: dict[str, float] = {}
    for name, change in (("pulley_radius", step), ("rigidity", 1e-4)):
        base = 1.0 if name == "rigidity" else 0.0
        ends = [
            along(cdsm.ArmParameters(ARM, (name,))(**{name: base + sign * change}))
            for sign in (1.0, -1.0)
        ]
        cases[name] = abs(ends[0] - ends[1]) / (2.0 * change)
    wide = cdsm.Tolerances(
        pulley_radius=cdsm.Tolerance(1e-4, correlation=1.0), rigidity=0.05, tension=0.5
    )
    budget = cdsm.uncertainty(POSE, PULL, wide, direction="z")
    assert budget.contributions["pulley_radius"] == pytest.approx(
        1e-4 * cases["pulley_radius"], rel=1e-3
    )
    assert budget.contributions["rigidity"] == pytest.approx(0.05 * cases["rigidity"], rel=1e-3)
    drawn = cdsm.monte_carlo(POSE, PULL, wide, direction="z", draws=400, progress=False)
    assert drawn.standard_uncertainty == pytest.approx(budget.standard_uncertainty, rel=0.15)


@pytest.mark.parametrize("source", ["site", "joint_stiffness", "hole_radius", "lead"])
def test_other_dimensions_are_refused_by_name(source: str) -> None:
    tolerances = cdsm.Tolerances(**{source: 1e-4})
    with pytest.raises(cdsm.InvalidInput, match=f"{source}: .*over the pulley.*pulley_radius"):
        cdsm.uncertainty(POSE, PULL, tolerances, direction="z")


def test_a_radius_is_found_from_measured_stiffness() -> None:
    truth = cdsm.ArmParameters(ARM, ("pulley_radius",))(pulley_radius=3e-4)
    tests = []
    for q in ([0.05, 0.3, 0.25, 0.2], [0.0, 0.5, 0.3, 0.1], [0.1, 0.2, 0.6, 0.3]):
        k = cdsm.stiffness(truth.at(q), PULL.values).along("z")
        tests.append(cdsm.Measurement(k, "z", tuple(q), tuple(PULL.values), std=1e-3 * k))
    model = cdsm.ArmParameters(ARM, ("pulley_radius",))
    free = {"pulley_radius": (-1e-3, 1e-3)}
    found = cdsm.identify(model, tests, free, progress=False)
    assert found.values[0] == pytest.approx(3e-4, rel=1e-4)
