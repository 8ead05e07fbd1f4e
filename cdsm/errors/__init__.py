"""All errors of the library; each one is a subclass of :class:`CdsmError`.

An error stores its data as attributes. Its message names the fault, the allowed values and the
remedy.
"""

from cdsm.errors.base import LONGEST as LONGEST
from cdsm.errors.base import CdsmError as CdsmError
from cdsm.errors.base import CdsmWarning as CdsmWarning
from cdsm.errors.base import counted as counted
from cdsm.errors.base import first_of as first_of
from cdsm.errors.base import listed as listed
from cdsm.errors.base import named as named
from cdsm.errors.inputs import CableError as CableError
from cdsm.errors.inputs import ClusterError as ClusterError
from cdsm.errors.inputs import FileError as FileError
from cdsm.errors.inputs import GeometryError as GeometryError
from cdsm.errors.inputs import InvalidInput as InvalidInput
from cdsm.errors.inputs import JointLimitError as JointLimitError
from cdsm.errors.inputs import MissingExtra as MissingExtra
from cdsm.errors.inputs import MissingWire as MissingWire
from cdsm.errors.inputs import StoreError as StoreError
from cdsm.errors.inputs import TensileTestError as TensileTestError
from cdsm.errors.inputs import UnknownName as UnknownName
from cdsm.errors.inputs import UrdfError as UrdfError
from cdsm.errors.mechanics import ElasticityRangeError as ElasticityRangeError
from cdsm.errors.mechanics import EquilibriumError as EquilibriumError
from cdsm.errors.mechanics import InfeasibleDesign as InfeasibleDesign
from cdsm.errors.mechanics import InfeasibleTension as InfeasibleTension
from cdsm.errors.mechanics import SingularMass as SingularMass
from cdsm.errors.mechanics import SingularStiffness as SingularStiffness
from cdsm.errors.mechanics import SolverError as SolverError
from cdsm.errors.mechanics import UnreachableStiffness as UnreachableStiffness
