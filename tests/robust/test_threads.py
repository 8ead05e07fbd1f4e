"""Many threads, many processes: the bits of one thread, and nothing shared that could change.

pytest -m long tests/robust/test_threads.py        10⁵ evaluations instead of some thousand
"""

import copy
import gc
import multiprocessing
import pickle
import threading
from collections.abc import Callable, Hashable
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import FrozenInstanceError, fields, is_dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.control.plant import SlowState
from tests.identification.test_experiment import PLAN
from tests.support.arms import mixed_arm, random_arm, random_tension
from tests.support.jobs import Work, balanced, batched, one_by_one, rested, solved, stiff
from tests.test_surface import PLAIN, POSE, RESULTS, WAYS, attributes

THREADS = 8

# --- the same bits --------------------------------------------------------------------------


# many of what is cheap, few of what is dear
MIXED: tuple[Work, ...] = (stiff,) * 20 + (balanced,) * 8 + (batched,) * 2 + (rested, solved)


def assert_same_bits(arms: list[cdsm.Manipulator], jobs: list[tuple[Work, int, int]]) -> None:
    """Jobs (what, which arm, seed) from many threads, in an order of their own, and serially."""

    @cache
    def serial(work: Work, a: int, seed: int) -> tuple[bytes, ...]:
        return work(arms[a], seed)

    order = np.random.default_rng(len(jobs)).permutation(len(jobs)).tolist()
    started = threading.Barrier(THREADS)
    with ThreadPoolExecutor(THREADS, initializer=started.wait) as pool:
        found = [(i, pool.submit(jobs[i][0], arms[jobs[i][1]], jobs[i][2])) for i in order]
        for i, job in found:
            assert job.result() == serial(*jobs[i]), jobs[i]


def test_threads_over_one_arm_give_the_serial_bits() -> None:
    # each seed several times, so that the serial answers are not half of the work
    assert_same_bits([mixed_arm()], [(stiff, 0, i % 500) for i in range(4000)])


@pytest.mark.long
def test_threads_over_one_arm_give_the_serial_bits_many_times() -> None:
    assert_same_bits([mixed_arm()], [(stiff, 0, i) for i in range(100_000)])


def test_threads_that_do_different_things_with_two_arms_give_the_serial_bits() -> None:
    arms = [random_arm(6, 3), random_arm(7, 4, "hinged")]
    jobs = [(MIXED[i % len(MIXED)], i % 2, i % 96) for i in range(960)]
    assert_same_bits(arms, jobs)


def test_two_arms_in_turn_in_one_thread_give_the_bits_of_each_alone() -> None:
    arms = [random_arm(6, 3), random_arm(7, 4, "hinged")]
    for work in dict.fromkeys(MIXED):
        alone = [[work(arm, seed) for seed in range(10)] for arm in arms]
        turns = [[work(arm, seed) for arm in arms] for seed in range(10)]
        assert [list(column) for column in zip(*turns, strict=True)] == alone


@pytest.mark.slow
def test_processes_with_a_pickled_arm_give_the_same_bits() -> None:
    arm, seeds = mixed_arm(), range(20)
    pool: Executor
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        jobs = {w: pool.submit(one_by_one, arm, w, seeds) for w in dict.fromkeys(MIXED)}
        for work, job in jobs.items():
            assert job.result() == one_by_one(arm, work, seeds)


# --- threads that come and go ---------------------------------------------------------------


def run_in_threads(count: int, target: Callable[[], object]) -> None:
    for _ in range(count):
        thread = threading.Thread(target=target)
        thread.start()
        thread.join()


def resident() -> int:
    """Memory of this process [bytes]."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * 4096


def test_scratch_memory_ends_with_its_thread() -> None:
    try:
        resident()
    except OSError:
        pytest.skip("needs /proc to see the memory of this process")
    arm = random_arm(1, 20)
    q = np.zeros(arm.nv)
    run_in_threads(50, lambda: arm.at(q))
    gc.collect()
    before = resident()
    run_in_threads(200, lambda: arm.at(q))
    gc.collect()
    assert resident() - before < 10e6  # 200 times what one needs would be 40 MB


def test_a_thread_that_dies_takes_nothing_along() -> None:
    arm = mixed_arm()
    expected = stiff(arm, 1)
    died: list[BaseException] = []

    def dies() -> None:
        arm.at(np.zeros(arm.nv))
        try:
            arm.at(np.full(arm.nv, np.nan))
        except cdsm.CdsmError as error:
            died.append(error)

    run_in_threads(20, dies)
    assert len(died) == 20
    assert stiff(arm, 1) == expected


def test_an_arm_goes_when_nobody_holds_it() -> None:
    def made() -> int:
        arm = random_arm(1, 3)
        run_in_threads(3, lambda: stiff(arm, 1))
        stiff(arm, 2)
        return id(arm)

    gc.collect()
    count = sum(type(each) is cdsm.Manipulator for each in gc.get_objects())
    for _ in range(3):
        made()
    gc.collect()
    assert sum(type(each) is cdsm.Manipulator for each in gc.get_objects()) == count


# --- copies of every public value -----------------------------------------------------------


def wired(rigidity: float) -> cdsm.Manipulator:
    """The arm of the posture with another wire; where pickling finds it."""
    return cdsm.Manipulator(POSE.arm.geometry, cdsm.LinearElasticity(rigidity))


MEASURED = [
    cdsm.Measurement(
        value=cdsm.stiffness(wired(1e5).at(POSE.q), random_tension(POSE.arm, 1)).along(u),
        direction=tuple(u),
        angles=tuple(POSE.q),
        tension=tuple(random_tension(POSE.arm, 1)),
        std=1.0,
    )
    for u in np.eye(3)[1:]
]
SOFT = random_arm(3, 2, elasticity=cdsm.LinearElasticity(100.0)).at([0.1, -0.1, 0.2, 0.1])
UNSTABLE = cdsm.stiffness(SOFT, cdsm.distribute_tension(SOFT, 300.0))
FIT = cdsm.fit_tensile_test(np.linspace(0.0, 2e-3, 40), np.linspace(0.0, 200.0, 40), 0.5)
DESIGN = cdsm.DesignProblem(
    arm=POSE.arm,
    variables=(cdsm.Variable("lead", 0.0, 0.2),),
    objectives=(cdsm.Objective("mass"),),
    constraints=(cdsm.Constraint("length", at_most=1.0),),
    postures=np.array([POSE.q]),
    minimum=20.0,
)
REFINED = cdsm.refine_design(DESIGN, [0.1])
LOOP = cdsm.WeightLoop(
    direction="-z",
    angles=tuple(POSE.q),
    forces=(1.0, 0.0),
    minimum=20.0,
    displacement_std=5e-6,
)
VALUES: dict[str, Any] = {
    **RESULTS,
    **PLAIN,
    "Manipulator": POSE.arm,
    "TabulatedElasticity": cdsm.TabulatedElasticity((0.0, 50.0, 200.0), (0.0, 2e-3, 5e-3)),
    "GridPoses": cdsm.GridPoses({"joint1_1": np.linspace(-0.1, 0.1, 3)}, {"joint1_2": 0.1}),
    "PathPoses": cdsm.PathPoses(np.array([np.zeros(6), np.ones(6)]), 5),
    "RandomPoses": cdsm.RandomPoses(9, 1),
    "Tolerance": cdsm.Tolerance(0.05, correlation=0.5),
    "Tolerances": cdsm.Tolerances(rigidity=0.05, lead=cdsm.Tolerance(1e-3, correlation=np.eye(9))),
    "Cables": POSE.arm.cables,
    "Remedy": UNSTABLE.remedies[0],
    "Bifurcation": cdsm.bifurcation(cdsm.critical_tension(SOFT), bounds=[10.0, 11.0]),
    "TensileFit": FIT,
    "TensileTest": FIT.test,
    "Measurement": MEASURED[0],
    "Identification": cdsm.identify(wired, MEASURED, {"rigidity": (1e4, 1e6)}),
    "ArmParameters": cdsm.ArmParameters(POSE.arm, ("hole_radius", "friction")),
    "WeightLoop": LOOP,
    "ExperimentPlan": PLAN,
    "SlowPlant": cdsm.SlowPlant(POSE.arm),
    "MuJoCoPlant": cdsm.MuJoCoPlant(POSE.arm),
    "Clearance": cdsm.clearance(POSE),
    "Variable": DESIGN.variables[0],
    "Objective": DESIGN.objectives[0],
    "Constraint": DESIGN.constraints[0],
    "DesignProblem": DESIGN,
    "Designs": REFINED.evaluated,
    "DesignSearch": REFINED,
    "DesignProgress": cdsm.DesignProgress(1, 10, 5, 0.3, 0.0),
}


def test_every_public_value_is_copied_here() -> None:
    public = {
        kind
        for kind in (getattr(cdsm, name) for name in cdsm.__all__)
        if isinstance(kind, type)
        and not issubclass(kind, (Exception, int))
        and kind not in (cdsm.Elasticity, cdsm.PoseSet)  # what others are derived from
    }
    assert public == {type(value) for value in VALUES.values()}


def leaves(value: object, path: str = "") -> list[tuple[str, object]]:
    """All that a value is made of, down to arrays, numbers and texts, by the way to it."""
    if isinstance(value, cdsm.Manipulator):
        return [(path, value.urdf), *leaves(value.cables, path), (path, value.gravity)]
    if isinstance(value, SlowState):  # its memory of the wire is its own
        return [*leaves(value.pose, path), *leaves(value.true, path)]
    inner: list[tuple[str, object]]
    if is_dataclass(value):
        inner = [(f".{each.name}", getattr(value, each.name)) for each in fields(value)]
    elif isinstance(value, (tuple, list)):
        inner = [(f"[{i}]", each) for i, each in enumerate(value)]
    elif isinstance(value, dict):
        inner = [(f"[{key!r}]", each) for key, each in value.items()]
    elif isinstance(value, Exception):
        inner = [(":", str(value)), *((f".{name}", each) for name, each in vars(value).items())]
    else:
        return [(path, value)]
    return [leaf for name, each in inner for leaf in leaves(each, path + name)]


@pytest.mark.parametrize("way", ["pickled", "copied", "deeply copied"])
@pytest.mark.parametrize("name", VALUES)
def test_copies_equal_their_original_to_the_last_array_and_stay_frozen(name: str, way: str) -> None:
    original = VALUES[name]
    copied = WAYS[way](original)
    assert type(copied) is type(original)
    assert str(copied) == str(original)
    found, expected = leaves(copied), leaves(original)
    assert [path for path, _ in found] == [path for path, _ in expected]
    for (path, value), (_, other) in zip(found, expected, strict=True):
        assert type(value) is type(other), path
        if isinstance(value, np.ndarray) and isinstance(other, np.ndarray):
            assert value.dtype == other.dtype, path
            assert value.tobytes() == other.tobytes(), path
            assert not value.flags.writeable, path
            assert not other.flags.writeable, path
        elif not callable(value):
            assert value == other or (value != value and other != other), path
    if isinstance(original, Hashable) and original == copy.copy(original):
        assert copied == original
        assert hash(copied) == hash(original)
    if is_dataclass(copied):
        with pytest.raises(FrozenInstanceError):
            setattr(copied, fields(copied)[0].name, None)


@pytest.mark.parametrize("name", RESULTS)
def test_copies_compute_on_to_the_same_bits(name: str) -> None:
    original = RESULTS[name]
    again = pickle.loads(pickle.dumps(original, protocol=pickle.HIGHEST_PROTOCOL))
    for attribute in attributes(original):
        ours, theirs = getattr(original, attribute), getattr(again, attribute)
        if isinstance(ours, np.ndarray):
            assert ours.tobytes() == theirs.tobytes(), attribute
