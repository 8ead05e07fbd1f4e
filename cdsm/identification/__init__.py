"""Parameters of an arm from measured stiffnesses and load loops, and which tests to make."""

from cdsm.identification.experiment_plan import ExperimentPlan, plan_experiment
from cdsm.identification.identify import identify
from cdsm.identification.loops_file import read_loops
from cdsm.identification.measurement import Measurement, WeightLoop
from cdsm.identification.result import Identification

__all__ = [
    "ExperimentPlan",
    "Identification",
    "Measurement",
    "WeightLoop",
    "identify",
    "plan_experiment",
    "read_loops",
]
