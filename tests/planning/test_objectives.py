"""Arguments of the planners that make no sense are refused by name."""

import math
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm import presets
from tests.support.paths import DOWN

BAD: list[tuple[Any, Any, str]] = [
    (DOWN, 0.0, "target: 0 N/m given"),
    (DOWN, -1e4, "target: -10000 N/m given"),
    (DOWN, math.nan, "target"),
    (DOWN, math.inf, "target"),
    (DOWN, [1e4], "target: shape"),
    (DOWN, "stiff", "target"),
    (np.eye(3), 1e4, "target: shape"),
    (np.eye(3), [1e4, 1e4, 0.0], "target: 0 N/m"),
    (np.eye(3)[:, :2], [1e4] * 3, "direction: shape"),
    (np.zeros((0, 3)), [], "direction: shape"),
    ([[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]], [1e4, 1e4], "zero vector"),
    (None, 1e4, "direction"),
]


@pytest.mark.parametrize(("direction", "target", "message"), BAD)
def test_targets_that_make_no_sense_are_named(direction: Any, target: Any, message: str) -> None:
    arm = presets.virtual_prototype()
    pose = arm.at(np.full(arm.nv, 0.1))
    with pytest.raises(cdsm.InvalidInput, match=message):
        cdsm.plan_stiffness(pose, direction, target, 50.0)
