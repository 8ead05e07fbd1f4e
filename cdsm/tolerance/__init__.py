"""Tolerances: standard uncertainties of the dimensions and measured values of an arm."""

from cdsm.tolerance.sources import COMMON, LARGEST, SOURCES, Tolerances
from cdsm.tolerance.tolerance import EVERY, WIDTH, Tolerance

__all__ = ["COMMON", "EVERY", "LARGEST", "SOURCES", "WIDTH", "Tolerance", "Tolerances"]
