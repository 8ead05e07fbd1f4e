"""Find the leads for which stiffness falls with tension, which is the paper's third finding.

The lead is the straight cable between its actuator and the base disk. With EA constant, tension
has two effects. The active stiffness softens the arm. The original length l_0 of a locked wire is
shorter than the cable, which stiffens the arm: EA/l_0 = (EA + F)/L. Only the second effect depends
on the cable length, hence on the lead. The paper takes l_0 = L and has only the first effect.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, final

import numpy as np
from scipy.optimize import brentq

from cdsm import presets
from cdsm.cable_laws import OriginalLength
from cdsm.paper.claims import Claim, Figure
from cdsm.paper.curves import FROM_FIG_6, at_minimum, readings
from cdsm.support.values import Array, frozen

LEADS: Final = frozen(np.concatenate([[0.0], np.geomspace(0.003, 0.3, 30)]))
"""Examined leads [m]. With a lead of 0.33 m or more the arm buckles below 800 N."""

MINIMA: Final = (100.0, 800.0)
"""Lower bounds of tension [N] at the start and the end of the change, as in Fig. 4."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class LeadFigure(Figure):
    """Change of stiffness if the lower bound of tension rises from 100 N to 800 N, for each lead.

    Attributes:
        leads: Leads of all cables (N,) [m].
        pseudoinverse: Change of K_R, computed with the unstrained length l_0; x, y, z (N, 3) [%].
        along: Change of the stiffness that a small weight measures, with this l_0 (N, 3) [%].
        stretched_pseudoinverse: ``pseudoinverse`` computed with l_0 = L as in the paper (N, 3) [%].
        stretched_along: ``along`` computed with l_0 = L as in the paper (N, 3) [%].
    """

    leads: Array
    pseudoinverse: Array
    along: Array
    stretched_pseudoinverse: Array
    stretched_along: Array

    def numbers(self) -> dict[str, object]:
        """Return the leads [m] and the curves [%] as plain numbers, for JSON."""
        names = ("pseudoinverse", "along", "stretched_pseudoinverse", "stretched_along")
        changes = {f"{name}_change_xyz_percent": getattr(self, name).tolist() for name in names}
        return {"lead_m": self.leads.tolist(), **changes}


def figure_lead() -> LeadFigure:
    """Compute, for each lead, the change of stiffness from a lower bound of 100 N to 800 N."""
    unstrained, stretched = (
        frozen(np.array([_changes(lead, length) for lead in LEADS.tolist()]))
        for length in ("unstrained", "stretched")
    )
    return LeadFigure(
        name="lead",
        title="Change of stiffness, 100 N to 800 N, over the lead of the cables, EA = 48 kN",
        leads=LEADS,
        pseudoinverse=unstrained[:, 0],
        along=unstrained[:, 1],
        stretched_pseudoinverse=stretched[:, 0],
        stretched_along=stretched[:, 1],
        claims=(
            Claim(
                figure="Fig. 4, lead",
                quantity="lead from which stiffness falls with tension",
                unit="mm",
                computed=_first_fall(stretched[:, 0], "stretched", 0),
                original=_first_fall(unstrained[:, 0], "unstrained", 0),
                along=_first_fall(unstrained[:, 1], "unstrained", 1),
                assumption="as Fig. 4, EA = 48 kN",
                searched=FROM_FIG_6,
            ),
        ),
    )


def _changes(lead: float, length: OriginalLength) -> Array:
    """Compute the change from the first to the second bound of :data:`MINIMA` (2, 3) [%].

    Row 0 is for K_R, row 1 for the stiffness that a small weight measures; columns are x, y, z.
    """
    arm = presets.virtual_prototype(presets.ELASTIC_STAGE, lead=lead, original_length=length)
    q = np.full(arm.nv, presets.TEN_DEGREES)
    first, last = (readings(at_minimum(arm, q, F)) for F in MINIMA)
    return np.asarray(100.0 * (last / first - 1.0))


def _first_fall(changes: Array, length: OriginalLength, reading: int) -> tuple[float, ...]:
    """Find the lead [mm] above which stiffness falls with tension, for x, y and z.

    It is 0 if stiffness falls with every lead. ``changes`` (N, 3) [%] belong to :data:`LEADS`;
    ``reading`` is the row of :func:`_changes` from which they come.
    """

    def crossing(axis: int) -> float:
        if changes[0, axis] < 0.0:
            return 0.0
        i = int(np.argmax(changes[:, axis] < 0.0))
        root = brentq(
            lambda lead: float(_changes(float(lead), length)[reading, axis]), LEADS[i - 1], LEADS[i]
        )
        return float(1e3 * root)

    return tuple(crossing(axis) for axis in range(3))
