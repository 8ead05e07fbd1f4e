"""Buckling: tension or load makes K_θ of a fixed posture singular, under the least tensions.

Tension usually softens an arm (active part of Eq. 16). See :func:`~cdsm.equilibrium` for what then.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Literal, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.applied import Applied, Loaded, acts, combined, scaled, tip_only, tip_part
from cdsm.batch.applied_rows import AppliedRows
from cdsm.batch.evaluation import evaluate
from cdsm.errors import CdsmError, ElasticityRangeError, InvalidInput, warn
from cdsm.geometry.beams import buckling_doubt
from cdsm.loads import LoadsLike, loads_of
from cdsm.motors import refuse_shared
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import NO_WRENCH, bound, checked_quantity, instance
from cdsm.support.values import Array, Plotted, frozen
from cdsm.tension import distribute_tension

SAMPLES = 200  # bounds or load factors of a scan: a stable range narrower than a step is not seen
_PRECISION = 1e-12  # relative precision of a critical bound or load factor
_ABOVE = 1.0 + 1e-9  # just above the low end of a law: rounding may put a tension below its bound
_LOWEST = 1e-3  # lowest bound of a scan from zero [N]; or over its end, if that is below it
_LARGEST = 1e6  # end of doubled load factors
_ROUNDING = 1e-7  # a smaller factor is that of the balance, which solvers accept to 1e-9
_SHOWN = 10.0  # largest load factor of the curve if the critical one is infinite
_LOCKED = "weight_test (cdsm weigh) says where it buckles with locked motors."
Limit = Literal["buckling", "infeasible", "elasticity", "none"]


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class _Critical(Result, Plotted, Loaded):
    """Posture and load of a result, and K_θ where the arm buckles."""

    posture: Posture
    applied: Applied
    stiffness: Stiffness

    @quantity("1", "joint")
    def mode(self) -> Array:
        """Unit joint motion (nv,) of buckling: eigenvector of the smallest eigenvalue of K_θ."""
        mode = self.stiffness.critical_direction
        return frozen(mode * np.sign(mode[abs(mode).argmax()]))

    @quantity("N", "cable")
    def tension(self) -> Array:
        """F (C,) [N] where the arm buckles."""
        return self.stiffness.tension

    def _softest(self) -> str:
        order = np.argsort(-abs(self.mode))
        names = self.posture.arm.joint_names
        shares = ", ".join(f"{names[i]} {self.mode[i]:+.2f}" for i in order[:4])
        return f"softest joint motion: {shares}" + ", …" * (self.mode.size > 4)

    @property
    def _frictionless(self) -> str:
        """A line that says that friction is left out, if the holes have it."""
        left_out = "\nwithout the friction of the holes, with which an arm buckles later"
        return left_out if self.posture.arm.has_friction else ""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class CriticalTension(_Critical):
    """Tension at which an arm buckles at one posture; made by :func:`critical_tension`.

    Attributes:
        posture: The fixed posture.
        applied: What acts: W (6,) at the tip, or loads on links.
        minimum: Lower bound of tension [N] at which the arm buckles: the end of the first range in
            ``stable``; inf if that is the end of ``examined``, its low end if no range is stable.
        stiffness: `K_θ` at ``minimum``; if the arm does not buckle, at the bound with the smallest
            of ``margins``. ``mode`` and ``tension`` belong to it.
        stable: Ranges (low, high) [N] of the lower bound in which the arm is stable.
        examined: Range [N] of the lower bound that was scanned.
        bounds: Lower bounds (n,) [N] that were evaluated.
        margins: Smallest eigenvalue of `K_θ` at each of these bounds (n,) [N m/rad].
    """

    _headline = "minimum"
    _rows = "bounds"
    _figure = "plot_critical_tension"

    minimum: float = field(metadata=unit("N"))
    stable: tuple[tuple[float, float], ...] = field(metadata=unit("N", "range", "end"))
    examined: tuple[float, float] = field(metadata=unit("N", "end"))
    bounds: Array = field(metadata=unit("N", "bounds"))
    margins: Array = field(metadata=unit("joint stiffness", "bounds"))

    @property
    def warnings(self) -> tuple[str, ...]:
        """One sentence if the arm is UNSTABLE at every lower bound; otherwise empty."""
        sentence = "UNSTABLE at every lower bound from {:.4g} N to {:.4g} N"
        return () if self.stable else (sentence.format(*self.examined),)

    def __str__(self) -> str:
        verdict = f"buckles at a lower bound of {self.minimum:.4g} N"
        if math.isinf(self.minimum):
            verdict = f"does not buckle at any lower bound up to {self.examined[1]:.4g} N"
        spans = ", ".join(f"{a:.4g} to {b:.4g} N" for a, b in self.stable if a < b)
        stable = f"stable from {spans}\n" if spans else ""
        return f"{(self.warnings or (verdict,))[0]}\n{stable}{self._softest()}{self._frictionless}"


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class CriticalLoad(_Critical):
    """Multiple of a load at which an arm fails at one posture; made by :func:`critical_load`.

    Attributes:
        posture: The fixed posture.
        applied: What acts in addition: W (6,) at the tip, or loads on links.
        multiplied: What is multiplied by the factor: a wrench (6,) at the tip, or loads on links.
        factor: Largest factor [-] up to which the arm is balanced and stable; inf: half a million.
        limit: What ends it: ``"buckling"``, ``"infeasible"``, ``"elasticity"`` or ``"none"``.
        stiffness: `K_θ` at ``factor``, or at half a million. ``mode`` and ``tension`` belong to it.
        factors: Factors (n,) [-] under which the arm is stable, up to ``factor``, or to ten.
        margins: Smallest eigenvalue of `K_θ` at each of these factors (n,) [N m/rad].
    """

    _headline = "factor"
    _rows = "factors"
    _figure = "plot_critical_load"

    multiplied: Applied
    factor: float = field(metadata=unit("1"))
    limit: Limit = field(metadata=unit("1"))
    factors: Array = field(metadata=unit("1", "factors"))
    margins: Array = field(metadata=unit("joint stiffness", "factors"))

    @property
    def load(self) -> Array:
        """The wrench (6,) that is multiplied; InvalidInput if loads act on other links."""
        return tip_only(self.multiplied)

    @quantity("N and N m", "component", name="load")
    def tip_load(self) -> Array:
        """W (6,) of what is multiplied at ``tool0``, base axes: force [N], then moment [N m]."""
        return tip_part(self.multiplied)

    @property
    def warnings(self) -> tuple[str, ...]:
        """One sentence if the arm is UNSTABLE even without the load; otherwise empty."""
        return () if self.factor else (f"UNSTABLE without the load: {str(self).splitlines()[0]}",)

    def __str__(self) -> str:
        none = self.factor == 0.0
        reason = {
            "buckling": "it buckles without the load already" if none else "there it buckles",
            "infeasible": "beyond, no tensions balance it",
            "elasticity": "beyond, a tension leaves the domain of its cable's elasticity",
            "none": "half a million times it was tried",
        }[self.limit]
        part = "no part of it" if none else f"the load up to a factor of {self.factor:.4g}"
        return f"holds {part}; {reason}\n{self._softest()}{self._frictionless}"


def critical_tension(
    pose: Posture, wrench: LoadsLike = NO_WRENCH, *, up_to: float = 1e6
) -> CriticalTension:
    """Compute the lower bound `F_min` [N] of tension at which `K_θ` stops being positive definite.

    The symmetric part of `K_θ` under the least tensions is examined at 200 bounds, even on a log
    scale, up to ``up_to``, or to where no tensions within their laws and maxima balance the arm. A
    :class:`CdsmWarning` says that a backbone with one piece from disk to disk reads too much.

    Args:
        pose: The posture, which stays fixed.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]. Or loads on links,
            as for :func:`~cdsm.distribute_tension`.
        up_to: Largest lower bound [N] of the scan.

    Raises:
        InvalidInput: ``wrench`` or ``up_to`` is invalid.
        InfeasibleTension: No tensions balance it.
        ElasticityRangeError: Even the least tensions are outside the domains of the elasticities.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> print(cdsm.critical_tension(pose))
        does not buckle at any lower bound up to 750 N
        stable from 2.2 to 750 N
        softest joint motion: joint5_1 +0.74, joint5_2 -0.66, joint4_2 +0.13, joint4_1 -0.07, …
    """
    from scipy.optimize import brentq  # slow to import

    arm = instance("pose", pose, Posture).arm
    refuse_shared(arm.motors, "critical_tension", _LOCKED)
    W = loads_of(arm, wrench)
    if arm.is_serpentine and (doubt := buckling_doubt(arm.geometry.joints)):
        warn(doubt)

    @cache
    def at(minimum: float) -> Stiffness:
        return stiffness(pose, distribute_tension(pose, minimum, wrench=W))

    low = float(arm.laws.low.max()) * _ABOVE
    ends = [*arm.laws.high.tolist(), *(cable.maximum for cable in arm.cables)]
    high = max(min([*ends, checked_quantity("up_to", up_to, "tension")]), low)
    at(low)  # raises the reason if no tensions balance the arm
    first = max(low, _LOWEST if high > _LOWEST else _LOWEST * high)
    scan = np.geomspace(first, high, SAMPLES - 1) if high > low else np.zeros(0)
    bounds = np.unique([low, *scan])
    margins = _margins(pose, bounds[:, None], math.inf, [W])
    n = int(np.append(np.isfinite(margins), False).argmin())  # bounds that balance the arm
    if n < bounds.size:
        balances = ("none", "buckling")
        high = _bisect(lambda b: _failure(at, b) in balances, *bounds[n - 1 : n + 1])[0]
        bounds = np.append(bounds[:n], high)
        margins = np.append(margins[:n], at(high).margin)
    changes = np.flatnonzero(np.diff(np.concatenate([[False], margins > 0.0, [False]])))
    edges = [
        brentq(lambda b: at(b).margin, *bounds[i - 1 : i + 1], xtol=1e-300, rtol=_PRECISION)
        if 0 < i < bounds.size
        else float(bounds[min(i, bounds.size - 1)])
        for i in changes.tolist()
    ]
    ranges = tuple(zip(edges[::2], edges[1::2], strict=True))
    minimum = next((end for _, end in ranges if end < high), math.inf if ranges else low)
    where = minimum if minimum < math.inf else float(bounds[margins.argmin()])
    return CriticalTension(
        posture=pose,
        applied=W,
        minimum=minimum,
        stiffness=at(where),
        stable=ranges,
        examined=(low, float(high)),
        bounds=frozen(bounds),
        margins=frozen(margins),
    )


def critical_load(
    pose: Posture,
    load: LoadsLike,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = math.inf,
    wrench: LoadsLike = NO_WRENCH,
) -> CriticalLoad:
    """Compute the factor λ up to which an arm at a fixed posture is stable under λ load + wrench.

    Friction in the holes is left out, and so is what came before: :func:`~cdsm.load_cycle`.

    Args:
        pose: The posture, which stays fixed. Tensions are distributed again for every load.
        load: Wrench (6,) at ``tool0`` in base axes: force [N], then moment [N m]; not zero. Or
            loads on links, as for :func:`~cdsm.distribute_tension`.
        minimum: Lower bound of the tensions [N], for all cables or (C,).
        maximum: Upper bound of the tensions [N], for all cables or (C,).
        wrench: What always acts, such as the weight of a tool, given alike.

    Raises:
        InvalidInput: ``load`` is zero; or ``load``, ``wrench`` or a bound is invalid.
        InfeasibleTension: No tensions balance the arm under its own weight and ``wrench``.
        ElasticityRangeError: A tension without the load is outside the domain of its elasticity.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> f"{cdsm.critical_load(pose, [0, -1, 0, 0, 0, 0], minimum=5.0).factor:.1f} N"
        '556.2 N'
    """
    count = len(instance("pose", pose, Posture).arm.cables)
    refuse_shared(pose.arm.motors, "critical_load", _LOCKED)
    multiplied = loads_of(pose.arm, load, "load")
    always = loads_of(pose.arm, wrench)
    low = bound("minimum", minimum, count)
    high = bound("maximum", maximum, count)
    if not acts(multiplied):
        raise InvalidInput("load", "is zero, and so is any multiple of it; give a load.")

    def under(factor: float) -> Applied:
        return combined(always, scaled(multiplied, factor))

    @cache
    def at(factor: float) -> Stiffness:
        return stiffness(pose, distribute_tension(pose, low, high, under(factor)))

    at(0.0)  # raises the reason if no tensions balance the arm
    end = 1e-3
    factor = 0.0
    limit = _failure(at, 0.0)
    factors = np.zeros(1)
    margins = np.array([at(0.0).margin])
    if limit == "none":
        while end < _LARGEST and _failure(at, end) == "none":
            end *= 2.0
        factor = math.inf
        last = end if end < _LARGEST else _SHOWN
        factors = np.linspace(0.0, last, SAMPLES)
        margins = _margins(pose, low, high, [under(x) for x in factors.tolist()])
    if limit == "none" and end < _LARGEST:  # the doubling may have stepped over the first failure
        n = int(np.append(margins[:-1] > 0.0, False).argmin())
        factor, beyond = _bisect(lambda x: _failure(at, x) == "none", *factors[n - 1 : n + 1])
        factor *= factor > _ROUNDING
        limit = _failure(at, beyond)
        factors = np.append(factors[:n], factor)
        margins = np.append(margins[:n], at(factor).margin)
    return CriticalLoad(
        posture=pose,
        applied=always,
        stiffness=at(min(factor, _LARGEST / 2.0)),
        multiplied=multiplied,
        factor=factor,
        limit=limit,
        factors=frozen(factors),
        margins=frozen(margins),
    )


def _margins(pose: Posture, minimum: Array, maximum: ArrayLike, loads: Sequence[Applied]) -> Array:
    """Compute margins or NaN (n,) for lower bounds (C,) or (n, 1) and one load or n."""
    q = np.tile(pose.q, (max(len(np.atleast_2d(minimum)), len(loads)), 1))
    rows = AppliedRows.of(loads)
    wrenches = AppliedRows(rows.at_tip[0], rows.loads) if len(loads) == 1 else rows
    bounds = np.broadcast_to(minimum, (len(q), len(pose.arm.cables))), maximum
    case: Any = {"minimum": bounds[0], "maximum": bounds[1], "check_limits": False}
    return np.asarray(evaluate(pose.arm, q, None, wrenches, ("margin",), **case)["margin"])


def _failure(at: Callable[[float], Stiffness], place: float) -> Limit:
    """Return why the arm fails at a lower bound [N] or load factor."""
    try:
        return "none" if at(float(place)).is_stable else "buckling"
    except ElasticityRangeError:
        return "elasticity"
    except CdsmError:  # no tensions; on the very edge; or below 1e-9 N
        return "infeasible"


def _bisect(true: Callable[[float], bool], a: float, b: float) -> tuple[float, float]:
    """Return two numbers, equal to 1e-12, between which ``true`` changes from True to False."""
    while b - a > max(_PRECISION * b, _PRECISION**2):
        middle = float(a + b) / 2.0
        a, b = (middle, b) if true(middle) else (a, middle)
    return float(a), float(b)
