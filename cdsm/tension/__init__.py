"""Cable tensions that balance an arm: bounds, distribution, solvers, reasons of failure."""

from cdsm.tension.bounds import Bounds as Bounds
from cdsm.tension.bounds import bounds_at as bounds_at
from cdsm.tension.bounds import checked_bounds as checked_bounds
from cdsm.tension.bounds import friction_exponents as friction_exponents
from cdsm.tension.distribution import Tension as Tension
from cdsm.tension.distribution import distribute_tension as distribute_tension
from cdsm.tension.distribution import least_tension as least_tension
from cdsm.tension.infeasibility import advice as advice
from cdsm.tension.infeasibility import too_few_cables as too_few_cables
from cdsm.tension.solvers import DEFAULT_SOLVER as DEFAULT_SOLVER
