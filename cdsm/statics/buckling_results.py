"""Tensions and loads at which an arm buckles, as frozen values."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, final

import numpy as np

import cdsm
from cdsm.posture import Posture
from cdsm.statics.bound_scan import Limit
from cdsm.support.result import Result, unit
from cdsm.support.values import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class CriticalTension(Result):
    """Tension at which an arm buckles at one posture; made by :func:`critical_tension`.

    Attributes:
        posture: The fixed posture.
        wrench: W (6,) at ``tool0``, base axes: force [N], then moment [N m].
        minimum: Lower bound of tension [N] at which the arm buckles as the bound rises: the end of
            the first range in :attr:`stable`. It is inf if that range reaches the end of
            :attr:`examined`, and the low end of :attr:`examined` if no range is stable.
        mode: Unit joint motion (nv,) of buckling: the eigenvector of the smallest eigenvalue of K_θ
            at ``minimum``. If the arm does not buckle, K_θ is taken at the bound with the smallest
            of :attr:`margins`.
        tension: F (C,) [N] at the same bound as ``mode``.
        stable: Ranges (low, high) [N] of the lower bound in which the arm is stable.
        examined: Range [N] of the lower bound that was scanned. It ends where no tensions balance
            the arm within the domains of the elasticities. If tensions balance the arm at every
            bound, it ends where the terms of K_θ that grow with the tension outweigh the others,
            and so decide alone whether the arm is stable.
        bounds: Lower bounds (n,) [N] that were evaluated.
        margins: Smallest eigenvalue of K_θ at each of these bounds (n,) [N m/rad].
    """

    _headline, _rows = "minimum", "bounds"

    posture: Posture
    wrench: Array = field(metadata=unit("N and N m", "component"))
    minimum: float = field(metadata=unit("N"))
    mode: Array = field(metadata=unit("1", "joint"))
    tension: Array = field(metadata=unit("N", "cable"))
    stable: tuple[tuple[float, float], ...] = field(metadata=unit("N", "range", "end"))
    examined: tuple[float, float] = field(metadata=unit("N", "end"))
    bounds: Array = field(metadata=unit("N", "bounds"))
    margins: Array = field(metadata=unit("joint stiffness", "bounds"))

    @property
    def _verdict(self) -> str:
        low, high = self.examined
        if not self.stable:
            return f"UNSTABLE at every lower bound from {low:.4g} N to {high:.4g} N"
        if math.isinf(self.minimum):
            return f"does not buckle at any lower bound up to {high:.4g} N"
        return f"buckles at a lower bound of {self.minimum:.4g} N"

    @property
    def warnings(self) -> tuple[str, ...]:
        """One sentence if the arm is UNSTABLE at every lower bound; otherwise empty."""
        return () if self.stable else (self._verdict,)

    def plot(self) -> Figure:
        """Plot the smallest eigenvalue of K_θ [N m/rad] against the lower bound of tension [N]."""
        return cdsm.plots.plot_critical_tension(self)

    def __str__(self) -> str:
        verdict = self._verdict
        spans = ", ".join(f"{a:.4g} to {b:.4g} N" for a, b in self.stable if a < b)
        names = self.posture.arm.joint_names
        lines = [verdict, f"stable from {spans}" if spans else "", _describe_mode(names, self.mode)]
        return "\n".join(line for line in lines if line)


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class CriticalLoad(Result):
    """Multiple of a load at which an arm fails at one posture; made by :func:`critical_load`.

    Attributes:
        posture: The fixed posture.
        wrench: W (6,) that is multiplied by the factor: force [N], then moment [N m].
        carried: Constant wrench (6,) that acts in addition: force [N], then moment [N m].
        factor: Largest factor [-] up to which the arm is balanced and stable; inf if it still is at
            a factor of half a million.
        limit: Reason of the failure: ``"buckling"``, ``"infeasible"`` (no tensions balance the
            load), ``"elasticity"`` (a tension leaves the domain of its law) or ``"none"``.
        mode: Unit joint motion (nv,) of buckling: the eigenvector of the smallest eigenvalue of K_θ
            at ``factor``, or at half a million if ``factor`` is inf.
        tension: F (C,) [N] at the same factor as ``mode``.
        factors: Factors (n,) [-] under which the arm is stable, from zero to ``factor``; only those
            below ten if ``factor`` is inf.
        margins: Smallest eigenvalue of K_θ at each of these factors (n,) [N m/rad].
    """

    _headline, _rows = "factor", "factors"

    posture: Posture
    wrench: Array = field(metadata=unit("N and N m", "component"))
    carried: Array = field(metadata=unit("N and N m", "component"))
    factor: float = field(metadata=unit("1"))
    limit: Limit = field(metadata=unit("1"))
    mode: Array = field(metadata=unit("1", "joint"))
    tension: Array = field(metadata=unit("N", "cable"))
    factors: Array = field(metadata=unit("1", "factors"))
    margins: Array = field(metadata=unit("joint stiffness", "factors"))

    @property
    def warnings(self) -> tuple[str, ...]:
        """One sentence if the arm is UNSTABLE even without the load; otherwise empty."""
        return () if self.factor else (f"UNSTABLE without the load: {self}".partition("\n")[0],)

    def plot(self) -> Figure:
        """Plot the smallest eigenvalue of K_θ [N m/rad] against the factor of the load."""
        return cdsm.plots.plot_critical_load(self)

    def __str__(self) -> str:
        reason = {
            "buckling": "there it buckles"
            if self.factor
            else "it buckles without the load already",
            "infeasible": "beyond, no tensions balance it",
            "elasticity": "beyond, a tension leaves the domain of its cable's elasticity",
            "none": "nothing happens that far",
        }[self.limit]
        mode = _describe_mode(self.posture.arm.joint_names, self.mode)
        part = f"the load up to a factor of {self.factor:.4g}"
        return f"holds {part if self.factor else 'no part of the load'}; {reason}\n{mode}"


def _describe_mode(names: tuple[str, ...], mode: Array) -> str:
    """Write a buckling ``mode`` (nv,) as text: its largest entries with the names of joints."""
    order = np.argsort(-abs(mode))[:4]
    shares = ", ".join(f"{names[i]} {mode[i]:+.2f}" for i in order)
    return f"softest joint motion: {shares}" + (", …" if len(mode) > len(order) else "")
