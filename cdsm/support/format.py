"""Format printed output: coordinates, units, keys of JSON."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.quantities import UNITS_OF_JOINTS, display_for
from cdsm.status import Status
from cdsm.support.values import Array

MODEL: Final = "frictionless, rigid links, tangent"
"""Assumptions of every printed stiffness."""


def coordinates(values: Iterable[float], form: str = ".4g") -> str:
    """Return a vector as text, such as ``(0, 0.5, 1)``; ``form`` is the format of each number."""
    return f"({', '.join(format(x, form) for x in values)})"


def rounded(value: float, *, up: bool) -> str:
    """Return a bound ≥ 0 as text with four digits, rounded up, or down if ``up`` is False."""
    step = 10.0 ** (math.floor(math.log10(value)) - 3) if value > 0.0 else 1.0
    return f"{(math.ceil if up else math.floor)(value / step) * step:.4g}"


def span(values: Array, form: Callable[[float], str] = "{:.4g}".format) -> str:
    """Return the range of ``values`` as text: ``2 to 5``, or ``2`` if both ends print alike."""
    low = form(float(values.min()))
    high = form(float(values.max()))
    return low if low == high else f"{low} to {high}"


def with_uncertainty(value: float, uncertainty: float, size: float) -> str:
    """Return ``value ± uncertainty`` [SI] as text in a unit of this ``size``: two digits of it."""
    u = uncertainty / size
    places = 4
    if 0.0 < u < math.inf:
        places = min(max(1 - math.floor(math.log10(u)), 0), 12)
    return f"{value / size:.{places}f} ± {u:.{places}f}"


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the rows as aligned lines: the first column to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join([first.ljust(widths[0]), *map(str.rjust, others, widths[1:])]).rstrip()
        for first, *others in rows
    ]


def largest_finite(values: Array) -> float:
    """Return the largest magnitude among the finite values; 0 if there are none."""
    return float(abs(values[np.isfinite(values)]).max(initial=0.0))


def stiffness_unit(*values: Array | float) -> tuple[str, float]:
    """Return the unit in which people read stiffnesses [N/m] of this size, and its size."""
    return display_for("N/m", max(largest_finite(np.atleast_1d(value)) for value in values))


def stiffness_text(*values: float, digits: int = 4) -> str:
    """Return a stiffness [N/m], or a range, in a unit for its size: ``3.2 N/mm``, ``0.67 N/m``."""
    unit, size = stiffness_unit(*values)
    return f"{' to '.join(f'{value / size:.{digits}g}' for value in values)} {unit}"


_ROUNDING = 1e-9  # a number of a table below this fraction of the largest is printed as zero


def without_rounding(values: Array) -> Array:
    """Return ``values`` with all magnitudes below 1e-9 of the largest, mere rounding, set to 0."""
    size = abs(values)
    return np.where(size > _ROUNDING * size.max(initial=0.0), values, 0.0)


def prepare_json(numbers: Mapping[str, Any]) -> dict[str, object]:
    """Prepare values for JSON: arrays become lists, results dictionaries, inf and NaN None."""
    return {name: _plain(value) for name, value in numbers.items()}


def merged(*parts: Mapping[str, object]) -> dict[str, object]:
    """Return the entries of all parts; no part may overwrite another one's."""
    entries: dict[str, object] = {}
    for part in parts:
        assert not (both := entries.keys() & part.keys()), f"two numbers are called {both}"
        entries |= part
    return entries


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return prepare_json(value)
    if hasattr(value, "to_dict"):
        return _plain(value.to_dict())
    if isinstance(value, Status):
        return value.word
    if isinstance(value, (np.ndarray, np.generic)):
        return _plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def plural(count: int, noun: str) -> str:
    """Return a count with its noun: ``1 cable``, ``2 cables``."""
    return f"{count} {noun}{'s' * (count != 1)}"


def place(value: float, unit: str) -> str:
    """Return a joint coordinate [``unit``: rad or m] as text for people: ``12.5°`` or ``30 mm``."""
    return f"{math.degrees(value):.4g}°" if unit == "rad" else f"{1e3 * value:.4g} mm"


def beyond(joint: str, value: float, low: float, high: float, unit: str) -> str:
    """Return the text of an error: the ``value`` of a joint [rad or m] is not in [low, high]."""
    problem = f"{joint} = {place(value, unit)} is outside {place(low, unit)} to {place(high, unit)}"
    return f"{problem} ({value:.4g} {unit} of {low:.4g} to {high:.4g} {unit})"


def key(name: str, unit: str) -> str:
    """Return a JSON key with unit: ``margin`` in ``N m/rad`` becomes ``margin_Nm_per_rad``."""
    words = unit.replace("N m", "Nm").replace("/", " per ").split()
    return "_".join([name, *(words[1:] if words[:1] == ["1"] else words)])


_COUNTED: Final = {
    "N m/rad or N/m": "N m/rad (1 m counted as 1 rad)",
    "N m or N": "N m (1 N counted as 1 N m)",
}


def one_unit(unit: str) -> str:
    """Return the unit of one number of joints that turn and slide, and how it was made one."""
    return _COUNTED.get(unit, unit)


class JointUnits(NamedTuple):
    """Units of the joints of an arm; joints are revolute or prismatic."""

    slides: NDArray[np.bool_]  # whether each joint slides (nv,)

    @property
    def shown(self) -> tuple[tuple[str, float], ...]:
        """Return the printed unit of each joint, deg or mm, and its value in rad or m."""
        return tuple(("mm", 1e-3) if slides else ("deg", math.pi / 180.0) for slides in self.slides)

    def to_dict(self, names: Sequence[str], q: Array) -> dict[str, object]:
        """Return joint coordinates q (..., nv) for JSON by joint name: angles_rad and ways_m."""
        numbers: dict[str, object] = {"angles_rad": {}}
        for i, (name, slides) in enumerate(zip(names, self.slides, strict=True)):
            column = numbers.setdefault("ways_m" if slides else "angles_rad", {})
            column[name] = q[..., i].tolist()  # type: ignore[index]
        return numbers

    def keyed(
        self, name: str, unit: str, dims: Sequence[str], value: Any, joints: Sequence[str]
    ) -> dict[str, object]:
        """Return a number for JSON, one key for each unit that its entries have.

        ``unit`` is that of the whole, such as ``"N m or N"`` of an arm whose joints turn and slide.
        Entries of joints are then by their names. Any other number counts 1 m as 1 rad.
        """
        turning, _, sliding = unit.partition(" or ")
        if not sliding or np.size(value) == 0:
            return {key(name, unit): value}
        if "joint" not in dims:
            return {f"{key(name, turning)}_1m_as_1rad": value}
        entries: dict[str, object] = {}
        array = np.moveaxis(np.asarray(value), tuple(dims).index("joint"), 0)
        rows = dict(zip(joints, array, strict=True))
        if "joint_column" in dims:  # a force per rad, and a torque per m, are N
            for i, row in enumerate(rows):
                for j, column in enumerate(rows):
                    slides = int(self.slides[i]) + int(self.slides[j])
                    entry = entries.setdefault(key(name, (turning, "N", sliding)[slides]), {})
                    entry.setdefault(row, {})[column] = array[i, j]  # type: ignore[attr-defined]
            return entries
        for slides, own in ((False, turning), (True, sliding)):
            entries[key(name, own)] = {
                joint: row
                for (joint, row), slide in zip(rows.items(), self.slides, strict=True)
                if slide == slides
            }
        return entries

    def of(self, unit: str) -> str:
        """Return the SI unit of a quantity, whose ``unit`` may depend on the joints."""
        return self.joined(*UNITS_OF_JOINTS[unit]) if unit in UNITS_OF_JOINTS else unit

    def joined(self, turning: str, sliding: str, joint: int | None = None) -> str:
        """Return the text of a joint, or of all: ``turning``, ``sliding``, or both with "or"."""
        slides = self.slides if joint is None else self.slides[joint : joint + 1]
        return " or ".join([turning] * (not slides.all()) + [sliding] * bool(slides.any()))
