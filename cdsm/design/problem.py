"""A design problem as a frozen value: variables, goals, postures and loads."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final, get_args

import numpy as np
from numpy.typing import ArrayLike

from cdsm.cable import Cable, Site
from cdsm.design.goals import Constraint, Measure, MeasureName, Objective
from cdsm.design.variables import WHOLE, Value, Variable, changed, present, require_compatible
from cdsm.errors import InvalidInput
from cdsm.geometry.cables import require_own_cables, serpentine_cables
from cdsm.manipulator import Manipulator
from cdsm.measures.rows import require
from cdsm.support.format import plural
from cdsm.support.validation import NO_WRENCH, instance, number_array, scalar, sequence_of
from cdsm.support.values import Array, Given, ReadOnlyState, frozen
from cdsm.sweeps.poses import PoseSet, poses_of
from cdsm.tension import checked_bounds
from cdsm.tolerances import Tolerances
from cdsm.wires.catalogue import as_wire

MISSED = "held"
"""Key of the fraction of postures and loads that are held; it is computed for every problem."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class DesignProblem(ReadOnlyState):
    """Design problem: variables of an arm, objectives, constraints; the argument of all searches.

    A posture is held if tensions within the bounds balance the arm under the load, and K_θ is then
    positive definite. A design must hold all postures under all loads, unless an objective or a
    constraint is on ``held`` or ``workspace``.

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
            came before; see :func:`~cdsm.distribute_tension`. ``motor_force`` and the quantities of
            wires then belong to the largest tension that friction can cause along each cable.
        diameter: Diameter of the cables [m], for clearances and the life of wires.
        tolerances: Tolerances of every design; constraints on ``stiffness``, ``margin`` and
            ``motor_force`` must then be met with a margin of ``coverage`` standard uncertainties
            u. The value of such a quantity includes the margin, e.g. stiffness − coverage · u.
        coverage: Coverage factor: number of standard uncertainties in this margin [-], 0 or more.

    Raises:
        InvalidInput: An argument is invalid; two variables change the same thing; the arm was made
            from a URDF, or its leads or holes are not those of its geometry.
        UnknownName: The arm does not have a cable that is named.
    """

    arm: Manipulator
    variables: Sequence[Variable]
    objectives: Sequence[Objective]
    postures: PoseSet | ArrayLike
    constraints: Sequence[Constraint] = ()
    loads: Given[ArrayLike, Array] = NO_WRENCH  # type: ignore[assignment]
    minimum: float = 10.0
    maximum: float = math.inf
    worst_friction: bool = False
    diameter: float = 0.0
    tolerances: Tolerances | None = None
    coverage: float = 2.0

    def __post_init__(self) -> None:
        geometry = instance("arm", self.arm, Manipulator).geometry  # raises without one
        require_own_cables(geometry, self.arm.cables)
        variables = sequence_of("variables", self.variables, Variable)
        objectives = sequence_of("objectives", self.objectives, Objective)
        constraints = sequence_of("constraints", self.constraints, Constraint)
        if not variables or not objectives:
            raise InvalidInput("variables", "give one variable and one objective or more.")
        require_compatible(variables, geometry)
        loads = np.atleast_2d(number_array("loads", self.loads, "wrench"))
        if loads.ndim != 2 or loads.shape[1] != 6 or not len(loads):
            raise InvalidInput("loads", f"shape {loads.shape} given, (n, 6) needed.")
        postures = self.postures
        if not isinstance(postures, PoseSet):
            postures = frozen(number_array("postures", postures))
        poses_of(self.arm, postures)  # raises for a wrong shape
        checked_bounds(self.arm, self.minimum, self.maximum)
        asked = {measure.of for measure in (*objectives, *constraints)}
        require(
            asked,
            self.arm,
            self.maximum,
            worst_friction=self.worst_friction,
            diameter=self.diameter,
        )
        if "deflection" in asked and not loads[:, :3].any(axis=1).all():
            raise InvalidInput("loads", "deflection needs a force in every load.")
        if self.tolerances is not None:
            instance("tolerances", self.tolerances, Tolerances)
        if scalar("coverage", self.coverage) < 0.0:
            raise InvalidInput("coverage", f"{self.coverage:g} given; give 0 or more.")
        self.__dict__.update(
            variables=variables,
            objectives=objectives,
            constraints=constraints,
            loads=frozen(loads),
            postures=postures,
            coverage=float(self.coverage),
        )

    @cached_property
    def measures(self) -> tuple[Measure, ...]:
        """All quantities of objectives and constraints, each once, and ``held``."""
        asked = {each.key: each for each in (*self.objectives, *self.constraints)}
        asked.setdefault(MISSED, Measure("held"))
        return tuple(Measure(each.of, each.direction) for each in asked.values())

    def in_full(self) -> DesignProblem:
        """Return the problem with every other quantity added as an objective.

        Quantities that need a direction, or data that the problem does not have, are not added.
        """
        full, asked = self, {each.of for each in self.measures}
        for of in get_args(MeasureName):
            if of not in asked:
                with suppress(InvalidInput):  # a direction, or a maximum of the tensions
                    full = replace(full, objectives=(*full.objectives, Objective(of)))
        return full

    @property
    def needs_all(self) -> bool:
        """Whether a design is feasible only if all postures are held under all loads.

        It is False if an objective or a constraint is on ``held`` or ``workspace``.
        """
        asked = {each.of for each in (*self.objectives, *self.constraints)}
        return not asked & {"held", "workspace"}

    @cached_property
    def bounds(self) -> Array:
        """Smallest and largest value of each variable (n, 2) in SI; for choices, their indices."""
        return frozen(
            np.array(
                [
                    (0.0, len(each.choices) - 1.0) if each.choices else (each.low, each.high)
                    for each in self.variables
                ],
                dtype=np.float64,
            )
        )

    @property
    def is_continuous(self) -> bool:
        """Whether all variables are real numbers in a range."""
        return all(variable.is_continuous for variable in self.variables)

    def values(self, design: ArrayLike) -> tuple[Value, ...]:
        """Return the value of each variable in a design, which has one number per variable (n,).

        Each number is a value in SI, or the index of a choice. Raises InvalidInput if a number is
        outside its range.
        """
        x = number_array("design", design)
        low, high = self.bounds.T
        if x.shape != low.shape:
            raise InvalidInput("design", f"shape {x.shape} given, {low.shape} needed.")
        found: list[Value] = []
        for variable, number, a, b in zip(self.variables, x.tolist(), low, high, strict=True):
            if not a <= number <= b:
                raise InvalidInput(
                    "design", f"{variable.name} = {number:g} is outside {a:g} to {b:g}."
                )
            if variable.choices:
                found.append(variable.choices[round(number)])
            else:
                found.append(round(number) if variable.of in WHOLE else number)
        return tuple(found)

    def arm_of(self, design: ArrayLike) -> Manipulator:
        """Build the arm of a design (n,), see :meth:`values`; its cables get the problem's bounds.

        Raises:
            InvalidInput: A number of the design is outside its range.
            GeometryError: No valid arm has these values; the error lists every fault.
        """
        geometry, wire = changed(self.arm.geometry, self.variables, self.values(design))
        old = self.arm.cables
        law = None if wire is None else as_wire(wire)
        routed = serpentine_cables(geometry, law or old[0].elasticity)
        like: Sequence[Cable] = old
        if len(routed) != len(old):
            joints = [route.joint for route in self.arm.geometry.cables]
            at = [route.joint for route in geometry.cables]
            like = tuple(old[joints.index(joint) if joint in joints else 0] for joint in at)
        minimum = self.minimum_of(design)
        cables = [
            replace(
                kept,
                name=cable.name,
                sites=_with_holes_like(cable, kept),
                lead=cable.lead,
                elasticity=law or kept.elasticity,
                minimum=max(kept.minimum, minimum),
                maximum=min(kept.maximum, self.maximum),
            )
            for cable, kept in zip(routed, like, strict=True)
        ]
        made = Manipulator(
            geometry,
            cables=cables,
            gravity=self.arm.gravity,
            original_length=self.arm.original_length,
        )
        return made.with_tolerances(self.arm.tolerances)

    def minimum_of(self, design: ArrayLike) -> float:
        """Return the lower bound of the tensions [N] in a design (n,); see :meth:`values`."""
        for variable, value in zip(self.variables, self.values(design), strict=True):
            if variable.of == "minimum":
                return float(value)
        return float(self.minimum)

    def postures_of(self, arm: Manipulator) -> Array:
        """Return the postures q (P, nv) [rad] of an arm; InvalidInput if they do not fit it."""
        poses = poses_of(arm, self.postures)
        return poses.angles({dim: slice(0, size) for dim, size in poses.sizes.items()})

    @cached_property
    def start(self) -> Array | None:
        """:attr:`arm` as a design (n,) [m, rad, N, -]; None if a variable is outside its range."""
        found = []
        for variable, (low, high) in zip(self.variables, self.bounds.tolist(), strict=True):
            value: Value | None = present(variable, self.arm.geometry, self.minimum)
            if variable.of == "wire":
                now = self.arm.cables[0].elasticity
                value = next((c for c in variable.choices if as_wire(c) == now), None)
            if variable.choices and value is not None:
                value = variable.choices.index(value) if value in variable.choices else None
            if value is None or isinstance(value, str) or not low <= value <= high:
                return None
            found.append(float(value))
        return frozen(np.array(found))

    def __repr__(self) -> str:
        return f"<DesignProblem {str(self).splitlines()[0]}>"

    def __str__(self) -> str:
        counts = plural(len(self.variables), "variable"), plural(len(self.loads), "load")
        lines = [f"{self.arm.name}: {', '.join(counts)}"]
        lines += [
            f"  {each.name}: "
            + (
                ", ".join(map(each.shown, each.choices))
                or f"{each.shown(each.low or 0.0)} to {each.shown(each.high or 0.0)}"
            )
            for each in self.variables
        ]
        lines += [f"  {each.goal}: {each.words}" for each in self.objectives]
        lines += [f"  {each.words}: {each.asked}" for each in self.constraints]
        return "\n".join(lines)


def _with_holes_like(cable: Cable, other: Cable) -> tuple[Site, ...]:
    """Return the sites of ``cable``, with the friction and the wrap of the holes of ``other``.

    A hole that only ``cable`` passes gets the friction of the nearest hole that ``other`` passes.
    """
    sites, known = list(cable.sites), other._holes
    for i in cable._holes if known else ():
        near = min(max(i, known[0]), known[-1])
        like = other.sites[near]
        if like.friction != sites[i].friction or like.wrap:
            wrap = like.wrap if i == near else 0.0
            sites[i] = replace(sites[i], friction=like.friction, wrap=wrap)
    return tuple(sites)
