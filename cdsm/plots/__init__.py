"""Plot arms, maps, curves, bars and films on any axes, and save figures. Axes show mm and N/mm.

Every function takes ``ax=``, ordinary axes of ``plt.subplots()``, or ``axs=`` if it draws several
panels, and returns the axes on which it drew. Without them it makes a new
:class:`~matplotlib.figure.Figure`, as wide as one or two columns of a journal: ``ax.figure``. With
them, size and layout of the figure remain the caller's. ``title=`` replaces the title; ``""`` is
none. The method ``plot`` of results passes all arguments on to the functions of this package that
are not listed in ``__all__``.

Artists with numbers have a ``gid``, such as ``cable:cable1_1:0``, ``compliance`` or ``along``, by
which data is read back, and groups are named in an SVG.
"""

from cdsm.plots.arm import plot_arm, plot_arms
from cdsm.plots.bars import plot_shares as plot_shares
from cdsm.plots.bars import plot_stiffness_plan as plot_stiffness_plan
from cdsm.plots.bars import plot_stiffness_range as plot_stiffness_range
from cdsm.plots.bars import plot_tensions
from cdsm.plots.curves import plot_critical_load as plot_critical_load
from cdsm.plots.curves import plot_critical_tension as plot_critical_tension
from cdsm.plots.curves import plot_load_history as plot_load_history
from cdsm.plots.curves import plot_weight_test as plot_weight_test
from cdsm.plots.laws import plot_elasticity as plot_elasticity
from cdsm.plots.laws import plot_spring_fit as plot_spring_fit
from cdsm.plots.laws import plot_tensile_fit as plot_tensile_fit
from cdsm.plots.loads import plot_load_estimate as plot_load_estimate
from cdsm.plots.maps import plot_map
from cdsm.plots.measured import plot_designs as plot_designs
from cdsm.plots.measured import plot_experiment_plan as plot_experiment_plan
from cdsm.plots.measured import plot_identification as plot_identification
from cdsm.plots.measured import plot_monte_carlo as plot_monte_carlo
from cdsm.plots.measured import plot_uncertainty as plot_uncertainty
from cdsm.plots.over_tension import plot_stiffness_over_tension, plot_tension_curve
from cdsm.plots.page import draw_report as draw_report
from cdsm.plots.paper import plot_paper as plot_paper
from cdsm.plots.paths import plot_force_polytope as plot_force_polytope
from cdsm.plots.paths import plot_modes as plot_modes
from cdsm.plots.paths import plot_path
from cdsm.plots.plans import plot_path_plan as plot_path_plan
from cdsm.plots.plans import plot_stiffness_ranges
from cdsm.plots.plans import plot_tracking_run as plot_tracking_run
from cdsm.plots.style import STYLE, save_figure

__all__ = [
    "STYLE",
    "plot_arm",
    "plot_arms",
    "plot_map",
    "plot_path",
    "plot_stiffness_over_tension",
    "plot_stiffness_ranges",
    "plot_tension_curve",
    "plot_tensions",
    "save_figure",
]
