"""Figures of arms, maps, plans, loads, and of the paper. Axes show mm and N/mm.

Every function returns a new :class:`matplotlib.figure.Figure`. Show it in a notebook, or save it
with ``savefig``. No function changes the global state of matplotlib.
"""

from cdsm.plots.arm import plot_arm
from cdsm.plots.loads import plot_critical_tension, plot_weight_test
from cdsm.plots.maps import plot_map
from cdsm.plots.paper import plot_paper
from cdsm.plots.planning import plot_path_plan, plot_stiffness_plan

__all__ = [
    "plot_arm",
    "plot_critical_tension",
    "plot_map",
    "plot_paper",
    "plot_path_plan",
    "plot_stiffness_plan",
    "plot_weight_test",
]
