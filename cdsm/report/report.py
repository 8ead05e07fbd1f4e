"""The report on a stiffness: every check, and whether the stiffness can be trusted."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, final

import numpy as np

from cdsm.errors import SolverError
from cdsm.report import facts, remarks
from cdsm.report.facts import CableState, Rank, Readings, Sticking
from cdsm.report.optimality import Optimality, optimality
from cdsm.report.page import to_document, to_fragment, to_text
from cdsm.report.potential import joint_unit
from cdsm.report.self_check import SelfCheck, self_check
from cdsm.support.format import JointUnits, key, plain
from cdsm.support.values import Array, ReadOnlyState

if TYPE_CHECKING:
    from cdsm.stiffness_matrix import Stiffness


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Report(ReadOnlyState):
    """Report that shows whether a stiffness can be trusted; made by :meth:`Stiffness.report`.

    Attributes:
        stiffness: The stiffness to check.
        self_check: Comparison of K_θ and its terms with central differences at this posture.
        residual: Largest residual |J_Lᵀ F + g − J_Xᵀ W| of Eq. 13 [N m]; the force at a prismatic
            joint is multiplied by the arm's length.
        residual_joint: Name of the joint with the largest residual.
        imbalance: ``residual`` divided by the largest entry of |J_L|ᵀ F + |J_X|ᵀ |W| + |g| [-].
        optimality: Optimality conditions of Eq. 17; None if the tensions were not distributed.
        cables: Tension, stiffness and domain of each cable.
        jacobian_rank: Rank and condition number of J_X.
        translation_rank: Rank and condition number of the linear rows of J_X.
        cable_rank: Rank and condition number of J_Lᵀ; full if cables can give every joint torque.
        closure: Largest ratio min(n)/max(n) [-] of tensions n that cause no joint torque; zero if
            the arm cannot be pretensioned with all cables, NaN if HiGHS fails.
        readings: The three tip stiffnesses along the base axes; None if K_θ is singular.
        sticking: Tip stiffnesses under loads too small to make a cable slide; None if no cable
            sticks, K_θ is singular, or a tension is outside the domain of its law.
    """

    stiffness: Stiffness
    self_check: SelfCheck
    residual: float
    residual_joint: str
    imbalance: float
    optimality: Optimality | None
    cables: tuple[CableState, ...]
    jacobian_rank: Rank
    translation_rank: Rank
    cable_rank: Rank
    closure: float
    readings: Readings | None
    sticking: Sticking | None

    @cached_property
    def faults(self) -> tuple[str, ...]:
        """Return the reasons not to trust the stiffness, a text for each; empty if none."""
        return tuple(remarks.faults(self))

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """Return notes on how to read the stiffness, one text each, e.g. that a cable is slack."""
        return tuple(remarks.notes(self))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Return :attr:`faults`, then :attr:`notes`."""
        return (*self.faults, *self.notes)

    @property
    def trustworthy(self) -> bool:
        """Return whether there are no faults.

        Without faults, the self-check agrees for every term, their sum and the torque; the residual
        of the balance is at most 1e-6 of the torques; K_θ is positive definite by more than
        rounding; and distributed tensions are the least within their bounds. Notes are ignored:
        they say how to read the stiffness.
        """
        return not self.faults

    @property
    def margin(self) -> float:
        """Smallest eigenvalue of K_θ's symmetric part [N m/rad], [N/m] for prismatic joints."""
        return self.stiffness.margin

    @property
    def critical_direction(self) -> Array:
        """Return the unit eigenvector (nv,) of :attr:`margin`: the softest joint motion."""
        return self.stiffness.critical_direction

    @cached_property
    def condition(self) -> float:
        """Return the condition number of K_θ [-], made dimensionless with the arm's length."""
        unit = joint_unit(self.stiffness.posture.arm)
        values = np.linalg.svd(self.stiffness.joint * unit[:, None] * unit, compute_uv=False)
        return float(values[0] / values[-1]) if values[-1] > 0.0 else math.inf

    def to_dict(self) -> dict[str, object]:
        """Return the report as plain SI numbers for strict JSON; None for infinity and NaN."""
        K = self.stiffness
        arm = K.posture.arm
        numbers = {
            "arm": arm.name,
            "trustworthy": self.trustworthy,
            "faults": self.faults,
            "notes": self.notes,
            "conventions": {
                "units": "SI: m, rad, N",
                "frame": "base",
                "tip": arm.tip_link,
                "gravity_m_per_s2": arm.gravity,
                "wrench_N_Nm": K.wrench,
                **JointUnits(arm.slides).to_dict(arm.joint_names, K.posture.q),
            },
            "self_check": {
                "passed": self.self_check.passed,
                "terms": [asdict(each) for each in self.self_check.compared],
            },
            "statics": {"residual_Nm": self.residual, "relative": self.imbalance},
            "optimality": None
            if self.optimality is None
            else {**asdict(self.optimality), "optimal": self.optimality.optimal},
            "stability": {
                "stable": K.is_stable,
                key("margin", arm.stiffness_unit()): self.margin,
                "critical_direction": self.critical_direction,
                "condition": self.condition,
            },
            "cables": [_cable_to_json(each) for each in self.cables],
            "rank": {
                name: {**asdict(rank), "condition": rank.condition}
                for name, rank in (
                    ("jacobian", self.jacobian_rank),
                    ("translation", self.translation_rank),
                    ("cables", self.cable_rank),
                )
            },
            "closure": self.closure,
            "readings_N_per_m": None if self.readings is None else asdict(self.readings),
            "sticking": None
            if self.sticking is None
            else {"along_N_per_m": self.sticking.along, "below_N": self.sticking.below},
        }
        return plain(numbers)

    def to_html(self, about: str = "") -> str:
        """Return the report as a self-contained HTML file.

        Args:
            about: Lines below the title, such as the file of the arm and the assumptions.
        """
        return to_document(self, about)

    def __repr__(self) -> str:
        state = "trustworthy" if self.trustworthy else "NOT TO BE TRUSTED"
        return f"<Report on the stiffness of {self.stiffness.posture.arm.name}, {state}>"

    def __str__(self) -> str:
        return to_text(self)

    def _repr_html_(self) -> str:
        return to_fragment(self)


def report_on(K: Stiffness) -> Report:
    """Compute the report on a stiffness."""
    residual, joint, imbalance = facts.balance_error(K)
    tip, translation, cables = facts.ranks(K)
    tension, readings = K.distribution, facts.readings(K)
    return Report(
        stiffness=K,
        self_check=self_check(K),
        residual=residual,
        residual_joint=joint,
        imbalance=imbalance,
        optimality=None if tension is None else optimality(K, tension),
        cables=facts.cable_states(K),
        jacobian_rank=tip,
        translation_rank=translation,
        cable_rank=cables,
        closure=_closure(K),
        readings=readings,
        sticking=facts.sticking(K, readings),
    )


def _closure(K: Stiffness) -> float:
    from cdsm.measures.closure import tension_ratio  # measures import the stiffness matrix

    try:
        return tension_ratio(K.posture.length_jacobian * joint_unit(K.posture.arm))
    except SolverError:
        return math.nan


def _cable_to_json(each: CableState) -> dict[str, object]:
    return {
        "name": each.name,
        "control": each.control,
        "slack": each.is_slack,
        "tension_N": each.tension,
        "stiffness_N_per_m": each.stiffness,
        "tangent_rigidity_N": each.tangent,
        "secant_rigidity_N": each.secant,
        "law_N": (each.low, each.high),
        "may_fall_N": each.below,
        "may_rise_N": each.above,
    }
