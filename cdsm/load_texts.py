"""Texts of loads on links, for prints and JSON: which act, and where."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cdsm.applied import Applied, as_loads
from cdsm.arm import ComputedArm
from cdsm.dead_loads import LinkPoint
from cdsm.support.format import coordinates
from cdsm.support.values import Array


def described(arm: ComputedArm, applied: Applied) -> list[dict[str, object]]:
    """Return the loads for JSON; nothing of a wrench at the tip alone."""
    return [
        {
            "link": at.link,
            "point_m": at.local,
            "force_N": W[:3],
            "moment_Nm": W[3:],
            **({"of_the_arm": True} if own else {}),
            **({"moved_by_no_joint": True} if at.still and W[:3].any() else {}),
        }
        for own, at, W in _on_links(arm, applied)
    ]


def _on_links(arm: ComputedArm, applied: Applied) -> Iterator[tuple[bool, LinkPoint, Array]]:
    """Yield whether a load belongs to the arm, its place and its wrench; none at the tip."""
    yield from ((True, at, W) for at, W in arm.own_loads)
    yield from ((False, load.at, load.wrench) for load in as_loads(applied).on_links)


def texts(arm: ComputedArm, applied: Applied) -> list[str]:
    """Return a line for each load that does not act at the tip, with its place."""
    lines = []
    for own, at, W in _on_links(arm, applied):
        parts = [f"{coordinates(W[:3])} N"] * bool(W[:3].any())
        parts += [f"{coordinates(W[3:])} N m"] * bool(W[3:].any())
        still = ", which no joint moves" if at.still and W[:3].any() else ""
        where = f"{coordinates(1e3 * at.local)} mm in its frame{still}"
        whose = "load of the arm" if own else "load"
        lines.append(f"{whose} on {at.link}, {where}: {', '.join(parts) or 'none'}")
    return lines


def own_loads(arm: ComputedArm) -> list[str]:
    """Return a line for each load that belongs to an arm, with its place."""
    return texts(arm, np.zeros(6))
