"""Identification of the parameters of an arm from measured stiffnesses and loading loops."""

from cdsm.identification.arm_parameters import ArmParameters
from cdsm.identification.experiment import plan_experiment
from cdsm.identification.experiment_plan import ExperimentPlan
from cdsm.identification.intervals import Profile
from cdsm.identification.loop import WeightLoop
from cdsm.identification.loops_file import read_loops
from cdsm.identification.measurement import Measurement
from cdsm.identification.result import Identification
from cdsm.identification.search import identify

__all__ = [
    "ArmParameters",
    "ExperimentPlan",
    "Identification",
    "Measurement",
    "Profile",
    "WeightLoop",
    "identify",
    "plan_experiment",
    "read_loops",
]
