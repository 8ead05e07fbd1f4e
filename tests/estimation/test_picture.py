"""The picture of estimated loads shows their numbers."""

import numpy as np
import pytest

import cdsm
from tests.estimation.test_loads import TIP, held, readme
from tests.support.pictures import artists, line, require_look, rows


def test_loads_are_drawn_with_both_uncertainties() -> None:
    pose = readme(0.1)
    found = cdsm.estimate_load(
        pose, held(pose, [*TIP, 0.1, -0.05, 0.02]), {"tool0": "wrench"}, tension_std=0.5
    )
    axs = found.plot()
    for i, name in enumerate(found.names):
        ax = axs[i // 3]
        assert line(ax, f"load:{name}")[0, 0] == pytest.approx(found.loads[i])
        assert np.ptp(line(ax, f"instruments:{name}")[:, 0]) == pytest.approx(3.92 * found.std[i])
        reach = 2.0 * (1.96 * found.std[i] + found.band[i])
        assert np.ptp(line(ax, f"friction:{name}")[:, 0]) == pytest.approx(reach)
    assert [name for ax in axs for name in rows(ax)] == [*found.names]
    legend = axs[-1].get_legend()
    widths = {text.get_text(): key.get_linewidth() for text, key in zip(
        legend.get_texts(), legend.get_lines(), strict=True)}  # fmt: skip
    drawn = [artists(axs[0], start)[f"{start}{found.names[0]}"].get_linewidth() for start in (
        "instruments:", "friction:")]  # fmt: skip
    said = ("load cells, angles: ± 1.96 std", "and what friction hides")
    assert widths == dict(zip(said, drawn, strict=True))
    assert [ax.get_xlabel().partition(",")[0] for ax in axs] == ["force [N]", "moment [N m]"]
    require_look(axs)


def test_what_is_not_told_has_no_point() -> None:
    pose = readme()
    F = held(pose, [*TIP, 0, 0, 0])
    found = cdsm.estimate_load(pose, F, {"tool0": "force", "link2": "force"}, tension_std=0.5)
    (ax,) = found.plot()
    assert len(artists(ax, "load:")) == 3
    words = {gid: text.get_text() for gid, text in artists(ax, "not told:").items()}
    assert words == {f"not told:f{axis} at link2": "not told by the readings" for axis in "xyz"}
    assert "friction" not in ax.get_legend().get_texts()[-1].get_text()
    require_look(np.array([ax]))
