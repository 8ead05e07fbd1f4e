"""Quantities of a batch: dimensions, units, what each one needs, and readings of many K_θ by numpy.

Formulas and thresholds of the readings are those of :mod:`cdsm.stiffness_matrix.value`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from cdsm.manipulator import Manipulator
from cdsm.stiffness_matrix.value import FLAT, REGULAR, UNMOVED
from cdsm.support.format import JointUnits
from cdsm.support.result import Result
from cdsm.support.status import Status, summary
from cdsm.support.values import Array, frozen

if TYPE_CHECKING:
    import pandas
    import xarray

Codes = NDArray[np.uint8]

_JOINTS: Final = ("joint", "joint_column")
_MOTIONS: Final = ("motion", "motion_column")
_AXES: Final = ("axis", "axis_column")
_SIX: Final = ("x", "y", "z", "rx", "ry", "rz")

DIMENSIONS: Final[dict[str, tuple[tuple[str, ...], str]]] = {
    # these need the joint angles alone
    "tip": (("row", "column"), "1"),
    "jacobian": (("motion", "joint"), "1"),
    "cable_lengths": (("cable",), "m"),
    "length_jacobian": (("cable", "joint"), "lever"),
    "gravity_torque": (("joint",), "torque"),
    "gravity": (_JOINTS, "joint stiffness"),
    "springs": (_JOINTS, "joint stiffness"),
    # these also need tensions
    "tension": (("cable",), "N"),
    "residual": (("joint",), "torque"),
    "active": (_JOINTS, "joint stiffness"),
    "load": (_JOINTS, "joint stiffness"),
    # these also need the stiffness of the cables
    "cable_stiffness": (("cable",), "N/m"),
    "passive": (_JOINTS, "joint stiffness"),
    "joint": (_JOINTS, "joint stiffness"),
    "margin": ((), "joint stiffness"),
    "pseudoinverse": (_AXES, "N/m"),
    # these also need a regular K_θ
    "along": (("direction",), "N/m"),
    "compliance": (_MOTIONS, "1"),
    "cartesian": (_AXES, "N/m"),
}
"""Dimensions and unit of each quantity.

The unit is 1 for matrices whose entries have different SI units. "torque", "joint stiffness" and
"lever" depend on the joints of the arm: N m, N m/rad and m/rad, or N, N/m and 1 for prismatic ones.
"""

_NAMES: Final = tuple(DIMENSIONS)
OF_POSTURE: Final = _NAMES[: _NAMES.index("tension")]
OF_TENSION: Final = _NAMES[_NAMES.index("tension") : _NAMES.index("cable_stiffness")]
READINGS: Final = _NAMES[_NAMES.index("margin") :]
TERMS: Final = ("active", "passive", "gravity", "load", "springs")


def shapes_of(nv: int, cables: int, directions: int) -> dict[str, tuple[int, ...]]:
    """Return the shape of each quantity at one posture."""
    sizes = {"joint": nv, "cable": cables, "direction": directions}
    sizes |= {"row": 4, "column": 4, "motion": 6, "axis": 3}
    return {
        name: tuple(sizes[each.removesuffix("_column")] for each in dims)
        for name, (dims, _) in DIMENSIONS.items()
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
        found = super().to_xarray()
        found["status"].attrs = {
            "flag_values": np.array([int(each) for each in Status], dtype=np.uint8),
            "flag_meanings": " ".join(each.name.lower() for each in Status),
        }
        return found

    def to_pandas(self) -> pandas.DataFrame:
        """Return a table with a row for each posture; needs pandas (CdsmError)."""
        table = super().to_pandas()
        table["status"] = [Status(each).name.lower() for each in self.status]
        return table

    def __len__(self) -> int:
        return len(self.q)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.arm.name}, {summary(self.status)}>"

    def _units(self) -> dict[str, str]:
        return {**super()._units(), "lever": JointUnits(self.arm.slides).joined("m/rad", "1")}

    def _labels(self) -> dict[str, Sequence[object]]:
        labels = super()._labels()
        return {**labels, **dict.fromkeys(_MOTIONS, _SIX), "axis_column": labels["axis"]}

    def _of(self, values: Mapping[str, Array]) -> Iterator[tuple[str, Any, str, tuple[str, ...]]]:
        """Yield name, value, unit and dimensions of ``values`` (B, …)."""
        units = self._units()
        yield "q", self.q, units["joint"], ("pose", "joint")
        for name, value in values.items():
            dims, unit = DIMENSIONS[name]
            if name == "tip":
                yield "tip_position", value[:, :3, 3], "m", ("pose", "axis")
                yield "tip_rotation", value[:, :3, :3], "1", ("pose", *_AXES)
                continue
            # one direction has no axis of its own; a variable must not have the name of a dimension
            shown = value[:, None] if name == "along" and value.ndim == 1 else value
            label = "joint_stiffness" if name == "joint" else name
            yield label, shown, units.get(unit, unit), ("pose", *dims)
        yield "status", self.status, "1", ("pose",)


def read(
    names: Collection[str], K: Array, parts: Array, jacobian: Array, directions: Array
) -> tuple[dict[str, Array], NDArray[np.uint8]]:
    """Compute readings of N postures, and their status; NaN where a reading does not exist.

    Args:
        names: Any of ``margin``, ``along``, ``compliance``, ``cartesian``, ``pseudoinverse``.
        K: K_θ (N, nv, nv).
        parts: Sum of the magnitudes of its terms (N, nv, nv).
        jacobian: J_X (N, 6, nv).
        directions: Unit vectors u (D, 3) of ``along``.
    """
    Jv = jacobian[:, :3]
    status = np.zeros(len(K), dtype=np.uint8)
    found: dict[str, Array] = {}
    if "margin" in names:
        found["margin"] = np.asarray(np.linalg.eigvalsh((K + _transposed(K)) / 2.0)[:, 0])
    if not {"cartesian", "pseudoinverse"}.isdisjoint(names):
        B, S, V = np.linalg.svd(Jv, full_matrices=False)
        still = S[:, -1] <= FLAT * S[:, 0] if S.shape[1] == 3 else np.ones(len(K), np.bool_)
        status[still] = Status.IMMOBILE
        with np.errstate(all="ignore"):
            A = B / S[:, None]
    if "pseudoinverse" in names:
        found["pseudoinverse"] = _between(A, V @ K @ _transposed(V), still)
    if not {"along", "compliance", "cartesian"}.isdisjoint(names):
        inverse, singular = _inverse(K, parts)
        status[singular] = Status.SINGULAR
        if "along" in names:
            torque = directions @ Jv  # (N, D, nv)
            compliance = (torque @ inverse * torque).sum(axis=2)
            moves = abs(torque).max(axis=2) > UNMOVED * abs(Jv).max(axis=(1, 2))[:, None]
            with np.errstate(divide="ignore"):
                found["along"] = np.where(moves, 1.0 / compliance, np.inf)
            found["along"][singular] = np.nan
        if "compliance" in names:
            found["compliance"] = jacobian @ inverse @ _transposed(jacobian)
        if "cartesian" in names:
            held = ~(still | singular)
            inner = np.full((len(K), V.shape[1], V.shape[1]), np.nan)
            inner[held] = np.linalg.inv((V @ inverse @ _transposed(V))[held])
            found["cartesian"] = _between(A, inner, ~held)
    return found, status


def _inverse(K: Array, parts: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return K_θ⁻¹ and where it does not exist; there it is NaN."""
    D = np.diagonal(parts, axis1=1, axis2=2)
    with np.errstate(all="ignore"):
        scale = 1.0 / np.sqrt(D)
        both = scale[:, :, None] * scale[:, None]
        A = K * both
        least = REGULAR * (parts * both).max(axis=(1, 2))
        try:
            inverse = np.linalg.inv(A)
        except np.linalg.LinAlgError:  # at least one of them is singular to the last bit
            least_values = np.array([np.linalg.svd(each, compute_uv=False)[-1] for each in A])
            inverse = np.full_like(A, np.nan)
            inverse[least_values > least] = np.linalg.inv(A[least_values > least])
        # 1/|A⁻¹| is a lower bound of the smallest singular value of A
        singular = ~(least * np.sqrt((inverse**2).sum(axis=(1, 2))) < 1.0)
    regular = np.flatnonzero(singular & (D.min(axis=1) > 0.0))
    if regular.size:
        values = np.linalg.svd(A[regular], compute_uv=False)[:, -1]
        singular[regular] = ~(values > least[regular])
    inverse[singular] = np.nan
    return inverse * both, singular


def _between(A: Array, inner: Array, missing: NDArray[np.bool_]) -> Array:
    """Compute A K Aᵀ (N, 3, 3), NaN where it is missing or the tip has fewer than three joints."""
    if A.shape[2] < 3:
        return np.full((len(A), 3, 3), np.nan)
    found = A @ inner @ _transposed(A)
    found[missing] = np.nan
    return np.asarray(found)


def _transposed(a: Array) -> Array:
    return a.swapaxes(-1, -2)
