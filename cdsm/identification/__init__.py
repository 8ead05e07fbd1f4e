"""Parameters of an arm from what is measured on it, and which tests to make."""

from cdsm.identification.experiment_plan import ExperimentPlan, plan_experiment
from cdsm.identification.explanations import Explanations, compare_explanations
from cdsm.identification.identify import identify
from cdsm.identification.loops_file import read_loops
from cdsm.identification.measurement import Measurement
from cdsm.identification.result import Identification
from cdsm.identification.tip_position import TipPosition
from cdsm.identification.tips_file import read_tip_positions
from cdsm.identification.weight_loop import WeightLoop

__all__ = [
    "ExperimentPlan",
    "Explanations",
    "Identification",
    "Measurement",
    "TipPosition",
    "WeightLoop",
    "compare_explanations",
    "identify",
    "plan_experiment",
    "read_loops",
    "read_tip_positions",
]
