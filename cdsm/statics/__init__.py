"""Statics of the loaded arm: equilibrium, weights, load cycles, buckling and natural modes."""

from cdsm.statics.buckling import CriticalLoad as CriticalLoad
from cdsm.statics.buckling import CriticalTension as CriticalTension
from cdsm.statics.equilibrium import Equilibrium as Equilibrium
from cdsm.statics.load_cycle import LoadHistory as LoadHistory
from cdsm.statics.modes import Modes as Modes
from cdsm.statics.weight_test import WeightTest as WeightTest
