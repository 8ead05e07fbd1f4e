"""Write the text of a new, complete ARM.toml with a comment on every key."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from cdsm.support.records import toml_value
from cdsm.wires.catalogue import WIRES

_HEAD = """\
# An arm for cdsm; try `cdsm check {name}`, or `cdsm view {name}`,
# or, in Python, arm = cdsm.Manipulator.read("{name}").
# To use a key that stands behind #, delete the #.
# Units: m, rad, kg, N, N/m, m/s2. Base axes: x along the straight arm.

gravity = {gravity}
#original_length = "unstrained"  # what a locked motor holds; "stretched" as in the paper's figures

# The wire of all cables: a name ({wires}), a constant rigidity EA in N
# (wire = 48e3), or the NAME of a table [wires.NAME] with the lines that `cdsm fit` writes.
wire = {wire}
#series_stiffness = 2000.0  # of a spring or a drive in series with every cable [N/m]
#control = "position"  # what the motors hold: "position" or "force"
#minimum = 5.0  # tensions that every cable may carry [N]
#maximum = 400.0
"""

_TOLERANCES = """
# How far the arm may be from what stands here, one sigma; `cdsm stiffness` then says how sure K is.
#[tolerances]
#rigidity = 0.05  # of EA, relative; common to all cables, as of one spool
#joint_angle = 0.0087  # [rad] 0.5 degrees
#tension = 2.0  # as measured [N]
#lead = 5e-3  # [m]
#hole_radius = {{within = 2e-4}}  # [m] surely within +-0.2 mm
#disk_offset = 1e-4  # [m]
#link_length = 1e-4  # [m]
#link_mass = {mass}  # [kg]
"""

_COMMENTS = {
    "joints": "base to tip",
    "twist": "about x, from each hinge axis to the next",
    "cables_per_joint": "",
    "link_length": "of every link; one number, here and below, or a list with one per joint",
    "base_length": "from the base frame to joint 1",
    "base_length of a section": "from the end of the section before to its first joint",
    "disk_offset": "from each joint centre to the disks before and after it",
    "hole_radius": "of the holes from the axis",
    "link_mass": "of every link, a solid cylinder",
    "lead": "straight cable from each actuator to the base disk",
    "spread": "between holes that would be one, where hinges share a plane",
    "phase": "turns its holes off those of the sections before",
}
_MORE = {
    "disk_radius": "outer radius of the disks; default 1.1 hole_radius",
    "cable_radius": "a ring for the cables of its own, on all disks",
    "joint_limit": "both ways; default: disks of disk_radius, else hole_radius, touch",
    "friction": "coefficient in the holes",
    "hole_angles": "replaces cables_per_joint; or one list per joint",
}
_UNITS = {
    **dict.fromkeys(("link_length", "base_length", "disk_offset", "hole_radius", "lead"), "m"),
    **dict.fromkeys(("disk_radius", "cable_radius"), "m"),
    **dict.fromkeys(("twist", "spread", "phase", "joint_limit", "hole_angles"), "rad"),
    "link_mass": "kg",
}

_ONE_CABLE = """
# One cable may differ; the i-th cable of joint k is called cable{k}_{i}.
#[cables.cable1_1]
#wire = 48e3
#minimum = 20.0
#control = "force"
"""


def template(
    name: str,
    wire: str | float,
    gravity: tuple[float, ...],
    sections: Sequence[tuple[str, Mapping[str, float]]],
) -> str:
    """Return the text of an ARM.toml called ``name``.

    ``wire`` is a name or EA [N], ``gravity`` is in base axes [m/s²]. Each of ``sections``, base to
    tip, is a constructor of :class:`Geometry` by name (``"universal"``, ``"hinged"``) and its
    keywords.
    """
    lines = [
        _HEAD.format(
            name=name, gravity=list(gravity), wire=toml_value(wire), wires=", ".join(WIRES)
        )
    ]
    for i, (kind, sizes) in enumerate(sections):
        prefix = ""
        if len(sections) > 1:
            prefix = "sections."
            lines.append("[[sections]]  # base to tip; its cables run through the holes before it")
        lines.append(f"[{prefix}{kind}]")
        for key, value in sizes.items():
            comment = _COMMENTS[f"{key} of a section" if i and key == "base_length" else key]
            lines.append(_line(key, value, comment))
        radius = 1.2 * sizes["hole_radius"]
        more = (radius, sizes["hole_radius"] / 2.0, 0.5, 0.1, (0.0, 2.0, 4.0))
        examples = zip(_MORE.items(), more, strict=True)
        lines += [f"#{_line(key, value, comment)}" for (key, comment), value in examples]
        lines.append("")
    tolerances = _TOLERANCES.format(mass=f"{0.05 * sections[0][1]['link_mass']:.3g}")
    return "\n".join(lines).rstrip("\n") + "\n" + _ONE_CABLE + tolerances


def _line(key: str, value: object, comment: str) -> str:
    """Return the TOML line of a key with its value; unit and ``comment`` follow after #."""
    words = [f"[{_UNITS[key]}]"] if key in _UNITS else []
    if _UNITS.get(key) == "rad" and isinstance(value, float):
        words.append(f"{math.degrees(value):.4g} degrees;")
    words += [comment] if comment else []
    return f"{key} = {toml_value(value)}" + (f"  # {' '.join(words)}" if words else "")
