"""Every row of the page's tables is a number that the page's own command gives as JSON."""

import math
import re
import shlex
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.arm_file.source import ArmSource
from cdsm.support.format import prepare_json
from cdsm.view.saving import command_text
from cdsm.view.state import Setting, Shown, show
from cdsm.view.texts import tensions_text
from cdsm.wires.ropes import breaking_force
from tests.cli.test_commands import told
from tests.support.printed import UNITS, Printed, numbers, require_all
from tests.view.test_state import text

EXAMPLES = Path(__file__).parents[2] / "examples"
UNITS_OF_PAGE = {**UNITS, "mm/N": 1e-3}
BENT = np.deg2rad([4.0, -3.0, 8.0, 2.0, -5.0, 6.0, 1.0, 7.0])
PUSH = np.array([0.2, 0.0, -0.4])
PULL = np.array([0.002, 0.0, 0.0, 0.0, 0.0, 0.0])

STANDS = Setting(q=BENT, minimum=25.0, force=PUSH)
BENDS = Setting(q=np.zeros(0), minimum=0.0, force=0.1 * PUSH, pull=PULL)
ROPES = {"wire": "7x7-0.8mm", "cables.cable2_1.wire": "7x19-1.5mm"}
CASES: dict[str, tuple[str, dict[str, Any], Setting]] = {
    "ropes": ("arm", ROPES, STANDS),
    "ropes, motors locked": ("arm", ROPES, replace(STANDS, sag=True)),
    "motors pull": ("backbone", {}, BENDS),
}
"""Arm of the examples, what is changed of it, and the setting of the page."""


class Row:
    """A row of the page: what it says, the number or numbers, and their unit."""

    def __init__(self, what: str, value: str, unit: str) -> None:
        self.what = re.sub("<[^>]*>", "", what).replace("&emsp;", "").strip()
        self.color = next(iter(re.findall(r"rgb(\([\d, ]+\))", what)), "")
        self.unit = unit
        self.values = value.split(", ")

    def require(self, values: Iterable[float], digits: int | None = 4) -> None:
        """Require these values [SI]."""
        size = UNITS_OF_PAGE[self.unit]
        printed = [Printed(value, "") for value in self.values]
        require_all(zip(printed, np.array([*values]) / size, strict=True), digits)


def rows(shown: Shown) -> dict[str, Row]:
    """The rows of the page's tables, by the first words of each."""
    cells = re.findall(r"<tr><td>(.*?)</td><td[^>]*>(.*?)</td><td[^>]*>&nbsp;(.*?)</td>",
                       text(shown))  # fmt: skip
    found = [Row(*cell) for cell in cells]
    return {re.split(r"[,:] ", row.what)[0]: row for row in found}


def answer_of(arm: cdsm.Manipulator, setting: Setting, source: ArmSource) -> dict[str, Any]:
    """JSON of the command that the page writes, or of the equilibrium that its arm sags to."""
    if setting.sag:
        pose = arm.at(setting.q)
        F = cdsm.distribute_tension(pose, setting.minimum)
        rest = cdsm.equilibrium(pose, F, [*setting.force, 0.0, 0.0, 0.0])
        return prepare_json(rest.stiffness.to_dict() | rest.to_dict())
    return told(*shlex.split(command_text(arm, setting, source))[1:])


def require_shares(shown: Shown, F: dict[str, float]) -> None:
    """Beside the bars, the tension of each cable and its part of what breaks its own rope."""
    bars = re.findall(r'<div class="tension".*?</div>', tensions_text(shown))
    laws = {cable.name: cable.elasticity for cable in shown.posture.arm.cables}  # type: ignore[union-attr]
    parts = {}
    for bar, (name, pull) in zip(bars, F.items(), strict=True):
        said = re.sub("<[^>]*>", " ", bar)
        assert said.split()[0] == name
        breaks = breaking_force(laws[name])
        if math.isnan(breaks):
            assert "%" not in said
            continue
        parts[name] = pull / breaks
        printed = numbers(said, f"{name} {{}} {{}}")
        require_all([(printed[0], pull)])
        require_all([(printed[1], parts[name])], digits=3)
    if not parts:
        assert "share of a breaking force" not in text(shown)
        return
    most = max(parts, key=parts.__getitem__)
    line = numbers(text(shown), f"largest share of a breaking force: {most}, {{}} of {{}}, {{}}")
    breaks = breaking_force(laws[most])
    require_all(zip(line[:2], (F[most], breaks), strict=True))
    require_all([(line[2], parts[most])], digits=3)
    assert most != max(F, key=F.__getitem__)  # a stronger rope pulls more


@pytest.mark.parametrize("case", CASES)
def test_rows_of_the_page_are_numbers_of_the_json(case: str) -> None:
    name, changes, setting = CASES[case]
    source = ArmSource(f"{EXAMPLES}/{name}.toml", changes)
    arm = cdsm.Manipulator.read(source.file, changes=changes)
    if setting.pull is not None:
        setting = replace(setting, q=np.zeros(arm.nv))
    shown = show(arm, setting)
    said, answer = rows(shown), answer_of(arm, setting, source)
    said.pop("stiffness along x").require(answer["along_N_per_m"])
    directions, moves, _ = np.linalg.svd(np.array(answer["compliance"])[:3, :3])
    for what, k in (("softest", 0), ("stiffest", 2)):
        row = said.pop(what)
        row.require([1.0 / moves[k]])
        along = [float(part.text) for part in numbers(row.what, f"{what}: ({{}}, {{}}, {{}})")]
        off = min(abs(side * directions[:, k] - along).max() for side in (1.0, -1.0))
        assert off < 0.0051
    said.pop("largest compliance").require([moves[0]], digits=3)
    said.pop("smallest joint stiffness").require([answer["margin_Nm_per_rad"]])
    said.pop("tip").require(answer["tip_position_m"], digits=None)
    if setting.sag or setting.pull is not None:
        said.pop("displacement").require(answer["displacement_m"], digits=None)
    F = answer["tension_N"]
    for what, end in (("smallest", min), ("largest", max)):
        row = said.pop(f"{what} tension")
        cable = end(F, key=F.__getitem__)
        assert row.what.split(", ")[1].strip() == cable
        row.require([F[cable]])
        assert row.color == str(shown.cable_colors[[*F].index(cable)])
    assert not said  # every row was read
    require_shares(shown, F)
