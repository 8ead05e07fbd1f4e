"""Uncertainty budget of a measurand: its standard uncertainty and the part of each source in it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.batch.quantities import Codes
from cdsm.errors import InvalidInput, SingularStiffness
from cdsm.loads import LoadsLike
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.status import Status
from cdsm.stiffness_matrix.verdict import describe_buckling
from cdsm.support.format import span, with_uncertainty
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import Direction, fraction, instance
from cdsm.support.values import Array, Plotted, frozen
from cdsm.tension import Tension
from cdsm.tolerances import Tolerance, Tolerances, sources
from cdsm.tolerancing.inputs import Errors, Group
from cdsm.tolerancing.measurand import Measurand, measurand_of
from cdsm.wires.ropes import construction_of

_LINEAR = 0.05  # largest nonlinearity with which first order is taken as sufficient
_DRAWN = 100  # random arms that show how far from linear a measurand is
_STEP = 0.1  # of differences, in standard uncertainties
_ROWS = 1000  # arms in one batch, which bounds its memory
_ROUNDING = 1e-9  # a smaller relative uncertainty is rounding


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Uncertainty(Result, Plotted):
    """Standard uncertainty of a measurand and its contributions; made by :func:`uncertainty`.

    Attributes:
        measurand: What is uncertain: its name, direction or cable, and the stiffness of the arm.
        tolerances: The tolerances.
        value: The measurand of the arm without errors [N/m], [N m/rad], [m] or [N].
        standard_uncertainty: `u_c = √(Σ u_i²)` over the sources, in the unit of the value.
        contributions: `u_i` of each source that has a tolerance, largest first, in the same unit.
        nonlinearity: RMS error of the linear approximation over 100 random arms, relative to `u_c`
            [-]. The standard uncertainty of Monte Carlo differs from `u_c` by at most this part.
        failed: Number of these arms for which the measurand does not exist.
    """

    _headline = "standard_uncertainty"
    _rows = "source"
    _figure = "plot_uncertainty"

    measurand: Measurand
    tolerances: Tolerances
    value: float = field(metadata=unit("measurand"))
    standard_uncertainty: float = field(metadata=unit("measurand"))
    contributions: Mapping[str, float] = field(metadata=unit("measurand", "source"))
    nonlinearity: float = field(metadata=unit("1"))
    failed: int = field(metadata=unit("1"))

    @quantity("1")
    def name(self) -> str:
        """Name of the measurand as text."""
        return self.measurand.name

    @quantity("1")
    def is_linear(self) -> bool:
        """Whether first order is sufficient: nonlinearity at most 5 %, and no arm failed."""
        return self.nonlinearity <= _LINEAR and not self.failed

    @property
    def relative(self) -> float:
        """Standard uncertainty divided by the magnitude of the value [-]; inf for the value 0."""
        return self.standard_uncertainty / abs(self.value) if self.value else math.inf

    @cached_property
    def sensitivities(self) -> Mapping[str, Array]:
        """Derivatives (n,) of the value by the n inputs of each source that has a tolerance.

        They are central differences, in the unit of the value per [-], [rad], [m], [N] or [kg].
        """
        derivatives = {}
        for source, tolerances in self.tolerances.given.items():
            most = max(tolerances, key=lambda tolerance: tolerance.standard)
            inputs = np.arange(len(self.measurand.inputs.labels[source]))[:, None]
            groups = [Group(source, number, most) for number in inputs]
            derivatives[source] = frozen(_differences(self.measurand, groups, {})[0][:, 0])
        return derivatives

    def interval(self, probability: float = 0.95) -> tuple[float, float]:
        """Return the coverage interval value `± k u_c`, with k of the normal distribution.

        Raises InvalidInput if the probability is not between 0 and 1.
        """
        from scipy.special import ndtri

        k = float(ndtri(0.5 + fraction("probability", probability) / 2.0))
        low, high = (self.value + s * k * self.standard_uncertainty for s in (-1.0, 1.0))
        return low, high

    def __str__(self) -> str:
        (unit, size) = self.measurand.unit
        relative = 100.0 * self.relative
        low, high = (end / size for end in self.interval())
        tensions = "its own least tensions" if self.measurand.redistribute else "the tensions given"
        with_them = "" if self.measurand.quantity.needs == "posture" else f", each with {tensions}"
        lines = [
            *self.stability_warnings,
            f"{self.name}: {self.shown} {unit} (one standard uncertainty, {relative:.2g} %)",
            f"95 % of such arms: {low:.4g} to {high:.4g} {unit}{with_them}",
            f"{'source':<16}{'tolerance':>16}{f'contribution [{unit}]':>24}{'of variance':>14}",
        ]
        for source, u in self.contributions.items():
            shown, scale = _unit_of_errors(source)
            errors = np.array([one.standard for one in self.tolerances.given[source]])
            tolerance = f"{span(errors / scale, '{:.3g}'.format)} {shown}".rstrip()
            share = 100.0 * (u / (self.standard_uncertainty or 1.0)) ** 2
            line = f"{source:<16}{tolerance:>16}{u / size:>24.3g}{share:>12.3g} %"
            lines += [line] if u else []
        if without := [source for source, u in self.contributions.items() if not u]:
            lines.append(f"without influence on it: {', '.join(without)}")
        return "\n".join([*lines, *self._nonlinear])

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings if the arm is UNSTABLE, or if first-order error propagation is insufficient."""
        return self.stability_warnings + self._nonlinear

    @property
    def shown(self) -> str:
        """Text "value ± standard uncertainty" in the unit for people, which is not written."""
        return with_uncertainty(self.value, self.standard_uncertainty, self.measurand.unit[1])

    @property
    def stability_warnings(self) -> tuple[str, ...]:
        """Warning that the arm is UNSTABLE, if the measurand is a stiffness."""
        K = self.measurand.stiffness
        has_stiffness = self.measurand.quantity.needs in ("stiffness", "stable arm")
        return (describe_buckling(K),) if has_stiffness and not K.is_stable else ()

    @property
    def _nonlinear(self) -> tuple[str, ...]:
        far = 100.0 * self.nonlinearity
        why = f"it does not exist for {self.failed} of {_DRAWN} random arms"
        if not self.failed:
            part = f"up to {far:.2g} % larger or smaller"
            why = f"the uncertainty may be {part if far < 100.0 else 'several times as large'}"
        warning = f"first order is not enough here: {why}; use Monte Carlo (cdsm.monte_carlo)"
        return () if self.is_linear else (warning,)

    def _units(self) -> dict[str, str]:
        return {"measurand": self.measurand.si_unit}

    def _labels(self) -> dict[str, Sequence[object]]:
        return {"source": tuple(self.contributions)}


def _unit_of_errors(source: str) -> tuple[str, float]:
    """Return the unit in which people read the errors of a source, and its size in SI."""
    row = sources()[source]
    return ("%", 1e-2) if row.is_relative else row.unit.shown


def uncertainty(
    pose: Posture,
    tension: Tension | ArrayLike,
    tolerances: Tolerances | None = None,
    *,
    direction: Direction | None = None,
    of: str = "along",
    cable: str | None = None,
    wrench: LoadsLike | None = None,
    redistribute: bool = False,
) -> Uncertainty:
    """Compute the standard uncertainty of a number of an arm to first order (JCGM 100, Eq. 13).

        `u_c² = Σ_s u_s² ((1 − ρ_s) g_s·g_s + ρ_s (Σ g_s)²)`

    Each source s of uncertainty (such as all hole radii) has the standard uncertainty `u_s`, the
    correlation `ρ_s` of its inputs, and the derivatives `g_s` of the measurand with respect to
    them. These are central differences between arms with errors of `± u_s/10` (JCGM 100, 5.1.3,
    Note 2).

    The tensions of a real arm are measured: they have errors of their own. That they balance the
    arm, which ties these errors to those of angles and dimensions, is not used. The tensions of an
    arm on paper follow from it: with ``redistribute``, each arm with errors has its own least
    tensions, within the same bounds.

    Args:
        pose: The posture.
        tension: A :class:`~cdsm.Tension`, or your own tensions (C,) [N].
        tolerances: Tolerances of the arm, the angles and the tensions; None: those of the arm, with
            the scatter of EA of its ropes.
        direction: u in base axes, for ``"along"`` and ``"tip_along"`` only.
        of: ``"along"``: the stiffness along u [N/m], without friction. ``"margin"``: the smallest
            eigenvalue of `K_θ` [N m/rad]. ``"tip_along"``: the tip's coordinate along u [m].
            ``"tension"``: the least tension of a cable [N], always distributed again.
        cable: Name of the cable, for ``"tension"`` only.
        wrench: What acts with your own tensions, as for :func:`~cdsm.stiffness`.
        redistribute: Distribute the tensions of each arm again; ``tension`` is a least
            :class:`~cdsm.Tension`, and its tolerance has no influence.

    Raises:
        InvalidInput: An argument has the wrong type or shape, is missing or not wanted; the arm has
            none of a source; or the measurand does not exist for small errors of an input. ``of``
            or ``cable`` is unknown.
        ElasticityRangeError: A tension is outside the domain of its cable's law.
        SingularStiffness: The measurand does not exist.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> F = cdsm.distribute_tension(pose, minimum=5.0)
        >>> tolerances = cdsm.Tolerances(tension=0.5, hole_radius=5e-5)
        >>> budget = cdsm.uncertainty(pose, F, tolerances, direction="z")
        >>> print(f"{budget.value:.0f} ± {budget.standard_uncertainty:.0f} N/m")
        2105 ± 140 N/m
    """
    asked = measurand_of(pose, tension, direction, of, cable, wrench, redistribute)
    return budget_of(asked, tolerances)


def budget_of(measurand: Measurand, tolerances: Tolerances | None) -> Uncertainty:
    """Compute the budget of a measurand; ``tolerances`` are as for :func:`uncertainty`."""
    used = known_tolerances(measurand.stiffness.posture.arm)
    if tolerances is not None:
        used = instance("tolerances", tolerances, Tolerances)
    elif not used.given:
        problem = "none given, and the arm has none; give Tolerances(rigidity=0.05, …), or a table "
        raise InvalidInput("tolerances", problem + "[tolerances] in its file.")
    groups = measurand.inputs.groups(used)
    (value,) = measurand.value().tolist()
    if measurand.direction is not None and math.isinf(value):
        problem = "the tip cannot move in this direction: its stiffness is infinite, and has no "
        problem += "uncertainty. Choose another direction, or bend the arm."
        raise SingularStiffness(problem, measurand.direction)
    drawn = measurand.inputs.draw(groups, np.random.default_rng(0), _DRAWN)
    variances, left, status = propagate(measurand, groups, drawn)
    parts = {source: math.sqrt(variance[0]) for source, variance in variances.items()}
    u = math.hypot(*parts.values())
    exist = status == Status.OK
    scale = max(u, _ROUNDING * abs(value)) or 1.0
    return Uncertainty(
        measurand=measurand,
        tolerances=used,
        value=value,
        standard_uncertainty=u,
        contributions=dict(sorted(parts.items(), key=lambda part: -part[1])),
        nonlinearity=float(np.sqrt(np.mean(left[exist] ** 2))) / scale if exist.any() else 0.0,
        failed=int(np.count_nonzero(~exist)),
    )


def known_tolerances(arm: Manipulator) -> Tolerances:
    """Return the tolerances of an arm; of a rope, EA has the scatter of its construction.

    The scatter is one error for all cables of a rope, as of one spool. Tolerances of the arm that
    have a ``rigidity`` stay as they are.
    """
    if arm.tolerances.rigidity:
        return arm.tolerances
    rows = {cable.name: construction_of(cable.elasticity) for cable in arm.cables}
    scatters = {name: row.scatter for name, row in rows.items() if row}
    if not scatters:
        return arm.tolerances
    if len(scatters) == len(rows) and len(set(scatters.values())) == 1:
        (scatter,) = set(scatters.values())
        return arm.tolerances.replace(rigidity=scatter)
    return arm.tolerances.replace(
        rigidity=[Tolerance(u, correlation=1.0, of=name) for name, u in scatters.items()]
    )


def propagate(
    measurand: Measurand, groups: Sequence[Group], drawn: Errors
) -> tuple[dict[str, Array], Array, Codes]:
    """Compute the variance (k,) by each source, and what is not linear (D, k) in D drawn arms.

    The latter is the measurand less its linear approximation; the status (D,) of the arms follows.
    """
    alone = [group.split() for group in groups]
    slopes, values, status = _differences(measurand, list(chain(*alone)), drawn)
    variances: dict[str, Array] = {}
    left = values - measurand.value()
    end = 0
    for (source, _, tolerance), parts in zip(groups, alone, strict=True):
        u = tolerance.standard
        rho = tolerance.correlation
        g = slopes[end : end + len(parts)]
        end = end + len(parts)
        variance = u**2 * ((1.0 - rho) * (g**2).sum(axis=0) + rho * g.sum(axis=0) ** 2)
        variances[source] = variances.get(source, 0.0) + variance
        if drawn:
            left = left - drawn[source][:, [part.inputs[0] for part in parts]] @ g
    return variances, left, status


def _differences(
    measurand: Measurand, groups: Sequence[Group], drawn: Errors
) -> tuple[Array, Array, Codes]:
    """Differentiate by the common error of each group (m, k), and evaluate D drawn arms (D, k).

    A difference is one-sided where the measurand exists only for one sign of the error.
    """
    m = len(groups)
    value = measurand.value()
    labels = measurand.inputs.labels
    step = _STEP * np.array([group.tolerance.standard for group in groups])
    arms = 2 * m + len(next(iter(drawn.values()), ()))
    values = np.zeros((arms, value.size))
    status = np.zeros(arms, dtype=np.uint8)
    sources = {*drawn, *(group.source for group in groups)}
    for rows in np.split(np.arange(arms), range(_ROWS, arms, _ROWS)) if groups else ():
        errors = {source: np.zeros((rows.size, len(labels[source]))) for source in sources}
        for row, arm in enumerate(rows[rows < 2 * m].tolist()):
            group = groups[arm % m]
            size = step[arm % m]
            errors[group.source][row, group.inputs] = size if arm < m else -size
        for source, drawn_errors in drawn.items():
            errors[source][rows >= 2 * m] = drawn_errors[rows[rows >= 2 * m] - 2 * m]
        values[rows], status[rows] = measurand.of_arms(errors)
    exist = (status[: 2 * m] == Status.OK).reshape(2, m, 1)
    for n in np.flatnonzero(~exist.any(axis=0)).tolist():
        name = labels[groups[n].source][groups[n].inputs[0]]
        state = Status(status[n]).name
        problem = f"with a small error of {name} the arm is {state}: there is no budget by it."
        raise InvalidInput(groups[n].source, f"{problem} Change the tensions, or leave it out.")
    up, down = np.where(exist, values[: 2 * m].reshape(2, m, value.size), value)
    return (up - down) / (step[:, None] * exist.sum(axis=0)), values[2 * m :], status[2 * m :]
