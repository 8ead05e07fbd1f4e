"""Plot laws of rigidity, and the stiffness of cables."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.figure import Figure

from cdsm.errors import InvalidInput
from cdsm.plots.style import (
    BLUE,
    KN,
    N_PER_MM,
    ONE_COLUMN,
    PALETTE,
    STYLES,
    VERMILLION,
    caption,
    expect,
    legend,
    panels,
)
from cdsm.support.values import Array

if TYPE_CHECKING:
    from cdsm.cable import Cable
    from cdsm.wires.elasticity import Elasticity

_POINTS: Final = 400

_ENDLESS: Final = 1000.0  # tension [N] up to which a law without a highest tension is drawn


def plot_elasticity(law: Elasticity) -> Figure:
    """Plot tangent and secant rigidity EA [kN] against the tension [N].

    A law without a highest tension is drawn up to 1000 N. Raises InvalidInput if ``law`` is not an
    :class:`~cdsm.Elasticity`.
    """
    expect("law", law, "Elasticity")
    tension = _tensions(law)
    figure, ((axes,),) = panels(ONE_COLUMN, 2.3, 1)
    axes.plot(tension, KN * law.rigidity(tension), color=BLUE, label="tangent, dF/dε")
    axes.plot(tension, KN * law.secant_rigidity(tension), "--", color=VERMILLION, label="secant")
    axes.set(xlabel="tension [N]", ylabel="rigidity EA [kN]")
    axes.set_ylim(bottom=0.0)
    legend(axes)
    return figure


def plot_cables(cables: Mapping[str, Cable] | Sequence[Cable], free_length: float) -> Figure:
    """Plot the stiffness of cables [N/mm] against the tension [N], on a logarithmic scale.

    Args:
        cables: Cables, or a mapping from labels to cables.
        free_length: Original length of every wire [m].

    Raises:
        InvalidInput: No cables are given, or ``free_length`` is not a positive number.
    """
    named = cables if isinstance(cables, Mapping) else {each.name: each for each in cables}
    if not named:
        raise InvalidInput("cables", "none given; give one at least.")
    figure, ((axes,),) = panels(ONE_COLUMN, 2.3, 1)
    for k, (name, cable) in enumerate(named.items()):
        expect("cables", cable, "Cable")
        tension = _tensions(cable.elasticity)
        values = N_PER_MM * cable.tangent_stiffness(tension, free_length)
        color = PALETTE[-3:][k % 3]
        axes.semilogy(tension, values, STYLES[k % len(STYLES)], color=color, label=name)
    axes.set(xlabel="tension [N]", ylabel="cable stiffness [N/mm]")
    caption(axes, f"original length {1e3 * free_length:g} mm")
    legend(axes)
    return figure


def _tensions(law: Elasticity) -> Array:
    return np.linspace(law.low, law.high if math.isfinite(law.high) else _ENDLESS, _POINTS)
