"""Simulated arms with a history of loads, and what sensors read of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

import cdsm
from cdsm import presets
from cdsm.support.values import Array
from tests.support.arms import readme_geometry

TENSION_STD = 0.5
ANGLE_STD = np.deg2rad(0.1)


class Reading(NamedTuple):
    """One state of an arm, and what sensors say of it."""

    history: cdsm.statics.load_cycle.LoadHistory
    posture: cdsm.Posture
    motor_tension: Array

    @property
    def load(self) -> Array:
        """The true load (6,)."""
        return self.history.wrenches[-1]

    @property
    def segment_tension(self) -> Array:
        """The true tensions of the segments (S,)."""
        return self.history.segment_tensions[-1]

    @property
    def sliding(self) -> Mapping[str, Array]:
        """How each cable slides in each of its holes: 1 taken in, −1 let out, 0 sticking."""
        chains = self.history.reference.segments.chains
        slid = -self.history.sliding[-1].astype(np.float64)
        names = self.history.reference.arm.cables.names
        return {name: slid[chains.cable[chains.hole] == c] for c, name in enumerate(names)}


def readings(friction: float, count: int, seed: int, moment: float = 0.0) -> Iterator[Reading]:
    """Three random loads and motor moves at random postures of README's arm, then a reading."""
    arm = cdsm.Manipulator(readme_geometry(friction=friction), presets.STRAND_1X19)
    rng = np.random.default_rng(seed)
    made = 0
    while made < count:
        pose = arm.at(rng.uniform(-0.2, 0.2, arm.nv))
        loads = rng.normal(size=(3, 6)) * [4.0, 4.0, 4.0, moment, moment, moment]
        moves = rng.normal(size=(2, len(arm.cables))) * 1e-4
        try:
            F = cdsm.distribute_tension(pose, minimum=40.0).values
            history = cdsm.load_cycle(pose, F, loads, motors=[*moves, moves[1]])
        except cdsm.CdsmError:
            continue
        T = history.segment_tensions[-1]
        if history.snaps.any() or T.min() < 3.0:
            continue
        made += 1
        read = T[pose.segments.chains.start[:-1]]
        read = read + rng.normal(size=read.size) * TENSION_STD
        q = history.angles[-1] + rng.normal(size=arm.nv) * ANGLE_STD
        yield Reading(history, arm.at(q, check_limits=False), read)
