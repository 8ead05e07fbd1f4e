"""Compute the stiffness of an arm half-way between two planned samples."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

from cdsm.errors import CdsmError, EquilibriumError
from cdsm.planning.objectives import achieved, misfit
from cdsm.statics.locked_motors import LoadedArm, lengths_with
from cdsm.statics.trust_region import find_rest
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.values import Array, ReadOnlyState, frozen


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class HalfWay(ReadOnlyState):
    """Equilibrium and stiffness of an arm half-way between a planned sample and the next sample.

    A position-controlled cable has the mean of its two original lengths l_0. A force-controlled
    cable has the mean of its two tensions. The mean of the two wrenches acts. The arm is in
    equilibrium, r(q) = J_Lᵀ F(q) + g − J_Xᵀ W = 0 (Eq. 13), near the mean of the two postures. The
    misfit is of second order in the step between the samples.

    Attributes:
        index: Number of the first sample, from 0.
        target: Mean of the two targets [N/m]: (), (n,) or (3, 3).
        stiffness: K_θ at the equilibrium; None without equilibrium.
        achieved: ``along`` or ``cartesian`` [N/m], (), (n,) or (3, 3); None without equilibrium.
        misfit: ‖achieved/target − 1‖ [-], or ‖S − target‖/‖target‖ with the symmetric part S of
            ``cartesian``; inf without equilibrium.
        reason: Why no equilibrium was found; otherwise empty.
    """

    index: int
    target: Array
    stiffness: Stiffness | None
    achieved: Array | None
    misfit: float
    reason: str = ""

    def __repr__(self) -> str:
        return f"<HalfWay from sample {self.index} to {self.index + 1}, misfit {self.misfit:.2g}>"


def half_way(
    index: int,
    ends: tuple[Stiffness, Stiffness],
    unstrained: Array,
    target: Array,
    directions: Array | None,
) -> HalfWay:
    """Compute the equilibrium half-way between sample number ``index`` and the next sample.

    ``ends`` are the stiffnesses of both samples. ``unstrained`` (H,) [m] are the means of the
    original lengths l_0 of the H position-controlled cables, and ``target`` [N/m] is the mean of
    the targets. ``directions`` are (3,), (n, 3) or None.
    """
    K, value, off, reason = None, None, math.inf, ""
    try:
        rest = _at_rest(ends, unstrained)
        value = achieved(rest, directions)
        K, off = rest, misfit(value, target, directions)
    except CdsmError as error:
        reason = f"{error} Or take smaller steps."
    return HalfWay(
        index=index, target=target, stiffness=K, achieved=value, misfit=off, reason=reason
    )


def _at_rest(ends: tuple[Stiffness, Stiffness], unstrained: Array) -> Stiffness:
    """Compute K_θ at the equilibrium near the mean of two postures.

    ``ends`` are the stiffnesses at both postures. ``unstrained`` (H,) [m] are the original lengths
    of the position-controlled cables.
    """
    one, other = ends
    q = (one.posture.q + other.posture.q) / 2.0
    F = frozen((one.tension + other.tension) / 2.0)
    W = frozen((one.wrench + other.wrench) / 2.0)
    arm = one.posture.arm
    mean = arm.at(q)
    # lock the cables at their mean tension, inside every domain; no posture has these lengths
    loaded = LoadedArm(mean, F, W, lengths_with(unstrained, mean, F))
    search = find_rest(loaded, loaded.at(mean, F))
    K = search.state.K
    if not (search.converged and search.convex):
        problem = "half-way the arm buckles, or finds no place to rest"
        worst = arm.joint_names[int(abs(K.residual).argmax())]
        raise EquilibriumError(problem, frozen(K.residual), 0.0, worst)
    loaded.require_domains(K.tension)
    return K
