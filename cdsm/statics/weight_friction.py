"""Weight tests with friction in the holes: which weight measures which stiffness."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np

from cdsm.errors import CdsmError
from cdsm.friction.breakaway import Breakaway
from cdsm.statics.load_cycle import slow_loading
from cdsm.statics.load_history import LoadHistory
from cdsm.statics.slow_loading import Load, State
from cdsm.support.format import plural
from cdsm.support.values import ReadOnlyState

SLIDING = 1.25
"""The arm slides where its tangent stiffness is at most this times the frictionless one."""

_GROWTH, _MOST = 1.25, 100.0
"""Ratio of each trial load to the one before; ratio of the largest one to the breakaway load."""

_HALVINGS = 6  # number of bisections of the load from which the arm slides; they reach 0.4 %


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class WeightFriction(ReadOnlyState):
    """Loads and stiffnesses of a weight test on an arm with friction in its holes.

    Attributes:
        breakaway: Load in the direction of the weight below which no cable slides, and the hole
            that slides first.
        frictionless: Tangent stiffness in the direction of the weight, computed without friction
            and without the weight [N/m].
        frictionless_secant: Weight divided by tip displacement along it, computed without friction
            [N/m].
        history: The states while the weight is applied in steps; entry 0 is the arm without the
            weight.
    """

    breakaway: Breakaway
    frictionless: float
    frictionless_secant: float
    history: LoadHistory

    @property
    def stuck(self) -> float:
        """Tangent stiffness [N/m] along the weight while it is so small that all cables stick."""
        return self.breakaway.stiffness.along(self.breakaway.direction)

    @property
    def secant(self) -> float:
        """Weight divided by tip displacement along it, with friction [N/m]; inf without motion."""
        tip, u = self.history.tip, self.breakaway.direction
        moved = float((tip[-1] - tip[0]) @ u)
        return self.weight / moved if moved else math.inf

    @cached_property
    def sliding_load(self) -> float:
        """Weight [N] from which the arm slides: its tangent stiffness is near the frictionless one.

        The tangent stiffness is then at most 1.25 times :attr:`frictionless`. The load is 0 without
        friction. It is inf if the arm does not slide up to 100 times the breakaway load, or if
        before that the search finds no equilibrium or a tension leaves the domain of its law.
        """
        first, u = self.breakaway.load, self.breakaway.direction
        if not 0.0 < first < math.inf:
            return first
        pose, F = self.history.reference, self.history.reference_tension
        loading = slow_loading(pose, F, self.breakaway.stiffness.wrench, 1e-2)
        state = loading.begin(F, self.breakaway.stiffness.wrench)
        start, none = self.history.wrenches[0], np.zeros(pose.q.size)

        def loaded(before: State, load: float) -> State:
            wrench = start + np.append(load * u, np.zeros(3))
            target = Load(wrench, none, before.load.motors)
            return loading.carry(before, target, f"{load:.4g} N")[0]

        def slides(state: State) -> bool:
            J = state.pose.jacobian[:3]
            compliance = u @ J @ np.linalg.solve(state.settled.stiffness, J.T @ u)
            return bool(SLIDING * self.frictionless * compliance >= 1.0)

        load = first
        try:
            before = loaded(state, load)
            while not slides(after := loaded(before, load * _GROWTH)):
                before, load = after, load * _GROWTH
                if load > _MOST * first:
                    return math.inf
            high = load * _GROWTH
            for _ in range(_HALVINGS):
                middle = math.sqrt(load * high)
                state = loaded(before, middle)
                load, before, high = (
                    (load, before, middle) if slides(state) else (middle, state, high)
                )
        except (CdsmError, np.linalg.LinAlgError):  # it buckles, or leaves the law of its wire
            return math.inf
        return high

    @property
    def weight(self) -> float:
        """The weight [N]."""
        wrenches = self.history.wrenches
        return float(np.linalg.norm((wrenches[-1] - wrenches[0])[:3]))

    def to_dict(self) -> dict[str, object]:
        """Return the loads and stiffnesses in SI, with units in the keys."""
        return {
            "stuck_below_N": self.breakaway.load,
            "stuck_stiffness_N_per_m": self.stuck,
            "sliding_from_N": self.sliding_load,
            "frictionless_stiffness_N_per_m": self.frictionless,
            "frictionless_secant_stiffness_N_per_m": self.frictionless_secant,
            "secant_stiffness_N_per_m": self.secant,
            "sliding_holes": self.sliding_holes,
            "holes": self.history.sliding.shape[1],
        }

    @property
    def sliding_holes(self) -> int:
        """Number of holes in which cables slide under the weight."""
        return int(np.count_nonzero(self.history.sliding[-1]))

    def __str__(self) -> str:
        frictionless, first = self.frictionless / 1000.0, self.breakaway.load
        if first == 0.0:
            return "friction holds no cable here: the cables go straight through all holes"
        stuck = f"{self.stuck / 1000.0:.4g} N/mm"
        rows = [f"below {first:.4g} N all cables stick: a weight measures {stuck}"]
        if math.isinf(self.sliding_load):
            rows.append("no weight was found from which the arm slides")
        else:
            rows.append(
                f"at {self.sliding_load:.4g} N they slide: the tangent there is at most "
                f"{100.0 * (SLIDING - 1.0):.0f} % above the frictionless {frictionless:.4g} N/mm "
                "before the weight"
            )
        rows.append(
            f"this weight, {self.weight:.4g} N, measures {self.secant / 1000.0:.4g} N/mm; "
            f"{self.sliding_holes} of {plural(self.history.sliding.shape[1], 'hole')} slide"
        )
        if math.isfinite(self.sliding_load):
            rows.append(
                f"so take the difference of two weights above {self.sliding_load:.3g} N, and "
                "compare it with theirs without friction; this weight alone would measure "
                f"{self.frictionless_secant / 1000.0:.4g} N/mm without friction"
            )
        return "\n".join(rows)
