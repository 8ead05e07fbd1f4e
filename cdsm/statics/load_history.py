"""States of an arm with friction under a series of loads and motor commands."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import NDArray

import cdsm
from cdsm.friction.stuck import assemble_segments
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Friction, Stiffness
from cdsm.support.format import plain, without_rounding
from cdsm.support.tidy import data_frame, dataset, write_labelled
from cdsm.support.validation import whole_number
from cdsm.support.values import Array, ReadOnlyState, frozen

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

_SHOWN = 24
"""Largest number of loads that ``print`` shows; of more loads it shows the first and last ones."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class LoadHistory(ReadOnlyState):
    """States of an arm with friction, load by load; made by :func:`~cdsm.load_cycle`.

    There are n loads. The S segments and P holes are in the order of :attr:`Posture.segments`. The
    natural length of wire is its length at zero strain. All arrays are read-only.

    Attributes:
        reference: Posture at which the motors were locked.
        reference_tension: F (C,) [N] at the reference, the same in all segments of a cable.
        reference_wrench: W at the reference (6,): force [N], then moment [N m].
        wrenches: W at each load (n, 6): force [N], then moment [N m].
        motors: Commands at each load (n, C): natural length [m] that a position-controlled motor
            has taken in since the reference, or the tension [N] of a force-controlled one.
        angles: Joint coordinates at each load (n, nv) [rad].
        tip: Position of the tip at each load (n, 3) [m].
        segment_tensions: T of each segment at each load (n, S) [N].
        slip: Natural length of wire that moved through each hole during the step to each load (n,
            P) [m]; positive towards the end of the cable.
        sliding: Where the cable slides as the load is reached (n, P): 1 if wire moves through the
            hole towards the end of the cable, −1 if towards its motor, 0 if the cable sticks or the
            hole has no friction.
        reaction: Torque of the stops on the joints at each load (n, nv) [N m].
        load_work: Work of the load during the step to each load (n,) [J].
        dissipated: Work lost to friction in the same step (n,) [J]; never negative.
        snaps: Whether the arm snaps through in the step to each load (n,).
    """

    reference: Posture
    reference_tension: Array
    reference_wrench: Array
    wrenches: Array
    motors: Array
    angles: Array
    tip: Array
    segment_tensions: Array
    slip: Array
    sliding: NDArray[np.int8]
    reaction: Array
    load_work: Array
    dissipated: Array
    snaps: NDArray[np.bool_]

    @cached_property
    def displacement(self) -> Array:
        """Displacement of the tip from the reference at each load (n, 3) [m]."""
        return frozen(self.tip - self.reference.tip[:3, 3])

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences with the loads at which the arm snaps through; empty if it never does.

        All states after a snap-through can depend on the sub-steps.
        """
        return tuple(f"SNAPS THROUGH at load {k + 1}" for k in np.flatnonzero(self.snaps).tolist())

    @cached_property
    def tensions(self) -> tuple[Array, ...]:
        """Tensions of the segments of each cable, from motor to end: one (n, segments) [N] each."""
        cable = self.reference.segments.chains.cable
        parts = np.split(self.segment_tensions, np.flatnonzero(np.diff(cable)) + 1, axis=1)
        return tuple(frozen(part.copy()) for part in parts)

    @property
    def holes(self) -> tuple[str, ...]:
        """Name of each hole (P,): its cable, and the number of the site from the actuator."""
        chains, cables = self.reference.segments.chains, self.reference.arm.cables
        pairs = zip(chains.cable[chains.hole], chains.site, strict=True)
        return tuple(f"{cables[c].name} site {site + 1}" for c, site in pairs)

    def pose(self, load: int) -> Posture:
        """Return the posture at load number ``load``, from 0; a negative one counts from the end.

        Raises InvalidInput if there is no such load.
        """
        return self.reference.arm.at(self.angles[self._index(load)], check_limits=False)

    def stiffness(self, load: int) -> Stiffness:
        """Compute the tangent stiffness at load number ``load``, from 0; −1 is the last load.

        It is valid while the cables continue to slide in the same holes and directions.
        """
        k = self._index(load)
        signs = self.sliding[k]
        friction: Friction = "sliding" if signs.any() else "stuck"
        T, W = self.segment_tensions[k].copy(), self.wrenches[k].copy()
        return assemble_segments(self.pose(k), T, signs, frozen(W), friction)

    def to_xarray(self) -> xarray.Dataset:
        """Return the states as a labelled Dataset in SI units; needs xarray (MissingExtra)."""
        arm, chains = self.reference.arm, self.reference.segments.chains
        names = np.array(arm.cables.names)
        first = np.flatnonzero(np.diff(chains.cable, prepend=-1))
        of = chains.cable[chains.hole]
        axes = list("xyz")
        labels: dict[str, Sequence[object] | NDArray[Any]] = {
            "load": np.arange(1, len(self.tip) + 1),
            "axis": axes,
            "component": [f"{kind}{axis}" for kind in "fm" for axis in axes],
            "joint": arm.joint_names,
            "cable": arm.cables.names,
            "hole": self.holes,
        }
        of_holes = {
            "hole_cable": ("hole", names[of]),
            "hole_site": ("hole", chains.site + 1),
            "segment_cable": ("segment", names[chains.cable]),
            "segment_number": ("segment", np.arange(len(chains.cable)) - first[chains.cable] + 1),
        }
        variables: dict[str, tuple[tuple[str, ...], NDArray[Any], str]] = {
            "wrench": (("load", "component"), self.wrenches, "N, N m"),
            "motor": (("load", "cable"), self.motors, "m, or N of a force-controlled cable"),
            "joint_position": (("load", "joint"), self.angles, "rad, or m where a joint slides"),
            "tip": (("load", "axis"), self.tip, "m"),
            "tip_displacement": (("load", "axis"), self.displacement, "m"),
            "segment_tension": (("load", "segment"), self.segment_tensions, "N"),
            "slip": (("load", "hole"), self.slip, "m"),
            "sliding": (("load", "hole"), self.sliding, "1"),
            "stop_torque": (("load", "joint"), self.reaction, "N m, or N where a joint slides"),
            "load_work": (("load",), self.load_work, "J"),
            "dissipated": (("load",), self.dissipated, "J"),
            "snaps": (("load",), self.snaps, "1"),
        }
        title = f"slow loading of {arm.name}, with friction in the holes"
        return dataset(variables, labels, title=title).assign_coords(of_holes)

    def to_pandas(self) -> pandas.DataFrame:
        """Return a table in SI units with a row per load; needs pandas (MissingExtra)."""
        loads, moved = self.wrenches.T, self.displacement.T
        columns: dict[str, NDArray[Any]] = {
            **{f"force {axis} [N]": force for axis, force in zip("xyz", loads[:3], strict=True)},
            **{f"moment {axis} [N m]": part for axis, part in zip("xyz", loads[3:], strict=True)},
            **{f"displacement {axis} [m]": part for axis, part in zip("xyz", moved, strict=True)},
            "sliding holes": np.count_nonzero(self.sliding, axis=1),
            "load work [J]": self.load_work,
            "dissipated [J]": self.dissipated,
        }
        for cable, T in zip(self.reference.arm.cables.names, self.tensions, strict=True):
            columns |= {f"{cable} segment {j + 1} [N]": own for j, own in enumerate(T.T)}
        return data_frame(columns, "load", np.arange(1, len(self.tip) + 1))

    def to_dict(self) -> dict[str, object]:
        """Return loads, displacements, sliding holes and energies in SI for JSON, with units."""
        numbers = {
            "wrenches_N_and_Nm": self.wrenches,
            "tip_displacements_m": self.displacement,
            "holes": self.holes,
            "sliding": self.sliding,
            "load_work_J": self.load_work,
            "dissipated_J": self.dissipated,
        }
        return plain(numbers)

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write :meth:`to_pandas` (``.csv``) or :meth:`to_xarray` (``.nc``); return the path.

        Raises:
            InvalidInput: The path ends neither in ``.csv`` nor in ``.nc``.
            MissingExtra: pandas or netCDF4 is not installed.
            FileError: The file cannot be written.
        """
        return write_labelled(path, self.to_pandas, self.to_xarray)

    def plot(self) -> Figure:
        """Plot force against tip displacement, and the tensions of the segments of one cable.

        The cable is the one whose segments differ most in tension.
        """
        return cdsm.plots.plot_load_history(self)

    def __repr__(self) -> str:
        return f"<LoadHistory of {self.reference.arm.name}, {len(self.tip)} loads>"

    def __str__(self) -> str:
        count = len(self.tip)
        rows = [
            f"{'load':>5}{'force [N]':>35}{'tip moved by [mm]':>30}"
            f"{'sliding':>9}{'work [mJ]':>12}{'lost [mJ]':>12}"
        ]
        moves, works = without_rounding(self.displacement), without_rounding(self.load_work)
        for k in range(count):
            if count > _SHOWN and _SHOWN // 2 <= k < count - _SHOWN // 2:
                if k == _SHOWN // 2:
                    rows.append(f"{'…':>5}")
                continue
            force = "".join(f"{f:>11.4g}" for f in self.wrenches[k, :3])
            moved = "".join(f"{1000.0 * x:>z10.4f}" for x in moves[k])
            rows.append(
                f"{k + 1:>5}  {force}{moved}{np.count_nonzero(self.sliding[k]):>9}"
                f"{1000.0 * works[k]:>12.4g}{1000.0 * self.dissipated[k]:>12.4g}"
            )
        lost = 1000.0 * self.dissipated.sum()
        rows.append(f"{self.sliding.shape[1]} holes; in all {lost:.4g} mJ lost in the holes")
        return "\n".join(rows)

    def _index(self, load: int) -> int:
        count = len(self.tip)
        k = whole_number("load", load, -count, count - 1)
        return k % count
