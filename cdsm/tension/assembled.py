"""Least tensions that the motors of an assembled arm give: a sequence of quadratic programs."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from cdsm.assembly import Assembly
from cdsm.errors import InfeasibleTension, InvalidInput, listed, solver_failed
from cdsm.posture import Posture
from cdsm.status import Status
from cdsm.support.format import plural
from cdsm.support.values import Array, frozen
from cdsm.tension.bounds import Bounds
from cdsm.tension.least_tensions import least_tensions
from cdsm.tension.solvers import TensionProblem, nondimensional, solve

_STEPS: Final = 60  # most quadratic programs; a strand takes ten
_CONVERGED: Final = 1e-12  # last change of a tension, over the largest
_SMALLEST: Final = 1e-3  # shortest part of a step that is tried
_MISSED: Final = 1e-6  # torque that no motors give, over the largest


def assembled_tensions(
    pose: Posture, assembly: Assembly, bounds: Bounds, torque: Array, solver: str
) -> tuple[Array, Array]:
    """Compute the least tensions F (C,) [N] of an assembly in balance, and its commands (M,).

    min ½‖F‖² with J_Lᵀ F = ``torque``, F = f(L; l_0 − B φ) within the bounds. In each step F is
    linear in the commands: F + G d. So F stays in the range of G, Nᵀ (F′ − F) = 0 with Nᵀ G = 0,
    which stands beside the balance in the program of free tensions. Raises InfeasibleTension if the
    motors give no such tensions.
    """
    motors = pose.arm.motors
    if len(motors) < pose.arm.nv:
        problem = f"{plural(len(motors), 'motor')} cannot hold {plural(pose.arm.nv, 'joint')} at "
        problem += "any posture; forward_statics(motors=, assembly=) says where they come to rest."
        raise InvalidInput("assembly", problem)
    commands = _nearest(pose, assembly)
    F, slope = assembly.slopes(assembly.driven(commands), pose.cable_lengths)
    missed = math.inf
    for _ in range(_STEPS):
        program = _linearised(pose, bounds, torque, F, slope)
        solution = least_tensions(program, solver)
        if solution.status is Status.INFEASIBLE:
            raise _unreachable(pose, assembly, bounds, torque, solver)
        if not solution.ok:
            raise solver_failed(solver, solution.message)
        change = solution.x * program.force - F
        step = np.linalg.lstsq(slope, change)[0]
        part = 1.0
        while True:
            there = commands + part * step
            driven = assembly.driven(there)
            if (driven.rest_length > 0.0).all():
                new, steeper = assembly.slopes(driven, pose.cable_lengths)
                off = float(abs(new - F - part * change).max())
                if off <= 0.5 * part * float(abs(change).max()) or part < _SMALLEST:
                    break
            part = part / 2.0
        commands = there
        F, slope = new, steeper
        before = missed
        missed = float(abs(change).max()) / max(float(abs(F).max()), 1.0)
        if missed <= _CONVERGED or (missed <= 1e3 * _CONVERGED and missed >= 0.5 * before):
            return frozen(F), frozen(commands)
    raise solver_failed(solver, "does not converge to tensions of this assembly")


def _nearest(pose: Posture, assembly: Assembly) -> Array:
    """Return commands (M,) that change the tensions of the assembly least, as the arm moves."""
    motors = pose.arm.motors
    held = np.array(motors.holds_torque)
    longer = pose.cable_lengths - assembly.posture.cable_lengths
    commands = assembly.commands.copy()
    commands[~held] = -np.linalg.lstsq(motors.matrix[:, ~held], longer)[0]
    return commands


def _linearised(
    pose: Posture, bounds: Bounds, torque: Array, F: Array, slope: Array
) -> TensionProblem:
    """Return the program of tensions F + G d with the ``slope`` G (C, M)."""
    unit = slope / np.linalg.norm(slope, axis=0)
    fixed = np.linalg.svd(unit)[0][:, unit.shape[1] :]
    lever = float(abs(pose.length_jacobian).max())
    rows = np.hstack([pose.length_jacobian, lever * fixed])
    sides = np.concatenate([torque, lever * (fixed.T @ F)])
    low, high = bounds.minimum_held, bounds.maximum_held
    return nondimensional(rows, sides, low, high, pose.arm.length)


def _unreachable(
    pose: Posture, assembly: Assembly, bounds: Bounds, torque: Array, solver: str
) -> InfeasibleTension:
    """Return the error that says which tensions the motors give without the bounds, if any."""
    motors = pose.arm.motors
    count = len(pose.arm.cables)
    free = bounds._replace(
        minimum_held=np.full(count, -np.inf), maximum_held=np.full(count, np.inf)
    )
    commands = _nearest(pose, assembly)
    F, slope = assembly.slopes(assembly.driven(commands), pose.cable_lengths)
    for _ in range(_STEPS):
        program = _linearised(pose, bounds, torque, F, slope)
        solution = solve(program._replace(low=free.minimum_held, high=free.maximum_held), solver)
        if not solution.ok:
            break
        change = solution.x * program.force - F
        commands = commands + np.linalg.lstsq(slope, change)[0]
        driven = assembly.driven(commands)
        if (driven.rest_length <= 0.0).any():
            break
        F, slope = assembly.slopes(driven, pose.cable_lengths)
        if abs(change).max() <= _MISSED * abs(F).max():
            break
    within = np.clip(F, bounds.minimum_held, bounds.maximum_held)
    missing = torque - within @ pose.length_jacobian
    joint = int(abs(missing * pose.arm.levers).argmax())
    outside = abs(F - within) > _MISSED * abs(F).max()
    names = pose.arm.cables.names
    at = [
        f"{names[c]} at {F[c]:.4g} N ({bounds.minimum_held[c]:g} to {bounds.maximum_held[c]:g} N)"
        for c in np.flatnonzero(outside)
    ]
    off = F @ pose.length_jacobian - torque
    balanced = abs(off).max() <= _MISSED * max(
        float((abs(F) @ abs(pose.length_jacobian)).max()), 1e-9
    )
    error = InfeasibleTension(
        frozen(missing),
        pose.arm.joint_names[joint],
        math.inf,
        [names[c] for c in np.flatnonzero(outside)],
        [pose.arm.torque_unit(j) for j in range(pose.arm.nv)],
        pose.arm.joint_names,
    )
    wire = assembly.missing_wire(pose)
    c = int(abs(wire).argmax())
    short = f"; no motor can give the {1e3 * wire[c]:.3g} mm that {names[c]} lacks from there"
    message = f"{plural(len(motors), 'motor')} cannot hold this posture"
    if balanced and at:
        message += f" within the bounds of the tensions: in balance {listed(at)}"
    error.args = (
        f"{message}{short if len(motors) < count else ''}. Assemble the arm at higher tensions, or "
        "at a posture near this one, or give cables motors of their own.",
    )
    return error
