"""What would hold an arm that buckles: each remedy, applied, brings it to the edge of stability."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array

SIZES: dict[str, Any] = {
    "joints": 4,
    "cables_per_joint": 3,
    "link_length": 0.03,
    "base_length": 0.03,
    "disk_offset": 0.005,
    "hole_radius": 0.008,
    "link_mass": 0.02,
}
Q = np.deg2rad([12.0, -8.0, 5.0, 15.0, -10.0, 6.0, 9.0, -3.0])
EA, SPRING, MINIMUM = 300.0, 16e3, 8.0


def stiffness(
    rigidity: float = EA,
    spring: float = SPRING,
    minimum: float = MINIMUM,
    offset: float = SIZES["disk_offset"],
) -> cdsm.Stiffness:
    """Build an arm of soft wires and springs from nothing, with what the remedies change."""
    geometry = cdsm.Geometry.universal(**{**SIZES, "disk_offset": offset})
    law = cdsm.LinearElasticity(rigidity)
    cables = cdsm.serpentine_cables(geometry, law, series_stiffness=spring)
    pose = cdsm.Manipulator(geometry, cables=cables).at(Q, check_limits=False)
    return cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum))


K = stiffness()
FOUND: dict[str, cdsm.Remedy] = {each.change: each for each in K.remedies}
CHANGED = {
    "wire": lambda s: stiffness(rigidity=s * EA),
    "spring": lambda s: stiffness(spring=s * SPRING),
    "tension": lambda s: stiffness(minimum=s * MINIMUM),
    "disk offset": lambda s: stiffness(offset=s * SIZES["disk_offset"]),
}


def size(each: cdsm.Stiffness) -> float:
    return float(np.linalg.norm(each.joint, 2))


def test_the_arm_buckles_and_everything_would_hold_it() -> None:
    assert not K.is_stable
    assert list(FOUND) == list(CHANGED)


@pytest.mark.parametrize("change", CHANGED)
def test_a_remedy_ends_where_the_smallest_eigenvalue_is_zero(change: str) -> None:
    factor = FOUND[change].factor
    assert factor is not None
    edge = CHANGED[change](factor)
    assert abs(edge.margin) <= 1e-9 * size(edge)  # the root to 1e-12, of slopes of order size
    up = math.copysign(1e-3, factor - 1.0)
    assert CHANGED[change](factor * (1.0 + up)).is_stable
    assert not CHANGED[change](factor * (1.0 - up)).is_stable


@pytest.mark.parametrize("change", CHANGED)
def test_slope_is_the_change_of_the_eigenvalue(change: str) -> None:
    """The difference quotient converges to it with the square of the step."""
    slope = FOUND[change].slope
    assert slope is not None
    errors = [
        (CHANGED[change](math.exp(h)).margin - CHANGED[change](math.exp(-h)).margin) / (2.0 * h)
        - slope
        for h in (4e-2, 1e-2)
    ]
    assert abs(errors[1]) <= 0.07 * abs(errors[0])  # 1/16 and what the fourth order adds


def test_slope_of_wires_is_the_formula() -> None:
    """dλ/d ln EA = Σ k² l_0/EA (J_L v)² for an eigenvector v; EA + F is EA (1 + ε)."""
    v: Array = K.critical_direction
    motion = K.posture.length_jacobian @ v
    # k = 1/(ℓ/(EA + F) + 1/k_s), so dk/d ln EA = k² ℓ EA/(EA + F)²
    wire = K.posture.cable_lengths - K.tension / SPRING
    change = K.cable_stiffness**2 * wire * EA / (EA + K.tension) ** 2
    assert FOUND["wire"].slope == pytest.approx(float(change @ motion**2), rel=1e-8)


@pytest.mark.parametrize("change", CHANGED)
def test_the_printed_number_is_enough(change: str) -> None:
    text = str(FOUND[change])
    number, unit = {
        "wire": (text.split()[1], 1.0),
        "spring": (text.split()[3], 1e3 / SPRING),
        "tension": (text.split()[4], 1.0 / MINIMUM),
        "disk offset": (text.split()[3], 1e-3 / SIZES["disk_offset"]),
    }[change]
    assert CHANGED[change](float(number) * unit).is_stable
    assert ("or more" in text) == ((FOUND[change].factor or 0.0) > 1.0)


def test_unstable_is_the_first_line_with_what_would_hold_it() -> None:
    first, second, *rest = str(K).splitlines()
    assert first.startswith("UNSTABLE: the arm buckles")
    assert f"{K.margin:.4g} N m/rad" in first
    assert second == "it would hold, by each of these alone, with"
    assert [f"  {each}" for each in K.remedies] == rest[:4]
    assert K._repr_html_().index("UNSTABLE") < K._repr_html_().index("<table>")


def test_a_stable_arm_needs_nothing() -> None:
    held = stiffness(rigidity=1e6, spring=math.inf)
    assert held.is_stable
    assert held.remedies == ()
    assert held.warnings == ()
    assert "UNSTABLE" not in str(held)


def test_tensions_of_your_own_are_not_distributed_again() -> None:
    own = cdsm.stiffness(K.posture, K.tension)
    assert [each.change for each in own.remedies] == ["wire", "spring"]
    assert own.remedies[0].factor == FOUND["wire"].factor


def test_what_does_not_help_is_told() -> None:
    stuck = stiffness(rigidity=1e9, spring=1.0, minimum=200.0, offset=0.0149)
    assert stuck.remedies[0].factor is None
    assert str(stuck.remedies[0]) == "no other wire holds the arm"


def test_wires_cannot_help_where_the_motors_hold_forces() -> None:
    forces = tuple(
        cdsm.Cable(name=each.name, sites=each.sites, elasticity=each.elasticity, control="force")
        for each in K.posture.arm.cables
    )
    pose = K.posture.arm.with_cables(forces).at(Q)
    limp = cdsm.stiffness(pose, cdsm.distribute_tension(pose, MINIMUM))
    assert not limp.is_stable
    assert [(each.change, each.factor) for each in limp.remedies] == [
        ("tension", None),
        ("disk offset", None),
    ]
    assert "change the posture, the load or the arm" in limp.warnings[1]


def test_disks_do_not_touch_where_their_offset_is_less() -> None:
    bent = 2.2 * math.atan(0.4 * SIZES["disk_offset"] / SIZES["hole_radius"])
    arm = K.posture.arm
    pose = arm.at(np.full(arm.nv, bent))
    for each in cdsm.stiffness(pose, cdsm.distribute_tension(pose, 60.0)).remedies:
        if each.change == "disk offset" and each.factor is not None:
            least = SIZES["hole_radius"] * math.tan(bent / 2.0) / SIZES["disk_offset"]
            assert each.factor >= least


def test_a_cable_beside_those_of_the_disks_leaves_out_the_disk_offsets() -> None:
    """The geometry then does not say how the cables run; the other remedies are there."""
    arm = K.posture.arm
    more = arm.with_cables([*arm.cables, replace(arm.cables[0], name="other")])
    pose = more.at(Q, check_limits=False)
    unstable = cdsm.stiffness(pose, cdsm.distribute_tension(pose, MINIMUM))
    assert not unstable.is_stable
    assert [each.change for each in unstable.remedies] == ["wire", "spring", "tension"]
