"""Base class of results: the unit and the dimensions of each number are metadata of its field."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import CdsmError, InvalidInput, need
from cdsm.quantities import QUANTITIES, UNITS_OF_JOINTS
from cdsm.status import Status
from cdsm.support.files import as_path, write_file
from cdsm.support.format import JointUnits, key, merged, prepare_json, span
from cdsm.support.values import Array, ReadOnlyState

if TYPE_CHECKING:
    import pandas
    import xarray

_T = TypeVar("_T")

AXIS_NAMES = ("x", "y", "z")
COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")
MOTION_NAMES = ("x", "y", "z", "rx", "ry", "rz")
_NAMED = {"joint", "cable", "segment", "hole", "load_component"}  # dimensions of dicts in JSON


def unit(unit: str, *dims: str, name: str = "") -> Mapping[str, Any]:
    """Return the metadata of a field: ``field(metadata=unit("N", "cable"))``.

    ``unit`` is an SI unit, "1" for a plain number, or a key of
    :data:`~cdsm.quantities.UNITS_OF_JOINTS`, which depends on whether joints turn or slide.
    ``dims`` name the axes of an array: "joint", "cable", "held_cable" (position-controlled),
    "axis", "component", or any other; a field that is called like its own and only dimension is
    the coordinate of this dimension. The dimension "direction" is left out of a value for one
    direction. ``name`` replaces the field's in the export.
    """
    return {"unit": unit, "dims": dims, "name": name}


def unit_of(name: str) -> Mapping[str, Any]:
    """Return the metadata of a field that is a quantity of :data:`~cdsm.quantities.QUANTITIES`."""
    quantity = QUANTITIES[name]
    return unit(quantity.unit, *quantity.dims, name=name)


class ArmOfResult(Protocol):
    """What a result asks of its arm: names and units of its joints, and its cables."""

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints."""

    @property
    def slides(self) -> NDArray[np.bool_]:
        """Whether each joint is prismatic (nv,)."""

    @property
    def cables(self) -> Any:
        """The cables, which have names."""


class PostureOfResult(Protocol):
    """What a result asks of its posture: the arm and the joint coordinates (nv,)."""

    @property
    def arm(self) -> ArmOfResult:
        """The arm."""

    @property
    def q(self) -> Array:
        """Joint coordinates (nv,) [rad]; [m] of prismatic joints."""


class _Quantity(cached_property[_T]):
    """A cached property with the metadata of a field."""

    metadata: Mapping[str, Any]


def quantity(
    unit_name: str, *dims: str, name: str = ""
) -> Callable[[Callable[[Any], _T]], cached_property[_T]]:
    """Make a cached property that is printed and exported like a field with :func:`unit`."""

    def decorate(compute: Callable[[Any], _T]) -> cached_property[_T]:
        cached = _Quantity(compute)
        cached.metadata = unit(unit_name, *dims, name=name)
        return cached

    return decorate


def tabulated(compute: Callable[[Any], _T]) -> cached_property[_T]:
    """Make a cached property of a quantity of :data:`~cdsm.quantities.QUANTITIES`."""
    cached = _Quantity(compute)
    cached.metadata = unit_of(compute.__name__)
    return cached


class Result(ReadOnlyState):
    """A frozen result that exports the numbers of fields and properties that have metadata.

    Subclasses write ``__str__`` by hand, nothing else; those with a figure are also
    :class:`~cdsm.support.values.Plotted`.
    """

    _headline: ClassVar[str] = ""
    """Name of the number that ``repr`` shows."""

    _rows: ClassVar[str] = ""
    """Dimension whose entries are the rows of the table; a table of one row if it is empty."""

    _posture_from: ClassVar[str] = "posture"
    """Attribute with the posture, whose joint coordinates come first in the JSON.

    Its arm, or the attribute ``arm``, names joints and cables.
    """

    @property
    def _posture(self) -> PostureOfResult | None:
        value: Any = self
        for name in self._posture_from.split("."):
            value = getattr(value, name, None)
        posture: PostureOfResult | None = value
        return posture

    @property
    def _arm(self) -> ArmOfResult | None:
        return self._posture.arm if self._posture else getattr(self, "arm", None)

    def to_dict(self) -> dict[str, object]:
        """Return all numbers in SI for JSON, with the unit in the keys; inf and NaN are None."""
        labels = self._labels()
        numbers: dict[str, object] = {}
        if pose := self._posture:
            numbers = JointUnits(pose.arm.slides).to_dict(pose.arm.joint_names, pose.q)
        for name, value, unit_name, dims in self._quantities():
            named = bool(dims) and {*dims} <= _NAMED & labels.keys()
            entries = {key(name, unit_name): _by_name(value, dims, labels) if named else value}
            if self._arm and " or " in unit_name and unit_name in self._units().values():
                units = JointUnits(self._arm.slides)
                entries = units.keyed(name, unit_name, dims, value, self._arm.joint_names)
            numbers = merged(numbers, entries)
        return prepare_json(numbers)

    def to_xarray(self) -> xarray.Dataset:
        """Return all numbers as a labelled Dataset in SI; needs xarray (CdsmError)."""
        variables = {}
        words = {}
        for name, value, unit_name, dims in self._quantities():
            array = _array(value)
            if array.dtype.kind in "USO" or array.ndim != len(dims):
                words[name] = str(value)
            else:
                variables[name] = (dims, array, unit_name)
        return dataset(variables, self._labels(), **words)

    def to_pandas(self) -> pandas.DataFrame:
        """Return a table with a unit in the name of each column; needs pandas (CdsmError)."""
        labels: dict[str, Any] = self._labels()
        columns: dict[str, Any] = {}
        for name, value, unit_name, dims in self._quantities():
            suffix = "" if unit_name == "1" else f" [{unit_name}]"
            if not self._rows and not dims:
                columns[name + suffix] = [value]
            elif dims == (name,) == (self._rows,):
                labels |= {name: np.asarray(value)}
            elif self._rows and dims[:1] == (self._rows,):
                array = _array(value)
                for place in np.ndindex(array.shape[1:]):
                    pairs = zip(dims[1:], place, strict=True)
                    parts = [str(labels[d][i] if d in labels else i + 1) for d, i in pairs]
                    end = suffix
                    if self._arm and unit_name == "rad or m":  # each joint has one of them
                        end = f" [{JointUnits(self._arm.slides).joined('rad', 'm', place[-1])}]"
                    columns[" ".join([name, *parts]) + end] = array[(slice(None), *place)]
        numbers = np.arange(len(next(iter(columns.values()), ())))  # of rows without names
        return data_frame(columns, self._rows or "result", labels.get(self._rows, numbers))

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write :meth:`to_pandas` (``.csv``) or :meth:`to_xarray` (``.nc``); return the path.

        Raises:
            InvalidInput: The path ends neither in ``.csv`` nor in ``.nc``.
            CdsmError: pandas, xarray or netCDF4 is not installed.
            FileError: The file cannot be written.
        """
        return write_labelled(path, self.to_pandas, self.to_xarray)

    def __repr__(self) -> str:
        state = "" if getattr(self, "is_stable", True) else ", UNSTABLE"
        return f"<{type(self).__name__}{self._headline_text()}{state}>"

    def _headline_text(self) -> str:
        """Return name, value and unit of the headline; nothing else is computed."""
        for attribute, metadata in self._metadata().items():
            name = metadata["name"] or attribute
            if name == self._headline:
                try:
                    value = getattr(self, attribute)
                except CdsmError:  # it does not exist here
                    return ""
                numbers = span(np.atleast_1d(value)) if np.size(value) else "none"
                unit_name = self._units().get(metadata["unit"], metadata["unit"])
                return f" {name} {numbers} {'' if unit_name == '1' else unit_name}".rstrip()
        return ""

    def _metadata(self) -> dict[str, Mapping[str, Any]]:
        """Return the metadata of each number by attribute: fields first, then properties."""
        metadata: dict[str, Mapping[str, Any]] = {
            field.name: field.metadata
            for field in fields(self)  # type: ignore[arg-type]
            if field.metadata
        }
        for kind in type(self).__mro__:
            metadata |= {n: p.metadata for n, p in vars(kind).items() if isinstance(p, _Quantity)}
        return metadata

    def _quantities(self) -> Iterator[tuple[str, Any, str, tuple[str, ...]]]:
        """Yield name, value, unit and dimensions of each number."""
        units = self._units()
        for attribute, metadata in self._metadata().items():
            value = getattr(self, attribute)
            value = value.word if isinstance(value, Status) else value
            dims = metadata["dims"]
            if "direction" in dims and np.ndim(value) < len(dims):
                dims = tuple(dim for dim in dims if dim != "direction")
            unit_name = units.get(metadata["unit"], metadata["unit"])
            yield metadata["name"] or attribute, value, unit_name, dims

    def _units(self) -> dict[str, str]:
        """Return the units that depend on the joints of the arm."""
        if not self._arm:
            return {}
        units = JointUnits(self._arm.slides)
        return {unit: units.of(unit) for unit in UNITS_OF_JOINTS}

    def _labels(self) -> dict[str, Sequence[object]]:
        """Return the names along each dimension that has names."""
        labels: dict[str, Sequence[object]] = {"axis": AXIS_NAMES, "component": COMPONENTS}
        labels |= {"axis_column": AXIS_NAMES, "motion": MOTION_NAMES, "motion_column": MOTION_NAMES}
        if self._arm:
            joints = self._arm.joint_names
            cables = self._arm.cables
            labels |= {"joint": joints, "joint_column": joints, "cable": cables.names}
            labels["held_cable"] = [cable.name for cable in cables if cable.control == "position"]
        return labels


def _array(value: Any) -> Any:
    """Return a value as an array; of a mapping, its values."""
    return np.asarray([*value.values()] if isinstance(value, Mapping) else value)


def _by_name(value: Any, dims: Sequence[str], labels: Mapping[str, Sequence[object]]) -> Any:
    """Return an array as nested dictionaries by the labels of its dimensions."""
    if not dims:
        return value
    pairs = zip(labels[dims[0]], np.asarray(value), strict=True)
    return {label: _by_name(entry, dims[1:], labels) for label, entry in pairs}


def data_frame(
    columns: Mapping[str, NDArray[Any] | Sequence[object]],
    index: str,
    labels: NDArray[Any] | Sequence[object],
) -> pandas.DataFrame:
    """Build a pandas table from columns by name; ``labels`` are its index, called ``index``."""
    need("sweep", "pandas")
    import pandas

    return pandas.DataFrame(dict(columns), index=pandas.Index(labels, name=index))


def dataset(
    variables: Mapping[str, tuple[Sequence[str], NDArray[Any], str]],
    labels: Mapping[str, Sequence[object] | NDArray[Any]],
    **attributes: str,
) -> xarray.Dataset:
    """Build a Dataset from variables, given as (dimensions, values, SI unit) by name.

    ``labels`` are the coordinates of the dimensions; those that no variable has are left out.
    """
    need("sweep", "xarray")
    import xarray

    used = {dim for dims, _, _ in variables.values() for dim in dims}
    return xarray.Dataset(
        {
            name: (tuple(dims), values.copy(), {"units": unit})
            for name, (dims, values, unit) in variables.items()
        },
        {dim: list(values) for dim, values in labels.items() if dim in used},
        attributes,
    )


def write_labelled(
    path: str | os.PathLike[str],
    table: Callable[[], pandas.DataFrame],
    labelled: Callable[[], xarray.Dataset],
) -> Path:
    """Write ``table()`` to a ``.csv`` or ``labelled()`` to a ``.nc``; only this one is called."""
    suffix = as_path(path).suffix.lower()
    if suffix not in (".nc", ".csv"):
        raise InvalidInput("path", f"{str(path)!r} ends neither in .nc (NetCDF) nor in .csv.")
    if suffix == ".csv":
        return write_file(path, table().to_csv)
    need("sweep", "netCDF4")
    data = labelled()
    return write_file(path, lambda aside: data.to_netcdf(aside, engine="netcdf4"))
