"""Elasticity of a wire: strain, rigidity and energy as functions of its tension."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Callable, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

import cdsm
from cdsm.errors import ElasticityRangeError, InvalidInput
from cdsm.support.roots import rising_root
from cdsm.support.validation import number_array, quantity, scalar
from cdsm.support.values import Array
from cdsm.wires.table import Table, horner, tabulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SHORTEST: Final = 0.5  # length of a slack wire over that at the low end of its law


class Elasticity:
    """Axial elasticity of a wire: its law EA(F), with the strain ε(F) = ∫ dF/EA.

    A wire of original length l_0 has the stiffness dF/dL = EA(F)/l_0: EA is the *tangent* rigidity.
    Every law is a table of ε(F), made once. :class:`~cdsm.LinearElasticity`,
    :class:`~cdsm.StrandElasticity`, :class:`~cdsm.TabulatedElasticity` and :meth:`from_rigidity`
    only construct it. Laws made of equal values are equal. Tensions F [N] and strains may have any
    shape; results have it too. All methods of F raise ElasticityRangeError outside [low, high].

    Attributes:
        low: Smallest tension [N].
        high: Largest tension [N]; inf if there is none.
        rest: Tension [N] at which the strain is zero: ``low``, but see :meth:`slack_below`.
    """

    low: float
    high: float
    rest: float
    _kind: str
    _given: dict[str, Any]
    _factor: float  # EA over that of the table
    _slack: bool

    def __init__(
        self, kind: str, given: dict[str, Any], low: float, high: float, factor: float = 1.0
    ) -> None:
        self.__dict__.update(low=low, high=high, rest=low)
        self.__dict__.update(_kind=kind, _given=given, _factor=factor, _slack=False)

    @classmethod
    def from_rigidity(
        cls,
        rigidity: Callable[[Array], ArrayLike],
        low: float,
        high: float,
        joins: Sequence[float] = (),
    ) -> Elasticity:
        """Make a law from a function EA(F), which is sampled once, to 1e-8 of EA between samples.

        Args:
            rigidity: Function that returns EA [N] at an array of tensions [N].
            low: Smallest tension [N], 0 or more.
            high: Largest tension [N].
            joins: Tensions [N] of corners of EA(F); these are rounded off within about 1 N.

        Raises:
            InvalidInput: The function fails, is not positive, jumps or has another corner; or not
                0 <= low < high.
        """
        low, high = quantity("low", low, "tension", zero=True), quantity("high", high, "tension")
        if not low < high:
            raise InvalidInput("low", f"low < high needed, but are {low:g} and {high:g} N.")
        table = tabulate(rigidity, low, high, joins)
        digest = hashlib.sha256(table.knots.tobytes() + table.coefficients.tobytes()).hexdigest()
        law = Elasticity("function", {"digest": digest[:16]}, low, high)
        law.__dict__["_table"] = table
        return law

    @staticmethod
    def read(path: str | os.PathLike[str]) -> Elasticity:
        """Read a law from a TOML file.

        Its ``kind`` is ``linear`` (with ``rigidity`` [N]), ``strand`` (``coefficients`` [N, 1,
        1/N, …], ``joins``, ``low``, ``high`` [N]) or ``tabulated`` (``tensions`` [N], ``strains``
        [-]). The last two may have a ``factor`` (:meth:`scaled`) and ``slack_below = true``.

        Raises:
            FileError: The file cannot be read or does not describe a law (all faults listed).
        """
        from cdsm.wires.catalogue import read_law

        return read_law(path)

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the law to a TOML file, from which :meth:`read` makes an equal one.

        Raises InvalidInput for a law of :meth:`from_rigidity`, and FileError.
        """
        from cdsm.wires.catalogue import write_law

        return write_law(self, path)

    def plot(self) -> Figure:
        """Plot tangent and secant rigidity [kN] against the tension [N]."""
        return cdsm.plots.plot_elasticity(self)

    def scaled(self, factor: float) -> Elasticity:
        """Return the law of ``factor`` · EA(F), e.g. for a wire of another spool.

        Raises InvalidInput if the factor [-] is not positive.
        """
        if not 0.0 < scalar("factor", factor) < math.inf:
            raise InvalidInput("factor", f"{factor:g} given; a positive number is needed.")
        return self._with(_factor=self._factor * float(factor))

    def slack_below(self) -> Elasticity:
        """Return the law continued to 0 N with the rigidity of its low end F_0 (an assumption).

        The strain stays zero at F_0, so nothing changes above. Below, ε = (F − F_0)/EA is negative.
        The strand of Eq. 19 has EA = 16.4 N at 2.2 N, and is slack after shortening by 13 %.

        Raises InvalidInput if the slack wire would be shorter than half its length.
        """
        if self.low == 0.0:
            return self
        low, EA = self.low, float(self.rigidity(self.low))
        if low > _SHORTEST * EA:
            raise InvalidInput(
                "slack_below",
                f"the rigidity at the low end, {low:g} N, is only {EA:.4g} N: a wire that keeps it "
                f"would be slack after shortening by {100.0 * low / EA:.3g} %. Begin the law at "
                "another tension.",
            )
        return self._with(_slack=True, low=0.0)

    def strain_and_rigidity(self, tension: ArrayLike) -> tuple[Array, Array]:
        """Compute ε [-] and EA [N] at F [N], any shape; see :meth:`strain`, :meth:`rigidity`."""
        strain, softness = self._evaluate(self._inside(tension))[:2]
        return np.asarray(strain / self._factor), np.asarray(self._factor / softness)

    def rigidity(self, tension: ArrayLike) -> Array:
        """Compute the tangent rigidity EA [N] at F [N], any shape (Fig. 5 of the paper)."""
        return self.strain_and_rigidity(tension)[1]

    def strain(self, tension: ArrayLike) -> Array:
        """Compute the strain ε = Δl/l_0 = ∫ dF/EA [-] from :attr:`rest` to F [N], any shape."""
        return self.strain_and_rigidity(tension)[0]

    def rigidity_slope(self, tension: ArrayLike) -> Array:
        """Compute dEA/dF [-] at F [N], any shape; zero below :attr:`rest`."""
        F, c = self._inside(tension), self._table.coefficients
        _, softness, x, piece = self._evaluate(F)
        powers = np.arange(len(c) - 1.0, 1.0, -1.0)[:, None]
        bend = horner(c[:-2] * powers * (powers - 1.0), x, piece) if len(c) > 2 else 0.0 * F
        return np.where(self.rest > F, 0.0, -self._factor * bend / softness**2)

    def energy(self, tension: ArrayLike) -> Array:
        """Compute ∫ F dε [N] = [J/m], from :attr:`rest` to F [N], any shape."""
        F = self._inside(tension)
        strain, softness, x, piece = self._evaluate(F)
        below = np.minimum(F - self.rest, 0.0)
        moment = horner(self._moments, x, piece) + below**2 * softness / 2.0
        return np.asarray((F * strain - moment) / self._factor)  # by parts

    def secant_rigidity(self, tension: ArrayLike) -> Array:
        """Compute the secant rigidity (F − rest)/ε [N] of Eq. 18 at F [N], any shape."""
        F = self._inside(tension)
        strain, secant = self.strain_and_rigidity(F)
        np.divide(F - self.rest, strain, out=secant, where=strain != 0.0)
        return secant

    def tension(self, strain: ArrayLike) -> Array:
        """Compute F [N] at strains [-], any shape: the inverse of :meth:`strain`.

        Raises ElasticityRangeError if no tension of the law gives one of the strains.
        """
        return self._tension_at(number_array("strain", strain), "strain")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Elasticity) and self._values == other._values

    def __hash__(self) -> int:
        return hash((self._kind, self._factor, self.low, self.high))

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"{name} of a law cannot be changed; make another law")

    def __repr__(self) -> str:
        if self._kind == "linear":
            return f"LinearElasticity(rigidity={self._factor!r})"
        given = ", ".join(f"{name}={value!r}" for name, value in self._given.items())
        made = f"{self._kind.capitalize()}Elasticity({given})"
        if self._kind == "function":
            made = f"<Elasticity from {self.rest:g} to {self.high:g} N, {given}>"
        scaled = f".scaled({self._factor!r})" if self._factor != 1.0 else ""
        return made + scaled + ".slack_below()" * self._slack

    @property
    def _values(self) -> tuple[object, ...]:
        return self._kind, self._given, self._factor, self._slack, self.rest, self.high

    @property
    def _constant(self) -> float | None:
        """EA [N] if it is the same at all tensions."""
        return self._factor if self._kind == "linear" else None

    @property
    def _span(self) -> str:
        """The tensions of the law, as text."""
        return f"[{self.low:g} N, {self.high:g} N{')' if math.isinf(self.high) else ']'}"

    @cached_property
    def _table(self) -> Table:
        """The strain times the factor, made when it is first needed."""
        raise NotImplementedError

    @cached_property
    def _moments(self) -> Array:
        return self._table.moments()

    def _with(self, **changes: Any) -> Elasticity:
        law = Elasticity.__new__(Elasticity)
        law.__dict__.update({**self.__dict__, "_table": self._table, **changes})
        return law

    def _inside(self, tension: ArrayLike) -> Array:
        F = number_array("tension", tension)
        if F.size and not (F.min() >= self.low and F.max() <= self.high):
            outside = (self.low > F) | (self.high < F)
            below = "; slack_below() continues one to 0 N" if F.min() < self.low else ""
            raise ElasticityRangeError(
                f"outside the domain {self._span} of the elasticity. Keep the tension inside it "
                f"(minimum=, maximum=), or use an elasticity that covers it{below}.",
                np.atleast_1d(F)[np.atleast_1d(outside)].tolist(),
                np.flatnonzero(outside).tolist(),
            )
        return F

    def _evaluate(self, F: Array) -> tuple[Array, Array, Array, Any]:
        """Return ε and dε/dF times the factor, the distance from the knot before, and the piece."""
        table = self._table
        inside = np.maximum(F, self.rest) if self._slack else F
        piece = table.piece(inside)
        x = inside - table.knots[piece]
        rows = table.coefficients.take(piece, axis=1)
        softness = rows[0]
        strain = softness * x + rows[1]
        for row in rows[2:]:
            softness = softness * x + strain
            strain = strain * x + row
        return strain + (F - inside) * softness if self._slack else strain, softness, x, piece

    def _tension_at(
        self, wanted: Array, name: str, length: float = 1.0, series: float = 0.0
    ) -> Array:
        """Return F [N] at which ``length`` · ε + ``series`` · (F − rest) is ``wanted``."""

        def elongation(F: Array) -> Array:
            return length * self.strain(F) + series * (F - self.rest)

        knots = np.append(0.0, self._table.knots) if self._slack else self._table.knots
        reached = elongation(knots)
        outside = (wanted < reached[0]) | (wanted > reached[-1] * (1.0 + 1e-15))
        if outside.any():
            raise ElasticityRangeError(
                f"no tension of the domain {self._span} gives the {name} "
                f"{np.atleast_1d(wanted)[np.atleast_1d(outside)][0]:.6g}; it reaches "
                f"{reached[-1]:.6g}.",
                indices=np.flatnonzero(outside).tolist(),
            )
        piece = np.clip(np.searchsorted(reached, wanted) - 1, 0, len(knots) - 2)
        ends = knots[piece], knots[piece + 1]
        guess = np.interp(wanted, reached, knots)
        return rising_root(
            wanted, guess, *ends, elongation, lambda F: length / self.rigidity(F) + series
        )[0]


def checked_law(law: object) -> Elasticity:
    """Return ``law``; raise InvalidInput if it is not an Elasticity."""
    if not isinstance(law, Elasticity):
        raise InvalidInput(
            "elasticity",
            f"{law!r} given; an Elasticity is needed: LinearElasticity(EA), a law of presets, or "
            "Elasticity.from_rigidity(EA, low, high). The name of a wire is taken only in files, "
            "and by wire= of Manipulator.read and read_cables.",
        )
    return law
