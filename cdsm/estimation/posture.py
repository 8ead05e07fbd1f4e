"""The posture from tensions at the motors, wires and tracked points, by the balance of the arm.

Unknown are the joint coordinates θ, of which nothing is known before, and z = (δF of the load
cells, s of the holes), whose covariance is known. Least squares, each over its uncertainty, of

    δF,  s,  a_c(θ, T) − wire_c,  x_k(θ) − point_k,   so that   Σ_j T_j g_j + g + springs = Jᵀ W,

with the unstrained length a of the wire. The balance counts as known to a millionth of what the
load cells leave open of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from cdsm.applied import Applied, jacobian_at, position_at, without_cables
from cdsm.dead_loads import LinkPoint
from cdsm.errors import EquilibriumError, InvalidInput, listed
from cdsm.estimation.estimate import checked_readings, spread
from cdsm.estimation.holes import SlidingLike, holes_of, sliding_of
from cdsm.loads import LoadsLike, link_point, loads_of
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.statics.forward_statics import forward_statics
from cdsm.support.determination import chi_square_text, likely
from cdsm.support.format import aligned, place, with_uncertainty
from cdsm.support.result import Result, unit
from cdsm.support.validation import NO_WRENCH, checked_quantity, instance, vector
from cdsm.support.values import Array, frozen
from cdsm.terms import stiffness_of, torque_of

_EXACT = 1e-6  # standard deviation of the balance over that by the load cells
_TOLERANCE = 1e-12
_POINT_STD = 1e-3  # of the coordinates of a tracked point [m], if none is given
_WIRE_STD = 1e-4  # of the wire that the motors have left [m], if none is given


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PostureEstimate(Result):
    """Posture from tensions, wires and points; made by :func:`cdsm.estimate_posture`.

    Attributes:
        posture: The posture.
        angle_std: Standard uncertainty of the joint coordinates by the instruments (nv,) [rad].
        angle_band: Most by which friction of unknown direction can change them (nv,) [rad].
        tip_std: Standard uncertainty of the tip (3,) [m].
        tip_band: Most by which friction can change it (3,) [m].
        segment_tension: T of each segment (S,) [N].
        chi_square: χ² of load cells, holes, wires and points [-].
        freedom: Its degrees of freedom: numbers of wires and points.
    """

    _headline = "chi_square"

    posture: Posture
    angle_std: Array = field(metadata=unit("joint", "joint"))
    angle_band: Array = field(metadata=unit("joint", "joint"))
    tip_std: Array = field(metadata=unit("m", "axis"))
    tip_band: Array = field(metadata=unit("m", "axis"))
    segment_tension: Array = field(metadata=unit("N", "segment"))
    chi_square: float = field(metadata=unit("1"))
    freedom: int = field(metadata=unit("1"))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences with reasons not to trust the numbers; empty if there are none."""
        warnings = []
        pose = self.posture
        beyond = (pose.q < pose.arm.lower) | (pose.q > pose.arm.upper)
        if beyond.any():
            names = [pose.arm.joint_names[i] for i in np.flatnonzero(beyond)]
            warnings.append(
                f"beyond their limits, whose stops are not known here: {listed(names, 6)}"
            )
        if not likely(self.chi_square, self.freedom):
            warnings.append(
                f"the readings do not fit: {chi_square_text(self.chi_square, self.freedom)}. A "
                "load acts that is not known, or the model of the arm is wrong, or the standard "
                "uncertainties are too small."
            )
        return tuple(warnings)

    def _labels(self) -> dict[str, Any]:
        return {**super()._labels(), "segment": self.posture.segments.chains.segment_names}

    def __str__(self) -> str:
        tip = self.posture.tip[:3, 3]
        rows = [("tip [mm]", "value ± std", "friction ±")]
        for axis, x, std, band in zip("xyz", tip, self.tip_std, self.tip_band, strict=True):
            rows.append((axis, with_uncertainty(x, std, 1e-3), f"{1e3 * band:.2g}"))
        worst = int((self.angle_std + self.angle_band).argmax())
        arm = self.posture.arm
        of = arm.joint_units[worst]
        least = (
            f"known worst: {arm.joint_names[worst]}, ± {place(self.angle_std[worst], of)} std, "
            f"friction ± {place(self.angle_band[worst], of)}"
        )
        head = (
            f"posture of {arm.name} by the tensions of its cables and {self.freedom} numbers more"
        )
        left = chi_square_text(self.chi_square, self.freedom)
        return "\n".join([*self.warnings, head, *aligned(rows), least, left])


class _Point(NamedTuple):
    """A tracked point."""

    at: LinkPoint | None  # None: the tip
    position: Array  # (3,) [m]


class _Problem:
    """Least squares in x = (θ, δF and s in standard deviations)."""

    def __init__(
        self,
        pose: Posture,
        F: Array,
        std: Array,
        sliding: Array,
        known: Applied,
        wires: tuple[Array, Array] | None,
        points: list[_Point],
        point_std: float,
    ) -> None:
        self.arm = pose.arm
        self.F = F
        self.std = std
        self.sliding = sliding
        self.known = known
        self.wires = wires
        self.points = points
        self.point_std = point_std
        self.behind = pose.segments.chains.behind
        self.cable = pose.segments.chains.cable
        self.start = pose.segments.chains.start
        self.taut = F > 0.0
        holes = holes_of(pose, sliding, self.taut)
        self.bound = holes.bound
        self.open = _root(holes.covariance - holes.known)
        self.tenth = _root(holes.known)
        self.root = np.hstack([self.open, self.tenth])
        G = pose.segments.length_jacobian
        pull = np.zeros((F.size, pose.q.size))
        np.add.at(pull, self.cable, G)
        self.exact = _EXACT * float(np.linalg.norm(pull * std[:, None], axis=0).max())
        self._at: tuple[bytes, tuple[Posture, Array, Array, Array]] | None = None

    def residuals(self, x: Array) -> Array:
        return self._evaluate(x)[2]

    def jacobian(self, x: Array) -> Array:
        return self._evaluate(x)[3]

    def at(self, x: Array) -> tuple[Posture, Array]:
        pose, T, _, _ = self._evaluate(x)
        return pose, T

    def _evaluate(self, x: Array) -> tuple[Posture, Array, Array, Array]:
        key = x.tobytes()
        if self._at is None or self._at[0] != key:
            self._at = key, self._computed(x)
        return self._at[1]

    def _computed(self, x: Array) -> tuple[Posture, Array, Array, Array]:
        nv, C = self.arm.nv, self.F.size
        pose = self.arm.at(x[:nv], check_limits=False)
        segments = pose.segments
        holes = holes_of(pose, self.sliding, self.taut)
        growth = np.exp(self.behind @ (holes.mean + self.root @ x[nv + C :]))
        T = (self.F + self.std * x[nv : nv + C])[self.cable] * growth
        chains = segments.chains
        turned = -self.sliding * chains.friction * self.taut[self.cable[chains.hole]]
        by_q = T[:, None] * (self.behind @ (turned[:, None] * segments.wrap_jacobian))
        by_cell = np.zeros((T.size, C))
        by_cell[np.arange(T.size), self.cable] = growth * self.std[self.cable]
        by_hole = T[:, None] * (self.behind @ self.root)
        dT = np.hstack([by_q, by_cell, by_hole])
        terms = without_cables(pose, self.known)
        G = segments.length_jacobian
        missing = T @ G + torque_of(terms, pose)
        slope = G.T @ dT
        slope[:, :nv] += segments.active(T) + stiffness_of(terms, pose)
        rows = [missing / self.exact, x[nv:]]
        slopes = [slope / self.exact, np.eye(x.size)[nv:]]
        if self.wires is not None:
            wire, std = self.wires
            laws = chains.laws
            own = laws.original_lengths(segments.lengths, T)
            k = laws.stiffness(segments.lengths, T)
            stretch = (segments.lengths - laws.series * (T - laws.rest)) / own
            first = self.start[:-1]
            rows.append((np.add.reduceat(own, first) - wire) / std)
            change = G / stretch[:, None]
            by_tension = dT / (k * stretch)[:, None]
            each = -by_tension
            each[:, :nv] += change
            slopes.append(np.add.reduceat(each, first, axis=0) / std[:, None])
        for point in self.points:
            moved = np.zeros((3, x.size))
            moved[:, :nv] = jacobian_at(pose, point.at)[:3]
            rows.append((position_at(pose, point.at) - point.position) / self.point_std)
            slopes.append(moved / self.point_std)
        return pose, T, np.concatenate(rows), np.vstack(slopes)


def estimate_posture(
    arm: Manipulator,
    motor_tensions: ArrayLike,
    *,
    tension_std: ArrayLike | None = None,
    points: Mapping[str, ArrayLike] | None = None,
    point_std: float | None = None,
    rest_lengths: ArrayLike | None = None,
    rest_length_std: ArrayLike | None = None,
    sliding: SlidingLike | None = None,
    wrench: LoadsLike = NO_WRENCH,
    start: ArrayLike | None = None,
) -> PostureEstimate:
    """Estimate the posture from the tensions at the motors, and from wires or tracked points.

    The tensions alone give it where springs or a backbone bring the arm to rest; more readings make
    it surer, and χ² says whether they agree. Wires or points make up for tensions that hold no
    posture.

    Args:
        arm: The arm.
        motor_tensions: F (C,) [N], read at the motors.
        tension_std: Standard uncertainty of the load cells [N], as for :func:`estimate_load`.
        points: Positions (3,) [m] in base axes of links that were tracked: of the centre of the
            disk of a link, or of the origin of its frame, as for :class:`~cdsm.Load`.
        point_std: Standard uncertainty of each of their coordinates [m]. Default: 1 mm.
        rest_lengths: Unstrained wire that the motors have left (C,) [m].
        rest_length_std: Its standard uncertainty [m], with that of EA: one number, or (C,).
            Default: 0.1 mm.
        sliding: How each cable last slid in its holes, as for :func:`estimate_load`.
        wrench: Loads that are known, as for :func:`~cdsm.stiffness`.
        start: Angles near the posture (nv,) [rad]. Default: where the arm rests without friction.

    Raises:
        InvalidInput: A shape, a link or a number is wrong; or an uncertainty is given of readings
            that are not.
        EquilibriumError: The arm has no rest at these tensions, give ``start``; or the search from
            there ended nowhere.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.rod_one_tendon(82e9, friction=0.08)
        >>> found = cdsm.estimate_posture(arm, [5.2522], tension_std=0.02, sliding=1)
        >>> (1e3 * found.posture.tip[:2, 3]).round(1).tolist()
        [102.1, 188.4]
    """
    instance("arm", arm, Manipulator)
    W = loads_of(arm, wrench)
    pose = _begin(arm, motor_tensions, wrench, start)
    readings = checked_readings(pose, motor_tensions, tension_std, 0.0, sliding, NO_WRENCH)
    wires = _wires(arm, rest_lengths, rest_length_std)
    tracked = _tracked(arm, points, point_std)
    problem = _Problem(
        pose,
        readings.motor_tension,
        readings.instruments.tension,
        sliding_of(pose, sliding),
        W,
        wires,
        tracked,
        checked_quantity("point_std", _POINT_STD if point_std is None else point_std, "length"),
    )
    x = np.concatenate([pose.q, np.zeros(len(arm.cables) + problem.root.shape[1])])
    solved = least_squares(
        problem.residuals, x, problem.jacobian, method="lm", xtol=_TOLERANCE, ftol=_TOLERANCE,
        gtol=_TOLERANCE, x_scale="jac",
    )  # fmt: skip
    missing = problem.residuals(solved.x)[: arm.nv]
    if not solved.success or abs(missing).max() > 1.0:
        raise EquilibriumError(
            "the search for the posture found no balance",
            missing * problem.exact,
            1.0,
            arm.joint_names[int(abs(missing).argmax())],
            "Give start=, angles near the posture; or check tensions, wires and points.",
        )
    return _estimate(problem, solved.x)


def _begin(
    arm: Manipulator, motor_tensions: ArrayLike, wrench: LoadsLike, start: ArrayLike | None
) -> Posture:
    """Return the posture to start from: the given one, or where the arm rests without friction."""
    begin: ArrayLike
    if start is None:
        F = vector("motor_tensions", motor_tensions, len(arm.cables), "one reading [N] per cable")
        begin = forward_statics(
            arm, tension=np.maximum(F, 0.0), wrench=wrench, friction=False
        ).pose.q
    else:
        begin = vector("start", start, arm.nv, "one angle per joint")
    return arm.at(begin, check_limits=False)


def _wires(
    arm: Manipulator, rest_lengths: ArrayLike | None, std: ArrayLike | None
) -> tuple[Array, Array] | None:
    """Return the wires (C,) [m] that the motors have left, and their standard uncertainties."""
    if rest_lengths is None:
        if std is not None:
            raise InvalidInput("rest_length_std", "is of rest_lengths, which are not given.")
        return None
    names = arm.cables.names
    wire = vector("rest_lengths", rest_lengths, len(names), "one length [m] per cable", "length")
    of_wire = _WIRE_STD if std is None else std
    return wire, spread("rest_length_std", of_wire, names, "length", "a wire is not exact")


def _tracked(
    arm: Manipulator, points: Mapping[str, ArrayLike] | None, std: float | None
) -> list[_Point]:
    """Return the points that were tracked."""
    seen: Any = {} if points is None else points
    if not isinstance(seen, Mapping):
        wanted = "give a dict of positions (3,) [m] by the names of links."
        raise InvalidInput("points", f"{points!r} given; {wanted}")
    if not seen and std is not None:
        raise InvalidInput("point_std", "is of points, which are not given.")
    return [
        _Point(
            link_point(arm, link), vector(f"points[{link!r}]", x, 3, "a point (3,) [m]", "length")
        )
        for link, x in seen.items()
    ]


def _estimate(problem: _Problem, x: Array) -> PostureEstimate:
    """Return what a solution says, with its uncertainty to first order."""
    there, T = problem.at(x)
    nv = problem.arm.nv
    left = problem.residuals(x)
    gain = np.linalg.pinv(problem.jacobian(x))[:nv]
    cells = nv + len(problem.arm.cables)
    free = problem.open.shape[1]
    by_open = gain[:, cells : cells + free] @ np.linalg.pinv(problem.open)
    others = np.delete(gain, np.r_[cells : cells + free], axis=1)
    J = there.jacobian[:3]
    return PostureEstimate(
        posture=there,
        angle_std=frozen(np.linalg.norm(others, axis=1)),
        angle_band=frozen(abs(by_open) @ problem.bound),
        tip_std=frozen(np.linalg.norm(J @ others, axis=1)),
        tip_band=frozen(abs(J @ by_open) @ problem.bound),
        segment_tension=frozen(np.maximum(T, 0.0)),
        chi_square=float(left[nv:] @ left[nv:]),
        freedom=left.size - x.size,
    )


def _root(covariance: Array) -> Array:
    """Return R with R Rᵀ = covariance and as many columns as its rank."""
    size, vectors = np.linalg.eigh(covariance)
    kept = size > 1e-12 * size.max(initial=0.0)
    return np.asarray(vectors[:, kept] * np.sqrt(size[kept]))
