"""Elasticity of a wire: strain, rigidity and energy as functions of its tension."""

from __future__ import annotations

import math
import os
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.polynomial.polynomial import polyint, polyval
from numpy.typing import ArrayLike, NDArray

from cdsm.errors import ElasticityRangeError, InvalidInput
from cdsm.support.format import rounded
from cdsm.support.validation import number_array, positive
from cdsm.support.values import Array, Plotted

_SHORTEST: Final = 0.5  # length of a slack wire over that at the low end of its law


@dataclass(frozen=True, eq=False, repr=False)
class Elasticity(Plotted):
    """Axial elasticity of a wire: its law EA(F), with the strain `ε(F) = ∫ dF/EA`.

    A wire of original length `l_0` has the stiffness `dF/dL = EA(F)/l_0`: EA is the *tangent*
    rigidity. :class:`~cdsm.LinearElasticity`, :class:`~cdsm.StrandElasticity`,
    :class:`~cdsm.TabulatedElasticity` and :meth:`from_rigidity` only make the table of ε(F) that
    every law is. Laws made of equal values are equal. Tensions F [N] and strains may have any
    shape; results have it too. All methods of F raise ElasticityRangeError outside [low, high].

    Attributes:
        low: Smallest tension [N].
        high: Largest tension [N]; inf if there is none.
        rest: Tension [N] at which the strain is zero: ``low``, but see :meth:`slack_below`.

    Example:
        >>> import cdsm
        >>> law = cdsm.presets.STRAND_1X19
        >>> round(float(law.rigidity(50.0))), round(float(law.strain(50.0)), 6)
        (17711, 0.034656)
    """

    _figure = "plot_elasticity"

    low: float
    high: float
    rest: float
    kind: str  # in TOML; empty if the law was made from a function
    arguments: dict[str, Any]  # arguments that the law was made from
    factor: float  # EA over that of the polynomials
    _knots: Array  # tensions (n + 1,) [N], from ``rest`` on
    _coefficients: Array  # of ε in F − knot (k, n), lowest power first
    _cells: NDArray[np.intp] | None = None  # piece of each cell, even in (F − rest)^¼

    @staticmethod
    def from_rigidity(
        rigidity: Callable[[Array], ArrayLike], low: float, high: float, joins: Sequence[float] = ()
    ) -> Elasticity:
        """Make a law from a function EA(F), which is sampled once, to 1e-8 of EA between samples.

        ``rigidity`` returns EA [N] at an array of tensions from ``low`` to ``high`` [N]; corners of
        EA(F), at the tensions ``joins`` [N], are rounded off within about 1 N. Raises
        InvalidInput if the function fails, is not positive, jumps or has other corners, or if 0 <=
        low < joins < high does not hold.
        """
        from cdsm.wires.laws import rising, tabulate

        low, *_, high = ends = rising(low, joins, high)
        table = tabulate(rigidity, ends)
        values = {"low": low, "high": high, "checksum": zlib.crc32(table[1].tobytes())}
        return Elasticity(low, high, low, "", values, 1.0, *table)

    @staticmethod
    def read(path: str | os.PathLike[str]) -> Elasticity:
        """Read a law from a TOML file.

        Its ``kind`` is ``linear`` (with ``rigidity`` [N]), ``strand`` (``coefficients`` [N, 1,
        1/N, …], ``joins``, ``low``, ``high`` [N]) or ``tabulated`` (``tensions`` [N], ``strains``
        [-]). The last two may have a ``factor`` (:meth:`scaled`) and ``slack_below = true``.
        FileError lists all faults.
        """
        from cdsm.wires.catalogue import read_law

        return read_law(path)

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the law to a TOML file, from which :meth:`read` makes an equal one.

        Raises InvalidInput for a law of :meth:`from_rigidity`, and FileError.
        """
        from cdsm.wires.catalogue import write_law

        return write_law(self, path)

    def scaled(self, factor: float) -> Elasticity:
        """Return the law of ``factor`` · EA(F), e.g. for a wire of another spool.

        Raises InvalidInput if the factor [-] is not positive.
        """
        return Elasticity(**vars(self) | {"factor": self.factor * positive("factor", factor)})

    def slack_below(self) -> Elasticity:
        """Return the law continued to 0 N with the rigidity of its low end `F_0` (an assumption).

        The strain stays zero at `F_0`, so nothing changes above. Below, `ε = (F − F_0)/EA` is
        negative. Raises InvalidInput if the slack wire would be shorter than half its length.
        """
        low = self.low
        EA = float(self.rigidity(self.low))
        if low > _SHORTEST * EA:
            slack = f"would be slack after shortening by {100.0 * low / EA:.3g} %"
            problem = (
                f"EA is only {EA:.4g} N at {low:g} N: a wire that keeps it {slack}. Begin higher."
            )
            raise InvalidInput("slack_below", problem)
        return Elasticity(**vars(self) | {"low": 0.0}) if low > 0.0 else self

    def rigidity(self, tension: ArrayLike) -> Array:
        """Compute the tangent rigidity EA [N] at F [N], any shape (Fig. 5 of the paper)."""
        return self.strain_and_rigidity(tension)[1]

    def strain(self, tension: ArrayLike) -> Array:
        """Compute the strain `ε = Δl/l_0 = ∫ dF/EA` [-] from :attr:`rest` to F [N], any shape."""
        return self.strain_and_rigidity(tension)[0]

    def strain_and_rigidity(self, tension: ArrayLike) -> tuple[Array, Array]:
        """Compute ε [-] and EA [N] at F [N], any shape; see :meth:`strain`, :meth:`rigidity`."""
        strain, EA = self.evaluate(self.require_inside(number_array("tension", tension)))
        return np.asarray(strain), np.asarray(EA)

    def rigidity_slope(self, tension: ArrayLike) -> Array:
        """Compute `dEA/dF` [-] at F [N], any shape; zero below :attr:`rest`."""
        F = number_array("tension", tension)
        return self.slope_at(F, self.evaluate(self.require_inside(F))[1])

    def slope_at(self, F: Array, EA: Array) -> Array:
        """Compute `dEA/dF` [-] at tensions F [N] of the law, with EA [N] there: `−EA² ε″`."""
        piece, x = self._place(F.clip(self.rest))
        rows = self._coefficients.take(piece, axis=1)
        bend = np.zeros_like(x)
        for i in range(len(rows) - 1, 1, -1):
            bend = bend * x + i * (i - 1) * rows[i]
        return np.where(self.rest > F, 0.0, -bend * EA**2 / self.factor)

    def energy(self, tension: ArrayLike) -> Array:
        """Compute `∫ F dε` [N] = [J/m], from :attr:`rest` to F [N], any shape."""
        F = self.require_inside(number_array("tension", tension))
        moment = polyint(self._coefficients)
        moment[0, 1:] = np.cumsum(polyval(np.diff(self._knots), moment, tensor=False))[:-1]
        (strain, EA) = self.evaluate(F)
        below = np.minimum(F - self.rest, 0.0)
        area = self._polynomial(moment, F) / self.factor + below**2 / (2.0 * EA)
        return np.asarray(F * strain - area)  # by parts

    def secant_rigidity(self, tension: ArrayLike) -> Array:
        """Compute the secant rigidity (F − rest)/ε [N] of Eq. 18 at F [N], any shape."""
        strain, secant = self.strain_and_rigidity(tension)
        np.divide(np.asarray(tension) - self.rest, strain, out=secant, where=strain != 0.0)
        return secant

    def tension(self, strain: ArrayLike) -> Array:
        """Compute F [N] at strains [-], any shape: the inverse of :meth:`strain`.

        Raises ElasticityRangeError if no tension of the law gives one of the strains.

        Example:
            >>> import cdsm
            >>> float(cdsm.LinearElasticity(48e3).tension(0.001))
            48.0
        """
        return self._tension_of(number_array("strain", strain), "strain")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Elasticity) and repr(self) == repr(other)

    def __hash__(self) -> int:
        return hash((self.kind, self.factor, self.low, self.high))

    def __repr__(self) -> str:
        linear = self.kind == "linear"
        values = self.arguments | ({"rigidity": self.factor} if linear else {})
        text = ", ".join(f"{name}={value!r}" for name, value in values.items())
        scaled = "" if linear or self.factor == 1.0 else f".scaled({self.factor!r})"
        slack = ".slack_below()" * (self.low < self.rest)
        return f"{self.kind.capitalize()}Elasticity({text}){scaled}{slack}"

    @property
    def constant_rigidity(self) -> float | None:
        """EA [N] if it is the same at all tensions."""
        if self.kind == "rope":
            return float(self.factor / self._coefficients[1, 0])
        return self.factor if self.kind == "linear" else None

    @property
    def _span(self) -> str:
        """The tensions of the law, as text."""
        return f"[{self.low:g} N, {self.high:g} N{')' if math.isinf(self.high) else ']'}"

    def require_inside(self, F: Array) -> Array:
        """Return the tensions F [N], or raise ElasticityRangeError."""
        if F.size and not (F.min() >= self.low and F.max() <= self.high):
            outside = (self.low > F) | (self.high < F)
            few = bool(F.min() < self.low)
            many = bool(F.max() > self.high)
            bounds = [f"a minimum of {rounded(self.low, up=True)} N or more"] if few else []
            if many:
                highest = rounded(self.high, up=False)
                bounds.append(f"a maximum of {highest} N or less, and a minimum below it")
            slack = "; slack_below() (in ARM.toml: slack_below = true) continues one to 0 N" * few
            raise ElasticityRangeError(
                f"outside the domain {self._span} of the elasticity. Give {' and '.join(bounds)}, "
                f"or an elasticity that covers it{slack}.",
                F[outside].tolist(),
                np.flatnonzero(outside).tolist(),
            )
        return F

    def evaluate(self, F: Array) -> tuple[Array, Array]:
        """Compute ε [-] and EA [N] at tensions F [N] of the law, any shape."""
        inside = F if self.low == self.rest else np.maximum(F, self.rest)
        piece, x = self._place(inside)
        softness, *rows = self._coefficients.take(piece, axis=1)[::-1]
        strain = softness * x + rows[0]
        for row in rows[1:]:  # in place, which is twice as fast
            softness *= x
            softness += strain
            strain *= x
            strain += row
        strain /= self.factor
        EA = self.factor / softness
        return (strain, EA) if inside is F else (strain + (F - inside) / EA, EA)

    def _polynomial(self, coefficients: NDArray[Any], F: Array) -> Array:
        """Evaluate polynomials (k, n) of the pieces at F [N], but not below the rest."""
        piece, x = self._place(F.clip(self.rest))
        return np.asarray(polyval(x, coefficients[:, piece], tensor=False))

    def _place(self, F: Array) -> tuple[Any, Array]:
        """Return the piece of each tension [N] and the distance from the knot before it."""
        if self._cells is None:
            piece = self._knots[1:-1].searchsorted(F)
        else:
            count = (len(self._cells) - 1.0) ** 4 / (self.high - self.rest)
            piece = self._cells.take(np.sqrt(np.sqrt((F - self.rest) * count)).astype(np.intp))
        return piece, F - self._knots.take(piece)

    def _tension_of(self, wanted: Array, name: str, length: float = 1, series: float = 0) -> Array:
        """Return F [N] at which ``length`` · ε + ``series`` · (F − rest) is ``wanted``."""
        knots = np.union1d(self.low, self._knots)
        reached = length * self.evaluate(knots)[0] + series * (knots - self.rest)
        if (outside := (wanted < reached[0]) | (wanted > reached[-1] * (1.0 + 1e-15))).any():
            reach = f"the {name} {wanted[outside][0]:.6g}; it reaches {reached[-1]:.6g}."
            problem = f"no tension of the domain {self._span} gives {reach}"
            raise ElasticityRangeError(problem, indices=np.flatnonzero(outside).tolist())
        after = np.searchsorted(reached, wanted).clip(1, len(knots) - 1)

        def error(F: Array) -> tuple[Array, Array]:
            strain, EA = self.evaluate(F)
            return length * strain + series * (F - self.rest) - wanted, length / EA + series

        start = np.interp(wanted, reached, knots)
        return newton_in_bracket(error, start, knots[after - 1], knots[after])[0]


def newton_in_bracket(
    function: Callable[[Array], tuple[Array, Array]], x: Array, low: Array, high: Array
) -> tuple[Array, Array]:
    """Find the roots of rising functions between ``low`` and ``high``, from x; any shape.

    ``function`` returns values and slopes at x. Returns the roots, to 1e-13, and the slopes there.
    """
    for _ in range(200):
        value, slope = function(x)
        newton = x - value / slope
        if (abs(newton - x) <= 1e-13 * np.maximum(abs(x), 1.0)).all():
            break
        low = np.where(value < 0.0, x, low)
        high = np.where(value > 0.0, x, high)
        x = np.where((low <= newton) & (newton <= high), newton, (low + high) / 2.0)
    return x, slope


def checked_law(law: object) -> Elasticity:
    """Return ``law``; raise InvalidInput if it is not an Elasticity."""
    if isinstance(law, Elasticity):
        return law
    raise InvalidInput(
        "elasticity",
        f"{law!r} given; an Elasticity is needed: LinearElasticity(EA), a law of presets, or "
        "Elasticity.from_rigidity(EA, low, high). The name of a wire is taken only in files, "
        "and by wire= of Manipulator.read and read_cables.",
    )
