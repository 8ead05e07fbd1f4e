"""Measurands: numbers of an arm that have an uncertainty, such as its stiffness along a direction.

Arms with errors are rows of a batch (:mod:`cdsm.batch.solution`), each with its own dimensions.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike

from cdsm.batch.applied_rows import AppliedRows
from cdsm.batch.quantities import Codes, derive
from cdsm.batch.rows import Rows
from cdsm.batch.solution import solve_rows
from cdsm.errors import InvalidInput
from cdsm.loads import LoadsLike
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.quantities import QUANTITIES, Quantity, display_for, require_name
from cdsm.routing import Indices
from cdsm.status import Status
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.format import JointUnits, coordinates, largest_finite
from cdsm.support.validation import Direction, flag, unit_direction
from cdsm.support.values import Array, ReadOnlyState
from cdsm.tension import Tension, distribute_tension
from cdsm.tolerancing.inputs import Errors, Inputs, inputs_of
from cdsm.tolerancing.rebuilt import slopes_of


@dataclass(frozen=True, eq=False)
class Measurand(ReadOnlyState):
    """Number of an arm whose uncertainty is asked for.

    Attributes:
        of: Its kind; :func:`~cdsm.uncertainty` explains the names.
        stiffness: The stiffness of the arm without errors.
        direction: Unit direction (3,) of ``along`` and ``tip_along``; else None.
        cable: Index of the cable whose ``tension`` it is; None for all cables.
        redistribute: Whether each arm has its own least tensions; if not, they are measured.
    """

    of: str
    stiffness: Stiffness
    direction: Array | None = None
    cable: int | None = None
    redistribute: bool = False

    @property
    def inputs(self) -> Inputs:
        """Inputs of the arm."""
        return inputs_of(self.stiffness.posture.arm)

    @cached_property
    def unit(self) -> tuple[str, float]:
        """Unit in which people read the value, and its size in SI."""
        return self.quantity.shown or display_for(self.si_unit, largest_finite(self.value()))

    @property
    def quantity(self) -> Quantity:
        """Description of the quantity."""
        return QUANTITIES[self.of]

    @property
    def si_unit(self) -> str:
        """SI unit of the value."""
        return JointUnits(self.stiffness.posture.arm.slides).of(self.quantity.unit)

    @property
    def name(self) -> str:
        """Name as text, with the direction or the cable."""
        if self.direction is not None:
            return self.quantity.along(coordinates(self.direction))
        if self.cable is not None:
            return f"{self.quantity.words} of {self.stiffness.posture.arm.cables[self.cable].name}"
        return self.quantity.words

    def value(self) -> Array:
        """Return the value of the arm without errors (1,), or of each cable (C,), in SI."""
        K = self.stiffness
        if self.of == "tension":
            return K.tension if self.cable is None else K.tension[[self.cable]]
        if self.of == "along":
            return np.array([K.along(self._directions[0])])
        names = self.quantity.reads or (self.of,)
        values = {name: np.asarray(_attribute(K, name))[None] for name in names}
        return self._of(values).ravel()

    @property
    def _directions(self) -> Array:
        """The direction as rows (1, 3); (0, 3) without one."""
        return np.zeros((0, 3)) if self.direction is None else self.direction[None]

    def _of(self, values: dict[str, Array]) -> Array:
        """Return the quantity (N, …) from those of a batch."""
        if self.of in values:
            return values[self.of]
        return derive(self.of, values, self._directions)

    def of_arms(self, errors: Errors, threads: int = 1) -> tuple[Array, Codes]:
        """Compute the values (N, 1 or C) of N arms with ``errors``, and the status (N,) of each."""
        K = self.stiffness
        arm = self.stiffness.posture.arm
        count = len(next(iter(errors.values())))
        bounds = None
        status = np.zeros(count, dtype=np.uint8)
        none = np.zeros((count, 1))
        F = K.tension + errors.get("tension", none)
        if self.redistribute:
            assert K.distribution is not None
            held = K.distribution.minimum_held, K.distribution.maximum_held
            bounds = held[0][None], held[1][None]
        elif self.quantity.needs != "posture":  # cables only pull
            status[F.min(axis=1) < 0.0] = Status.OUTSIDE_ELASTICITY
        q = np.tile(K.posture.q, (count, 1))
        q[:, ~arm.slides] += errors.get("joint_angle", none)
        q[:, arm.slides] += errors.get("joint_position", none)
        acting = AppliedRows.of([K.applied])
        rows = Rows(
            arm=arm,
            q=q,
            wrench=acting.at_tip,
            loads=acting.loads,
            names=self.quantity.reads or (self.of,),
            tension=None if self.redistribute else F,
            bounds=bounds,
            directions=self._directions,
            body=self.inputs.bodies(errors, count),
            cable_stiffness=lambda L, F, part: self._springs(errors, L, F, part),
            check_limits=False,
            status=status,
        )
        quantities, status = solve_rows(rows, threads)
        numbers = self._of(quantities).reshape(count, -1)
        if self.of == "tension":
            numbers = numbers if self.cable is None else numbers[:, [self.cable]]
            return numbers + self._of_rebuilt(errors), status
        numbers = numbers + self._of_rebuilt(errors)
        status[~np.isfinite(numbers[:, 0]) & (status == Status.OK)] = Status.SINGULAR
        return numbers, status

    def of_arm(self, arm: Manipulator) -> Array:
        """Return the value of another ``arm``, at the posture and with the tensions of this one."""
        K = self.stiffness
        pose = arm.at(K.posture.q)
        tension: Tension | Array = K.tension
        if self.redistribute:
            assert K.distribution is not None
            bounds = K.distribution.minimum_held, K.distribution.maximum_held
            tension = distribute_tension(pose, *bounds, K.applied)
        wrench = None if self.redistribute else K.applied
        return replace(self, stiffness=stiffness(pose, tension, wrench)).value()

    def _of_rebuilt(self, errors: Errors) -> Array | float:
        """Return what errors of sources without a formula change (N, k), to first order."""
        rebuilt = [source for source in errors if source in self.inputs.rebuilt]
        return sum((errors[source] @ _slopes(self, source) for source in rebuilt), 0.0)

    def _springs(self, errors: Errors, L: Array, F: Array, part: slice | Indices) -> Array:
        """Return stiffness with errors of springs and EA; as EA rises, ε falls: EA ε stays."""
        laws = self.stiffness.posture.arm.laws
        change = errors["rigidity"][part] if "rigidity" in errors else 0.0
        stretched = laws.rigidities(F)
        EA = np.zeros_like(F)
        series = laws.series + 0.0 * F
        if "spring" in errors:
            series[:, laws.series > 0.0] /= 1.0 + errors["spring"][part]
        for law, of in laws.held:
            EA[:, of] = law.rigidity(np.clip(F[:, of], law.low, law.high))
        stretched = stretched + np.where(stretched > 0.0, change * EA, 0.0)
        return laws.stiffness_of(L, F, stretched, series)


@lru_cache(maxsize=16)
def _slopes(measurand: Measurand, source: str) -> Array:
    return slopes_of(measurand.stiffness.posture.arm, source, measurand.of_arm)


def measurand_of(
    pose: Posture,
    tension: Tension | ArrayLike,
    direction: Direction | None,
    of: str,
    cable: str | None,
    wrench: LoadsLike | None,
    redistribute: bool,
) -> Measurand:
    """Check the arguments of :func:`~cdsm.uncertainty`; return the measurand they describe."""
    require_name("measurand", of, "uncertainty")
    K = stiffness(pose, tension, wrench)
    for name, argument in {"direction": direction, "cable": cable}.items():
        is_needed = name in QUANTITIES[of].dims
        if (argument is not None) != is_needed:
            raise InvalidInput(name, f"{'is needed' if is_needed else 'has no meaning'} for {of}.")
    again = flag("redistribute", redistribute) or of == "tension"
    if again and not (isinstance(tension, Tension) and tension.least):
        raise InvalidInput("tension", "is distributed again: give a least Tension.")
    u = None if direction is None else unit_direction("direction", direction)
    index = None if cable is None else pose.arm.cables.number_of(cable)
    return Measurand(of, K, u, index, again)


def _attribute(K: Stiffness, name: str) -> Array | float:
    """Return a quantity of a stiffness or of its posture."""
    value: Array | float = getattr(K if hasattr(K, name) else K.posture, name)
    return value
