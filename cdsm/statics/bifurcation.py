"""Equilibria of an arm that a small force pushes, at tensions below and above buckling."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, final

import numpy as np
from numpy.typing import ArrayLike

import cdsm
from cdsm.errors import InvalidInput
from cdsm.statics.buckling_results import CriticalTension
from cdsm.statics.equilibrium import Equilibrium
from cdsm.statics.rest_search import equilibrium
from cdsm.support.format import plain
from cdsm.support.tidy import data_frame
from cdsm.support.validation import instance, number_array, quantity
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tension import distribute_tension

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

_UNMOVED: Final = 1e-9
"""A buckling mode moves the tip if tip motion/joint motion/arm length is above this [1/rad]."""

_AROUND: Final = frozen(np.linspace(0.8, 1.3, 26))
"""Default lower bounds of tension as multiples of the critical bound."""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Bifurcation(ReadOnlyState):
    """Equilibria of an arm that a small force pushes, around its critical tension.

    The motors are locked at the posture of ``critical``. Below the critical tension the arm stays
    near this posture. Above it the posture is an unstable equilibrium, and the push moves the arm
    to a stable one elsewhere. Made by :func:`bifurcation`.

    Attributes:
        critical: The result of :func:`critical_tension`, with its posture and wrench.
        push: The push (6,): force [N] along the tip motion of the buckling mode, then zero moment
            [N m].
        bounds: Lower bounds of tension (n,) [N], ascending.
        rests: Equilibrium of the pushed arm at each of these bounds.
    """

    critical: CriticalTension
    push: Array
    bounds: Array
    rests: tuple[Equilibrium, ...]

    @property
    def displacements(self) -> Array:
        """Displacement of the tip from the posture of ``critical`` at each bound (n, 3) [m]."""
        return frozen(np.array([rest.displacement for rest in self.rests]))

    def plot(self) -> Figure:
        """Plot the displacement of the tip [mm] against the lower bound of tension [N]."""
        return cdsm.plots.plot_bifurcation(self)

    def to_dict(self) -> dict[str, object]:
        """Return bounds and displacements in SI for JSON, with units in the keys."""
        numbers = {
            "critical_minimum_tension_N": self.critical.minimum,
            "push_force_N": self.push[:3],
            "minimum_tension_N": self.bounds,
            "tip_displacements_m": self.displacements,
        }
        return plain(numbers)

    def to_pandas(self) -> pandas.DataFrame:
        """Return the curve as a table: tip displacement [m] at each bound of the tensions [N].

        Raises MissingExtra if pandas is not installed.
        """
        columns = dict(zip(("x [m]", "y [m]", "z [m]"), self.displacements.T, strict=True))
        return data_frame(columns, "minimum [N]", self.bounds)

    def __repr__(self) -> str:
        return f"<Bifurcation at {self.critical.minimum:.4g} N>"

    def __str__(self) -> str:
        moved = 1e3 * np.linalg.norm(self.displacements, axis=1)
        below = moved[self.bounds < self.critical.minimum]
        lines = [f"pushed aside by {np.linalg.norm(self.push[:3]):.3g} N:"]
        if below.size:
            lines.append(f"below {self.critical.minimum:.4g} N the tip moves {below.max():.3g} mm")
        return "\n".join([*lines, f"at {self.bounds[-1]:.4g} N it moves {moved[-1]:.3g} mm"])


def bifurcation(
    critical: CriticalTension, push: float = 1e-3, bounds: ArrayLike | None = None
) -> Bifurcation:
    """Compute the equilibria of an arm under a small push, at tensions below and above buckling.

    For each lower bound of tension, the motors are locked at the posture of ``critical``, with the
    least tensions that respect the bound. Then the push acts: a force at the tip, in the direction
    in which the buckling mode moves the tip.

    Args:
        critical: Result of :func:`~cdsm.critical_tension` of an arm that buckles.
        push: Magnitude of the force [N].
        bounds: Lower bounds of tension (n,) [N]; by default 26, from 0.8 to 1.3 times the critical.

    Raises:
        InvalidInput: ``critical`` is of an arm that does not buckle, or whose buckling does not
            move the tip; or ``push`` or ``bounds`` are not positive numbers.
        InfeasibleTension: No tensions balance the arm at one of the bounds.
        ElasticityRangeError: A tension is outside the domain of its cable's elasticity.
        EquilibriumError: No equilibrium of the pushed arm was found.
    """
    instance("critical", critical, CriticalTension)
    if not critical.stable or math.isinf(critical.minimum):
        raise InvalidInput("critical", f"{critical!r} given; an arm that buckles is needed.")
    pose = critical.posture
    motion = pose.jacobian[:3] @ critical.mode
    size = np.linalg.norm(motion)
    if not size > _UNMOVED * pose.arm.length:
        raise InvalidInput("critical", "buckles without moving its tip, which nothing can push.")
    least = critical.minimum * _AROUND if bounds is None else number_array("bounds", bounds)
    levels = np.sort(np.atleast_1d(least))
    force = np.zeros(6)
    force[:3] = quantity("push", push, "force") * motion / size
    rests = []
    for level in levels.tolist():
        tension = distribute_tension(pose, level, wrench=critical.wrench)
        rests.append(equilibrium(pose, tension, critical.wrench + force))
    return Bifurcation(
        critical=critical, push=frozen(force), bounds=frozen(levels), rests=tuple(rests)
    )
