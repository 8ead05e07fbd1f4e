"""The virtual prototype of the paper: stiffness rises with tension, fast and then hardly."""

import sys
from pathlib import Path

import numpy as np

import cdsm


def main(folder: Path) -> None:
    """Print the stiffness over the least tension, all joints at 10°, and draw it."""
    arm = cdsm.presets.virtual_prototype()
    pose = arm.at(np.full(arm.nv, cdsm.presets.TEN_DEGREES))
    print("least tension [N]   along x, y, z [N/mm]         softest active, passive [N m/rad]")
    for minimum in (15.0, 50.0, 120.0, 400.0):
        K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum))
        along = "".join(f"{K.along(u) / 1e3:9.1f}" for u in "xyz")
        softest = [np.linalg.eigvalsh(term)[0] for term in (K.active, K.passive)]
        print(f"{minimum:17g}{along}{softest[0]:17.2f}{softest[1]:9.1f}")
    ax = cdsm.plots.plot_arm(pose, K.tension, K)
    cdsm.plots.save_figure(ax, folder / "virtual_prototype.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if sys.argv[1:] else Path(__file__).parent)
