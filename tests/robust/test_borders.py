"""What no caller means: paths, names, flags, counts and magnitudes, each refused by its name."""

import errno
import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from tests.support.arms import STEEL, random_arm, random_posture
from tests.support.sweeps import short_arm

ANY: Any = None
ARM = random_arm(1, 3)
POSE = random_posture(ARM, 1)
PULL = cdsm.distribute_tension(POSE, minimum=10.0)
K = cdsm.stiffness(POSE, PULL)
UP = (0.0, 0.0, 1.0)
SURROGATE = "link\ud800"
DATA = np.linspace(0.0, 1e-3, 40)


# --- paths ----------------------------------------------------------------------------------

READERS: dict[str, Callable[[Any], object]] = {
    "read_caspr": lambda path: cdsm.read_caspr(path, elasticity=STEEL),
    "read_caspr, cables": lambda path: cdsm.read_caspr("a.xml", path, elasticity=STEEL),
    "read_cables": lambda path: cdsm.read_cables(path),
    "read_sweep": lambda path: cdsm.read_sweep(path),
    "Geometry.read": lambda path: cdsm.Geometry.read(path),
    "from_urdf": lambda path: cdsm.Manipulator.from_urdf(path, ARM.cables, tip="tool0"),
    "write_urdf": lambda path: cdsm.write_urdf(ARM.geometry, path),
    "write_cables": lambda path: cdsm.write_cables(ARM.cables, path),
    "sweep": lambda path: cdsm.sweep(
        short_arm(), np.zeros((1, short_arm().nv)), minimum=20.0, store=path, progress=False
    ),
}

PATHS = {
    "too long a name": ("x" * 5000, "File name too long"),
    "too long": ("/".join(["x" * 200] * 60), "File name too long"),
    "a zero inside": ("a\0b", "null"),
    "no text": (SURROGATE, "surrogates not allowed"),
}


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("reader", READERS)
def test_paths_that_cannot_be_are_file_errors(reader: str, path: str) -> None:
    given, reason = PATHS[path]
    for each in (given, Path(given)):
        with pytest.raises(cdsm.FileError) as caught:
            READERS[reader](each)
        assert reason in str(caught.value)
        assert caught.value.path == given


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is forbidden to root")
def test_paths_in_a_forbidden_folder_are_file_errors(tmp_path: Path) -> None:
    tmp_path.chmod(0)
    for reader in READERS.values():
        with pytest.raises(cdsm.FileError, match=os.strerror(errno.EACCES)):
            reader(tmp_path / "a.xml")
    tmp_path.chmod(0o700)


# --- names ----------------------------------------------------------------------------------

NAMES: dict[str, tuple[Callable[[], object], type[cdsm.CdsmError], str]] = {
    "link_pose": (lambda: POSE.link_pose(SURROGATE), cdsm.UnknownName, "no link is called"),
    "tip": (
        lambda: cdsm.Manipulator.from_urdf(ARM.urdf, ARM.cables, tip=SURROGATE),
        cdsm.UnknownName,
        "no link is called",
    ),
    "joint_names": (
        lambda: cdsm.Manipulator.from_urdf(
            ARM.urdf, ARM.cables, tip="tool0", joint_names=[*ARM.joint_names[1:], SURROGATE]
        ),
        cdsm.InvalidInput,
        "has too many of",
    ),
    "site": (lambda: cdsm.Site(SURROGATE, UP), cdsm.InvalidInput, "link: .* character 5"),
    "cable": (
        lambda: cdsm.Cable(SURROGATE, ARM.cables[0].sites, STEEL),
        cdsm.CableError,
        "name: .* character 5",
    ),
    "load of a sweep": (
        lambda: cdsm.sweep(short_arm(), np.zeros((1, 6)), wrench={SURROGATE: np.zeros(6)}),
        cdsm.InvalidInput,
        "name: .* character 5",
    ),
}


@pytest.mark.parametrize("what", NAMES)
def test_a_lone_surrogate_is_no_name(what: str) -> None:
    call, kind, said = NAMES[what]
    with pytest.raises(kind, match=said) as caught:
        call()
    assert repr(SURROGATE) in str(caught.value)


@pytest.mark.parametrize("given", [5, None, {}, [3.0], iter(ARM.cables)])
def test_cables_are_a_list_of_cables(given: Any) -> None:
    with pytest.raises(cdsm.InvalidInput, match=r"cables: .*a list or tuple of Cable is needed"):
        ARM.with_cables(given)
    with pytest.raises(cdsm.FileError, match="cable1_1: does not exist"):
        ARM.with_cables("cable1_1")  # a text is the path of a file


# --- flags ----------------------------------------------------------------------------------

Q, F = POSE.q[None], PULL.values[None]

FLAGS: dict[str, Callable[[Any], object]] = {
    "check_limits of at": lambda flag: ARM.at(POSE.q, check_limits=flag),
    "check_limits of cable_lengths": lambda flag: ARM.cable_lengths(POSE.q, check_limits=flag),
    "check_limits of evaluate": lambda flag: cdsm.evaluate(ARM, Q, F, check_limits=flag),
    "check_limits of distribute_tensions": lambda flag: cdsm.distribute_tensions(
        ARM, Q, check_limits=flag
    ),
    "check_inertia": lambda flag: cdsm.Manipulator.from_urdf(
        ARM.urdf, ARM.cables, tip="tool0", check_inertia=flag
    ),
    "progress of plan_path": lambda flag: cdsm.plan_path(
        ARM, UP, K.along(UP), 10.0, 100.0, angles=Q, progress=flag
    ),
    "progress of plan_stiffness": lambda flag: cdsm.plan_stiffness(
        POSE, UP, K.along(UP), 10.0, 100.0, progress=flag
    ),
    "progress of stiffness_range": lambda flag: cdsm.stiffness_range(
        POSE, UP, 10.0, 100.0, starts=2, progress=flag
    ),
    "progress of sweep": lambda flag: cdsm.sweep(ARM, Q, minimum=10.0, progress=flag),
}


@pytest.mark.parametrize("given", [np.array([True, False]), float("nan"), 1, None, "yes"])
@pytest.mark.parametrize("what", FLAGS)
def test_a_flag_is_true_or_false(what: str, given: object) -> None:
    with pytest.raises(cdsm.InvalidInput, match=f"^{what.split()[0]}: .*True or False is needed"):
        FLAGS[what](given)


@pytest.mark.parametrize("what", FLAGS)
def test_flags_of_numpy_are_flags(what: str) -> None:
    FLAGS[what](np.True_)
    FLAGS[what](np.False_)


# --- counts and magnitudes ------------------------------------------------------------------

COUNTS: dict[str, tuple[Callable[[Any], object], str]] = {
    "steps": (lambda n: cdsm.weight_test(POSE, PULL, (0.0, 0.0, -1.0), steps=n), "1 to 1000"),
    "starts": (
        lambda n: cdsm.plan_stiffness(POSE, UP, K.along(UP), 10.0, 100.0, starts=n),
        "1 to 1000",
    ),
    "starts of a range": (
        lambda n: cdsm.stiffness_range(POSE, UP, 10.0, 100.0, starts=n),
        "1 to 1000",
    ),
    "starts of a path": (
        lambda n: cdsm.plan_path(ARM, UP, K.along(UP), 10.0, 100.0, angles=Q, starts=n),
        "1 to 1000",
    ),
    "count": (lambda n: cdsm.RandomPoses(n), f"1 to {2**30}"),
    "count of a path": (lambda n: cdsm.PathPoses(np.eye(2), n), f"2 to {2**30}"),
}


@pytest.mark.parametrize("given", [2**63, 10**30, 0, -1, 2.0, True, np.array([1, 2]), "3"])
@pytest.mark.parametrize("what", COUNTS)
def test_a_count_is_bounded(what: str, given: object) -> None:
    call, bounds = COUNTS[what]
    name = what.split()[0]
    with pytest.raises(
        cdsm.InvalidInput, match=f"^{name}: .* whole number from {bounds} is needed"
    ):
        call(given)


@pytest.mark.parametrize("margin", [1e-200, 1e-10, 0.0, -1.0, 1.0])
def test_a_margin_below_rounding_is_none(margin: float) -> None:
    """At 1e-14 the range went down to stiffnesses below zero, which it calls stable."""
    for call in (
        lambda: cdsm.plan_stiffness(POSE, UP, K.along(UP), 10.0, 100.0, margin=margin),
        lambda: cdsm.stiffness_range(POSE, UP, 10.0, 100.0, margin=margin),
        lambda: cdsm.plan_path(ARM, UP, K.along(UP), 10.0, 100.0, angles=Q, margin=margin),
    ):
        with pytest.raises(cdsm.InvalidInput, match=r"margin: .* 1e-09 <= margin < 1"):
            call()


@pytest.mark.parametrize("rigidity", [600.0, 2000.0, 8000.0])
def test_at_the_least_margin_a_range_ends_at_a_stable_arm(rigidity: float) -> None:
    arm = cdsm.Manipulator(ARM.geometry, cdsm.LinearElasticity(rigidity), gravity=ARM.gravity)
    pose = arm.at(POSE.q)
    found = cdsm.stiffness_range(pose, UP, 1.0, 4000.0, margin=1e-9)
    softest = cdsm.stiffness(pose, found.low_tension)
    assert found.low > 0.0
    assert softest.is_stable
    assert softest.margin == pytest.approx(found.floor, rel=0.1)  # buckling is what ends it


@pytest.mark.parametrize("target", [1e308, 1e16, 1e-13, 1e-308, 5e-324, 0.0, -1.0])
def test_targets_no_arm_can_have_are_refused_without_a_warning(target: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for direction, wanted in (
            (UP, target),
            ((UP, (1.0, 0.0, 0.0)), (1e4, target)),
        ):
            for call in (
                lambda u=direction, t=wanted: cdsm.plan_stiffness(POSE, u, t, 10.0, 100.0),
                lambda u=direction, t=wanted: cdsm.plan_path(ARM, u, t, 10.0, 100.0, angles=Q),
            ):
                with pytest.raises(cdsm.InvalidInput, match=r"^target: "):
                    call()


@pytest.mark.parametrize("target", [1e15, 1e-12])
def test_targets_at_the_ends_of_what_is_taken_have_an_answer(target: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(cdsm.UnreachableStiffness):
            cdsm.plan_stiffness(POSE, UP, target, 10.0, 100.0)
        assert not cdsm.plan_stiffness(POSE, (UP,), (target,), 10.0, 100.0).reached


# --- tables ---------------------------------------------------------------------------------


def test_tables_of_pandas_are_the_numbers_they_hold() -> None:
    pandas: Any = pytest.importorskip("pandas")
    q, tension = np.tile(POSE.q, (3, 1)), np.tile(PULL.values, (3, 1))
    angles = pandas.DataFrame(q, columns=ARM.joint_names)
    expected = cdsm.evaluate(ARM, q, tension)
    found = cdsm.evaluate(ARM, angles, pandas.DataFrame(tension))
    for name in expected.outputs:
        np.testing.assert_array_equal(found[name], expected[name])
    np.testing.assert_array_equal(ARM.at(angles.iloc[0]).tip, POSE.tip)
    for other in (angles.astype(object), angles.astype(str)):
        with pytest.raises(cdsm.InvalidInput, match="q: holds object entries, such as"):
            cdsm.evaluate(ARM, other, tension)
