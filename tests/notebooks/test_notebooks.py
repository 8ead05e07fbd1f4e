"""The notebooks show what they show when they are run again, and their main numbers are pinned."""

import json
import math
import re
from itertools import zip_longest
from pathlib import Path
from typing import Any

import pytest

FOLDER = Path(__file__).parents[2] / "notebooks"
NAMES = sorted(path.stem for path in FOLDER.glob("*.ipynb"))
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")

PINNED = {
    "01_stiffness_of_an_arm": [
        "along 46.76 3.296 3.215",
        "moves it by [mm]: [0.605 0.658]",
        "the tip has 5 of 6 motions",
        "tensions from 10 N: 0.319 N/mm",
    ],
    "02_wires": ["fit 1.1 % rms", "strand and spring: 1.52 times stiffer"],
    "03_loads_and_buckling": [
        "measured with 1 mN 59.996 N/mm along z 59.996 N/mm",
        "link2 sinks by 0.520 mm",
        "with gripper up to 26.7 N",
        "h/R = 0.10: stiffens from 9.25°",
        "buckles at a lower bound of 28.83 N",
    ],
    "04_planning_and_control": [
        "20.29 to 128.6 N/mm",
        "measured with 50 mN: 90.0000 N/mm",
        "saturates at 200.4 N",
        "estimated: 90.00 % of the rigidity",
    ],
    "05_stiffness_maps": ["[11.65 33.48 53.03]", "equal to 1e-10: True"],
    "06_urdf_robot_and_mujoco": [
        "MuJoCo settles at [mm]: [-0.05156 0. -0.08731]",
        "less than 1e-9 N m: True",
    ],
    "07_friction_and_identification": ["all cables stuck 257.7 N/mm", "friction 0.1002"],
    "08_design": ["deflection allows 1.072 N", "under the real weight: 0.957 mm"],
    "09_backbone": [
        "x 0.674 12.17 18.1",
        "1 per gap: 305 N, +21.6%",
        "exponent 0.74 ± 0.03, scale 2° (given)",
        "slack explains these measurements.",
        "rigid 651.18 630.85 661.87",
    ],
    "10_pulleys_rolling_joints_sheaths": [
        "lift off at 46.59 degrees",
        "posts, friction 0.1: 90.2%",
        "sheath, bent by 180 degrees: 73.3%",
        "rolling: active term +0.0410",
    ],
    "11_what_load_cells_tell": [
        "unknown directions: RMS error [5.32 0.85 1.27] N",
        "after the pull: RMS error [2.73 0.44 0.5 ] N",
        "on link3, 20 mm from its joint: [0.96 4. ] N",
    ],
    "12_friction_in_somebody_elses_rod": [
        "from 1 N on: 80.6 to 89.2 GPa",
        "from 1 N on: 77.1 to 80.4 GPa",
        "bending_stiffness and friction are correlated at -0.9588",
        "tips 17.6 mm apart",
    ],
}


def outputs(notebook: dict[str, Any]) -> list[dict[str, Any]]:
    return [output for cell in notebook["cells"] for output in cell.get("outputs", [])]


def printed(cell: dict[str, Any]) -> list[str]:
    """Return the words that a cell printed, without what compiling says on the standard error."""
    texts = [each["text"] for each in cell.get("outputs", []) if each.get("name") == "stdout"]
    return " ".join("".join(text) for text in texts).split()


def same(one: str, other: str) -> bool:
    """Compare words: their numbers by 1e-3, by two units of the last digit, or by 1e-9 (noise)."""
    if NUMBER.sub("", one) != NUMBER.sub("", other):
        return False
    for a, b in zip(NUMBER.findall(one), NUMBER.findall(other), strict=True):
        digit = 10.0 ** -len(a.partition("e")[0].partition(".")[2]) if "e" not in a else 0.0
        unit = 2.0 * digit if "." in a else 0.0
        if not math.isclose(float(a), float(b), rel_tol=1e-3, abs_tol=max(1e-9, unit)):
            return False
    return True


@pytest.mark.parametrize("name", NAMES)
def test_what_is_kept_is_small_clean_and_has_the_pinned_numbers(name: str) -> None:
    text = (FOLDER / f"{name}.ipynb").read_text(encoding="utf-8")
    notebook = json.loads(text)
    words = " ".join(" ".join(printed(cell)) for cell in notebook["cells"])
    assert [each for each in PINNED[name] if each not in words] == []
    assert len(text) < 2e6
    assert "/home/" not in text
    assert "/tmp/" not in text
    kinds = {(each["output_type"], each.get("name", "")) for each in outputs(notebook)}
    assert not kinds & {("error", ""), ("stream", "stderr")}
    assert any("image/png" in each.get("data", {}) for each in outputs(notebook))
    assert not any(cell["metadata"] for cell in notebook["cells"])


@pytest.mark.notebooks
@pytest.mark.parametrize("name", NAMES)
def test_run_again_a_notebook_prints_the_same(name: str) -> None:
    execute = pytest.importorskip("tests.notebooks.execute").execute
    path = FOLDER / f"{name}.ipynb"
    before, now = json.loads(path.read_text(encoding="utf-8")), execute(path)
    for old, new in zip(before["cells"], now["cells"], strict=True):
        one, other = printed(old), printed(new)
        if other[:2] != ["not", "installed:"]:  # a package that not every machine has
            pairs = zip_longest(one, other, fillvalue="")
            assert [pair for pair in pairs if not same(*pair)] == []
