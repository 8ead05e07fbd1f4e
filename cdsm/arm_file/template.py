"""Write the text of a new, complete ARM.toml with a comment on every key."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from importlib.resources import files
from string import Template

from cdsm.wires.catalogue import WIRES


def template(
    name: str,
    wire: str | float,
    minimum: float,
    sections: Sequence[tuple[str, Mapping[str, float]]],
) -> str:
    """Return the text of an ARM.toml called ``name``: ``template.toml`` beside this file, filled.

    ``minimum`` is the lower bound of all tensions [N]. Each of ``sections``, base to tip, is a
    constructor of :class:`Geometry` by name and its keywords; lines of the file with other keywords
    are left out.
    """
    text = files("cdsm.arm_file").joinpath("template.toml").read_text("utf-8")
    section = next(each for each in text.split("\n\n") if each.startswith("[[sections]]"))
    header, *lines = section.split("\n")
    robot = []
    for i, (kind, sizes) in enumerate(sections):
        values: dict[str, object] = dict(sizes)
        values |= {f"{key}_degrees": f"{math.degrees(x):.4g}" for key, x in sizes.items()}
        values["kind"] = kind if len(sections) == 1 else f"sections.{kind}"
        values["start"] = "end of the section before" if i else "base frame"
        values["disk_radius"] = f"{1.2 * sizes['hole_radius']:.4g}"
        values["cable_radius"] = f"{sizes['hole_radius'] / 2.0:.4g}"
        own = [line for line in lines if line[0] in "#[" or line.split(" = ")[0] in sizes]
        robot.append(Template("\n".join([header][: len(sections) - 1] + own)).substitute(values))
    return Template(text.replace(section, "\n\n".join(robot))).substitute(
        name=name, wire=json.dumps(wire), wires=", ".join(WIRES), minimum=minimum
    )
