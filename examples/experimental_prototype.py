"""The prototype of the paper: motors hold a length and a tension in pairs; sizes are assumed."""

import sys
from pathlib import Path

import numpy as np

import cdsm


def main(folder: Path) -> None:
    """Print the stiffness over the tension that every second motor holds."""
    arm = cdsm.paper.experimental_prototype()
    pose = arm.at(np.deg2rad([-12.0, -18.0, -20.0]))
    print("held tension [N]   along x, y, z [N/mm]          deflection under 1 N along z [mm]")
    for level in (3.0, 24.0, 45.0, 86.0):
        held = {cable.name: level for cable in arm.cables if cable.control == "force"}
        K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum=2.3, fixed=held))
        along = "".join(f"{K.along(u) / 1e3:9.2f}" for u in "xyz")
        print(f"{level:16g}{along}{1e3 * K.compliance[2, 2]:26.3f}")
    ax = cdsm.plots.plot_arm(pose, K.tension, K)
    cdsm.plots.save_figure(ax, folder / "experimental_prototype.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if sys.argv[1:] else Path(__file__).parent)
