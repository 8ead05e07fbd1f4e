"""Loads, and tensions at the joints, from load cells at the motors and joint angles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.applied import Applied
from cdsm.errors import InvalidInput, listed
from cdsm.estimation.balanced_loads import (
    Instruments,
    LoadBalance,
    balance_loads,
)
from cdsm.estimation.components import Components, LinksLike, components_of
from cdsm.estimation.holes import Holes, SlidingLike, holes_of, sliding_of
from cdsm.estimation.result import LoadEstimate, TensionEstimate
from cdsm.loads import LoadsLike, loads_of
from cdsm.posture import Posture
from cdsm.support.determination import Determination
from cdsm.support.format import plural
from cdsm.support.validation import NO_WRENCH, SMALLEST, instance, number_array, vector
from cdsm.support.values import Array, frozen

_ASSUMED = 0.01  # standard uncertainty of load cells over their largest reading, if none is given
_NOISE = 3.0  # standard uncertainties by which a slack cable may read below 0 N
_NEAR = 2.0  # standard uncertainties of an angle within which a joint is at its stop
_PART = 0.01  # of a hidden combination, below which a component is told if nothing acts that way
_ROUNDING = 1e-9  # the same with exact angles [rad or m]


class CheckedReadings(NamedTuple):
    """What was read, and what is known besides."""

    pose: Posture
    motor_tension: Array  # F (C,) [N], 0 where a cable is slack
    read: Array  # as the load cells said it (C,) [N]
    instruments: Instruments
    assumed: bool  # whether the uncertainty of load cells is assumed
    known: Applied
    sliding: Array  # (P,)
    rows: NDArray[np.bool_]  # joints off their stops (nv,)


def estimate_load(
    pose: Posture,
    motor_tensions: ArrayLike,
    links: LinksLike | None = None,
    *,
    points: Mapping[str, ArrayLike] | None = None,
    tension_std: ArrayLike | None = None,
    angle_std: ArrayLike = 0.0,
    sliding: SlidingLike | None = None,
    wrench: LoadsLike = NO_WRENCH,
) -> LoadEstimate:
    """Estimate loads on links from the tensions at the motors and the joint angles.

    Behind hole i of a cable the tension is `e^{s_i}` times that before it, with `|s_i| ≤ μ β_i`.
    With `T_j = F_c exp(Σ s_i)` of each segment, its gradient `g_j`, and errors of F and θ, the
    loads follow from the balance by weighted least squares:

        `Σ_j T_j g_j + g + springs = Σ_k J_kᵀ W_k`.

    ``std`` of the result is what the instruments leave unknown, ``band`` what friction of unknown
    direction can hide at most. Which combinations of components are told how well is ``seen``;
    what the readings do not tell is named, and gets no number. Of an arm of 4 universal joints with
    μ = 0.1, 40 N and load cells of ±0.5 N, a force across it is known to some ±0.3 N and ±2 N of
    friction, one along it to ±1.4 N and ±14 N. Known directions take most of the friction away.

    Args:
        pose: The posture that was measured; ``arm.at(q, check_limits=False)`` takes angles that
            noise puts beyond a limit.
        motor_tensions: F (C,) [N], read at the motors.
        links: What is sought on each link: ``"force"``, ``"moment"``, ``"wrench"``, or rows of the
            wrench as numbers 0 to 5 or names ``fx`` to ``mz``. Default: the force at the tip.
        points: Where on a link the load acts (3,) [m], in its frame, as for :class:`~cdsm.Load`.
        tension_std: Standard uncertainty of the load cells [N]: one number, or (C,). Default: 1 %
            of the largest reading, which ``warnings`` say.
        angle_std: Standard uncertainty of the joint coordinates [rad], [m]: one number, or (nv,).
        sliding: How each cable last slid in its holes: 1 taken in, −1 let out, 0 unknown. One
            number for all cables, (C,), or a dict by cables, with a number for all holes of a cable
            or one for each. It is known after a motor has pulled until its cable slides in all
            holes. Directions that follow from measured angles are wrong where angles are not
            exact to 0.01°.
        wrench: Loads that are known, as for :func:`~cdsm.stiffness`.

    Raises:
        InvalidInput: A shape, a link, a component or a number is wrong; a cable reads less than
            0 N; or more components are sought than joints off their stops give equations.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> F = cdsm.distribute_tension(pose, minimum=50.0, wrench=[1, -2, 3, 0, 0, 0]).values
        >>> found = cdsm.estimate_load(pose, F, {"tool0": "force"}, tension_std=0.5)
        >>> print(found.loads.round(6), found.std.round(2))
        [ 1. -2.  3.] [0.95 0.37 0.37]
    """
    readings = checked_readings(pose, motor_tensions, tension_std, angle_std, sliding, wrench)
    components = components_of(pose.arm, links, points)
    names = components.names
    equations = int(readings.rows.sum())
    if len(names) > equations:
        stops = listed(_stopped(readings), 6)
        off = f", since a stop holds {stops}" if stops else ""
        raise InvalidInput(
            "links",
            f"{plural(len(names), 'component')} sought, but the joints give "
            f"{plural(equations, 'equation')}{off}; seek fewer.",
        )
    holes, balance = _solved(readings, components)
    scale = components.columns(pose).scale
    instruments = _covariance(balance, readings.instruments, holes)
    by_hole = balance.gain @ balance.by_hole
    turned = balance.motions / scale
    std = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", turned, instruments, turned), 0.0))
    band = abs(turned @ by_hole) @ holes.bound
    std[balance.rank :] = np.inf
    band[balance.rank :] = np.inf
    largest = np.take_along_axis(balance.motions, abs(balance.motions).argmax(1)[:, None], 1)
    motions = balance.motions * np.sign(largest)
    order = np.argsort(np.hypot(std, band), kind="stable")
    determination = _determination(names, scale, balance)
    open_ = determination.covariance
    hidden = np.isinf(np.diag(open_))
    return LoadEstimate(
        components=components,
        names=names,
        loads=frozen(balance.loads),
        covariance=frozen(np.where(np.isinf(open_), open_, instruments)),
        band=frozen(np.where(hidden, np.inf, abs(by_hole) @ holes.bound)),
        seen=frozen(motions[order]),
        seen_std=frozen(std[order]),
        seen_band=frozen(band[order]),
        determination=determination,
        **_tensions(readings, holes, balance),
    )


def estimate_tensions(
    pose: Posture,
    motor_tensions: ArrayLike,
    *,
    tension_std: ArrayLike | None = None,
    angle_std: ArrayLike = 0.0,
    sliding: SlidingLike | None = None,
    wrench: LoadsLike = NO_WRENCH,
) -> TensionEstimate:
    """Estimate the tensions of all segments from those at the motors, without unknown loads.

    By friction alone `T_j` is within `F e^{±Σ μ β}` of the holes before it. The balance of the
    joints, with ``wrench`` as the only load, narrows this, and so does the direction in which
    cables slid. Arguments and errors are those of :func:`estimate_load`, which gives these numbers
    too, where loads are unknown.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype(friction=0.1).at([0.1] * 10)
        >>> F = cdsm.distribute_tension(pose, minimum=50.0).values
        >>> found = cdsm.estimate_tensions(pose, F, tension_std=0.5)
        >>> print(f"{F[-1]:.1f}, {found.segment_low[-1]:.1f} to {found.segment_high[-1]:.1f} N")
        50.8, 48.0 to 53.7 N
    """
    readings = checked_readings(pose, motor_tensions, tension_std, angle_std, sliding, wrench)
    holes, balance = _solved(readings, Components((), ()))
    return TensionEstimate(**_tensions(readings, holes, balance))


class TipForce(NamedTuple):
    """Force at the tip."""

    force: Array  # f (3,) [N], base axes
    std: Array  # standard uncertainty by the instruments (3,) [N]
    band: Array  # most by which friction can change it (3,) [N]


def tip_force(
    pose: Posture, motor_tension: Array, exponents: Array, instruments: Instruments
) -> TipForce:
    """Estimate the force at the tip from the exponents s (P,) of a followed history.

    A history that was followed from measured angles can be wrong in every hole, so that the band is
    that of unknown directions. What the readings do not tell is 0.
    """
    rows = _off_stops(pose, instruments.angle)
    none = np.zeros(exponents.size)
    readings = CheckedReadings(
        pose, motor_tension, motor_tension, instruments, False, np.zeros(6), none, rows
    )
    components = components_of(pose.arm, None, None)
    holes, balance = _solved(readings, components, exponents)
    std = np.sqrt(np.diag(_covariance(balance, instruments, holes)))
    band = abs(balance.gain @ balance.by_hole) @ holes.bound
    return TipForce(balance.loads, std, band)


def checked_readings(
    pose: Posture,
    motor_tensions: ArrayLike,
    tension_std: ArrayLike | None,
    angle_std: ArrayLike,
    sliding: SlidingLike | None,
    wrench: LoadsLike,
) -> CheckedReadings:
    """Check what was read; InvalidInput names what is wrong."""
    arm = instance("pose", pose, Posture).arm
    cables = arm.cables.names
    read = vector(
        "motor_tensions", motor_tensions, len(cables), "one reading [N] per cable", "tension"
    )
    assumed = tension_std is None
    if tension_std is None:
        largest = float(read.max(initial=0.0))
        if largest <= 0.0:
            problem = f"1 % of the largest reading, {largest:g} N, tells nothing; give that of the"
            raise InvalidInput("tension_std", f"{problem} load cells, and check their signs.")
        tension_std = _ASSUMED * largest
    std = spread("tension_std", tension_std, cables, "force", "a load cell is not exact")
    angle = spread("angle_std", angle_std, arm.joint_names, None, "")
    low = read < -_NOISE * std
    if low.any():
        c = int(low.argmax())
        raise InvalidInput(
            "motor_tensions",
            f"{read[c]:g} N given for {cables[c]}; cables only pull, and the load cell is known "
            f"within ±{std[c]:g} N. Check its sign and its zero, or give a larger tension_std.",
        )
    rows = _off_stops(pose, angle)
    if not rows.any():
        raise InvalidInput("pose", "all joints are at their stops, whose torques are unknown.")
    return CheckedReadings(
        pose=pose,
        motor_tension=np.maximum(read, 0.0),
        read=read,
        instruments=Instruments(std, angle),
        assumed=assumed,
        known=loads_of(arm, wrench),
        sliding=sliding_of(pose, sliding),
        rows=rows,
    )


def spread(
    name: str, value: ArrayLike, owners: tuple[str, ...], kind: str | None, exact: str
) -> Array:
    """Return standard uncertainties, one for each owner; InvalidInput if one is not positive.

    ``exact`` says why 0 is refused, and what is as good as 0; both are allowed if it is empty.
    """
    values = number_array(name, value, kind)
    if values.shape not in ((), (len(owners),)):
        raise InvalidInput(
            name, f"shape {values.shape} given; give one number, or ({len(owners)},)."
        )
    values = np.broadcast_to(values, (len(owners),)).copy()
    wrong = (values < 0.0) | ((values < SMALLEST) & bool(exact))
    if wrong.any():
        i = int(wrong.argmax())
        why = exact if values[i] >= 0.0 else "a standard uncertainty is not negative"
        raise InvalidInput(name, f"{values[i]:g} given for {owners[i]}; {why}.")
    return frozen(values)


def _off_stops(pose: Posture, angle_std: Array) -> NDArray[np.bool_]:
    """Return which joints are off their stops (nv,), as far as the encoders tell."""
    near = np.maximum(_NEAR * angle_std, _ROUNDING)
    arm = pose.arm
    return np.asarray((pose.q > arm.lower + near) & (pose.q < arm.upper - near))


def _stopped(readings: CheckedReadings) -> tuple[str, ...]:
    names = readings.pose.arm.joint_names
    return tuple(names[i] for i in np.flatnonzero(~readings.rows))


def _solved(
    readings: CheckedReadings, components: Components, followed: Array | None = None
) -> tuple[Holes, LoadBalance]:
    taut = readings.motor_tension > 0.0
    holes = holes_of(readings.pose, readings.sliding, taut, followed)
    balance = balance_loads(
        readings.pose,
        readings.motor_tension,
        readings.known,
        components.columns(readings.pose),
        readings.instruments,
        holes,
        readings.rows,
    )
    return holes, balance


def _covariance(balance: LoadBalance, instruments: Instruments, holes: Holes) -> Array:
    """Compute the covariance (m, m) of loads by instruments and friction of known direction."""
    E = balance.gain
    by_tension = E @ balance.by_tension * instruments.tension
    by_angle = E @ balance.by_angle * instruments.angle
    by_hole = E @ balance.by_hole
    exact = balance.exact**2 * E @ E.T
    known = by_hole @ holes.known @ by_hole.T
    return np.asarray(by_tension @ by_tension.T + by_angle @ by_angle.T + known + exact)


def _determination(names: tuple[str, ...], scale: Array, balance: LoadBalance) -> Determination:
    """Return which components are told; hidden combinations have no part of others below 1 %."""
    hidden = balance.motions[balance.rank :]
    hidden = hidden * (np.linalg.norm(hidden, axis=0) > _PART)
    told = np.eye(len(names)) - np.linalg.pinv(hidden) @ hidden
    seen = balance.seen * scale @ told / scale if balance.rank else np.zeros((1, len(names)))
    return Determination(names, frozen(seen), frozen(100.0 * scale))


def _tensions(readings: CheckedReadings, holes: Holes, balance: LoadBalance) -> dict[str, Any]:
    """Return the fields of a :class:`TensionEstimate`."""
    pose = readings.pose
    behind = pose.segments.chains.behind
    even = readings.motor_tension[pose.segments.chains.cable]
    names = pose.arm.cables.names
    variance = np.maximum(np.diag(balance.tension_covariance), 0.0)
    return {
        "posture": pose,
        "motor_tension": readings.read,
        "tension_std": readings.instruments.tension,
        "tension_std_assumed": readings.assumed,
        "angle_std": readings.instruments.angle,
        "applied": readings.known,
        "sliding": frozen(readings.sliding.copy()),
        "segment_tension": frozen(balance.tension),
        "segment_std": frozen(np.sqrt(variance)),
        "segment_low": frozen(even * np.exp(behind @ (holes.mean - holes.bound))),
        "segment_high": frozen(even * np.exp(behind @ (holes.mean + holes.bound))),
        "chi_square": balance.misfit,
        "freedom": int(readings.rows.sum()) - balance.rank,
        "at_stop": _stopped(readings),
        "slack": tuple(names[c] for c in np.flatnonzero(readings.motor_tension == 0.0)),
    }
