"""The Dataset of a sweep: quantities of postures and cases, with labels and units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.quantities import QUANTITIES, udunits
from cdsm.status import ENTRY_STATUSES
from cdsm.stiffness_matrix.prints import frictionless_model
from cdsm.support.format import JointUnits
from cdsm.support.progress import progress_bar
from cdsm.support.result import MOTION_NAMES
from cdsm.support.validation import XYZ
from cdsm.support.values import Array
from cdsm.sweeps.cases import CASES, Cases

if TYPE_CHECKING:
    import xarray

_FAST = 2**15  # rows that are computed together, also with measures of milliseconds
_SLOW = 2**8


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Labelled(Cases):
    """Cases with names, and their Dataset."""

    names: Mapping[str, Sequence[object] | None]  # of wrenches, minima, directions; None: only one

    @property
    def together(self) -> int:
        """Return the number of postures that are computed together, in about a second at most."""
        return max(1, (_SLOW if self.is_slow else _FAST) // self.count)

    def dataset(self, q: xarray.DataArray, progress: bool = False) -> xarray.Dataset:
        """Compute the cases at joint angles q (…, joint) [rad], by all threads and with a bar.

        If q is chunked, the Dataset is lazy; a chunk is then computed by one thread.
        """
        import xarray

        names = (*self.outputs, "status")
        dims = [_dims(name) for name in names]
        by_joint = q.coords.keys() >= {*self.arm.joint_names}  # a coordinate for each, as of a grid
        coordinates = self._coordinates() if by_joint else {**self._coordinates("joint"), "q": q}
        taken = {*names, *coordinates, *CASES}
        for name in map(str, q.coords.keys() - {"joint"}):
            if name in taken or "/" in name:
                problem = "is another variable of the Dataset, or no name that files accept"
                remedy = "Rename it in the URDF, or sweep over a path or random postures"
                raise InvalidInput("angles", f"joint {name!r} of the grid {problem}. {remedy}.")
        variables = xarray.apply_ufunc(
            self._compute,
            q,
            kwargs={"threads": None, "progress": progress} if q.chunks is None else {},
            input_core_dims=[["joint"]],
            output_core_dims=dims,
            dask="parallelized",
            output_dtypes=[_dtype(name) for name in names],
            dask_gufunc_kwargs={"output_sizes": {d: self.sizes[d] for core in dims for d in core}},
        )
        dataset = xarray.Dataset(dict(zip(names, variables, strict=True)), attrs=self._about())
        dataset.attrs["poses"] = q.attrs.get("poses", "as given")
        for name in names:
            dataset[name].attrs = self._attributes(name)
        only = {dim: 0 for dim, labels in self.names.items() if labels is None}
        return dataset.assign_coords(coordinates).isel(only, missing_dims="ignore")

    def _compute(
        self, q: Array, threads: int | None = 1, progress: bool = False
    ) -> tuple[NDArray[Any], ...]:
        """Compute all outputs, then ``status``, at joint angles q (…, nv) [rad]."""
        flat = q.reshape(-1, self.arm.nv)
        parts = []
        with progress_bar("sweep", len(flat), wanted=progress) as advance:
            for start in range(0, len(flat), self.together):
                part = flat[start : start + self.together]
                parts.append(self.rows(part, threads))
                advance(len(part))
        variables = []
        for name in (*self.outputs, "status"):
            rows = np.concatenate([part[name] for part in parts])
            sizes = [self.sizes[dim] for dim in _dims(name)]
            variables.append(rows.reshape(*q.shape[:-1], *sizes))
        return tuple(variables)

    def _coordinates(self, *dims: str) -> dict[str, Any]:
        """Return the coordinates of arguments and of named dimensions, also of ``dims``."""
        used = {"axis", "cable", *CASES, *dims}
        used |= {dim for name in self.outputs for dim in _dims(name)}
        force, moment = np.split(self.acting.at_tip, 2, axis=1)
        loads = self.acting.loads
        points = loads.points if loads else ()
        on_links = loads.wrenches if loads else np.zeros((len(force), 0, 6))
        places = np.array([point.local for point in points]).reshape(-1, 3)
        used |= {"load"} if points else set()
        low, high = self.held_bounds
        coordinates: dict[str, Any] = {}
        for name, along, values, long_name, units in (
            ("force", ("wrench", "axis"), force, "force on the tip, base axes", "N"),
            ("moment", ("wrench", "axis"), moment, "moment on the tip, base axes", "N m"),
            ("load_force", ("wrench", "load", "axis"), on_links[..., :3], "force on it", "N"),
            ("load_moment", ("wrench", "load", "axis"), on_links[..., 3:], "moment on it", "N m"),
            ("load_point", ("load", "axis"), places, "where it acts, in the link's frame", "m"),
            ("minimum", ("minimum",), self.minimum, "lower bound of all tensions, as asked", "N"),
            ("minimum_held", ("minimum", "cable"), low, "lower bound of a tension that held", "N"),
            ("maximum", (), self.maximum, "upper bound of all tensions, as asked", "N"),
            ("maximum_held", ("cable",), high, "upper bound of a tension that held", "N"),
            ("diameter", (), self.diameter, "diameter of the cables", "m"),
            ("direction_vector", ("direction", "axis"), self.direction, "unit vector", "1"),
        ):
            if used.issuperset(along):
                coordinates[name] = (along, values, {"long_name": long_name, "units": units})
        labels: dict[str, Sequence[object] | None] = {"cable": self.arm.cables.names, **self.names}
        labels |= dict.fromkeys(("axis", "axis_column"), XYZ)
        labels |= dict.fromkeys(("motion", "motion_column"), MOTION_NAMES)
        labels |= dict.fromkeys(("joint", "joint_column"), self.arm.joint_names)
        for dim, names in labels.items():
            if dim in used - coordinates.keys() and names is not None:
                coordinates[dim] = _labels(dim, names)
        if points:
            links = np.array([point.link for point in points], dtype=object)
            coordinates["load_link"] = ("load", links, {"long_name": "link on which a load acts"})
        return coordinates

    def _attributes(self, name: str) -> dict[str, Any]:
        """Return the attributes of an output or of ``status``."""
        if name == "status":
            return {
                "long_name": "what became of the entry; NaN stands only where it says so",
                "units": "1",
                "flag_meanings": " ".join(status.word for status in ENTRY_STATUSES),
                "flag_values": [*map(int, ENTRY_STATUSES)],
            }
        unit = JointUnits(self.arm.slides).of(QUANTITIES[name].unit)
        return {"long_name": QUANTITIES[name].text, "units": udunits(unit)}

    def _about(self) -> dict[str, str]:
        """Return the attributes of the Dataset, which tell the arm by the text of its ARM.toml."""
        from cdsm.arm_file.arm import arm_text  # pydantic: slow to import

        try:
            arm = arm_text(self.arm.definition)
        except InvalidInput:  # laws made from functions cannot be written
            arm = _text_of_fields(self.arm)
        about = {"Conventions": "CF-1.11", "title": f"stiffness sweep of {self.arm.name}"}
        about |= {"source": f"cdsm {version('cdsm-stiffness')}", "arm": arm}
        about["model"] = frictionless_model(self.arm)
        if self.worst_friction:
            about["worst_friction"] = "all segments stay within the bounds, whatever came before"
        return about


def _dims(name: str) -> list[str]:
    """Return the dimensions of an output or of ``status`` behind those of the postures."""
    if name == "status":
        return [*CASES]
    quantity = QUANTITIES[name]
    return [*(() if quantity.needs == "posture" else CASES), *quantity.dims]


def _dtype(name: str) -> type[np.generic]:
    """Return the type of the entries of an output or of ``status``."""
    if name == "status":
        return np.int8
    return np.bool_ if QUANTITIES[name].is_flag else np.float64


def _labels(dim: str, names: Sequence[object]) -> tuple[str, NDArray[Any], dict[str, str]]:
    """Return the coordinate of a dimension with names or numbers."""
    if isinstance(names[0], str):
        return dim, np.array(names, dtype=object), {"long_name": f"name of the {dim}"}
    about = {"long_name": f"number of the {dim}", "units": "1"}
    return dim, np.array(names, dtype=np.int64), about


def _text_of_fields(arm: Manipulator) -> str:
    """Describe an arm by TOML with the ``repr`` of each of its fields, and of those of cables."""
    from cdsm.support.records import toml_text  # pydantic: slow to import

    table: dict[str, Any] = {name: repr(value) for name, value in vars(arm.definition).items()}
    table["cables"] = {
        cable.name: {field.name: repr(getattr(cable, field.name)) for field in fields(cable)}
        for cable in arm.cables
    }
    return toml_text(table)
