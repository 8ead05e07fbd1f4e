"""An arm whose links roll on each other: tension straightens it, where it softens others."""

import sys
from pathlib import Path

import numpy as np

import cdsm


def main(folder: Path) -> None:
    """Print the active term and the stiffness of the tip over the least tension."""
    arm = cdsm.Manipulator.read(Path(__file__).with_name("rolling_arm.toml"))
    pose = arm.at(np.deg2rad([8.0] * arm.nv))
    print("least tension [N]   along y [N/mm]   active term, whole term of joint 1 [N m/rad]")
    for minimum in (5.0, 20.0, 50.0):
        tension = cdsm.distribute_tension(pose, minimum)
        K = cdsm.stiffness(pose, tension)
        first = K.active[0, 0], K.joint[0, 0]
        print(f"{minimum:17g}{K.along('y') / 1e3:17.3f}{first[0]:14.3f}{first[1]:12.3f}")
    ax = cdsm.plots.plot_arm(pose, tension, K, title="links that roll, all joints at 8°")
    cdsm.plots.save_figure(ax, folder / "rolling_arm.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if sys.argv[1:] else Path(__file__).parent)
