"""Results of estimates: tensions at the joints, and loads, with what is not known of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any, final

import numpy as np

from cdsm.applied import Applied, acts, tip_part
from cdsm.dead_loads import Load
from cdsm.errors import listed
from cdsm.estimation.components import Components
from cdsm.load_texts import texts
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.support.determination import INTERVAL, Determination, chi_square_text, likely
from cdsm.support.format import aligned, coordinates, place, plural, span, with_uncertainty
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import SMALLEST
from cdsm.support.values import Array, Plotted, frozen

_NOISE = 0.1  # [rad], or of the arm's length: so far beyond a limit, an encoder is not just noisy
_WIDE = 3.0  # times the instruments by which friction is named in a warning
_LARGE = 0.5  # Σ μ β of a cable from which on first order misleads
_CORRELATED = 0.9  # correlation of two loads that is printed
_SHOWN = 0.05  # part of the largest coefficient of a combination below which one is not printed


def beyond_noise(arm: Manipulator, q: Array) -> Array:
    """Return how far angles (nv,) are beyond a limit [rad or m]; 0 where it may be noise."""
    beyond = np.maximum(arm.lower - q, q - arm.upper)
    return np.where(beyond > _NOISE * np.where(arm.slides, arm.length, 1.0), beyond, 0.0)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class TensionEstimate(Result):
    """Tensions of the segments from tensions at the motors; see :func:`cdsm.estimate_tensions`.

    The S segments and P holes are in the order of :attr:`Posture.segments`.

    Attributes:
        posture: The posture that was measured.
        motor_tension: F that the load cells read (C,) [N].
        tension_std: Standard uncertainty of the load cells (C,) [N].
        tension_std_assumed: Whether it was not given.
        angle_std: Standard uncertainty of the joint coordinates (nv,) [rad].
        applied: Loads that are known: W (6,) at the tip, or loads on links.
        sliding: How the cable last slid in each hole (P,): 1 taken in, −1 let out, 0 unknown.
        segment_tension: T of each segment (S,) [N].
        segment_std: Standard uncertainty of T (S,) [N], of friction too.
        segment_low: Least T by the capstan law alone (S,) [N], for the readings F as they are.
        segment_high: Largest T by the capstan law alone (S,) [N].
        chi_square: χ² of what is left of the balance [-].
        freedom: Its degrees of freedom: equations less combinations of loads.
        at_stop: Joints on their stops, whose torque is unknown: their equations are left out.
        slack: Cables that read 0 N or less.
    """

    _headline = "chi_square"

    posture: Posture
    motor_tension: Array = field(metadata=unit("N", "cable"))
    tension_std: Array = field(metadata=unit("N", "cable"))
    tension_std_assumed: bool = field(metadata=unit("1"))
    angle_std: Array = field(metadata=unit("joint", "joint"))
    applied: Applied
    sliding: Array = field(metadata=unit("1", "hole"))
    segment_tension: Array = field(metadata=unit("N", "segment"))
    segment_std: Array = field(metadata=unit("N", "segment"))
    segment_low: Array = field(metadata=unit("N", "segment"))
    segment_high: Array = field(metadata=unit("N", "segment"))
    chi_square: float = field(metadata=unit("1"))
    freedom: int = field(metadata=unit("1"))
    at_stop: tuple[str, ...] = field(metadata=unit("1"))
    slack: tuple[str, ...] = field(metadata=unit("1"))

    @property
    def is_explained(self) -> bool:
        """Whether at least one in a thousand right models would leave this χ² or more."""
        return likely(self.chi_square, self.freedom)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences with reasons not to trust the numbers; empty if there are none."""
        warnings = []
        if not self.is_explained:
            warnings.append(
                f"the readings do not fit: {chi_square_text(self.chi_square, self.freedom)}. "
                "Another load acts, or the model of the arm is wrong (masses, places of holes, "
                "springs), or the standard uncertainties are too small."
            )
        arm = self.posture.arm
        beyond = beyond_noise(arm, self.posture.q)
        if beyond.any():
            far = [
                f"{arm.joint_names[i]} by {place(beyond[i], arm.joint_units[i])}"
                for i in np.flatnonzero(beyond).tolist()
            ]
            warnings.append(
                f"read beyond a limit, farther than encoders are noisy: {listed(far, 6)}; check "
                "the zeros and units of these encoders, and the joint limits of the arm"
            )
        if self.at_stop:
            their = "their equations are" if len(self.at_stop) > 1 else "its equation is"
            warnings.append(
                f"at a stop, whose torque is unknown: {listed(self.at_stop, 6)}; {their} left out"
            )
        if self.slack:
            warnings.append(f"slack, by the load cells: {listed(self.slack, 6)}")
        if self.tension_std_assumed:
            warnings.append(
                f"the load cells are taken as ±{self.tension_std.max():.3g} N, 1 % of the largest "
                "reading, since no tension_std was given"
            )
        return tuple(warnings)

    def _labels(self) -> dict[str, Sequence[object]]:
        chains = self.posture.segments.chains
        names = {"segment": chains.segment_names, "hole": chains.hole_names}
        return {**super()._labels(), **names}

    def _readings(self) -> str:
        """Return what was read, and how well, as text."""
        cells = f"{plural(self.motor_tension.size, 'load cell')} (±{span(self.tension_std)} N)"
        slides = self.posture.arm.slides
        parts = []
        for chosen, noun, name, size in ((~slides, "angle", "°", math.pi / 180.0),
                                         (slides, "way", " mm", 1e-3)):  # fmt: skip
            if chosen.any():
                std = self.angle_std[chosen] / size
                exact = "exact" if not std.any() else f"±{span(std)}{name}"
                parts.append(f"{plural(int(chosen.sum()), noun)} ({exact})")
        return " and ".join([cells, *parts])

    def _known(self) -> list[str]:
        """Return which loads are taken as known as text."""
        at_tip = tip_part(self.applied)
        lines = [f"wrench at the tip {coordinates(at_tip)} N, N m"] * acts(at_tip)
        return [f"known {line}" for line in (*lines, *texts(self.posture.arm, self.applied))]

    def _verdict(self) -> str:
        return f"left of the balance: {chi_square_text(self.chi_square, self.freedom)}"

    def _directions(self) -> str:
        """Return what is known of the directions of sliding as text."""
        if not self.posture.arm.has_friction:
            return "no friction"
        unknown = int((self.segment_high > self.segment_low).any())
        known = int(np.count_nonzero(self.sliding))
        if not known:
            return "direction of sliding unknown in all holes"
        if not unknown:
            return "direction of sliding known in all holes"
        return f"direction of sliding known in {known} of {plural(self.sliding.size, 'hole')}"

    def __str__(self) -> str:
        head = f"tensions at the joints from {self._readings()}; {self._directions()}"
        chains = self.posture.segments.chains
        ends = chains.start[1:] - 1
        rows: list[Sequence[str]] = [
            ("cable", "motor [N]", "at its end [N]", "by friction alone [N]")
        ]
        for name, F, s in zip(self.posture.arm.cables.names, self.motor_tension, ends, strict=True):
            end = with_uncertainty(self.segment_tension[s], self.segment_std[s], 1.0)
            alone = f"{self.segment_low[s]:.4g} to {self.segment_high[s]:.4g}"
            rows.append((name, f"{F:.4g}", end, alone))
        parts = [*self.warnings, head, *aligned(rows), *self._known(), self._verdict()]
        return "\n".join(parts)


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class LoadEstimate(TensionEstimate, Plotted):
    """Loads from tensions at the motors and joint angles; made by :func:`cdsm.estimate_load`.

    There are m components of loads, in base axes. The true one is within ± (:attr:`band` + 1.96
    :attr:`std`) in 95 % of all cases or more. All arrays are read-only.

    Attributes:
        components: What was sought.
        names: Name of each component (m,), such as ``fx at tool0``.
        loads: W (m,) [N], [N m]; of a combination that the readings do not tell, the part that is
            nothing.
        covariance: Covariance of W (m, m) by the load cells, the encoders, and friction whose
            direction is known, within a tenth of it; infinite where a component is not told.
        band: Most by which friction of unknown direction can change each component (m,).
        seen: Combinations of the components, best known first: rows (m, m) of length 1, with
            moments over the arm's length.
        seen_std: Standard uncertainty of each combination (m,) [N], as of ``covariance``; inf for
            those that the readings do not tell.
        seen_band: Most by which friction can change each (m,) [N].
        determination: Which components are determined.
    """

    _headline = "loads"
    _rows = "load_component"
    _figure = "plot_load_estimate"

    components: Components
    names: tuple[str, ...]
    loads: Array = field(metadata=unit("N or N m", "load_component"))
    covariance: Array
    band: Array = field(metadata=unit("N or N m", "load_component"))
    seen: Array = field(metadata=unit("1", "combination", "load_component"))
    seen_std: Array = field(metadata=unit("N", "combination"))
    seen_band: Array = field(metadata=unit("N", "combination"))
    determination: Determination

    @quantity("N or N m", "load_component")
    def std(self) -> Array:
        """Standard uncertainty of each component by the instruments (m,); inf if not told."""
        return frozen(np.sqrt(np.diag(self.covariance)))

    @quantity("N or N m", "load_component")
    def uncertainty(self) -> Array:
        """Standard uncertainty with friction, `√(std² + band²/3)` (m,): JCGM 100, a bound."""
        return frozen(np.hypot(self.std, self.band / math.sqrt(3.0)))

    @quantity("1", "load_component", "other_component")
    def correlation(self) -> Array:
        """Correlations of the components (m, m) [-], of ``covariance``."""
        known = np.isfinite(self.std)
        sigma = np.where(known, self.std, 1.0)
        with np.errstate(invalid="ignore"):
            matrix = self.covariance / np.outer(sigma, sigma)
        both = known[:, None] & known
        return frozen(np.clip(np.where(both, matrix, self.determination.correlation), -1.0, 1.0))

    @property
    def acting(self) -> tuple[Load, ...]:
        """The loads, as ``wrench=`` of other functions takes them."""
        return self.components.loads(self.loads)

    @property
    def told(self) -> Any:
        """Whether the readings tell each component (m,)."""
        return frozen(np.isfinite(self.std))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences with reasons not to trust the numbers; empty if there are none."""
        warnings = []
        for combination in self.determination.open_combinations:
            warnings.append(
                f"not told by the readings: they do not change with {combination} [N, N m]; other "
                "numbers hold if that is small. Seek fewer components, or read at another posture."
            )
        told = self.told
        wide = [
            f"±{band:.2g} {unit_name} of {name}"
            for name, unit_name, band, std, known in zip(
                self.names, self.components.units, self.band, self.std, told, strict=True
            )
            if known and band > _WIDE * std
        ]
        if wide:
            warnings.append(
                f"friction of unknown direction can hide {listed(wide, 3)}: let each motor pull "
                "until its cable slides in all holes, read then, and give sliding=1 (--sliding in)"
            )
        low = np.maximum(self.segment_low, SMALLEST)
        exponent = 0.5 * float(
            np.log(np.maximum(self.segment_high, SMALLEST) / low).max(initial=0.0)
        )
        if exponent > _LARGE:
            warnings.append(
                f"friction changes a tension by up to e^±{exponent:.2g}: what it can hide is of "
                "first order, and more than that"
            )
        return (*warnings, *super().warnings)

    def correlated(self) -> list[str]:
        """Describe the components that are correlated, and the most correlated of each two links.

        Loads on neighbouring links bend nearly the same joints.
        """
        links = self.components.link_numbers
        r = self.correlation
        told = self.told
        chosen: dict[object, tuple[int, int]] = {}
        for i, j in combinations(range(len(links)), 2):
            if told[i] and told[j]:
                key: object = (links[i], links[j]) if links[i] != links[j] else (i, j, "own")
                if key not in chosen or abs(r[i, j]) > abs(r[chosen[key]]):
                    chosen[key] = i, j
        return [
            f"{self.names[i]} and {self.names[j]} are correlated at {r[i, j]:+.3f}"
            for key, (i, j) in chosen.items()
            if isinstance(key, tuple) and (len(key) == 2 or abs(r[i, j]) > _CORRELATED)
        ]

    def _labels(self) -> dict[str, Sequence[object]]:
        names = {"load_component": self.names, "other_component": self.names}
        return {**super()._labels(), **names}

    def __str__(self) -> str:
        links = listed([point.link for point in self.components.at], 6)
        rows: list[Sequence[str]] = [("load", "value ± std", "friction ±", "combined std")]
        units = self.components.units
        for i, (name, unit_name) in enumerate(zip(self.names, units, strict=True)):
            shown = ["not told", "", ""]
            if self.told[i]:
                value = with_uncertainty(self.loads[i], self.std[i], 1.0)
                shown = [value, f"{self.band[i]:.2g}", f"{self.uncertainty[i]:.2g}"]
            rows.append((f"{name} [{unit_name}]", *shown))
        note = "(std: load cells and angles. friction: most that holes of unknown direction hide. "
        note += f"Within ± (friction + {INTERVAL:g} std) in 95 % of all cases or more)"
        seen: list[Sequence[str]] = [("combination, told best first", "std", "friction ±")]
        for row, std, band in zip(self.seen, self.seen_std, self.seen_band, strict=True):
            numbers = (f"{std:.2g} N", f"{band:.2g} N") if std < math.inf else ("not told", "")
            seen.append((self._combination(row), *numbers))
        parts = [
            f"load on {links} from {self._readings()}; {self._directions()}",
            *aligned(rows),
            note,
            *(aligned(seen) if len(self.names) > 1 else []),
            *self.correlated(),
            *self._known(),
            self._verdict(),
        ]
        return "\n".join([*self.warnings, *parts])

    def _combination(self, row: Array) -> str:
        """Return a combination of the components as text."""
        one = len(self.components.at) == 1
        terms = []
        for value, name, rows in zip(row, self.names, self.components.units, strict=True):
            if abs(value) > _SHOWN * abs(row).max():
                over = "/L" if rows == "N m" else ""
                terms.append(f"{value:+.2f} {name.partition(' ')[0] if one else name}{over}")
        return " ".join(terms)
