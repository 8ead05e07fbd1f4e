"""Is a stuck arm ever softer than the same arm without friction?

``python -m tests.campaigns.order 100000`` draws that many different arms: hinged and universal,
linear wires and strands, springs in series, motors that hold their force, friction in some holes.
By Cauchy and Schwarz K_stuck − K is positive semidefinite for all of them. Prints the smallest
eigenvalue found, over the norm of K_stuck.
"""

import sys
import time

import numpy as np

import cdsm
from cdsm import presets
from cdsm.support.progress import track
from tests.support import arms
from tests.support.rough import rough

WIRE = cdsm.LinearElasticity(226e3)

ROUNDING = 1e-12
"""Least eigenvalue that is rounding, over the norm of K_stuck."""


def least(seed: int) -> float:
    """Smallest eigenvalue of K_stuck − K over the norm of K_stuck, of one random arm.

    Inf where the sizes drawn are those of no machine.
    """
    rng = np.random.default_rng([seed, 19])
    joints, kind = int(rng.integers(1, 6)), ("universal", "hinged")[seed % 2]
    spring = 10.0 ** rng.uniform(3.5, 6.0) if seed % 3 else np.inf
    try:
        plain = arms.random_arm(seed, joints, kind, (WIRE, presets.STRAND_1X19)[seed % 5 == 0])
    except cdsm.GeometryError:
        return np.inf
    mu = rng.uniform(-0.2, 0.5, (len(plain.cables), 20)).round(3).clip(0.0)
    control = "force" if seed % 7 == 0 else "position"
    arm = rough(plain, lambda c, i: float(mu[c, i]), series_stiffness=spring, control=control)
    pose = arm.at(rng.uniform(-0.9, 0.9, arm.nv) * arm.upper)
    F = rng.uniform(5.0, 300.0, len(arm.cables))
    stuck = cdsm.stuck_stiffness(pose, F).joint
    values = np.linalg.eigvalsh(stuck - cdsm.stiffness(pose, F).joint)
    return float(values[0] / np.linalg.norm(stuck, 2))


def main(count: int) -> None:
    """Run the campaign."""
    start, values = time.perf_counter(), np.empty(count)
    for seed in track(range(count), "arms"):
        values[seed] = least(seed)
        if (seed + 1) % 10_000 == 0 or seed + 1 == count:
            drawn = np.isfinite(values[: seed + 1])
            print(
                f"{drawn.sum()} arms, least eigenvalue {values[: seed + 1].min():.1e} of the norm "
                f"of K_stuck, {time.perf_counter() - start:.0f} s",
                flush=True,
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)
