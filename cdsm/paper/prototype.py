"""One prototype that explains all measurements of Section V, if the model holds.

The paper prints 20 numbers of its prototype and none of its dimensions. Every unknown is a
parameter within :data:`BOUNDS`. A search finds the parameters that explain the numbers best, in
steps that free more and more parameters. The residual of a stiffness is ln(model/paper), because
its errors are factors. The residual of a drop or a rise is (model − paper)/paper.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, final

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from cdsm import presets
from cdsm.elasticity import LinearElasticity
from cdsm.errors import CdsmError, InvalidInput, SingularStiffness
from cdsm.identification.least_squares import LeastSquares, NoModelError
from cdsm.manipulator import Manipulator
from cdsm.paper.section_v import (
    CHECK,
    DROPS,
    HYBRID,
    NAMES,
    POSTURE,
    RISES,
    TABLE_II,
    TABLE_II_SWAPPED,
    TENSIONS,
)
from cdsm.posture import Posture
from cdsm.statics.weight_test import weight_test
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.validation import Array, frozen
from cdsm.tension import distribute_tension

_RIGID = LinearElasticity(1e12)  # the series stiffness is the whole stiffness of a hybrid cable

_LIMIT = math.radians(30.0)


@final
@dataclass(frozen=True, kw_only=True)
class Prototype:
    """Unknown parameters of Section V. The first cable of each pair is position-controlled.

    Attributes:
        link_length: Length of the links between the joints [m].
        tool_length: Distance from the last joint to the weights [m].
        hole_radius: R [m].
        lead: Lead (the straight cable between its actuator and the base disk) of all cables [m].
        link_mass: Mass of every link [kg].
        drive_stiffness: Stiffness of the drive in series with every strand [N/m].
        tension_offset: Actual minus reported tension of the force-controlled cables [N].
        angle_1: Joint angle 1 of the second configuration of Figs. 12 and 13 [rad]. The first
            configuration is assumed to be that of Table II.
        angle_2: Joint angle 2 of the second configuration [rad].
        angle_3: Joint angle 3 of the second configuration [rad].
        spring_ratio: Stiffest over softest hybrid cable stiffness [-]; Fig. 11 is only a picture.
        hybrid_tension: Tension in Fig. 13 and in the accuracy check [N]. The cables of the check
            are assumed to be the hybrid ones of 1.89 N/mm.
        highest_hybrid_tension: Highest tension in Fig. 12 [N]; the lowest is 3 N, as in Table II.
        disk_ratio: Disk offset over hole radius [-]. At tan 15° disks touch at ±30°, the stated
            joint limit.
        level_2: Tension of row 2 of Table II [N]. Row 1 is at 3 N, row 5 at 86 N.
        level_3: Tension of row 3 of Table II [N].
        level_4: Tension of row 4 of Table II [N].
        weight_x: Weight along x that measured Table II [N]; 0 means an infinitesimal weight.
        weight_y: Weight along y [N].
        weight_z: Weight along −z, as it hangs [N].
    """

    link_length: float
    tool_length: float
    hole_radius: float
    lead: float
    link_mass: float
    drive_stiffness: float
    tension_offset: float
    angle_1: float
    angle_2: float
    angle_3: float
    spring_ratio: float
    hybrid_tension: float
    highest_hybrid_tension: float
    disk_ratio: float
    level_2: float
    level_3: float
    level_4: float
    weight_x: float
    weight_y: float
    weight_z: float

    @property
    def levels(self) -> Array:
        """Tensions of the rows of Table II (5,) [N]."""
        return np.array([TENSIONS[0], self.level_2, self.level_3, self.level_4, TENSIONS[-1]])

    @property
    def weights(self) -> Array:
        """Forces that measured Table II (3, 3) [N], one per row."""
        return np.diag([self.weight_x, self.weight_y, -self.weight_z])

    @property
    def configurations(self) -> tuple[Array, Array]:
        """Joint angles (3,) of the two configurations of Figs. 12 and 13 [rad]."""
        return POSTURE, np.array([self.angle_1, self.angle_2, self.angle_3])

    def arm(self, cable_stiffness: float | None = None) -> Manipulator:
        """Build the arm with the 1×19 strand, or with hybrid cables of one stiffness [N/m].

        Raises:
            GeometryError: The dimensions do not make a valid arm.
        """
        return presets.experimental_prototype(
            presets.STRAND_1X19 if cable_stiffness is None else _RIGID,
            series_stiffness=self.drive_stiffness if cable_stiffness is None else cable_stiffness,
            link_length=self.link_length,
            tool_length=self.tool_length,
            hole_radius=self.hole_radius,
            disk_offset=self.hole_radius * self.disk_ratio,
            lead=self.lead,
            link_mass=self.link_mass,
        )

    def measure(self, pose: Posture, tensions: ArrayLike) -> Array:
        """Compute stiffness (N, 3) [N/m] along x, y, z at N reported tensions [N].

        Raises:
            CdsmError: No tension of the position-controlled cables balances the arm, or it leaves
                the domain of their law, or the arm is unstable.
        """
        return self._measured(pose, tensions, np.zeros((3, 3)))

    def weigh(self, pose: Posture, tensions: ArrayLike) -> Array:
        """Compute force over displacement (N, 3) [N/m] with the weights of Table II.

        Raises:
            CdsmError: The reasons of :meth:`measure`, also with the weights hung.
        """
        return self._measured(pose, tensions, self.weights)

    def _measured(self, pose: Posture, tensions: ArrayLike, weights: Array) -> Array:
        """Compute the stiffness along x, y and z: secant with a weight, tangent without."""
        levels = np.atleast_1d(np.asarray(tensions, dtype=np.float64))
        return np.array(
            [
                [
                    weight_test(pose, K.tension, force).stiffness if force.any() else K.along(axis)
                    for axis, force in zip(np.eye(3), weights, strict=True)
                ]
                for K in self._held(pose, levels)
            ]
        )

    def _held(self, pose: Posture, tensions: Array) -> list[Stiffness]:
        """Compute K_θ for each reported tension [N] of the force-controlled cables."""
        results = []
        for tension in tensions.tolist():
            actual = tension + self.tension_offset
            held = {c.name: actual for c in pose.arm.cables if c.control == "force"}
            K = stiffness(pose, distribute_tension(pose, fixed=held))
            if not K.is_stable:
                raise SingularStiffness(
                    f"the arm buckles at {tension:g} N: its smallest stiffness is "
                    f"{K.margin:.3g} N m/rad. Lower the tension, or take stiffer cables.",
                    K.critical_direction,
                )
            results.append(K)
        return results

    def predict(self, table_alone: bool = False) -> Predicted:
        """Predict the numbers of Section V, or those of Table II alone.

        Raises:
            CdsmError: An experiment has no stable equilibrium; see :meth:`measure`.
        """
        table = self.weigh(self.arm().at(POSTURE), self.levels)
        if table_alone:
            return Predicted(table=frozen(table))
        soft, stiff = self.arm(HYBRID), self.arm(HYBRID * self.spring_ratio)
        drops, rises = [], []
        for q in self.configurations:
            pose = soft.at(q)
            low, middle, high = self.measure(
                pose, [TENSIONS[0], self.hybrid_tension, self.highest_hybrid_tension]
            )
            drops.append(float(1.0 - high[1] / low[1]))
            rises.append(
                float(self.measure(stiff.at(q), self.hybrid_tension)[0, 1] / middle[1] - 1.0)
            )
            if q is POSTURE:
                check = float(middle[2])
        return Predicted(table=frozen(table), drops=tuple(drops), rises=tuple(rises), check=check)


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Predicted:
    """The 20 numbers of Section V, or the 15 of Table II alone.

    Attributes:
        table: Table II (5, 3) [N/m].
        drops: Reductions of Fig. 12 (2,) [-], or empty.
        rises: Increments of Fig. 13 (2,) [-], or empty.
        check: Stiffness in z of Section V-B [N/m], or None.
    """

    table: Array
    drops: tuple[float, ...] = ()
    rises: tuple[float, ...] = ()
    check: float | None = None

    def residuals(self, table: Array) -> Array:
        """Compute residuals (20,) [-], or (15,) for Table II alone; ``table`` is (5, 3) [N/m].

        They are ln(model/paper) for a stiffness, (model − paper)/paper for a drop or a rise.
        """
        of_table = np.log(self.table / table).ravel()
        if self.check is None:
            return np.asarray(of_table)
        return np.concatenate(
            [
                of_table,
                np.divide(self.drops, DROPS) - 1.0,
                np.divide(self.rises, RISES) - 1.0,
                [math.log(self.check / CHECK)],
            ]
        )


_EVEN = TENSIONS.tolist()
_TOUCH = math.tan(_LIMIT / 2.0)  # with a smaller disk ratio, disks touch before ±30°

_PARAMETERS: Final[dict[str, tuple[float, ...]]] = {
    # bounds, then starts: even tensions, uneven tensions, Table II alone
    "link_length": (0.03, 0.15, 0.031, 0.0305, 0.0305),
    "tool_length": (0.03, 0.3, 0.295, 0.295, 0.266),
    "hole_radius": (0.015, 0.05, 0.0495, 0.0495, 0.0268),
    "lead": (0.0, 0.5, 0.085, 0.062, 0.002),
    "link_mass": (0.05, 1.0, 0.98, 0.947, 0.41),
    "drive_stiffness": (1e5, 1e7, 9.5e6, 9.5e6, 9.5e6),
    "tension_offset": (0.0, 20.0, 17.5, 15.0, 6.45),
    "angle_1": (-_LIMIT, _LIMIT, -0.51, -0.505, -0.505),
    "angle_2": (-_LIMIT, _LIMIT, -0.51, 0.084, 0.084),
    "angle_3": (-_LIMIT, _LIMIT, 0.12, -0.1155, -0.1155),
    "spring_ratio": (5.0, 15.0, 8.0, 8.54, 8.54),
    "hybrid_tension": (3.0, 86.0, 3.5, 3.5, 3.5),
    "highest_hybrid_tension": (10.0, 86.0, 34.0, 34.0, 34.0),
    "disk_ratio": (_TOUCH, 1.0, _TOUCH, 0.275, 0.275),
    "level_2": (3.0, 40.0, _EVEN[1], 12.3, 11.6),
    "level_3": (3.0, 60.0, _EVEN[2], 18.4, 17.7),
    "level_4": (3.0, 86.0, _EVEN[3], 43.8, 47.9),
    "weight_x": (0.0, 20.0, 0.0, 0.0, 8.0),
    "weight_y": (0.0, 20.0, 0.0, 0.0, 8.0),
    "weight_z": (0.0, 20.0, 0.0, 0.0, 7.0),
}

BOUNDS: Final = {name: (low, high) for name, (low, high, *_) in _PARAMETERS.items()}
"""Plausible range of each parameter, in SI units. Tensions end at 86 N, as in Table II."""

START, UNEVEN_START, TABLE_START = (
    Prototype(**{name: row[column] for name, row in _PARAMETERS.items()}) for column in (2, 3, 4)
)
"""Starts near the results of searches over all of :data:`BOUNDS`. They keep the search short."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Step:
    """One reading of Section V.

    Attributes:
        label: Name in tables and figures.
        table: Table II (5, 3) [N/m], as printed or with exchanged entries.
        free: Names of the searched parameters.
        start: Start of the search. Parameters that are not free keep these values.
        table_alone: Whether only Table II counts, without Figs. 12, 13 and Section V-B.
    """

    label: str
    table: Array
    free: tuple[str, ...]
    start: Prototype
    table_alone: bool = False

    @property
    def numbers(self) -> tuple[str, ...]:
        """Names of the numbers to explain."""
        return NAMES[: TABLE_II.size] if self.table_alone else NAMES

    @property
    def count(self) -> str:
        """Count of free parameters and of numbers, as text."""
        return f"{len(self.free)} free parameters for {len(self.numbers)} numbers"


_DIMENSIONS = tuple(BOUNDS)[:13]
_LEVELS = ("disk_ratio", "level_2", "level_3", "level_4")
_WEIGHTS = ("weight_x", "weight_y", "weight_z")

STEPS: Final = (
    Step(label="as printed", table=TABLE_II, free=_DIMENSIONS, start=START),
    Step(
        label="x and y exchanged in rows 2 to 4",
        table=TABLE_II_SWAPPED,
        free=_DIMENSIONS,
        start=START,
    ),
    Step(
        label="exchanged, uneven tensions",
        table=TABLE_II_SWAPPED,
        free=_DIMENSIONS + _LEVELS,
        start=UNEVEN_START,
    ),
    Step(
        label="Table II alone, exchanged, uneven tensions, finite weights",
        table=TABLE_II_SWAPPED,
        free=_DIMENSIONS[:7] + _LEVELS + _WEIGHTS,
        start=TABLE_START,
        table_alone=True,
    ),
)
"""Readings of Section V. Each has more freedom than the one before. A good fit proves none."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class PrototypeFit:
    """The prototype that explains the numbers best, with its residuals.

    Attributes:
        step: Reading of Section V.
        prototype: Identified parameters.
        predicted: Numbers of Section V for the identified prototype.
        residuals: Residuals of :meth:`Predicted.residuals`, in the order of ``step.numbers``.
        at_bound: Names of searched parameters at a bound; the best value may lie beyond it.
    """

    step: Step
    prototype: Prototype
    predicted: Predicted
    residuals: Array
    at_bound: tuple[str, ...]

    @property
    def cost(self) -> float:
        """Sum of the squared residuals [-]."""
        return float(self.residuals @ self.residuals)

    @property
    def misfit(self) -> Array:
        """Root mean square of ln(model/paper) over the columns of Table II (3,) [-]."""
        table = self.residuals[: TABLE_II.size].reshape(TABLE_II.shape)
        return np.asarray(np.sqrt(np.mean(table**2, axis=0)))


def identify_prototype(step: Step) -> PrototypeFit:
    """Find the free parameters of a step within :data:`BOUNDS` that minimise Σ r².

    Raises:
        InvalidInput: The start is out of bounds, or its arm has no stable equilibrium.
    """
    bounds = {name: BOUNDS[name] for name in step.free}

    def residuals(values: dict[str, float]) -> Array:
        try:
            return replace(step.start, **values).predict(step.table_alone).residuals(step.table)
        except CdsmError as error:
            raise NoModelError(str(error)) from error

    problem = LeastSquares(residuals, len(step.numbers), bounds)
    start = np.array([getattr(step.start, name) for name in bounds])
    if not ((problem.box.low < start) & (start < problem.box.high)).all():
        raise InvalidInput("start", f"{step.start} is not within {bounds}.")
    point = problem.box.point(start)
    if problem.failure(point) is not None:
        raise InvalidInput("start", f"{step.start} cannot hold itself. Start elsewhere.")
    # the step of the finite differences is large against rounding errors of the weight tests
    point = least_squares(
        problem.residuals,
        point,
        bounds=(0.0, 1.0),
        diff_step=1e-5,
        ftol=1e-6,
        xtol=1e-5,
        max_nfev=60,
    ).x
    prototype = replace(step.start, **problem.parameters(point))
    predicted = prototype.predict(step.table_alone)
    at_bound = (point < _NEAR) | (point > 1.0 - _NEAR)
    return PrototypeFit(
        step=step,
        prototype=prototype,
        predicted=predicted,
        residuals=frozen(predicted.residuals(step.table)),
        at_bound=tuple(name for name, on in zip(bounds, at_bound, strict=True) if on),
    )


_NEAR = 0.02
"""A parameter is at a bound if it is this near, as a fraction of its range."""
