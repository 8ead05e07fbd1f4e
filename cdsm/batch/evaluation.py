"""Evaluation of posture and stiffness at many joint angles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.batch.applied_rows import RowLoads
from cdsm.batch.distribution import (
    RowsOfLoads,
    Tensions,
    check_load_rows,
    check_tension_rows,
    checked_threads,
    postures,
)
from cdsm.batch.quantities import Codes, OfPostures
from cdsm.batch.rows import Rows
from cdsm.batch.solution import solve_rows
from cdsm.errors import InvalidInput, unknown
from cdsm.manipulator import ANOTHER_ARM, Manipulator
from cdsm.quantities import QUANTITIES, require_name
from cdsm.support.format import coordinates
from cdsm.support.status import summary
from cdsm.support.validation import Direction, flag, instance, unit_directions
from cdsm.support.values import Array, IndexedByName, frozen
from cdsm.tension import checked_bounds

DEFAULT_OUTPUTS = ("tip", "compliance", "margin")
"""Default outputs: pose of the tip, its compliance, and the stability margin."""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Batch(OfPostures, IndexedByName):
    """Quantities at B postures: ``batch["joint"]`` is `K_θ` (B, nv, nv); ``len(batch)`` is B.

    The keys are the names in :attr:`outputs`; ``"joint" in batch``, ``list(batch)`` and
    ``dict(batch)`` use them too. Names, shapes and units are as in :class:`~cdsm.Posture` and
    :class:`~cdsm.Stiffness`, with the posture as an additional first axis. A quantity that does not
    exist is NaN; :attr:`status` says why. A batch has no ``plot``, since its rows have no order.
    Plot the table of :meth:`to_pandas`, or compute a :func:`~cdsm.sweep` and plot it with
    :func:`cdsm.plots.plot_map`.

    Attributes:
        arm: The arm.
        q: Joint angles (B, nv) [rad].
        tension: Given tensions, (C,) for all postures or (B, C) [N]; None if not given.
        wrench: W (6,) at the tip for all postures, or (B, 6): force [N], then moment [N m].
        minimum: Lower bounds (C,) for all postures or (B, C) [N]; None if F was not distributed.
        maximum: Upper bounds (C,) for all postures or (B, C) [N], or None.
        direction: Unit direction (3,) of ``along``, or several (D, 3); or None.
        status: :class:`Status` of each posture (B,).
        outputs: Names of the requested quantities.
        values: The requested quantities, (B, …) each, in the order of ``outputs``, in SI units such
            as [m], [N] and [rad].
        loads: Loads on links; None if there are none.
    """

    arm: Manipulator
    q: Array
    tension: Array | None
    wrench: Array
    minimum: Array | None
    maximum: Array | None
    direction: Array | None
    status: Codes
    outputs: tuple[str, ...]
    values: tuple[Array, ...]
    loads: RowLoads | None = None

    def __getitem__(self, name: str) -> Array:
        """Return a quantity by name, (B, …), in the unit that it has for one posture.

        Raises:
            InvalidInput: The quantity was not requested in ``outputs``.
        """
        if name not in self.outputs:
            raise unknown("output", name, self.outputs, "Name it in outputs=.")
        return self.values[self.outputs.index(name)]

    def keys(self) -> tuple[str, ...]:
        """Return the names of the quantities, :attr:`outputs`."""
        return self.outputs

    @property
    def by_name(self) -> dict[str, Array]:
        """The quantities by name, (B, …) each."""
        return dict(zip(self.outputs, self.values, strict=True))

    def _labels(self) -> dict[str, Sequence[object]]:
        u = np.zeros((0, 3)) if self.direction is None else self.direction.reshape(-1, 3)
        return {**super()._labels(), "direction": tuple(map(coordinates, u))}

    def __str__(self) -> str:
        lines = [summary(self.status)]
        lines += [
            f"{name:<16}{value.shape!s:>20}"
            for name, value in zip(self.outputs, self.values, strict=True)
        ]
        return "\n".join(lines)


def evaluate(
    arm: Manipulator,
    q: ArrayLike,
    tension: Tensions | ArrayLike | None = None,
    wrench: RowsOfLoads | None = None,
    outputs: Sequence[str] = DEFAULT_OUTPUTS,
    *,
    direction: Direction | Sequence[Direction] | None = None,
    minimum: ArrayLike | None = None,
    maximum: ArrayLike | None = None,
    check_limits: bool = True,
    threads: int | None = None,
) -> Batch:
    """Compute tip, stiffness and other quantities at B postures.

    A row takes some 50 µs by numpy, and less than 10 µs by compiled kernels, which are used once
    they pay; ``python -m cdsm.batch`` compiles them ahead.
    A posture that cannot be evaluated raises no error; its :attr:`Batch.status` says why.

    Args:
        arm: The arm.
        q: Joint angles (B, nv) [rad], a row for each posture.
        tension: F (C,) for all postures or (B, C) [N], not negative, or the result of
            :func:`distribute_tensions` at these postures. Omit it if ``minimum`` is given or no
            output depends on tensions.
        wrench: W (6,) for all postures or (B, 6) at ``tool0`` in base axes: force [N], then moment
            [N m]; zero if not given. Or loads on any links: a dict of such wrenches by link, or a
            list of :class:`~cdsm.Load`. Omit it if ``tension`` is a result of
            :func:`distribute_tensions`, which contains it.
        outputs: Names of the quantities to store. Of a posture: ``"tip"``, ``"jacobian"``,
            ``"cable_lengths"``, ``"length_jacobian"``, ``"gravity_torque"``. Of a stiffness:
            ``"active"``, ``"passive"``, ``"gravity"``, ``"load"``, ``"springs"``, ``"joint"``,
            ``"cable_stiffness"``, ``"residual"``, ``"margin"``, ``"compliance"``, ``"cartesian"``,
            ``"along"``, ``"slack"`` (a boolean), ``"pseudoinverse"``. The tensions: ``"tension"``.
        direction: u of ``"along"``: an axis such as ``"z"``, or (3,), any length. For several
            directions (D, 3) the output is (B, D).
        minimum: Lower bounds [N] of the tensions, as for :func:`distribute_tensions`; tensions are
            then distributed first.
        maximum: Upper bounds [N] of these tensions; no bounds if not given.
        check_limits: Skip postures beyond the joint limits; their status is ``BEYOND_LIMITS``.
        threads: Maximum number of threads; by default one for each core.

    Raises:
        InvalidInput: An argument has the wrong shape or is not a number; a tension is negative; or
            two arguments contradict each other or one is missing. An output does not exist.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype()
        >>> angles = [[0.0] * 10, [0.1] * 10]
        >>> batch = cdsm.evaluate(arm, angles, outputs=["along"], direction="z", minimum=5.0)
        >>> (1e-3 * batch["along"]).round(3).tolist()  # N/mm
        [1.817, 2.105]
    """
    instance("arm", arm, Manipulator)
    names = _checked_outputs(outputs)
    angles = postures(arm, q)
    rows = len(angles)
    if (direction is None) != ("along" not in names):
        raise InvalidInput("direction", "belongs to the output along: give both, or neither.")
    F, at_tip, loads, lost = _checked_load(arm, angles, tension, wrench)
    bounds = None
    if minimum is not None:
        if F is not None:
            raise InvalidInput("minimum", "give tension= or minimum=, not both.")
        bounds = checked_bounds(arm, minimum, math.inf if maximum is None else maximum, rows)
    elif maximum is not None:
        raise InvalidInput("maximum", "belongs to minimum=: give that too.")
    needy = [name for name in names if QUANTITIES[name].needs != "posture"]
    if needy and F is None and minimum is None:
        raise InvalidInput(
            "tension",
            f"{needy[0]!r} depends on it: give tension=, or minimum= to have it distributed.",
        )
    u = None if direction is None else unit_directions("direction", direction)
    asked = Rows(
        arm=arm,
        q=angles,
        wrench=np.atleast_2d(at_tip),
        loads=loads,
        names=names,
        tension=None if F is None else np.atleast_2d(F),
        bounds=(np.atleast_2d(bounds[0]), np.atleast_2d(bounds[1])) if bounds and needy else None,
        directions=np.zeros((0, 3)) if u is None else u.reshape(-1, 3),
        check_limits=flag("check_limits", check_limits),
        status=lost if needy else None,
    )
    solved, status = solve_rows(asked, checked_threads(threads))
    if u is not None and u.ndim == 1:
        solved["along"] = solved["along"][:, 0]
    return Batch(
        arm=arm,
        q=angles,
        tension=F,
        wrench=at_tip,
        loads=loads,
        minimum=None if bounds is None else bounds[0],
        maximum=None if bounds is None else bounds[1],
        direction=u,
        status=frozen(status),
        outputs=names,
        values=tuple(frozen(solved[name]) for name in names),
    )


def _checked_outputs(outputs: Sequence[str]) -> tuple[str, ...]:
    if not isinstance(outputs, (list, tuple)):
        raise InvalidInput("outputs", f"{outputs!r} given; a list or tuple of names is needed.")
    names = tuple(require_name("output", name, "batch") for name in outputs)
    for name in names:
        if names.count(name) > 1:
            raise InvalidInput("outputs", f"{name!r} is named twice.")
    return names


def _checked_load(
    arm: Manipulator, q: Array, tension: Tensions | ArrayLike | None, wrench: RowsOfLoads | None
) -> tuple[Array | None, Array, RowLoads | None, Codes | None]:
    """Return checked tensions (None if not given), wrench and loads, and the tensions' status."""
    if not isinstance(tension, Tensions):
        F = None if tension is None else check_tension_rows(arm, tension, len(q))
        return F, *check_load_rows(arm, wrench, len(q)), None
    if not np.array_equal(tension.q, q):
        raise InvalidInput("tension", "was distributed at other postures; distribute it at these.")
    if tension.arm != arm:
        raise InvalidInput("tension", f"was distributed for {ANOTHER_ARM}")
    if wrench is not None:
        raise InvalidInput("wrench", "comes with the Tensions; leave it out here.")
    return tension.values, tension.wrench, tension.loads, tension.status
