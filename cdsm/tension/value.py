"""Cable tensions that balance an arm, as a frozen value."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import DTypeLike

from cdsm.posture import Posture
from cdsm.support.format import aligned
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import one_of
from cdsm.support.values import Array, Named, frozen
from cdsm.tension.solvers import OPTIMALITY

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Tension(Result, Named):
    """Cable tensions that balance an arm, with the posture, load and bounds they were computed for.

    The keys are the names of the cables: ``tension["cable1_1"]`` [N], ``dict(tension)``. Use the
    array :attr:`values`, equal to ``np.array(tension)``, to index by number.

    Attributes:
        posture: The posture.
        values: F (C,) [N], in the order of ``posture.arm.cables``.
        wrench: W (6,) at ``tool0``, base axes: force [N], then moment [N m].
        minimum: Lower bounds (C,) [N].
        maximum: Upper bounds (C,) [N].
        solver: Name of the solver that computed them.
        least: Whether they are the smallest tensions within the bounds; False if they were planned
            for a stiffness.
    """

    _headline, _rows = "tension", "cable"

    posture: Posture
    values: Array = field(metadata=unit("N", "cable", name="tension"))
    wrench: Array = field(metadata=unit("N and N m", "component"))
    minimum: Array = field(metadata=unit("N", "cable"))
    maximum: Array = field(metadata=unit("N", "cable"))
    solver: str = field(metadata=unit("1"))
    least: bool = True

    @quantity("torque", "joint")
    def residual(self) -> Array:
        """Residual J_Lᵀ F − (J_Xᵀ W − g) of Eq. 13, (nv,) [N m]."""
        at = self.posture
        torque = at.jacobian.T @ self.wrench - at._own_torque
        return frozen(self.values @ at.length_jacobian - torque)

    def keys(self) -> tuple[str, ...]:
        """Return the names of the cables, in the order of :attr:`values`."""
        return self.posture.arm.cables.names

    def __getitem__(self, cable: str) -> float:
        """Return the tension of a cable [N]; InvalidInput if there is no such cable."""
        remedy = "" if isinstance(cable, str) else "By index there is the array tension.values."
        return float(self.values[self.keys().index(one_of("cable", cable, self.keys(), remedy))])

    def __len__(self) -> int:
        return self.values.size

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> Array:
        return np.array(self.values, dtype) if copy else np.asarray(self.values, dtype)

    @property
    def at_minimum(self) -> tuple[str, ...]:
        """Names of the cables at their lower bound."""
        return self._names(self.values - self.minimum)

    @property
    def at_maximum(self) -> tuple[str, ...]:
        """Names of the cables at their upper bound."""
        return self._names(self.maximum - self.values)

    def _names(self, distance: Array) -> tuple[str, ...]:
        tight = distance <= OPTIMALITY * self.values.max(initial=0.0)
        return tuple(self.keys()[c] for c in np.flatnonzero(tight))

    def plot(self) -> Figure:
        """Plot the arm in mm, its cables coloured by their tension [N]."""
        return self.posture.plot(self)

    def __str__(self) -> str:
        rows = aligned([("cable", "tension [N]"), *((c, f"{self[c]:.3f}") for c in self)])
        unit = self.posture.arm.torque_unit()
        return "\n".join([*rows, f"static residual: {abs(self.residual).max():.1e} {unit}"])
