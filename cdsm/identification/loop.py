"""Loops of a weight test: forces, and readings of the tip."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from cdsm.errors import InvalidInput
from cdsm.identification.measurement import Measurement, checked_conditions
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.statics.load_cycle import load_cycle
from cdsm.support.directions import Axis, unit_direction
from cdsm.support.validation import SMALLEST, instance, number_array, scalar, whole_number
from cdsm.support.values import Array
from cdsm.tension import distribute_tension


@final
@dataclass(frozen=True, kw_only=True)
class WeightLoop:
    """Loop of a weight test: forces applied and removed again, and readings of the tip.

    The arm is shaken at the posture, so that each cable has one tension along its length, and its
    motors are locked. Then the forces act one after the other, as in :func:`~cdsm.load_cycle`. A
    reading is the position of the tip along the direction, or in x, y and z, from an arbitrary
    zero.

    Attributes:
        direction: Direction of the forces: an axis such as ``"-z"``, kept as its vector, or (3,) in
            base axes, any length.
        angles: Joint angles (nv,) [rad] before the first force.
        forces: Forces along the direction (n,) [N], in their order; 0 where nothing hangs.
        displacements: Readings (n,) along the direction or (n, 3) in base axes [m]; None if the
            test is only planned.
        displacement_std: Standard deviation of a reading [m].
        tension: Cable tensions (C,) [N] before the first force. Give ``tension`` or ``minimum``.
        minimum: Lower bound of the tensions [N], one number or (C,).
            :func:`~cdsm.distribute_tension` then balances the model at these angles.
        wrench: W (6,) at ``tool0`` without the forces, base axes: force [N], moment [N m].
        label: Name in reports and figures.

    Raises:
        InvalidInput: A field is invalid, or all forces are the same. The error names the field and
            the fault.
    """

    direction: tuple[float, float, float] | Axis
    angles: tuple[float, ...]
    forces: tuple[float, ...]
    displacements: tuple[float, ...] | tuple[tuple[float, float, float], ...] | None = None
    displacement_std: float
    tension: tuple[float, ...] | None = None
    minimum: float | tuple[float, ...] | None = None
    wrench: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    label: str = ""

    def __post_init__(self) -> None:
        forces = number_array("forces", self.forces, "force")
        if forces.ndim != 1 or forces.size < 2 or np.ptp(forces) == 0.0:
            raise InvalidInput(
                "forces",
                f"{self.forces!r} given; a loop needs forces of at least two sizes, one after the "
                "other, as 0, 2, 4, 2, 0 N: only differences of readings are used.",
            )
        checked: dict[str, object] = checked_conditions(self) | {"forces": tuple(forces.tolist())}
        if self.displacements is not None:
            read = number_array("displacements", self.displacements, "length")
            if read.shape not in ((forces.size,), (forces.size, 3)):
                raise InvalidInput(
                    "displacements",
                    f"shape {read.shape} given; one reading [m] per force is needed, "
                    f"({forces.size},) along the direction or ({forces.size}, 3) in base axes.",
                )
            rows = read.tolist()
            checked["displacements"] = tuple(rows if read.ndim == 1 else map(tuple, rows))
        std = checked["displacement_std"] = scalar("displacement_std", self.displacement_std)
        if std < SMALLEST:
            raise InvalidInput("displacement_std", f"{std:g} m given; it must be positive.")
        for name, entry in checked.items():
            object.__setattr__(self, name, entry)

    @property
    def axes(self) -> Array:
        """Unit vectors along which the tip is read: the direction (1, 3), or x, y and z (3, 3)."""
        alone = self.displacements is None or np.ndim(self.displacements) == 1
        return self._unit[None] if alone else np.eye(3)

    @property
    def informative(self) -> int:
        """Number of independent readings; each axis has one less, since its zero is unknown."""
        return (len(self.forces) - 1) * len(self.axes)

    @property
    def applied(self) -> Array:
        """Applied forces as vectors (n, 3) [N] in base axes."""
        return np.outer(self.forces, self._unit)

    @property
    def _unit(self) -> Array:
        return unit_direction("direction", self.direction)

    def simulated(
        self, arm: Manipulator, random: np.random.Generator | int | None = None
    ) -> WeightLoop:
        """Return the same loop with simulated readings (n,) [m] of an arm, along the direction.

        Args:
            arm: The arm, with friction in its holes.
            random: Generator of the random errors of the readings, or its seed. None: without
                errors.

        Raises:
            InvalidInput: ``random`` is neither of these, or ``arm`` is not an arm.
            CdsmError: The arm has no equilibrium under the forces; see :func:`~cdsm.load_cycle`.
        """
        instance("arm", arm, Manipulator)
        if not isinstance(random, np.random.Generator | None):
            random = np.random.default_rng(whole_number("random", random, 0))
        pose, wrench = arm.at(self.angles), np.array(self.wrench)
        if self.tension is None:
            assert self.minimum is not None
            tension = distribute_tension(pose, self.minimum, wrench=wrench).values
        else:
            tension = np.array(self.tension)
        read = tips(pose, tension, wrench, self.applied) @ self._unit
        if random is not None:
            read += self.displacement_std * random.normal(size=read.size)
        return replace(self, displacements=tuple(read.tolist()))


def tips(pose: Posture, tension: Array, wrench: Array, forces: Array) -> Array:
    """Compute how far ``forces`` (n, 3) [N], one after the other, move the tip (n, 3) [m].

    ``pose``, ``tension`` (C,) [N] and ``wrench`` (6,) are those before the first force.
    """
    path = wrench + np.pad(forces, ((1, 0), (0, 3)))
    return load_cycle(pose, tension, path, substeps=2).displacement[1:]


def measured(measurement: Measurement | WeightLoop) -> Array:
    """Return the measured numbers: a stiffness (1,) [N/m], or the readings of a loop (m,) [m]."""
    if isinstance(measurement, WeightLoop):
        return np.array(measurement.displacements).ravel()
    return np.array([measurement.value])


def offset(loop: WeightLoop, predicted: Array) -> Array:
    """Return predictions minus readings of a loop, averaged over each axis, (m,) [m].

    The zero of each axis is unknown, and this estimate of it has the least χ².
    """
    error = (predicted - measured(loop)).reshape(len(loop.forces), -1)
    return np.tile(error.mean(axis=0), len(loop.forces))


def up_and_down(weight: float, steps: int) -> tuple[float, ...]:
    """Return the forces [N] of a loop: from 0 to ``weight`` in equal ``steps``, and back."""
    return tuple(weight * k / steps for k in (*range(steps + 1), *range(steps - 1, -1, -1)))
