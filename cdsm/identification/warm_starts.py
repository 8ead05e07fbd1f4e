"""Where the search for each equilibrium of a weight loop begins, from loops computed nearby.

Between two points of the parameters p a loop changes little. Its equilibria x at p + Δp are near
x + Σ_j ∂x/∂p_j Δp_j, and the derivatives come with those of the residuals. From there a sub-step
takes two or three evaluations instead of nine.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from cdsm.statics.quasi_static import EquilibriumPath
from cdsm.support.values import Array

LoopPaths = Mapping[int, tuple[EquilibriumPath, ...]]
"""Paths to each force of each loop, by the number of its measurement."""


@dataclass(frozen=True)
class WarmStarts:
    """Paths of the loops at a point of the parameters, and beside it.

    Attributes:
        point: The point p (P,), scaled.
        paths: The paths there.
        beside: By the number of a parameter, how far it was changed, and the paths there.
    """

    point: Array
    paths: LoopPaths
    beside: dict[int, tuple[float, LoopPaths]] = field(default_factory=dict)

    def at(self, point: Array) -> LoopPaths:
        """Extrapolate the paths to another point (P,)."""
        change = point - self.point
        shares = [
            (change[j] / step, paths) for j, (step, paths) in self.beside.items() if change[j]
        ]
        extrapolated = dict[int, tuple[EquilibriumPath, ...]]()
        for i, loop in self.paths.items():
            sides = [(share, paths[i]) for share, paths in shares if paths.get(i)]
            extrapolated[i] = tuple(
                {
                    part: x + sum(s * (side[k][part] - x) for s, side in sides if part in side[k])
                    for part, x in path.items()
                }
                for k, path in enumerate(loop)
            )
        return extrapolated
