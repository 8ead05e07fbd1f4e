"""Stiffness of cable-driven serpentine manipulators.

    geometry = cdsm.Geometry.universal(...)            # or read from TOML
    arm = cdsm.Manipulator(geometry, elasticity=...)   # URDF, rigid-body model, cables
    pose = arm.at(q)                                   # kinematics, cable lengths, gravity torque
    pull = cdsm.distribute_tension(pose, minimum=50.0) # tensions that balance the load
    K = cdsm.stiffness(pose, pull)                     # joint and Cartesian stiffness

All units are SI. The x-axis of the base frame lies along the straight arm.
"""

from importlib import import_module as _import_module
from importlib.metadata import version as _version
from typing import TYPE_CHECKING as _TYPE_CHECKING

from cdsm import presets
from cdsm.batch import Batch, Status, Tensions, distribute_tensions, evaluate
from cdsm.cable import Cable, Site, in_series, serpentine_cables
from cdsm.elasticity import Domain, Elasticity, LinearElasticity
from cdsm.errors import (
    CableError,
    CdsmError,
    ClusterError,
    ElasticityRangeError,
    EquilibriumError,
    FileError,
    GeometryError,
    InfeasibleTension,
    InvalidInput,
    JointLimitError,
    MissingExtra,
    SingularMass,
    SingularStiffness,
    SolverError,
    StoreError,
    TensileTestError,
    UnknownName,
    UnreachableStiffness,
    UrdfError,
)
from cdsm.geometry import CableRoute, Geometry, Joint, Link
from cdsm.identification import Identification, Measurement, identify
from cdsm.interchange.cable_file import read_cables, write_cables
from cdsm.interchange.caspr import read_caspr
from cdsm.interchange.mjcf import to_mjcf, write_mjcf
from cdsm.kinematics.maps import inverse_kinematics, solve_joint_angles
from cdsm.kinematics.solutions import JointSolution, KinematicSolution
from cdsm.manipulator import Manipulator
from cdsm.planning import (
    HalfWay,
    InfeasibleSample,
    PathPlan,
    Saturation,
    StiffnessGradient,
    StiffnessPlan,
    StiffnessRange,
    plan_path,
    plan_stiffness,
    saturation,
    stiffness_gradient,
    stiffness_range,
)
from cdsm.posture import Posture
from cdsm.statics.buckling import CriticalLoad, CriticalTension, critical_load, critical_tension
from cdsm.statics.equilibrium import Equilibrium, equilibrium
from cdsm.statics.natural_modes import Modes, modes
from cdsm.statics.weight_test import LinearPrediction, WeightTest, weight_test
from cdsm.stiffness_matrix import Shares, Stiffness, stiffness
from cdsm.sweeps import (
    GridPoses,
    PathPoses,
    PoseSet,
    RandomPoses,
    SweepStatus,
    read_sweep,
    sweep,
    write_sweep,
)
from cdsm.tension import Tension, distribute_tension
from cdsm.urdf import to_urdf, write_urdf
from cdsm.wires.files import read_elasticity, write_elasticity
from cdsm.wires.laws import StrandElasticity, TabulatedElasticity
from cdsm.wires.tensile.fit import TensileFit, fit_tensile_test
from cdsm.wires.tensile.record import TensileTest, read_tensile_csv

if _TYPE_CHECKING:
    from cdsm.report import Report, SelfCheck

__version__ = _version("cdsm-stiffness")

__all__ = [
    "Batch",
    "Cable",
    "CableError",
    "CableRoute",
    "CdsmError",
    "ClusterError",
    "CriticalLoad",
    "CriticalTension",
    "Domain",
    "Elasticity",
    "ElasticityRangeError",
    "Equilibrium",
    "EquilibriumError",
    "FileError",
    "Geometry",
    "GeometryError",
    "GridPoses",
    "HalfWay",
    "Identification",
    "InfeasibleSample",
    "InfeasibleTension",
    "InvalidInput",
    "Joint",
    "JointLimitError",
    "JointSolution",
    "KinematicSolution",
    "LinearElasticity",
    "LinearPrediction",
    "Link",
    "Manipulator",
    "Measurement",
    "MissingExtra",
    "Modes",
    "PathPlan",
    "PathPoses",
    "PoseSet",
    "Posture",
    "RandomPoses",
    "Report",
    "Saturation",
    "SelfCheck",
    "Shares",
    "SingularMass",
    "SingularStiffness",
    "Site",
    "SolverError",
    "Status",
    "Stiffness",
    "StiffnessGradient",
    "StiffnessPlan",
    "StiffnessRange",
    "StoreError",
    "StrandElasticity",
    "SweepStatus",
    "TabulatedElasticity",
    "TensileFit",
    "TensileTest",
    "TensileTestError",
    "Tension",
    "Tensions",
    "UnknownName",
    "UnreachableStiffness",
    "UrdfError",
    "WeightTest",
    "critical_load",
    "critical_tension",
    "distribute_tension",
    "distribute_tensions",
    "equilibrium",
    "evaluate",
    "fit_tensile_test",
    "identify",
    "in_series",
    "inverse_kinematics",
    "modes",
    "plan_path",
    "plan_stiffness",
    "presets",
    "read_cables",
    "read_caspr",
    "read_elasticity",
    "read_sweep",
    "read_tensile_csv",
    "saturation",
    "serpentine_cables",
    "solve_joint_angles",
    "stiffness",
    "stiffness_gradient",
    "stiffness_range",
    "sweep",
    "to_mjcf",
    "to_urdf",
    "weight_test",
    "write_cables",
    "write_elasticity",
    "write_mjcf",
    "write_sweep",
    "write_urdf",
]

_LAZY = ("Report", "SelfCheck")


def __getattr__(name: str) -> object:
    if name in _LAZY:
        return getattr(_import_module("cdsm.report"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_LAZY})
