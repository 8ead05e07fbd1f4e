"""Equivalent arm of an arm whose cables stick in their holes.

A *block* is a part of a cable between two holes in which the cable sticks, or between such a hole
and an end of the cable. In the *arm of blocks*, each block is a cable of its own. While all cables
stick, K_θ of the arm is K_θ of the arm of blocks. Several inputs of the arm of blocks may belong to
one input of the arm: the blocks of a cable have one rigidity and one tension, and the two blocks at
a hole share this hole.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from cdsm.cable import Cable
from cdsm.kernels.tree import Indices
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.stiffness_matrix.sticking import holding
from cdsm.support.values import Array
from cdsm.uncertainties.inputs import inputs_of


class InputMap(NamedTuple):
    """Correspondence between the inputs of an arm and of its equivalent arm of blocks.

    In that arm each block is a cable of its own. A block is a piece of a cable between two holes in
    which the cable sticks.
    """

    labels: Mapping[str, Sequence[str]]  # names of the inputs of the arm, by source
    tension: Array  # tensions of the cables of the arm (C,) [N]
    # index of the arm's input for each input of the arm of blocks; −1 if there is none
    inputs: Mapping[str, Indices]

    def to_arm(self, gradient: Mapping[str, Array]) -> dict[str, Array]:
        """Convert derivatives with respect to inputs of the arm of blocks to those of the arm.

        Inputs of the arm of blocks that are one input of the arm add up. Both mappings have an
        array for each source of uncertainty, such as ``hole_radius``.
        """
        found = {source: np.zeros(len(names)) for source, names in self.labels.items()}
        for source, at in self.inputs.items():
            np.add.at(found[source], at[at >= 0], gradient[source][at >= 0])
        return found

    def to_blocks(self, errors: Mapping[str, Array]) -> dict[str, Array]:
        """Convert errors (N, inputs) of the arm's inputs to errors of the arm of blocks.

        Both mappings have an array for each source of uncertainty, such as ``hole_radius``.
        """
        found = {}
        for source, drawn in errors.items():
            at = self.inputs[source]
            found[source] = np.where(at >= 0, drawn[:, at], 0.0)
        return found


def blocks_of(pose: Posture, tension: Array) -> tuple[Posture, Array, InputMap]:
    """Build the arm of blocks at a posture: a block is a piece of cable between sticking holes.

    ``tension`` is F (C,) [N] of the cables of the arm. Returns the posture of the arm of blocks,
    the tensions of its blocks [N], and the :class:`InputMap` between the two arms.
    """
    arm, chains = pose.arm, pose.segments.chains
    sticks = holding(pose)
    where = zip(
        chains.cable[chains.hole[sticks]].tolist(), chains.site[sticks].tolist(), strict=True
    )
    cuts: dict[int, list[int]] = {}
    for c, site in where:
        cuts.setdefault(c, []).append(site)
    blocks: list[Cable] = []
    own: list[int] = []
    behind: list[bool] = []
    names: dict[str, str] = {}
    for c, cable in enumerate(arm.cables):
        sites = tuple(replace(site, friction=0.0, wrap=0.0) for site in cable.sites)
        at = cuts.get(c, [])
        ends = sorted({0, *at, len(sites) - 1})
        for n, (i, j) in enumerate(pairwise(ends)):
            part = sites[i : j + 1]
            if len({site.link for site in part}) == 1:
                continue  # within one link nothing changes its length
            block = replace(cable, name=f"{cable.name}:{n}", sites=part)
            behind.append(i > 0 or 0 in at)
            if behind[-1]:  # a hole that holds keeps lead, spring and motor away
                block = replace(block, lead=0.0, series_stiffness=math.inf, control="position")
            names[block.name] = cable.name
            for k, site in enumerate(part, start=1):
                of_block = f"{block.name} on {site.link}, site {k}"
                of_cable = f"{cable.name} on {site.link}, site {i + k}"
                for axis in ("", ", x", ", y", ", z"):  # a hole, and its coordinates
                    names[of_block + axis] = of_cable + axis
            blocks.append(block)
            own.append(c)
    stuck = arm.with_cables(blocks)
    ties = InputMap(inputs_of(arm).labels, tension, _matching_inputs(arm, stuck, names, behind))
    return stuck.at(pose.q, check_limits=False), tension[own], ties


def _matching_inputs(
    arm: Manipulator, stuck: Manipulator, names: Mapping[str, str], behind: Sequence[bool]
) -> dict[str, Indices]:
    """Find the index of the arm's input that belongs to each input of the arm of blocks.

    ``stuck`` is the arm of blocks. ``names`` maps names of blocks and of their sites to names in
    the arm. ``behind`` marks the blocks that begin at a sticking hole. They have no lead, so they
    get the index −1 there.
    """
    theirs, found = inputs_of(arm).labels, {}
    for source, labels in inputs_of(stuck).labels.items():
        at = {name: i for i, name in enumerate(theirs[source])}
        each = [at[names.get(label, label)] for label in labels]
        found[source] = np.array(each, dtype=np.intp)
    found["lead"] = np.where(behind, -1, found["lead"])
    return found
