"""The Dataset of a sweep: quantities of postures and cases, with labels and units."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import FileError, InvalidInput
from cdsm.status import ENTRY_STATUSES
from cdsm.stiffness_matrix.prints import frictionless_model
from cdsm.support.format import JointUnits
from cdsm.support.progress import progress_bar
from cdsm.support.validation import XYZ
from cdsm.support.values import Array
from cdsm.sweeps.cases import CASES, QUANTITIES, Cases

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
        return max(1, (_SLOW if self.slow else _FAST) // self.count)

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
            output_dtypes=[np.int8 if name == "status" else np.float64 for name in names],
            dask_gufunc_kwargs={"output_sizes": {d: self.sizes[d] for each in dims for d in each}},
        )
        found = xarray.Dataset(dict(zip(names, variables, strict=True)), attrs=self._about())
        found.attrs["poses"] = q.attrs.get("poses", "as given")
        for name in names:
            found[name].attrs = self._attributes(name)
        one = {dim: 0 for dim, several in self.names.items() if several is None}
        return found.assign_coords(coordinates).isel(one, missing_dims="ignore")

    def _compute(
        self, q: Array, threads: int | None = 1, progress: bool = False
    ) -> tuple[NDArray[Any], ...]:
        """Compute all outputs, then ``status``, at joint angles q (…, nv) [rad]."""
        flat = q.reshape(-1, self.arm.nv)
        found = []
        with progress_bar("sweep", len(flat), wanted=progress) as advance:
            for part in (flat[i : i + self.together] for i in range(0, len(flat), self.together)):
                found.append(self.rows(part, threads))
                advance(len(part))
        names = (*self.outputs, "status")
        sizes = [[self.sizes[dim] for dim in _dims(name)] for name in names]
        rows = [np.concatenate([each[name] for each in found]) for name in names]
        shapes = [(*q.shape[:-1], *own) for own in sizes]
        return tuple(row.reshape(shape) for row, shape in zip(rows, shapes, strict=True))

    def _coordinates(self, *dims: str) -> dict[str, Any]:
        """Return the coordinates of arguments and of named dimensions, also of ``dims``."""
        own = {"axis", *CASES, *dims, *(dim for name in self.outputs for dim in _dims(name))}
        force, moment = np.split(self.wrench, 2, axis=1)
        found: dict[str, Any] = {}
        for name, along, values, long_name, units in (
            ("force", ("wrench", "axis"), force, "force on the tip, base axes", "N"),
            ("moment", ("wrench", "axis"), moment, "moment on the tip, base axes", "N m"),
            ("minimum", ("minimum",), self.minimum, "lower bound of all tensions", "N"),
            ("maximum", (), self.maximum, "upper bound of all tensions", "N"),
            ("diameter", (), self.diameter, "diameter of the cables", "m"),
            ("direction_vector", ("direction", "axis"), self.direction, "unit vector", "1"),
        ):
            if own.issuperset(along):
                found[name] = (along, values, {"long_name": long_name, "units": units})
        joints = dict.fromkeys(("joint", "joint_column"), self.arm.joint_names)
        axes = dict.fromkeys(("axis", "axis_column"), XYZ)
        labels = {**axes, **joints, "cable": self.arm.cables.names, **self.names}
        for dim, names in labels.items():
            if dim in own - found.keys() and names is not None:
                words = isinstance(names[0], str)
                told = {"long_name": f"{'name' if words else 'number'} of the {dim}"}
                told |= {} if words else {"units": "1"}
                found[dim] = (dim, np.array(names, dtype=object if words else np.int64), told)
        return found

    def _attributes(self, name: str) -> dict[str, Any]:
        """Return the attributes of an output or of ``status``."""
        if name == "status":
            words = "what became of the entry; NaN stands only where it says so"
            flags = {"flag_meanings": " ".join(status.word for status in ENTRY_STATUSES)}
            return {
                "long_name": words,
                "units": "1",
                **flags,
                "flag_values": [*map(int, ENTRY_STATUSES)],
            }
        units = QUANTITIES[name].units
        of_slides = {"N m": "N", "N m rad-1": "N m-1"}
        if units in of_slides:
            units = JointUnits(self.arm.slides).joined(units, of_slides[units])
        return {"long_name": QUANTITIES[name].long_name, "units": units}

    def _about(self) -> dict[str, str]:
        """Return the attributes of the Dataset, which tell the arm by the text of its ARM.toml."""
        from cdsm.arm_file.arm import arm_text  # pydantic: slow to import

        try:
            arm = arm_text(self.arm)
        except InvalidInput:  # laws made from functions cannot be written
            arm = f"{self.arm.__getstate__() | {'cables': [*self.arm.cables]}}"
        about = {"Conventions": "CF-1.11", "title": f"stiffness sweep of {self.arm.name}"}
        about |= {"source": f"cdsm {version('cdsm-stiffness')}", "arm": arm}
        about["model"] = frictionless_model(self.arm)
        if self.worst_friction:
            about["worst_friction"] = "all segments stay within the bounds, whatever came before"
        return about


def read_into_memory(data: Any, store: object) -> Any:
    """Load data of a store; raise FileError if a chunk of it is damaged."""
    try:
        return data.load()
    except RuntimeError as error:  # of the decoder
        raise FileError(store, f"is damaged ({error}); delete it, and repeat the sweep.") from None


@contextmanager
def only_writer(path: Path) -> Iterator[None]:
    """Lock a store; FileError if another sweep writes to it. The lock ends with its process."""
    folder = os.open(path, os.O_RDONLY)
    try:
        try:
            fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            said = "another sweep writes to it; wait for that one, or give another path to store."
            raise FileError(path, said) from None
        yield
    finally:
        os.close(folder)


def _dims(name: str) -> list[str]:
    """Return the dimensions of an output or of ``status`` behind those of the postures."""
    quantity = QUANTITIES.get(name)
    cases = () if quantity and quantity.needs == "posture" else CASES
    return [*cases, *(quantity.dims if quantity else ())]
