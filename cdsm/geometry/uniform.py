"""Build joints, links and cables of arms whose joints are alike.

A size of these arms is one number for all joints, or a list with one for each joint.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any

from pydantic import Discriminator, Field, Tag

from cdsm.errors import GeometryError
from cdsm.geometry.holes import spread_out
from cdsm.geometry.parts import MAXIMUM_JOINTS, CableRoute, Joint, Link
from cdsm.support.records import EACH, ONE, Integer, Number, one_or_each

JointCount = Annotated[Integer, Field(ge=1, le=MAXIMUM_JOINTS)]

_MOST_CABLES = 64

CablesPerJoint = Annotated[Integer, Field(ge=1, le=_MOST_CABLES)]

_Angles = Annotated[Sequence[Number], Field(max_length=_MOST_CABLES)]


def _of_all_or_each(value: object) -> str:
    first = next(iter(value), None) if isinstance(value, (list, tuple)) else value
    return one_or_each(first)


HoleAngles = Annotated[
    Annotated[_Angles, Tag(ONE)] | Annotated[Sequence[_Angles], Tag(EACH)],
    Discriminator(_of_all_or_each),
]
"""Hole angles [rad]: one list for all joints, or a list of lists, one per joint."""


_SIZES = (
    *("link_length", "disk_offset", "hole_radius", "link_mass", "lead", "friction"),
    *("joint_limit", "disk_radius", "cable_radius", "phase"),
)
"""Keywords whose value is one number for all joints, or a list with one per joint."""


def uniform(
    axes: Sequence[tuple[tuple[float, float, float], ...]],
    usual_angles: Callable[[int], list[list[float]]],
    keywords: Mapping[str, Any],
) -> dict[str, Any]:
    """Return the attributes of a Geometry of universal joints or hinges, by name.

    ``axes`` has the axes of each joint. ``keywords`` are the arguments of
    :meth:`Geometry.universal` by name. ``usual_angles`` maps the number of cables per joint to the
    default hole angles [rad], a list for each joint. Raises GeometryError if an argument is
    invalid.
    """
    cables_per_joint, hole_angles = keywords["cables_per_joint"], keywords["hole_angles"]
    sizes = {key: keywords[key] for key in _SIZES}
    n = len(axes)
    faults = [
        f"{key}: {len(value)} values given for {n} joints; give one, or one for each joint"
        for key, value in sizes.items()
        if isinstance(value, Sequence) and len(value) != n
    ]
    if (cables_per_joint is None) == (hole_angles is None):
        given = "is missing" if hole_angles is None else "is given beside hole_angles"
        faults.append(f"cables_per_joint: {given}; give cables_per_joint or hole_angles")
    elif hole_angles is not None and (empty := _without_angles(hole_angles)):
        faults.append(
            f"{empty}: has no angle; give one for each cable of a joint, at least one. Cables with "
            "other paths replace these: give them in a file of cables (--cables CABLES.toml)"
        )
    elif hole_angles is not None and isinstance(hole_angles[0], Sequence) and len(hole_angles) != n:
        faults.append(
            f"hole_angles: {len(hole_angles)} lists given for {n} joints; give one list of angles, "
            "or one for each joint"
        )
    if faults:
        raise GeometryError(faults)
    if hole_angles is None:
        angles: Sequence[Sequence[float]] = usual_angles(cables_per_joint or 0)
    else:
        angles = hole_angles if isinstance(hole_angles[0], Sequence) else (hole_angles,) * n
    rows = [value if isinstance(value, Sequence) else (value,) * n for value in sizes.values()]
    each = [dict(zip(_SIZES, row, strict=True)) for row in zip(*rows, strict=True)]
    hole_radius = each[0]["hole_radius"]
    joints, links = [], []
    cables: list[CableRoute] = []
    for k, size in enumerate(each):
        R, phase = size["hole_radius"], size["phase"]
        joints.append(
            Joint(
                axes=axes[k],
                disk_offset=size["disk_offset"],
                limit=size["joint_limit"],
                hole_radius=None if hole_radius == R else R,
                disk_radius=size["disk_radius"],
            )
        )
        links.append(Link(length=size["link_length"], mass=size["link_mass"]))
        kept = {"lead": size["lead"], "friction": size["friction"], "radius": size["cable_radius"]}
        cables += [
            CableRoute(joint=k + 1, angle=angle + phase if phase else angle, **kept)
            for angle in angles[k]
        ]
    return {
        "name": keywords["name"],
        "base_length": keywords["base_length"],
        "hole_radius": hole_radius,
        "joints": tuple(joints),
        "links": tuple(links),
        "cables": spread_out(cables, keywords["spread"]),
    }


def _without_angles(hole_angles: Sequence[float | Sequence[float]]) -> str:
    """Return a text that names empty lists of hole angles; an empty text if there are none."""
    lists = [each for each in hole_angles if isinstance(each, Sequence)]
    if not hole_angles or (lists and not any(lists)):
        return "hole_angles"
    return ", ".join(f"hole_angles[{k}]" for k, each in enumerate(lists, start=1) if not each)
