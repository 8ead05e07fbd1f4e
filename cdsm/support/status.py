"""Status of each posture of a batch or sweep, and the Datasets of sweeps, which have one."""

from __future__ import annotations

import itertools
from enum import IntEnum, unique
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import InvalidInput, need
from cdsm.support.format import plural

if TYPE_CHECKING:
    import pandas
    import xarray


@unique
class Status(IntEnum):
    """Status of one posture of a batch or sweep. It says which quantities exist; others are NaN.

    The status names the first failure. A computation of a single posture raises the error in
    brackets instead, whose ``status`` is the name. A negative margin (unstable arm) and an infinite
    stiffness ``along`` (immobile direction) are not failures; a sweep tells the first apart as
    UNSTABLE.
    """

    OK = 0
    """All requested quantities exist."""
    BEYOND_LIMITS = 1
    """A joint angle is beyond its limit (InvalidInput): no quantity exists."""
    COINCIDENT_SITES = 2
    """Two neighbouring sites of a cable coincide (InvalidInput): no quantity exists."""
    INFEASIBLE = 3
    """No tensions within the bounds balance the arm (InfeasibleTension): only quantities of the
    joint angles alone exist."""
    SOLVER_FAILED = 4
    """The solver finds no tensions, though some exist (CdsmError): only quantities of the joint
    angles alone exist."""
    OUTSIDE_ELASTICITY = 5
    """A tension is outside the domain of its law (ElasticityRangeError): tensions, residual, active
    and load terms exist; quantities that need the cable stiffness do not."""
    SINGULAR = 6
    """K_θ is singular (SingularStiffness): along, compliance and cartesian do not exist. If the tip
    is also IMMOBILE, pseudoinverse does not exist."""
    IMMOBILE = 7
    """The tip can hardly move in some direction (SingularStiffness): cartesian and pseudoinverse do
    not exist, all other quantities exist."""
    UNSTABLE = 8
    """Only in sweeps: the arm buckles (margin ≤ 0): softest, stiffest and isotropy do not exist. If
    the tip is also IMMOBILE, cartesian and pseudoinverse do not exist."""
    PENDING = 9
    """Only in stores of sweeps: not computed yet, no quantity exists."""


def summary(status: NDArray[np.uint8]) -> str:
    """Count the postures with each status in a text: ``9 postures: 8 OK, 1 SINGULAR``."""
    counts = np.bincount(status, minlength=len(Status))
    listed = [f"{counts[each]} {each.name}" for each in Status if counts[each] or each == Status.OK]
    return f"{plural(len(status), 'posture')}: {', '.join(listed)}"


def check_sweep(dataset: object) -> None:
    """Raise :class:`~cdsm.InvalidInput` if an object is not the Dataset of a sweep."""
    need("sweep", "xarray")
    import xarray

    if not isinstance(dataset, xarray.Dataset):
        raise InvalidInput("dataset", f"{dataset!r} given; the Dataset of a sweep is needed.")
    if not {"flag_values", "flag_meanings"} <= set(dataset.get("status", xarray.DataArray()).attrs):
        raise InvalidInput("dataset", "has no status; the Dataset of a sweep is needed.")


def status_names(dataset: xarray.Dataset) -> dict[int, str]:
    """Return the name of each status of a sweep by its number, read from the attributes."""
    flags = dataset["status"].attrs
    values = np.atleast_1d(flags["flag_values"]).tolist()
    return dict(zip(values, flags["flag_meanings"].split(), strict=False))


def tidy(dataset: xarray.Dataset) -> pandas.DataFrame:
    """Turn the Dataset of a sweep into a pandas table with a row for each entry of ``status``.

    The columns are the components of all variables; their names contain the unit.
    """
    import pandas

    if not dataset["status"].ndim:
        dataset = dataset.expand_dims("entry")
    status = dataset["status"]
    columns: dict[str, NDArray[Any]] = {}
    for name in (*dataset.coords, *dataset.data_vars):
        variable = dataset[name]
        if name == "status" or (variable.dims == (name,) and name not in status.dims):
            continue  # coordinates of components appear in the names of the columns
        units = f" [{variable.units}]" if variable.attrs.get("units", "1") != "1" else ""
        inner = [dim for dim in variable.dims if dim not in status.dims]
        # along dimensions that the variable lacks, its values are repeated
        full = variable.broadcast_like(status).transpose(*status.dims, *inner).values
        labels = itertools.product(*(variable[dim].values.tolist() for dim in inner))
        for label, column in zip(labels, full.reshape(status.size, -1).T, strict=True):
            columns["_".join(map(str, (name, *label))) + units] = column
    words = status_names(dataset)
    columns["status"] = np.array([words.get(k, str(k)) for k in status.values.ravel().tolist()])
    return pandas.DataFrame(columns)
