"""Paths of the virtual prototype, and what every plan of a path has to keep."""

import numpy as np
import pytest

import cdsm
from cdsm import presets
from cdsm.planning.path_plan import PathPlan
from cdsm.support.values import Array

DOWN = (0.0, 0.0, 1.0)

ARM = presets.virtual_prototype()


def waving(count: int) -> Array:
    """Joint angles (count, 10) around those of the paper, each at its own pace."""
    s = np.linspace(0.0, 1.0, count)[:, None]
    return np.asarray(presets.TEN_DEGREES * (1.0 + 0.3 * np.sin(0.5 * s * np.arange(1, 11))))


def assert_holds(plan: PathPlan, low: float, high: float) -> None:
    """Every planned sample does what was asked for, judged by the stiffness alone."""
    for k, i in enumerate(plan.planned):
        F, K = plan.tensions[k], plan.stiffness[k]
        again = cdsm.stiffness(plan.arm.at(plan.angles[k]), F, wrench=K.wrench)
        assert again.along(DOWN) == pytest.approx(plan.target[i], rel=1e-9)
        assert plan.achieved[k] == again.along(DOWN)
        assert abs(again.residual).max() < 1e-12 * F.max()
        assert (low <= F).all()
        assert (high >= F).all()
        assert again.is_stable
    changes = abs(np.diff(plan.tensions, axis=0)) / np.diff(plan.planned)[:, None]
    assert (changes <= plan.max_change_per_sample * (1.0 + 1e-12)).all()
    np.testing.assert_array_equal(plan.steps, [0.0, *changes.max(axis=1)])
    named = [*plan.planned, *(each.index for each in plan.infeasible)]
    assert sorted(named) == list(range(len(plan.target)))
