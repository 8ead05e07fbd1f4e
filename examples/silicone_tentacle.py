"""A measured silicone tentacle: a cone as a backbone that tapers, bent by one of two tendons."""

import sys
from pathlib import Path

import numpy as np

import cdsm

MEASURED = {
    3.0769: (53.4, 113.8, -317.5),
    4.6154: (75.9, 149.9, -244.3),
    6.1538: (79.6, 150.3, -167.4),
}
"""Marker 8 mm beyond the tip [mm], z up, by the tension [N]; the preset has the source."""


def main(folder: Path) -> None:
    """Print the marker at each tension; E and the density are fitted, see Validation."""
    arm = cdsm.presets.silicone_tentacle(youngs_modulus=404e3, density=1050.0)
    print("tension [N]     measured x, y, z [mm]         cdsm [mm]   apart [mm]")
    cases = []
    for tension, measured in MEASURED.items():
        rest = cdsm.forward_statics(arm, tension=[tension, 0.0])
        x, y, z = 1e3 * (rest.pose.tip @ [0.008, 0.0, 0.0, 1.0])[:3]
        marker = np.array([z, y, -x])
        cells = "".join(f"{each:8.1f}" for each in (*measured, *marker))
        print(f"{tension:11.2f}{cells}{np.linalg.norm(marker - measured):10.1f}")
        cases.append((rest, None, None, f"{tension:.1f} N"))
    panels = cdsm.plots.plot_arms([cases[0], cases[-1]], warnings=False)
    cdsm.plots.save_figure(panels, folder / "silicone_tentacle.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if sys.argv[1:] else Path(__file__).parent)
