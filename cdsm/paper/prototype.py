"""One prototype for all that Section V measured: what it must have been like, if the model holds.

The paper prints 20 numbers of its prototype and not one dimension of it. Everything it leaves open
is a parameter here, within the bounds of :data:`BOUNDS`, and the parameters that explain the
numbers best are searched for. A stiffness misfits by factors, so its residual is the logarithm
ln(model/paper); that of a drop or rise is (model − paper)/paper.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import asdict, dataclass
from typing import Final, final

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from cdsm import presets
from cdsm._checks import Array, frozen
from cdsm.elasticity import LinearElasticity
from cdsm.errors import CdsmError, InvalidInput, SingularStiffness
from cdsm.manipulator import Manipulator
from cdsm.paper.section_v import (
    CHECK,
    DROPS,
    HYBRID,
    NAMES,
    POSTURE,
    RISES,
    TABLE_II,
    TENSIONS,
)
from cdsm.posture import Posture
from cdsm.stiffness import stiffness
from cdsm.tension import distribute_tension

_RIGID = LinearElasticity(1e12)  # a hybrid cable's stiffness is given as a whole

_LIMIT = math.radians(30.0)


@final
@dataclass(frozen=True, kw_only=True)
class Prototype:
    """What Section V leaves open. Of each pair the first cable is position-controlled.

    Attributes:
        link_length: Of the links between the joints [m].
        tool_length: From the last joint to where the weights hang [m].
        hole_radius: R [m]. The disk offset is R tan 15°: disks touch at ±30°, the stated limit.
        lead: Of all cables, before the base disk [m].
        link_mass: Of every link [kg].
        drive_stiffness: In series with every strand [N/m].
        tension_offset: Tension of the force-controlled cables beyond the value reported [N].
        angle_1: Joint angles of the second configuration of Figs. 12 and 13 [rad]; the first is
            assumed to be that of Table II.
        angle_2: [rad].
        angle_3: [rad].
        spring_ratio: Stiffness of the stiffest over that of the softest hybrid cable (Fig. 11
            shows it as a picture only) [-].
        hybrid_tension: At which Fig. 13 and the accuracy check were made [N]. The check's cables
            are not named either; they are assumed to be the hybrid ones of 1.89 N/mm.
        highest_hybrid_tension: Up to which Fig. 12 goes [N]; from 3 N, as Table II.
    """

    link_length: float
    tool_length: float
    hole_radius: float
    lead: float
    link_mass: float
    drive_stiffness: float
    tension_offset: float
    angle_1: float
    angle_2: float
    angle_3: float
    spring_ratio: float
    hybrid_tension: float
    highest_hybrid_tension: float

    @property
    def configurations(self) -> tuple[Array, Array]:
        """Joint angles (3,) of the two configurations of Figs. 12 and 13 [rad]."""
        return POSTURE, np.array([self.angle_1, self.angle_2, self.angle_3])

    def arm(self, cable_stiffness: float | None = None) -> Manipulator:
        """The arm with the 1×19 strand, or with hybrid cables of one stiffness [N/m].

        Raises:
            GeometryError: No such arm can be.
        """
        return presets.experimental_prototype(
            presets.STRAND_1X19 if cable_stiffness is None else _RIGID,
            series_stiffness=self.drive_stiffness if cable_stiffness is None else cable_stiffness,
            link_length=self.link_length,
            tool_length=self.tool_length,
            hole_radius=self.hole_radius,
            disk_offset=self.hole_radius * math.tan(_LIMIT / 2.0),
            lead=self.lead,
            link_mass=self.link_mass,
        )

    def measure(self, pose: Posture, tensions: ArrayLike) -> Array:
        """Stiffness (N, 3) [N/m] along x, y, z with the force-controlled cables at N tensions [N].

        Raises:
            CdsmError: No tension of the position-controlled cables balances the arm, or it leaves
                the domain of their elasticity, or the arm is unstable.
        """
        rows = []
        for tension in np.atleast_1d(np.asarray(tensions, dtype=np.float64)):
            actual = float(tension) + self.tension_offset
            held = {c.name: actual for c in pose.arm.cables if c.control == "force"}
            K = stiffness(pose, distribute_tension(pose, fixed=held))
            if not K.is_stable:
                raise SingularStiffness(
                    f"the arm buckles at {tension:g} N: its smallest stiffness is "
                    f"{K.margin:.3g} N m/rad. Lower the tension, or take stiffer cables.",
                    K.critical_direction,
                )
            rows.append([K.along(axis) for axis in np.eye(3)])
        return np.array(rows)

    def predict(self) -> Predicted:
        """What this prototype would have shown.

        Raises:
            CdsmError: It cannot hold itself in one of the experiments; see :meth:`measure`.
        """
        table = self.measure(self.arm().at(POSTURE), TENSIONS)
        soft, stiff = self.arm(HYBRID), self.arm(HYBRID * self.spring_ratio)
        drops, rises = [], []
        for q in self.configurations:
            pose = soft.at(q)
            low, middle, high = self.measure(
                pose, [TENSIONS[0], self.hybrid_tension, self.highest_hybrid_tension]
            )
            drops.append(float(1.0 - high[1] / low[1]))
            rises.append(
                float(self.measure(stiff.at(q), self.hybrid_tension)[0, 1] / middle[1] - 1.0)
            )
            if q is POSTURE:
                check = float(middle[2])
        return Predicted(table=frozen(table), drops=tuple(drops), rises=tuple(rises), check=check)


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Predicted:
    """The 20 numbers of Section V.

    Attributes:
        table: Table II (5, 3) [N/m].
        drops: Of Fig. 12 (2,) [-].
        rises: Of Fig. 13 (2,) [-].
        check: Of Section V-B [N/m].
    """

    table: Array
    drops: tuple[float, ...]
    rises: tuple[float, ...]
    check: float

    def residuals(self) -> Array:
        """ln(model/paper) of each stiffness, (model − paper)/paper of each drop and rise (20,)."""
        return np.concatenate(
            [
                np.log(self.table / TABLE_II).ravel(),
                np.divide(self.drops, DROPS) - 1.0,
                np.divide(self.rises, RISES) - 1.0,
                [math.log(self.check / CHECK)],
            ]
        )


BOUNDS: Final[dict[str, tuple[float, float]]] = {
    "link_length": (0.03, 0.15),
    "tool_length": (0.03, 0.3),
    "hole_radius": (0.015, 0.05),
    "lead": (0.0, 0.5),
    "link_mass": (0.05, 1.0),
    "drive_stiffness": (1e5, 1e7),
    "tension_offset": (0.0, 20.0),
    "angle_1": (-_LIMIT, _LIMIT),
    "angle_2": (-_LIMIT, _LIMIT),
    "angle_3": (-_LIMIT, _LIMIT),
    "spring_ratio": (5.0, 15.0),
    "hybrid_tension": (3.0, 86.0),
    "highest_hybrid_tension": (10.0, 86.0),
}
"""What a prototype of that kind can be, in SI units; the tensions as far as Table II goes."""

START: Final = Prototype(
    link_length=0.031,
    tool_length=0.295,
    hole_radius=0.0495,
    lead=0.085,
    link_mass=0.98,
    drive_stiffness=9.5e6,
    tension_offset=17.5,
    angle_1=-0.51,
    angle_2=-0.51,
    angle_3=0.12,
    spring_ratio=8.0,
    hybrid_tension=3.5,
    highest_hybrid_tension=34.0,
)
"""Near where searches over the whole of :data:`BOUNDS` end; a search from here is short."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class PrototypeFit:
    """The prototype that explains the numbers best, and how well.

    Attributes:
        prototype: The parameters found.
        predicted: Its numbers.
        residuals: As :meth:`Predicted.residuals` (20,), in the order of :data:`NAMES`.
        without: Names that did not count in the search.
        at_bound: Names of parameters on a bound: the numbers want them there or beyond.
    """

    prototype: Prototype
    predicted: Predicted
    residuals: Array
    without: tuple[str, ...]
    at_bound: tuple[str, ...]

    @property
    def cost(self) -> float:
        """Sum of the squared residuals that counted [-]."""
        counted = [name not in self.without for name in NAMES]
        return float(np.sum(self.residuals[counted] ** 2))


def identify_prototype(start: Prototype = START, *, without: Collection[str] = ()) -> PrototypeFit:
    """Search the parameters within :data:`BOUNDS` that explain Section V best: min Σ r².

    Args:
        start: Where to start.
        without: Names in :data:`NAMES` that shall not count.

    Raises:
        InvalidInput: A start out of bounds, or an arm there that cannot hold itself.
    """
    low, high = np.array([_scaled(name, limits) for name, limits in BOUNDS.items()]).T
    counted = np.array([name not in without for name in NAMES])

    def prototype(point: Array) -> Prototype:
        values = dict(zip(BOUNDS, (low + point * (high - low)).tolist(), strict=True))
        values[_DECADES] = math.exp(values[_DECADES])
        return Prototype(**values)

    def residuals(point: Array) -> Array:
        try:
            return np.asarray(prototype(point).predict().residuals()[counted])
        except CdsmError:  # no such arm: the search steps back from infinite residuals
            return np.full(int(counted.sum()), math.inf)

    given = np.array([_scaled(name, value) for name, value in asdict(start).items()])
    point = (given - low) / (high - low)
    if not ((point > 0.0) & (point < 1.0)).all():
        raise InvalidInput("start", f"{start} is not within {BOUNDS}.")
    if not np.isfinite(residuals(point)).all():
        raise InvalidInput("start", f"{start} cannot hold itself. Start elsewhere.")
    found = least_squares(
        residuals, point, bounds=(0.0, 1.0), diff_step=1e-5, ftol=1e-6, xtol=1e-5, max_nfev=60
    )
    best = prototype(found.x)
    predicted = best.predict()
    at_bound = (found.x < _NEAR) | (found.x > 1.0 - _NEAR)
    return PrototypeFit(
        prototype=best,
        predicted=predicted,
        residuals=frozen(predicted.residuals()),
        without=tuple(without),
        at_bound=tuple(name for name, on in zip(asdict(best), at_bound, strict=True) if on),
    )


_DECADES = "drive_stiffness"
"""The parameter whose bounds are decades apart: it is searched by its logarithm."""


def _scaled(name: str, value: ArrayLike) -> Array:
    """A parameter, or its bounds, as it is searched."""
    values = np.asarray(value, dtype=np.float64)
    return np.asarray(np.log(values)) if name == _DECADES else values


_NEAR = 0.02
"""Part of its range within which a parameter counts as on its bound."""
