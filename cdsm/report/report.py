"""Everything that says whether a stiffness can be trusted, in one value."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, final

import numpy as np

from cdsm.errors import SingularStiffness
from cdsm.report import facts, remarks
from cdsm.report.facts import CableState, Optimality, Rank, Readings
from cdsm.report.page import page, to_document, to_fragment, to_text
from cdsm.report.potential import joint_unit
from cdsm.report.self_check import SelfCheck, self_check
from cdsm.support.format import JointUnits, key
from cdsm.support.values import Array, ReadOnlyState

if TYPE_CHECKING:
    from cdsm.stiffness_matrix import Stiffness


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Report(ReadOnlyState):
    """Whether a stiffness can be trusted, and why; made by :meth:`Stiffness.report`.

    Attributes:
        stiffness: The one in question.
        self_check: It and its terms against central differences at this very posture.
        residual: Largest |J_Lᵀ F + g − J_Xᵀ W| [N m], what is left of Eq. 13; a joint that slides
            counts with the arm's length as lever.
        residual_joint: Name of the joint where it is.
        imbalance: That over the torques it is a sum of [-].
        optimality: How well the tensions meet Eq. 17; None if they were given, not distributed.
        cables: Where each cable stands in its law.
        jacobian_rank: Rank and condition of J_X.
        translation_rank: Those of its linear rows.
        cable_rank: Those of J_Lᵀ: whether the cables give every joint torque.
        closure: Least over largest of tensions without a torque [-]: zero if none pulls all cables.
        readings: The three stiffnesses at the tip side by side; None if K_θ is singular.
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

    @cached_property
    def faults(self) -> tuple[str, ...]:
        """Why the stiffness is not to be trusted, a sentence each; empty if it is."""
        return remarks.faults(self)

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """What to know beside it, a sentence each: slack cables, laws that end, readings apart."""
        return remarks.notes(self)

    @property
    def warnings(self) -> tuple[str, ...]:
        """All there is to say: :attr:`faults`, then :attr:`notes`."""
        return (*self.faults, *self.notes)

    @property
    def trustworthy(self) -> bool:
        """Whether nothing failed.

        That is: the self-check could be made of every term, their sum and the torque, and agreed;
        the tensions balance the arm to 1e-6 of its torques; K_θ is positive definite by more than
        rounding; and tensions that were distributed are the least within their bounds. Notes do not
        count: a stiffness beside them is right, if it is read as they say.
        """
        return not self.faults

    @property
    def margin(self) -> float:
        """Smallest eigenvalue of the symmetric part of K_θ [N m/rad]; [N/m] where joints slide."""
        return self.stiffness.margin

    @property
    def critical_direction(self) -> Array:
        """Unit joint motion (nv,) of it: how the arm gives way first."""
        return self.stiffness.critical_direction

    @cached_property
    def condition(self) -> float:
        """Largest over smallest singular value of K_θ [-], joints that slide in arm lengths."""
        unit = joint_unit(self.stiffness.posture.arm)
        values = np.linalg.svd(self.stiffness.joint * unit[:, None] * unit, compute_uv=False)
        return float(values[0] / values[-1]) if values[-1] > 0.0 else math.inf

    def to_dict(self) -> dict[str, object]:
        """Everything it says as plain SI numbers, ready for strict JSON.

        Null where a number is infinite or does not exist.
        """
        K = self.stiffness
        arm = K.posture.arm
        values: dict[str, object] = {
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
            "optimality": None if self.optimality is None else _optimality_to_json(self.optimality),
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
        }
        return {name: _plain(value) for name, value in values.items()}

    def to_html(self) -> str:
        """The report as an HTML file that needs no other."""
        return to_document(page(self))

    def __repr__(self) -> str:
        state = "trustworthy" if self.trustworthy else "NOT TO BE TRUSTED"
        return f"<Report on the stiffness of {self.stiffness.posture.arm.name}, {state}>"

    def __str__(self) -> str:
        return to_text(page(self))

    def _repr_html_(self) -> str:
        return to_fragment(page(self))


def report_on(K: Stiffness) -> Report:
    """Measure and derive everything a report holds.

    Args:
        K: The stiffness in question.
    """
    residual, joint, imbalance = facts.imbalance(K)
    try:
        readings = facts.readings(K)
    except SingularStiffness:
        readings = None
    pull = K.distribution
    return Report(
        stiffness=K,
        self_check=self_check(K),
        residual=residual,
        residual_joint=joint,
        imbalance=imbalance,
        optimality=None if pull is None else facts.optimality(K, pull),
        cables=facts.cable_states(K),
        jacobian_rank=facts.jacobian_rank(K),
        translation_rank=facts.translation_rank(K),
        cable_rank=facts.cable_rank(K),
        closure=facts.closure(K),
        readings=readings,
    )


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


def _optimality_to_json(optimality: Optimality) -> dict[str, object]:
    return {**asdict(optimality), "optimal": optimality.optimal}


def _plain(value: object) -> object:
    """As JSON has it: lists for tuples and arrays, null for what is not finite."""
    if isinstance(value, dict):
        return {name: _plain(each) for name, each in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    if isinstance(value, float):  # numpy's too
        return float(value) if math.isfinite(value) else None
    return value
