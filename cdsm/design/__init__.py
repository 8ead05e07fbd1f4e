"""Design of an arm: the design problem, searches for the best designs, and their results."""

from cdsm.design.evaluation import Designs as Designs
from cdsm.design.evaluation import InfeasibleDesign as InfeasibleDesign
from cdsm.design.result import DesignSearch as DesignSearch
