"""What would hold an arm that buckles: each remedy, applied, brings it to the edge of stability."""

import math
from typing import Any

import numpy as np
import pytest

import cdsm
from tests.support.arms import readme_geometry

Q = np.deg2rad([12.0, -8.0, 5.0, 15.0, -10.0, 6.0, 9.0, -3.0])
EA, SPRING, MINIMUM = 300.0, 16e3, 8.0


def stiffness(
    rigidity: float = EA, spring: float = SPRING, minimum: float = MINIMUM
) -> cdsm.Stiffness:
    """Build an arm of soft wires and springs from nothing, with what the remedies change."""
    geometry = readme_geometry(
        link_length=0.03, disk_offset=0.005, hole_radius=0.008, link_mass=0.02, lead=0.0
    )
    law = cdsm.LinearElasticity(rigidity)
    cables = cdsm.serpentine_cables(geometry, law, series_stiffness=spring)
    pose = cdsm.Manipulator(geometry, cables=cables).at(Q, check_limits=False)
    return cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum))


K = stiffness()
FOUND = {remedy.change: remedy for remedy in K.report().remedies}
CHANGED = {
    "wire": lambda s: stiffness(rigidity=s * EA),
    "spring": lambda s: stiffness(spring=s * SPRING),
    "tension": lambda s: stiffness(minimum=s * MINIMUM),
}


@pytest.mark.parametrize("change", CHANGED)
def test_a_remedy_ends_where_the_smallest_eigenvalue_is_zero(change: Any) -> None:
    assert not K.is_stable
    assert list(FOUND) == list(CHANGED)
    factor = FOUND[change].factor
    assert factor is not None
    edge = CHANGED[change](factor)
    # the root to 1e-12, of slopes of order of K_θ
    assert abs(edge.margin) <= 1e-9 * np.linalg.norm(edge.joint, 2)
    up = math.copysign(1e-3, factor - 1.0)
    assert CHANGED[change](factor * (1.0 + up)).is_stable
    assert not CHANGED[change](factor * (1.0 - up)).is_stable

    # the printed number is enough
    words = str(FOUND[change]).split()
    assert CHANGED[change](float(words[words.index("times") - 1])).is_stable
    assert (words[-1] == "more") == (factor > 1.0)


def test_a_stable_arm_needs_nothing() -> None:
    held = stiffness(rigidity=1e6, spring=math.inf)
    assert held.is_stable
    assert held.report().remedies == ()
    assert held.warnings == ()


def test_wires_cannot_help_where_the_motors_hold_forces() -> None:
    forces = tuple(
        cdsm.Cable(name=each.name, sites=each.sites, elasticity=each.elasticity, control="force")
        for each in K.posture.arm.cables
    )
    pose = K.posture.arm.with_cables(forces).at(Q)
    limp = cdsm.stiffness(pose, cdsm.distribute_tension(pose, MINIMUM))
    assert not limp.is_stable
    remedies = limp.report().remedies
    assert [(remedy.change, remedy.factor) for remedy in remedies] == [("tension", None)]
    assert str(remedies[0]) == "no other lower bounds alone would hold it"
    assert any(str(remedies[0]) in fault for fault in limp.report().faults)


def test_warnings_solve_for_no_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    """They and the errors of readings took 50 ms each: three root searches over new arms."""
    monkeypatch.setattr(cdsm.Manipulator, "with_cables", None)
    assert [text.split(":")[0] for text in K.warnings] == ["UNSTABLE"]
    assert str(K).startswith("UNSTABLE")
    with pytest.raises(cdsm.InvalidInput, match="has no isotropy: UNSTABLE"):
        cdsm.isotropy(K)
