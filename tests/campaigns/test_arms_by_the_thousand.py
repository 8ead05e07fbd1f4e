"""Arms by the thousand: each gives numbers that are verified, or an error of the library's own.

None crashes, hangs, warns or returns NaN. Here are the first few of each kind, always the same, and
a fault is shrunk; ``python -m tests.campaigns.thousand`` tries ten thousand and counts
what became of them.
"""

import numpy as np
import pytest
from hypothesis import given, settings

import cdsm
from tests.campaigns.thousand import tried
from tests.support import strategies
from tests.support.arms import random_arm
from tests.support.strategies import Broken

REPEATABLE = settings(derandomize=True, database=None, deadline=None, max_examples=40)
SHORT = 24
"""Arms of each kind."""


@pytest.mark.slow
@pytest.mark.parametrize("kind", strategies.ARMS)
def test_arms_give_verified_numbers_or_an_error_of_ours(kind: str) -> None:
    counts = tried(kind, SHORT)
    # most get as far as the stiffness under given tensions, which is verified before the rest
    early = sum(n for what, n in counts.items() if what.startswith(("at:", "stiffness of given")))
    assert early < counts.total() / 2


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
    with pytest.raises(cdsm.InvalidInput):
        cdsm.Cable(**broken.value)
