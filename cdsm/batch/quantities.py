"""Quantities of a batch: their shapes and labels, and what is read off many K_θ."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from cdsm import readings
from cdsm.manipulator import Manipulator
from cdsm.quantities import AXIS_DIMS, QUANTITIES, names_of
from cdsm.status import ENTRY_STATUSES, Status
from cdsm.support.result import Result
from cdsm.support.status import summary
from cdsm.support.values import Array, frozen

if TYPE_CHECKING:
    import pandas
    import xarray

Codes = NDArray[np.uint8]

READINGS: Final = ("margin", "pseudoinverse", "along", "compliance", "cartesian")
"""Quantities that :func:`read` computes."""


def shapes_of(nv: int, cables: int, directions: int) -> dict[str, tuple[int, ...]]:
    """Return the shape of each quantity at one posture."""
    sizes = {"joint": nv, "cable": cables, "direction": directions}
    sizes |= {"row": 4, "column": 4, "motion": 6, "axis": 3}
    return {
        name: tuple(sizes[dim.removesuffix("_column")] for dim in QUANTITIES[name].dims)
        for name in names_of("batch")
    }


class OfPostures(Result):
    """Base class of results with a row for each of B postures.

    Attributes:
        arm: The arm.
        q: Joint angles (B, nv) [rad].
        status: :class:`Status` of each posture (B,).
    """

    _rows = "pose"

    arm: Manipulator
    q: Array
    status: Codes

    @cached_property
    def ok(self) -> NDArray[np.bool_]:
        """Return for each posture whether all that was asked for exists, (B,)."""
        return frozen(self.status == Status.OK)

    def to_xarray(self) -> xarray.Dataset:
        """Return all quantities as a labelled Dataset in SI; needs xarray (CdsmError)."""
        dataset = super().to_xarray()
        dataset["status"].attrs = {
            "flag_values": np.array([int(status) for status in ENTRY_STATUSES], dtype=np.uint8),
            "flag_meanings": " ".join(status.word for status in ENTRY_STATUSES),
        }
        return dataset

    def to_pandas(self) -> pandas.DataFrame:
        """Return a table with a row for each posture; needs pandas (CdsmError)."""
        table = super().to_pandas()
        table["status"] = [Status(code).word for code in self.status]
        return table

    def __len__(self) -> int:
        return len(self.q)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.arm.name}, {summary(self.status)}>"

    @property
    def by_name(self) -> Mapping[str, Array]:
        """The quantities by name, (B, …) each."""
        raise NotImplementedError

    def _quantities(self) -> Iterator[tuple[str, Any, str, tuple[str, ...]]]:
        units = self._units()
        yield "q", self.q, units["joint"], ("pose", "joint")
        for name, value in self.by_name.items():
            dims = QUANTITIES[name].dims
            unit = QUANTITIES[name].unit
            if name == "tip":
                yield "tip_position", value[:, :3, 3], "m", ("pose", "axis")
                yield "tip_rotation", value[:, :3, :3], "1", ("pose", *AXIS_DIMS)
                continue
            # one direction has no axis of its own; a variable must not have the name of a dimension
            shown = value[:, None] if name == "along" and value.ndim == 1 else value
            label = f"{name}_stiffness" if name in dims else name
            yield label, shown, units.get(unit, unit), ("pose", *dims)
        yield "status", self.status, "1", ("pose",)


def derive(name: str, values: Mapping[str, Array], directions: Array) -> Array:
    """Compute a quantity of N postures from those that it reads, by its row of the table.

    Args:
        name: Name of a quantity with a formula, ``compute``.
        values: Quantities (N, …) by name, those that it reads among them.
        directions: Unit vectors u (D, 3), for a quantity along directions.

    Returns:
        The quantity (N, …); NaN where one that it reads does not exist.
    """
    quantity = QUANTITIES[name]
    assert quantity.compute is not None
    sources = [values[source] for source in quantity.reads]
    exists = ~np.any([np.isnan(x).reshape(len(x), -1).any(axis=1) for x in sources], axis=0)
    more = {"direction": directions} if "direction" in quantity.dims else {}
    existing = np.asarray(quantity.compute(*(x[exists] for x in sources), **more))
    derived = np.full((len(exists), *existing.shape[1:]), np.nan)
    derived[exists] = existing
    return derived


def read(
    names: Collection[str], K: Array, magnitudes: Array, jacobian: Array, directions: Array
) -> tuple[dict[str, Array], NDArray[np.uint8]]:
    """Compute readings of N postures, and their status; NaN where a reading does not exist.

    Args:
        names: Any of ``margin``, ``along``, ``compliance``, ``cartesian``, ``pseudoinverse``.
        K: K_θ (N, nv, nv).
        magnitudes: Sum of the magnitudes of its terms (N, nv, nv).
        jacobian: J_X (N, 6, nv).
        directions: Unit vectors u (D, 3) of ``along``.
    """
    J_v = jacobian[:, :3]
    status = np.zeros(len(K), dtype=np.uint8)
    values: dict[str, Array] = {}
    if "margin" in names:
        values["margin"] = readings.margin(K)
    if not {"cartesian", "pseudoinverse"}.isdisjoint(names):
        motions = readings.tip_motions(J_v)
        status[motions.immobile] = Status.IMMOBILE
    if "pseudoinverse" in names:
        values["pseudoinverse"] = readings.pseudoinverse(K, motions)
    if not {"along", "compliance", "cartesian"}.isdisjoint(names):
        inverse, singular = readings.invert(K, magnitudes)
        status[singular] = Status.SINGULAR
        if "along" in names:
            torque = directions @ J_v  # (N, D, n)
            moves = readings.moves_tip(torque, J_v)
            values["along"], _ = readings.along(inverse, torque, moves)
            values["along"][singular] = np.nan
        if "compliance" in names:
            values["compliance"] = readings.compliance(inverse, jacobian)
        if "cartesian" in names:
            values["cartesian"] = readings.cartesian(inverse, motions)
    return values, status
