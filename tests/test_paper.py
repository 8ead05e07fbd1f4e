"""The paper's simulation study (Section IV), recomputed, and the report of all figures."""

import json

import numpy as np
import pytest

from cdsm import paper, presets
from tests.conftest import Results


def claims(results: Results, name: str, quantity: str) -> list[paper.Claim]:
    found = [claim for claim in results[name].claims if claim.quantity.startswith(quantity)]
    assert found
    return found


def of_arm(results: Results, name: str) -> paper.Figure:
    figure = results[name]
    assert isinstance(figure, paper.Figure)
    return figure


def test_fig5_branches_meet_only_if_eq19_is_repaired(results: Results) -> None:
    repaired, printed, rise = results["fig5"].claims
    assert repaired.computed[0] == pytest.approx(0.9575, abs=1e-4)
    assert printed.computed[0] == pytest.approx(-69.4, abs=0.1)
    assert rise.computed[0] == pytest.approx(13.7, abs=0.1)


def test_fig5_curve_integrates_eq19(results: Results) -> None:
    figure = results["fig5"]
    assert isinstance(figure, paper.StrandFigure)
    slope = np.gradient(figure.tension, figure.displacement)
    # differences of a curve with a jump at 31 N and a steep start
    smooth = (figure.tension > 40.0) & (figure.tension < 800.0)
    expected = figure.tangent / figure.gauge_length
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


def test_fig4_stiffness_falls_a_little_with_tension_if_ea_is_constant(results: Results) -> None:
    strand, wire = claims(results, "fig4", "change of stiffness")
    np.testing.assert_allclose(strand.computed, (-1.434, -1.226, -1.231), atol=1e-3)
    assert all(x < 0.0 for x in (*strand.along, *wire.computed, *wire.along))


def test_fig4_active_part_falls_in_proportion_to_tension(results: Results) -> None:
    (curve,) = of_arm(results, "fig4").curves
    # not exactly: gravity's share of the tensions does not grow with the bound
    growth = curve.pseudoinverse_part[-1] / curve.pseudoinverse_part[0]
    assert np.all(curve.pseudoinverse_part < 0.0)
    np.testing.assert_allclose(growth, 800.0 / 100.0, rtol=0.05)


def test_fig6_increments_are_within_two_percent_of_the_paper(results: Results) -> None:
    (claim,) = claims(results, "fig6", "increment")
    assert claim.paper == (4.24, 2.9, 4.57)
    np.testing.assert_allclose(claim.computed, claim.paper, rtol=0.02)
    assert claim.difference == pytest.approx(np.subtract(claim.computed, claim.paper))


def test_fig7_stiffness_falls_in_the_elastic_stage(results: Results) -> None:
    (claim,) = claims(results, "fig7", "change")
    np.testing.assert_allclose(claim.computed, (-1.21, -1.04, -1.04), atol=0.01)
    (curve,) = of_arm(results, "fig7").curves
    assert curve.tension[-1, 2] == pytest.approx(paper.figures.STRAND_END, abs=0.01)


def test_fig8_rise_holds_but_the_fall_needs_constant_ea(results: Results) -> None:
    rises = claims(results, "fig8", "rise")
    assert len(rises) == 3
    assert all(x > 5.0 for claim in rises for x in claim.computed)
    ends = claims(results, "fig8", "change at the end")
    eq19 = [claim for claim in ends if "Eq. 19" in claim.assumption]
    constant = [claim for claim in ends if "EA constant" in claim.assumption]
    assert len(eq19) == len(constant) == 3
    assert all(x > 0.0 for claim in eq19 for x in claim.computed + claim.along)
    assert all(x < 0.0 for claim in constant for x in claim.computed + claim.along)


def test_paper_reading_overestimates_a_hung_weight_everywhere(results: Results) -> None:
    for name in ("fig3", "fig4", "fig6", "fig7", "fig8"):
        for curve in of_arm(results, name).curves:
            assert np.all(curve.pseudoinverse > curve.along)


def test_virtual_prototype_is_that_of_section_iv() -> None:
    arm = presets.virtual_prototype()
    assert (arm.nv, len(arm.cables)) == (10, 15)
    assert arm.geometry.hole_radius == 0.03
    places = [x for _, disks in arm.geometry.disks for x in disks]
    assert places == [0.01, *[0.01, 0.03] * 4, 0.01]  # every 20 mm along the straight arm
    np.testing.assert_array_equal(arm.gravity, (0.0, -9.81, 0.0))


def test_report_is_strict_json_and_a_table(results: Results) -> None:
    figures = list(results.values())
    numbers = json.loads(json.dumps(paper.to_dict(figures), allow_nan=False))
    assert list(numbers) == list(paper.FIGURES)
    table = paper.to_markdown(figures).splitlines()
    count = sum(len(figure.claims) for figure in figures)
    rows = table[2 : 2 + count]
    assert all(line.startswith(("| Fig.", "| Table", "| Section")) for line in rows)
    assert len({line.count("|") for line in table[: count + 2]}) == 1
    parameters = [line for line in table if line.startswith("| link_length |")]
    assert parameters == ["| link_length | 0.03 | 0.03 | 0.15 | at a bound |"]
