"""From cables on links to the plain arrays that the kernels work on."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cdsm.cable import Cable
from cdsm.errors import CableError, UnknownName
from cdsm.kernels import segments
from cdsm.rigid_body import RigidBody
from cdsm.support.validation import frozen


def route(body: RigidBody, tree: segments.Tree, cables: Sequence[Cable]) -> segments.Routing:
    """Place the sites on the joints, and find for every segment the joints that change it."""
    row, point, fixed = [], [], np.array([cable.lead for cable in cables])
    parts: list[tuple[int, int, int, int, int]] = []
    joints: list[int] = []
    for c, cable in enumerate(cables):
        for i, site in enumerate(cable.sites):
            try:
                joint, rotation, translation = body.locate(site.link)
            except UnknownName as error:
                raise CableError(cable.name, str(error)) from None
            row.append(joint)
            point.append(translation + rotation @ np.array(site.position))
            if i == 0:
                continue
            if row[-2] != row[-1]:
                to_a, to_b = _way(tree, row[-2]), _way(tree, row[-1])
                only_a = [j for j in to_a if j not in to_b]
                first, turn = len(joints), len(joints) + len(only_a)
                parts.append((c, len(row) - 2, len(row) - 1, first, turn))
                joints += [*only_a, *(j for j in to_b if j not in to_a)]
                continue
            length = math.dist(point[-2], point[-1])
            if length < segments.SHORTEST_SEGMENT:
                raise CableError(cable.name, f"sites {i} and {i + 1} coincide; leave one out.")
            fixed[c] += length
    parts.append((0, 0, 0, len(joints), len(joints)))
    return segments.Routing(
        row=frozen(np.array(row, dtype=np.intp)),
        point=frozen(np.array(point)),
        segment=frozen(np.array(parts, dtype=np.intp)),
        joint=frozen(np.array(joints, dtype=np.intp)),
        fixed=frozen(fixed),
    )


def _way(tree: segments.Tree, row: int) -> list[int]:
    way: list[int] = []
    while row:
        way.insert(0, row)
        row = int(tree.parent[row])
    return way
