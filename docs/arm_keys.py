"""Print the table of the keys of ARM.toml, from docstrings: ``python -m docs.arm_keys``.

It stands in ``docs/guide/arm_file.md``; a test compares both.
"""

import re
from collections.abc import Iterable, Mapping

import cdsm
from cdsm.arm_file.model import ArmFile, Urdf
from cdsm.cable import SETTINGS
from cdsm.geometry.beams import Section
from cdsm.support.described import attributes_of
from docs.formulas import typeset

_ROLLING = {
    "radius": "Radius [m] of the round end before each joint; other keys as in ``[hinged]``.",
    "second_radius": "Radius [m] of the round end that rolls on it; the same if it is left out.",
}


def table() -> str:
    """Return the table as Markdown: where a key stands, the key, and what it means."""
    cable = attributes_of(cdsm.Cable)
    site = attributes_of(cdsm.Site)
    pulley = attributes_of(cdsm.Pulley)
    at_joint = attributes_of(cdsm.JointPulley)
    sheath = attributes_of(cdsm.Sheath)
    motor = attributes_of(cdsm.Motor)
    rows = [
        *_rows("top", attributes_of(ArmFile)),
        *_rows("top, `[cables.NAME]`, `[[cables]]`", {key: cable[key] for key in SETTINGS}),
        *_rows("`[[cables]]`", {key: cable[key] for key in ("name", "lead", "sites")}),
        *_rows("`sites`", {"link": site["link"], "xyz": site["position"]}),
        *_rows("`sites`", {key: site[key] for key in ("friction", "wrap")}),
        *_rows("`sites`, a pulley", {key: pulley[key] for key in ("radius", "axis", "groove")}),
        *_rows("`sites`, a pulley", {key: pulley[key] for key in ("turns", "bearing")}),
        *_rows("`sites`, a pulley at a joint", {key: at_joint[key] for key in ("joint", "turn")}),
        *_rows("`sites`, a sheath", {"sheath": sheath["length"], "pieces": sheath["pieces"]}),
        *_rows("`[motors.NAME]`", {key: motor[key] for key in ("cables", "stiffness", "control")}),
        *_rows("`[[loads]]`", attributes_of(cdsm.Load)),
        *_rows("`[urdf]`", attributes_of(Urdf)),
        *_rows("`[universal]`, `[hinged]`", attributes_of(cdsm.Geometry.universal)),
        *_rows("`[hinged]`", {"twist": "Angle about x from each hinge axis to the next [rad]."}),
        *_rows("`[rolling]`", {key: _ROLLING[key] for key in ("radius", "second_radius")}),
        *_rows("`[backbone]`", attributes_of(cdsm.Geometry.backbone)),
        *_rows("`[[backbone.sections]]`", attributes_of(Section)),
        *_rows("`[[sections]]`", {"spread": attributes_of(cdsm.Geometry.sections)["spread"]}),
        *_rows("`[tolerances]`", attributes_of(cdsm.Tolerances)),
    ]
    return "\n".join(["| where | key | meaning |", "|---|---|---|", *rows]) + "\n"


def _rows(where: str, meanings: Mapping[str, str]) -> Iterable[str]:
    for key, meaning in meanings.items():
        plain = re.sub(r":\w+:`~?(?:cdsm\.)?([^`]*)`", r"`\1`", typeset(meaning)).replace("``", "`")
        yield f"| {where} | `{key}` | {plain.replace('|', '&#124;')} |"


if __name__ == "__main__":
    print(table())
