"""What results print is what they hold: names, numbers and units, read back from the text."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import cdsm
from tests.support.printed import Printed, numbers, require_all, table
from tests.support.sweeps import short_arm

POSE = short_arm(cdsm.presets.STRAND_1X19, lead=0.3).at(np.full(6, 0.1))
PULL = cdsm.distribute_tension(POSE, 40.0)
K = cdsm.stiffness(POSE, PULL)
SURE = cdsm.Tolerances(rigidity=0.05, tension=1.0)


def test_saturation_has_its_bounds_and_percents() -> None:
    saturated = cdsm.saturation(POSE, "z", fraction=0.9)
    text = str(saturated)
    most = numbers(text, "the stiffness along (0, 0, 1) is at most {}, at a lower bound of {}")
    require_all(zip(most, (saturated.along.max(), saturated.stiffest), strict=True))
    line = numbers(text, "saturates at {}: {} of that")
    require_all(zip(line, (saturated.bound, 0.9), strict=True))
    require_all([(numbers(text, "looked at up to {}")[0], saturated.minimum[-1])])


def test_gradient_has_a_row_for_each_cable() -> None:
    gradient = cdsm.stiffness_gradient(K)
    rows = table(str(gradient), "cable ")
    assert [*rows] == [*POSE.arm.cables.names]
    for cells, slope, margin in zip(
        rows.values(), gradient.cable_stiffness, gradient.margin, strict=True
    ):
        require_all(
            [(cells["cable stiffness"], slope), (cells["smallest joint stiffness"], margin)]
        )


def test_rest_lengths_of_a_plan_are_those_without_strain() -> None:
    pose = short_arm().at(POSE.q)
    reach = cdsm.stiffness_range(pose, "z", 10.0, 200.0)
    plan = cdsm.plan_stiffness(pose, "z", 0.5 * (reach.low + reach.high), 10.0, 200.0)
    missed = replace(plan, target=1.5 * np.asarray(plan.target))
    said = numbers(str(missed), "along (0, 0, 1): {} ({} wanted)")
    require_all(zip(said, map(float, (plan.achieved, missed.target)), strict=True))
    unstrained = pose.cable_lengths / (1.0 + plan.tension.values / 48e3)
    np.testing.assert_allclose(plan.rest_lengths, unstrained, rtol=1e-12)
    np.testing.assert_allclose(plan.cable_lengths, pose.cable_lengths)


def test_steps_of_a_path_are_its_largest_changes() -> None:
    q = np.linspace(1.0, 0.9, 3)[:, None] * POSE.q
    plan = cdsm.plan_path(POSE.arm, "z", 0.9 * K.along("z"), 10.0, 400.0, angles=q)
    changes = [abs(after - before).max() for before, after in pairwise(plan.tensions)]
    np.testing.assert_allclose(plan.steps, [0.0, *changes])
    ends = numbers(str(plan), "with {} to {}, which change by up to {} per sample", "N")
    values = plan.tensions.min(), plan.tensions.max(), max(changes)
    require_all(zip(ends, values, strict=True))


def test_budget_and_monte_carlo() -> None:
    budget = cdsm.uncertainty(POSE, PULL, SURE, direction="z")
    text = str(budget)
    u = budget.standard_uncertainty
    value = numbers(text, "{} ± {} (one standard uncertainty, {})", "N/mm")
    require_all(zip(value[:2], (budget.value, u), strict=True), digits=None)
    assert value[0].unit == "N/mm"
    require_all([(value[2], u / budget.value)], digits=2)
    ends = numbers(text, "95 % of such arms: {} to {}", "N/mm")
    require_all(
        zip(ends, (budget.value - 1.96 * u, budget.value + 1.96 * u), strict=True), digits=3
    )
    rows = table(text, "source ")
    assert [*rows] == [source for source, part in budget.contributions.items() if part]
    for source, cells in rows.items():
        part = budget.contributions[source]
        require_all([(cells["contribution"], part), (cells["of variance"], (part / u) ** 2)], 3)
    require_all([(rows["rigidity"]["tolerance"], 0.05), (rows["tension"]["tolerance"], 1.0)])
    run = cdsm.monte_carlo(POSE, PULL, SURE, direction="z", draws=2000, progress=False)
    drawn: Any = numbers(str(run), "{} ± {} N/mm, {} draws", "N/mm")
    mean, spread = np.mean(run.values), np.std(run.values, ddof=1)
    require_all(zip(drawn[:2], (mean, spread), strict=True), digits=None)
    assert drawn[2].text == "2000"
    low, high = np.quantile(run.values, [0.025, 0.975])
    ends = numbers(str(run), "95 % of the draws: {} to {}", "N/mm")
    for end, exact in zip(ends, (low, high), strict=True):
        assert float(end.text) * end.size == pytest.approx(exact, rel=1e-3)


def test_terms_of_a_stiffness_are_its_shares_by_name() -> None:
    rows = table(str(K), "stiffness [N")
    for axis in "xyz":
        shares = K.shares(axis)
        parts = {"passive": shares.passive.sum(), "active": shares.active.sum(), **shares.others}
        said = {name: parts[name] for name in parts if f"of it {name}" in rows}
        assert {"passive", "active", "gravity"} <= {*said}
        require_all((rows[f"of it {name}"][axis], value) for name, value in said.items())


def test_bars_of_shares_are_printed_with_their_parts_and_percents() -> None:
    shares = K.shares("z")
    rows = table(str(shares), "cable ")
    assert [*rows] == [*shares, *shares.others, "total"]
    for name, passive, active in zip(shares, shares.passive, shares.active, strict=True):
        cells = rows[name]
        printed = (Printed(cells[part].text, "N/mm") for part in ("passive", "active", "sum"))
        require_all(zip(printed, (passive, active, passive + active), strict=True))
        share = (passive + active) / shares.total
        assert cells["share"].text == f"{100.0 * share:z.1f}%"
    require_all([(rows["total"]["sum"], shares.total)])


def test_weakest_joint_of_a_stiffness_is_named() -> None:
    text = str(K)
    values, vectors = np.linalg.eigh(0.5 * (K.joint + K.joint.T))
    require_all([(numbers(text, "smallest joint stiffness {}")[0], values[0])])
    worst = POSE.arm.joint_names[abs(vectors[:, 0]).argmax()]
    assert f"{worst} moves most" in text


def test_modes_have_their_frequencies() -> None:
    modes = cdsm.modes(K)
    rows = table(str(modes), "mode ")
    pairs = zip((cells["frequency"] for cells in rows.values()), modes.frequencies, strict=True)
    require_all(pairs)
    for cells, shape in zip(rows.values(), modes.shapes.T, strict=True):
        assert cells["moves most"].text == POSE.arm.joint_names[abs(shape).argmax()]
