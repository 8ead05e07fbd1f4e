"""Laws of springs at joints, M(x) of the angle x from rest, and their fit to measured points."""

from cdsm.springs.law import JointSpring as JointSpring
from cdsm.springs.law import SpringLaw as SpringLaw
from cdsm.springs.law import law_table as law_table
