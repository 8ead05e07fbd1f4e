"""Sweeps over many postures and cases, as labelled Datasets; on this machine or a cluster."""

from cdsm.sweeps.export import read_sweep, write_sweep
from cdsm.sweeps.poses import GridPoses, PathPoses, PoseSet, RandomPoses
from cdsm.sweeps.quantities import SweepStatus
from cdsm.sweeps.run import sweep

__all__ = [
    "GridPoses",
    "PathPoses",
    "PoseSet",
    "RandomPoses",
    "SweepStatus",
    "read_sweep",
    "sweep",
    "write_sweep",
]
