"""Chain rule: derivatives with respect to design variables, from those with respect to inputs.

Inputs are the numbers that describe an arm: each hole radius, disk offset, lead, link length, link
mass and so on. One variable, such as the hole radius of all joints, changes many inputs at once. It
may also change the postures, if they are random within the joint limits, and the bounds of the
tensions.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdsm.design.grip import grip_slopes
from cdsm.design.problem import DesignProblem
from cdsm.design.variables import Variable
from cdsm.manipulator import Manipulator
from cdsm.support.values import Array
from cdsm.sweeps.poses import RandomPoses
from cdsm.tension import Tension
from cdsm.uncertainties.balanced import Balance
from cdsm.uncertainties.inputs import Inputs, Places, inputs_of


class Chain:
    """Derivatives with respect to the n variables of a problem, at one design, by the chain rule.

    Args:
        problem: The problem; its variables are continuous.
        design: The design (n,).
        arm: The arm of this design.
    """

    def __init__(self, problem: DesignProblem, design: Array, arm: Manipulator) -> None:
        self._rough, self.inputs = problem.worst_friction, inputs_of(arm)
        self._columns = [_column(arm, self.inputs, each) for each in problem.variables]
        # a cable may have a larger lower bound of its own
        minimum = problem.minimum_of(design)
        common = np.array([cable.minimum == minimum for cable in arm.cables], dtype=np.float64)
        self._bound = np.outer(common, [each.of == "minimum" for each in problem.variables])
        self._limits = np.zeros((arm.nv, len(self._columns)))
        if isinstance(problem.postures, RandomPoses):
            self._limits = np.column_stack([_limit_slopes(arm, each) for each in problem.variables])
        by_variable = {
            source: np.array([each.get(source, zero) for each in self._columns])
            for source, zero in self.inputs.zeros().items()
        }
        still = Places(*(np.zeros_like(place) for place in self.inputs.places))
        self._moved = still.moved(self.inputs.displaced(by_variable))

    def at(self, tension: Tension, loss: Array) -> Posed:
        """Return the chain rule at one posture and load: those of the least tensions ``tension``.

        ``loss`` (C,) [-] is exp(Σ μ φ) of each cable, the factor by which friction (coefficient μ,
        wrap angle φ) narrows its bounds. It is 1 if ``worst_friction`` is False.
        """
        pose = tension.posture
        turned, grip = pose.q[:, None] * self._limits, np.zeros_like(self._bound)
        if self._rough:
            grip = grip_slopes(pose, self.inputs, self._moved, turned)
        return Posed(self, Balance.of(tension), turned, grip, loss[:, None] * self._bound)

    def apply(self, by_input: dict[str, Array]) -> Array:
        """Compute the derivatives (n,) of a quantity with respect to the variables.

        The bounds of the tensions are constant. ``by_input`` has an array for each kind of input,
        such as ``link_mass``: the derivatives of the quantity with respect to these inputs of the
        arm.
        """
        return np.array(
            [
                sum(float(weights @ by_input[source]) for source, weights in column.items())
                for column in self._columns
            ]
        )

    def of_links(self, source: str) -> Array:
        """Return the derivatives (n,) of total link mass or length with respect to the variables.

        ``source`` is ``link_mass`` or ``link_length``.
        """
        return np.array([float(np.sum(column.get(source, 0.0))) for column in self._columns])


class Posed(NamedTuple):
    """Chain rule at one posture and load; the least tensions change with the variables.

    All derivatives are with respect to the n variables.
    """

    chain: Chain  # of the arm
    balance: Balance  # the least tensions, and the matrices for their derivatives
    turned: Array  # derivatives (nv, n) of the joint angles
    grip: Array  # derivatives (C, n) of Σ μ φ [-] of the cables; 0 without ``worst_friction``
    bound: Array  # derivatives (C, n) of the lower bounds at constant φ

    def slopes(self, by_input: dict[str, Array], by_tension: Array) -> Array:
        """Return the derivatives (n,) of a quantity with respect to the variables.

        ``by_input`` has an array for each kind of input, such as ``link_mass``: the derivatives of
        the quantity with respect to these inputs at constant tensions. It is empty for a quantity
        of the tensions alone. ``by_tension`` (C,) are the derivatives with respect to the tensions.
        """
        followed = self.balance.gradient(self.chain.inputs, by_tension)
        total = {name: by_input.get(name, 0.0) + g for name, g in followed.items()}
        # friction raises the lower bound by exp(Σ μ φ), and lowers the upper one
        by_grip = self.balance.tension.values[:, None] * self.grip
        bounds = self.balance.by_bounds(by_tension, self.bound + by_grip, -by_grip)
        return self.chain.apply(total) + bounds + np.asarray(total["joint_angle"] @ self.turned)


def _joints(arm: Manipulator, variable: Variable) -> list[int]:
    """Return the numbers, from 0, of the joints that a variable changes."""
    if isinstance(variable.at, int):
        return [variable.at - 1]
    return [*range(len(arm.geometry.joints))]


def _limit_slopes(arm: Manipulator, variable: Variable) -> Array:
    """Return the relative change (dλ/dx)/λ (nv,) of the joint limits λ per change of a variable x.

    At λ = 2 atan(h/R) neighbouring disks touch; h is the disk offset, and R the radius of the disk.
    The result is 0 if the geometry gives the limit of a joint.
    """
    geometry, joints = arm.geometry, _joints(arm, variable)
    found = []
    for k, (joint, limit) in enumerate(zip(geometry.joints, geometry.joint_limits, strict=True)):
        radius = joint.disk_radius or geometry.hole_radii[k]
        by, touching = 0.0, limit == 2.0 * math.atan(joint.disk_offset / radius)
        if k in joints and joint.limit is None and touching:
            if variable.of == "disk_offset":
                by = math.sin(limit) / joint.disk_offset
            elif variable.of == "hole_radius" and joint.disk_radius is None:
                by = -math.sin(limit) / radius
        found += [by / limit] * len(joint.axes)
    return np.array(found)


def _column(arm: Manipulator, inputs: Inputs, variable: Variable) -> dict[str, Array]:
    """Return the derivatives of all inputs with respect to a variable.

    The result has an array for each kind of input that changes, such as ``link_mass``.
    """
    geometry, of, joints = arm.geometry, variable.of, _joints(arm, variable)
    labels = inputs.labels
    disks = [disk.joint - 1 for disk in geometry.disks]
    sites = [(c, i) for c, cable in enumerate(arm.cables) for i in range(len(cable.sites))]
    routes = geometry.cables
    if of == "minimum":
        return {}
    if of == "hole_radius":
        moves = [disks[i] in joints and routes[c].radius is None for c, i in sites]
    elif of == "hole_angle":
        moves = [geometry.cable_names[c] == variable.at for c, _ in sites]
    elif of == "phase":
        of, moves = "hole_angle", [routes[c].joint - 1 in joints for c, _ in sites]
    elif of == "disk_offset":
        of_link = [disk.link for disk in geometry.disks]
        names = [f"disk {of_link[: d + 1].count(link)} of {link}" for d, link in enumerate(of_link)]
        joint_of = dict(zip(names, disks, strict=True))
        moves = [joint_of[name] in joints for name in labels["disk_offset"]]
    elif of == "lead":
        moves = [route.joint - 1 in joints for route in routes]
    else:  # link_length: the mass grows with it
        links = [f"link{k + 1}" for k in joints]
        moves = [name in links for name in labels["link_length"]]
        rows = {
            arm._body.locate(name)[0]: geometry.links[k]
            for k, name in zip(joints, links, strict=True)
        }
        heavier = [
            rows[row].mass / rows[row].length if row in rows else 0.0
            for row in inputs.link_rows.tolist()
        ]
        return {"link_length": np.array(moves, float), "link_mass": np.array(heavier)}
    return {of: np.array(moves, dtype=np.float64)}
