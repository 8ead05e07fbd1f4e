"""Wires of the catalogue in examples/wires."""

import math
from pathlib import Path

import pytest

import cdsm

EXAMPLES = Path(__file__).parents[2] / "examples"

POUND_PER_SQUARE_INCH = 6894.757293168
"""[Pa]"""


def strand(diameter: float, stretch_factor: float) -> float:
    """EA [N] of the stretch in % that makers tabulate, G W/D² in pounds and inches."""
    modulus = 100.0 / stretch_factor * POUND_PER_SQUARE_INCH
    return modulus * diameter**2


@pytest.mark.parametrize(
    ("name", "rigidity"),
    [
        ("1x19-1.2mm-datasheet", strand(1.2e-3, 7.79e-6)),
        ("7x7-1mm", strand(1e-3, 1.2e-5)),
        ("7x19-1.5mm", strand(1.5e-3, 1.62e-5)),
        ("nitinol-0.5mm", 83e9 * math.pi / 4.0 * 0.5e-3**2),
        ("uhmwpe-sk75-1760dtex", 124.5 * 176.0),
    ],
)
def test_wires_are_as_rigid_as_their_source_says(name: str, rigidity: float) -> None:
    path = EXAMPLES / "wires" / f"{name}.toml"
    law = cdsm.Elasticity.read(path)
    # the files have five digits
    assert float(law.rigidity(10.0)) == pytest.approx(rigidity, rel=5e-5)
    text = path.read_text(encoding="utf-8")
    assert "Band: rigidity = 0." in text
    arm = cdsm.Manipulator.read(EXAMPLES / "arm.toml", wire=path)
    pose = arm.at([0.1] * arm.nv)
    assert cdsm.stiffness(pose, cdsm.distribute_tension(pose, 5.0)).cable_stiffness.min() > 0.0
