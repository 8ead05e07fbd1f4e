"""Stiffness and tension distribution at many postures at once, in compiled kernels."""

from cdsm.batch.distribution import Tensions, distribute_tensions
from cdsm.batch.evaluation import Batch, evaluate
from cdsm.status import Status

__all__ = ["Batch", "Status", "Tensions", "distribute_tensions", "evaluate"]
