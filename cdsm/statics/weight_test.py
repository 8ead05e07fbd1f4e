"""Weight test of Section V: stiffness from the displacement under a weight (Eq. 20)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import ArrayLike

import cdsm
from cdsm.errors import InvalidInput
from cdsm.friction.breakaway import breakaway
from cdsm.posture import Posture
from cdsm.statics.equilibrium import Equilibrium
from cdsm.statics.following import follow_load
from cdsm.statics.load_cycle import load_cycle
from cdsm.statics.rest_search import equilibrium
from cdsm.statics.weight_friction import WeightFriction
from cdsm.support.directions import unit_direction
from cdsm.support.format import MODEL, coordinates, plain, without_rounding
from cdsm.support.tidy import data_frame
from cdsm.support.validation import vector, whole_number
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tension import Tension

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

MOST_STEPS = 1000
"""Largest number of steps. A curve with more points is not smoother, but takes long."""

_MEASURED = 1e-12
"""Smallest tip displacement, divided by the arm's length, with about three correct digits."""

_DISPLACED = 1e-9
"""Smallest tip displacement, divided by the arm's length, above the rounding of equilibrium."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class LinearPrediction(ReadOnlyState):
    """Linear prediction of a weight test from the compliance of the arm without the weight.

    Joints at stops are fixed. ΔF (3,) [N] is the force of the :class:`WeightTest`, u = ΔF/|ΔF|.

    Attributes:
        displacement: Displacement of the tip C_vv ΔF (3,) [m], with C of
            :attr:`~cdsm.Equilibrium.compliance`.
        stiffness: 1/(uᵀ C_vv u) along the force [N/m].
    """

    displacement: Array
    stiffness: float


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class WeightTest(ReadOnlyState):
    """States of an arm while a weight at its tip is increased in equal steps.

    If the arm has friction in its holes, tips, displacements and stiffness are computed with it.

    Attributes:
        force: ΔF (3,) [N], the dead force at the full load, base axes.
        without: Frictionless equilibrium without the weight, under the wrench that also acts then.
        loaded: Frictionless equilibrium at each step; the last one is under the full load.
        friction: Loads and stiffnesses with friction; None for an arm without friction.
    """

    force: Array
    without: Equilibrium
    loaded: tuple[Equilibrium, ...]
    friction: WeightFriction | None = None

    @cached_property
    def displacement(self) -> Array:
        """ΔX (3,) [m]: tip position with the full weight minus tip position without the weight."""
        return frozen(self.displacements[-1].copy())

    @cached_property
    def stiffness(self) -> float:
        """Secant |ΔF|/(u·ΔX) [N/m], u = ΔF/|ΔF| (1/C of Eq. 20); inf without motion along u."""
        return (
            float(np.linalg.norm(self.force)) / self._tip_motion if self._tip_motion else math.inf
        )

    @property
    def _tip_motion(self) -> float:
        """Displacement of the tip along the force [m]; zero if it is rounding."""
        moved = float(self.displacement @ unit_direction("force", self.force))
        return moved if abs(moved) > _MEASURED * self.without.pose.arm.length else 0.0

    @cached_property
    def linear(self) -> LinearPrediction:
        """Linear prediction of the test from the compliance without the weight.

        Raises:
            SingularStiffness: The arm without the weight is about to buckle.
        """
        C = self.without.compliance[:3, :3]
        stiff = self.without.along(self.force)
        return LinearPrediction(displacement=frozen(C @ self.force), stiffness=stiff)

    @property
    def settled_first(self) -> bool:
        """Whether the given tensions did not balance the arm, so that it moved before the test."""
        moved = float(np.linalg.norm(self.without.displacement))
        return moved > _DISPLACED * self.without.pose.arm.length

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences if, without the weight, the arm leaves its reference, or is not stable."""
        said = []
        if self.settled_first:
            moved = coordinates(1000.0 * self.without.displacement)
            left = (
                "before the weight the arm did not stay there; the tip moved "
                f"by {moved} mm, from where all this is measured"
            )
            if self.friction is not None:
                start = self.friction.history.tip[0] - self.without.reference.tip[:3, 3]
                left = (
                    f"without friction the arm does not stay there before the weight; its tip "
                    f"moves by {moved} mm, from where all that is linear or frictionless is "
                    f"measured. With friction it moves by {coordinates(1000.0 * start)} mm"
                )
            said.append(f"LEFT ITS REFERENCE: {left}")
        if not self.without.stable:
            said.append("NEUTRAL: before the weight, not every joint is brought back")
        return tuple(said)

    @cached_property
    def loads(self) -> Array:
        """Magnitude of the force at each step (n,) [N]."""
        count = len(self.loaded)
        return frozen(np.linalg.norm(self.force) * np.arange(1, count + 1) / count)

    @cached_property
    def tips(self) -> Array:
        """Tip position at each step (n, 3) [m]."""
        if self.friction is not None:
            return frozen(self.friction.history.tip[1:].copy())
        return frozen(np.array([each.pose.tip[:3, 3] for each in self.loaded]))

    @cached_property
    def displacements(self) -> Array:
        """Tip position at each step minus tip position without the weight (n, 3) [m]."""
        if self.friction is not None:
            return frozen(self.tips - self.friction.history.tip[0])
        return frozen(self.tips - self.without.pose.tip[:3, 3])

    @cached_property
    def tensions(self) -> Array:
        """Cable tensions at each step (n, C) [N]; with friction, those at the motors."""
        if self.friction is not None:
            return frozen(np.array([T[1:, 0] for T in self.friction.history.tensions]).T)
        return frozen(np.array([each.tension for each in self.loaded]))

    def plot(self) -> Figure:
        """Plot load [N] against tip displacement [mm], and the tension of each cable [N]."""
        return cdsm.plots.plot_weight_test(self)

    def to_dict(self) -> dict[str, object]:
        """Return loads, displacements and tensions in SI for JSON, with units in the keys."""
        last, before = self.loaded[-1], self.without
        numbers = {
            "before": {
                "tip_displacement_m": before.displacement,
                "at_limit": before.at_limit,
                "slack": before.slack,
                "stable": before.stable,
            },
            "force_N": self.force,
            "loads_N": self.loads,
            "tip_displacements_m": self.displacements,
            "linear_displacement_m": self.linear.displacement,
            "stiffness_N_per_m": self.stiffness,
            "linear_stiffness_N_per_m": self.linear.stiffness,
            "cables": last.pose.arm.cables.names,
            "tensions_N": self.tensions,
            **last.pose._coordinates,
            "slack": last.slack,
            "at_limit": last.at_limit,
            "stable": last.stable,
        }
        if self.friction is not None:
            numbers["friction"] = self.friction.to_dict()
        return plain(numbers)

    def to_pandas(self) -> pandas.DataFrame:
        """Return displacement [m] and tensions [N] at each load; needs pandas (MissingExtra)."""
        names = [f"{name} tension [N]" for name in self.without.pose.arm.cables.names]
        moved = zip(("x [m]", "y [m]", "z [m]"), self.displacements.T, strict=True)
        columns = {**dict(moved), **dict(zip(names, self.tensions.T, strict=True))}
        return data_frame(columns, "load [N]", self.loads)

    def __repr__(self) -> str:
        return (
            f"<WeightTest with {np.linalg.norm(self.force):.4g} N on "
            f"{self.without.pose.arm.name}: {self.stiffness / 1000.0:.4g} N/mm>"
        )

    def __str__(self) -> str:
        rows = [f"{'load [N]':>10}{'x [mm]':>12}{'y [mm]':>12}{'z [mm]':>12}"]
        for load, moved in zip(self.loads, without_rounding(self.displacements), strict=True):
            rows.append(f"{load:>10.4g}" + "".join(f"{1000.0 * x:>12.4g}" for x in moved))
        predicted = "".join(
            f"{1000.0 * x:>12.4g}" for x in without_rounding(self.linear.displacement)
        )
        rows += [
            f"{'linear':>10}{predicted}",
            f"stiffness along the force: measured {self.stiffness / 1000.0:.4g} N/mm, "
            f"linear {self.linear.stiffness / 1000.0:.4g} N/mm",
            f"(linear is {MODEL}; measured the secant over this weight)",
        ]
        if self.friction is not None:
            rows.append(str(self.friction))
        if self.without.at_limit:
            rows.append(f"before the weight at a stop: {', '.join(self.without.at_limit)}")
        return "\n".join([*self.warnings, *rows])


def weight_test(
    pose: Posture,
    tension: Tension | ArrayLike,
    force: ArrayLike,
    *,
    steps: int = 1,
    wrench: ArrayLike | None = None,
) -> WeightTest:
    """Compute the stiffness under a weight hung at the tip, with locked motors: 1/C of Eq. 20.

    The test is nonlinear: the tensions follow the elongations, and the posture changes. For a small
    force the result is :meth:`~cdsm.Stiffness.along`. With friction in the holes it depends on the
    weight: under a small one all cables stick; ``friction.sliding_load`` of the result is the
    weight [N] from which they slide. The weight is hung once and slowly, as in
    :func:`~cdsm.load_cycle`.

    Args:
        pose: The reference posture, at which the motors are locked.
        tension: F at the reference, as for :func:`~cdsm.equilibrium`. If these tensions do not
            balance the arm, the test starts from the equilibrium they lead to.
        force: ΔF (3,) [N] at ``tool0`` in base axes, added to ``wrench``.
        steps: Number of equal load steps, at most 1000.
        wrench: Wrench (6,) without the weight: force [N], then moment [N m]. Default: the wrench of
            the ``Tension``, or zero.

    Raises:
        InvalidInput: As for :func:`~cdsm.equilibrium`; or the force is zero or moves the tip by
            rounding only; or ``steps`` is not a whole number from 1 to 1000.
        ElasticityRangeError: As for :func:`~cdsm.equilibrium`, at any step.
        EquilibriumError: The arm buckles under a part of the load. The error names this part.
            :func:`~cdsm.equilibrium` finds the posture after buckling.
        SingularStiffness: The arm has friction and is about to buckle without the weight.
    """
    force = vector("force", force, 3, "a force in base axes [N]", "force")
    if not force.any():
        raise InvalidInput("force", "is zero; nothing moves, and there is nothing to measure.")
    steps = whole_number("steps", steps, 1, MOST_STEPS)
    without = equilibrium(pose, tension, wrench)
    added = np.append(force, np.zeros(3))
    loaded, part = [without], 0.0
    for step in range(1, steps + 1):
        loaded.append(follow_load(loaded[-1], without.wrench, added, part, step / steps))
        part = step / steps
    test = WeightTest(force=force, without=without, loaded=tuple(loaded[1:]))
    if not test._tip_motion and math.isfinite(test.linear.stiffness):
        raise InvalidInput(
            "force",
            f"{np.abs(force).max():.3g} N moves the tip by rounding only, and measures nothing; "
            f"hang at least {_MEASURED * pose.arm.length * test.linear.stiffness:.1g} N.",
        )
    return _with_friction(test, tension) if pose.arm.has_friction else test


def _with_friction(test: WeightTest, tension: Tension | ArrayLike) -> WeightTest:
    """Return ``test`` with its field ``friction`` computed, under the same load steps."""
    before, parts = test.without, test.loads / np.linalg.norm(test.force)
    added = np.append(test.force, np.zeros(3))
    path = before.wrench + np.append(0.0, parts)[:, None] * added
    friction = WeightFriction(
        breakaway=breakaway(before.reference, before.reference_tension, test.force, before.wrench),
        frictionless=test.linear.stiffness,
        frictionless_secant=test.stiffness,
        history=load_cycle(before.reference, tension, path),
    )
    return replace(test, friction=friction)
