"""Plot laws of wires and springs, and the measurements that they are fitted to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from cdsm.plots import style
from cdsm.plots.style import KN, MM, Panels

if TYPE_CHECKING:
    from cdsm.springs.fit import SpringFit
    from cdsm.wires.elasticity import Elasticity
    from cdsm.wires.tensile_fit import TensileFit


_BROAD = 0.25  # stages wider than this fraction of the whole range have horizontal names
_ENDLESS = 1000.0  # tension [N] up to which a law without a highest tension is drawn


@style.styled
def plot_tensile_fit(
    fit: TensileFit, axs: Panels | Sequence[Axes] | None = None, *, title: str | None = None
) -> Panels:
    """Plot force [N] against strain [%] with the fit; EA [kN] with its 95 % band and stages."""
    panels = style.panels(axs, 2, height=2.6)
    left, right = panels
    tension = fit.tension
    band = fit.band
    length = fit.test.gauge_length
    fitted = 100.0 * (fit.start / length + fit.elasticity.strain(tension))
    strain = 100.0 * fit.test.displacement / length
    left.plot(strain, fit.test.force, ".", color="0.6", label="test", gid="test")
    left.plot(fitted, tension, color=style.VERMILLION, label="fit", gid="fit")
    left.set(xlabel="strain [%]", ylabel="force [N]")
    ends = KN * band.low, KN * band.high
    look: dict[str, Any] = {"color": style.BLUE, "alpha": 0.3, "linewidth": 0}
    right.fill_between(tension, *ends, label="95 % band", gid="band", **look)
    right.plot(tension, KN * fit.rigidity, color=style.VERMILLION, label="EA", gid="rigidity")
    shade_stages(right, fit.stages)
    right.set(xlabel="tension [N]", ylabel="tangent rigidity EA [kN]")
    right.set_ylim(0.0, 1.1 * right.get_ylim()[1])  # room for the names of the stages
    for ax in panels:
        ax.legend()
    question = f"wire of {MM * length:.4g} mm: how stiff is it, from which tension?"
    style.set_heading(panels, axs, title, question)
    return panels


@style.styled
def plot_spring_fit(
    fit: SpringFit, axs: Panels | Sequence[Axes] | None = None, *, title: str | None = None
) -> Panels:
    """Plot torque [N m] against angle [°] with the law; the tangent [N m/rad] and what is not told.

    Below the first point the tangent depends on the scale, which was given: a band is between half
    of it and twice.

    Example:
        >>> import cdsm
        >>> fit = cdsm.fit_spring(*cdsm.read_spring_csv("examples/data/SPRING.csv"))
        >>> left, right = cdsm.plots.plot_spring_fit(fit)
        >>> right.get_ylabel()
        'tangent [N m/rad]'
    """
    panels = style.panels(axs, 2, height=2.6)
    left, right = panels
    x = fit.angle
    ends = min(0.0, float(x[0])), max(0.0, float(x[-1]))
    grid = np.linspace(*ends, 300)
    left.plot(np.rad2deg(x), fit.torque, "o", color="0.5", label="points", gid="points")
    left.plot(
        np.rad2deg(grid), fit.law.shape.torque(grid), color=style.VERMILLION, label="law", gid="law"
    )
    secant = float(x @ fit.torque / (x @ x))
    line: dict[str, Any] = {"color": style.BLUE, "linestyle": "--", "linewidth": 0.9}
    left.plot(np.rad2deg(ends), secant * np.array(ends), label="linear", gid="linear", **line)
    left.set(xlabel="angle from rest [°]", ylabel="torque [N m]")
    others = [law.shape.stiffness(grid) for law in fit.others]
    look: dict[str, Any] = {"color": style.BLUE, "alpha": 0.3, "linewidth": 0}
    right.fill_between(np.rad2deg(grid), *others, label="scale halved, doubled", gid="band", **look)
    tangent = fit.law.shape.stiffness(grid)
    right.plot(np.rad2deg(grid), tangent, color=style.VERMILLION, label="law", gid="tangent")
    for beside in (x[x < 0.0][-1:], x[x > 0.0][:1]):
        for angle in np.rad2deg(beside).tolist():
            right.axvline(angle, color="0.5", linestyle=":", gid="first point")
    right.set(xlabel="angle from rest [°]", ylabel="tangent [N m/rad]")
    style.from_zero(right, tangent, *others)
    for ax in panels:
        ax.legend()
    p = f"exponent {fit.exponent:.2f} ± {fit.exponent_std:.2f}"
    question = f"{p}; nearer to rest than the dotted line, no point tells the tangent"
    style.set_heading(panels, axs, title, question)
    return panels


def shade_stages(axes: Any, stages: Sequence[tuple[str, float, float]], along: str = "x") -> None:
    """Shade and name the ``stages`` (name, lowest, highest [N]) of a wire on the x- or y-axis."""
    look: dict[str, Any] = {"fontsize": "small", "color": "0.3"}
    whole = stages[-1][2] - stages[0][1]
    for (name, low, high), shade in zip(stages, cycle(("0.93", "0.98", "0.88")), strict=False):
        middle = (low + high) / 2.0
        if along == "x":
            axes.axvspan(low, high, color=shade, zorder=0, linewidth=0, gid=f"stage:{name}")
            look["rotation"] = 90.0 if high - low < _BROAD * whole else 0.0
            where = axes.get_xaxis_transform()
            axes.text(middle, 0.98, name, transform=where, ha="center", va="top", **look)
        else:
            axes.axhspan(low, high, color=shade, zorder=0, linewidth=0, gid=f"stage:{name}")
            where = axes.get_yaxis_transform()
            axes.text(0.02, middle, name.replace("\n", " "), transform=where, va="center", **look)


@style.styled
def plot_elasticity(law: Elasticity, ax: Axes | None = None, *, title: str | None = None) -> Axes:
    """Plot tangent and secant rigidity [kN] against the tension [N]: up to 1000 N if endless."""
    tension = np.linspace(law.low, law.high if math.isfinite(law.high) else _ENDLESS, 400)
    axes = style.panel(ax, 2.3)
    tangent, secant = KN * law.rigidity(tension), KN * law.secant_rigidity(tension)
    axes.plot(tension, tangent, color=style.BLUE, label="tangent, dF/dε", gid="tangent")
    axes.plot(tension, secant, "--", color=style.VERMILLION, label="secant", gid="secant")
    axes.set(xlabel="tension [N]", ylabel="rigidity EA [kN]")
    style.from_zero(axes, tangent, secant)
    axes.legend()
    style.set_title(axes, title, "wire: how does its rigidity grow?")
    return axes
