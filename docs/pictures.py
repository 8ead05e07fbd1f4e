"""Draw the pictures of README and of the first page: ``python docs/pictures.py``.

The arm is that of README. Written to ``docs/pictures``; committed, since README shows them.
"""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

import cdsm
from cdsm import plots

FOLDER = Path(__file__).parent / "pictures"
FRAMES = 36
COLORS = 48
"""Number of frames and colours of the animation."""

geometry = cdsm.Geometry.universal(
    joints=4, cables_per_joint=3, link_length=0.06, base_length=0.03, disk_offset=0.012,
    hole_radius=0.025, link_mass=0.12, lead=0.3, name="serpentine",
)  # fmt: skip
arm = cdsm.Manipulator(geometry, elasticity=cdsm.presets.STRAND_1X19)


def still() -> None:
    """Draw README's arm at README's posture, with tensions and compliance."""
    pose = arm.at(np.deg2rad([10, 5, 10, 5, -8, 0, -8, 0]))
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
    figure = Figure(figsize=(3.5, 2.6), dpi=130, layout="constrained")
    ax = figure.subplots()
    canvas: Any = FigureCanvasAgg(figure)
    frames = []
    for K, along in zip(plan.stiffness, plan.achieved, strict=True):
        ax.clear()
        F = K.tension
        words = f"{along.item() / 1e3:.2f} N/mm along z, {F.min():.0f} to {F.max():.0f} N"
        plots.plot_arm(K.posture, F, ax=ax, limits=limits, title=words)
        ax.set(xlim=(-20.0, 290.0), ylim=(-190.0, 90.0))
        canvas.draw()
        frames.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
    palette = frames[0].quantize(COLORS, Image.Quantize.MAXCOVERAGE)
    flat = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    flat[0].save(FOLDER / "bend.gif", save_all=True, append_images=flat[1:], duration=107, loop=0)


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    still()
    animation()
