"""For which leads the paper's third finding holds: that stiffness falls a little with tension.

With EA constant, tension softens an arm by the active stiffness and stiffens it since the locked
wire is shorter than the cable: EA/l_0 = (EA + F)/L. Only the second depends on how long the cables
are, so that the lead decides. The paper takes l_0 = L and has the first alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, final

import numpy as np
from scipy.optimize import brentq

from cdsm import presets
from cdsm.arm_model import OriginalLength
from cdsm.paper.figures import KEPT, STRETCHED, UNSTRAINED, Claim
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.validation import Array, frozen
from cdsm.tension import distribute_tension

LEADS: Final = frozen(np.concatenate([[0.0], np.geomspace(0.003, 0.3, 30)]))
"""Leads looked at [m]; from 0.33 m on the arm buckles below 800 N."""

BOUNDS: Final = (100.0, 800.0)
"""Lower bounds of tension [N] between which the stiffness changes, as for Fig. 4."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class LeadFigure:
    """Change of stiffness with tension over the lead of the cables.

    Attributes:
        name: ``"lead"``.
        title: What it shows.
        leads: (N,) [m].
        pseudoinverse: Change of K_R with the original length (N, 3) [%].
        along: Change of what a small weight measures, with the original length (N, 3) [%].
        stretched_pseudoinverse: As ``pseudoinverse``, with the paper's l_0 = L.
        stretched_along: As ``along``, with the paper's l_0 = L.
        claims: From which leads on it is a fall.
    """

    name: str
    title: str
    leads: Array
    pseudoinverse: Array
    along: Array
    stretched_pseudoinverse: Array
    stretched_along: Array
    claims: tuple[Claim, ...]


def figure_lead() -> LeadFigure:
    """Change of stiffness from a lower bound of 100 N to one of 800 N over the lead, EA = 48 kN."""
    true, paper = (
        [_changes(lead, length) for lead in LEADS.tolist()] for length in (UNSTRAINED, STRETCHED)
    )
    table, stretched = frozen(np.array(true)), frozen(np.array(paper))
    return LeadFigure(
        name="lead",
        title="Change of stiffness, 100 N to 800 N, over the lead of the cables, EA = 48 kN",
        leads=LEADS,
        pseudoinverse=table[:, 0],
        along=table[:, 1],
        stretched_pseudoinverse=stretched[:, 0],
        stretched_along=stretched[:, 1],
        claims=(
            Claim(
                figure="Fig. 4, lead",
                quantity="lead from which stiffness falls with tension",
                unit="mm",
                paper=None,
                computed=tuple(_first_fall(stretched[:, 0], STRETCHED, 0)),
                original=tuple(_first_fall(table[:, 0], UNSTRAINED, 0)),
                along=tuple(_first_fall(table[:, 1], UNSTRAINED, 1)),
                assumption="as Fig. 4, EA = 48 kN",
                searched=KEPT,
            ),
        ),
    )


def _changes(lead: float, length: OriginalLength) -> Array:
    """Change of K_R and of what a weight measures, in x, y and z (2, 3) [%]."""
    arm = presets.virtual_prototype(presets.ELASTIC_STAGE, lead=lead, original_length=length)
    pose = arm.at(np.full(arm.nv, presets.TEN_DEGREES))
    first, last = (
        _readings(stiffness(pose, distribute_tension(pose, minimum))) for minimum in BOUNDS
    )
    return np.asarray(100.0 * (last / first - 1.0))


def _readings(K: Stiffness) -> Array:
    return np.array([np.diag(K.pseudoinverse()), [K.along(axis) for axis in np.eye(3)]])


def _first_fall(changes: Array, length: OriginalLength, reading: int) -> list[float]:
    """Lead [mm] from which on stiffness falls, for x, y and z; 0 where it always does."""

    def crossing(axis: int) -> float:
        if changes[0, axis] < 0.0:
            return 0.0
        i = int(np.argmax(changes[:, axis] < 0.0))
        root = brentq(
            lambda lead: float(_changes(float(lead), length)[reading, axis]), LEADS[i - 1], LEADS[i]
        )
        return float(1e3 * root)

    return [crossing(axis) for axis in range(3)]
