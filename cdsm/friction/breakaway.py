"""Breakaway: the load at which the first cable of a stuck arm begins to slide, to first order."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.friction.sticking import first_order_loads, holding
from cdsm.friction.stuck import stuck_stiffness
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.directions import Direction, unit_direction
from cdsm.support.format import coordinates
from cdsm.support.result import Result, unit
from cdsm.support.values import Array, frozen
from cdsm.tension import Tension


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Breakaway(Result):
    """First-order load at which the first cable of a stuck arm begins to slide, and its hole.

    Attributes:
        stiffness: Stiffness of the stuck arm, which a weight below ``load`` measures; see
            :func:`stuck_stiffness`.
        direction: Unit direction u (3,) of the force, base axes.
        load: The breakaway load [N], in addition to the wrench of ``stiffness``: the smallest of
            ``hole_loads``. It is 0 if no cable can stick, and inf if none ever slides because the
            force moves no joint.
        hole_loads: Load at which the cable begins to slide in each hole (P,) [N]; inf for holes in
            which it never begins to slide, or cannot stick.
        cable: Name of the cable that slides first; empty if ``load`` is 0 or inf.
        site: Number of the hole where it slides first, among the sites of ``cable``, from 1; 0 if
            ``load`` is 0 or inf.
        link: Name of the link that has this hole; empty if ``load`` is 0 or inf.
    """

    _headline = "load"

    stiffness: Stiffness
    direction: Array = field(metadata=unit("1", "axis"))
    load: float = field(metadata=unit("N"))
    hole_loads: Array = field(metadata=unit("N", "hole"))
    cable: str = field(metadata=unit("1"))
    site: int = field(metadata=unit("1"))
    link: str = field(metadata=unit("1"))

    @property
    def _posture(self) -> Posture:
        return self.stiffness.posture

    def __str__(self) -> str:
        said = f"first-order breakaway along {coordinates(self.direction)}: {self.load:.4g} N"
        if not self.cable:
            return said
        return f"{said}, first at site {self.site} of {self.cable} ({self.link})"


def breakaway(
    pose: Posture,
    tension: Tension | ArrayLike,
    direction: Direction,
    wrench: ArrayLike | None = None,
) -> Breakaway:
    """Compute the force along a direction at which the first cable begins to slide in a hole.

    All segments of a cable start with its tension, as after shaking the arm, and motors are locked.
    A weight below this load measures :func:`stuck_stiffness`. To first order in the load, the cable
    begins to slide in hole i, between segments j and j + 1 with the tensions T, under

        W_i = μ φ_i/(|x_i| − y_i),   x_i = d(ln T_{j+1} − ln T_j)/dW,   y_i = μ dφ_i/dW,

    with the friction coefficient μ, the wrap angle φ_i and the joint motion dθ/dW = K_θ⁻¹ J_vᵀ u of
    the stuck arm. On random arms the exact load is within 2 % of this at μ ≤ 0.1, and within 6 % at
    μ = 0.3.

    Args:
        pose: The posture.
        tension: A :class:`~cdsm.Tension` or your own tensions (C,) [N], as for
            :func:`~cdsm.stiffness`. If they do not balance the arm, the residual torque is kept as
            a constant load.
        direction: u (3,) of the force in base axes, any length, or an axis such as ``"-z"``.
        wrench: W (6,) at ``tool0`` in base axes before the force acts: force [N], then moment
            [N m]; only with your own tensions.

    Raises:
        InvalidInput: An argument is invalid for :func:`~cdsm.stiffness`, or ``direction`` is not a
            direction.
        ElasticityRangeError: A tension leaves the domain of its cable's elasticity.
        SingularStiffness: The stuck arm is about to buckle.
    """
    u = unit_direction("direction", direction)
    K = stuck_stiffness(pose, tension, wrench)
    chains, loads = pose.segments.chains, np.full(pose.segments.wrap.size, math.inf)
    if math.isfinite(K.along(u)):
        motion = np.asarray(np.linalg.solve(K.joint, u @ pose.jacobian[:3]), dtype=np.float64)
        assert K.tension_gradient is not None
        loads = first_order_loads(pose, K.tension[chains.cable], K.tension_gradient, motion)
    load = float(loads.min()) if holding(pose).any() else 0.0
    cable, site, link = "", 0, ""
    if 0.0 < load < math.inf:
        hole = int(loads.argmin())
        slides, site = pose.arm.cables[chains.cable[chains.hole[hole]]], int(chains.site[hole]) + 1
        cable, link = slides.name, slides.sites[site - 1].link
    return Breakaway(
        stiffness=K,
        direction=u,
        load=load,
        hole_loads=frozen(loads),
        cable=cable,
        site=site,
        link=link,
    )
