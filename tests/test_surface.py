"""The public surface: results are frozen and safe to copy, errors keep their data, one version."""

import copy
import dataclasses
import inspect
import pickle
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import cdsm
from cdsm import errors
from tests.support.arms import mixed_arm, random_posture, random_tension, random_wrench
from tests.support.processes import uncompiled

ROOT = Path(__file__).parents[1]
POSE = random_posture(mixed_arm(), 2)
PULL = cdsm.distribute_tension(POSE, minimum=10.0, wrench=random_wrench(2))
K = cdsm.stiffness(POSE, PULL)

RESULTS = (
    POSE.arm,
    POSE,
    PULL,
    K,
    cdsm.modes(K),
    cdsm.equilibrium(POSE, PULL, random_wrench(3)),
    cdsm.stiffness_range(POSE, (0.0, 0.3, 1.0), 10.0, 200.0),
    cdsm.uncertainty(POSE, PULL, cdsm.Tolerances(rigidity=0.05), direction="z"),
    cdsm.distribute_tensions(POSE.arm, [POSE.q, POSE.q / 2.0], minimum=10.0),
)

WAYS: tuple[Callable[[Any], Any], ...] = (
    lambda x: pickle.loads(pickle.dumps(x)),
    copy.copy,
    copy.deepcopy,
)


@pytest.mark.parametrize("result", RESULTS, ids=lambda result: type(result).__name__)
def test_results_are_read_only_and_equal_after_a_copy(result: Any) -> None:
    names = [field.name for field in dataclasses.fields(result)]
    arrays = [name for name in names if isinstance(getattr(result, name), np.ndarray)]
    for again in (result, *(way(result) for way in WAYS)):
        for name in arrays:
            np.testing.assert_array_equal(getattr(again, name), getattr(result, name))
            assert not getattr(again, name).flags.writeable, name
        for name in (*names, "something_new"):
            with pytest.raises(dataclasses.FrozenInstanceError):
                setattr(again, name, None)


def test_public_callables_show_an_example_that_the_plain_run_tries() -> None:
    public = [
        (name, getattr(module, name))
        for module in (cdsm, cdsm.plots, cdsm.presets)
        for name in module.__all__
    ]
    silent = [
        name
        for name, value in public
        if callable(value) and not name.startswith("Cdsm") and not name.endswith("Error")
        if ">>> " not in (inspect.getdoc(value) or "")
    ]
    assert silent == ["InvalidInput", "Status"]  # made by no user
    assert len(public) - len(silent) > 90


ERRORS = (
    cdsm.InvalidInput("q", "is odd."),
    cdsm.FileError("/nowhere/arm.toml", "does not exist."),
    cdsm.GeometryError(["a: is missing", "b: is odd"], "arm.toml"),
    cdsm.InvalidInput("q", "joint1 is at 2 rad", cdsm.Status.BEYOND_LIMITS),
    cdsm.ElasticityRangeError("outside.", [900.0], [3], ["cable1_1"]),
    cdsm.InfeasibleTension(np.array([0.1, -0.2]), "joint2", 3.5, ["cable1_1"]),
    cdsm.SingularStiffness("K_θ is singular.", np.array([0.6, 0.8])),
    cdsm.UnreachableStiffness(np.array([0.0, 0.6, 0.8]), 9e4, 1e3, 8e4, [8e4]),
)


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_errors_survive_pickling_with_message_and_data(error: cdsm.CdsmError) -> None:
    for way in WAYS:
        again = way(error)
        assert (type(again), str(again)) == (type(error), str(error))
        for name, value in vars(error).items():
            np.testing.assert_array_equal(getattr(again, name), value)


def test_every_error_class_is_public_and_the_version_is_one_everywhere() -> None:
    kinds = [kind for kind in vars(errors).values() if inspect.isclass(kind)]
    for kind in (each for each in kinds if issubclass(each, Exception)):
        assert kind.__name__ in cdsm.__all__
        assert issubclass(kind, (cdsm.CdsmError, cdsm.CdsmWarning))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert cdsm.__version__ == project["version"] == cited["version"]


PLAIN_PYTHON = """
import json, sys
import cdsm
import numba
from tests.support.arms import mixed_arm, random_posture, random_tension, random_wrench
assert numba.config.DISABLE_JIT, "the kernels are compiled"
pose = random_posture(mixed_arm(), 3)
K = cdsm.stiffness(pose, random_tension(pose.arm, 3), random_wrench(3))
names = ("cable_lengths", "length_jacobian", "length_hessian")
answer = {name: getattr(pose, name).tolist() for name in names}
answer |= {name: getattr(K, name).tolist() for name in ("active", "load", "joint")}
json.dump(answer, sys.stdout)
"""


def test_numbers_are_the_same_without_compilation() -> None:
    pose = random_posture(mixed_arm(), 3)
    stiff = cdsm.stiffness(pose, random_tension(pose.arm, 3), random_wrench(3))
    for name, numbers in uncompiled(PLAIN_PYTHON).items():
        expected = getattr(pose if hasattr(pose, name) else stiff, name)
        np.testing.assert_allclose(
            numbers, expected, rtol=1e-12, atol=1e-13 * abs(expected).max(), err_msg=name
        )
