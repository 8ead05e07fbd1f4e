"""Check a stiffness matrix: is it right, is the arm balanced and stable, and how to read it."""

from cdsm.report.report import report_on as report_on
