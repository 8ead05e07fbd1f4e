"""What an arm with friction is watched for while it is loaded slowly.

A cable begins to slide in a hole, towards its end or its motor, where

    μ φ ∓ (ln T_{j+1} − ln T_j) − max(±s_j, 0)/(κ_j T_j) = 0,

with the wire s_j that slips since then and the compliance κ_j of the segment before the hole:
the first two terms are zero while it slides, the last one while it sticks.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cdsm.friction.capstan import can_stick
from cdsm.routing import Indices
from cdsm.statics.contact_events import contact_values
from cdsm.statics.crossings import Watched, label_watched
from cdsm.statics.events import Kind
from cdsm.statics.quasi_static import ChainArmState, QuasiStaticArm
from cdsm.statics.solve import ArmState, Balance, Point
from cdsm.support.validation import SMALLEST
from cdsm.support.values import Array


class SlowStage(NamedTuple):
    """Equilibrium within a sub-step."""

    share: float  # of the sub-step
    point: Point
    balance: Balance


def known_point(f: Balance, state: ArmState, x: Array) -> Point:
    """Return an equilibrium with the state that was found there, which knows its own slips."""
    return f(x)._replace(state=state)


def watched_slowly(arm: QuasiStaticArm, holes: Sequence[str]) -> Watched[SlowStage]:
    """Return what an arm with friction is watched for."""
    robot = arm.reference.arm
    cables = robot.cables
    first = arm.start[:-1]
    rough = np.array([any(cable.friction) for cable in cables])
    held = ~arm.forced
    known = held | rough  # a motor that holds the tension without friction needs no law
    most = np.array([cable.maximum for cable in cables])
    low = np.array([cable.elasticity.low for cable in cables])
    high = np.array([cable.elasticity.high for cable in cables])
    stretched = np.flatnonzero(held)
    limited = np.flatnonzero(np.isfinite(most))
    begun = np.flatnonzero(known & (low > 0.0))
    ended = np.flatnonzero(known & np.isfinite(high))
    of_cables: tuple[tuple[Kind, Indices], ...] = (
        ("slack", stretched),
        ("maximum", limited),
        ("law", begun),
        ("law", ended),
    )
    kinds, places, stops = label_watched(robot, of_cables)
    tensions = sum(indices.size for _, indices in of_cables)
    angles = len(kinds) - tensions
    slips: list[Kind] = ["slip"] * (2 * len(holes))

    def value(stage: SlowStage) -> Array:
        state = stage.point.state
        assert isinstance(state, ChainArmState)
        T = state.tension
        least = np.minimum.reduceat(T, first)
        largest = np.maximum.reduceat(T, first)
        return np.concatenate(
            [
                *_slips(state),
                arm.continued_tensions(state)[stretched],
                (most - largest)[limited],
                (least - low)[begun],
                (high - largest)[ended],
                stage.balance.gaps(stage.point.x).ravel()[stops],
                contact_values(state.pose),
            ]
        )

    def scale(stage: SlowStage) -> Array:
        size = max(float(stage.point.state.tension.max(initial=0.0)), SMALLEST)
        parts = (1.0, len(slips)), (size, tensions), (1.0, angles)
        return np.concatenate([np.full(count, unit) for unit, count in parts])

    return Watched((*slips, *kinds), (*holes, *holes, *places), value, scale)


def _slips(state: ChainArmState) -> tuple[Array, Array]:
    """Return what is negative where a cable slides towards its end, or its motor (P,) [-]."""
    segments = state.pose.segments
    hole = segments.chains.hole
    T = np.maximum(state.tension, SMALLEST)
    rise = (np.log(T[1:]) - np.log(T[:-1]))[hole] if hole.size else np.empty(0)
    taut = state.tension[hole] > 0.0
    sticks = can_stick(state.pose) & taut
    beyond = state.chain.slip[hole] / np.where(taut, state.chain.compliance[hole] * T[hole], 1.0)
    towards_end, towards_motor = (
        np.where(sticks, segments.grip - way * rise - np.maximum(way * beyond, 0.0), 1.0)
        for way in (1.0, -1.0)
    )
    return towards_end, towards_motor
