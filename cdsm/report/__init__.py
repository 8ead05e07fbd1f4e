"""Check a stiffness matrix, and report whether it can be trusted."""

from cdsm.report.facts import CableState, Rank, Readings
from cdsm.report.optimality import Optimality
from cdsm.report.report import Report, report_on
from cdsm.report.self_check import Agreement, Difference, SelfCheck, self_check

# fmt: off
__all__ = [
    "Agreement", "CableState", "Difference", "Optimality", "Rank", "Readings", "Report",
    "SelfCheck", "report_on", "self_check",
]
# fmt: on
