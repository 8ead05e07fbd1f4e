"""Random loads come and go on arms with friction: does the tip stay in its band of rest?

``python -m tests.campaigns.histories 10000`` loads an arm of two hinges that often, and an arm of
five universal joints a tenth as often, with one to three pulls each, and counts the tips outside
the band of :func:`cdsm.rest_band`. It prints how far the farthest tip went in the band, and how far
an adversary gets, who chooses loads and motor commands step by step.
"""

import sys
import time

import numpy as np

import cdsm
from cdsm import presets
from cdsm.support.progress import track

WIRE = cdsm.LinearElasticity(48e3)


def two_hinges(mu: float) -> tuple[cdsm.Posture, cdsm.Tension]:
    """Two hinges about y at 15°, 50 N."""
    geometry = cdsm.Geometry.hinged(
        joints=2,
        twist=0.0,
        cables_per_joint=2,
        link_length=0.06,
        base_length=0.02,
        disk_offset=0.012,
        hole_radius=0.025,
        link_mass=0.0,
        lead=0.3,
        spread=0.02,
        friction=mu,
    )
    arm = cdsm.Manipulator(geometry, WIRE, gravity=(0.0, 0.0, 0.0))
    pose = arm.at(np.deg2rad([15.0, 15.0]))
    return pose, cdsm.distribute_tension(pose, 50.0)


def prototype(mu: float) -> tuple[cdsm.Posture, cdsm.Tension]:
    """The paper's virtual prototype at 10°, 50 N, with leads of 0.3 m."""
    arm = presets.virtual_prototype(WIRE, lead=0.3, friction=mu)
    pose = arm.at(np.full(arm.nv, presets.TEN_DEGREES))
    return pose, cdsm.distribute_tension(pose, 50.0)


def farthest(
    pose: cdsm.Posture, pull: cdsm.Tension, largest: float, count: int, seed: int = 0
) -> tuple[int, float]:
    """Load an arm with random pulls ``count`` times; return the tips outside, the farthest part."""
    band, rng = cdsm.rest_band(pose, pull, "z"), np.random.default_rng(seed)
    outside, far = 0, 0.0
    for _ in track(range(count), "histories"):
        pulls = np.zeros((int(rng.integers(2, 5)), 6))  # the last one is none
        directions = rng.normal(size=(len(pulls) - 1, 3))
        directions[rng.random(len(directions)) < 0.5] *= (0.05, 0.05, 1.0)  # rather along z
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        pulls[:-1, :3] = directions * rng.uniform(0.05, 1.0, (len(directions), 1)) * largest
        rest = cdsm.load_cycle(pose, pull, pulls, accuracy=0.1).displacement[-1, 2]
        outside += not band.low - 1e-12 <= rest <= band.high + 1e-12
        far = max(far, rest / band.high, rest / band.low)
    return outside, far


def adversary(
    pose: cdsm.Posture, pull: cdsm.Tension, largest: float, count: int, seed: int = 0
) -> tuple[int, float]:
    """Search three loads and motor commands that leave the tip far off, ``count`` times."""
    band, rng, cables = (
        cdsm.rest_band(pose, pull, "z"),
        np.random.default_rng(seed),
        len(pull.values),
    )
    outside, far, best, step = 0, 0.0, np.zeros((3, 3 + cables)), 1.0
    scale = np.append(np.full(3, largest / 2.0), np.full(cables, 2e-4))
    for k in track(range(count), "adversary"):
        chosen = rng.random(best.shape) < (1.0 if k < count // 5 else 0.3)
        trial = rng.normal(size=best.shape) if k < count // 5 else best.copy()
        trial[chosen] += (k >= count // 5) * step * rng.normal(size=best.shape)[chosen]
        wrenches, motors = np.zeros((4, 6)), np.zeros((4, cables))
        wrenches[:3, :3], motors[:3] = (trial * scale)[:, :3], (trial * scale)[:, 3:]
        try:
            history = cdsm.load_cycle(pose, pull, wrenches, motors=motors, accuracy=0.1)
        except cdsm.CdsmError:  # too much for the arm
            continue
        rest = history.displacement[-1, 2]
        outside += not band.low - 1e-12 <= rest <= band.high + 1e-12
        reached = max(rest / band.high, rest / band.low)
        step = min(1.3 * step, 1.0) if reached > far else max(0.97 * step, 0.02)
        if reached > far:
            far, best = reached, trial
    return outside, far


def main(count: int) -> None:
    """Run the campaign."""
    for make, largest, share in ((two_hinges, 12.0, 1), (prototype, 60.0, 10)):
        for mu in (0.1, 0.2):
            start, pose_pull = time.perf_counter(), make(mu)
            outside, far = farthest(*pose_pull, largest, count // (2 * share))
            print(
                f"{make.__name__}, μ = {mu}: {count // (2 * share)} histories, {outside} outside, "
                f"the farthest at {100.0 * far:.1f} % of the band, "
                f"{time.perf_counter() - start:.0f} s",
                flush=True,
            )
            outside, far = adversary(*pose_pull, largest, max(count // 20, 100))
            print(
                f"    searched: {outside} outside, the farthest at {100.0 * far:.1f} %", flush=True
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
