"""Ends of the sliders: those of the arm's own bounds and of what it holds."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import cdsm
from cdsm.errors import CdsmError
from cdsm.manipulator import Manipulator
from cdsm.view.state import Setting
from cdsm.wires.ropes import breaking_force

ROUND = 1e-9
"""Largest difference of an end of a slider from a round number, over a step."""

_TENSION = 200.0  # [N] where nothing bounds a tension
_FORCE = 20.0  # [N] where nothing bounds a force
_SAG_SHOWN = 0.05  # displacement at the end of a slider of the force, over the arm's length


def tension_range(arm: Manipulator, start: Setting) -> tuple[float, float, float]:
    """Return the ends [N] of the slider of the least tension, and where it starts.

    It begins at the least tension that the cables and their laws allow, and ends where the first
    cable has its maximum, the end of its law or its breaking force.
    """
    held = [cable for cable in arm.cables if cable.control == "position"]
    least = min((cable.minimum for cable in arm.cables), default=0.0)
    laws = [cable.elasticity for cable in held]
    low = max([least, *(law.low for law in laws)])
    ends = [*(cable.maximum for cable in arm.cables), start.maximum]
    ends += [law.high for law in laws] + [breaking_force(law) for law in laws]
    most = min((end for end in ends if math.isfinite(end)), default=_TENSION)
    applied = max(start.minimum, least)
    return min(low, applied), max(most, applied), applied


def force_range(arm: Manipulator, start: Setting) -> float:
    """Return the end [N] of the sliders of the force: twice what the arm holds along y or z.

    Where no bound of a tension limits that, it is the force that moves the place where it acts by
    5 % of the arm's length, or twice the one under which the arm buckles, if that is less.
    """
    link = start.link or None
    try:
        if start.pull is not None:
            source: Any = cdsm.forward_statics(arm, pull=start.pull)
            held = []
        else:
            pose = arm.at(start.q)
            sides = "y", "-y", "z", "-z"
            bounds = start.minimum, start.maximum
            held = [cdsm.payload(pose, u, *bounds, link=link) for u in sides]
            source = cdsm.stiffness(pose, cdsm.distribute_tension(pose, start.minimum))
        within = _proper(2.0 * case.limits["tension"] for case in held)
        if not within:
            within = _proper(_SAG_SHOWN * arm.length * source.along(u, link) for u in "yz")
            buckling = _proper(2.0 * case.following.force for case in held if case.following)
            within = [min(max(within, default=_FORCE), max(buckling, default=math.inf))]
    except CdsmError:
        return _FORCE
    largest = max(within)
    step = 10.0 ** math.floor(math.log10(largest))
    return math.ceil(largest / step - ROUND) * step


def _proper(forces: Iterable[float]) -> list[float]:
    return [force for force in forces if 0.0 < force < math.inf]
