"""What threads and processes are given to do: an arm and a seed to the bytes of an answer."""

from collections.abc import Callable

import numpy as np

import cdsm
from tests.support.arms import random_posture, random_tension, random_wrench

Work = Callable[[cdsm.Manipulator, int], tuple[bytes, ...]]


def stiff(arm: cdsm.Manipulator, seed: int) -> tuple[bytes, ...]:
    """A posture and its stiffness, as bytes."""
    pose = random_posture(arm, seed)
    K = cdsm.stiffness(pose, random_tension(arm, seed), random_wrench(seed))
    arrays = (pose.tip, pose.jacobian, pose.length_jacobian, pose.gravity_torque)
    return tuple(each.tobytes() for each in (*arrays, K.joint, K.compliance, np.array(K.margin)))


def balanced(arm: cdsm.Manipulator, seed: int) -> tuple[bytes, ...]:
    pull = cdsm.distribute_tension(random_posture(arm, seed), 5.0, wrench=random_wrench(seed))
    return pull.values.tobytes(), pull.residual.tobytes()


def batched(arm: cdsm.Manipulator, seed: int) -> tuple[bytes, ...]:
    q = np.array([random_posture(arm, seed + i).q for i in range(5)])
    found = cdsm.evaluate(arm, q, outputs=("tip", "joint", "compliance"), minimum=5.0, threads=2)
    return tuple(each.tobytes() for each in found.values)


def rested(arm: cdsm.Manipulator, seed: int) -> tuple[bytes, ...]:
    pose = random_posture(arm, seed, reach=0.3)
    rest = cdsm.equilibrium(pose, cdsm.distribute_tension(pose, 20.0), 0.1 * random_wrench(seed))
    return rest.stiffness.joint.tobytes(), rest.residual.tobytes()


def solved(arm: cdsm.Manipulator, seed: int) -> tuple[bytes, ...]:
    found = cdsm.solve_joint_angles(arm, random_posture(arm, seed, reach=0.3).cable_lengths)
    return found.angles.tobytes(), found.posture.cable_lengths.tobytes()


def one_by_one(arm: cdsm.Manipulator, work: Work, seeds: range) -> list[tuple[bytes, ...]]:
    return [work(arm, seed) for seed in seeds]
