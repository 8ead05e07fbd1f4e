"""Arms with friction, and chains of segments computed from places alone."""

from dataclasses import replace
from typing import Any

import numpy as np

import cdsm
from cdsm.support.values import Array


def rough(arm: cdsm.Manipulator, friction: Any, **changes: Any) -> cdsm.Manipulator:
    """The arm with friction: a number, or a function of the cable's and the site's number."""
    cables = []
    for c, cable in enumerate(arm.cables):
        holes = range(0 if cable.lead else 1, len(cable.sites) - 1)
        sites = tuple(
            replace(site, friction=friction(c, i) if callable(friction) else friction)
            if i in holes
            else site
            for i, site in enumerate(cable.sites)
        )
        cables.append(replace(cable, sites=sites, **changes))
    return arm.with_cables(cables)


def segment_lengths(pose: cdsm.Posture) -> Array:
    """Length of every segment [m], lead first, from the places of the sites."""
    lengths: list[float] = []
    for cable, path in zip(pose.arm.cables, pose.cable_paths, strict=True):
        lengths += [cable.lead] if cable.lead else []
        lengths += np.linalg.norm(np.diff(path, axis=0), axis=1).tolist()
    return np.array(lengths)


def blocks(arm: cdsm.Manipulator, joined: Any) -> list[list[int]]:
    """Segments that holes join, for a function that says it of a cable and its site."""
    found: list[list[int]] = []
    s = 0
    for c, cable in enumerate(arm.cables):
        found.append([s])
        for i in range(0 if cable.lead else 1, len(cable.sites) - 1):
            s += 1
            if joined(c, i):
                found[-1].append(s)
            else:
                found.append([s])
        s += 1
    return found
