"""Models of CASPR, the MATLAB simulator of cable-driven robots: their XML into a manipulator.

CASPR (D. Lau et al., Cable-Driven Parallel Robots, Springer 2016) describes a robot by two files:
rigid links, each with its joint, and sets of cables between points on them.
"""

from cdsm.interchange.caspr.model import read_caspr

__all__ = ["read_caspr"]
