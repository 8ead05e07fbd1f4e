"""The leg finger_edu of example-robot-data, driven by six cables that are chosen here."""

import sys
from pathlib import Path

import numpy as np
from example_robot_data.robots_loader import getModelPath

import cdsm

URDF = "finger_edu_description/robots/finger_edu.urdf"
ROUTES = [
    [("base", (x, y, 0.08)), ("middle", (0.6 * x, 0.6 * y, -0.12))]
    for x in (-0.05, 0.05)
    for y in (-0.06, 0.04)
] + [
    [("base", (x, -0.01, 0.08)), ("middle", (x, -0.01, -0.12)), ("lower", (x / 2, 0.0, -0.1))]
    for x in (-0.05, 0.05)
]


def main(folder: Path) -> None:
    """Print the stiffness of the foot at three bends of the knee."""
    cables = [
        cdsm.Cable(f"cable{i}", [cdsm.Site(f"finger_{link}_link", at) for link, at in route],
                   cdsm.LinearElasticity(48e3), lead=0.3)
        for i, route in enumerate(ROUTES, start=1)
    ]  # fmt: skip
    leg = cdsm.Manipulator.from_urdf(f"{getModelPath(URDF)}/{URDF}", cables, tip="finger_tip_link")
    print("knee [°]   foot along x, y, z [N/mm]   largest tension [N]")
    cases = []
    for knee in (-20.0, -40.0, -60.0):
        pose = leg.at(np.deg2rad([10.0, 20.0, knee]))
        tension = cdsm.distribute_tension(pose, minimum=20.0)
        K = cdsm.stiffness(pose, tension)
        along = "".join(f"{K.along(u) / 1e3:9.2f}" for u in "xyz")
        print(f"{knee:8.0f}{along}{tension.values.max():21.0f}")
        cases.append((pose, tension, K, f"knee at {knee:g}°"))
    panels = cdsm.plots.plot_arms([cases[0], cases[-1]])
    cdsm.plots.save_figure(panels, folder / "finger_edu.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if sys.argv[1:] else Path(__file__).parent)
