"""A measured rod that one tendon bends: its tip with and without friction in its disks."""

import sys
from pathlib import Path

import numpy as np

import cdsm

MEASURED = {
    0.599: (268.1, 30.4),
    1.938: (243.7, 97.7),
    3.3122: (198.7, 151.1),
    5.2522: (101.0, 191.9),
}
"""Tip along and across the straight rod [mm], by the tension [N]; the preset has the source."""


def main(folder: Path) -> None:
    """Print the tip at each tension, and draw the rod; E and μ are fitted, see Validation."""
    rubbing = cdsm.presets.rod_one_tendon(youngs_modulus=80.7e9, friction=0.095)
    arms = rubbing, rubbing.with_friction(0.0)
    print("tension [N]   measured tip [mm]   with friction   without friction")
    cases = []
    for tension, tip in MEASURED.items():
        rests = [cdsm.forward_statics(arm, tension=[tension]) for arm in arms]
        tips = [tip, *(np.abs(1e3 * rest.pose.tip[:2, 3]) for rest in rests)]
        print(f"{tension:11.2f}" + "".join(f"{x:11.1f} {y:6.1f}" for x, y in tips))
        cases.append((rests[0], None, None, f"{tension:.2f} N"))
    panels = cdsm.plots.plot_arms([cases[0], cases[-1]], view=(90.0, -90.0), warnings=False)
    cdsm.plots.save_figure(panels, folder / "rod_one_tendon.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if sys.argv[1:] else Path(__file__).parent)
