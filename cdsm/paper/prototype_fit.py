"""Identify the prototype of Section V from all numbers that the section prints.

The paper prints 20 numbers of its prototype, but no dimensions. Every unknown is a
parameter within :data:`BOUNDS`. For each of four interpretations of Section V (:data:`STEPS`), a
search finds the parameters that explain the numbers best. The residual of a stiffness is
ln(model/paper), because its errors are factors. The residual of a drop or a rise of stiffness is
(model − paper)/paper.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from functools import cache, partial
from typing import Final, final

import numpy as np
from scipy.optimize import least_squares

from cdsm.errors import InvalidInput
from cdsm.identification.least_squares import LeastSquares, no_model
from cdsm.paper.claims import Claim, Figure, floats, markdown_table
from cdsm.paper.prototype import Predicted, Prototype
from cdsm.paper.section_v import CHECK, MEASURED, NAMES, TABLE_II, TABLE_II_SWAPPED, TENSIONS
from cdsm.support.values import Array, frozen

_LIMIT = math.radians(30.0)
_EVEN = TENSIONS.tolist()
_TOUCH = math.tan(_LIMIT / 2.0)  # with a smaller disk ratio, disks touch before ±30°

_PARAMETERS: Final[dict[str, tuple[float, ...]]] = {
    # lower and upper bound, then the three starts: START, UNEVEN_START, TABLE_START
    "link_length": (0.03, 0.15, 0.031, 0.0305, 0.0305),
    "tool_length": (0.03, 0.3, 0.295, 0.295, 0.266),
    "hole_radius": (0.015, 0.05, 0.0495, 0.0495, 0.0268),
    "lead": (0.0, 0.5, 0.085, 0.062, 0.002),
    "link_mass": (0.05, 1.0, 0.98, 0.947, 0.41),
    "drive_stiffness": (1e5, 1e7, 9.5e6, 9.5e6, 9.5e6),
    "tension_offset": (0.0, 20.0, 17.5, 15.0, 6.45),
    "angle_1": (-_LIMIT, _LIMIT, -0.51, -0.505, -0.505),
    "angle_2": (-_LIMIT, _LIMIT, -0.51, 0.084, 0.084),
    "angle_3": (-_LIMIT, _LIMIT, 0.12, -0.1155, -0.1155),
    "spring_ratio": (5.0, 15.0, 8.0, 8.54, 8.54),
    "hybrid_tension": (3.0, 86.0, 3.5, 3.5, 3.5),
    "highest_hybrid_tension": (10.0, 86.0, 34.0, 34.0, 34.0),
    "disk_ratio": (_TOUCH, 1.0, _TOUCH, 0.275, 0.275),
    "level_2": (3.0, 40.0, _EVEN[1], 12.3, 11.6),
    "level_3": (3.0, 60.0, _EVEN[2], 18.4, 17.7),
    "level_4": (3.0, 86.0, _EVEN[3], 43.8, 47.9),
    "weight_x": (0.0, 20.0, 0.0, 0.0, 8.0),
    "weight_y": (0.0, 20.0, 0.0, 0.0, 8.0),
    "weight_z": (0.0, 20.0, 0.0, 0.0, 7.0),
}

BOUNDS: Final = {name: (low, high) for name, (low, high, *_) in _PARAMETERS.items()}
"""Plausible range of each parameter, in SI units. Tensions end at 86 N, as in Table II."""

START, UNEVEN_START, TABLE_START = (
    Prototype(**{name: row[column] for name, row in _PARAMETERS.items()}) for column in (2, 3, 4)
)
"""First guesses of the searches: with evenly and unevenly spaced tensions, and Table II alone.

They are near the results of searches over all of :data:`BOUNDS`, so the searches are short.
"""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Step:
    """One interpretation of Section V: the numbers to explain, and the parameters to search.

    Attributes:
        label: Name in tables and figures.
        table: Table II (5, 3) [N/m], as printed or with exchanged entries.
        free: Names of the searched parameters.
        start: First guess of the search. Parameters that are not free keep these values.
        table_alone: Whether only Table II is fitted, without Figs. 12, 13 and Section V-B.
    """

    label: str
    table: Array
    free: tuple[str, ...]
    start: Prototype
    table_alone: bool = False

    @property
    def numbers(self) -> tuple[str, ...]:
        """Names of the paper's numbers that are fitted, such as ``Table II, x, row 1``."""
        return NAMES[: TABLE_II.size] if self.table_alone else NAMES

    @property
    def count(self) -> str:
        """Text with the count of free parameters and of fitted numbers."""
        return f"{len(self.free)} free parameters for {len(self.numbers)} numbers"


_DIMENSIONS = tuple(BOUNDS)[:13]
_LEVELS = ("disk_ratio", "level_2", "level_3", "level_4")
_WEIGHTS = ("weight_x", "weight_y", "weight_z")

STEPS: Final = (
    Step(label="as printed", table=TABLE_II, free=_DIMENSIONS, start=START),
    Step(
        label="x and y exchanged in rows 2 to 4",
        table=TABLE_II_SWAPPED,
        free=_DIMENSIONS,
        start=START,
    ),
    Step(
        label="exchanged, uneven tensions",
        table=TABLE_II_SWAPPED,
        free=_DIMENSIONS + _LEVELS,
        start=UNEVEN_START,
    ),
    Step(
        label="Table II alone, exchanged, uneven tensions, finite weights",
        table=TABLE_II_SWAPPED,
        free=_DIMENSIONS[:7] + _LEVELS + _WEIGHTS,
        start=TABLE_START,
        table_alone=True,
    ),
)
"""Interpretations of Section V to which a prototype is fitted. A good fit proves none of them."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class PrototypeFit:
    """Result of fitting a prototype to one interpretation of Section V.

    Attributes:
        step: The interpretation of Section V that was fitted: its numbers and free parameters.
        prototype: Identified parameters.
        predicted: Numbers of Section V for the identified prototype.
        residuals: Residual [-] of each of ``step.numbers``: see :meth:`Predicted.residuals`.
        at_bound: Names of searched parameters at a bound; the best value may lie beyond it.
    """

    step: Step
    prototype: Prototype
    predicted: Predicted
    residuals: Array
    at_bound: tuple[str, ...]

    @property
    def cost(self) -> float:
        """Sum of the squared residuals [-]."""
        return float(self.residuals @ self.residuals)

    @property
    def misfit(self) -> Array:
        """Root mean square of ln(model/paper) in each column of Table II (3,) [-]."""
        table = self.residuals[: TABLE_II.size].reshape(TABLE_II.shape)
        return np.asarray(np.sqrt(np.mean(table**2, axis=0)))


_NEAR = 0.02  # a parameter is at a bound if it is this near, as a fraction of its range


def identify_prototype(step: Step) -> PrototypeFit:
    """Find the ``step.free`` parameters within :data:`BOUNDS` with the least squared residuals.

    Raises:
        InvalidInput: The start is out of bounds, or its arm has no stable equilibrium.
    """
    bounds = {name: BOUNDS[name] for name in step.free}

    def residuals(values: dict[str, float]) -> Array:
        with no_model():
            return replace(step.start, **values).predict(step.table_alone).residuals(step.table)

    problem = LeastSquares(residuals, len(step.numbers), bounds)
    start = np.array([getattr(step.start, name) for name in bounds])
    if not ((problem.box.low < start) & (start < problem.box.high)).all():
        raise InvalidInput("start", f"{step.start} is not within {bounds}.")
    point = problem.box.point(start)
    if problem.failure(point) is not None:
        raise InvalidInput("start", f"{step.start} has no stable equilibrium. Start elsewhere.")
    # the step of the finite differences is large against rounding errors of the weight tests
    point = least_squares(
        problem.residuals,
        point,
        bounds=(0.0, 1.0),
        diff_step=1e-5,
        ftol=1e-6,
        xtol=1e-5,
        max_nfev=60,
    ).x
    prototype = replace(step.start, **problem.parameters(point))
    predicted = prototype.predict(step.table_alone)
    at_bound = (point < _NEAR) | (point > 1.0 - _NEAR)
    return PrototypeFit(
        step=step,
        prototype=prototype,
        predicted=predicted,
        residuals=frozen(predicted.residuals(step.table)),
        at_bound=tuple(name for name, on in zip(bounds, at_bound, strict=True) if on),
    )


identified = cache(identify_prototype)
"""As :func:`identify_prototype`; a repeated call returns the stored result."""

section_v_claim = partial(Claim, searched="all parameters of the prototype")
"""Build a :class:`Claim` of Section V, measured with weights; ``original``, ``along`` are empty."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class PrototypeFigure(Figure):
    """Residuals of the numbers of Section V for the identified prototypes.

    Attributes:
        fits: Identified prototypes, one for each interpretation of Section V (:data:`STEPS`).
    """

    fits: tuple[PrototypeFit, ...]

    def numbers(self) -> dict[str, object]:
        """Return parameters and residuals of all fits, for JSON."""
        return {
            "bounds_SI": BOUNDS,
            "fits": [
                {
                    "step": fit.step.label,
                    "free": fit.step.free,
                    "numbers": len(fit.step.numbers),
                    "table_N_per_m": fit.step.table.tolist(),
                    "parameters_SI": asdict(fit.prototype),
                    "at_bound": fit.at_bound,
                    "misfit_xyz": fit.misfit.tolist(),
                    "residuals": dict(zip(fit.step.numbers, fit.residuals.tolist(), strict=True)),
                }
                for fit in self.fits
            ],
        }

    def tables(self) -> tuple[str, ...]:
        """Return the table of identified parameters; * marks a parameter at a bound."""
        rows = []
        for name, (low, high) in BOUNDS.items():
            cells = [
                "–"
                if name not in fit.step.free
                else f"{getattr(fit.prototype, name):.4g}" + ("*" if name in fit.at_bound else "")
                for fit in self.fits
            ]
            rows.append((name, f"{low:.4g}", f"{high:.4g}", *cells))
        header = ("parameter [SI]", "from", "to", *(fit.step.label for fit in self.fits))
        return (markdown_table(header, rows),)


def figure_prototype() -> PrototypeFigure:
    """Compare the numbers of Section V with the prototype identified for each interpretation."""
    fits = tuple(identified(step) for step in STEPS)
    checks = [
        section_v_claim(
            figure="Section V-B",
            quantity="accuracy check in z, off the paper's calculated 0.139 N/mm",
            unit="%",
            paper=(100.0 * (MEASURED / CHECK - 1.0),),
            computed=(100.0 * (fit.predicted.check / CHECK - 1.0),),
            assumption=f"{fit.step.label}; the paper's is its measurement, 0.131 N/mm; posture of "
            "Table II, cables of 1.89 N/mm",
        )
        for fit in fits
        if fit.predicted.check is not None
    ]
    misfits = [
        section_v_claim(
            figure="Section V",
            quantity="typical misfit of Table II in x, y, z",
            unit="%",
            computed=floats(100.0 * fit.misfit),
            assumption=f"{fit.step.label}; {fit.step.count}; at a bound: "
            f"{', '.join(fit.at_bound) or 'none'}",
        )
        for fit in fits
    ]
    return PrototypeFigure(
        name="prototype",
        title="Section V: every number against one identified prototype",
        fits=fits,
        claims=(*checks, *misfits),
    )
