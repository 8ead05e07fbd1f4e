"""Description of an arm: joints, links, holes and cable routes, and its TOML form.

All units are SI (m, rad, kg). The straight arm lies along x, and all lengths are measured along x.
"""

from cdsm.geometry.geometry import Geometry as Geometry
from cdsm.geometry.parts import MAXIMUM_JOINTS as MAXIMUM_JOINTS
from cdsm.geometry.parts import CableRoute as CableRoute
from cdsm.geometry.parts import Disk as Disk
from cdsm.geometry.parts import Joint as Joint
from cdsm.geometry.parts import Link as Link
