"""Draw the pictures of README and of the pages that show results: ``python -m docs.pictures``.

The arm is that of README. Written to ``docs/pictures``; committed, since README shows them.
"""

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image
from scipy.optimize import brentq

import cdsm
from cdsm import paper, plots
from tests.validation import rod

FOLDER = Path(__file__).parent / "pictures"
FRAMES = 36
COLORS = 48
"""Number of frames and colours of the animation."""
BEST = 80.7, 0.0946
"""E [GPa] and μ that fit the shapes of the measured rod best, as on the page on validation."""
BENT = np.deg2rad([10, 5, 10, 5, -8, 0, -8, 0])

geometry = cdsm.Geometry.universal(
    joints=4, cables_per_joint=3, link_length=0.06, base_length=0.03, disk_offset=0.012,
    hole_radius=0.025, link_mass=0.12, lead=0.3, name="serpentine",
)  # fmt: skip
arm = cdsm.Manipulator(geometry, elasticity=cdsm.presets.STRAND_1X19)


def still() -> None:
    """Draw README's arm at README's posture, with tensions and compliance."""
    pose = arm.at(BENT)
    tension = cdsm.distribute_tension(pose, minimum=50.0)
    plots.save_figure(cdsm.stiffness(pose, tension).plot(), FOLDER / "arm.png")


def animation() -> None:
    """Draw the arm on its way round; its cables keep it equally stiff along z at each posture."""
    turn = np.linspace(0.0, 2.0 * np.pi, FRAMES + 1)[:-1]
    bend = np.deg2rad(14.0) * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    q = np.hstack([bend, bend, 0.6 * bend, 0.6 * bend])
    plan = cdsm.plan_path(arm, "z", 4e3, minimum=20.0, maximum=400.0, angles=q)
    assert plan.complete
    limits = plan.tensions.min(), plan.tensions.max()
    figure = Figure(figsize=(3.5, 2.4), dpi=130, layout="constrained")
    ax = figure.subplots()
    canvas: Any = FigureCanvasAgg(figure)
    frames = []
    for K, along in zip(plan.stiffness, plan.achieved, strict=True):
        ax.clear()
        F = K.tension
        words = f"{along.item() / 1e3:.2f} N/mm along z, {F.min():.0f} to {F.max():.0f} N"
        plots.plot_arm(K.posture, F, ax=ax, limits=limits, triad=False, title=words)
        ax.set(xlim=(-30.0, 280.0), ylim=(-165.0, 90.0))
        canvas.draw()
        frames.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
    palette = frames[0].quantize(COLORS, Image.Quantize.MAXCOVERAGE)
    flat = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    flat[0].save(FOLDER / "bend.gif", save_all=True, append_images=flat[1:], duration=107, loop=0)


def measured() -> None:
    """Draw the measured rod: its shapes, and E by the direction of its end at each tension."""
    figure = Figure(figsize=(7.0, 3.0), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=[1.0, 1.2])
    shapes = rod.shapes_in_plane()
    for k in range(1, len(shapes)):
        computed = rod.in_plane(rod.predicted(*BEST))[k]
        left.plot(computed[:, 1], -computed[:, 0], color="C0", label="cdsm" if k == 1 else None)
        dots = {"color": "0.1", "label": "measured" if k == 1 else None}
        left.plot(shapes[k, :, 1], -shapes[k, :, 0], ".", **dots)
    left.set(aspect="equal", xlabel="across [mm]", ylabel="along [mm]")
    left.legend(loc="lower right")
    for mu, mark in ((0.0, "s"), (BEST[1], "o")):
        moduli = [modulus_of_end(mu, k) for k in range(1, len(shapes))]
        right.plot(rod.TENSIONS[1:], moduli, f"{mark}-", label=f"friction μ = {mu:.2g}")
    right.set(xlabel="tension [N]", ylabel="E that the end's direction asks for [GPa]")
    right.legend()
    plots.save_figure(figure, FOLDER / "measured.png")


def modulus_of_end(mu: float, k: int) -> float:
    """Find E [GPa] with which the last three gaps point as measured at tension k."""

    def off(E: float) -> float:
        ways = [shape[-1] - shape[-4] for shape in (rod.shapes_in_plane()[k], at(E))]
        directions = [np.arctan2(way[1], way[0]) for way in ways]
        return float(directions[1] - directions[0])

    def at(E: float) -> Any:
        bent = cdsm.presets.rod_one_tendon(1e9 * E, mu)
        rest = cdsm.forward_statics(bent, tension=[rod.TENSIONS[k]])
        return rod.in_plane(rod.disk_centres(rest.pose))

    return float(brentq(off, 62.0, 110.0, xtol=0.05))


def contributions() -> None:
    """Draw the terms of the stiffness over the tension, of strand alone and with soft springs."""
    soft = cdsm.serpentine_cables(geometry, cdsm.presets.STRAND_1X19, series_stiffness=6e3)
    cases = (
        ("strand", arm, np.linspace(10.0, 150.0, 60)),
        ("strand and a spring of 6 N/mm", cdsm.Manipulator(geometry, cables=soft),
         np.linspace(4.0, 24.0, 80)),
    )  # fmt: skip
    figure = Figure(figsize=(181 / 25.4, 2.5))
    for ax, (words, one, levels) in zip(figure.subplots(1, 2), cases, strict=True):
        plots.plot_stiffness_over_tension(one.at(BENT), levels, "z", ax, title=words)
    plots.save_figure(figure, FOLDER / "contributions.svg")


def weights() -> None:
    """Draw which stiffness a weight measures where the holes have friction."""
    pose = arm.with_friction(0.1).at(BENT)
    tension = cdsm.distribute_tension(pose, minimum=50.0)
    loads = np.geomspace(0.02, 20.0, 25)
    values = [
        cdsm.weight_test(pose, tension, [0.0, 0.0, -load], steps=3).stiffness for load in loads
    ]
    stuck = cdsm.stuck_stiffness(pose, tension).along("z")
    ax = Figure(figsize=(88 / 25.4, 2.4)).subplots()
    ax.plot(loads, 1e-3 * np.array(values), label="measured")
    ax.axhline(1e-3 * stuck, color="0.2", ls=":", label="stuck")
    ax.axhline(1e-3 * cdsm.stiffness(pose, tension).along("z"), color="0.2", ls="--")
    ax.plot([], [], color="0.2", ls="--", label="frictionless")
    ax.set(xscale="log", ylim=(0.0, None), xlabel="weight [N]")
    ax.set_ylabel("weight over displacement [N/mm]")
    ax.set_xticks([0.02, 0.1, 0.5, 2.0, 10.0], ["0.02", "0.1", "0.5", "2", "10"])
    ax.minorticks_off()
    ax.legend()
    plots.save_figure(ax, FOLDER / "weights.svg")


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    plt.style.use(plots.STYLE)
    measured()
    still()
    animation()
    contributions()
    weights()
    plots.save_figure(paper.FIGURES["lead"]().plot(), FOLDER / "lead.svg")
