"""Curves of stiffness of the virtual prototype, as a function of Young's modulus or tension.

Every number is computed in three ways ("readings"): ``pseudoinverse`` (K_R) from EA/L with the
stretched length L, as in the paper; ``pseudoinverse`` from EA/l_0 with the original length l_0; and
``along`` from EA/l_0, the stiffness that a small weight at the tip measures.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Any, Final, Literal, NamedTuple, final

import numpy as np

from cdsm import presets
from cdsm.cable_laws import OriginalLength
from cdsm.manipulator import Manipulator
from cdsm.paper.claims import Claim, Figure, floats
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.values import Array, frozen
from cdsm.tension import distribute_tension
from cdsm.wires.elasticity import Elasticity

Part = Literal["active", "passive"]
Swept = Literal["young_modulus", "tension"]

FROM_FIG_6: Final = "prototype searched for Fig. 6"
"""Text of ``Claim.searched`` where the virtual prototype was chosen to meet Fig. 6."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Curve:
    """Stiffness in x, y and z as a function of a swept quantity, at N values.

    It has the total stiffness, and the part of the stiffness that comes from one term of K_θ. The
    ``part`` of the figure names this term.

    Attributes:
        label: Name of the curve in its figure.
        original_length: ``"stretched"`` for EA/L, ``"unstrained"`` for EA/l_0.
        swept: Swept quantity (N,): Young's modulus [Pa] or lower bound of tension [N].
        tension: Smallest, mean and largest cable tension (N, 3) [N].
        pseudoinverse: Diagonal of the paper's K_R (N, 3) [N/m].
        pseudoinverse_part: Diagonal of K_R computed from this term alone (N, 3) [N/m].
        along: Stiffness that a small weight measures along x, y, z (N, 3) [N/m].
        along_part: Contribution of this term to ``along`` (N, 3) [N/m].
    """

    label: str
    original_length: OriginalLength
    swept: Array
    tension: Array
    pseudoinverse: Array
    pseudoinverse_part: Array
    along: Array
    along_part: Array


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class StiffnessFigure(Figure):
    """A figure of stiffness as a function of Young's modulus or tension.

    Attributes:
        swept: ``"young_modulus"`` or ``"tension"``: the quantity on the horizontal axis.
        part: ``"active"`` or ``"passive"``: the term of K_θ that is shown in addition to the total.
        curves: Curves computed with the cable stiffness EA/L, L the stretched length, as in the
            paper.
        original: The same curves computed with EA/l_0, l_0 the original length.
        postures: Posture of each curve.
    """

    swept: Swept
    part: Part
    curves: tuple[Curve, ...]
    original: tuple[Curve, ...]
    postures: tuple[Posture, ...]

    def numbers(self) -> dict[str, object]:
        """Return the curves as plain SI numbers, for JSON."""
        swept = {"young_modulus": "young_modulus_Pa", "tension": "minimum_tension_N"}[self.swept]
        return {
            "postures_rad": [pose.q.tolist() for pose in self.postures],
            "curves": [
                {
                    "label": curve.label,
                    "original_length": curve.original_length,
                    swept: curve.swept.tolist(),
                    "tension_min_mean_max_N": curve.tension.tolist(),
                    "pseudoinverse_xyz_N_per_m": curve.pseudoinverse.tolist(),
                    "along_xyz_N_per_m": curve.along.tolist(),
                    f"{self.part}_part": {
                        "pseudoinverse_xyz_N_per_m": curve.pseudoinverse_part.tolist(),
                        "along_xyz_N_per_m": curve.along_part.tolist(),
                    },
                }
                for curve in (*self.curves, *self.original)
            ],
        }


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class LeadFigure(Figure):
    """Change of stiffness if the lower bound of tension rises from 100 N to 800 N, for each lead.

    The lead is the straight cable between its actuator and the base disk. Changes (N, 2, 3) are
    those of K_R (row 0) and of the stiffness that a small weight measures (row 1), in x, y and z.

    Attributes:
        leads: Leads of all cables (N,) [m].
        stretched: Changes (N, 2, 3) [%] with the stretched length, l_0 = L, as in the paper.
        original: Changes (N, 2, 3) [%] with the original length l_0.
    """

    leads: Array
    stretched: Array
    original: Array

    def numbers(self) -> dict[str, object]:
        """Return the leads [m] and the changes [%] as plain numbers, for JSON."""
        return {
            "lead_m": self.leads.tolist(),
            "stretched_change_percent": self.stretched.tolist(),
            "original_change_percent": self.original.tolist(),
        }


class Pair(NamedTuple):
    """The same curve computed twice, with two lengths in the cable stiffness."""

    stretched: Curve
    original: Curve
    posture: Posture

    def claim(
        self, measure: Callable[[Array, Array], Array], searched: str = FROM_FIG_6, **texts: Any
    ) -> Claim:
        """Build a claim; ``measure`` computes its numbers from each of the three readings.

        The arguments of ``measure`` are the stiffness (N, 3) and its active or passive part (N, 3)
        in one reading, both [N/m]. ``searched`` and ``texts`` are fields of the claim.
        """
        paper, original = self.stretched, self.original
        return Claim(
            computed=floats(measure(paper.pseudoinverse, paper.pseudoinverse_part)),
            original=floats(measure(original.pseudoinverse, original.pseudoinverse_part)),
            along=floats(measure(original.along, original.along_part)),
            searched=searched,
            **texts,
        )


def over_cases(
    label: str, q: Array, cases: Sequence[tuple[Elasticity, float]], swept: Array, part: Part
) -> Pair:
    """Compute the stiffness of the virtual prototype at a posture q (nv,) [rad] for N cases.

    A case is a law of the cables, and a lower bound of all tensions [N]. ``swept`` (N,) is the
    abscissa of the curves [Pa or N]. ``part`` is the term of K_θ whose part of the stiffness is
    computed in addition to the total.
    """

    def curve(length: OriginalLength) -> Curve:
        arm = cache(partial(presets.virtual_prototype, original_length=length))
        results = [at_minimum(arm(law), q, minimum) for law, minimum in cases]
        tensions = [K.tension for K in results]
        both = np.array([readings(K) for K in results])
        parts = [[getattr(K.shares(axis), part).sum() for axis in np.eye(3)] for K in results]
        return Curve(
            label=label,
            original_length=length,
            swept=frozen(np.array(swept)),
            tension=frozen(np.array([(F.min(), F.mean(), F.max()) for F in tensions])),
            pseudoinverse=frozen(both[:, 0].copy()),
            pseudoinverse_part=frozen(np.array([np.diag(K.pseudoinverse(part)) for K in results])),
            along=frozen(both[:, 1].copy()),
            along_part=frozen(np.array(parts)),
        )

    return Pair(curve("stretched"), curve("unstrained"), presets.virtual_prototype().at(q))


def over_minimum(label: str, law: Elasticity, q: Array, minima: Array) -> Pair:
    """Compute the stiffness and its active part for each lower bound in ``minima`` (N,) [N]."""
    return over_cases(label, q, [(law, minimum) for minimum in minima], minima, "active")


def at_minimum(arm: Manipulator, q: Array, minimum: float) -> Stiffness:
    """Compute the stiffness at q (nv,) [rad] under the least tensions above ``minimum`` [N]."""
    pose = arm.at(q)
    return stiffness(pose, distribute_tension(pose, minimum))


def readings(K: Stiffness) -> Array:
    """Return two tip stiffnesses in x, y, z (2, 3) [N/m].

    Row 0 is the diagonal of K_R, row 1 the stiffness that a small weight measures.
    """
    return np.array([np.diag(K.pseudoinverse()), [K.along(axis) for axis in np.eye(3)]])
