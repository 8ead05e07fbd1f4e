"""Do the intervals of identified dimensions, springs, friction and rigidity hold the truth?

``python -m tests.campaigns.identified FILE [--experiments 500]`` simulates so many experiments:
three loops of weight tests on an arm of two hinges, with readings of a standard
deviation of 5 µm. The weights bend the arm until cables go slack. Six parameters are identified
from each experiment. The table says how often the 95 % interval of each parameter holds its true
value. FILE takes one line per experiment; run again, it is continued.
"""

import argparse
import json
import math
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

import cdsm
from cdsm.identification import WeightLoop
from cdsm.support.directions import Axis
from cdsm.support.progress import track
from tests.support.coverage import Experiment

TRUE = {
    "friction": 0.1,
    "rigidity": 1.0,
    "spring": 1e5,
    "hole_radius@1": 0.025,
    "hole_radius@2": 0.02,
    "disk_offset": 0.015,
}
"""Standard deviations from one experiment: 2.0, 1.3, 1.3, 0.4, 0.3 and 0.7 %."""

FREE = {
    "friction": (0.0, 0.5),
    "rigidity": (0.3, 3.0),
    "spring": (2e4, 1e6),
    "hole_radius@1": (0.015, 0.04),
    "hole_radius@2": (0.01, 0.035),
    "disk_offset": (0.008, 0.03),
}

GEOMETRY = cdsm.Geometry.hinged(
    joints=2,
    twist=math.pi / 2.0,
    link_length=0.2,
    base_length=0.02,
    disk_offset=0.015,
    hole_radius=[0.025, 0.02],
    link_mass=0.05,
    lead=[0.1, 0.6],
)
"""Cables of different lengths, which tell rigidity from springs."""

ARM = cdsm.ArmParameters(cdsm.Manipulator(GEOMETRY, cdsm.LinearElasticity(48e3)), tuple(TRUE))

TESTS: list[tuple[tuple[float, float], Axis]] = [
    ((0.3, 0.3), "-z"),
    ((-0.3, 0.35), "-z"),
    ((-0.3, 0.35), "y"),
]

PLANNED = [
    WeightLoop(
        direction=direction,
        angles=angles,
        forces=(0.0, 15.0, 30.0, 15.0, 0.0),
        minimum=150.0,
        displacement_std=5e-6,
    )
    for angles, direction in TESTS
]


def main() -> None:
    """Run the experiments that the file lacks, and print the table of all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--experiments", type=int, default=500)
    given = parser.parse_args()
    given.file.touch()
    done = [json.loads(line) for line in given.file.read_text().splitlines()]
    experiment = Experiment(ARM, PLANNED, TRUE, FREE)
    with given.file.open("a") as file:
        for seed in track(range(len(done), given.experiments), "experiments"):
            done.append(experiment.held(np.random.default_rng([seed, 21])))
            file.write(json.dumps(done[-1]) + "\n")
            file.flush()
    print(f"{'95 % interval of':<18}{'holds':>13}{'share':>9}{'95 % of the share':>21}")
    for name in TRUE:
        count = sum(row[name] for row in done)
        low, high = binomtest(count, len(done)).proportion_ci(method="wilson")
        share = 100.0 * count / len(done)
        ends = f"{100.0 * low:.1f} to {100.0 * high:.1f} %"
        print(f"{name:<18}{count:>5} of {len(done):<4}{share:>7.1f} %{ends:>21}")


if __name__ == "__main__":
    main()
