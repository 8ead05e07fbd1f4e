"""Sweeps over many postures and cases, as labelled Datasets; here or on a cluster."""

from cdsm.sweep.export import read_sweep, write_sweep
from cdsm.sweep.poses import GridPoses, PathPoses, PoseSet, RandomPoses
from cdsm.sweep.quantities import SweepStatus
from cdsm.sweep.run import sweep

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
