"""Plot loads that sensors tell, with what they leave unknown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from cdsm.plots import style
from cdsm.plots.style import Panels
from cdsm.support.determination import INTERVAL

if TYPE_CHECKING:
    from cdsm.estimation import LoadEstimate

_ROW = 0.22  # height of a row [inch]
_FRAME = 0.75  # height of the rest of a panel [inch]
_INSTRUMENTS: Final[dict[str, Any]] = {"color": style.BLUE, "lw": 3.0}
_FRICTION: Final[dict[str, Any]] = {"color": style.SKY, "lw": 7.0, "alpha": 0.5}


@style.styled
def plot_load_estimate(
    estimate: LoadEstimate, axs: Panels | Axes | None = None, *, title: str | None = None
) -> Panels:
    """Plot each component of the loads, with its uncertainty and what friction hides.

    The dark bar is ± 1.96 standard uncertainties of the instruments; the light one goes on by the
    most that friction of unknown direction can hide. A component that the readings do not tell has
    no point. Forces [N] and moments [N m] have a panel each. Returns the panels.
    """
    units = np.array(estimate.components.units)
    shown = [unit for unit in ("N", "N m") if (units == unit).any()]
    rows = sum(int((units == unit).sum()) for unit in shown)
    panels = style.panels(
        axs,
        1,
        len(shown),
        height=len(shown) * _FRAME + _ROW * rows + 0.25,
        width=style.ONE_COLUMN,
        height_ratios=[int((units == unit).sum()) + 0.5 for unit in shown],
    )
    for panel, unit in zip(panels, shown, strict=True):
        _draw(panel, estimate, np.flatnonzero(units == unit))
        panel.set_xlabel(f"{'force' if unit == 'N' else 'moment'} [{unit}], base axes")
    handles = [Line2D([], [], label="load cells, angles: ± 1.96 std", **_INSTRUMENTS)]
    if estimate.band[estimate.told].any():
        handles.append(Line2D([], [], label="and what friction hides", **_FRICTION))
    anchor = (-0.28, -0.46 / style.height_of(panels[-1]))
    panels[-1].legend(handles=handles, loc="upper left", bbox_to_anchor=anchor, ncols=2)
    name = estimate.posture.arm.name
    style.set_title(panels[0], title, f"{name}: what do its load cells tell of the load?")
    return panels


def _draw(panel: Axes, estimate: LoadEstimate, chosen: Any) -> None:
    """Draw the ``chosen`` components in rows."""
    for row, i in enumerate(chosen.tolist()):
        name = estimate.names[i]
        if not estimate.told[i]:
            panel.text(
                0.99,
                row,
                "not told by the readings",
                transform=panel.get_yaxis_transform(),
                gid=f"not told:{name}",
                ha="right",
                va="center",
                fontsize=style.NOTE_SIZE,
                color=style.SOFT,
            )
            continue
        load = estimate.loads[i]
        half = INTERVAL * estimate.std[i]
        for gid, reach, look in (
            ("friction", half + estimate.band[i], _FRICTION),
            ("instruments", half, _INSTRUMENTS),
        ):
            if gid == "instruments" or estimate.band[i] > 0.0:
                ends = [load - reach, load + reach]
                panel.plot(ends, [row, row], gid=f"{gid}:{name}", solid_capstyle="butt", **look)
        panel.plot(load, row, "o", color=style.INK, ms=3.0, zorder=4, gid=f"load:{name}")
    panel.axvline(0.0, color="0.3", lw=0.6, zorder=0)
    names = [estimate.names[i] for i in chosen]
    panel.set_yticks(range(len(names)), names, parse_math=False)
    panel.set_ylim(len(names) - 0.4, -0.6)
    panel.grid(visible=False, axis="y")
