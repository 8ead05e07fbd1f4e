"""The public surface: documented, frozen, picklable, and safe from many threads."""

import ast
import copy
import dataclasses
import html
import inspect
import pickle
import re
import subprocess
import sys
import textwrap
import types
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm import errors
from cdsm.kernels import posture
from cdsm.kernels import stiffness as stiffness_kernels
from cdsm.support.values import Array
from tests.support.arms import (
    STEEL,
    mixed_arm,
    random_arm,
    random_posture,
    random_tension,
    random_wrench,
)
from tests.support.patience import HANGS
from tests.support.processes import uncompiled
from tests.support.tracking import small_path

ROOT = Path(__file__).parents[1]

# --- names and docstrings -------------------------------------------------------------------


def public() -> Iterator[tuple[str, Any]]:
    """Every public class, function, method and property, by its dotted name."""
    for name in cdsm.__all__:
        thing = getattr(cdsm, name)
        if isinstance(thing, types.ModuleType):
            for inner, part in vars(thing).items():
                if inspect.isfunction(part) and part.__module__ == thing.__name__:
                    yield f"{name}.{inner}", part
            continue
        yield name, thing
        if not inspect.isclass(thing):
            continue
        for inner, part in own(thing).items():
            if inner.startswith("_"):
                continue
            if isinstance(part, (staticmethod, classmethod)):
                yield f"{name}.{inner}", part.__func__
            elif inspect.isfunction(part):
                yield f"{name}.{inner}", part
            elif isinstance(part, property):
                yield f"{name}.{inner}", part.fget
            elif isinstance(part, cached_property):
                yield f"{name}.{inner}", part.func


def own(kind: type) -> dict[str, Any]:
    """What a class defines, or takes from a base that is not public."""
    bases = [base for base in reversed(kind.__mro__) if base.__module__.startswith("cdsm.")]
    hidden = [base for base in bases if base is kind or base.__name__ not in cdsm.__all__]
    return {name: part for base in hidden for name, part in vars(base).items()}


PUBLIC = dict(public())
FUNCTIONS = {name: thing for name, thing in PUBLIC.items() if inspect.isfunction(thing)}
CLASSES = {name: thing for name, thing in PUBLIC.items() if inspect.isclass(thing)}

UNIT = re.compile(
    r"\[(?:N|m|J|rad|kg|Pa|s|Hz|-|1)\b[^\]]*\]|\[-\]|\b(?:N|m|rad|kg)\b"
    r"|[Uu]nit (?:vector|joint motion)"
)
SHAPE = re.compile(r"\((?:nv|B|C|D|S|P|n|\d|sites)(?:\s*[,+]\s*[\w…]*)*\)|any shape|same shape")
ARRAY = re.compile(r"\bArray\b|NDArray|ndarray")
CHECKERS = {
    "bound",
    "checked_bounds",
    "number_array",
    "one_of",
    "quantity",
    "scalar",
    "unit_direction",
    "unit_directions",
    "vector",
    "wrench_vector",
    "read_text",
    "write_file",
    "write_text",
}


RAISED = re.compile("|".join(["Raises:", *(rf"\b{n}\b" for n in dir(errors) if n[0].isupper())]))
"""A section of errors, or in a docstring of one line the name of the error."""


def documentation(name: str) -> str:
    """The docstring of a thing, with those of the methods and classes it refers to."""
    text = inspect.getdoc(PUBLIC[name]) or ""
    for referred in re.findall(r":(?:meth|attr|class|func):`~?([\w.]+)`", text):
        last = referred.rsplit(".", 1)[-1]
        own = f"{name.rsplit('.', 1)[0]}.{last}"
        for candidate in (referred, referred.removeprefix("cdsm."), own):
            if candidate in PUBLIC and candidate != name:
                text += "\n" + (inspect.getdoc(PUBLIC[candidate]) or "")
                break
    return text


def raises(function: Any) -> bool:
    """Whether the body raises an error or hands an argument to one of the checks."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    return any(
        isinstance(node, ast.Raise)
        or (
            isinstance(node, ast.Call)
            and (
                (isinstance(node.func, ast.Name) and node.func.id in CHECKERS)
                or (isinstance(node.func, ast.Attribute) and node.func.attr == "check")
            )
        )
        for node in ast.walk(tree)
    )


def returns(function: Any) -> str:
    return str(function.__annotations__.get("return", ""))


def test_all_names_exist_are_sorted_and_are_listed_once() -> None:
    assert cdsm.__all__ == sorted(set(cdsm.__all__))
    for name in cdsm.__all__:
        assert hasattr(cdsm, name)


def test_everything_public_that_is_imported_is_listed() -> None:
    visible = {
        name
        for name, thing in vars(cdsm).items()
        if not name.startswith("_")
        and (inspect.isclass(thing) or inspect.isfunction(thing))
        and thing.__module__.startswith("cdsm")
    }
    assert visible <= set(cdsm.__all__)


def test_every_error_class_is_public_and_a_cdsm_error() -> None:
    found = {name for name, thing in vars(errors).items() if inspect.isclass(thing)}
    found -= {"Iterable", "Sequence"}
    assert found <= set(cdsm.__all__)
    for name in found:
        assert issubclass(getattr(cdsm, name), (cdsm.CdsmError, cdsm.CdsmWarning))


@pytest.mark.parametrize("name", PUBLIC)
def test_everything_public_has_a_docstring_of_its_own(name: str) -> None:
    text = PUBLIC[name].__doc__
    assert text
    assert text.strip()
    assert not text.startswith(f"{name.rsplit('.', 1)[-1]}(")  # what dataclass makes up


@pytest.mark.parametrize("name", [n for n, f in FUNCTIONS.items() if ARRAY.search(returns(f))])
def test_arrays_that_are_returned_have_a_shape(name: str) -> None:
    assert SHAPE.search(documentation(name))


@pytest.mark.parametrize("name", [n for n, f in FUNCTIONS.items() if raises(f)])
def test_functions_that_raise_list_what_they_raise(name: str) -> None:
    assert RAISED.search(documentation(name))


def constructor_raises(kind: Any) -> bool:
    if hasattr(kind, "__pydantic_validator__"):  # a record: every field is checked
        return True
    if dataclasses.is_dataclass(kind):
        own = vars(kind).get("__post_init__")
        # an __init__ that dataclass has made has no source
        if own is None and vars(kind)["__init__"].__module__ == kind.__module__:
            own = vars(kind)["__init__"]
    else:
        own = vars(kind).get("__init__")
    try:
        return own is not None and raises(own)
    except OSError:
        return False


@pytest.mark.parametrize(
    "name",
    [n for n, k in CLASSES.items() if not issubclass(k, Exception) and constructor_raises(k)],
)
def test_constructors_that_raise_list_what_they_raise(name: str) -> None:
    assert "Raises:" in documentation(name)


@pytest.mark.parametrize(
    ("kind", "field"),
    [
        pytest.param(kind, field.name, id=f"{name}.{field.name}")
        for name, kind in CLASSES.items()
        if dataclasses.is_dataclass(kind)
        for field in dataclasses.fields(kind)
        if not field.name.startswith("_")
    ],
)
def test_every_field_is_documented_and_numbers_have_a_unit_and_arrays_a_shape(
    kind: Any, field: str
) -> None:
    text = inspect.getdoc(kind) or ""
    entry = re.search(rf"^    {field}: (.*(?:\n      +.*)*)", text, re.MULTILINE)
    assert entry is not None
    annotation = next(str(each.type) for each in dataclasses.fields(kind) if each.name == field)
    if ARRAY.search(annotation):
        assert SHAPE.search(entry[1])
    if re.search(r"\bArray\b|float|Number|Length|Mass|JointLimit", annotation):
        assert UNIT.search(entry[1]) or re.search("direction|axis", entry[1])


# --- frozen ---------------------------------------------------------------------------------

POSE = random_posture(mixed_arm(), 2)
PULL = cdsm.distribute_tension(POSE, minimum=10.0, wrench=random_wrench(2))
K = cdsm.stiffness(POSE, PULL)
SHARES = K.shares((0.0, 0.3, 1.0))
WEIGHT = cdsm.weight_test(POSE, PULL, (0.0, 0.0, -1.0), steps=2)
PULLS = cdsm.distribute_tensions(POSE.arm, [POSE.q, POSE.q / 2.0], minimum=10.0)
TOLERANCES = cdsm.Tolerances(rigidity=0.05, hole_radius=1e-4)
RESULTS: dict[str, Any] = {
    "Posture": POSE,
    "MomentArms": POSE.moment_arms,
    "Tension": PULL,
    "Stiffness": K,
    "Shares": SHARES,
    "RestBand": cdsm.rest_band(POSE, PULL, "z"),
    "Breakaway": cdsm.breakaway(POSE, PULL, "z"),
    "JointSolution": cdsm.solve_joint_angles(POSE.arm, POSE.cable_lengths),
    "KinematicSolution": cdsm.inverse_kinematics(POSE.arm, POSE.tip),
    "Modes": cdsm.modes(POSE, K),
    "Equilibrium": cdsm.equilibrium(POSE, PULL, random_wrench(3)),
    "LoadHistory": cdsm.load_cycle(POSE, PULL, [random_wrench(3)]),
    "WeightTest": WEIGHT,
    "LinearPrediction": WEIGHT.linear,
    "StiffnessGradient": cdsm.stiffness_gradient(K),
    "StiffnessRange": cdsm.stiffness_range(POSE, (0.0, 0.3, 1.0), 10.0, 200.0),
    "StiffnessPlan": cdsm.plan_stiffness(
        POSE, np.eye(3)[1:], [K.along(u) for u in np.eye(3)[1:]], 10.0, 200.0
    ),
    "PathPlan": cdsm.plan_path(
        POSE.arm,
        (0.0, 0.3, 1.0),
        K.along((0.0, 0.3, 1.0)),
        10.0,
        200.0,
        angles=[POSE.q, 9.0 * POSE.q],
    ),
    "HalfWay": cdsm.plan_path(
        POSE.arm, (0.0, 0.3, 1.0), K.along((0.0, 0.3, 1.0)), 10.0, 200.0, angles=[POSE.q] * 2
    ).between[0],
    "Saturation": cdsm.saturation(POSE, (0.0, 0.3, 1.0), 10.0, 200.0),
    "Uncertainty": cdsm.uncertainty(POSE, PULL, TOLERANCES, direction=(0.0, 0.3, 1.0)),
    "MonteCarlo": cdsm.monte_carlo(
        POSE, PULL, TOLERANCES, direction=(0.0, 0.3, 1.0), draws=100, progress=False
    ),
    "CriticalTension": cdsm.critical_tension(POSE),
    "Tensions": PULLS,
    "Batch": cdsm.evaluate(
        POSE.arm, [POSE.q, POSE.q / 2.0], PULLS, outputs=("tip", "along"), direction=(0, 0, 1)
    ),
    "CriticalLoad": cdsm.critical_load(POSE, random_wrench(4), 10.0),
    "Report": K.report(),
    "ForcePolytope": cdsm.force_polytope(POSE, 1.0, 200.0),
    "Payload": cdsm.payload(POSE, "z", 1.0, 200.0, deflection=1e-3),
    "WireUse": cdsm.wire_use(PULL, diameter=1e-3, breaking_load=1e3, bend_diameter=5e-3),
    "TipForce": cdsm.tip_force(POSE, PULL.values, "z", 1e3),
    "TrackingRun": cdsm.track(small_path(0.1), steps=1, minimum=10.0),
}

PLAIN: dict[str, Any] = {
    "Geometry": POSE.arm.geometry,
    "Joint": POSE.arm.geometry.joints[0],
    "Link": POSE.arm.geometry.links[0],
    "CableRoute": POSE.arm.geometry.cables[0],
    "Site": POSE.arm.cables[0].sites[0],
    "Cable": POSE.arm.cables[0],
    "Cable with all options": cdsm.Cable(
        "a", POSE.arm.cables[0].sites, STEEL, lead=0.1, series_stiffness=1890.0, control="force"
    ),
    "InfeasibleSample": cdsm.InfeasibleSample(3, "rate", "too far."),
    "SelfCheck": K.report().self_check,
    "Sensors": cdsm.Sensors(tension_noise=0.5),
}


def attributes(result: Any) -> list[str]:
    """Names of all public attributes, the computed ones included."""
    names = [field.name for field in dataclasses.fields(result)]
    names += [
        name
        for name, part in vars(type(result)).items()
        if isinstance(part, (property, cached_property))
    ]
    return [name for name in names if not name.startswith("_")]


def arrays(result: Any) -> Iterator[tuple[str, Array]]:
    """Every array a result gives out, those inside tuples and dictionaries included."""
    for name in attributes(result):
        value = getattr(result, name)
        many = value.values() if isinstance(value, dict) else value
        for part in many if isinstance(value, (tuple, dict)) else (value,):
            if isinstance(part, np.ndarray):
                yield name, part


WAYS: dict[str, Callable[[Any], Any]] = {
    "as made": lambda x: x,
    "pickled": lambda x: pickle.loads(pickle.dumps(x)),
    "copied": copy.copy,
    "deeply copied": copy.deepcopy,
    "replaced": dataclasses.replace,
}


@pytest.mark.parametrize("name", RESULTS)
def test_notebooks_show_what_is_printed(name: str) -> None:
    thing = RESULTS[name]
    shown = thing._repr_html_()
    if not isinstance(thing, (cdsm.Stiffness, cdsm.Report)):  # which have tables of their own
        assert html.unescape(shown) == f"<pre>{thing}</pre>"
    assert shown.startswith(("<pre>", "<table>", "<section>"))


@pytest.mark.parametrize("name", RESULTS)
def test_a_result_is_one_short_line_in_a_list(name: str) -> None:
    shown = repr(RESULTS[name])
    assert "\n" not in shown, shown
    assert len(shown) < 130, shown


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", RESULTS)
def test_arrays_of_results_are_read_only(name: str, way: str) -> None:
    original = RESULTS[name]
    assert list(arrays(original))  # and all that is computed late is there before it is copied
    result = WAYS[way](original)
    for attribute, array in arrays(result):
        assert not array.flags.writeable, attribute
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", RESULTS)
def test_copies_of_results_hold_the_same_numbers(name: str, way: str) -> None:
    original = RESULTS[name]
    result = WAYS[way](original)
    for (attribute, array), (_, expected) in zip(arrays(result), arrays(original), strict=True):
        np.testing.assert_array_equal(array, expected, err_msg=attribute)


def test_arrays_handed_out_by_methods_and_arms_are_read_only() -> None:
    for array in (
        POSE.link_pose("link1"),
        K.pseudoinverse(),
        POSE.arm.lower,
        POSE.arm.upper,
        POSE.arm.gravity,
    ):
        assert not array.flags.writeable


@pytest.mark.parametrize("name", [*RESULTS, *PLAIN])
def test_assigning_or_deleting_an_attribute_raises(name: str) -> None:
    thing = {**RESULTS, **PLAIN}[name]
    for attribute in (*(field.name for field in dataclasses.fields(thing)), "something_new"):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(thing, attribute, None)
    with pytest.raises(dataclasses.FrozenInstanceError):
        delattr(thing, dataclasses.fields(thing)[0].name)


@pytest.mark.parametrize("name", RESULTS)
def test_results_are_made_by_name_and_equal_to_nothing_but_themselves(name: str) -> None:
    result = RESULTS[name]
    assert all(field.kw_only for field in dataclasses.fields(result) if field.init)
    with pytest.raises(TypeError, match="positional"):
        type(result)(*(getattr(result, field.name) for field in dataclasses.fields(result)))
    # arrays have no one truth value to compare by
    assert result != copy.copy(result)
    assert len({result, copy.copy(result)}) == 2


def test_properties_of_an_arm_cannot_be_assigned() -> None:
    names = [name for name, part in own(cdsm.Manipulator).items() if isinstance(part, property)]
    assert "geometry" in names
    for name in names:
        with pytest.raises(AttributeError):
            setattr(POSE.arm, name, None)


# --- pickling -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", PLAIN)
def test_plain_values_survive_pickling(name: str) -> None:
    again = pickle.loads(pickle.dumps(PLAIN[name]))
    assert again == PLAIN[name]
    assert hash(again) == hash(PLAIN[name])
    assert repr(again) == repr(PLAIN[name])


def test_arm_survives_pickling() -> None:
    again = pickle.loads(pickle.dumps(POSE.arm))
    assert again.geometry == POSE.arm.geometry
    assert again.cables == POSE.arm.cables
    assert again.urdf == POSE.arm.urdf
    np.testing.assert_array_equal(again.gravity, POSE.arm.gravity)
    np.testing.assert_array_equal(again.at(POSE.q).length_jacobian, POSE.length_jacobian)


def test_stiffness_goes_on_from_a_pickled_tension() -> None:
    again = pickle.loads(pickle.dumps(PULL))
    np.testing.assert_array_equal(cdsm.stiffness(again.posture, again).joint, K.joint)
    assert str(again) == str(PULL)


ERRORS: tuple[cdsm.CdsmError, ...] = (
    cdsm.TensileTestError("two points."),
    cdsm.CdsmError("something"),
    cdsm.InvalidInput("q", "is odd."),
    cdsm.UnknownName("link", "lnk1", ["link1", "link2"], "Look again."),
    cdsm.FileError("/nowhere/arm.toml", "does not exist."),
    cdsm.StoreError("/nowhere/s.zarr", "holds another sweep.", ["minimum: 1.0, 2.0"]),
    cdsm.MissingExtra("zarr", "sweep"),
    cdsm.MissingWire("arm.toml", ["cable1_1"]),
    cdsm.ClusterError("a worker failed."),
    cdsm.GeometryError(["a: is missing", "b: is odd"], "arm.toml"),
    cdsm.UrdfError("is no robot."),
    cdsm.CableError("cable1_1", "is too short."),
    cdsm.JointLimitError(["joint1"], [2.0], [(-1.0, 1.0)]),
    cdsm.ElasticityRangeError("outside.", [900.0], [3], ["cable1_1"]),
    cdsm.InfeasibleDesign("none meets all", ["held"], [0.02, 3.0]),
    cdsm.InfeasibleTension(np.array([0.1, -0.2]), "joint2", 3.5, ["cable1_1"]),
    cdsm.SolverError("daqp", "failed."),
    cdsm.SingularStiffness("K_θ is singular.", np.array([0.6, 0.8])),
    cdsm.SingularMass("moves no mass.", np.array([0.6, 0.8])),
    cdsm.EquilibriumError("the arm buckles", np.array([0.1, -0.2]), 0.5, "joint2"),
    cdsm.UnreachableStiffness(np.array([0.0, 0.6, 0.8]), 9e4, 1e3, 8e4, [8e4]),
)


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
@pytest.mark.parametrize("way", ["pickled", "copied", "deeply copied"])
def test_errors_survive_pickling_with_message_and_data(error: cdsm.CdsmError, way: str) -> None:
    again = WAYS[way](error)
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert again.args == error.args
    assert vars(again).keys() == vars(error).keys()
    for name, value in vars(error).items():
        np.testing.assert_array_equal(getattr(again, name), value)
    with pytest.raises(type(error)):
        raise again


def test_every_error_class_is_pickled_above() -> None:
    kinds = {k for k in vars(errors).values() if inspect.isclass(k) and issubclass(k, Exception)}
    assert {type(error) for error in ERRORS} == kinds - {cdsm.CdsmWarning}


# --- one hinge ------------------------------------------------------------------------------


def test_arm_of_one_hinge_has_arrays_of_the_documented_shapes() -> None:
    geometry = cdsm.Geometry.hinged(
        joints=1,
        twist=0.0,
        link_length=0.05,
        base_length=0.02,
        disk_offset=0.01,
        hole_radius=0.03,
        link_mass=0.1,
    )
    pose = cdsm.Manipulator(geometry, STEEL).at([0.1])
    stiff = cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum=5.0))
    assert pose.jacobian.shape == (6, 1)
    assert pose.length_jacobian.shape == (2, 1)
    assert pose.gravity_stiffness.shape == stiff.joint.shape == (1, 1)
    assert stiff.compliance.shape == (6, 6)
    assert "stable" in str(stiff)


# --- threads --------------------------------------------------------------------------------


def evaluate(arm: cdsm.Manipulator, seed: int) -> tuple[bytes, ...]:
    """Everything from the joint angles to the stiffness, as bytes."""
    pose = random_posture(arm, seed)
    pull = cdsm.distribute_tension(pose, minimum=5.0, wrench=random_wrench(seed))
    stiff = cdsm.stiffness(pose, pull)
    return tuple(
        array.tobytes()
        for array in (
            pose.tip,
            pose.jacobian,
            pose.cable_lengths,
            pose.length_jacobian,
            pose.gravity_torque,
            pull.values,
            stiff.joint,
            stiff.compliance,
        )
    )


def test_eight_threads_over_one_arm_give_the_serial_bits() -> None:
    arm = random_arm(5, 4)
    seeds = range(250)
    serial = [evaluate(arm, seed) for seed in seeds]
    with ThreadPoolExecutor(8) as pool:
        # every thread goes through all seeds, in an order of its own
        jobs = [
            (seed, pool.submit(evaluate, arm, seed))
            for thread in range(8)
            for seed in np.random.default_rng(thread).permutation(len(seeds)).tolist()
        ]
        for seed, job in jobs:
            assert job.result() == serial[seed]


def test_two_arms_in_turn_do_not_disturb_each_other() -> None:
    first, second = random_arm(6, 3), random_arm(7, 5, "hinged")
    serial = [[evaluate(arm, seed) for seed in range(50)] for arm in (first, second)]
    in_turn = [(evaluate(first, seed), evaluate(second, seed)) for seed in range(50)]
    assert [list(column) for column in zip(*in_turn, strict=True)] == serial


def test_a_posture_keeps_its_numbers_when_the_arm_moves_on() -> None:
    arm = random_arm(6, 3)
    pose = random_posture(arm, 1)
    before = [array.copy() for _, array in arrays(pose)]
    for seed in range(2, 6):
        random_posture(arm, seed)
    for (name, array), expected in zip(arrays(pose), before, strict=True):
        np.testing.assert_array_equal(array, expected, err_msg=name)


# --- without compilation --------------------------------------------------------------------

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


@pytest.mark.slow
def test_kernels_give_the_same_without_compilation() -> None:
    pose = random_posture(mixed_arm(), 3)
    stiff = cdsm.stiffness(pose, random_tension(pose.arm, 3), random_wrench(3))
    answer = uncompiled(PLAIN_PYTHON)
    for name, numbers in answer.items():
        expected = getattr(pose if hasattr(pose, name) else stiff, name)
        np.testing.assert_allclose(
            numbers, expected, rtol=1e-12, atol=1e-13 * abs(expected).max(), err_msg=name
        )


NO_CACHE = """
from numba.core import caching
for kind in (caching.CacheImpl, caching.CompileResultCacheImpl):
    kind._locator_classes = []  # no folder can be written
import cdsm
from tests.support.arms import mixed_arm, random_posture
random_posture(mixed_arm(), 3)
"""


@pytest.mark.slow
def test_kernels_compile_where_no_cache_can_be_written() -> None:
    command = [sys.executable, "-c", NO_CACHE]
    subprocess.run(command, cwd=ROOT, timeout=HANGS, check=True)


def test_pickled_values_carry_their_fields_alone() -> None:
    pose = random_posture(mixed_arm(), 3)
    stiff = cdsm.stiffness(pose, random_tension(pose.arm, 3))
    before = len(pickle.dumps(stiff))
    assert str(stiff)
    assert pose.length_hessian.size
    assert len(pickle.dumps(stiff)) == before


def test_unpickled_posture_needs_no_new_compilation() -> None:
    pose = random_posture(mixed_arm(), 3)
    tension = random_tension(pose.arm, 3)
    cdsm.stiffness(pose, tension)
    kernels = [
        stiffness_kernels.single_stiffness,
        stiffness_kernels.single_length_hessian,
        posture.single_pose,
    ]
    compiled = [len(kernel.signatures) for kernel in kernels]  # type: ignore[attr-defined]
    again = pickle.loads(pickle.dumps(pose))
    np.testing.assert_array_equal(
        cdsm.stiffness(again, tension).joint, cdsm.stiffness(pose, tension).joint
    )
    assert again.length_hessian.size
    assert [len(kernel.signatures) for kernel in kernels] == compiled  # type: ignore[attr-defined]


def test_tension_from_another_process_fits_the_posture_at_hand() -> None:
    pose = random_posture(mixed_arm(), 3)
    pull = cdsm.distribute_tension(pose, 10.0)
    again = pickle.loads(pickle.dumps(pull))
    np.testing.assert_array_equal(
        cdsm.stiffness(pose, again).joint, cdsm.stiffness(pose, pull).joint
    )
