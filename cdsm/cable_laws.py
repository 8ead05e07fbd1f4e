"""Stiffness, tension bounds and original lengths of all cables of an arm, from their laws EA(F)."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from cdsm.cable import Cable
from cdsm.elasticity import Elasticity, LinearElasticity, SlackBelow
from cdsm.elasticity.answers import rigidity_of, slope_of, strain_of
from cdsm.errors import ElasticityRangeError, InvalidInput
from cdsm.kernels.stiffness import single_cable_stiffness
from cdsm.kernels.wires import AT_ONCE, CURVE, POLYNOMIAL, Wires, single_rigidity
from cdsm.support.values import Array, frozen
from cdsm.wires.continuity import find_jump
from cdsm.wires.laws import StrandElasticity, TabulatedElasticity
from cdsm.wires.quadrature import NODES, WEIGHTS

OriginalLength = Literal["unstrained", "stretched"]

_STEP = 1e-5  # relative step of the finite difference of the slope of EA (1 + ε)


class CableLaws:
    """Elasticities of all cables of an arm; C is the number of cables.

    A locked motor keeps the original length l_0 of its wire constant. Under tension the length of
    the wire is ℓ = l_0 (1 + ε). The stiffness EA/l_0 is therefore EA (1 + ε)/ℓ.

    Args:
        cables: Cables of the arm.
        original_length: Original length of a wire of length ℓ and strain ε. ``"unstrained"``:
            ℓ/(1 + ε); ``"stretched"``: ℓ, as in the paper.

    Attributes:
        held: Each distinct law of the position-controlled cables, with the indices of its cables.
        series: 1/k_series of all cables (C,) [m/N].
        rest: Tension (C,) [N] at which wire strain and spring elongation are zero.
        constant: EA (C,) [N] of position-controlled cables with a linear law; 0 for all others.
        linear: Factor b (C,) [-] in EA (1 + ε) = EA + b F of these cables: 1 if ``original_length``
            is unstrained, 0 if it is stretched. It is 0 for all other cables.
        nonlinear: The entries of ``held`` whose law is not linear; their EA is computed at each
            tension.
        without_kernel: The laws of ``nonlinear`` that no compiled kernel can evaluate.
    """

    def __init__(self, cables: tuple[Cable, ...], original_length: OriginalLength) -> None:
        self._cables = cables
        self._unstrained = original_length == "unstrained"
        held = [c for c, cable in enumerate(self._cables) if cable.control == "position"]
        by_law: dict[object, list[int]] = {}
        for c in held:
            by_law.setdefault(key(self._cables[c].elasticity), []).append(c)
        # usually all cables have one law, and a slice is faster than indices
        count = len(self._cables)
        self.held = [
            (cables[of[0]].elasticity, slice(None) if len(of) == count else np.array(of))
            for of in by_law.values()
        ]
        self._least = frozen(np.array([cable.minimum for cable in self._cables]))
        self._most = frozen(np.array([cable.maximum for cable in self._cables]))
        self._bounded = bool(self._least.any() or np.isfinite(self._most).any())
        series = np.array([cable.series_stiffness for cable in self._cables])
        self.series = frozen(1.0 / series)
        self.rest = frozen(np.array([cable.elasticity.rest for cable in self._cables]))
        # constant EA of linear laws; all other laws are evaluated at each tension
        self.nonlinear, constant, linear = [], np.zeros(count), np.zeros(count)
        for law, of in self.held:
            if isinstance(law, LinearElasticity):
                constant[of], linear[of] = law.rigidity(0.0), float(self._unstrained)
            else:
                self.nonlinear.append((law, of))
        self.constant, self.linear = frozen(constant), frozen(linear)
        self.without_kernel = [law for law, _ in self.nonlinear if _pieces(law) is None]

    def require_continuity(self) -> None:
        """Raise InvalidInput if the rigidity of a law is discontinuous."""
        for law, held in self.held:
            jump = find_jump(law)
            if jump is not None:
                name = np.array(self._cables, dtype=object)[held][0].name
                raise InvalidInput(
                    "elasticity",
                    f"the rigidity of {name} is discontinuous at {jump.tension:.6g} N: it changes "
                    f"from {jump.below:.6g} to {jump.above:.6g} N. Make it continuous, e.g. by a "
                    "TabulatedElasticity through points of its strain.",
                )

    @cached_property
    def wires(self) -> Wires:
        """The laws of the cables as arrays, which compiled kernels evaluate."""
        count = len(self._cables)
        of_cable, ends = np.tile([0, -1, 0], (count, 1)), np.zeros((count, 6))
        edges, coefficients = [np.zeros((3, 0))], [np.zeros((0, 0))]
        for law, held in self.nonlinear:
            pieces = _pieces(law)
            if pieces is None:
                continue
            inside, kind, own = pieces
            first = sum(each.shape[1] for each in edges)
            of_cable[held] = first, first + own[0].shape[1] - 1, kind
            edges, coefficients = [*edges, own[0]], [*coefficients, own[1]]
            ends[held] = (
                law.domain.first,
                law.domain.high,
                -math.inf if inside is law else law.rest,
                inside.domain.first,
                inside.rigidity(inside.domain.first),
                self._unstrained,
            )
        return Wires(
            self.constant,
            self.linear,
            frozen(of_cable.astype(np.intp)),
            frozen(ends),
            frozen(np.hstack(edges)),
            frozen(_joined(coefficients)),
            frozen(np.array([NODES, WEIGHTS])),
        )

    def narrowed(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Return the tension bounds ``low``, ``high`` (…, C) [N], narrowed to the cables' own."""
        if not self._bounded:
            return low, high
        return frozen(np.maximum(low, self._least)), frozen(np.minimum(high, self._most))

    def stiffness(self, lengths: Array, tension: Array) -> Array:
        """Compute the diagonal of K_L (C,) [N/m]: 1/(l_0/EA(F) + 1/k_series).

        Force-controlled cables have the stiffness 0. ``lengths`` is L (C,) [m] and ``tension`` is
        F (C,) [N], both checked and not negative.
        """
        rigidity = self._rigidity(tension) if self.nonlinear else self.constant
        k = single_cable_stiffness(lengths, tension, rigidity, self.linear, self.series, self.rest)
        return frozen(k)

    def _rigidity(self, tension: Array) -> Array:
        """Compute EA (1 + ε) (C,) [N] at F (C,) [N]; for linear laws only its constant part, EA."""
        if not self.without_kernel:
            arguments: tuple[Any, ...] = (self.constant, *self.wires[2:], tension)
            rigidity = single_rigidity(*arguments)
            if rigidity.min() >= 0.0:  # else the law says what is wrong
                return rigidity
        rigidity = self.constant.copy()
        for law, held in self.nonlinear:
            try:
                rigidity[held] = self.stretched_rigidity(law, tension[held])
            except ElasticityRangeError as error:
                raise self.naming(error, held) from None
        return rigidity

    def stretched_rigidity(self, law: Elasticity, tension: Array) -> Array:
        """Compute EA (1 + ε) [N] of a law at ``tension`` [N], in the shape of ``tension``.

        Divided by the length ℓ under tension, this is the stiffness EA/l_0 of the wire. If
        ``original_length`` is "stretched", as in the paper, the result is EA.
        """
        if isinstance(law, LinearElasticity):
            rigidity = law.rigidity(tension)
            return rigidity + tension if self._unstrained else rigidity
        rigidity = rigidity_of(law, tension)
        return rigidity * (1.0 + strain_of(law, tension)) if self._unstrained else rigidity

    def original_lengths(self, lengths: Array, tension: Array) -> Array:
        """Compute l_0 (C,) [m] of cables of length L (C,) [m] under tension F (C,) [N].

        The cable length includes the series spring. l_0 is therefore negative if the spring
        stretches by more than the length of the cable. A force-controlled cable has no l_0: its
        entry is L.
        """
        wire = np.array(lengths)
        for law, held in self.held:
            F = tension[held]
            wire[held] -= self.series[held] * (F - self.rest[held])
            if self._unstrained:
                try:
                    wire[held] /= 1.0 + strain_of(law, F)
                except ElasticityRangeError as error:
                    raise self.naming(error, held) from None
        return frozen(wire)

    def slopes(self, tension: Array, stiffness: Array) -> tuple[Array, Array]:
        """Compute dk/dF (C,) [1/m] and d²k/dF² (C,) [1/(N m)] at a constant posture.

        F (C,) [N] is ``tension``, and k (C,) [N/m] is ``stiffness``, that of each cable at F. The
        cable length is constant, so l_0 changes with F. A prime is d/dF, R = EA (1 + ε) and
        G = R′/R. The wire's share of the compliance of the cable is w = 1 − k/k_series. Then

            k′ = k A,  k″ = k (A² + A′),  A = (1 − w)/R + w G,
            A′ = (1 − w) (A/R − G/R − A G) + w G′.

        G′ is computed by finite differences and has about five correct digits.
        """
        first, second = np.zeros_like(stiffness), np.zeros_like(stiffness)
        for law, held in self.held:
            F, k = tension[held], stiffness[held]
            last = np.array([*kinks(law), law.domain.high])[np.searchsorted(kinks(law), F)]
            step = _STEP * np.maximum(F, 1.0)
            beside = np.where(F + step <= last, F + step, F - step)
            both = np.stack([F, beside])
            try:
                slopes = slope_of(law, both)
                R = self.stretched_rigidity(law, F)
                if self._unstrained:  # (EA (1 + ε))′ = EA′ (1 + ε) + 1
                    slopes = slopes * (1.0 + strain_of(law, both)) + 1.0
            except ElasticityRangeError as error:
                raise self.naming(error, held) from None
            G, spring = slopes[0] / R, k * self.series[held]
            bend = (slopes[1] - slopes[0]) / (beside - F) / R - G**2
            A = spring / R + (1.0 - spring) * G
            first[held] = k * A
            change = spring * (A / R - G / R - A * G) + (1.0 - spring) * bend
            second[held] = k * (A**2 + change)
        return frozen(first), frozen(second)

    def naming(
        self, error: ElasticityRangeError, held: slice | NDArray[np.intp]
    ) -> ElasticityRangeError:
        """Return a copy of a law's error that also names the cables whose tension caused it.

        ``held`` are the indices, among all cables, of the cables to which the law was applied.
        """
        outside = np.arange(len(self._cables))[held][list(error.indices)].tolist()
        names = [self._cables[c].name for c in outside]
        return ElasticityRangeError(error.problem, error.tension, outside, names)


def kinks(law: Elasticity) -> tuple[float, ...]:
    """Return the tensions [N], in ascending order, at which dEA/dF of a law jumps: its kinks.

    They are the tensions where two polynomials of a strand's law meet, and the tension below which
    a cable is slack. At a kink, ``rigidity_slope`` returns the slope below it. dEA/dF also jumps at
    the points of a tabulated law, but these points are not returned.
    """
    if isinstance(law, SlackBelow):
        return law.rest, *kinks(law.law)
    return law.joins if isinstance(law, StrandElasticity) else ()


def _pieces(law: Elasticity) -> tuple[Elasticity, int, tuple[Array, Array]] | None:
    """Return a law without its slack branch, its kind of pieces, and arrays of the pieces.

    The kind is POLYNOMIAL or CURVE. The arrays are edges and coefficients, for the kernels. Return
    None if no kernel can evaluate the law, or if its polynomials are not positive on its domain.
    """
    inside = law.law if isinstance(law, SlackBelow) else law
    if isinstance(inside, TabulatedElasticity):
        return inside, CURVE, inside._curve.pieces
    if isinstance(inside, StrandElasticity) and inside.panels.end == math.inf:
        return inside, POLYNOMIAL, inside.panels.pieces
    return None


def _joined(tables: list[Array]) -> Array:
    """Join tables of coefficients side by side; zeros fill each to a multiple of AT_ONCE rows."""
    rows = AT_ONCE * -(-max(map(len, tables)) // AT_ONCE)
    return np.hstack([np.pad(each, ((0, rows - len(each)), (0, 0))) for each in tables])


def key(law: Elasticity) -> object:
    """Return a hashable key of a law: the law, or its ``id`` if a user's law is not hashable."""
    try:
        hash(law)
    except TypeError:
        return id(law)
    return law
