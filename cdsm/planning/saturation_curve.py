"""Result of :func:`saturation`: stiffness as a function of the lower bound of the tensions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal, final

import cdsm
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.format import MODEL, coordinates, plain
from cdsm.support.tidy import data_frame
from cdsm.support.values import Array, ReadOnlyState
from cdsm.tension import Tension

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


End = Literal["buckling", "maximum", "infeasible", "elasticity", "none"]


_ENDS: Final[dict[End, str]] = {
    "buckling": "where the arm buckles",
    "maximum": "where the maximum leaves no tensions that balance the arm",
    "infeasible": "beyond which no tensions balance the arm",
    "elasticity": "where a tension reaches the end of its cable's elasticity",
    "none": "and goes on",
}


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Saturation(ReadOnlyState):
    """Stiffness as a function of the lower bound of the tensions; made by :func:`saturation`.

    Attributes:
        direction: u (3,), a unit direction in base axes.
        fraction: Part of the largest slope [-] below which more tension hardly stiffens the arm.
        bound: The lower bound [N] at which the slope has fallen to ``fraction`` of the largest
            slope. It is inf if the slope stays above this value, and the first bound if the
            stiffness never rises.
        tension: The least tensions with the lower bound ``bound`` or, if that is inf, with the last
            bound of the curve.
        stiffness: K_θ under these tensions.
        steepest: The lower bound [N] with the largest slope.
        steepest_slope: Derivative of the stiffness with respect to the bound at ``steepest`` [1/m].
        stiffest: The lower bound [N] with the largest stiffness: an end of the curve, or a maximum
            between the ends, above which tension softens the arm.
        limit: Why the curve ends: ``"buckling"``, ``"maximum"`` (the upper bound of the tensions),
            ``"elasticity"`` (a tension leaves the domain of its cable), ``"infeasible"`` (no
            tensions balance the arm) or ``"none"`` (the curve goes on).
        curve: n rows (n, 3): lower bound [N], stiffness along u [N/m], its slope [1/m].
    """

    direction: Array
    fraction: float
    bound: float
    tension: Tension
    stiffness: Stiffness
    steepest: float
    steepest_slope: float
    stiffest: float
    limit: End
    curve: Array

    @property
    def end(self) -> float:
        """Lower bound [N] at which the curve ends; ``limit`` is the reason."""
        return float(self.curve[-1, 0])

    def plot(self) -> Figure:
        """Plot stiffness [N/mm] and slope [N/mm per N] against the lower bound of tension [N]."""
        return cdsm.plots.plot_saturation(self)

    def to_dict(self) -> dict[str, object]:
        """Return bounds, slopes and curve in SI for JSON, with units in the keys; inf as None."""
        numbers = {
            **self.tension.posture._coordinates,
            "direction": self.direction,
            "fraction": self.fraction,
            "saturation_tension_N": self.bound,
            "steepest_tension_N": self.steepest,
            "steepest_slope_per_m": self.steepest_slope,
            "stiffest_tension_N": self.stiffest,
            "end_tension_N": self.end,
            "limit": self.limit,
            "tension_N": dict(self.tension),
            "minimum_tension_N": self.curve[:, 0],
            "along_N_per_m": self.curve[:, 1],
            "slope_per_m": self.curve[:, 2],
        }
        return plain(numbers)

    def to_pandas(self) -> pandas.DataFrame:
        """Return a table with a row for each lower bound [N]; needs pandas (MissingExtra)."""
        columns = {"along [N/m]": self.curve[:, 1], "slope [1/m]": self.curve[:, 2]}
        return data_frame(columns, "minimum [N]", self.curve[:, 0])

    def __repr__(self) -> str:
        return f"<Saturation at {self.bound:.4g} N>"

    def __str__(self) -> str:
        along, part = coordinates(self.direction), f"{100.0 * self.fraction:.3g} %"
        if self.steepest_slope <= 0.0:
            lines = [f"tension nowhere raises the stiffness along {along}"]
        else:
            lines = [
                f"the stiffness along {along} rises most, by {self.steepest_slope / 1000.0:.4g} "
                f"N/mm per N, at a lower bound of {self.steepest:.4g} N",
                f"it never pays less than {part} of that"
                if math.isinf(self.bound)
                else f"above {self.bound:.4g} N it pays less than {part}",
            ]
        here, most = self.stiffness.along(self.direction), self.curve[:, 1].max()
        if not math.isinf(self.bound) and here < most / 2.0:
            lines.append(
                f"yet it is {here / 1e3:.4g} N/mm there, and {most / 1e3:.4g} N/mm at "
                f"{self.stiffest:.4g} N: give a minimum above this short rise"
            )
        if self.curve[0, 0] < self.stiffest < self.end:
            lines.append(f"above {self.stiffest:.4g} N tension makes the arm softer")
        lines.append(f"looked at up to {self.end:.4g} N, {_ENDS[self.limit]} ({MODEL})")
        return "\n".join(lines)
