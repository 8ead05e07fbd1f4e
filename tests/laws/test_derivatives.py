"""Every derivative the library gives, against central differences of what it derives from."""

from collections.abc import Callable

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array
from tests.support import arms
from tests.support.differences import assert_second_order, gravity_energy

Quantity = Callable[[cdsm.Posture], Array]


def _general_arm(seed: int, geometry: cdsm.Geometry) -> cdsm.Manipulator:
    """Cables that no serpentine arm has, through random sites."""
    rng = np.random.default_rng(seed)
    routes = {
        "skips_links": ("base_disk", "link2", "tool0"),
        "from_the_tip_back": ("tool0", "link2", "link1", "base_link"),
        "on_crosses": ("base_link", "cross1", "link2", "cross3", "tool0"),
        "to_and_fro": ("link3", "link1", "cross3", "base_disk", "link2", "link2", "cross1"),
        "one_segment_back": ("cross3", "link1"),
        "last_joint_only": ("cross3", "tool0"),
    }
    cables = [
        cdsm.Cable(
            name=name,
            sites=tuple(cdsm.Site(link, tuple(rng.normal(0.0, 0.03, 3))) for link in links),
            elasticity=arms.STEEL,
            lead=0.1,
        )
        for name, links in routes.items()
    ]
    return cdsm.Manipulator(geometry, cables=cables, gravity=(2.0, -5.0, 7.0))


ARMS = {
    **{f"{k}-{n}": arms.random_arm(n, n, k) for k in ("universal", "hinged") for n in (1, 2, 4, 8)},
    "mixed": arms.mixed_arm(),
    "general-mixed": _general_arm(1, arms.mixed_arm().geometry),
    "general-universal": _general_arm(2, arms.random_arm(5, 3).geometry),
}


@pytest.fixture(params=ARMS)
def pose(request: pytest.FixtureRequest) -> cdsm.Posture:
    return arms.random_posture(ARMS[request.param], 7)


W, FORCE, MOMENT = arms.random_wrench(3), np.repeat([1.0, 0.0], 3), np.repeat([0.0, 1.0], 3)


def _pull(pose: cdsm.Posture) -> Array:
    return arms.random_tension(pose.arm, 3)


def _turning(pose: cdsm.Posture) -> Array:
    """∂R/∂θ_i of the tip: the cross product of ω_i with each of its axes, (3, 3, nv)."""
    R = pose.tip[:3, :3]
    return np.cross(pose.jacobian[3:].T[:, None, :], R.T[None, :, :]).transpose(2, 1, 0)


def _load(wrench: Array) -> tuple[Quantity, Quantity]:
    def term(pose: cdsm.Posture) -> Array:
        return cdsm.stiffness(pose, _pull(pose), wrench=wrench).load

    return lambda pose: -pose.jacobian.T @ wrench, term


DERIVATIVES: dict[str, tuple[Quantity, Quantity]] = {
    "J_L of the lengths": (lambda p: p.cable_lengths, lambda p: p.length_jacobian),
    "H_L of J_L": (lambda p: p.length_jacobian, lambda p: p.length_hessian),
    "J_X of the tip's place": (lambda p: p.tip[:3, 3], lambda p: p.jacobian[:3]),
    "J_X of the tip's axes": (lambda p: p.tip[:3, :3], _turning),
    "g of the energy": (lambda p: np.array(gravity_energy(p)), lambda p: p.gravity_torque),
    "gravity term": (lambda p: p.gravity_torque, lambda p: cdsm.stiffness(p, _pull(p)).gravity),
    "active term": (
        lambda p: p.length_jacobian.T @ _pull(p),
        lambda p: cdsm.stiffness(p, _pull(p)).active,
    ),
    "load term of a force": _load(W * FORCE),
    "load term of a moment": _load(W * MOMENT),
}


def _assert_derivative(pose: cdsm.Posture, quantity: Quantity, analytic: Array) -> None:
    def f(q: Array) -> Array:
        return np.asarray(quantity(pose.arm.at(q, check_limits=False)))

    assert_second_order(f, analytic, pose.q)


@pytest.mark.parametrize("name", DERIVATIVES)
def test_differences_converge_to_the_analytic_derivative(pose: cdsm.Posture, name: str) -> None:
    quantity, derivative = DERIVATIVES[name]
    _assert_derivative(pose, quantity, derivative(pose))


@pytest.mark.parametrize("pose", [name for name in ARMS if name != "hinged-1"], indirect=True)
def test_eq16_load_part_is_symmetric_for_a_force_alone(pose: cdsm.Posture) -> None:
    quantity, term = _load(W * FORCE)
    np.testing.assert_array_equal(term(pose), term(pose).T)
    quantity, term = _load(W)
    load = term(pose)
    assert abs(load - load.T).max() > 0.01 * abs(load).max()
    with pytest.raises(AssertionError, match=r"neither rounding|fall at the rates"):
        _assert_derivative(pose, quantity, load.T)


@pytest.mark.parametrize("kind", ["universal", "hinged", "mixed"])
def test_serpentine_cable_depends_on_no_joint_after_its_own(kind: str) -> None:
    arm = arms.mixed_arm() if kind == "mixed" else arms.random_arm(4, 4, kind)
    pose = arms.random_posture(arm, 1)
    number = np.array([int(name.removeprefix("joint").split("_")[0]) for name in arm.joint_names])
    for c, cable in enumerate(arm.geometry.cables):
        assert (pose.length_jacobian[c, number > cable.joint] == 0.0).all()
        assert (pose.length_jacobian[c, number <= cable.joint] != 0.0).all()
        # neighbouring disks see one joint each, so the Hessian is block diagonal
        H = pose.length_hessian[c]
        assert (H[number[:, None] != number[None, :]] == 0.0).all()
        assert (H.diagonal()[number <= cable.joint] != 0.0).all()
