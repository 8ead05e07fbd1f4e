"""Plot arms, maps, paths and attainable stiffness, and save figures. Axes show mm and N/mm.

Every function returns a new :class:`matplotlib.figure.Figure`, as wide as one or two columns of a
journal. Show it in a notebook, or write it with :func:`save_figure`. The method ``plot`` of results
calls the functions of this package that are not listed in ``__all__``.
"""

from cdsm.plots.arm import plot_arm, plot_path
from cdsm.plots.arm import plot_modes as plot_modes
from cdsm.plots.loads import plot_critical_load as plot_critical_load
from cdsm.plots.loads import plot_critical_tension as plot_critical_tension
from cdsm.plots.loads import plot_load_history as plot_load_history
from cdsm.plots.loads import plot_tracking_run as plot_tracking_run
from cdsm.plots.loads import plot_weight_test as plot_weight_test
from cdsm.plots.maps import plot_map
from cdsm.plots.measured import plot_designs as plot_designs
from cdsm.plots.measured import plot_elasticity as plot_elasticity
from cdsm.plots.measured import plot_experiment_plan as plot_experiment_plan
from cdsm.plots.measured import plot_force_polytope as plot_force_polytope
from cdsm.plots.measured import plot_identification as plot_identification
from cdsm.plots.measured import plot_monte_carlo as plot_monte_carlo
from cdsm.plots.measured import plot_tensile_fit as plot_tensile_fit
from cdsm.plots.measured import plot_uncertainty as plot_uncertainty
from cdsm.plots.paper import plot_paper as plot_paper
from cdsm.plots.planning import plot_path_plan as plot_path_plan
from cdsm.plots.planning import plot_saturation as plot_saturation
from cdsm.plots.planning import plot_shares as plot_shares
from cdsm.plots.planning import plot_stiffness_plan as plot_stiffness_plan
from cdsm.plots.planning import plot_stiffness_range as plot_stiffness_range
from cdsm.plots.planning import plot_stiffness_ranges, plot_tension_curve
from cdsm.plots.style import save_figure

__all__ = [
    "plot_arm",
    "plot_map",
    "plot_path",
    "plot_stiffness_ranges",
    "plot_tension_curve",
    "save_figure",
]
