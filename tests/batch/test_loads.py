"""Loads on links in batches and sweeps: as posture by posture, compiled and by numpy."""

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest

import cdsm
from cdsm.applied import as_loads
from cdsm.batch import solution
from cdsm.loads import loads_of
from tests.core.test_loads import ARMS, THREE, Q, backbone, branching, some_loads, universal

NAMES = ("active", "passive", "gravity", "load", "springs", "joint", "residual", "compliance")
ROWS = 11


@pytest.fixture(params=["numpy", "compiled"])
def kernels(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Have batches use these kernels."""
    module = getattr(solution, f"{request.param}_kernels")()
    monkeypatch.setattr(solution, "choose_kernels", lambda arm, count: module)
    return module


@pytest.mark.parametrize("make", ARMS)
@pytest.mark.parametrize("moments", [0.0, 0.3])
def test_a_row_is_a_posture(
    make: Callable[[], cdsm.Manipulator], moments: float, kernels: ModuleType
) -> None:
    arm = make()
    rng = np.random.default_rng(3)
    loads = some_loads(arm, np.repeat([5.0, moments], 3), rng)
    own = arm.with_loads(loads[0])
    q = rng.uniform(-0.15, 0.15, (ROWS, arm.nv))
    F = rng.uniform(60.0, 90.0, (ROWS, len(arm.cables)))
    given = {loads[1].link: rng.normal(size=(ROWS, 6)), loads[2].link: loads[2].wrench}
    if make is not backbone:  # its last disk is the tip
        given |= {arm.tip_link: [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]}
    batch = cdsm.evaluate(own, q, F, given, NAMES, check_limits=False)
    along = cdsm.evaluate(own, q, F, given, ("along",), direction="z", check_limits=False)
    for row in range(ROWS):
        wrench = {link: W[row] if np.ndim(W) > 1 else W for link, W in given.items()}
        K = cdsm.stiffness(own.at(q[row], check_limits=False), F[row], wrench)
        size = abs(K.joint).max()
        for name in NAMES:
            alone = K.terms[name] if name in K.terms else getattr(K, name)
            most = 1e-9 * abs(alone).max() if name == "compliance" else 1e-12 * size
            assert abs(batch[name][row] - alone).max() < most, name
        assert along["along"][row, ...] == pytest.approx(K.along("z"), rel=1e-10)


def test_a_load_counts_for_the_joints_before_its_link_alone(kernels: ModuleType) -> None:
    """On a finger that does not lead to the tip."""
    arm = branching()
    q = np.array([[0.2, 0.3, -0.2, 0.25], [0.1, -0.2, 0.1, 0.3]])
    beside = cdsm.Load("link4", (1.0, 2.0, -3.0), (0.1, 0.0, 0.2), point=(0.03, 0.0, 0.0))
    F = np.full(len(arm.cables), 30.0)
    names = ("load", "residual")
    load = cdsm.evaluate(arm, q, F, beside, names)
    none = cdsm.evaluate(arm, q, F, None, names)
    torque = none["residual"] - load["residual"]
    joints = [arm.joint_names.index(name) for name in ("wrist", "right1")]
    others = [arm.joint_names.index(name) for name in ("left1", "left2")]
    assert (torque[:, others] == 0.0).all()
    assert (load["load"][:, others] == 0.0).all()
    assert (abs(torque[:, joints]) > 1e-3).all()
    for row in range(2):
        expected = -as_loads(loads_of(arm, beside)).torque(arm.at(q[row]))
        np.testing.assert_allclose(torque[row], expected, atol=1e-13)


def test_tensions_under_loads_on_links(kernels: ModuleType) -> None:
    arm = universal()
    q = np.outer([1.0, 0.5, -0.4], Q)
    tensions = cdsm.distribute_tensions(arm, q, 20.0, 300.0, THREE)
    for row in range(3):
        alone = cdsm.distribute_tension(arm.at(q[row]), 20.0, 300.0, THREE)
        np.testing.assert_allclose(tensions.values[row], alone.values, rtol=1e-10)
    assert tensions.loads is not None
    assert [point.link for point in tensions.loads.points] == ["link2", "link3"]
    np.testing.assert_array_equal(tensions.wrench, THREE[2].wrench)
    K = cdsm.evaluate(arm, q, tensions, outputs=("residual",))
    assert abs(K["residual"]).max() < 1e-12
    np.testing.assert_array_equal(K.wrench, THREE[2].wrench)


def test_without_loads_all_bits_stay(kernels: ModuleType) -> None:
    arm = universal()
    q = np.outer([1.0, 0.5, -0.4], Q)
    W = [0.0, 1.0, -2.0, 0.0, 0.1, 0.0]
    options = {"outputs": (*NAMES, "tension"), "minimum": 20.0}
    plain = cdsm.evaluate(arm, q, wrench=W, **options)  # type: ignore[arg-type]
    at_tip = cdsm.evaluate(arm, q, wrench={"tool0": W}, **options)  # type: ignore[arg-type]
    assert at_tip.loads is None
    for name in plain:
        np.testing.assert_array_equal(plain[name], at_tip[name])


@pytest.mark.parametrize(
    ("wrench", "said"),
    [
        ({"lnik2": np.zeros(6)}, r"wrench\.link: .*did you mean 'link2'"),
        ({"base_link": np.zeros(6)}, r"wrench\.link: 'base_link' is the base"),
        ({"link2": np.zeros((3, 6))}, r"wrench\['link2'\]: shape \(3, 6\) given, .*\(2, 6\)"),
        ([THREE[0], THREE[0]], "two loads act on link2 at one point"),
    ],
)
def test_wrong_loads_are_named(wrench: object, said: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=said):
        cdsm.evaluate(universal(), [Q, Q], None, wrench, ("tension",), minimum=20.0)  # type: ignore[arg-type]
