"""Check a stiffness matrix: is it right, is the arm balanced and stable, and how to read it."""

from cdsm.report.checks import BALANCED, Comparison, balance_error, compared
from cdsm.report.report import Report, report_on

__all__ = ["BALANCED", "Comparison", "Report", "balance_error", "compared", "report_on"]
