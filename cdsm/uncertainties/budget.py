"""Uncertainty budget of a reading: its standard uncertainty and the contribution of each source.

A reading is one number of an arm, such as its stiffness along a direction. A source is a kind of
inputs with errors, such as all hole radii.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import ArrayLike

import cdsm
from cdsm.errors import CdsmError, InvalidInput, SingularStiffness
from cdsm.posture import Posture
from cdsm.stiffness_matrix.instability import verdict
from cdsm.support.validation import scalar
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tension import Tension
from cdsm.tolerances import Tolerances
from cdsm.uncertainties.inputs import inputs_of
from cdsm.uncertainties.parts import Part, draw, standards, variance
from cdsm.uncertainties.question import checked_question, chosen_tolerances
from cdsm.uncertainties.readings import Question, Reading
from cdsm.uncertainties.texts import shown, with_uncertainty

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LINEAR = 0.05
"""Largest ``nonlinearity`` with which first-order propagation is taken as sufficient."""

_PROBED = 100  # number of drawn arms with which the error of first-order propagation is estimated

_ROUNDING = 1e-9  # a smaller relative uncertainty is rounding


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Uncertainty(ReadOnlyState):
    """Standard uncertainty of a reading and its contributions; made by :func:`uncertainty`.

    Attributes:
        question: The reading: its name, its direction or cable, and the stiffness of the arm.
        tolerances: The tolerances.
        value: The reading of the arm without errors [N/m], [N m/rad], [m] or [N].
        standard_uncertainty: u_c = √Σ u_i² over the sources [N/m], [N m/rad], [m] or [N].
        contributions: u_i of each source that has a tolerance, largest first [N/m], [N m/rad], [m]
            or [N].
        sensitivities: For each source, the partial derivatives (n,) of the value with respect to
            its n inputs, in the unit of the value per [-], [rad], [m], [N] or [kg].
    """

    question: Question
    tolerances: Tolerances
    value: float
    standard_uncertainty: float
    contributions: Mapping[str, float]
    sensitivities: Mapping[str, Array]

    @cached_property
    def parts(self) -> Mapping[str, tuple[Part, ...]]:
        """Groups of inputs that share a tolerance, by source, such as ``hole_radius``."""
        return self.question.parts(self.tolerances)

    @property
    def relative(self) -> float:
        """Standard uncertainty divided by the magnitude of the value [-]; inf for the value 0."""
        return self.standard_uncertainty / abs(self.value) if self.value else math.inf

    @cached_property
    def nonlinearity(self) -> float:
        """RMS error of the linear approximation over 100 random arms, relative to u_c [-].

        The standard uncertainty of Monte Carlo differs from u_c by at most this fraction. It is inf
        if the reading does not exist for one of the arms.
        """
        errors = self._drawn(np.random.default_rng(0), _PROBED)
        if not errors:
            return 0.0
        try:
            left = self.question.at(errors) - self.value
        except CdsmError:
            return math.inf
        for source, drawn in errors.items():
            left -= drawn @ self.sensitivities[source]
        rounding = _ROUNDING * abs(self.value)
        return float(np.sqrt(np.mean(left**2))) / max(self.standard_uncertainty, rounding)

    def _drawn(self, rng: np.random.Generator, draws: int) -> dict[str, Array]:
        """Draw random errors (draws, n) of the n inputs of each source that has a tolerance."""
        labels = self.question.labels
        return {name: draw(own, rng, draws, len(labels[name])) for name, own in self.parts.items()}

    @property
    def is_linear(self) -> bool:
        """Whether :attr:`nonlinearity` is at most 5 %: first-order error propagation is sufficient.

        If not, see :func:`~cdsm.monte_carlo`.
        """
        return self.nonlinearity <= LINEAR

    def interval(self, probability: float = 0.95) -> tuple[float, float]:
        """Return the coverage interval value ± k u_c, with k of the normal distribution.

        Raises InvalidInput if the probability is not between 0 and 1.
        """
        from scipy.special import ndtri

        k = float(ndtri((1.0 + checked_probability(probability)) / 2.0))
        half = k * self.standard_uncertainty
        return self.value - half, self.value + half

    def largest_inputs(self, count: int = 5) -> tuple[tuple[str, str, float], ...]:
        """Return the ``count`` inputs that contribute most: source, name and contribution.

        The contribution of an input x to the uncertainty of the value f is |∂f/∂x| u(x), in SI.
        """
        labels = self.question.labels
        each = [
            (source, name, abs(float(g)) * float(u))
            for source, parts in self.parts.items()
            for name, g, u in zip(
                labels[source],
                self.sensitivities[source],
                standards(parts, len(labels[source])),
                strict=True,
            )
        ]
        return tuple(sorted(each, key=lambda entry: -entry[2])[:count])

    def to_dict(self) -> dict[str, object]:
        """Return value, standard uncertainty, interval and contributions in SI, with the unit."""
        low, high = self.interval()
        return {
            "quantity": self.question.name,
            "unit": self.question.si_unit,
            "value": self.value,
            "standard_uncertainty": self.standard_uncertainty,
            "interval_95": [low, high],
            "linear": self.is_linear,
            "contributions": dict(self.contributions),
        }

    def plot(self) -> Figure:
        """Plot the contributions to the standard uncertainty, one bar per source."""
        return cdsm.plots.plot_uncertainty(self)

    def __repr__(self) -> str:
        return f"<Uncertainty {self._headline}>"

    def __str__(self) -> str:
        unit, size = self.question.unit
        low, high = self.interval()
        lines = [
            *self._unstable,
            f"{self._headline} (one standard uncertainty, {100.0 * self.relative:.2g} %)",
            f"95 % of such arms: {low / size:.4g} to {high / size:.4g} {unit}",
            f"{'source':<14}{'tolerance':>16}{f'contribution [{unit}]':>24}{'of variance':>14}",
        ]
        for source, u in self.contributions.items():
            if u == 0.0:
                continue
            size_of_inputs = standards(self.parts[source], self.sensitivities[source].size)
            share = (u / self.standard_uncertainty) ** 2
            lines.append(
                f"{source:<14}{shown(source, size_of_inputs):>16}{u / size:>24.3g}"
                f"{100.0 * share:>12.3g} %"
            )
        without = [source for source, u in self.contributions.items() if u == 0.0]
        if without:
            lines.append(f"without influence on it: {', '.join(without)}")
        return "\n".join([*lines, *self._nonlinear])

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings if the arm is UNSTABLE, or if first-order error propagation is insufficient."""
        return self._unstable + self._nonlinear

    @property
    def _unstable(self) -> tuple[str, ...]:
        """Warning, in a tuple, if the reading is a stiffness and the arm is unstable.

        No weight can measure such a stiffness. Otherwise the tuple is empty.
        """
        K = self.question.stiffness
        read = self.question.of in ("along", "margin")
        return (verdict(K),) if read and not K.is_stable else ()

    @property
    def _nonlinear(self) -> tuple[str, ...]:
        if self.is_linear:
            return ()
        off = f"{100.0 * self.nonlinearity:.2g} %"
        return (
            f"first order is not enough here: the uncertainty may be up to {off} larger or "
            "smaller; use Monte Carlo (cdsm.monte_carlo)",
        )

    @property
    def shown(self) -> str:
        """Text "value ± standard uncertainty" in the unit shown to the user, without the unit.

        The uncertainty has two digits.
        """
        return with_uncertainty(self.value, self.standard_uncertainty, self.question.unit[1])

    @property
    def _headline(self) -> str:
        return f"{self.question.name}: {self.shown} {self.question.unit[0]}"


def uncertainty(
    pose: Posture,
    tension: Tension | ArrayLike,
    tolerances: Tolerances | None = None,
    *,
    direction: ArrayLike | None = None,
    of: Reading = "along",
    cable: str | None = None,
    wrench: ArrayLike | None = None,
) -> Uncertainty:
    """Compute the standard uncertainty of a reading to first order (JCGM 100, Eq. 13).

        u_c² = Σ_s u_s² ((1 − ρ_s) g_s·g_s + ρ_s (Σ g_s)²)

    A reading is one number of the arm, such as its stiffness along a direction. Each source s of
    uncertainty (such as all hole radii) has the standard uncertainty u_s, the correlation ρ_s of
    its inputs, and the exact partial derivatives g_s of the reading with respect to these inputs.
    For ``"tension"``, each arm with errors has its own least tensions; cables at a bound stay
    there. For all other readings the tensions are measured: they are inputs
    with errors, too.

    Args:
        pose: The posture.
        tension: A :class:`~cdsm.Tension` or, unless ``of`` is ``"tension"``, your own
            tensions (C,) [N].
        tolerances: Tolerances of the arm, the angles and the tensions; None: the tolerances of the
            arm, as in the table ``[tolerances]`` of its file.
        direction: u (3,) in base axes, any length: for ``"along"`` and ``"tip"`` only.
        of: ``"along"``: the stiffness along u [N/m], without friction. ``"margin"``: the
            smallest eigenvalue of K_θ [N m/rad]. ``"tip"``: the tip's coordinate along u [m].
            ``"tension"``: the distributed tension of a cable [N].
        cable: Name of the cable, for ``"tension"`` only.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]; only with your own
            tensions.

    Raises:
        InvalidInput: An argument has the wrong type or shape; ``direction`` or ``cable`` is missing
            or not wanted; the arm does not have one of the sources; or so many cables are at a
            bound that the least tensions have no derivative.
        UnknownName: ``of`` or ``cable`` is unknown.
        ElasticityRangeError: A tension is outside the domain of its cable's law.
        SingularStiffness: The reading does not exist.
    """
    tolerances = chosen_tolerances(pose, tolerances)
    question = checked_question(pose, tension, direction, of, cable, wrench)
    inputs_of(pose.arm).require(tolerances, pose.arm)
    value = question.value()
    if not math.isfinite(value):  # the stiffness along a direction
        assert question.direction is not None
        raise SingularStiffness(
            "the tip cannot move in this direction: its stiffness is infinite, and has no "
            "uncertainty. Choose another direction, or bend the arm.",
            question.direction,
        )
    gradient = question.gradient()
    variances = {
        source: variance(parts, gradient[source])
        for source, parts in question.parts(tolerances).items()
    }
    ranked = sorted(variances, key=lambda source: -variances[source])
    return Uncertainty(
        question=question,
        tolerances=tolerances,
        value=value,
        standard_uncertainty=math.sqrt(sum(variances.values())),
        contributions={source: math.sqrt(variances[source]) for source in ranked},
        sensitivities={source: frozen(g) for source, g in gradient.items()},
    )


def checked_probability(probability: float) -> float:
    """Return ``probability``; raise InvalidInput if it is not between 0 and 1."""
    p = scalar("probability", probability)
    if not 0.0 < p < 1.0:
        raise InvalidInput("probability", f"{p:g} given; a number between 0 and 1 is needed.")
    return p
