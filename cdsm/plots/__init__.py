"""Plot arms, maps, plans, loads, and the figures of the paper. Axes show mm and N/mm.

Every function returns a new :class:`matplotlib.figure.Figure`, as wide as one or two columns of a
journal. Show it in a notebook, or write it with :func:`save_figure`. No function changes the global
state of matplotlib.
"""

from cdsm.plots.arm import plot_arm
from cdsm.plots.budget import plot_monte_carlo, plot_uncertainty
from cdsm.plots.by_cable import (
    plot_shares,
    plot_stiffness_plan,
    plot_stiffness_range,
    plot_tensions,
)
from cdsm.plots.designs import plot_designs
from cdsm.plots.forces import plot_force_polytope
from cdsm.plots.loads import (
    plot_critical_load,
    plot_critical_tension,
    plot_load_history,
    plot_weight_test,
)
from cdsm.plots.maps import plot_map
from cdsm.plots.paper import plot_paper
from cdsm.plots.path import plot_modes, plot_path
from cdsm.plots.planning import plot_path_plan, plot_saturation, plot_stiffness_ranges
from cdsm.plots.style import save_figure
from cdsm.plots.tracking import plot_tracking_run
from cdsm.plots.wires import plot_cables, plot_elasticity

# fmt: off
__all__ = [
    "plot_arm", "plot_cables", "plot_critical_load", "plot_critical_tension",
    "plot_designs", "plot_elasticity", "plot_force_polytope", "plot_load_history", "plot_map",
    "plot_modes", "plot_monte_carlo", "plot_paper", "plot_path", "plot_path_plan",
    "plot_saturation", "plot_shares", "plot_stiffness_plan", "plot_stiffness_range",
    "plot_stiffness_ranges", "plot_tensions", "plot_tracking_run", "plot_uncertainty",
    "plot_weight_test", "save_figure",
]
# fmt: on


def __dir__() -> list[str]:
    """List the public names."""
    return __all__
