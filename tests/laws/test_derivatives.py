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


def _postures() -> dict[str, Callable[[], cdsm.Posture]]:
    mixed = arms.mixed_arm().geometry
    uniform = arms.random_arm(5, 3).geometry
    serpentine: dict[str, Callable[[], cdsm.Manipulator]] = {
        f"{kind}-{n}": lambda n=n, kind=kind: arms.random_arm(n, n, kind)  # type: ignore[misc]
        for kind in ("universal", "hinged")
        for n in (1, 2, 4, 8)
    }
    general: dict[str, Callable[[], cdsm.Manipulator]] = {
        "mixed": arms.mixed_arm,
        "general-mixed": lambda: _general_arm(1, mixed),
        "general-universal": lambda: _general_arm(2, uniform),
    }
    return {
        name: lambda make=make: arms.random_posture(make(), 7)  # type: ignore[misc]
        for name, make in (serpentine | general).items()
    }


POSTURES = _postures()


@pytest.fixture(scope="module", params=POSTURES)
def pose(request: pytest.FixtureRequest) -> cdsm.Posture:
    return POSTURES[request.param]()


def _assert_derivative(pose: cdsm.Posture, quantity: Quantity, analytic: Array) -> None:
    def f(q: Array) -> Array:
        return np.asarray(quantity(pose.arm.at(q, check_limits=False)))

    assert_second_order(f, analytic, pose.q)


def test_length_jacobian_is_derivative_of_lengths(pose: cdsm.Posture) -> None:
    _assert_derivative(pose, lambda p: p.cable_lengths, pose.length_jacobian)


def test_length_hessian_is_derivative_of_length_jacobian(pose: cdsm.Posture) -> None:
    _assert_derivative(pose, lambda p: p.length_jacobian, pose.length_hessian)


def test_length_hessian_is_symmetric(pose: cdsm.Posture) -> None:
    H = pose.length_hessian
    np.testing.assert_allclose(H, H.transpose(0, 2, 1), rtol=0.0, atol=1e-15 * abs(H).max())


def test_eq16_active_part_contracts_length_hessian_with_tension(pose: cdsm.Posture) -> None:
    F = arms.random_tension(pose.arm, 3)
    active = cdsm.stiffness(pose, F).active
    expected = np.einsum("cij,c->ij", pose.length_hessian, F)
    # the same products in another order of summation
    np.testing.assert_allclose(active, expected, rtol=0.0, atol=1e-14 * F.sum())
    _assert_derivative(pose, lambda p: p.length_jacobian.T @ F, active)


def test_jacobian_linear_rows_are_derivative_of_tip_position(pose: cdsm.Posture) -> None:
    _assert_derivative(pose, lambda p: p.tip[:3, 3], pose.jacobian[:3])


def test_jacobian_angular_rows_turn_the_tip(pose: cdsm.Posture) -> None:
    R = pose.tip[:3, :3]
    # column i: the cross product of ω_i with each axis of the tip
    analytic = np.cross(pose.jacobian[3:].T[:, None, :], R.T[None, :, :])  # i, axis, xyz
    _assert_derivative(pose, lambda p: p.tip[:3, :3], analytic.transpose(2, 1, 0))


def test_gravity_torque_is_derivative_of_potential_energy(pose: cdsm.Posture) -> None:
    _assert_derivative(pose, lambda p: np.array(gravity_energy(p)), pose.gravity_torque)


def test_eq16_gravity_part_is_derivative_of_gravity_torque(pose: cdsm.Posture) -> None:
    _assert_derivative(pose, lambda p: p.gravity_torque, pose.gravity_stiffness)
    F = arms.random_tension(pose.arm, 3)
    np.testing.assert_array_equal(cdsm.stiffness(pose, F).gravity, pose.gravity_stiffness)


@pytest.mark.parametrize("part", ["force", "moment", "both"])
def test_eq16_load_part_is_minus_derivative_of_load_torque(pose: cdsm.Posture, part: str) -> None:
    W = arms.random_wrench(3)
    W[3:] *= part != "force"
    W[:3] *= part != "moment"
    load = cdsm.stiffness(pose, arms.random_tension(pose.arm, 3), wrench=W).load
    _assert_derivative(pose, lambda p: -p.jacobian.T @ W, load)


def test_eq16_load_part_is_symmetric_for_a_force(pose: cdsm.Posture) -> None:
    F = arms.random_tension(pose.arm, 3)
    load = cdsm.stiffness(pose, F, wrench=arms.random_wrench(3, moment=False)).load
    np.testing.assert_array_equal(load, load.T)


@pytest.mark.parametrize("pose", [name for name in POSTURES if name != "hinged-1"], indirect=True)
def test_eq16_load_part_is_not_symmetric_with_a_moment(pose: cdsm.Posture) -> None:
    W = arms.random_wrench(3)
    load = cdsm.stiffness(pose, arms.random_tension(pose.arm, 3), wrench=W).load
    assert abs(load - load.T).max() > 0.01 * abs(load).max()
    with pytest.raises(AssertionError, match=r"neither rounding|fall at the rates"):
        _assert_derivative(pose, lambda p: -p.jacobian.T @ W, load.T)


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
