"""Numbers in print: coordinates, units in the keys of JSON, and the model of every stiffness."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.support.values import Array

MODEL: Final = "frictionless, rigid links, tangent"
"""What every stiffness in print is."""


def coordinates(values: Iterable[float], form: str = ".4g") -> str:
    """A direction or a place: ``(0, 0.5, 1)``."""
    return f"({', '.join(format(x, form) for x in values)})"


def key(name: str, unit: str) -> str:
    """A key that names its unit: ``margin`` in ``N m/rad`` is ``margin_Nm_per_rad``."""
    words = unit.replace("N m", "Nm").replace("/", " per ").split()
    return "_".join([name, *words])


class JointUnits(NamedTuple):
    """Units of joints of which some turn and some may slide.

    Attributes:
        slides: Whether each joint slides (nv,).
    """

    slides: NDArray[np.bool_]

    @property
    def coordinates(self) -> tuple[str, ...]:
        """SI unit of each coordinate."""
        return tuple("m" if slides else "rad" for slides in self.slides)

    @property
    def shown(self) -> tuple[tuple[str, float], ...]:
        """The unit in which people are shown each coordinate, and what it is in SI."""
        return tuple(("mm", 1e-3) if slides else ("deg", math.pi / 180.0) for slides in self.slides)

    def torque(self, joint: int | None = None) -> str:
        """Unit of the torque of a joint, or of all of them together."""
        return self._joined("N m", "N", joint)

    def stiffness(self) -> str:
        """Unit of the diagonal of K_θ and of its eigenvalues."""
        return self._joined("N m/rad", "N/m")

    def levers(self, length: float) -> Array:
        """1 rad for a joint that turns, the arm's length [m] for one that slides (nv,)."""
        return np.where(self.slides, length, 1.0)

    def to_dict(self, names: Sequence[str], q: Array) -> dict[str, object]:
        """Coordinates q (..., nv) by joint, angles and ways apart since their units differ."""
        found: dict[str, object] = {}
        for key_of, chosen in (("angles_rad", ~self.slides), ("ways_m", self.slides)):
            if chosen.any() or key_of == "angles_rad":
                columns = np.flatnonzero(chosen).tolist()
                found[key_of] = {names[i]: q[..., i].tolist() for i in columns}
        return found

    def _joined(self, turning: str, sliding: str, joint: int | None = None) -> str:
        slides = self.slides if joint is None else self.slides[joint : joint + 1]
        if slides.all():
            return sliding
        return f"{turning} or {sliding}" if slides.any() else turning
