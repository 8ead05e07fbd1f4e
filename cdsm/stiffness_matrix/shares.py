"""Contributions of cables, gravity, load and springs to the stiffness in one direction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import final

import numpy as np

from cdsm.posture import Posture
from cdsm.support.format import aligned, coordinates, stiffness_unit, without_rounding
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
        terms: Of each other term of `K_θ` [N/m], by its name: gravity, load, springs, …
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
    terms: Mapping[str, float]
    model: str
    warnings: tuple[str, ...] = ()

    @quantity("N/m")
    def gravity(self) -> float:
        """Contribution of the weight of the links [N/m]."""
        return self.terms["gravity"]

    @quantity("N/m")
    def load(self) -> float:
        """Contribution of the wrench at the tip [N/m]."""
        return self.terms["load"]

    @quantity("N/m")
    def springs(self) -> float:
        """Contribution of the joint springs [N/m]."""
        return self.terms["springs"]

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
        """:attr:`terms` [N/m] without that of the springs, if the arm has none."""
        sprung = self.posture.arm.has_springs
        return {name: k for name, k in self.terms.items() if sprung or name != "springs"}

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
        unit, size = stiffness_unit(whole)
        rows = [[name, "", "", f"{k / size:z.4g}", f"{k / self.total:z.1%}"] for name, k in pairs]
        for row, passive, active in zip(rows, self.passive, self.active, strict=False):
            row[1:3] = f"{passive / size:z.4g}", f"{active / size:z.4g}"
        rows = [["cable", "passive", "active", f"sum [{unit}]", "share"], *rows]
        warnings = [f"{warning}; its shares mean nothing" for warning in self.warnings]
        along = f"stiffness along {coordinates(self.direction)}"
        return "\n".join([*warnings, along, *aligned(rows), f"({self.model})"])
