"""Elasticity of a wire: strain, rigidity and energy as functions of its tension."""

from __future__ import annotations

import hashlib
import math
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

import cdsm
from cdsm.errors import ElasticityRangeError, FileError, GeometryError, InvalidInput, listed
from cdsm.support.files import read_text, write_text
from cdsm.support.records import read_toml
from cdsm.support.validation import number_array, quantity, scalar
from cdsm.support.values import Array
from cdsm.wires.table import Table, horner, tabulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SHORTEST: Final = 0.5  # length of a slack wire over that at the low end of its law
_UNITS: Final = "# Elasticity of a wire: tensions and rigidity in N, strains without unit"
_MEASURED = re.compile(r'^"?[-+]?\d[\d.,eE+-]*"?\s*[;,\t]\s*"?[-+]?\d', re.MULTILINE)  # of a CSV


@dataclass(frozen=True, eq=False, repr=False)
class Elasticity:
    """Axial elasticity of a wire: its law EA(F), with the strain ε(F) = ∫ dF/EA.

    A wire of original length l_0 has the stiffness dF/dL = EA(F)/l_0: EA is the *tangent* rigidity.
    :class:`~cdsm.LinearElasticity`, :class:`~cdsm.StrandElasticity`,
    :class:`~cdsm.TabulatedElasticity` and :meth:`from_rigidity` only make the table of ε(F) that
    every law is. Laws made of equal values are equal. Tensions F [N] and strains may have any
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
    _given: dict[str, Any]  # arguments that the law was made of
    _factor: float  # EA over that of the table
    _table: Table

    @staticmethod
    def from_rigidity(
        rigidity: Callable[[Array], ArrayLike], low: float, high: float, joins: Sequence[float] = ()
    ) -> Elasticity:
        """Make a law from a function EA(F), which is sampled once, to 1e-8 of EA between samples.

        ``rigidity`` returns EA [N] at an array of tensions from ``low`` to ``high`` [N]; corners of
        EA(F), at the tensions ``joins`` [N], are rounded off within about 1 N. Raises InvalidInput
        if the function fails, is not positive, jumps or has other corners, or not 0 <= low < high.
        """
        low, high = quantity("low", low, "tension", zero=True), quantity("high", high, "tension")
        if not low < high:
            raise InvalidInput("low", f"low < high needed, but are {low:g} and {high:g} N.")
        table = tabulate(rigidity, low, high, joins)
        digest = hashlib.sha256(table.coefficients.tobytes()).hexdigest()[:16]
        given = {"low": low, "high": high, "digest": digest}
        return Elasticity(low, high, low, "", given, 1.0, table)

    @staticmethod
    def read(path: str | os.PathLike[str]) -> Elasticity:
        """Read a law from a TOML file.

        Its ``kind`` is ``linear`` (with ``rigidity`` [N]), ``strand`` (``coefficients`` [N, 1,
        1/N, …], ``joins``, ``low``, ``high`` [N]) or ``tabulated`` (``tensions`` [N], ``strains``
        [-]). The last two may have a ``factor`` (:meth:`scaled`) and ``slack_below = true``.
        FileError lists all faults.
        """
        from cdsm.wires.catalogue import from_table

        text = read_text(path, any_encoding=True)  # to know a table of a testing machine
        if _MEASURED.search(text):
            raise FileError(path, "looks like measured points. Fit it first: `cdsm fit`.")
        try:
            return from_table(read_toml(text))
        except (GeometryError, InvalidInput) as error:
            faults = getattr(error, "faults", (str(error),))
        raise FileError(path, f"is not an elasticity, {len(faults)} found:{listed(faults)}")

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the law to a TOML file, from which :meth:`read` makes an equal one.

        Raises InvalidInput for a law of :meth:`from_rigidity`, and FileError.
        """
        from cdsm.wires.catalogue import table_of

        return write_text(path, "\n".join([_UNITS, *table_of(self), ""]))

    def plot(self) -> Figure:
        """Plot tangent and secant rigidity [kN] against the tension [N]."""
        return cdsm.plots.plot_elasticity(self)

    def scaled(self, factor: float) -> Elasticity:
        """Return the law of ``factor`` · EA(F), e.g. for a wire of another spool.

        Raises InvalidInput if the factor [-] is not positive.
        """
        if not 0.0 < scalar("factor", factor) < math.inf:
            raise InvalidInput("factor", f"{factor:g} given; a positive number is needed.")
        return self._changed(self.low, self._factor * float(factor))

    def slack_below(self) -> Elasticity:
        """Return the law continued to 0 N with the rigidity of its low end F_0 (an assumption).

        The strain stays zero at F_0, so nothing changes above. Below, ε = (F − F_0)/EA is negative.
        Raises InvalidInput if the slack wire would be shorter than half its length.
        """
        low, EA = self.low, float(self.rigidity(self.low))
        if low > _SHORTEST * EA:
            raise InvalidInput(
                "slack_below",
                f"EA is only {EA:.4g} N at {low:g} N: a wire that keeps it would be slack after "
                f"shortening by {100.0 * low / EA:.3g} %. Begin the law at another tension.",
            )
        return self._changed(0.0, self._factor) if low > 0.0 else self

    def rigidity(self, tension: ArrayLike) -> Array:
        """Compute the tangent rigidity EA [N] at F [N], any shape (Fig. 5 of the paper)."""
        return self.strain_and_rigidity(tension)[1]

    def strain(self, tension: ArrayLike) -> Array:
        """Compute the strain ε = Δl/l_0 = ∫ dF/EA [-] from :attr:`rest` to F [N], any shape."""
        return self.strain_and_rigidity(tension)[0]

    def strain_and_rigidity(self, tension: ArrayLike) -> tuple[Array, Array]:
        """Compute ε [-] and EA [N] at F [N], any shape; see :meth:`strain`, :meth:`rigidity`."""
        strain, EA = self._evaluate(self._inside(number_array("tension", tension)))
        return np.asarray(strain), np.asarray(EA)

    def rigidity_slope(self, tension: ArrayLike) -> Array:
        """Compute dEA/dF [-] at F [N], any shape; zero below :attr:`rest`."""
        F, c = self._inside(number_array("tension", tension)), self._table.coefficients
        powers = np.arange(len(c) - 1.0, 1.0, -1.0)[:, None]
        bend = horner(c[:-2] * powers * (powers - 1.0), *self._table.place(F.clip(self.rest)))
        return np.where(self.rest > F, 0.0, -bend * self._evaluate(F)[1] ** 2 / self._factor)

    def energy(self, tension: ArrayLike) -> Array:
        """Compute ∫ F dε [N] = [J/m], from :attr:`rest` to F [N], any shape."""
        F = self._inside(number_array("tension", tension))
        strain, EA = self._evaluate(F)
        moment = horner(self._table.moments(), *self._table.place(F.clip(self.rest)))
        below = np.minimum(F - self.rest, 0.0)  # by parts, with the moment ∫ε dF
        return np.asarray(F * strain - moment / self._factor - below**2 / (2.0 * EA))

    def secant_rigidity(self, tension: ArrayLike) -> Array:
        """Compute the secant rigidity (F − rest)/ε [N] of Eq. 18 at F [N], any shape."""
        strain, secant = self.strain_and_rigidity(tension)
        np.divide(np.asarray(tension) - self.rest, strain, out=secant, where=strain != 0.0)
        return secant

    def tension(self, strain: ArrayLike) -> Array:
        """Compute F [N] at strains [-], any shape: the inverse of :meth:`strain`.

        Raises ElasticityRangeError if no tension of the law gives one of the strains.
        """
        return self._tension_of(number_array("strain", strain), "strain")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Elasticity) and repr(self) == repr(other)

    def __hash__(self) -> int:
        return hash((self._kind, self._factor, self.low, self.high))

    def __repr__(self) -> str:
        kind, factor = self._kind.capitalize(), self._factor
        given = {"rigidity": factor} if kind == "Linear" else self._given
        scaled = f".scaled({factor!r})" if given is self._given and factor != 1.0 else ""
        text = ", ".join(f"{name}={value!r}" for name, value in given.items())
        return f"{kind}Elasticity({text}){scaled}" + ".slack_below()" * self._slack

    @property
    def _constant(self) -> float | None:
        """EA [N] if it is the same at all tensions."""
        return self._factor if self._kind == "linear" else None

    @property
    def _slack(self) -> bool:
        return self.low < self.rest

    @property
    def _span(self) -> str:
        """The tensions of the law, as text."""
        return f"[{self.low:g} N, {self.high:g} N{')' if math.isinf(self.high) else ']'}"

    def _changed(self, low: float, factor: float) -> Elasticity:
        same = self.high, self.rest, self._kind, self._given
        return Elasticity(low, *same, factor, self._table)

    def _inside(self, F: Array) -> Array:
        """Return the tensions F [N], or raise ElasticityRangeError."""
        if F.size and not (F.min() >= self.low and F.max() <= self.high):
            outside = (self.low > F) | (self.high < F)
            below = "; slack_below() continues one to 0 N" if F.min() < self.low else ""
            problem = (
                f"outside the domain {self._span} of the elasticity. Keep the tension inside it "
                f"(minimum=, maximum=), or use an elasticity that covers it{below}."
            )
            raise ElasticityRangeError(
                problem, F[outside].tolist(), np.flatnonzero(outside).tolist()
            )
        return F

    def _evaluate(self, F: Array) -> tuple[Array, Array]:
        """Compute ε [-] and EA [N] at tensions F [N] of the law, any shape."""
        inside = F if self.low == self.rest else np.maximum(F, self.rest)
        piece, x = self._table.place(inside)
        rows = self._table.coefficients.take(piece, axis=1)
        softness, strain = rows[0], rows[0] * x + rows[1]
        for row in rows[2:]:  # in place, which is twice as fast
            softness *= x
            softness += strain
            strain *= x
            strain += row
        strain /= self._factor
        EA = self._factor / softness
        return (strain, EA) if inside is F else (strain + (F - inside) / EA, EA)

    def _tension_of(
        self, wanted: Array, name: str, length: float = 1.0, series: float = 0
    ) -> Array:
        """Return F [N] at which ``length`` · ε + ``series`` · (F − rest) is ``wanted``."""
        knots = np.append(0.0, self._table.knots) if self._slack else self._table.knots
        reached = length * self._evaluate(knots)[0] + series * (knots - self.rest)
        if (outside := (wanted < reached[0]) | (wanted > reached[-1] * (1.0 + 1e-15))).any():
            given = f"the {name} {wanted[outside][0]:.6g}; it reaches {reached[-1]:.6g}."
            problem = f"no tension of the domain {self._span} gives {given}"
            raise ElasticityRangeError(problem, indices=np.flatnonzero(outside).tolist())
        after = np.searchsorted(reached, wanted).clip(1, len(knots) - 1)
        low, high, F = knots[after - 1], knots[after], np.interp(wanted, reached, knots)
        for _ in range(50):  # Newton's method in a shrinking bracket
            strain, EA = self._evaluate(F)
            error = length * strain + series * (F - self.rest) - wanted
            low, high = np.where(error < 0.0, F, low), np.where(error > 0.0, F, high)
            F, before = np.clip(F - error / (length / EA + series), low, high), F
            if (abs(F - before) <= 1e-13 * np.maximum(F, 1.0)).all():
                break
        return np.asarray(F)


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
