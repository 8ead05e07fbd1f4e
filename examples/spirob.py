"""A SpiRob: an arm of TPU that curls like a tentacle, whose flexures are no linear springs."""

import sys
from pathlib import Path

import numpy as np

import cdsm


def main(folder: Path) -> None:
    """Print how far it curls with measured laws, and with linear springs that fit at 25°."""
    arm = cdsm.presets.spirob()
    x = np.deg2rad(25.0)
    laws = arm.definition.springs or {}
    linear = arm.with_springs({name: float(law.torque(x) / x) for name, law in laws.items()})
    print("tension [N]   turn of the tip [°]   of linear springs [°]")
    cases = []
    for tension in (0.5, 1.0, 2.0, 3.0):
        rests = [cdsm.forward_statics(each, tension=[tension, 0.0]) for each in (arm, linear)]
        turns = [-np.rad2deg(rest.pose.q).sum() for rest in rests]
        print(f"{tension:11.1f}{turns[0]:22.1f}{turns[1]:24.1f}")
        cases.append((rests[0], None, None, f"{tension:g} N"))
    panels = cdsm.plots.plot_arms([cases[1], cases[-1]], view=(0.0, -90.0), warnings=False)
    cdsm.plots.save_figure(panels, folder / "spirob.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if sys.argv[1:] else Path(__file__).parent)
