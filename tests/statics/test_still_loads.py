"""A force on a point that no joint moves bends nothing; prints and JSON say so."""

from collections.abc import Callable

import numpy as np
import pytest

import cdsm
from tests.support import arms

ARM = cdsm.Manipulator(arms.readme_geometry(joints=3), cdsm.LinearElasticity(48e3))
POSE = ARM.at(np.full(6, 0.1))
DOUBT = r"no joint moves the point \(0, 0, 0\) mm of link1: a force there bends nothing; give"
WEIGHT = cdsm.Load("link1", force=(0.0, 0.0, -2.0))


@pytest.mark.parametrize(
    "ask",
    [
        lambda: cdsm.distribute_tension(POSE, 10.0, wrench=WEIGHT),
        lambda: ARM.with_loads([WEIGHT]),
        lambda: cdsm.payload(POSE, "-z", 10.0, 100.0, link="link1"),
    ],
)
def test_a_force_at_the_centre_of_the_first_joint_is_doubted(ask: Callable[[], object]) -> None:
    with pytest.warns(cdsm.CdsmWarning, match=DOUBT):
        ask()


@pytest.mark.filterwarnings("ignore:no joint moves")
def test_it_bends_nothing_and_the_print_and_json_say_so() -> None:
    free = cdsm.distribute_tension(POSE, 10.0)
    held = cdsm.distribute_tension(POSE, 10.0, wrench=WEIGHT)
    np.testing.assert_allclose(held.values, free.values, rtol=1e-9)
    K = cdsm.stiffness(POSE, held)
    assert "load on link1, (0, 0, 0) mm in its frame, which no joint moves: (0, 0, -2) N" in str(K)
    assert K.to_dict()["loads"][0]["moved_by_no_joint"]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "load",
    [
        cdsm.Load("link1", force=(0.0, 0.0, -2.0), point=(0.02, 0.0, 0.0)),
        cdsm.Load("link1", moment=(0.0, 0.1, 0.0)),
        cdsm.Load("link2", force=(0.0, 0.0, -2.0)),
    ],
)
def test_other_loads_are_not_doubted(load: cdsm.Load) -> None:
    free = cdsm.distribute_tension(POSE, 10.0)
    held = cdsm.distribute_tension(POSE, 10.0, wrench=load)
    assert not np.allclose(held.values, free.values, rtol=1e-3)
    assert "which no joint moves" not in str(cdsm.stiffness(POSE, held))
