"""A finger whose cables run over pulleys on its joints: what it holds, bent more and more."""

import sys
from pathlib import Path

import numpy as np

import cdsm


def main(folder: Path) -> None:
    """Print the stiffness of the fingertip and what it holds, over the bend of its joints."""
    finger = cdsm.Manipulator.read(Path(__file__).with_name("finger_with_pulleys.toml"))
    print("bend [°]   along x, y, z [N/mm]      holds downwards [N]   limit")
    cases = []
    for bend in (10.0, 30.0, 50.0):
        pose = finger.at([0.0, *np.deg2rad([bend] * 3)])
        tension = cdsm.distribute_tension(pose, maximum=100.0)
        K = cdsm.stiffness(pose, tension)
        held = cdsm.payload(pose, "-z", maximum=100.0).following
        along = "".join(f"{K.along(u) / 1e3:8.2f}" for u in "xyz")
        print(f"{bend:8.0f}{along}{held.force:20.1f}   {held.limit}")
        cases.append((pose, tension, K, f"bent by {bend:g}°"))
    panels = cdsm.plots.plot_arms([cases[0], cases[-1]], view=(10.0, -80.0))
    cdsm.plots.save_figure(panels, folder / "finger_with_pulleys.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if sys.argv[1:] else Path(__file__).parent)
