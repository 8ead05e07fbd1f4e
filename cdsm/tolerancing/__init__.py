"""Uncertainty of stiffnesses and other numbers of an arm that follows from its tolerances.

Uncertainty budgets follow the *Guide to the expression of uncertainty in measurement*
(JCGM 100:2008), Monte Carlo runs its Supplement 1 (JCGM 101:2008).
"""

from cdsm.tolerancing.budget import Uncertainty as Uncertainty
from cdsm.tolerancing.monte_carlo import MonteCarlo as MonteCarlo
