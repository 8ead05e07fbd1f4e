"""Posture and stiffness at many joint angles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.batch import layout
from cdsm.batch.distribution import Distributor, Tensions
from cdsm.batch.evaluator import Evaluator
from cdsm.batch.inputs import checked_threads, given_tension, given_wrench, postures, run_slices
from cdsm.batch.layout import QUANTITIES, Codes, Flags
from cdsm.errors import InvalidInput, UnknownName
from cdsm.manipulator import Manipulator
from cdsm.support.status import summary
from cdsm.support.validation import (
    Array,
    ReadOnlyState,
    frozen,
    instance,
    one_of,
    unit_directions,
)
from cdsm.tension import checked_bounds

OUTPUTS = (*QUANTITIES, "tension")
"""Names of the quantities that :func:`evaluate` computes."""

DEFAULT_OUTPUTS = ("tip", "compliance", "margin")
"""Where the tip is, what it does under load, and whether the arm is stable."""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Batch(ReadOnlyState):
    """Quantities at many postures, row by row: ``batch["joint"]`` is K_θ (B, nv, nv).

    A quantity has the name, shape and unit it has in :class:`~cdsm.Posture` and
    :class:`~cdsm.Stiffness`, with one more axis in front; what does not exist is NaN,
    and :attr:`status` says why.

    Attributes:
        arm: The arm.
        q: Joint angles (B, nv) [rad].
        tension: Tensions given, (C,) for all or (B, C) [N]; None if none were.
        wrench: W (6,) for all, or (B, 6): force [N], then moment [N m].
        minimum: Lower bounds for which tensions were distributed, (C,) for all or (B, C) [N]; or
            None.
        maximum: Upper bounds, likewise (C,) or (B, C) [N].
        direction: Unit direction (3,) of ``along``, or several (D, 3); or None.
        status: A :class:`Status` for each row, (B,).
        outputs: Names of the quantities, as asked for.
        values: The quantities themselves, (B, …) each, in SI units: [m], [N], [rad].
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

    def __getitem__(self, name: str) -> Array:
        """A quantity by name, (B, …), any shape, in the unit it has for one posture.

        Raises:
            UnknownName: It was not asked for.
        """
        if name not in self.outputs:
            raise UnknownName("output", name, self.outputs, "Name it in outputs=.")
        return self.values[self.outputs.index(name)]

    @cached_property
    def ok(self) -> Flags:
        """Where everything asked for exists, (B,)."""
        return frozen(self.status == layout.OK)

    def __len__(self) -> int:
        return len(self.q)

    def __repr__(self) -> str:
        return f"<Batch of {self.arm.name}, {summary(self.status)}>"

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
    wrench: ArrayLike | None = None,
    outputs: Sequence[str] = DEFAULT_OUTPUTS,
    *,
    direction: ArrayLike | None = None,
    minimum: ArrayLike | None = None,
    maximum: ArrayLike | None = None,
    check_limits: bool = True,
    threads: int | None = None,
) -> Batch:
    """Evaluate Posture and Stiffness of an arm at many postures, in microseconds each.

    Rows that cannot be evaluated raise no error; their :attr:`Batch.status` says why.

    Args:
        arm: The arm.
        q: Joint angles (B, nv) [rad], a row for each posture.
        tension: F (C,) for all rows or (B, C) [N], not negative, or the answer of
            :func:`distribute_tensions` at these postures. Only left out if ``minimum`` is given, or
            if no output depends on it.
        wrench: W (6,) for all rows or (B, 6) at ``tool0`` in base axes: force [N], then moment
            [N m]; zero if not given. Belongs to tensions of your own, and to ``minimum``.
        outputs: Names of the wanted quantities; no others are stored. Of a posture ``"tip"``,
            ``"jacobian"``, ``"cable_lengths"``, ``"length_jacobian"``, ``"gravity_torque"``; of a
            stiffness ``"active"``, ``"passive"``, ``"gravity"``, ``"load"``, ``"joint"``,
            ``"cable_stiffness"``, ``"residual"``, ``"margin"``, ``"compliance"``, ``"cartesian"``,
            ``"along"``, ``"pseudoinverse"``; and ``"tension"``.
        direction: u (3,) of ``"along"``, any length, or several (D, 3) for an answer (B, D).
        minimum: Distribute the tensions: their lower bounds [N], as in
            :func:`distribute_tensions`.
        maximum: Their upper bounds [N]; none if not given.
        check_limits: Pass over angles beyond the joint limits.
        threads: How many at most; by default as many as there are cores. An elasticity of your own
            is called from all of them.

    Raises:
        InvalidInput: Something has the wrong shape or is not a number, a tension is negative, two
            arguments contradict each other or one is missing; or an elasticity of the user's own
            gives no positive rigidity.
        UnknownName: An output of no such name.
    """
    instance("arm", arm, Manipulator)
    names = _checked_outputs(outputs)
    angles = postures(arm, q)
    rows = len(angles)
    if (direction is None) == ("along" in names):
        raise InvalidInput("direction", "belongs to the output 'along': give both, or neither.")
    given, loads, status = _checked_load(arm, angles, tension, wrench)
    low = high = distributor = None
    if minimum is not None:
        if given is not None:
            raise InvalidInput("minimum", "give tension= or minimum=, not both.")
        low, high = checked_bounds(arm, minimum, math.inf if maximum is None else maximum, rows)
        distributor = Distributor(arm, angles, low, high, loads, check_limits)
    elif maximum is not None:
        raise InvalidInput("maximum", "belongs to minimum=: give that too.")
    needy = [name for name in names if name not in QUANTITIES[: layout.RESIDUAL]]
    if needy and given is None and minimum is None:
        raise InvalidInput(
            "tension",
            f"{needy[0]!r} depends on it: give tension=, or minimum= to have it distributed.",
        )
    if not needy:
        status[:] = layout.OK
    u = None if direction is None else unit_directions("direction", direction)
    evaluator = Evaluator(
        arm, angles, given, loads, u, names, distributor if needy else None, check_limits
    )
    run_slices(
        lambda part: evaluator.fill(part, status), rows, evaluator.width, checked_threads(threads)
    )
    return Batch(
        arm=arm,
        q=angles,
        tension=given,
        wrench=loads,
        minimum=low,
        maximum=high,
        direction=u,
        status=frozen(status),
        outputs=names,
        values=tuple(frozen(value) for value in evaluator.values),
    )


def _checked_outputs(outputs: Sequence[str]) -> tuple[str, ...]:
    if not isinstance(outputs, (list, tuple)):
        raise InvalidInput("outputs", f"{outputs!r} given; a list or tuple of names is needed.")
    names = tuple(one_of("output", name, OUTPUTS) for name in outputs)
    for name in names:
        if names.count(name) > 1:
            raise InvalidInput("outputs", f"{name!r} is named twice.")
    return names


def _checked_load(
    arm: Manipulator, q: Array, tension: Tensions | ArrayLike | None, wrench: ArrayLike | None
) -> tuple[Array | None, Array, Codes]:
    """Tensions, wrench and what is known of the rows before they are evaluated."""
    if not isinstance(tension, Tensions):
        given = None if tension is None else given_tension(arm, tension, len(q))
        return given, given_wrench(wrench, len(q)), np.zeros(len(q), dtype=np.uint8)
    if tension.arm != arm or not np.array_equal(tension.q, q):
        raise InvalidInput("tension", "was distributed at other postures; do it at these.")
    if wrench is not None:
        raise InvalidInput("wrench", "comes with the Tensions; leave it out here.")
    return tension.values, tension.wrench, tension.status.copy()
