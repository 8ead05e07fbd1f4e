"""Stiffness of cable-driven serpentine manipulators.

    geometry = cdsm.Geometry.universal(...)            # or read from TOML
    arm = cdsm.Manipulator(geometry, elasticity=...)   # URDF, rigid-body model, cables
    pose = arm.at(q)                                   # kinematics, cable lengths, gravity torque
    tension = cdsm.distribute_tension(pose, minimum=50.0)  # tensions that balance the load
    K = cdsm.stiffness(pose, tension)                  # joint and Cartesian stiffness

All units are SI. The x-axis of the base frame lies along the straight arm.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cdsm import control as control
    from cdsm import paper as paper
    from cdsm import plots as plots
    from cdsm import presets
    from cdsm import view as view
    from cdsm.arm_file.cables import read_cables, write_cables
    from cdsm.batch import Batch, Tensions, distribute_tensions, evaluate
    from cdsm.cable import Cable, Cables, Site, in_series
    from cdsm.control.mujoco_plant import MuJoCoPlant
    from cdsm.control.plant import SlowPlant
    from cdsm.control.run import TrackingRun
    from cdsm.control.sensors import Sensors
    from cdsm.control.tip_force import TipForce, tip_force
    from cdsm.control.track import track
    from cdsm.design.evaluation import Designs, evaluate_designs
    from cdsm.design.goals import Constraint, Objective
    from cdsm.design.problem import DesignProblem
    from cdsm.design.problem_file import read_problem
    from cdsm.design.refine import refine_design
    from cdsm.design.result import DesignProgress, DesignSearch
    from cdsm.design.search import search_designs
    from cdsm.design.variables import Variable
    from cdsm.elasticity import Domain, Elasticity, LinearElasticity
    from cdsm.errors import (
        CableError,
        CdsmError,
        CdsmWarning,
        ClusterError,
        ElasticityRangeError,
        EquilibriumError,
        FileError,
        GeometryError,
        InfeasibleDesign,
        InfeasibleTension,
        InvalidInput,
        JointLimitError,
        MissingExtra,
        MissingWire,
        SingularMass,
        SingularStiffness,
        SolverError,
        StoreError,
        TensileTestError,
        UnknownName,
        UnreachableStiffness,
        UrdfError,
    )
    from cdsm.friction.band import RestBand, rest_band
    from cdsm.friction.breakaway import Breakaway, breakaway
    from cdsm.friction.stuck import sliding_stiffness, stuck_stiffness
    from cdsm.geometry import CableRoute, Geometry, Joint, Link
    from cdsm.geometry.cables import serpentine_cables
    from cdsm.identification import (
        ArmParameters,
        ExperimentPlan,
        Identification,
        Measurement,
        WeightLoop,
        identify,
        plan_experiment,
        read_loops,
    )
    from cdsm.instability import Remedy
    from cdsm.interchange.caspr import read_caspr
    from cdsm.interchange.mjcf import to_mjcf, write_mjcf
    from cdsm.kinematics.maps import inverse_kinematics, solve_joint_angles
    from cdsm.kinematics.solutions import JointSolution, KinematicSolution
    from cdsm.manipulator import Manipulator
    from cdsm.measures.clearance import Clearance, clearance
    from cdsm.measures.closure import has_wrench_closure, isotropy, tension_factor
    from cdsm.measures.forces import ForcePolytope, force_polytope
    from cdsm.measures.payload import Payload, payload
    from cdsm.measures.wire_use import WireUse, wire_use
    from cdsm.planning.gradient import StiffnessGradient, stiffness_gradient
    from cdsm.planning.half_way import HalfWay
    from cdsm.planning.path import plan_path
    from cdsm.planning.path_plan import InfeasibleSample, PathPlan
    from cdsm.planning.plan import StiffnessPlan, plan_stiffness
    from cdsm.planning.range import StiffnessRange, stiffness_range
    from cdsm.planning.saturation_curve import Saturation
    from cdsm.planning.tension_growth import saturation
    from cdsm.posture import MomentArms, Posture
    from cdsm.report import Report, SelfCheck
    from cdsm.statics.bifurcation import Bifurcation, bifurcation
    from cdsm.statics.buckling import critical_load, critical_tension
    from cdsm.statics.buckling_results import CriticalLoad, CriticalTension
    from cdsm.statics.equilibrium import Equilibrium
    from cdsm.statics.load_cycle import load_cycle
    from cdsm.statics.load_history import LoadHistory
    from cdsm.statics.natural_modes import Modes, modes
    from cdsm.statics.rest_search import equilibrium
    from cdsm.statics.weight_test import LinearPrediction, WeightTest, weight_test
    from cdsm.stiffness_matrix import Shares, Stiffness, stiffness
    from cdsm.support.status import Status
    from cdsm.sweeps.export import read_sweep, sweep_to_pandas, write_sweep
    from cdsm.sweeps.poses import GridPoses, PathPoses, PoseSet, RandomPoses
    from cdsm.sweeps.run import sweep
    from cdsm.sweeps.status import SweepStatus
    from cdsm.tension import Tension, distribute_tension
    from cdsm.tolerance import Tolerance, Tolerances
    from cdsm.tolerances.budget import Uncertainty, uncertainty
    from cdsm.tolerances.monte_carlo import MonteCarlo, monte_carlo
    from cdsm.urdf import to_urdf, write_urdf
    from cdsm.wires.files import read_elasticity, write_elasticity
    from cdsm.wires.laws import StrandElasticity, TabulatedElasticity
    from cdsm.wires.tensile.fit import TensileFit, fit_tensile_test
    from cdsm.wires.tensile.record import TensileTest, read_tensile_csv

    __version__: str

# fmt: off
__all__ = [
    "ArmParameters", "Batch", "Bifurcation", "Breakaway", "Cable", "CableError", "CableRoute",
    "Cables", "CdsmError", "CdsmWarning", "Clearance", "ClusterError", "Constraint", "CriticalLoad",
    "CriticalTension", "DesignProblem", "DesignProgress", "DesignSearch", "Designs", "Domain",
    "Elasticity", "ElasticityRangeError", "Equilibrium", "EquilibriumError", "ExperimentPlan",
    "FileError", "ForcePolytope", "Geometry", "GeometryError", "GridPoses", "HalfWay",
    "Identification", "InfeasibleDesign", "InfeasibleSample", "InfeasibleTension", "InvalidInput",
    "Joint", "JointLimitError", "JointSolution", "KinematicSolution", "LinearElasticity",
    "LinearPrediction", "Link", "LoadHistory", "Manipulator", "Measurement", "MissingExtra",
    "MissingWire", "Modes", "MomentArms", "MonteCarlo", "MuJoCoPlant", "Objective", "PathPlan",
    "PathPoses", "Payload", "PoseSet", "Posture", "RandomPoses", "Remedy", "Report", "RestBand",
    "Saturation", "SelfCheck", "Sensors", "Shares", "SingularMass", "SingularStiffness", "Site",
    "SlowPlant", "SolverError", "Status", "Stiffness", "StiffnessGradient", "StiffnessPlan",
    "StiffnessRange", "StoreError", "StrandElasticity", "SweepStatus", "TabulatedElasticity",
    "TensileFit", "TensileTest", "TensileTestError", "Tension", "Tensions", "TipForce", "Tolerance",
    "Tolerances", "TrackingRun", "Uncertainty", "UnknownName", "UnreachableStiffness", "UrdfError",
    "Variable", "WeightLoop", "WeightTest", "WireUse", "bifurcation", "breakaway", "clearance",
    "critical_load", "critical_tension", "distribute_tension", "distribute_tensions", "equilibrium",
    "evaluate", "evaluate_designs", "fit_tensile_test", "force_polytope", "has_wrench_closure",
    "identify", "in_series", "inverse_kinematics", "isotropy", "load_cycle", "modes", "monte_carlo",
    "payload", "plan_experiment", "plan_path", "plan_stiffness", "presets", "read_cables",
    "read_caspr", "read_elasticity", "read_loops", "read_problem", "read_sweep", "read_tensile_csv",
    "refine_design", "rest_band", "saturation", "search_designs", "serpentine_cables",
    "sliding_stiffness", "solve_joint_angles", "stiffness", "stiffness_gradient", "stiffness_range",
    "stuck_stiffness", "sweep", "sweep_to_pandas", "tension_factor", "tip_force", "to_mjcf",
    "to_urdf", "track", "uncertainty", "weight_test", "wire_use", "write_cables",
    "write_elasticity", "write_mjcf", "write_sweep", "write_urdf",
]
# fmt: on


_NAMES = {
    "arm_file.cables": "read_cables write_cables",
    "batch": "Batch Tensions distribute_tensions evaluate",
    "cable": "Cable Cables Site in_series",
    "control.mujoco_plant": "MuJoCoPlant",
    "control.plant": "SlowPlant",
    "control.run": "TrackingRun",
    "control.sensors": "Sensors",
    "control.tip_force": "TipForce tip_force",
    "control.track": "track",
    "design.evaluation": "Designs evaluate_designs",
    "design.goals": "Constraint Objective",
    "design.problem": "DesignProblem",
    "design.problem_file": "read_problem",
    "design.refine": "refine_design",
    "design.result": "DesignProgress DesignSearch",
    "design.search": "search_designs",
    "design.variables": "Variable",
    "elasticity": "Domain Elasticity LinearElasticity",
    "errors": (
        "CableError CdsmError CdsmWarning ClusterError ElasticityRangeError EquilibriumError "
        "FileError GeometryError InfeasibleDesign InfeasibleTension InvalidInput JointLimitError "
        "MissingExtra MissingWire SingularMass SingularStiffness SolverError StoreError "
        "TensileTestError UnknownName UnreachableStiffness UrdfError"
    ),
    "friction.band": "RestBand rest_band",
    "friction.breakaway": "Breakaway breakaway",
    "friction.stuck": "sliding_stiffness stuck_stiffness",
    "geometry": "CableRoute Geometry Joint Link",
    "geometry.cables": "serpentine_cables",
    "instability": "Remedy",
    "identification": "ArmParameters ExperimentPlan Identification Measurement WeightLoop identify "
    "plan_experiment read_loops",
    "interchange.caspr": "read_caspr",
    "interchange.mjcf": "to_mjcf write_mjcf",
    "kinematics.maps": "inverse_kinematics solve_joint_angles",
    "kinematics.solutions": "JointSolution KinematicSolution",
    "manipulator": "Manipulator",
    "measures.clearance": "Clearance clearance",
    "measures.closure": "has_wrench_closure isotropy tension_factor",
    "measures.forces": "ForcePolytope force_polytope",
    "measures.payload": "Payload payload",
    "measures.wire_use": "WireUse wire_use",
    "planning.gradient": "StiffnessGradient stiffness_gradient",
    "planning.half_way": "HalfWay",
    "planning.path": "plan_path",
    "planning.path_plan": "InfeasibleSample PathPlan",
    "planning.plan": "StiffnessPlan plan_stiffness",
    "planning.range": "StiffnessRange stiffness_range",
    "planning.saturation_curve": "Saturation",
    "planning.tension_growth": "saturation",
    "posture": "MomentArms Posture",
    "report": "Report SelfCheck",
    "statics.bifurcation": "Bifurcation bifurcation",
    "statics.buckling": "critical_load critical_tension",
    "statics.buckling_results": "CriticalLoad CriticalTension",
    "statics.equilibrium": "Equilibrium",
    "statics.load_cycle": "load_cycle",
    "statics.load_history": "LoadHistory",
    "statics.natural_modes": "Modes modes",
    "statics.rest_search": "equilibrium",
    "statics.weight_test": "LinearPrediction WeightTest weight_test",
    "stiffness_matrix": "Shares Stiffness stiffness",
    "support.status": "Status",
    "sweeps.export": "read_sweep sweep_to_pandas write_sweep",
    "sweeps.poses": "GridPoses PathPoses PoseSet RandomPoses",
    "sweeps.run": "sweep",
    "sweeps.status": "SweepStatus",
    "tension": "Tension distribute_tension",
    "tolerances.budget": "Uncertainty uncertainty",
    "tolerances.monte_carlo": "MonteCarlo monte_carlo",
    "tolerance": "Tolerance Tolerances",
    "urdf": "to_urdf write_urdf",
    "wires.files": "read_elasticity write_elasticity",
    "wires.laws": "StrandElasticity TabulatedElasticity",
    "wires.tensile.fit": "TensileFit fit_tensile_test",
    "wires.tensile.record": "TensileTest read_tensile_csv",
}
"""Public names by their module, which is imported when one of its names is first used."""

_HOME = {name: f"cdsm.{module}" for module, names in _NAMES.items() for name in names.split()}
_MODULES = ("control", "paper", "plots", "presets", "view")

if not TYPE_CHECKING:  # a type checker would take any name for one that exists

    def __getattr__(name: str) -> object:
        if name in _MODULES:
            return import_module(f"cdsm.{name}")
        if name in _HOME:
            found = getattr(import_module(_HOME[name]), name)
        elif name == "__version__":
            from importlib.metadata import version

            found = version("cdsm-stiffness")
        else:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        globals()[name] = found  # the next time it is found without this function
        return found


def __dir__() -> list[str]:
    return sorted({*__all__, *_MODULES})
