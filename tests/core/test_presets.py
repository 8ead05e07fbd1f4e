"""The arms of the paper: what it gives, and what is assumed by name."""

import numpy as np
import pytest

from cdsm import presets


def test_virtual_prototype_is_that_of_section_iv() -> None:
    arm = presets.virtual_prototype()
    assert (arm.nv, len(arm.cables)) == (10, 15)
    assert arm.geometry == presets.virtual_prototype_geometry()
    assert arm.length == pytest.approx(0.22)
    assert {cable.elasticity for cable in arm.cables} == {presets.STRAND_1X19}
    np.testing.assert_array_equal(arm.gravity, [0.0, -9.81, 0.0])


def test_experimental_prototype_controls_one_cable_of_each_pair_by_force() -> None:
    arm = presets.experimental_prototype(series_stiffness=1890.0, tool_length=0.15)
    assert [cable.control for cable in arm.cables] == ["position", "force"] * 3
    assert {cable.series_stiffness for cable in arm.cables} == {1890.0}
    assert [link.length for link in arm.geometry.links] == [0.1, 0.1, 0.15]
    np.testing.assert_allclose(np.rad2deg(arm.upper), 30.0)


def test_steel_wire_has_the_rigidity_of_its_section() -> None:
    area = np.pi * presets.STRAND_DIAMETER**2 / 4.0
    assert float(presets.STEEL_WIRE_200GPA.rigidity(1.0)) == pytest.approx(200e9 * area)
