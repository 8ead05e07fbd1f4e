"""Monte Carlo runs: a measurand of many arms with random errors (JCGM 101)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.batch.distribution import checked_threads
from cdsm.batch.quantities import Codes
from cdsm.errors import InvalidInput
from cdsm.loads import LoadsLike
from cdsm.posture import Posture
from cdsm.status import Status
from cdsm.support.format import with_uncertainty
from cdsm.support.progress import progress_bar
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import Direction, flag, fraction, whole_number
from cdsm.support.values import Array, Plotted, frozen
from cdsm.tension import Tension
from cdsm.tolerances import Tolerances
from cdsm.tolerancing.budget import Uncertainty, budget_of
from cdsm.tolerancing.measurand import measurand_of

_AGREES = 0.1  # largest difference of the ends of intervals that agree, in uncertainties
_BLOCK = 1000  # number of draws in a block; each block has its own random numbers


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class MonteCarlo(Result, Plotted):
    """Values of a measurand for many arms with random errors; made by :func:`monte_carlo`.

    Attributes:
        budget: Uncertainty of the same measurand to first order.
        values: The measurand of each arm for which it exists (n,) [N/m], [N m/rad], [m] or [N].
        status: :class:`Status` of each draw: why the measurand does not exist for some arms.
        seed: Seed of the random numbers.
    """

    _headline = "standard_uncertainty"
    _rows = "draw"
    _figure = "plot_monte_carlo"

    budget: Uncertainty
    values: Array = field(metadata=unit("measurand", "draw"))
    status: Codes
    seed: int = field(metadata=unit("1"))

    @quantity("measurand")
    def mean(self) -> float:
        """Mean of the values."""
        return float(self.values.mean())

    @quantity("measurand")
    def standard_uncertainty(self) -> float:
        """Standard deviation of the values (JCGM 101, Eq. 17)."""
        return float(self.values.std(ddof=1))

    @quantity("1")
    def failed(self) -> int:
        """Number of draws for which the measurand does not exist; the values leave them out."""
        return self.status.size - self.values.size

    @property
    def errors(self) -> Mapping[str, Array]:
        """Errors (n, inputs) of each source in the arms of the values, drawn again from the seed.

        Tools for sensitivity analysis take them; ``budget.measurand.inputs.labels`` names them.
        """
        drawn = [*_draws(self.budget, self.seed, self.status.size)]
        fine = self.status == Status.OK
        return {name: np.concatenate([block[name] for block in drawn])[fine] for name in drawn[0]}

    def interval(self, probability: float = 0.95) -> tuple[float, float]:
        """Return the interval (low, high) that contains the fraction ``probability`` of the values.

        As many values are below the interval as above it (JCGM 101, 7.7). Raises InvalidInput if
        ``probability`` is not between 0 and 1.
        """
        p = fraction("probability", probability)
        low, high = np.quantile(self.values, [(1.0 - p) / 2.0, (1.0 + p) / 2.0])
        return float(low), float(high)

    @property
    def agrees(self) -> bool:
        """Whether the ends of the 95 % intervals of Monte Carlo and first order agree.

        JCGM 101, clause 8, compares them too; here they may differ by 10 % of the uncertainty.
        """
        both = zip(self.interval(), self.budget.interval(), strict=True)
        return all(abs(a - b) <= _AGREES * self.standard_uncertainty for a, b in both)

    def __str__(self) -> str:
        unit, size = self.budget.measurand.unit
        low, high, *first = (x / size for x in (*self.interval(), *self.budget.interval()))
        shown = with_uncertainty(self.mean, self.standard_uncertainty, size)
        word = "agrees with" if self.agrees else "differs from"
        lines = [
            *self.budget.stability_warnings,
            f"{self.budget.name}: {shown} {unit}, {self.values.size} draws",
            f"95 % of the draws: {low:.4g} to {high:.4g} {unit}, which {word} first order "
            f"({first[0]:.4g}, {first[1]:.4g})",
        ]
        if self.failed:
            why = ", ".join(Status(code).name for code in np.unique(self.status) if code)
            lines.append(f"it does not exist for {self.failed} more draws, left out: {why}")
        return "\n".join(lines)

    def _units(self) -> dict[str, str]:
        return self.budget._units()

    def _labels(self) -> dict[str, Sequence[object]]:
        return {"draw": np.flatnonzero(self.status == Status.OK).tolist()}


def monte_carlo(
    pose: Posture,
    tension: Tension | ArrayLike,
    tolerances: Tolerances | None = None,
    *,
    direction: Direction | None = None,
    of: str = "along",
    cable: str | None = None,
    wrench: LoadsLike | None = None,
    redistribute: bool = False,
    draws: int = 100_000,
    seed: int = 0,
    progress: bool = True,
) -> MonteCarlo:
    """Compute a number of many arms with random errors within the tolerances (JCGM 101).

    Rigidities and springs stay positive: 1 + a normal relative error is drawn from the lognormal
    distribution of the same mean and standard uncertainty. Arms for which the number does not
    exist, such as those with a tension outside its law, are left out and counted. The same seed
    gives the same draws, with which more draws begin.

    Args:
        pose: The posture.
        tension: A :class:`~cdsm.Tension`, or your own tensions (C,) [N].
        tolerances: Tolerances of the arm, the angles and the tensions; None: those of the arm.
        direction: As for :func:`~cdsm.uncertainty`, and so are the next four.
        of: The measurand.
        cable: Name of the cable.
        wrench: What acts with your own tensions.
        redistribute: Distribute the tensions of each arm again.
        draws: Number of arms, 100 to 10⁸.
        seed: Seed of the random numbers, from 0.
        progress: Show a progress bar on a terminal.

    Raises:
        InvalidInput: ``draws`` or ``seed`` is out of range; no tolerance is given; or the number
            exists for fewer than half of the arms. Other errors as for :func:`~cdsm.uncertainty`.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> F = cdsm.distribute_tension(pose, minimum=5.0)
        >>> tolerances = cdsm.Tolerances(tension=cdsm.Tolerance(0.5))
        >>> draws = cdsm.monte_carlo(pose, F, tolerances, direction="z", draws=1000, progress=False)
        >>> print(draws)
        stiffness along (0, 0, 1): 2.10 ± 0.14 N/mm, 1000 draws
        95 % of the draws: 1.813 to 2.37 N/mm, which differs from first order (1.831, 2.379)
    """
    count = whole_number("draws", draws, 100, 10**8)
    start = whole_number("seed", seed, 0)
    wanted = flag("progress", progress)
    asked = measurand_of(pose, tension, direction, of, cable, wrench, redistribute)
    budget = budget_of(asked, tolerances)
    if not budget.tolerances.given:
        raise InvalidInput("tolerances", "are all zero, so all draws are the same; give one.")
    values = []
    status = []
    with progress_bar("Monte Carlo", count, wanted=wanted) as advance:
        for errors in _draws(budget, start, count):
            numbers, codes = budget.measurand.of_arms(errors, checked_threads(None))
            values.append(numbers[codes == Status.OK, 0])
            status.append(codes)
            advance(codes.size)
    exist = np.concatenate(values)
    codes = np.concatenate(status)
    if exist.size < count / 2:
        worst = Status(int(np.bincount(codes[codes != Status.OK]).argmax())).name
        problem = f"the {budget.name} exists for {exist.size} of {count} draws; most others are "
        raise InvalidInput("tolerances", f"{problem}{worst}. Lower them, or change the tensions.")
    return MonteCarlo(budget=budget, values=frozen(exist), status=frozen(codes), seed=start)


def _draws(budget: Uncertainty, seed: int, count: int) -> Iterator[dict[str, Array]]:
    """Yield the errors of the arms of each block; they depend on ``seed`` and its number."""
    inputs = budget.measurand.inputs
    groups = inputs.groups(budget.tolerances)
    for block, first in enumerate(range(0, count, _BLOCK)):
        drawn = inputs.draw(groups, np.random.default_rng([seed, block]), _BLOCK)
        yield {source: numbers[: count - first] for source, numbers in drawn.items()}
