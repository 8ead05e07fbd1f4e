"""Ropes by construction and diameter: EA with its scatter, and least breaking force.

A construction has a metallic area A = C d² of the diameter d, a modulus E of the whole rope, and a
least breaking force S d². A row without a source is none.
"""

from __future__ import annotations

import math
import re
from typing import Final, NamedTuple, final

from cdsm.errors import InvalidInput
from cdsm.support.validation import checked_quantity, one_of, scalar
from cdsm.wires.elasticity import Elasticity
from cdsm.wires.laws import LINE

_POUND_PER_SQUARE_INCH: Final = 6894.757293168  # [Pa]
_POUND: Final = 4.4482216152605  # [N]
_GRADE: Final = 1570e6  # strength of the wires of stainless ropes [Pa]
_THICKEST: Final = 0.05  # diameter of a rope [m]
_OTHER: Final = 3.0  # largest ratio of breaking forces of ropes of one construction and diameter
_NAME: Final = re.compile(r"([A-Za-z0-9]+)-(\d+\.?\d*)mm")


class Construction(NamedTuple):
    """A construction of ropes of one material, with its sources."""

    material: str
    area: float  # C: metallic area over d² [-]
    stiffness: float  # EA/d² [Pa]
    scatter: float  # relative standard uncertainty of EA [-]
    strength: float  # least breaking force over d² [Pa]
    source: str

    @property
    def modulus(self) -> float:
        """Modulus of the construction on its metallic area [Pa]."""
        return self.stiffness / self.area


def _stretch(G: float) -> float:
    """Return EA/d² [Pa] of a maker's factor G: stretch in % = G W/d², in pounds and inches."""
    return 100.0 / G * _POUND_PER_SQUARE_INCH


_STRAND_CORE: Final = "EA: Strand Core, Wire rope stretch (G factor, 302; 316 has the same modulus)"
_DES: Final = (
    "strength: des-boots-service.de, Drahtseil (wires of 1570 N/mm², stranding factor 0.88"
)
_EN: Final = "strength: EN 12385-4 factors in vornbaeumen.de, Calculation variables"

ROPES: Final[dict[str, Construction]] = {
    "1x7": Construction(
        "316",
        7.0 * math.pi / 36.0,
        _stretch(7.35e-6),
        0.05,
        7.0 * math.pi / 36.0 * 0.88 * _GRADE,
        f"{_STRAND_CORE}; {_DES} of 1x19)",
    ),
    "1x19": Construction(
        "316",
        19.0 * math.pi / 100.0,
        _stretch(7.79e-6),
        0.05,
        19.0 * math.pi / 100.0 * 0.88 * _GRADE,
        f"{_STRAND_CORE}; {_DES})",
    ),
    "7x7": Construction(
        "316",
        0.432,
        _stretch(1.20e-5),
        0.10,
        0.388 * _GRADE,
        f"{_STRAND_CORE}; {_EN} (6x7 WSC, 0.388), grade 1570",
    ),
    "7x19": Construction(
        "316",
        0.418,
        _stretch(1.62e-5),
        0.15,
        0.362 * _GRADE,
        f"{_STRAND_CORE}; {_EN} (6x19M WSC, 0.362), grade 1570",
    ),
    "uhmwpe": Construction(
        "heat-set braid of Dyneema fibre",
        math.pi / 4.0,
        1000.0 * _POUND / 0.00078 / 9e-3**2,
        0.30,
        5400.0 * _POUND / (25.4e-3 * 3.0 / 16.0) ** 2,
        "EA at a fifth of the breaking load: catsailor.com, post 170007 (Dynex Dux, 9 mm, 0.00078 "
        "per 1000 lb); strength: arboristsite.com, AmSteel-Blue 3/16 in, 5400 lb",
    ),
}
"""Ropes that have a source, by construction. The area of a braid is that of its circle."""


@final
class RopeElasticity(Elasticity):
    """Constant EA of a rope, from its construction and diameter, with its scatter and source.

    `EA = (EA/d²) d²` holds for a rope that was stretched before, above some 20 % of its breaking
    force; below, ropes are softer. Measure yours: :func:`~cdsm.fit_tensile_test`.

    ``rope`` is 1x7, 1x19, 7x7, 7x19 (stainless steel 316) or uhmwpe, ``diameter`` d is in m, and
    ``breaking_load`` [N] that of the maker; None: the least one of the table. A number that no such
    rope has, or a rope without a source, raises InvalidInput.

    Example:
        >>> import cdsm
        >>> law = cdsm.RopeElasticity("7x7", 0.8e-3)
        >>> round(float(law.rigidity(10.0)))
        36772
    """

    def __init__(self, rope: str, diameter: float, breaking_load: float | None = None) -> None:
        row = ROPES[one_of("rope", rope, ROPES, "A rope without a source is left out: give EA.")]
        d = checked_quantity("diameter", diameter, "length")
        if d > _THICKEST:
            problem = f"{d:g} m given, up to {_THICKEST:g} m is a cable of an arm. mm? Give m."
            raise InvalidInput("diameter", problem)
        values: dict[str, object] = {"rope": rope, "diameter": d}
        if breaking_load is not None:
            load = scalar("breaking_load", breaking_load)
            usual = row.strength * d * d
            if not usual / _OTHER < load < usual * _OTHER:
                problem = f"{load:g} N given, but {rope} of {1e3 * d:g} mm breaks at some "
                raise InvalidInput("breaking_load", f"{problem}{usual:.3g} N. Give N.")
            values["breaking_load"] = load
        EA = checked_quantity("rigidity", row.stiffness * d * d, "rigidity")
        knots, line = LINE
        super().__init__(0.0, math.inf, 0.0, "rope", values, 1.0, knots, line / EA)


def rope_of_name(name: str) -> RopeElasticity | None:
    """Return the rope of a name such as ``7x7-0.8mm``, or None if it is no such name."""
    match = _NAME.fullmatch(name)
    if not match or match[1] not in ROPES:
        return None
    return RopeElasticity(match[1], float(match[2]) / 1000.0)


def names_like(name: str) -> list[str]:
    """Return the names of all ropes with the size in a name, or of 1 mm."""
    size = match[2] if (match := _NAME.fullmatch(name)) else "1"
    return [f"{rope}-{size}mm" for rope in ROPES]


def rope_name(law: Elasticity) -> str | None:
    """Return the name from which :func:`rope_of_name` makes a law, or None."""
    if law.kind != "rope":
        return None
    name = f"{law.arguments['rope']}-{1e3 * law.arguments['diameter']:.12g}mm"
    return name if rope_of_name(name) == law else None


def construction_of(law: Elasticity) -> Construction | None:
    """Return the construction of a rope; None for other laws."""
    return ROPES[law.arguments["rope"]] if law.kind == "rope" else None


def breaking_force(law: Elasticity) -> float:
    """Return the least breaking force [N] of a rope: the maker's, or of the table; else NaN."""
    if (row := construction_of(law)) is None:
        return math.nan
    usual = row.strength * law.arguments["diameter"] ** 2
    return float(law.arguments.get("breaking_load", usual))


def describe(law: Elasticity) -> str:
    """Return EA, scatter, breaking force and sources of a rope, as text; empty for other laws."""
    if (row := construction_of(law)) is None:
        return ""
    rope = law.arguments["rope"]
    diameter = 1e3 * law.arguments["diameter"]
    area = row.area * diameter**2
    return (
        f"wire {rope}, {diameter:g} mm, {row.material}: EA {float(law.rigidity(0.0)) / 1e3:.4g} kN "
        f"± {100.0 * row.scatter:.2g} % (one σ; stretched before, above a fifth of its breaking "
        f"force)\n  that is {row.modulus / 1e9:.4g} GPa on {area:.3g} mm²; breaking force "
        f"{breaking_force(law):.4g} N\n  {row.source}"
    )
