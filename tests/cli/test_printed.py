"""What a command prints is what its JSON and its tables hold: names, numbers and units."""

from __future__ import annotations

import csv
import json
import math
import re
import shlex
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.special import chdtr, ndtri

import cdsm
from tests.cli.test_commands import EXAMPLES, call
from tests.support.printed import Printed, numbers, require_all, table

Answer = dict[str, Any]
SAMPLES = EXAMPLES / "data"


def both(words: str, code: int = 0) -> tuple[str, Answer]:
    """Return what a command prints, and its JSON. Words in capitals are arms of the examples."""
    words = re.sub(
        r"\b([A-Z_]+)\b(?=\s)", lambda m: f"{EXAMPLES}/{m[1].lower()}.toml", words, count=1
    )
    arguments = shlex.split(words.replace("DATA", str(SAMPLES)))
    text = call(*arguments)
    assert text.exit_code == code, text.output
    answer = call(*arguments, "--json")
    assert answer.exit_code == code
    return text.stdout, json.loads(answer.stdout)


def row(cells: dict[str, Printed], names: Any, values: Any) -> Any:
    """Pair the cells of a row with values, by the names of the columns."""
    return [(cells[name], value) for name, value in zip(names, values, strict=True)]


def require_tensions(text: str, tension: dict[str, float], column: str = "tension") -> None:
    rows = table(text, "cable ")
    assert [*rows] == [*tension]
    require_all(((rows[name][column], F) for name, F in tension.items()), digits=None)


def require_stiffness(text: str, answer: Answer) -> None:
    """The table of readings, with the terms of each, and the smallest joint stiffness."""
    rows = table(text, "stiffness [N")
    require_all(row(rows["along"], "xyz", answer["along_N_per_m"]))
    for name in ("cartesian", "pseudoinverse"):
        matrix = answer[f"{name}_N_per_m"]
        if matrix is not None:
            require_all(row(rows[f"{name}, diagonal"], "xyz", np.diag(matrix)))
    for axis, along in zip("xyz", answer["along_N_per_m"], strict=True):
        parts = [cells[axis] for name, cells in rows.items() if name.startswith("of it ")]
        if along is None:
            assert {part.text for part in parts} == {"-"}
            continue
        terms = [float(part.text) * part.size for part in parts]
        assert sum(terms) == pytest.approx(along, abs=1e-3 * max(map(abs, terms)))
        compliance = np.array(answer["compliance"])[:3, :3]
        assert along == pytest.approx(1.0 / compliance["xyz".index(axis), "xyz".index(axis)])
    (margin,) = numbers(text, "smallest joint stiffness {}")
    require_all([(margin, answer["margin_Nm_per_rad"])])


def require_place(text: str, answer: Answer) -> None:
    """The posture, and where the tip is."""
    places = numbers(text, "tip at ({}, {}, {}) mm", "mm")
    require_all(zip(places, answer["tip_position_m"], strict=True))
    line = next(line for line in text.splitlines() if line.startswith("at "))
    angles = [numbers(each, "{}")[0] for each in line[3:].partition(";")[0].split(", ")]
    require_all(zip(angles, answer["angles_rad"].values(), strict=True))
    assumed = answer["computed_with"]
    gravity = numbers(text, "gravity {}, {}, {} m/s²")
    require_all(zip(gravity, assumed["gravity_m_per_s2"], strict=True), digits=6)
    assert f"with wire {assumed['wire']}; " in text
    assert f"; friction {assumed['friction']}\n" in text


@pytest.mark.parametrize(
    "words",
    [
        "ARM --angles 8 --load 0,0,-1",
        "TWO_SECTIONS --angles 5",
        "ALTERNATING_HINGES --angles joint1=12,joint4=-7",
        "FINGER_WITH_PULLEYS ",
    ],
)
def test_stiffness(words: str) -> None:
    text, answer = both(f"stiffness {words}")
    require_place(text, answer)
    require_tensions(text, answer["tension_N"])
    require_stiffness(text, answer)
    arm = cdsm.Manipulator.read(EXAMPLES / f"{words.split()[0].lower()}.toml")
    J = arm.at([*answer["angles_rad"].values()]).jacobian
    rows = table(text, "stiffness [N")
    for i, axis in enumerate("xyz"):
        if answer["along_N_per_m"][i] is not None:  # each term is mᵀ K m of the same motion m
            motion = np.linalg.solve(answer["joint_stiffness_Nm_per_rad"], J[i])
            motion /= J[i] @ motion
            for name in ("passive", "active", "gravity", "load"):
                part = motion @ answer[f"{name}_Nm_per_rad"] @ motion
                cell = rows[f"of it {name}"][axis]
                assert float(cell.text) * cell.size == pytest.approx(part, rel=1e-3, abs=1e-6)
    held = answer["computed_with"]["least_tension_N"]
    assert [{*low.values()} for low in held] == [{float(numbers(text, "least tension {}")[0].text)}]


def test_stiffness_of_directions_with_friction_and_tolerances() -> None:
    changes = "--set friction=0.1 --set tolerances.rigidity=0.05 --set tolerances.tension=0.5"
    text, answer = both(f"stiffness ARM --angles 8 --direction 1,0,-1 {changes}")
    along = numbers(text, "along 1,0,-1: {}")
    require_all(zip(along, [answer["along_direction_N_per_m"]], strict=True))
    assert [*answer["sticking"]] == ["x", "y", "z", "1,0,-1"]
    for name, stuck in answer["sticking"].items():
        printed = numbers(text, f"along {name} {{}} below {{}}")
        require_all(zip(printed, (stuck["stuck_N_per_m"], stuck["breakaway_N"]), strict=True))
    rows = table(text, "uncertainty [N")
    for name, budget in answer["uncertainty"].items():
        value, _, half = rows["along"][name].text.partition(" ± ")
        unit = rows["along"][name].unit
        ends = (budget["value_N_per_m"], budget["standard_uncertainty_N_per_m"])
        pair = (Printed(value, unit), Printed(half, unit))
        require_all(zip(pair, ends, strict=True), digits=None)
        for source, part in budget["contributions_N_per_m"].items():
            share = rows[source.replace("_", " ")][name]
            require_all([(share, part / budget["value_N_per_m"])], digits=2)
    sources = [*rows][1:]
    largest = {
        source: max(
            budget["contributions_N_per_m"][source.replace(" ", "_")] / budget["value_N_per_m"]
            for budget in answer["uncertainty"].values()
        )
        for source in sources
    }
    assert sources == sorted(largest, key=lambda source: -largest[source])  # what counts is first
    assert len({*largest.values()}) > 1


def test_stiffness_of_an_arm_whose_motors_hold_tensions() -> None:
    text, answer = both("stiffness BACKBONE --tension cable10_1=2,cable10_3=1", code=0)
    require_tensions(text, answer["tension_N"])
    require_stiffness(text, answer)
    moved = numbers(text, "tip moved by ({}, {}, {}) mm", "mm")
    straight = np.array([0.4, 0.0, 0.0])
    require_all(
        zip(
            moved,
            np.array(answer["tip_position_m"]) - straight,
            strict=True,
        )
    )
    assert [name for name, F in answer["tension_N"].items() if F == 0.0] == answer["slack"]


@pytest.mark.parametrize(
    "words", ["ARM --angles 8 --mass 0.2", "ARM --angles 8 --load 0,1,-2 --set friction=0.1"]
)
def test_weigh(words: str) -> None:
    text, answer = both(f"weigh {words}")
    rows = table(text, "load [N]")
    loads = [name for name in rows if name != "linear"]
    printed = [Printed(name, "N") for name in loads]
    require_all(zip(printed, answer["loads_N"], strict=True))
    moves = [*answer["displacements_m"], answer["tangent_displacement_m"]]
    for cells, moved in zip(rows.values(), moves, strict=True):
        require_all(row(cells, "xyz", moved))
    measured = numbers(text, "measured {}, linear {}")
    require_all(
        zip(measured, (answer["stiffness_N_per_m"], answer["tangent_N_per_m"]), strict=True)
    )
    require_held(text, "locked", answer["holds"])
    if "friction" not in words:  # else the table is that without friction, and says so
        last = answer["tensions_N"][-1]
        cables = table(text, "cable ")
        pairs = zip((cells["tension"] for cells in cables.values()), last, strict=True)
        require_all(pairs, digits=None)
        _, start = both("stiffness ARM --angles 8")  # from where the weight pulls
        require_all(
            ((cables[name]["reference"], F) for name, F in start["tension_N"].items()), digits=None
        )
        return
    assert "at the full load without friction:\n" in text
    stuck = numbers(text, "below {} all cables stick: a weight measures {}")
    require_all(zip(stuck, (answer["breakaway_load_N"], answer["stuck_N_per_m"]), strict=True))
    require_all([(numbers(text, "at {} they slide")[0], answer["sliding_load_N"])])
    alone = numbers(text, "alone would measure {} without friction")
    require_all([(alone[0], answer["frictionless_N_per_m"])])
    last = numbers(text, "with friction, at the full load: tip moved by ({}, {}, {}) mm", "mm")
    require_all(zip(last, answer["displacements_m"][-1], strict=True))


def test_weigh_in_cycles_and_their_table(tmp_path: Path) -> None:
    out = tmp_path / "loop.csv"
    words = f"--mass 0.2 --set friction=0.1 --cycles 2 --steps 1 --out {out}"
    text, answer = both(f"weigh ARM --angles 8 {words}")
    lines = text.partition("lost [mJ]\n")[2].splitlines()
    head, *readings = csv.reader(out.read_text(encoding="utf-8").splitlines())
    assert head[1:4] == [f"force {axis} [N]" for axis in "xyz"]
    assert head[4:7] == [f"displacement {axis} [m]" for axis in "xyz"]
    assert head[-1] == "events"
    for k, (*reading, told) in enumerate(readings):
        events = [event for event in answer["events"] if event["step"] == k]
        for said, event in zip(filter(None, told.split("; ")), events, strict=True):
            assert said.startswith(event["place"])
            require_all([(numbers(said, "at {}")[0], event["load_N"])])
        cells = lines[k].split()
        sliding = np.count_nonzero(answer["sliding"][k])
        lost = answer["dissipated_J"][k]
        forces = answer["wrenches_N_and_Nm"][k][:3]
        moved = answer["displacement_m"][k]
        numbers_of_row = [k, *forces, *moved, sliding, lost]
        units = ["", "N", "N", "N", "mm", "mm", "mm", "", "mJ"]
        printed = [Printed(*pair) for pair in zip(cells, units, strict=True)]
        require_all(zip(printed, numbers_of_row, strict=True), digits=None)
        np.testing.assert_allclose([float(x) for x in reading], numbers_of_row)
    require_all([(numbers(text, "in all {} lost")[0], sum(answer["dissipated_J"]))])
    first, second = np.split(np.array(answer["dissipated_J"]), 2)
    assert answer["lost_in_last_cycle_J"] == pytest.approx(second.sum())
    assert first.sum() != pytest.approx(second.sum(), rel=1e-3)
    assert answer["left_over_m"] == pytest.approx(np.linalg.norm(answer["displacement_m"][-1]))
    last = numbers(text, "the last cycle loses {}; residual displacement {}")
    require_all(zip(last, (answer["lost_in_last_cycle_J"], answer["left_over_m"]), strict=True))


@pytest.mark.parametrize("words", ["ARM --angles 8 --mass 0.2", "TWO_SECTIONS --load 0,-3,0"])
def test_buckle(words: str) -> None:
    text, answer = both(f"buckle {words}")
    critical = answer["critical_tension"]
    if critical["minimum_N"] is not None:
        bound = numbers(text, "buckles at a lower bound of {}")
        require_all([(bound[0], critical["minimum_N"])])
    spans = numbers(text, "stable from {} to {}", "N")
    require_all(zip(spans, critical["stable_N"][0], strict=True))
    require_all([(numbers(text, "up to a factor of {}")[0], answer["critical_load"]["factor"])])
    for name, held in (("follow", "following"), ("locked", "locked")):
        require_held(text, name, answer["payload"][held])
    require_mode(text.split("softest joint motion: ")[1], critical["mode"])
    require_mode(text.split("softest joint motion: ")[2], answer["critical_load"]["mode"])


def require_held(text: str, motors: str, case: dict[str, Any]) -> None:
    """What an arm holds, in kg only if that hangs, and what limits it."""
    hangs = case["mass_kg"] is not None
    line = f"motors {motors}: {{}}{' ({})' * hangs}, limit: {case['limit']}"
    require_all(zip(numbers(text, line), (case["force_N"], case["mass_kg"]), strict=False))


def require_mode(text: str, mode: dict[str, float]) -> None:
    """Named joints move most, in this order."""
    named = [part.split() for part in text.splitlines()[0].split(", ") if part != "…"]
    order = sorted(mode, key=lambda name: -abs(mode[name]))
    assert [name for name, _ in named] == order[: len(named)]
    require_all(((Printed(x, ""), mode[name]) for name, x in named), digits=2)


def test_plan_at_a_posture_and_its_table(tmp_path: Path) -> None:
    out = tmp_path / "motors.csv"
    text, answer = both(f"plan ARM --direction z --target 4 --angles 8 --out {out}")
    reach = numbers(text, "the stiffness can be {} to {}")
    unit = reach[1].unit
    ends = [Printed(x.text, unit) for x in reach]
    require_all(zip(ends, (answer["low_N_per_m"], answer["high_N_per_m"]), strict=True))
    for name, case in (("softest", "low"), ("stiffest", "high")):
        printed = numbers(text, f"{name} with {{}} to {{}}, smallest joint stiffness {{}}", "N")
        F = answer[f"{case}_tension_N"].values()
        margin = answer["margins_Nm_per_rad"][case == "high"]
        require_all(zip(printed, (min(F), max(F), margin), strict=True))
    stops = re.findall(r"(softest|stiffest).*limited by stability", text)
    cases = zip(("softest", "stiffest"), answer["limited_by_stability"], strict=True)
    assert stops == [name for name, limited in cases if limited]
    require_tensions(text, answer["tension_N"])
    planned = numbers(text, "along (0, 0, 1): {} ({} wanted)")
    require_all(zip(planned, (answer["achieved_N_per_m"], answer["target_N_per_m"]), strict=True))
    margin = numbers(text.rpartition("wanted")[2], "smallest joint stiffness {}")
    require_all([(margin[0], answer["margin_Nm_per_rad"])])
    head, *rows = csv.reader(out.read_text(encoding="utf-8").splitlines())
    assert head == ["cable", "tension [N]", "cable_lengths [m]", "rest_lengths [m]"]
    names = ("tension_N", "cable_lengths_m", "rest_lengths_m")
    for cable, *cells in rows:
        assert [float(cell) for cell in cells] == [answer[name][cable] for name in names]


def test_plan_along_a_path_and_its_table(tmp_path: Path) -> None:
    out = tmp_path / "path.csv"
    words = f"--direction z --target 4 --path DATA/PATH.csv --out {out}"
    text, answer = both(f"plan ARM {words}")
    F = np.array(answer["tensions_N"])
    printed = numbers(text, "with {} to {}, which change by up to {}", "N")
    values = (F.min(), F.max(), abs(np.diff(F, axis=0)).max())
    require_all(zip(printed, values, strict=True))
    assert f"{len(F)} of {len(answer['target_N_per_m'])} samples planned" in text
    rows = [*csv.DictReader(out.read_text(encoding="utf-8").splitlines())]
    for k, cable in enumerate(answer["cables"]):
        assert [float(row[f"tensions {cable} [N]"]) for row in rows] == F[:, k].tolist()


def test_sweep_has_quantiles_of_its_table(tmp_path: Path) -> None:
    out = tmp_path / "s.csv"
    text, answer = both(f"sweep ARM --grid joint1_1=-50:20:10,joint3_1=-15:15:8 --out {out}")
    rows = [*csv.DictReader(out.read_text(encoding="utf-8").splitlines())]
    counted = [row["status"] for row in rows]
    assert answer["entries"] | {word: counted.count(word) for word in counted} == answer["entries"]
    listed = ", ".join(f"{count} {word}" for word, count in answer["entries"].items() if count)
    assert f": {listed}\n" in text
    printed = table(text, "quantiles")
    assert [*printed] == [*answer["quantiles"]]
    for name, cells in printed.items():
        marks = answer["quantiles"][name]
        assert int(cells["entries"].text) == marks["entries"]
        head = re.fullmatch(r"along (.)", name)
        column = next(
            key
            for key in rows[0]
            if (f"along_{head[1]}" if head else name) == key.partition(" [")[0]
        )
        held = [row for row in rows if row["status"] in ("ok", "immobile", "unstable")]
        values = np.array([float(_number(row[column])) for row in held if row[column]])
        assert len(values) == marks["entries"]
        levels = {"least": 0.0, "5 %": 0.05, "median": 0.5, "95 %": 0.95, "most": 1.0}
        for mark, level in levels.items():
            exact = np.quantile(values, level, method="inverted_cdf")
            assert level in (0.0, 0.5, 1.0) or len(values) > 40  # else it is an end
            if math.isfinite(exact):
                assert marks[mark] == pytest.approx(exact, rel=1e-12)
            require_all([(Printed(cells[mark].text, cells["unit"].text), exact)])


def _number(cell: str) -> float:
    return float(cell == "True") if cell in ("True", "False") else float(cell)


def test_curve_of_a_sweep_over_tension() -> None:
    text, answer = both("sweep ARM --angles 8 --minimum 5,20,40")
    rows = table(text, "least tension [N]  along")
    assert [*rows] == ["10", "20", "40"]
    for k, (low, cells) in enumerate(rows.items()):
        point = {name: values[k] for name, values in answer["curve"].items()}
        assert point.pop("status") == cells["status"].text == "ok"
        assert point.pop("least_tension_N") == float(low)
        assert len(point) == len(cells) - 2
        for name, value in point.items():
            key = next(head for head in cells if name.startswith(head.replace(" ", "_")))
            require_all([(cells[key], value)])


def test_fit() -> None:
    text, answer = both("fit DATA/TEST.csv")
    tension = numbers(text, "tension {} to {}")
    require_all(zip(tension, answer["domain_N"], strict=True))
    rigidity = numbers(text, "rigidity {} to {}, ± {}")
    ends = answer["rigidity_N"][0], answer["rigidity_N"][-1]
    require_all(zip(rigidity, ends, strict=False))
    require_all([(rigidity[2], answer["relative_uncertainty"])], digits=2)
    require_all([(numbers(text, "rms {}")[0], answer["rms_N"])], digits=3)
    require_all([(numbers(text, "gauge length {}")[0], answer["gauge_length_m"])], digits=None)
    for name, ends in answer["stages_N"].items():
        require_all(zip(numbers(text, f"stage {name} {{}} to {{}}"), ends, strict=True))
    for remark in answer["notes"]:
        assert remark in text


def test_identify_and_plan_of_tests() -> None:
    free = "--free rigidity --free friction --displacement-std 0.01"
    text, answer = both(f"identify ARM DATA/LOOPS.csv {free}")
    rows = table(text, "parameter [own unit]")
    half = ndtri(0.975) * np.array(answer["std_own_unit"])
    for k, name in enumerate(answer["names"]):
        value, std = answer["values_own_unit"][k], answer["std_own_unit"][k]
        ends = [value - half[k], value + half[k], *answer["bounds_own_unit"][k]]
        columns = ("value", "std", "95 % from", "to", "low", "high")
        require_all(row(rows[name], columns, [value, std, *ends]))
    chi = numbers(text, "χ² = {} with {} degrees of freedom (right models and σ: smaller in {} of")
    less = chdtr(answer["freedom"], answer["chi_square"])
    require_all(zip(chi, (answer["chi_square"], answer["freedom"], less), strict=True), digits=3)
    assert f"rank {answer['rank']} of {len(answer['names'])}" in text
    tests = table(text, "measurement ")
    errors = np.subtract(answer["predicted_N_per_m_or_m"], answer["measured_N_per_m_or_m"])
    sizes = zip(
        tests.values(), np.split(errors, 2), np.split(np.array(answer["residuals"]), 2), strict=True
    )
    for cells, error, residual in sizes:
        off = numbers(cells["predicted"].text, "off by {} rms")
        require_all([(off[0], np.sqrt(np.mean(error**2)))], digits=3)
        worst = residual[abs(residual).argmax()]
        require_all([(cells["worst residual"], worst)], digits=None)
    text, answer = both(f"identify ARM DATA/LOOPS.csv {free} --start friction=0.1 --tests 3")
    times = table(text, "test ")
    assert sum(int(cells["times"].text.rstrip("×")) for cells in times.values()) == 3
    rows = table(text, "parameter [own unit]")
    names = zip(rows, answer["values_own_unit"], answer["std_own_unit"], strict=True)
    for name, value, std in names:
        require_all([(Printed(rows[name]["expected"].text, ""), value)])
        share = numbers(rows[name]["95 %"].text, "± {}")
        require_all([(share[0], 1.96 * std / value)], digits=3)


@pytest.mark.parametrize(
    "sought",
    [
        "--link tool0",
        "--link tool0=fx,fy,fz,mz --link link2=fz --set friction=0.1",
        "--link tool0=wrench --link link2=fy,fz",  # of which the readings do not tell all
    ],
)
def test_estimate(sought: str) -> None:
    std = "--tension-std 0.5 --angle-std 0.1"
    text, answer = both(f"estimate ARM DATA/LOAD_CELLS.csv {std} {sought}")
    parts = text.split("\n\n")
    assert [part.splitlines()[0] for part in parts] == [*answer["readings"]]
    for part, found in zip(parts, answer["readings"].values(), strict=True):
        require_estimate(part, found)


def require_estimate(text: str, found: Answer) -> None:
    """The loads with what they leave unknown, and the combinations of them that are told."""
    for warning in found["warnings"]:
        assert warning in text
    (cells,) = {*found["tension_std_N"].values()}
    (angles,) = {*found["angle_std_rad"].values()}
    read = numbers(text, "from {} load cells (±{} N) and {} angles (±{})")
    counts = len(found["motor_tension_N"]), len(found["angles_rad"])
    require_all(zip(read, (counts[0], cells, counts[1], angles), strict=True))
    units = {name: "N m" if name[0] == "m" else "N" for name in found["loads_N_or_Nm"]}
    # empty cells at the end of a row are not printed
    text = re.sub("not told$", f"not told{' ' * 40}", text, flags=re.MULTILINE)
    rows = table(text, "load  ")
    assert [*rows] == [f"{name} [{unit}]" for name, unit in units.items()]
    for (name, unit), cells in zip(units.items(), rows.values(), strict=True):
        value, _, half = cells["value ± std"].text.partition(" ± ")
        std = found["std_N_or_Nm"][name]
        if std is None:
            assert value == "not told"
            continue
        load = (Printed(value, unit), found["loads_N_or_Nm"][name]), (Printed(half, unit), std)
        require_all(load, digits=None)
        for column, key in (("friction ±", "band"), ("combined std", "uncertainty")):
            printed = Printed(cells[column].text, unit)
            require_all([(printed, found[f"{key}_N_or_Nm"][name])], digits=2)
    sums = table(text, "combination")
    seen = zip(sums.items(), found["seen"], found["seen_std_N"], found["seen_band_N"], strict=True)
    for (words, cells), row, std, band in seen:
        terms = re.findall(r"([-+]\d\.\d\d) (\w\w)(?: at (\w+))?", words)
        for part, component, link in terms:
            name = f"{component} at {link or 'tool0'}"
            require_all([(Printed(part, ""), row[[*units].index(name)])], digits=None)
        small = np.delete(row, [[*units].index(f"{c} at {k or 'tool0'}") for _, c, k in terms])
        assert (abs(small) <= 0.05 * max(map(abs, row))).all()
        if std is None:
            assert cells["std"].text == "not told"
            continue
        require_all([(cells["std"], std), (cells["friction ±"], band)], digits=2)
    for line in re.findall(r".* are correlated at .*", text):
        one, other = re.match(r"(.*) and (.*) are", line).groups()  # type: ignore[union-attr]
        (said,) = numbers(line, "correlated at {}")
        wanted = found["correlation"][[*units].index(one)][[*units].index(other)]
        require_all([(said, wanted)], digits=None)
    chi = numbers(text, "χ² = {} with {} degrees of freedom (right models and σ: smaller in {} of")
    less = chdtr(found["freedom"], found["chi_square"])
    require_all(zip(chi, (found["chi_square"], found["freedom"], less), strict=True), digits=3)


def test_design_and_its_table(tmp_path: Path) -> None:
    (tmp_path / "arm.toml").write_bytes((EXAMPLES / "arm.toml").read_bytes())
    problem, out = tmp_path / "design.toml", tmp_path / "out"
    task = (EXAMPLES / "design.toml").read_text(encoding="utf-8")
    for key, value in (("generations", 2), ("population", 8)):
        task = re.sub(rf"(?m)^#?\s*{key} =.*", f"{key} = {value}", task)
    problem.write_text(task, encoding="utf-8")
    call("design", problem, "--out", out)
    text, answer = both(f"design {problem} --out {out} --choose 0")
    counts = numbers(text, "{} designs, {} feasible, {} on the front")
    front = answer["front"]
    many = answer["designs"], answer["feasible"], len(next(iter(front.values())))
    require_all(zip(counts, many, strict=True))
    rows = [*csv.DictReader((out / "front.csv").read_text(encoding="utf-8").splitlines())]
    printed = table(text, "design ")
    assert [name.rstrip("*") for name in printed] == [str(k) for k in range(len(rows))]
    assert [k for k, name in enumerate(printed) if "*" in name] == [answer["compromise"]]
    for k, cells in enumerate(printed.values()):
        for key, values in front.items():
            assert float(rows[k][key]) == values[k]
            require_all([(cells[key.partition(" [")[0]], values[k])])


def test_new_and_export_name_the_arm(tmp_path: Path) -> None:
    text, answer = both(f"new {tmp_path}/a.toml --overwrite --joints 3")
    require_all([(numbers(text, "cables, {} long")[0], answer["length_m"])])
    text, answer = both(f"export ARM {tmp_path}/a.xml --angles 8")
    require_all([(numbers(text, "time step {}")[0], answer["time_step_s"])])
    damping = answer["cable_damping_N_s_per_m"].values()
    ends = numbers(text, "by the cables: {} to {}", "N s/m")
    require_all(zip(ends, (min(damping), max(damping)), strict=True))


def test_reproduce_prints_what_it_writes(tmp_path: Path) -> None:
    text = call("reproduce", "--out", tmp_path).stdout
    results = json.loads((tmp_path / "reproduction.json").read_text(encoding="utf-8"))
    claims = [claim for result in results.values() for claim in result["claims"]]
    assert len(claims) > 20
    head, *lines = text.partition("\n\n")[0].splitlines()
    ends = [0, 35, *(match.end() for match in re.finditer(r"\S+", head))][:2]
    ends += [match.end() for match in re.finditer(r"\S+", head)][1:]
    columns = [slice(*pair) for pair in pairwise(ends)]
    names, paper, computed, verdicts = (
        " ".join(" ".join(line[column] for line in lines).split()) for column in columns
    )
    for column, key in ((names, "quantity"), (verdicts, "verdict")):
        for claim in claims:
            assert claim[key] in column
    for column, key in ((paper, "paper"), (computed, "computed")):
        values = [x for claim in claims for x in claim[key] or ()]
        shown = re.findall(r"-?\d[\d.]*(?:e[-+]?\d+)?", column)
        require_all(zip((Printed(x, "") for x in shown), values, strict=True), digits=3)
