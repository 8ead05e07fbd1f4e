"""Arms, postures and elasticities that the tests of sweeps share."""

import os
import signal
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

import cdsm
from cdsm.support.values import Array
from cdsm.sweeps.quantities import QUANTITIES

EVERYTHING = tuple(name for name in QUANTITIES if name != "force_radius")
"""All quantities that need no upper bound of the tensions and no size of the wire."""

STEEL = cdsm.LinearElasticity(48e3)
LAWS = {"strand": cdsm.presets.STRAND_1X19, "steel": STEEL}
WRENCHES = {"none": np.zeros(6), "pulled": np.array([1.0, 0.5, -2.0, 0.0, 0.05, 0.1])}


def short_arm(elasticity: cdsm.Elasticity = STEEL, spring: float = np.inf) -> cdsm.Manipulator:
    """Three universal joints, and limits that a grid can go beyond."""
    geometry = cdsm.Geometry.universal(
        joints=3,
        cables_per_joint=3,
        link_length=0.05,
        base_length=0.02,
        disk_offset=0.01,
        hole_radius=0.02,
        link_mass=0.1,
    )
    cables = cdsm.serpentine_cables(geometry, elasticity, series_stiffness=spring)
    return cdsm.Manipulator(geometry, cables=cables, gravity=(0.0, -2.0, -9.0))


GRID = cdsm.GridPoses(
    {"joint1_1": [-0.4, 0.1, 2.0], "joint3_2": np.linspace(-0.3, 0.3, 4)}, {"joint2_1": 0.2}
)
CASES: dict[str, Any] = {"minimum": [1.0, 20.0, 60.0], "elasticity": LAWS, "wrench": WRENCHES}
"""Postures within and beyond the limits, bounds below and in the domain of the strand."""


class Deadly(cdsm.Elasticity):
    """A wire that kills the process that asks for its rigidity, once it comes to a file "die…".

    Attributes:
        folder: Its files are taken away one by one, in the order of their names.
        least: Only under tensions above it [N].
    """

    folder: str
    least: float

    def __init__(self, folder: str, low: float = 0.0) -> None:
        table = STEEL._knots, STEEL._coefficients
        super().__init__(0.0, 1e6, 0.0, "", {"folder": folder}, 5e4, *table)
        self.folder, self.least = folder, low

    def _evaluate(self, F: Array) -> tuple[Array, Array]:
        if np.max(F, initial=0.0) > self.least:
            for order in sorted(Path(self.folder).iterdir())[:1]:
                with suppress(FileNotFoundError):  # another process was faster
                    order.unlink()
                    if order.name.startswith("die"):
                        os.kill(os.getpid(), signal.SIGKILL)
        return STEEL._evaluate(F)
