"""Loops of a weight test: forces, readings of the tip, and statistical weights of the readings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from cdsm.errors import InvalidInput
from cdsm.identification.measurement import Measurement, checked_conditions
from cdsm.manipulator import Manipulator
from cdsm.statics.loading_path import LoadingPath
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
        force_std: Standard deviation of a force [N].
        tension: Cable tensions (C,) [N] before the first force. Give ``tension`` or ``minimum``.
        minimum: Lower bound of the tensions [N], one number or (C,).
            :func:`~cdsm.distribute_tension` then balances the model at these angles.
        tension_std: Standard deviation of each tension [N], the same error over the whole loop.
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
    force_std: float = 0.0
    tension: tuple[float, ...] | None = None
    minimum: float | tuple[float, ...] | None = None
    tension_std: float = 0.0
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
        for name in ("displacement_std", "force_std", "tension_std"):
            least = SMALLEST if name == "displacement_std" else 0.0
            std = checked[name] = scalar(name, getattr(self, name))
            if std < least:
                needed = "positive" if least else "positive, or 0"
                raise InvalidInput(name, f"{std:g} given; a standard deviation is {needed}.")
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
            random: Generator of random errors of readings, forces and tensions, or its seed. None:
                without errors.

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
            tension = distribute_tension(pose, self.minimum, wrench=wrench).values.copy()
        else:
            tension = np.array(self.tension)
        forces, read = np.array(self.forces), np.zeros(len(self.forces))
        if random is not None:
            tension += self.tension_std * random.normal(size=tension.size)
            forces += self.force_std * random.normal(size=forces.size)
            read += self.displacement_std * random.normal(size=forces.size)
        tips = LoadingPath.of(pose, tension, wrench, np.outer(forces, self._unit)).tips
        read += (tips - pose.tip[:3, 3]) @ self._unit
        return replace(self, displacements=tuple(read.tolist()))


def measured(measurement: Measurement | WeightLoop) -> Array:
    """Return the measured numbers: a stiffness (1,) [N/m], or the readings of a loop (m,) [m]."""
    if isinstance(measurement, WeightLoop):
        return np.array(measurement.displacements).ravel()
    return np.array([measurement.value])


class Weights:
    """Statistical weights of the m readings of a loop; each axis has an unknown offset.

    e (m,) are the errors, predicted − measured, and V (m, m) is their covariance. The matrix Z (m,
    k) adds the offsets z (k,) of the k axes to the readings. χ² is the least value of (e + Z z)ᵀ
    V⁻¹ (e + Z z) over all z. With the matrix R of these weights, χ² = |R e|². An entry of R e is
    the residual of one reading, in standard deviations.

    Attributes:
        root: R (m, m) [1/m], symmetric; the readings are sorted by force, then axis.
        zero: Matrix (k, m) that gives the best offsets from the errors: z = −``zero`` e.
    """

    def __init__(
        self, loop: WeightLoop, by_forces: Array | None = None, by_tensions: Array | None = None
    ) -> None:
        """Compute the weights from the standard deviations of the loop.

        ``by_forces`` (m, n) and ``by_tensions`` (m, C) [m/N] are the derivatives of the readings
        with respect to the n forces and C tensions. The errors of forces or tensions are ignored if
        their derivatives are None.
        """
        axes = len(loop.axes)
        covariance = loop.displacement_std**2 * np.eye(len(loop.forces) * axes)
        for slope, std in (by_forces, loop.force_std), (by_tensions, loop.tension_std):
            if slope is not None:
                covariance += std**2 * slope @ slope.T
        inverse = np.linalg.inv(covariance)
        zeros = np.tile(np.eye(axes), (len(covariance) // axes, 1))
        normal = zeros.T @ inverse
        self.zero = np.linalg.solve(normal @ zeros, normal)
        values, vectors = np.linalg.eigh(inverse - normal.T @ self.zero)
        values[:axes] = 0.0  # eigenvalues of the offsets, zero but for rounding
        self.root = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T


def up_and_down(weight: float, steps: int) -> tuple[float, ...]:
    """Return the forces [N] of a loop: from 0 to ``weight`` in equal ``steps``, and back."""
    return tuple(weight * k / steps for k in (*range(steps + 1), *range(steps - 1, -1, -1)))
