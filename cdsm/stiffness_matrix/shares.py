"""Contributions of cables, gravity, load and springs to the stiffness in one direction."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import final

import numpy as np

from cdsm.posture import Posture
from cdsm.support.format import aligned, coordinates, without_rounding
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import one_of
from cdsm.support.values import Array, IndexedByName, Plotted, frozen


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Shares(Result, IndexedByName, Plotted):
    """Contributions to the stiffness in one direction; they add up to :attr:`total`.

    Attributes:
        posture: The posture.
        direction: Unit direction (3,), base axes.
        passive: Of each cable's elasticity, (C,) [N/m].
        active: Of each cable's tension, (C,) [N/m]; usually negative.
        gravity: Of the weight of the links [N/m].
        load: Of the wrench at the tip [N/m].
        springs: Of the joint springs [N/m].
        model: Assumptions of the stiffness in words, such as locked motors.
        warnings: Of an unstable arm, the sentence that says so: its contributions mean nothing.
    """

    _headline = "total"
    _rows = "cable"
    _figure = "plot_shares"

    posture: Posture
    direction: Array = field(metadata=unit("1", "axis"))
    passive: Array = field(metadata=unit("N/m", "cable"))
    active: Array = field(metadata=unit("N/m", "cable"))
    gravity: float = field(metadata=unit("N/m"))
    load: float = field(metadata=unit("N/m"))
    springs: float = field(metadata=unit("N/m"))
    model: str
    warnings: tuple[str, ...] = ()

    def __getitem__(self, cable: str) -> float:
        """Return passive + active contribution of a cable [N/m], or raise InvalidInput."""
        return float(self.cables[self.keys().index(one_of("cable", cable, self.keys()))])

    def keys(self) -> tuple[str, ...]:
        """Return the names of the cables."""
        return self.posture.arm.cables.names

    @property
    def cables(self) -> Array:
        """Sum of the passive and active contributions of each cable, (C,) [N/m]."""
        return frozen(self.passive + self.active)

    @property
    def others(self) -> dict[str, float]:
        """Contributions of gravity, of the load and, if there are any, of the springs [N/m]."""
        found = {"gravity": self.gravity, "load": self.load}
        return found | {"springs": self.springs} if self.posture.arm.has_springs else found

    @quantity("N/m")
    def total(self) -> float:
        """Sum of all contributions [N/m]: the stiffness along the direction."""
        return float(self.cables.sum() + sum(self.others.values()))

    @quantity("1")
    def is_stable(self) -> bool:
        """Whether the arm is stable; if not, the contributions mean nothing."""
        return not self.warnings

    def __str__(self) -> str:
        others = self.others
        names = [*self.keys(), *others, "total"]
        whole = without_rounding(np.array([*self.cables, *others.values(), self.total]))
        pairs = zip(names, whole, strict=True)
        rows = [[name, "", "", f"{k / 1e3:z.4g}", f"{k / self.total:z.1%}"] for name, k in pairs]
        for row, passive, active in zip(rows, self.passive, self.active, strict=False):
            row[1:3] = f"{passive / 1e3:z.4g}", f"{active / 1e3:z.4g}"
        rows = [["cable", "passive", "active", "sum [N/mm]", "share"], *rows]
        warnings = [f"{warning}; its shares mean nothing" for warning in self.warnings]
        along = f"stiffness along {coordinates(self.direction)}"
        return "\n".join([*warnings, along, *aligned(rows), f"({self.model})"])
