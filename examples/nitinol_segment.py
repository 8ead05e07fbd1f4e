"""A Nitinol segment whose tip was read: slack of the tendons explains what it does."""

import sys
from pathlib import Path

import cdsm

MEASURED = {5.0: "233, 235, 233", 10.0: "171, 168, 169"}
"""Heights of the tip [mm] with each tendon in turn, by its pull [mm]; the preset has the source."""


def main(folder: Path) -> None:
    """Print the height of the tip for each pull, with the slack that fits best and without."""
    plain = cdsm.presets.nitinol_segment()
    slack = cdsm.ArmParameters(plain, ("slack",))(slack=1.02e-3)
    print("pull [mm]   measured [mm]   no slack   1.02 mm of slack   K along z [N/m]")
    cases = []
    for pull, heights in MEASURED.items():
        motors = {"cable10_1": 1e-3 * pull}
        rests = [cdsm.forward_statics(arm, pull=motors) for arm in (plain, slack)]
        tips = [1e3 * rest.pose.tip[0, 3] for rest in rests]
        K = rests[1].along("z")
        print(f"{pull:9g}{heights:>16}{tips[0]:11.1f}{tips[1]:19.1f}{K:18.2f}")
        cases.append((rests[1], None, None, f"pulled by {pull:g} mm"))
    panels = cdsm.plots.plot_arms(cases, view=(0.0, -90.0), warnings=False)
    cdsm.plots.save_figure(panels, folder / "nitinol_segment.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if sys.argv[1:] else Path(__file__).parent)
