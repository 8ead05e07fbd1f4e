"""Arms by the thousand: each gives numbers that are verified, or an error of the library's own.

None crashes, hangs, warns or returns NaN. The short profile runs always; the long one, more than
ten thousand arms that are others every time, on demand, and prints what became of them::

    pytest -m long -s tests/test_arms_by_the_thousand.py

With ``--hypothesis-seed=N`` they are the same again. A fault is shrunk and shown by hypothesis.
"""

import faulthandler
import warnings
from collections import Counter
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import cdsm
from cdsm._checks import Array
from tests import strategies, verified
from tests.arms import random_arm
from tests.strategies import Broken

REPEATABLE = settings(derandomize=True, database=None, deadline=None, max_examples=40)
SHORT, LONG = 24, 2100
"""Arms of each kind."""

LOADED = 8
"""Of so many arms one is also brought to rest, one weighed, one buckled and one simulated: each
takes as long as all the rest."""

HANGS = 300.0
"""Seconds after which an arm that takes a tenth of one counts as hanging, and Python is ended."""


def outcome(
    arm: cdsm.Manipulator,
    q: Array,
    bounds: tuple[float, float],
    wrench: Array,
    tension: Array,
    seed: int,
) -> str:
    """What became of an arm: ``answered``, or where it was refused and by which error.

    Args:
        arm: The arm.
        q: Joint angles (nv,) [rad].
        bounds: Lower and upper bound of the tensions to distribute [N].
        wrench: W (6,): force [N], then moment [N m].
        tension: Others, which balance nothing (C,) [N].
        seed: Of what is random in the checks.

    Raises:
        AssertionError: A number is wrong. Anything else that is no CdsmError is a crash.
    """
    rng = np.random.default_rng(seed)
    low, high = bounds
    stage = "at"
    try:
        pose = arm.at(q)
        verified.finite(pose)
        sure = verified.derivatives(pose, rng)
        verified.travels(arm, pose)
        stage = "stiffness of given tensions"
        K = cdsm.stiffness(pose, tension, wrench)
        verified.finite(K)
        sure &= verified.stiff(K, rng)
        stage = "distribute_tension"
        try:
            pull = cdsm.distribute_tension(pose, low, high, wrench)
        except cdsm.InfeasibleTension as error:
            lows, highs = np.full(len(arm.cables), low), np.full(len(arm.cables), high)
            lows = np.maximum(lows, [cable.minimum for cable in arm.cables])
            highs = np.minimum(highs, [cable.maximum for cable in arm.cables])
            verified.infeasible(pose, lows, highs, wrench, error)
            raise
        verified.finite(pull)
        verified.least(pull)
        stage = "stiffness"
        K = cdsm.stiffness(pose, pull)
        verified.finite(K)
        sure &= verified.stiff(K, rng)
        verified.batched(arm, q, low, high, wrench, K)
        chosen = seed % LOADED
        stage = ("equilibrium", "weight_test", "critical_tension", "to_mjcf", "")[min(chosen, 4)]
        if chosen == 0:
            verified.at_rest(pull, wrench + rng.normal(size=6) * 0.01 * abs(wrench).max())
        elif chosen == 1:
            verified.weighed(pull, K)
        elif chosen == 2:
            verified.buckles(pose, wrench)
        elif chosen == 3:
            verified.simulated(pull)
    except cdsm.CdsmError as error:
        verified.told(error, arm)
        if stage in ("at", "distribute_tension", "stiffness") and not isinstance(
            error, cdsm.InvalidInput
        ):
            verified.batched(arm, q, low, high, wrench, error)
        return f"{stage}: {type(error).__name__}"
    return "answered" if sure else "answered, derivatives unresolved"


def tried(kind: str, examples: int, **options: Any) -> Counter[str]:
    """What became of so many arms of a kind."""
    counts: Counter[str] = Counter()

    @settings(
        database=None,
        deadline=None,
        max_examples=examples,
        suppress_health_check=list(HealthCheck),
        **options,
    )
    @given(st.data())
    def each(data: st.DataObject) -> None:
        arm = data.draw(strategies.ARMS[kind])
        question = (
            data.draw(strategies.angles(arm)),
            data.draw(strategies.bounds()),
            data.draw(strategies.wrenches()),
            data.draw(strategies.tensions(arm)),
            data.draw(st.integers(0, 2**32 - 1)),
        )
        faulthandler.dump_traceback_later(HANGS, exit=True)
        try:
            with warnings.catch_warnings(action="error"):
                counts[outcome(arm, *question)] += 1
        finally:
            faulthandler.cancel_dump_traceback_later()

    each()
    return counts


def told(kind: str, counts: Counter[str]) -> str:
    """The counts as a table."""
    answered = sum(count for what, count in counts.items() if what.startswith("answered"))
    total = counts.total()
    rows = [f"{kind}: {total} arms, {answered} answered, {total - answered} refused, 0 wrong"]
    return "\n".join([*rows, *(f"{count:>8} {what}" for what, count in sorted(counts.items()))])


@pytest.mark.parametrize("kind", strategies.ARMS)
def test_arms_give_verified_numbers_or_an_error_of_ours(kind: str) -> None:
    counts = tried(kind, SHORT, derandomize=True)
    # most get as far as the stiffness under given tensions, which is verified before the rest
    early = sum(n for what, n in counts.items() if what.startswith(("at:", "stiffness of given")))
    assert early < counts.total() / 2


@pytest.mark.long
@pytest.mark.parametrize("kind", strategies.ARMS)
def test_ten_thousand_arms_give_verified_numbers_or_an_error_of_ours(kind: str) -> None:
    print(f"\n{told(kind, tried(kind, LONG))}")


# --- broken input ---------------------------------------------------------------------------

ARM = random_arm(1, 2)
POSE = ARM.at(np.zeros(ARM.nv))


@REPEATABLE
@given(strategies.broken_vectors(ARM.nv))
def test_broken_angles_are_refused(broken: Broken) -> None:
    with pytest.raises(cdsm.InvalidInput, match=r"^q: "):
        ARM.at(broken.value)


@REPEATABLE
@given(strategies.broken_vectors(6).filter(lambda broken: broken.value is not None))
def test_broken_wrenches_are_refused(broken: Broken) -> None:
    with pytest.raises(cdsm.InvalidInput, match=r"^wrench: "):
        cdsm.distribute_tension(POSE, wrench=broken.value)
    with pytest.raises(cdsm.InvalidInput, match=r"^wrench: "):
        cdsm.stiffness(POSE, np.full(len(ARM.cables), 5.0), wrench=broken.value)


@REPEATABLE
@given(strategies.broken_vectors(len(ARM.cables)))
def test_broken_tensions_are_refused(broken: Broken) -> None:
    with pytest.raises(cdsm.InvalidInput, match=r"^tension: "):
        cdsm.stiffness(POSE, broken.value)


@REPEATABLE
@given(strategies.foreign_vectors(np.linspace(-0.1, 0.2, ARM.nv)))
def test_unusual_arrays_are_read_like_usual_ones(foreign: Broken) -> None:
    expected = ARM.at(np.linspace(-0.1, 0.2, ARM.nv))
    np.testing.assert_array_equal(ARM.at(foreign.value).tip, expected.tip)


@REPEATABLE
@given(strategies.broken_geometries())
def test_broken_geometries_are_refused(broken: Broken) -> None:
    with pytest.raises((cdsm.GeometryError, TypeError)) as caught:
        cdsm.Geometry.universal(**broken.value)
    # a keyword that Python itself misses or does not know is Python's to refuse
    by_name = broken.fault.endswith("missing") or "no such key" in broken.value
    assert by_name or isinstance(caught.value, cdsm.GeometryError)


@REPEATABLE
@given(strategies.broken_elasticities())
def test_broken_elasticities_are_refused(broken: Broken) -> None:
    with pytest.raises(cdsm.InvalidInput):
        broken.value()


@REPEATABLE
@given(strategies.broken_cables())
def test_broken_cables_are_refused(broken: Broken) -> None:
    with pytest.raises(cdsm.CableError):
        cdsm.Cable(**broken.value)
