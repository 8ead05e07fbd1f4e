"""Choose time step and damping of an arm in MuJoCo, from its natural frequencies."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.statics.modes import vibrations
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.format import JointUnits
from cdsm.support.values import Array

DAMPING_RATIO = 0.05
"""Default damping ratio of the least damped mode [-]."""

_SHARE = 0.5  # least share of ω² from the cables, for modes that count for the damping
_DEFAULT_STEP = 2e-3  # MuJoCo's own time step [s]

_PHASE = 0.2
"""Largest ω·dt [rad], with ω the highest natural frequency: frequencies are right within 0.2 %.
MuJoCo integrates the springs explicitly, which diverges from ω·dt = 2 on."""


class Carried(NamedTuple):
    """Rigid body that a link carries; its centre and inertia are in the frame of the link."""

    link: str
    mass: float  # m [kg]
    centre: Array  # centre of mass (3,) [m]
    inertia: Array  # I about the centre of mass (3, 3) [kg m²]


class Motion(NamedTuple):
    """Time step and damping of a MuJoCo model."""

    time_step: float  # [s]
    wires: Array  # damping of the cables (C,) [N s/m]
    joints: float  # damping of every joint [N m s/rad], [N s/m] where it slides
    said: tuple[str, str]  # lines shown to the user


def choose_motion(
    arm: Manipulator,
    K: Stiffness | None,
    masses: list[Carried],
    ratio: float | None,
    damping: float | None,
) -> Motion:
    """Choose the damping, and the time step for the highest natural frequency of K and ``masses``.

    If ``damping``, that of every joint, is None, each cable gets the damping c = β k, with β such
    that the least damped mode has the damping ratio ``ratio``. Joint dampers with this effect would
    slow down the slow motions of a long arm tenfold. Without K, the time step is MuJoCo's own.
    """
    wires, joints = np.zeros(len(arm.cables)), damping or 0.0
    step, reason = _DEFAULT_STEP, "MuJoCo's own"
    unit = JointUnits(arm.slides).joined("N m s/rad", "N s/m")
    damped = f"{joints:.4g} {unit} at every joint"
    if K is not None:
        squares, shapes = vibrations(K, mass_matrix(K.posture, masses))
        fastest = math.sqrt(abs(squares).max())
        step, reason = _time_step(fastest), f"for frequencies up to {fastest / math.tau:.4g} Hz"
        swings = squares > 0.0
        omega = np.sqrt(squares[swings])
        stretch = K.posture.length_jacobian @ shapes[:, swings]
        ratios = K.cable_stiffness @ stretch**2 / (2.0 * omega)  # for β = 1 s
        resisted = 2.0 * ratios >= _SHARE * omega
        if damping is None and resisted.any():
            beta = (DAMPING_RATIO if ratio is None else ratio) / ratios[resisted].min()
            wires = beta * K.cable_stiffness
            damped = (
                f"ratio {beta * ratios.min():.2g} to {beta * ratios.max():.2g} of the modes, by "
                f"the cables: {wires.min():.4g} to {wires.max():.4g} N s/m"
            )
    said = f"time step  {1e3 * step:g} ms, {reason}", f"damping    {damped}"
    return Motion(step, wires, joints, said)


def _time_step(omega: float) -> float:
    """Choose a time step of 1, 2 or 5 times 10ⁿ s, at most 2 ms and at most 0.2/``omega``.

    ``omega`` is the highest natural frequency [rad/s].
    """
    if omega * _DEFAULT_STEP <= _PHASE:
        return _DEFAULT_STEP
    power = math.floor(math.log10(_PHASE / omega))
    steps = [float(f"{digit}e{exponent}") for exponent in (power - 1, power) for digit in (1, 2, 5)]
    return max(step for step in steps if step * omega <= _PHASE)


def mass_matrix(pose: Posture, carried: Iterable[Carried]) -> Array:
    """Compute the joint-space mass matrix (nv, nv) [kg m²] of the bodies ``carried`` alone.

    M = Σ (m J_vᵀ J_v + J_ωᵀ I J_ω). J_v and J_ω are the Jacobians of the velocity of the centre of
    mass and of the angular velocity of a body.
    """
    body, M = pose.arm._body, np.zeros((pose.arm.nv, pose.arm.nv))
    for link, mass, centre, inertia in carried:
        place = pose.link_pose(link)
        joints = np.array(body.joints_to(body.locate(link)[0]), dtype=np.intp) - 1
        angular, R = pose._twist[3:, joints], place[:3, :3]
        linear = pose._twist[:3, joints] + np.cross(angular.T, R @ centre + place[:3, 3]).T
        turned = angular.T @ R
        M[np.ix_(joints, joints)] += mass * linear.T @ linear + turned @ inertia @ turned.T
    return M
