"""A design problem as a frozen value: variables, goals, postures and loads."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.arm_parameters import ArmParameters
from cdsm.cable import require_own_cables
from cdsm.definition import refuse_terms
from cdsm.design.goals import Constraint, Measure, Objective
from cdsm.design.variables import WHOLE, Value, Variable, changed
from cdsm.errors import InvalidInput, listed
from cdsm.loads import has_loads
from cdsm.manipulator import Manipulator
from cdsm.parameters import PARAMETERS
from cdsm.support.format import plural
from cdsm.support.validation import NO_WRENCH, instance, number_array, sequence_of
from cdsm.support.values import Array, Converted, ReadOnlyState, frozen
from cdsm.sweeps.cases import require
from cdsm.sweeps.poses import PoseSet, joint_angles
from cdsm.tension import checked_bounds

MISSED = "held"
"""Key of the fraction of postures and loads that are held; it is computed for every problem."""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class DesignProblem(ReadOnlyState):
    """Design problem: variables of an arm, objectives, constraints; the argument of all searches.

    A posture is held if tensions within the bounds balance the arm under the load, and `K_θ` is
    then positive definite. A design must hold all postures under all loads, unless an objective or
    a constraint is on ``held`` or ``workspace``.

    Attributes:
        arm: The arm that is changed; it was made from a Geometry.
        variables: What may change.
        objectives: Quantities to optimise; one or more.
        constraints: Limits of quantities.
        postures: Joint angles q (P, nv) [rad], or a pose set; its random postures lie within the
            joint limits of each design.
        loads: Wrenches W (n, 6), or one (6,), at ``tool0``, base axes: force [N], then moment
            [N m]; default: no load.
        minimum: Lower bound of all tensions [N], unless it is a variable.
        maximum: Upper bound of all tensions [N].
        worst_friction: Whether all segments of the cables stay within the bounds, whatever loads
            came before; see :func:`~cdsm.distribute_tension`. ``tension`` is then the largest
            one that friction can cause along each cable.
        diameter: Diameter of the cables [m], for clearances.

    Raises:
        InvalidInput: An argument is invalid; two variables change the same thing; the arm was made
            from a URDF, or its leads or holes are not those of its geometry. The arm does not have
            a cable that is named.

    Example:
        >>> import cdsm
        >>> problem = cdsm.DesignProblem.read("examples/design.toml")
        >>> [variable.of for variable in problem.variables]
        ['hole_radius', 'disk_offset', 'cables_per_joint', 'minimum']
    """

    arm: Manipulator
    variables: Sequence[Variable]
    objectives: Sequence[Objective]
    postures: PoseSet | ArrayLike
    constraints: Sequence[Constraint] = ()
    loads: Converted[ArrayLike, Array] = NO_WRENCH  # type: ignore[assignment]
    minimum: float = 0.0
    maximum: float = math.inf
    worst_friction: bool = False
    diameter: float = 0.0

    def __post_init__(self) -> None:
        geometry = instance("arm", self.arm, Manipulator).geometry  # raises without one
        refuse_terms(self.arm.definition.terms, "batches, and so designs, have no kernel for")
        require_own_cables(geometry, self.arm.cables)
        if given := [motor.name for motor in self.arm.definition.motors]:
            problem = f"designs know one rigid motor for each cable, not {listed(given)}; take "
            problem += "[motors] out of the ARM.toml, or use arm.with_motors([])."
            raise InvalidInput("arm", problem)
        variables = sequence_of("variables", self.variables, Variable)
        objectives = sequence_of("objectives", self.objectives, Objective)
        constraints = sequence_of("constraints", self.constraints, Constraint)
        if not variables or not objectives:
            raise InvalidInput("variables", "give one variable and one objective or more.")
        _require_compatible(variables, self.arm)
        if has_loads(self.loads) and self.loads != []:
            problem = "designs take wrenches (n, 6) at the tip; loads on links that stay belong to "
            raise InvalidInput("loads", f"{problem}the arm: with_loads, [[loads]] in its ARM.toml.")
        loads = np.atleast_2d(number_array("loads", self.loads, "wrench"))
        if loads.ndim != 2 or loads.shape[1] != 6 or not len(loads):
            raise InvalidInput(
                "loads", f"shape {loads.shape} given, (n, 6) needed, or in a file (n, 3)."
            )
        postures = self.postures
        if not isinstance(postures, PoseSet):
            postures = frozen(number_array("postures", postures))
        joint_angles(self.arm, postures)  # raises for a wrong shape
        checked_bounds(self.arm, self.minimum, self.maximum)
        for variable in variables:
            if variable.kind == "minimum":
                _require_below_maximum(variable, self.arm, self.maximum)
        asked = {measure.of for measure in (*objectives, *constraints)}
        require(asked, self.arm, self.maximum, self.worst_friction, self.diameter)
        if "deflection" in asked and not loads[:, :3].any(axis=1).all():
            raise InvalidInput("loads", "deflection needs a force in every load.")
        self.__dict__.update(
            variables=variables,
            objectives=objectives,
            constraints=constraints,
            loads=frozen(loads),
            postures=postures,
        )

    @staticmethod
    def read(path: str | os.PathLike[str]) -> DesignProblem:
        """Read a problem from a PROBLEM.toml; all numbers are in SI: m, rad, N, N/m, kg.

        ``arm`` is the path of an ARM.toml, relative to the folder of the file. ``[postures]`` has
        ``random`` (a number, and ``seed``), ``grid`` (angles [rad] by joint) or ``angles`` (a list
        of postures). ``loads`` is a list of wrenches (6 numbers) or forces (3). The keys of
        ``[[variables]]``, ``[[objectives]]`` and ``[[constraints]]`` are the attributes of
        :class:`Variable`, :class:`Objective` and :class:`Constraint`. All other keys are attributes
        of this class. The command ``cdsm design`` reads ``[search]`` too. ``examples/design.toml``
        has comments.

        Raises:
            FileError: The file, or one that it names, cannot be read, or does not describe a design
                problem; the error lists every fault.
        """
        from cdsm.design.problem_file import read_problem

        return read_problem(path)[0]

    @cached_property
    def measures(self) -> tuple[Measure, ...]:
        """All quantities of objectives and constraints, each once, and ``held``."""
        asked = {measure.key: measure for measure in (*self.objectives, *self.constraints)}
        asked.setdefault(MISSED, Measure("held"))
        return tuple(Measure(measure.of, measure.direction) for measure in asked.values())

    @property
    def needs_all(self) -> bool:
        """Whether a design is feasible only if all postures are held under all loads.

        It is False if an objective or a constraint is on ``held`` or ``workspace``.
        """
        asked = {measure.of for measure in (*self.objectives, *self.constraints)}
        return not asked & {"held", "workspace"}

    @cached_property
    def bounds(self) -> Array:
        """Smallest and largest value of each variable (n, 2) in SI; for choices, their indices."""
        ends = [
            (0.0, len(variable.choices) - 1.0)
            if variable.choices
            else (variable.low, variable.high)
            for variable in self.variables
        ]
        return frozen(np.array(ends, dtype=np.float64))

    def values(self, design: ArrayLike) -> tuple[Value, ...]:
        """Return the value of each variable in a design, which has one number per variable (n,).

        Each number is a value in SI, or the index of a choice. Raises InvalidInput if a number is
        outside its range.
        """
        x = number_array("design", design)
        low, high = self.bounds.T
        if x.shape != low.shape:
            raise InvalidInput("design", f"shape {x.shape} given, {low.shape} needed.")
        values: list[Value] = []
        for variable, number, a, b in zip(self.variables, x.tolist(), low, high, strict=True):
            if not a <= number <= b:
                problem = f"{variable.of} = {number:g} is outside {a:g} to {b:g}."
                raise InvalidInput("design", problem)
            whole = variable.choices or variable.kind in WHOLE
            value = round(number) if whole else number
            values.append(variable.choices[int(value)] if variable.choices else value)
        return tuple(values)

    def arm_of(self, design: ArrayLike) -> Manipulator:
        """Build the arm of a design (n,), see :meth:`values`; its cables get the problem's bounds.

        Raises:
            InvalidInput: A number of the design is outside its range.
            GeometryError: No valid arm has these values; the error lists every fault.
        """
        made = self.unbounded_arm_of(design)
        low = self.minimum_of(design)
        bounds = [(max(c.minimum, low), min(c.maximum, self.maximum)) for c in made.cables]
        pairs = zip(made.cables, bounds, strict=True)
        return made.with_cables([replace(c, minimum=a, maximum=b) for c, (a, b) in pairs])

    def unbounded_arm_of(self, design: ArrayLike) -> Manipulator:
        """Build the arm of a design, without the problem's bounds."""
        return changed(self.arm, dict(zip(self.variables, self.values(design), strict=True)))

    def minimum_of(self, design: ArrayLike) -> float:
        """Return the lower bound of the tensions [N] in a design (n,); see :meth:`values`."""
        for variable, value in zip(self.variables, self.values(design), strict=True):
            if variable.kind == "minimum":
                return float(value)
        return float(self.minimum)

    def postures_of(self, arm: Manipulator) -> Array:
        """Return the postures q (P, nv) [rad] of an arm; InvalidInput if they do not fit it."""
        return joint_angles(arm, self.postures)

    @cached_property
    def start(self) -> Array | None:
        """:attr:`arm` as a design (n,) [m, rad, N, -]; None if a variable is outside its range."""
        values = [variable.present(self.arm, self.minimum) for variable in self.variables]
        known = [value for value in values if value is not None]
        return frozen(np.array(known)) if len(known) == len(values) else None

    def __repr__(self) -> str:
        return f"<DesignProblem {str(self).splitlines()[0]}>"

    def __str__(self) -> str:
        counts = plural(len(self.variables), "variable"), plural(len(self.loads), "load")
        lines = [f"{self.arm.name}: {', '.join(counts)}"]
        for variable in self.variables:
            ends = (
                f"{variable.shown(variable.low or 0.0)} to {variable.shown(variable.high or 0.0)}"
            )
            lines.append(
                f"  {variable.of}: {', '.join(map(variable.shown, variable.choices)) or ends}"
            )
        lines += [f"  {objective.goal}: {objective.words}" for objective in self.objectives]
        lines += [f"  {constraint.words}: {constraint.asked}" for constraint in self.constraints]
        return "\n".join(lines)


def _require_below_maximum(variable: Variable, arm: Manipulator, maximum: float) -> None:
    """Raise InvalidInput unless all values of the ``variable`` minimum [N] leave some tension."""
    ends = [float(end) for end in (variable.high, *variable.choices) if end is not None]
    limits = {cable.name: min(cable.maximum, maximum) for cable in arm.cables}
    cable = min(limits, key=limits.__getitem__)
    if max(ends) > limits[cable]:
        problem = f"is a variable of up to {max(ends):g} N, but the maximum of {cable} is"
        remedy = f"{limits[cable]:g} N; end it there or below, or raise the maximum."
        raise InvalidInput("minimum", f"{problem} {remedy}")


def _require_compatible(variables: Sequence[Variable], arm: Manipulator) -> None:
    """Raise InvalidInput unless the arm has what the variables change, each once."""
    for variable in variables:
        variable.require(arm)
    ArmParameters(arm, tuple(variable.of for variable in variables if variable.kind in PARAMETERS))
    others = [variable.of for variable in variables if variable.kind not in PARAMETERS]
    if len({*others}) < len(others):
        twice = next(name for name in others if others.count(name) > 1)
        raise InvalidInput("variables", f"{twice} is named twice.")
    kinds = {variable.kind for variable in variables}
    of_cables = [variable.of for variable in variables if "@cable" in variable.of]
    if "cables_per_joint" in kinds and of_cables:
        raise InvalidInput("variables", f"cables_per_joint replaces the cable of {of_cables[0]}.")
