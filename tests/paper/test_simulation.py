"""The paper's simulation study (Section IV), recomputed, and the report of all figures."""

import json

import numpy as np
import pytest

import cdsm
from cdsm import paper, presets
from tests.conftest import Results


def claims(results: Results, name: str, quantity: str) -> list[paper.Claim]:
    found = [claim for claim in results[name].claims if claim.quantity.startswith(quantity)]
    assert found
    return found


def of_arm(results: Results, name: str) -> paper.StiffnessFigure:
    figure = results[name]
    assert isinstance(figure, paper.StiffnessFigure)
    return figure


def test_fig5_says_what_is_misprinted_and_what_the_digits_leave_open(results: Results) -> None:
    first, printed, end, level = results["fig5"].claims
    assert first.computed[0] == pytest.approx(-0.9946, abs=1e-4)
    assert printed.computed[0] == pytest.approx(-69.4, abs=0.1)
    assert end.computed == pytest.approx((14.5, 84.8), abs=0.1)
    assert level.computed[0] == pytest.approx(0.75, abs=0.01)


def test_fig5_curve_integrates_eq19(results: Results) -> None:
    figure = results["fig5"]
    assert isinstance(figure, paper.StrandFigure)
    slope = np.gradient(figure.tension, figure.displacement)
    # differences of a curve with a jump at 31 N and a steep start
    smooth = (figure.tension > 40.0) & (figure.tension < 800.0)
    expected = figure.tangent / 0.5
    np.testing.assert_allclose(slope[smooth], expected[smooth], rtol=2e-3)
    np.testing.assert_allclose(presets.STRAND_1X19.rigidity(figure.tension), figure.tangent)


def test_fig3_stiffness_is_proportional_to_youngs_modulus(results: Results) -> None:
    (claim,) = claims(results, "fig3", "stiffness at 320 GPa")
    # exactly proportional but for active and gravity part, 3e-4 of the whole
    np.testing.assert_allclose(claim.computed, 2.0, rtol=2e-4)
    np.testing.assert_allclose(claim.along, 2.0, rtol=2e-4)


def test_fig3_passive_part_is_within_the_papers_gap(results: Results) -> None:
    low, high = claims(results, "fig3", "largest difference")
    assert low.computed[0] == pytest.approx(0.0278, abs=1e-4)
    assert high.computed[0] == pytest.approx(0.436, abs=1e-3)
    assert high.paper is not None
    assert high.computed[0] < high.paper[0]


def test_fig4_stiffness_falls_a_little_by_the_stretched_length_and_rises_by_the_original(
    results: Results,
) -> None:
    strand, wire = claims(results, "fig4", "change of stiffness")
    np.testing.assert_allclose(strand.computed, (-1.434, -1.226, -1.231), atol=1e-3)
    np.testing.assert_allclose(wire.computed, (-0.304, -0.260, -0.261), atol=1e-3)
    np.testing.assert_allclose(strand.original, (0.077, 0.291, 0.289), atol=1e-3)
    np.testing.assert_allclose(strand.along, (0.929, 0.752, 0.740), atol=1e-3)
    assert all(x > 0.0 for x in (*wire.original, *wire.along))


def test_lead_decides_whether_stiffness_falls_with_tension(results: Results) -> None:
    figure = results["lead"]
    assert isinstance(figure, paper.LeadFigure)
    # without a lead as Fig. 4; K_R keeps 60 % of its fall with 0.1 m of lead, 80 % with 0.3 m
    strand, _ = claims(results, "fig4", "change of stiffness")
    np.testing.assert_allclose(figure.original[0, 0], strand.original, rtol=1e-9)
    np.testing.assert_allclose(figure.stretched[0, 0], strand.computed, rtol=1e-9)
    share = figure.original[:, 0, 0] / figure.stretched[:, 0, 0]
    assert np.interp(0.1, figure.leads, share) == pytest.approx(0.60, abs=0.01)
    assert share[-1] == pytest.approx(0.80, abs=0.01)
    assert (figure.stretched < 0.0).all()
    (claim,) = figure.claims
    assert claim.computed == (0.0, 0.0, 0.0)
    np.testing.assert_allclose(claim.original, (1.88, 6.47, 7.44), atol=0.01)
    np.testing.assert_allclose(claim.along, (277.0, 91.5, 93.2), atol=0.5)
    for length in ("stretched", "unstrained"):
        lead = float(figure.leads[-1])
        arm = presets.virtual_prototype(presets.ELASTIC_STAGE, lead=lead, original_length=length)
        pose = arm.at(np.full(10, presets.TEN_DEGREES))
        assert cdsm.stiffness(pose, cdsm.distribute_tension(pose, 800.0)).is_stable


def test_fig6_increments_are_within_two_percent_of_the_paper(results: Results) -> None:
    (claim,) = claims(results, "fig6", "increment")
    assert claim.paper == (4.24, 2.9, 4.57)
    np.testing.assert_allclose(claim.computed, claim.paper, rtol=0.02)
    assert claim.difference == pytest.approx(np.subtract(claim.computed, claim.paper))


def test_fig7_stiffness_falls_in_the_elastic_stage_by_the_stretched_length(
    results: Results,
) -> None:
    (claim,) = claims(results, "fig7", "change")
    np.testing.assert_allclose(claim.computed, (-1.21, -1.04, -1.04), atol=0.01)
    np.testing.assert_allclose(claim.original, (0.06, 0.24, 0.24), atol=0.01)
    (curve,) = of_arm(results, "fig7").curves
    assert curve.tension[-1, 2] == pytest.approx(paper.simulation.STRAND_END, abs=0.01)


def test_fig8_rises_and_then_falls_a_little_with_eq19_within_its_digits(results: Results) -> None:
    rises = claims(results, "fig8", "rise")
    assert len(rises) == 3
    assert all(x > 5.0 for claim in rises for x in claim.computed)
    ten, arc, s = claims(results, "fig8", "change at the end")
    np.testing.assert_allclose(ten.computed, (-0.60, -0.55, -0.52), atol=0.01)
    np.testing.assert_allclose(arc.computed, (-0.73, -0.16, -0.50), atol=0.01)
    np.testing.assert_allclose(s.computed, (-0.06, 0.25, 0.11), atol=0.01)
    assert all(x > 0.0 for claim in (ten, arc, s) for x in claim.original + claim.along)


def test_original_length_stiffens_by_the_strain_and_changes_nothing_else(results: Results) -> None:
    """K of a locked wire is EA (1 + ε)/L instead of EA/L."""
    figure = of_arm(results, "fig6")
    paper_curve, original = figure.curves[0], figure.original[0]
    np.testing.assert_array_equal(paper_curve.tension, original.tension)
    stiffer = original.pseudoinverse / paper_curve.pseudoinverse - 1.0
    strain = presets.STRAND_1X19.strain(original.tension)
    assert (stiffer > strain[:, :1]).all()
    assert (stiffer < 1.05 * strain[:, 2:]).all()
    assert figure.curves[0].original_length == "stretched"
    assert figure.original[0].original_length == "unstrained"


def test_virtual_prototype_is_that_of_section_iv() -> None:
    arm = presets.virtual_prototype()
    assert (arm.nv, len(arm.cables)) == (10, 15)
    assert arm.geometry.hole_radius == 0.03
    places = [disk.x for disk in arm.geometry.disks]
    assert places == [0.01, *[0.01, 0.03] * 4, 0.01]  # every 20 mm along the straight arm
    np.testing.assert_array_equal(arm.gravity, (0.0, -9.81, 0.0))


def test_report_is_strict_json_and_a_table(results: Results) -> None:
    figures = [results[name] for name in paper.FIGURES]
    numbers = json.loads(json.dumps(paper.to_dict(figures), allow_nan=False))
    assert list(numbers) == list(paper.FIGURES)
    table = paper.to_markdown(figures).splitlines()
    count = sum(len(figure.claims) for figure in figures)
    rows = table[2 : 2 + count]
    assert all(line.startswith(("| Fig.", "| Table", "| Section")) for line in rows)
    assert len({line.count("|") for line in table[: count + 2]}) == 1
