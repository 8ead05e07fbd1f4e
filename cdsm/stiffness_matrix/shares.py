"""Contributions of cables, gravity and load to the stiffness of an arm in one direction."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, final

import cdsm
from cdsm.posture import Posture
from cdsm.stiffness_matrix.instability import verdict
from cdsm.stiffness_matrix.prints import model_of
from cdsm.support.format import aligned, coordinates
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import one_of
from cdsm.support.values import Array, Named, frozen

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cdsm.stiffness_matrix import Stiffness

_ROUNDING = 1e-15  # contributions below this fraction of the total are printed as zero


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Shares(Result, Named):
    """Contributions to the stiffness in one direction; they add up to :attr:`total`.

    Attributes:
        stiffness: The stiffness from which they are computed.
        direction: The unit direction (3,), base axes.
        passive: Contribution of each cable's elasticity, (C,) [N/m].
        active: Contribution of each cable's tension, (C,) [N/m]; usually negative.
        gravity: Contribution of the weight of the links [N/m].
        load: Contribution of the wrench at the tip [N/m].
    """

    _headline, _rows = "total", "cable"

    stiffness: Stiffness
    direction: Array = field(metadata=unit("1", "axis"))
    passive: Array = field(metadata=unit("N/m", "cable"))
    active: Array = field(metadata=unit("N/m", "cable"))
    gravity: float = field(metadata=unit("N/m"))
    load: float = field(metadata=unit("N/m"))

    @property
    def _posture(self) -> Posture:
        return self.stiffness.posture

    def __getitem__(self, cable: str) -> float:
        """Return passive + active contribution of a cable [N/m], or raise UnknownName."""
        names = self.keys()
        return float(self.cables[names.index(one_of("cable", cable, names))])

    def keys(self) -> tuple[str, ...]:
        """Return the names of the cables."""
        return self._posture.arm.cables.names

    @property
    def cables(self) -> Array:
        """Sum of the passive and active contributions of each cable, (C,) [N/m]."""
        return frozen(self.passive + self.active)

    @quantity("N/m")
    def total(self) -> float:
        """Sum of all contributions [N/m]: the stiffness along the direction."""
        return float(self.passive.sum() + self.active.sum() + self.gravity + self.load)

    @quantity("1")
    def is_stable(self) -> bool:
        """Whether the arm is stable; if not, the contributions mean nothing."""
        return self.stiffness.is_stable

    def plot(self) -> Figure:
        """Plot the contribution of each cable, of gravity and of the load as bars [N/mm]."""
        return cdsm.plots.plot_shares(self)

    def __str__(self) -> str:
        def line(name: str, whole: float, *parts: float) -> list[str]:
            seen = [x * (abs(x) > _ROUNDING * abs(total)) for x in (*parts, whole)]
            numbers = [f"{x / 1e3:z.4g}" for x in seen]
            return [name, *[""] * (3 - len(numbers)), *numbers, f"{whole / total:z.1%}"]

        total = self.total
        rows = [["cable", "passive", "active", "sum [N/mm]", "share"]]
        rows += map(line, self.keys(), self.cables, self.passive, self.active)
        rows += [line("gravity", self.gravity), line("load", self.load), line("total", total)]
        first = [] if self.is_stable else [f"{verdict(self.stiffness)}; its shares mean nothing"]
        along = f"stiffness along {coordinates(self.direction)}"
        return "\n".join([*first, along, *aligned(rows), f"({model_of(self.stiffness)})"])
