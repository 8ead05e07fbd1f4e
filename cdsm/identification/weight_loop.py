"""A loop of a weight test: forces applied and removed again, and what the tip did."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.applied import Applied, combined, load_at, position_at
from cdsm.dead_loads import Load
from cdsm.errors import InvalidInput
from cdsm.identification.measurement import keep, tension_before
from cdsm.loads import has_loads, link_point, loads_of
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.statics.equilibrium import equilibrium
from cdsm.statics.load_cycle import follow_loads
from cdsm.statics.quasi_static import EquilibriumPath
from cdsm.support.validation import (
    Axis,
    instance,
    number_array,
    positive,
    unit_direction,
    whole_number,
)
from cdsm.support.values import Array
from cdsm.tension import Tension

_SUBSTEPS = 2  # of load_cycle; fixed, so that predictions are smooth functions of parameters


@final
@dataclass(frozen=True, kw_only=True)
class WeightLoop:
    """Loop of a weight test: forces applied and removed again, and readings of the tip.

    The arm is shaken at the posture, so that each cable has one tension along its length, and its
    motors are locked. Then the forces act one after the other, as in :func:`~cdsm.load_cycle`. A
    reading is the position of the tip along the direction, or in x, y and z, from an arbitrary
    zero; with a ``link``, the forces act there, and the reading is its position.

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
        wrench: W (6,) at ``tool0`` without the forces, base axes: force [N], moment [N m]. Or loads
            on links, as for :func:`~cdsm.distribute_tension`.
        label: Name in reports and figures.
        link: Link on which the forces act and that is read; None: the tip.
        point: Where on it (3,) [m], as for :class:`~cdsm.Load`.

    Raises:
        InvalidInput: A field is invalid, or all forces are the same. The error names the field and
            the fault.

    Example:
        >>> import cdsm
        >>> loop = cdsm.WeightLoop(
        ...     direction="z", angles=(0.1,) * 10, forces=(0.0, 2.0, 4.0, 2.0, 0.0),
        ...     displacements=(0.0, 0.9e-3, 1.9e-3, 1.1e-3, 0.2e-3),
        ...     displacement_std=2e-5, minimum=5.0,
        ... )
        >>> len(loop.forces)
        5
    """

    direction: tuple[float, float, float] | Axis
    angles: tuple[float, ...]
    forces: tuple[float, ...]
    displacements: tuple[float, ...] | tuple[tuple[float, float, float], ...] | None = None
    displacement_std: float
    tension: tuple[float, ...] | None = None
    minimum: float | tuple[float, ...] | None = None
    wrench: tuple[float, ...] | tuple[Load, ...] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    label: str = ""
    link: str | None = None
    point: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        forces = number_array("forces", self.forces, "force")
        read = None
        if forces.ndim != 1 or forces.size < 2 or np.ptp(forces) == 0.0:
            raise InvalidInput(
                "forces",
                f"{self.forces!r} given; a loop needs forces of at least two sizes, one after the "
                "other, as 0, 2, 4, 2, 0 N: only differences of readings are used.",
            )
        if self.displacements is not None:
            array = number_array("displacements", self.displacements, "length")
            n = forces.size
            if array.shape not in ((n,), (n, 3)):
                remedy = f"one reading [m] per force is needed, ({n},) along the direction or "
                remedy += f"({n}, 3) in base axes."
                raise InvalidInput("displacements", f"shape {array.shape} given; {remedy}")
            read = tuple(array.tolist() if array.ndim == 1 else map(tuple, array.tolist()))
        std = positive("displacement_std", self.displacement_std, "m")
        keep(self, forces=tuple(forces.tolist()), displacements=read, displacement_std=std)

    @property
    def axes(self) -> Array:
        """Unit vectors along which the tip is read: the direction (1, 3), or x, y and z (3, 3)."""
        alone = self.displacements is None or np.ndim(self.displacements) == 1
        return self._unit[None] if alone else np.eye(3)

    @property
    def applied(self) -> Array:
        """Applied forces as vectors (n, 3) [N] in base axes."""
        return np.outer(self.forces, self._unit)

    @property
    def _unit(self) -> Array:
        return unit_direction("direction", self.direction)

    @property
    def reading_suffixes(self) -> list[str]:
        """What follows the label in the name of each reading: the number of its force."""
        return [f" force {k + 1}" for k in range(len(self.forces)) for _ in self.axes]

    @property
    def readings(self) -> Array:
        """Displacements (n,) [m] along the direction; zeros of a planned test."""
        if self.displacements is None:
            return np.zeros(len(self.forces))  # of a planned test, any
        return np.array(self.displacements).ravel()

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
        pose = arm.at(self.angles)
        alone = replace(self, displacements=None)
        read = alone.predict(pose, tension_before(self, pose))
        if random is not None:
            read += self.displacement_std * random.normal(size=read.size)
        return replace(self, displacements=tuple(read.tolist()))

    def predict(self, pose: Posture, tension: Tension | ArrayLike) -> Array:
        """Compute how far the forces would move the tip of a model of the arm, (m,) [m]."""
        return self.follow(pose, tension)[0]

    def follow(
        self, pose: Posture, tension: Tension | ArrayLike, near: Sequence[EquilibriumPath] = ()
    ) -> tuple[Array, tuple[EquilibriumPath, ...]]:
        """Compute what ``predict`` does, and the path to each force, sought from paths ``near``.

        Without friction there are no paths.
        """
        F = tension.values if isinstance(tension, Tension) else tension
        at = link_point(pose.arm, self.link, self.point)
        before = loads_of(pose.arm, self.wrench)
        forces = np.pad(self.applied, ((0, 0), (0, 3)))
        loads = [combined(before, load_at(at, force)) for force in forces]
        paths: tuple[EquilibriumPath, ...] = ()
        if pose.arm.has_friction:
            history, paths = follow_loads(pose, F, _rows(loads), substeps=_SUBSTEPS, near=near)
            places = history.tip
            if at is not None:
                poses = [history.pose(k) for k in history.load.tolist()]
                places = np.array([at.position(there) for there in poses])
        else:  # the history has no influence, so each load is computed once
            _, first, which = np.unique(self.forces, return_index=True, return_inverse=True)
            rests = [equilibrium(pose, F, loads[k]).pose for k in first.tolist()]
            places = np.array([position_at(rest, at) for rest in rests])[which]
        moved = places - position_at(pose, at)
        return np.asarray(moved @ self.axes.T).ravel(), paths

    def errors(self, predicted: Array) -> tuple[Array, float]:
        """Return errors less their mean along each axis (the unknown zero of least χ²), and σ."""
        off = (predicted - self.readings).reshape(len(self.forces), -1)
        return (off - off.mean(axis=0)).ravel(), self.displacement_std

    def described(self, measured: Array, predicted: Array) -> list[str]:
        """Return the number of readings, and how far predictions are off, as texts."""
        rms = 1e6 * np.sqrt(np.mean((predicted - measured) ** 2))
        return [f"{measured.size} readings", f"off by {rms:.3g} µm rms"]


def _rows(loads: list[Applied]) -> ArrayLike | list[Applied]:
    """Return loads as wrenches (n, 6) if all act at the tip alone."""
    return loads if has_loads(loads) else np.array(loads)
