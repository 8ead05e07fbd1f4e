"""Monte Carlo runs: a reading of many arms with random errors within the tolerances (JCGM 101).

A reading is one number of an arm, such as its stiffness along a direction.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import ArrayLike

import cdsm
from cdsm.errors import InvalidInput
from cdsm.posture import Posture
from cdsm.support.extras import need
from cdsm.support.progress import progress_bar
from cdsm.support.validation import flag, whole_number
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tension import Tension
from cdsm.tolerances import Tolerances
from cdsm.uncertainties.budget import Uncertainty, checked_probability, uncertainty
from cdsm.uncertainties.question import chosen_tolerances
from cdsm.uncertainties.readings import Reading
from cdsm.uncertainties.texts import with_uncertainty

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

_BLOCK = 1000  # number of draws in a block; each block has its own random numbers

AGREES = 0.1
"""Two 95 % intervals agree if their limits differ by at most this part of the uncertainty."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class MonteCarlo(ReadOnlyState):
    """Values of a reading for many arms with random errors; made by :func:`monte_carlo`.

    Attributes:
        budget: Uncertainty of the same reading to first order.
        values: The reading of each arm (n,) [N/m], [N m/rad], [m] or [N].
        seed: Seed of the random numbers.
    """

    budget: Uncertainty
    values: Array
    seed: int

    @cached_property
    def mean(self) -> float:
        """Mean of the values."""
        return float(self.values.mean())

    @cached_property
    def standard_uncertainty(self) -> float:
        """Standard deviation of the values (JCGM 101, Eq. 17)."""
        return float(self.values.std(ddof=1))

    def interval(self, probability: float = 0.95) -> tuple[float, float]:
        """Return the interval (low, high) that contains the fraction ``probability`` of the values.

        As many values are below the interval as above it (JCGM 101, 7.7). Raises InvalidInput if
        ``probability`` is not between 0 and 1.
        """
        p = checked_probability(probability)
        low, high = np.quantile(self.values, [(1.0 - p) / 2.0, (1.0 + p) / 2.0])
        return float(low), float(high)

    @property
    def agrees(self) -> bool:
        """Whether first-order error propagation and Monte Carlo agree (JCGM 101, clause 8).

        They agree if each end of the 95 % interval of one differs from that of the other by at most
        10 % of the standard uncertainty.
        """
        both = zip(self.interval(), self.budget.interval(), strict=True)
        return all(abs(a - b) <= AGREES * self.standard_uncertainty for a, b in both)

    def to_xarray(self) -> xarray.Dataset:
        """Return the values and the errors of all inputs as a Dataset with dimension ``draw``.

        Each source of uncertainty has one variable of errors, labelled with the names of its
        inputs. Tools for sensitivity analysis need such samples. The errors are not stored, but
        drawn again from the seed.

        Raises:
            MissingExtra: xarray is not installed (extra ``sweep``).
        """
        need("sweep", "xarray")
        import xarray

        question, labels = self.budget.question, self.budget.question.labels
        drawn = [_errors(self.budget, self.seed, block) for block in _blocks(self.values.size)]
        reading = xarray.Variable(
            "draw", self.values, {"long_name": question.name, "units": question.si_unit}
        )
        variables: dict[str, object] = {question.of: reading}
        for source in self.budget.parts:
            size = f"{source}_input"
            errors = np.concatenate([each[source] for each in drawn])
            variables[f"{source}_error"] = (("draw", size), errors)
            variables[size] = ((size,), list(labels[source]))
        return xarray.Dataset(variables, attrs={"seed": self.seed})

    def plot(self) -> Figure:
        """Plot the histogram of the values and the normal distribution of :attr:`budget`."""
        return cdsm.plots.plot_monte_carlo(self)

    def __repr__(self) -> str:
        return f"<MonteCarlo {self.values.size} draws, {self._headline}>"

    def __str__(self) -> str:
        unit, size = self.budget.question.unit
        low, high = (end / size for end in self.interval())
        word = "agrees with" if self.agrees else "differs from"
        first = ", ".join(f"{end / size:.4g}" for end in self.budget.interval())
        return "\n".join(
            [
                *self.budget._unstable,
                f"{self.budget.question.name}: {self._headline}, {self.values.size} draws",
                f"95 % of the draws: {low:.4g} to {high:.4g} {unit}, which {word} first order "
                f"({first})",
            ]
        )

    @property
    def _headline(self) -> str:
        unit, size = self.budget.question.unit
        return f"{with_uncertainty(self.mean, self.standard_uncertainty, size)} {unit}"


def monte_carlo(
    pose: Posture,
    tension: Tension | ArrayLike,
    tolerances: Tolerances | None = None,
    *,
    direction: ArrayLike | None = None,
    of: Reading = "along",
    cable: str | None = None,
    wrench: ArrayLike | None = None,
    draws: int = 100_000,
    seed: int = 0,
    progress: bool = True,
) -> MonteCarlo:
    """Compute a reading for many arms with random errors within the tolerances (JCGM 101).

    A reading is one number of the arm, such as its stiffness along a direction. Each arm has its
    own angles, tensions, rigidities, leads, holes, disks, links and masses. The same seed gives the
    same values on any number of threads.

    Args:
        pose: The posture.
        tension: A :class:`~cdsm.Tension` or, unless ``of`` is ``"tension"``, your own
            tensions (C,) [N].
        tolerances: Tolerances of the arm, the angles and the tensions; None: those of the arm.
        direction: u (3,) in base axes, any length: for ``"along"`` and ``"tip"`` only.
        of: The reading; :func:`~cdsm.uncertainty` explains the names.
        cable: Name of the cable, for ``"tension"`` only.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]; only with your own
            tensions.
        draws: Number of arms, 100 to 10⁸.
        seed: Seed of the random numbers, from 0.
        progress: Show a progress bar on a terminal.

    Raises:
        InvalidInput: An argument is invalid for :func:`~cdsm.uncertainty`; ``draws`` or ``seed`` is
            out of range; or no tensions balance a drawn arm (``"tension"``).
        UnknownName: ``of`` or ``cable`` is unknown.
        ElasticityRangeError: A drawn tension is outside the domain of its cable's law.
        SingularStiffness: The reading does not exist.
    """
    count = whole_number("draws", draws, 100, 10**8)
    start = whole_number("seed", seed, 0)
    wanted = flag("progress", progress)
    tolerances = chosen_tolerances(pose, tolerances)
    if not tolerances.given:
        raise InvalidInput("tolerances", "are all zero, so all draws are the same; give one.")
    budget = uncertainty(
        pose, tension, tolerances, direction=direction, of=of, cable=cable, wrench=wrench
    )
    values = np.empty(count)
    blocks = _blocks(count)

    def compute(block: tuple[int, int]) -> Array:
        return budget.question.at(_errors(budget, start, block))

    with (
        progress_bar("Monte Carlo", count, wanted=wanted, rate=True) as advance,
        ThreadPoolExecutor(os.cpu_count()) as pool,
    ):
        for (i, size), part in zip(blocks, pool.map(compute, blocks), strict=True):
            values[i * _BLOCK : i * _BLOCK + size] = part
            advance(size)
    return MonteCarlo(budget=budget, values=frozen(values), seed=start)


def _blocks(count: int) -> list[tuple[int, int]]:
    """Split ``count`` draws into blocks; return the number (from 0) and the size of each."""
    return [(start // _BLOCK, min(_BLOCK, count - start)) for start in range(0, count, _BLOCK)]


def _errors(budget: Uncertainty, seed: int, block: tuple[int, int]) -> dict[str, Array]:
    """Draw the random errors of the arms of one block: an array (arms, inputs) per source.

    A ``block`` is (number, size). Its errors depend only on ``seed`` and its number.
    """
    number, count = block
    errors = budget._drawn(np.random.default_rng([seed, number]), _BLOCK)
    return {source: drawn[:count] for source, drawn in errors.items()}
