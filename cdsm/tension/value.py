"""Cable tensions that balance an arm, as a frozen value."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import DTypeLike

from cdsm.kernels.tension import OPTIMALITY
from cdsm.posture import Posture
from cdsm.support.format import aligned, key, plain, plural
from cdsm.support.tidy import data_frame
from cdsm.support.validation import one_of
from cdsm.support.values import Array, Named, ReadOnlyState, frozen

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Tension(ReadOnlyState, Named):
    """Cable tensions that balance an arm, with the posture, load and bounds they were computed for.

    The keys are the names of the cables: ``tension["cable1_1"]`` [N], ``"cable1_1" in tension``,
    ``dict(tension)``. To index by number, use the array :attr:`values`, equal to
    ``np.array(tension)``.

    Attributes:
        posture: The posture.
        values: F (C,) [N], in the order of ``posture.arm.cables``.
        wrench: W (6,) at ``tool0``, base axes: force [N], then moment [N m].
        minimum: Lower bounds (C,) [N].
        maximum: Upper bounds (C,) [N].
        solver: Name of the requested solver, even if a first guess was optimal.
        least: Whether they are the smallest tensions within the bounds; False if they were planned
            for a stiffness.
    """

    posture: Posture
    values: Array
    wrench: Array
    minimum: Array
    maximum: Array
    solver: str
    least: bool = True

    @cached_property
    def residual(self) -> Array:
        """Residual J_Lᵀ F − (J_Xᵀ W − g) of Eq. 13, (nv,) [N m]."""
        pose = self.posture
        torque = pose.jacobian.T @ self.wrench - pose.gravity_torque
        return frozen(self.values @ pose.length_jacobian - torque)

    def keys(self) -> tuple[str, ...]:
        """Return the names of the cables, in the order of :attr:`values`."""
        return self.posture.arm.cables.names

    def items(self) -> tuple[tuple[str, float], ...]:
        """Return pairs of name and tension [N], one for each cable."""
        return tuple(zip(self.keys(), self.values.tolist(), strict=True))

    def __getitem__(self, cable: str) -> float:
        """Return the tension of a cable [N]; UnknownName if there is no such cable."""
        remedy = "" if isinstance(cable, str) else "By index there is the array tension.values."
        return dict(self.items())[one_of("cable", cable, self.keys(), remedy)]

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
        return tuple(self.posture.arm.cables[c].name for c in np.flatnonzero(tight))

    def plot(self) -> Figure:
        """Plot the arm in mm, its cables coloured by their tension [N]."""
        return self.posture.plot(self)

    def to_dict(self) -> dict[str, object]:
        """Return tensions, bounds and load in SI for JSON, with units in the keys; inf as None."""
        arm = self.posture.arm
        numbers = {
            **self.posture._coordinates,
            "tension_N": dict(self),
            "minimum_N": dict(zip(self, self.minimum, strict=True)),
            "maximum_N": dict(zip(self, self.maximum, strict=True)),
            "force_N": self.wrench[:3],
            "moment_Nm": self.wrench[3:],
            key("static_residual", arm.torque_unit()): self.residual,
            "solver": self.solver,
        }
        return plain(numbers)

    def to_pandas(self) -> pandas.DataFrame:
        """Return tension and bounds [N] of each cable as a table; needs pandas (MissingExtra)."""
        columns = {
            "tension [N]": self.values,
            "minimum [N]": self.minimum,
            "maximum [N]": self.maximum,
        }
        return data_frame(columns, "cable", self.keys())

    def __repr__(self) -> str:
        return (
            f"<Tension {self.values.min():.4g} to {self.values.max():.4g} N in "
            f"{plural(self.values.size, 'cable')}>"
        )

    def __str__(self) -> str:
        rows = aligned([("cable", "tension [N]"), *((c, f"{F:.3f}") for c, F in self.items())])
        unit = self.posture.arm.torque_unit()
        return "\n".join([*rows, f"static residual: {abs(self.residual).max():.1e} {unit}"])
