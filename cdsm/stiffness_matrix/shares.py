"""Contributions of cables, gravity and load to the stiffness of an arm in one direction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import cdsm
from cdsm.stiffness_matrix.instability import verdict
from cdsm.stiffness_matrix.prints import model_of
from cdsm.support.format import aligned, coordinates, plain
from cdsm.support.tidy import data_frame
from cdsm.support.validation import one_of
from cdsm.support.values import Array, Named, ReadOnlyState, frozen

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

    from cdsm.stiffness_matrix import Stiffness

_ROUNDING = 1e-15  # contributions below this fraction of the total are printed as zero


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Shares(ReadOnlyState, Named):
    """Contributions to the stiffness in one direction; their sum is :attr:`total`.

    Attributes:
        stiffness: The stiffness from which they are computed.
        direction: The unit direction (3,), base axes.
        passive: Contribution of each cable's elasticity, (C,) [N/m].
        active: Contribution of each cable's tension, (C,) [N/m]; usually negative.
        gravity: Contribution of the weight of the links [N/m].
        load: Contribution of the wrench at the tip [N/m].
    """

    stiffness: Stiffness
    direction: Array
    passive: Array
    active: Array
    gravity: float
    load: float

    def __getitem__(self, cable: str) -> float:
        """Return passive + active contribution of a cable [N/m], or raise UnknownName."""
        names = self.keys()
        return float(self.cables[names.index(one_of("cable", cable, names))])

    def keys(self) -> tuple[str, ...]:
        """Return the names of the cables."""
        return self.stiffness.posture.arm.cables.names

    @property
    def cables(self) -> Array:
        """Sum of the passive and active contributions of each cable, (C,) [N/m]."""
        return frozen(self.passive + self.active)

    @property
    def total(self) -> float:
        """Sum of all contributions [N/m]: the stiffness along the direction."""
        return float(self.passive.sum() + self.active.sum() + self.gravity + self.load)

    def plot(self) -> Figure:
        """Plot the contribution of each cable, of gravity and of the load as bars [N/mm]."""
        return cdsm.plots.plot_shares(self)

    def to_dict(self) -> dict[str, object]:
        """Return the contributions in N/m by name for JSON, with units in the keys."""
        names = self.stiffness.posture.arm.cables.names
        numbers = {
            "direction": self.direction,
            "passive_N_per_m": dict(zip(names, self.passive, strict=True)),
            "active_N_per_m": dict(zip(names, self.active, strict=True)),
            "gravity_N_per_m": self.gravity,
            "load_N_per_m": self.load,
            "total_N_per_m": self.total,
            "stable": self.stiffness.is_stable,
        }
        return plain(numbers)

    def to_pandas(self) -> pandas.DataFrame:
        """Return both contributions of each cable [N/m] as a table; needs pandas (MissingExtra)."""
        columns = {"passive [N/m]": self.passive, "active [N/m]": self.active}
        return data_frame(columns, "cable", self.stiffness.posture.arm.cables.names)

    def __repr__(self) -> str:
        state = "" if self.stiffness.is_stable else ", UNSTABLE"
        return f"<Shares of {self.total / 1e3:.4g} N/mm along {coordinates(self.direction)}{state}>"

    def __str__(self) -> str:
        def line(name: str, whole: float, *parts: float) -> list[str]:
            seen = [x * (abs(x) > _ROUNDING * abs(total)) for x in (*parts, whole)]
            numbers = [f"{x / 1e3:z.4g}" for x in seen] if parts else []
            return [name, *(numbers or ["", "", f"{whole / 1e3:z.4g}"]), f"{whole / total:z.1%}"]

        total, names = self.total, self.stiffness.posture.arm.cables.names
        rows = [["cable", "passive", "active", "sum [N/mm]", "share"]]
        rows += map(line, names, self.cables, self.passive, self.active)
        rows += [line("gravity", self.gravity), line("load", self.load), line("total", total)]
        along = f"stiffness along {coordinates(self.direction)}"
        K = self.stiffness
        first = [] if K.is_stable else [f"{verdict(K)}; its shares mean nothing"]
        return "\n".join([*first, along, *aligned(rows), f"({model_of(K)})"])
