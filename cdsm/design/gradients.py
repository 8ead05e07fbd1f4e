"""Exact derivatives of the quantities of a design with respect to its continuous variables.

The kernel of sensitivities gives the derivatives of a stiffness with respect to every hole, disk,
link, lead and mass at constant tensions, and with respect to the tensions. The tensions depend on
the design: they are the least that balance the arm. So the derivative of their distribution is
added. A variable moves many holes and disks at once; its column in the chain rule says which, and
how far.
"""

from __future__ import annotations

import warnings
from typing import Final

import numpy as np

from cdsm.design.goals import Measure
from cdsm.design.problem import DesignProblem
from cdsm.design.variables import Variable
from cdsm.errors import CdsmWarning, InvalidInput, SingularStiffness
from cdsm.manipulator import Manipulator
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.values import Array
from cdsm.tension import distribute_tension
from cdsm.tolerances.balanced import Balance
from cdsm.tolerances.inputs import Inputs, inputs_of
from cdsm.tolerances.readings import Question

SMOOTH: Final = ("stiffness", "margin", "deflection", "motor_force", "mass", "length")
"""Quantities with exact derivatives."""

_ALIKE = 1e-20
"""Two unit vectors are equal if their squared distance is below this."""


class Chain:
    """Chain rule from the inputs of an arm to the variables of a problem.

    Args:
        problem: The problem; its variables are continuous.
        arm: The arm of a design.
    """

    def __init__(self, problem: DesignProblem, arm: Manipulator) -> None:
        self._problem, self._arm, self.inputs = problem, arm, inputs_of(arm)
        self._columns = [_column(arm, self.inputs, each) for each in problem.variables]
        self._bound = np.array([each.of == "minimum" for each in problem.variables])

    def apply(self, by_input: dict[str, Array], by_bound: float = 0.0) -> Array:
        """Compute the derivatives (n,) with respect to the variables.

        ``by_input`` has those with respect to the inputs of each source, ``by_bound`` the one with
        respect to the lower bound of the tensions.
        """
        found = np.array(
            [
                sum(float(weights @ by_input[source]) for source, weights in column.items())
                for column in self._columns
            ]
        )
        return np.asarray(found + self._bound * by_bound)

    def of_links(self, of: str) -> Array:
        """Return the derivatives of the mass [kg] or the length [m] of all links (n,)."""
        links = self._arm.geometry.links
        slopes = [link.mass / link.length if of == "mass" else 1.0 for link in links]
        return np.array(
            [
                sum(slopes[k] for k in _joints(self._arm, each)) * (each.of == "link_length")
                for each in self._problem.variables
            ]
        )


def rows_and_gradients(
    problem: DesignProblem, design: Array, measure: Measure
) -> tuple[Array, Array]:
    """Compute a quantity at each posture and load (R,), and its derivatives (R, n).

    ``motor_force`` has a row for each cable too.

    Raises:
        InvalidInput: The quantity has no exact derivatives, or the tensions have none for this
            design.
        InfeasibleTension: A posture is not held.
        SingularStiffness: The arm is unstable at a posture.
    """
    if measure.of not in SMOOTH:
        raise InvalidInput(measure.of, f"has no exact derivatives; {', '.join(SMOOTH)} have.")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CdsmWarning)
        arm = problem.arm_of(design)
    chain = Chain(problem, arm)
    if measure.of in ("mass", "length"):
        links = arm.geometry.links
        value = sum(link.mass for link in links) if measure.of == "mass" else arm.geometry.length
        return np.array([value]), chain.of_links(measure.of)[None]
    minimum = problem.minimum_of(design)
    values, slopes = [], []
    for q in problem.postures_of(arm):
        pose = arm.at(q)
        for load in problem.loads:
            tension = distribute_tension(pose, minimum, problem.maximum, load)
            if measure.of == "motor_force":
                balance = Balance.of(tension)
                for c, weights in enumerate(np.eye(len(tension))):
                    values.append(float(tension.values[c]))
                    by_input = balance.gradient(chain.inputs, weights)
                    slopes.append(chain.apply(by_input, balance.by_bound(weights)))
                continue
            K = stiffness(pose, tension)
            if not K.is_stable:
                raise SingularStiffness("the arm is unstable here.", K.critical_direction)
            value, slope = _reading(K, measure, chain)
            values.append(value)
            slopes.append(slope)
    return np.array(values), np.array(slopes)


def _reading(K: Stiffness, measure: Measure, chain: Chain) -> tuple[float, Array]:
    """Return a reading of a stiffness and its derivatives with respect to the variables (n,)."""
    if measure.of == "deflection":
        force = K.wrench[:3]
        value, partial = _displacement(K, force)
    else:
        u = None if measure.direction is None else np.array(measure.direction)
        question = Question("along" if u is not None else "margin", K, u)
        value, partial = question.value(), question.gradient()
    assert K.distribution is not None
    balance = Balance.of(K.distribution)
    followed = balance.gradient(chain.inputs, partial["tension"])
    total = {name: partial[name] + followed[name] for name in partial}
    return value, chain.apply(total, balance.by_bound(partial["tension"]))


def _displacement(K: Stiffness, force: Array) -> tuple[float, dict[str, Array]]:
    """Return |C_vv f| and its derivatives at constant tensions, by source.

    With unit vectors n of the displacement and f̂ of the force f, and c(u) = uᵀ C_vv u, it is |f|
    nᵀ C_vv f̂ = |f| (c(n + f̂) − c(n − f̂))/4.
    """
    if K.wrench[3:].any():
        raise InvalidInput("deflection", "under a moment has no exact derivatives here.")
    size = float(np.linalg.norm(force))
    moved = K.compliance[:3, :3] @ force
    value = float(np.linalg.norm(moved))
    n, u = moved / value, force / size
    total: dict[str, Array] = {}
    for sign in (1.0, -1.0):
        way = n + sign * u
        square = float(way @ way)
        if square < _ALIKE:
            continue
        question = Question("along", K, way / np.sqrt(square))
        weight = -sign * size * square / (4.0 * question.value() ** 2)
        for name, g in question.gradient().items():
            total[name] = total.get(name, 0.0) + weight * g
    return value, total


def _joints(arm: Manipulator, variable: Variable) -> list[int]:
    """Return the joints (from 0) that a variable belongs to."""
    if isinstance(variable.at, int):
        return [variable.at - 1]
    return [*range(len(arm.geometry.joints))]


def _column(arm: Manipulator, inputs: Inputs, variable: Variable) -> dict[str, Array]:
    """Return the derivatives of the inputs of each source with respect to a variable."""
    geometry, of, joints = arm.geometry, variable.of, _joints(arm, variable)
    labels = inputs.labels
    disks = [disk.joint - 1 for disk in geometry.disks]
    sites = [(c, i) for c, cable in enumerate(arm.cables) for i in range(len(cable.sites))]
    routes = geometry.cables
    if of == "minimum":
        return {}
    if of == "hole_radius":
        moves = [disks[i] in joints and routes[c].radius is None for c, i in sites]
    elif of in ("hole_angle", "phase"):
        of = "hole_angle"
        names = geometry.cable_names
        moves = [
            names[c] == variable.at
            if variable.of == "hole_angle"
            else routes[c].joint - 1 in joints
            for c, _ in sites
        ]
    elif of == "disk_offset":
        # in the order of the disks, which sites name first
        number = {name: d for d, name in enumerate(_disk_labels(arm))}
        moves = [disks[number[name]] in joints for name in labels["disk_offset"]]
    elif of == "lead":
        moves = [route.joint - 1 in joints for route in routes]
    else:  # link_length: the mass grows with it
        links = [f"link{k + 1}" for k in joints]
        moves = [name in links for name in labels["link_length"]]
        rows = {
            arm._model.body.locate(name)[0]: geometry.links[k]
            for k, name in zip(joints, links, strict=True)
        }
        heavier = [
            rows[row].mass / rows[row].length if row in rows else 0.0
            for row in inputs.link_rows.tolist()
        ]
        return {"link_length": np.array(moves, float), "link_mass": np.array(heavier)}
    return {of: np.array(moves, dtype=np.float64)}


def _disk_labels(arm: Manipulator) -> list[str]:
    """Return the name of each disk in the labels of the inputs, base to tip."""
    count: dict[str, int] = {}
    names = []
    for disk in arm.geometry.disks:
        count[disk.link] = count.get(disk.link, 0) + 1
        names.append(f"disk {count[disk.link]} of {disk.link}")
    return names
