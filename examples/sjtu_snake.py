"""The snake of Shanghai Jiao Tong University: 24 joints, 36 cables, bent into an S."""

import sys
from pathlib import Path

import numpy as np

import cdsm


def main(folder: Path) -> None:
    """Print what more tension costs and gives: largest tension, stiffness, lowest frequency."""
    snake = cdsm.presets.sjtu_snake()
    q = np.zeros((12, 2))
    q[:6, 1], q[6:, 1], q[:, 0] = 0.1, -0.1, 0.05
    pose = snake.at(q.ravel())
    print("least tension [N]   largest [N]   along y, z [N/mm]   lowest mode [Hz]")
    for minimum in (10.0, 30.0, 100.0):
        tension = cdsm.distribute_tension(pose, minimum)
        K = cdsm.stiffness(pose, tension)
        lowest = cdsm.modes(K).frequencies[0]
        along = "".join(f"{K.along(u) / 1e3:9.3f}" for u in "yz")
        print(f"{minimum:17g}{tension.values.max():14.0f}{along}{lowest:17.2f}")
    ax = cdsm.plots.plot_arm(pose, tension, K)
    cdsm.plots.save_figure(ax, folder / "sjtu_snake.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if sys.argv[1:] else Path(__file__).parent)
