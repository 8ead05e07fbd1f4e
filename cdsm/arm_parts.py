"""What defines an arm, checked once."""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple, get_args

from cdsm.cable import Cable, Cables
from cdsm.cable_laws import OriginalLength
from cdsm.errors import CableError, InvalidInput
from cdsm.geometry import LONGEST, Geometry, doubts_about_units
from cdsm.rigid_body import RigidBody
from cdsm.support.directions import Direction, gravity_vector
from cdsm.support.validation import one_of, sequence_of
from cdsm.tolerances import Tolerances

CablesOrFile = Cable | Sequence[Cable] | str | os.PathLike[str]
"""One or more cables, or the path of their file."""

_FARTHEST = 5.0  # longest plausible lead and distance of a site [m]; or ten arm lengths, if more


class ArmParts(NamedTuple):
    """Everything that defines an arm; two arms are equal if these parts are equal."""

    geometry: Geometry | None
    urdf: str
    cables: Cables
    tip: str
    gravity: tuple[float, ...]
    original_length: OriginalLength
    joint_names: tuple[str, ...] | None
    tolerances: Tolerances = Tolerances()


def checked_parts(
    geometry: Geometry | None,
    urdf: str,
    cables: CablesOrFile,
    tip: str,
    gravity: Direction,
    original_length: OriginalLength,
    joint_names: Sequence[str] | None = None,
    tolerances: Tolerances = Tolerances(),  # noqa: B008  # frozen
) -> ArmParts:
    """Check the arguments of :class:`~cdsm.Manipulator`; ``urdf`` has been checked before."""
    one_of("original_length", original_length, get_args(OriginalLength))
    g = tuple(gravity_vector("gravity", gravity).tolist())
    names = None if joint_names is None else sequence_of("joint_names", joint_names, str)
    held = checked_cables(cables)
    return ArmParts(geometry, urdf, held, tip, g, original_length, names, tolerances)


def checked_cables(cables: CablesOrFile) -> Cables:
    """Return cables, given as such or as the path of their file; each needs a name of its own."""
    if isinstance(cables, (str, os.PathLike)):
        from cdsm.arm_file.cables import read_cables

        return Cables(read_cables(cables))
    given = [cables] if isinstance(cables, Cable) else cables
    cables = Cables(sequence_of("cables", given, Cable))
    if not cables:
        raise InvalidInput("cables", "none given; an arm needs at least one.")
    counts = Counter(cable.name for cable in cables)
    for name, count in counts.items():
        if count > 1:
            raise CableError(name, "the name is used twice; every cable needs its own.")
    return cables


def doubts(parts: ArmParts, body: RigidBody) -> list[str]:
    """Return texts of warnings: lengths look as if not in metres, or no joint moves the tip."""
    # without lengths between the joints, the frame of the robot may be as long as any arm
    most = max(_FARTHEST, 10.0 * body.length) if body.length > 0.0 else LONGEST
    sizes = [(f"the lead of {each.name}", each.lead, most) for each in parts.cables]
    sizes += [
        (f"a site of {each.name}", math.hypot(*site.position), most)
        for each in parts.cables
        for site in each.sites
    ]
    # a geometry warns of its own length
    length = body.length if parts.geometry is None else 0.0
    found = doubts_about_units(length, [max(sizes, key=lambda size: size[1])])
    if not body.tip_joints.size:
        found.append(
            f"no joint moves its tip {parts.tip}, so its stiffness is infinite; give another link "
            "as tip."
        )
    return found
