"""Stiffness of cable-driven serpentine manipulators.

    geometry = cdsm.Geometry.universal(...)            # or read from TOML
    arm = cdsm.Manipulator(geometry, elasticity=...)   # URDF, rigid-body model, cables
    pose = arm.at(q)                                   # all that depends on the joint angles
    pull = cdsm.distribute_tension(pose, minimum=50.0) # all that depends on the load
    K = cdsm.stiffness(pose, pull)                     # joint and Cartesian stiffness

SI units throughout; base frame with x along the straight arm.
"""

from importlib.metadata import version as _version

from cdsm import presets
from cdsm.cable import Cable, Site, in_series, serpentine_cables
from cdsm.elasticity import Domain, Elasticity, LinearElasticity
from cdsm.errors import (
    CableError,
    CdsmError,
    ElasticityRangeError,
    FileError,
    GeometryError,
    InfeasibleTension,
    InvalidInput,
    JointLimitError,
    SingularStiffness,
    SolverError,
    TensileTestError,
    UnknownName,
    UrdfError,
)
from cdsm.geometry import Geometry
from cdsm.identification import Identification, Measurement, identify
from cdsm.manipulator import Manipulator, Posture
from cdsm.parts import CableRoute, Joint, Link
from cdsm.stiffness import Shares, Stiffness, stiffness
from cdsm.tensile import TensileFit, fit_tensile_test
from cdsm.tensile_data import TensileTest, read_tensile_csv
from cdsm.tension import Tension, distribute_tension
from cdsm.urdf import to_urdf, write_urdf
from cdsm.wire import StrandElasticity, TabulatedElasticity
from cdsm.wire_file import read_elasticity, write_elasticity

__version__ = _version("cdsm-stiffness")

__all__ = [
    "Cable",
    "CableError",
    "CableRoute",
    "CdsmError",
    "Domain",
    "Elasticity",
    "ElasticityRangeError",
    "FileError",
    "Geometry",
    "GeometryError",
    "Identification",
    "InfeasibleTension",
    "InvalidInput",
    "Joint",
    "JointLimitError",
    "LinearElasticity",
    "Link",
    "Manipulator",
    "Measurement",
    "Posture",
    "Shares",
    "SingularStiffness",
    "Site",
    "SolverError",
    "Stiffness",
    "StrandElasticity",
    "TabulatedElasticity",
    "TensileFit",
    "TensileTest",
    "TensileTestError",
    "Tension",
    "UnknownName",
    "UrdfError",
    "distribute_tension",
    "fit_tensile_test",
    "identify",
    "in_series",
    "presets",
    "read_elasticity",
    "read_tensile_csv",
    "serpentine_cables",
    "stiffness",
    "to_urdf",
    "write_elasticity",
    "write_urdf",
]
