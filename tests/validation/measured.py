"""Measured arms beside what cdsm predicts of them: ``python -m tests.validation.measured``.

Each row says what was fitted, and to what. docs/reference/validation.md shows the table.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import cdsm
from cdsm.presets.spirob import MEASURED_JOINTS
from cdsm.springs.fit import SpringFit
from cdsm.support.values import Array
from tests.validation import rod, tentacle

PULLS = (0.005, 0.010)  # of one tendon of the Nitinol segment [m]
HEIGHTS = np.array([[233.0, 235.0, 233.0], [171.0, 168.0, 169.0]])
"""Measured heights of its tip [mm], with each tendon in turn (2, 3)."""


@dataclass(frozen=True)
class Row:
    """One arm, one set of fitted numbers: predicted minus measured points, and how far they moved.

    ``errors`` of the fitted numbers are (…, k) [mm], ``moved`` as its last axes; ``fitted`` has the
    numbers that were fitted here, by what they are called, ``kept`` all others.
    """

    arm: str
    points: str
    errors: Callable[..., Array]
    moved: Array
    fitted: dict[str, float]
    kept: dict[str, float]
    camera: str = "0"  # numbers of the camera that were fitted to the same points
    authors: str = "–"
    tip: bool = False

    def off(self, **values: float) -> Array:
        """Return the errors (…, k) [mm]; ``values`` replace those that were fitted."""
        return self.errors(**self.kept | self.fitted | values)

    @property
    def rms(self) -> float:
        """Root mean square of the distances [mm]."""
        return root_mean_square(self.off())

    @property
    def share(self) -> float:
        """That over the root mean square of how far the same points moved [%]."""
        return 100.0 * self.rms / root_mean_square(self.moved)

    @property
    def friction(self) -> str:
        return "on" if (self.kept | self.fitted).get("μ") else "off"

    @property
    def cells(self) -> list[str]:
        """Cells of the row in the table."""
        named = ", ".join(f"{name} = {value:g}{UNITS[name]}" for name, value in self.fitted.items())
        count = f"{len(self.fitted)}" + (f" + {self.camera}" if self.camera != "0" else "")
        off = f"{self.rms:.2f}" if self.rms < 10.0 else f"{self.rms:.1f}"
        if self.tip:
            off += f" (tip {root_mean_square(self.off()[..., -1, :]):.1f})"
        cells = [self.arm, self.points, named or "nothing", count, self.friction]
        return [*cells, off, f"{self.share:.1f}", self.authors]


UNITS = {"E": " GPa", "μ": "", "E_s": " kPa", "ρ": " kg/m³", "slack": " mm"}


def root_mean_square(vectors: Array) -> float:
    """Root of the mean square length of vectors (…, k)."""
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=-1))))


def rows() -> list[Row]:
    """Return the whole table."""
    return [*rod_rows(), *segment_rows(), *tentacle_rows()]


def rod_rows() -> Iterator[Row]:
    shapes = rod.shapes_in_plane()
    name, nominal = "rod with one tendon", {"E": 50.0, "μ": 0.0}

    def plane(E: float, μ: float) -> Array:
        return (rod.in_plane(rod.predicted(E, μ)) - shapes)[1:]

    def as_authors(E: float, μ: float) -> Array:
        return rod.seen_from_straight(rod.predicted(E, μ)) - rod.POINTS

    def free(E: float, μ: float) -> Array:
        return rod.seen_by_camera(rod.predicted(E, μ)) - rod.POINTS

    moved = shapes[1:] - shapes[0]
    points = "8 shapes × 11 disks, in the plane"
    for fitted in ({}, {"E": 86.0}, {"E": 80.7, "μ": 0.0946}):
        yield Row(name, points, plane, moved, fitted, nominal, "6")
    moved = (rod.POINTS - rod.POINTS[0])[1:]
    points = "9 shapes × 11 disks, in space, frame of the straight one"
    theirs = "2.72 mm: E, roll, frame"
    for fitted in ({"E": 85.5}, {"E": 79.2, "μ": 0.107}):
        yield Row(name, points, as_authors, moved, fitted, nominal, "6", theirs)
    points = "9 shapes × 11 disks, in space, frame of all"
    for fitted in ({"E": 86.3}, {"E": 77.2, "μ": 0.126}):
        yield Row(name, points, free, moved, fitted, nominal, "6")


def segment_rows() -> Iterator[Row]:
    model = cdsm.ArmParameters(cdsm.presets.nitinol_segment(), ("slack",))

    def heights(slack: float) -> Array:
        arm = model(slack=1e-3 * slack)
        rests = [cdsm.forward_statics(arm, pull={"cable10_1": pull}) for pull in PULLS]
        tips = np.array([1e3 * rest.pose.tip[0, 3] for rest in rests])
        return (tips[:, None] - HEIGHTS)[..., None]

    moved = (HEIGHTS - 250.0)[..., None]
    name, points = "Nitinol segment", "6 heights of the tip"
    for fitted, theirs in (({}, "14.0 mm: nothing"), ({"slack": 1.02}, "–")):
        yield Row(name, points, heights, moved, fitted, {"slack": 0.0}, authors=theirs)


def tentacle_rows() -> Iterator[Row]:
    def errors(E_s: float, μ: float, ρ: float) -> Array:
        return tentacle.predicted(E_s, μ, ρ) - tentacle.MARKERS

    moved = tentacle.MARKERS - tentacle.straight()
    name, points = "silicone tentacle", "8 shapes × 4 markers"
    start = {"E_s": 505.0, "μ": 0.0, "ρ": 1500.0}
    fits: list[tuple[dict[str, float], str]] = [
        ({}, "56.9 (tip 108.6) mm: nothing"),
        ({"E_s": 366.7}, "–"),
        ({"E_s": 296.8, "μ": 0.109}, "–"),
        ({"E_s": 404.0, "ρ": 1050.0}, "22.9 (tip 35.6) mm: E, ν, ρ"),
        ({"E_s": 280.8, "μ": 0.157, "ρ": 1267.0}, "–"),
    ]
    for fitted, theirs in fits:
        yield Row(name, points, errors, moved, fitted, start, authors=theirs, tip=True)


HEAD = ["arm", "measured", "fitted here", "numbers", "friction", "RMSE [mm]", "%", "authors' model"]


def markdown(table: list[Row]) -> str:
    lines = ["| " + " | ".join(HEAD) + " |", "|---|---|---|--:|---|--:|--:|---|"]
    lines += ["| " + " | ".join(row.cells).replace("E_s", "E") + " |" for row in table]
    return "\n".join(lines)


SPIROB = np.loadtxt(
    Path(__file__).parents[1] / "data" / "spirob_joints.csv", delimiter=",", skiprows=3
)
"""Joint of the SpiRob, angle [°] and torque [mN m]."""

STOP = math.radians(29.0)
"""Angle at which hinges 1 and 11 of the SpiRob are at their stops."""


def spring_fits() -> dict[int, SpringFit]:
    """Fit a law to each measured hinge of the SpiRob, without the points at a stop."""
    fits = {}
    for joint in MEASURED_JOINTS:
        _, angles, torques = SPIROB[SPIROB[:, 0] == joint].T
        most = STOP if joint in (1, 11) else math.inf
        fits[joint] = cdsm.fit_spring(np.deg2rad(angles), 1e-3 * torques, between=(0.0, most))
    return fits


def springs_markdown() -> str:
    head = ["hinge", "points", "linear spring, 1 number: RMS", "law, 2 numbers: RMS"]
    lines = ["| " + " | ".join([*head, "k at rest, a = 2° [N m/rad]", "exponent"]) + " |"]
    lines.append("|--:|--:|--:|--:|--:|--:|")
    for joint, fit in spring_fits().items():
        mean = float(np.mean(fit.torque))
        shares = [f"{100.0 * rms / mean:.1f} %" for rms in (fit.linear_rms, fit.rms)]
        exponent = f"{fit.exponent:.2f} ± {fit.exponent_std:.2f}"
        cells = [f"{joint}", f"{fit.angle.size}", *shares, f"{fit.stiffness:.2f}", exponent]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


if __name__ == "__main__":
    print(markdown(rows()))
    print()
    print(springs_markdown())
