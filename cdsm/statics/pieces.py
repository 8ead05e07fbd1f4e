"""Pieces of a branch of equilibria: while the same cables are taut, and the same stops push.

On a piece the equilibrium is a smooth function of the share of the load. It ends where a cable goes
slack or taut, or a stop begins or ends to push: a root of a tension or of a way to a stop.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from cdsm.errors import CdsmError
from cdsm.posture import Posture
from cdsm.statics.locked_arm import LockedArm
from cdsm.statics.solve import NEUTRAL, Balance, Point, continued, stable_between
from cdsm.support.values import Array, Flags

PRECISION = 1e-15  # of the share of a root, relative to the step

_RATE = 1e-6  # change of the share for a difference
_EVEN = 1e-9  # a tension below this part of the largest is zero: the load decides if it pulls
_TOUCH = 1e-12  # a stop touches at this distance [rad]
_JUMP = 1e-6  # part of the change of a value within a step that is left where it should be 0
_CHANGE = 1e-5  # a rate below this part of the largest is rounding

_EPSILON = 2.0**-50  # least relative precision of a root

_LOST = CdsmError("the equilibrium is not found.")

Model = Callable[[float], LockedArm]
"""Arm under a share of the load and of the pull."""


class Stage(NamedTuple):
    """Equilibrium of a branch."""

    share: float  # of the load and of the pull [-]
    point: Point
    balance: Balance
    arm: LockedArm  # under this share
    taut: Flags | None = None  # which cables are taut from here on (C,); None: not known yet
    snapped: bool = False  # whether the arm snapped through to it from the stage before

    @property
    def pose(self) -> Posture:
        """Its posture."""
        return self.point.state.pose


def stage_at(model: Model, pose: Posture, stop_torque: Array, share: float) -> Stage:
    """Return the equilibrium at a known posture, where the stops push with ``stop_torque``."""
    arm = model(share)
    f = Balance(arm.at, arm.reference, arm.at_pose(pose))
    return Stage(share, f(pose.q / f.unit - stop_torque * f.unit / f.k), f, arm)


def equilibrium_near(
    model: Model, share: float, before: Stage, speed: Array | None = None
) -> Stage | None:
    """Find the stable equilibrium near ``before`` under another share; None if there is none.

    The search begins there, or first where the ``speed`` dx/dshare of the branch leads.
    """
    arm = model(share)
    pose = before.pose
    f = Balance(arm.at, arm.reference, arm.at_pose(pose))
    guess = pose.q / f.unit - before.point.stop_torque * f.unit / f.k
    ahead = () if speed is None else (guess + (share - before.share) * speed,)
    found = continued(f, (*ahead, guess), pose.q)
    return None if found is None else Stage(share, found, f, arm)


def under(model: Model, stage: Stage, taut: Flags | None) -> Stage:
    """Return an equilibrium as one of another model, such as of a piece."""
    arm = model(stage.share)
    balance = stage.balance.under(arm.at)
    return Stage(stage.share, balance(stage.point.x), balance, arm, taut)


def rate(model: Model, stage: Stage) -> Array:
    """Compute dx/dshare (nv,) of the branch at an equilibrium."""
    residual = [model(stage.share + h).at_pose(stage.pose).residual for h in (0.0, _RATE)]
    change = (residual[1] - residual[0]) / _RATE * stage.balance.unit
    return np.asarray(-np.linalg.lstsq(stage.point.slope, change)[0], np.float64)


def slope(model: Model, stage: Stage, value: Callable[[Stage], Array]) -> Array:
    """Compute the derivatives (m,) of quantities by the share along the branch."""
    x = stage.point.x + _RATE * rate(model, stage)
    arm = model(stage.share + _RATE)
    balance = stage.balance.under(arm.at)
    ahead = Stage(stage.share + _RATE, balance(x), balance, arm)
    with np.errstate(invalid="ignore"):  # the way to a stop that does not exist is inf
        return np.asarray((value(ahead) - value(stage)) / _RATE)


def dip(before: tuple[Array, Array], after: tuple[Array, Array]) -> float | None:
    """Return the part of a step at which a quantity may be negative within it, or None.

    Values and slopes (m,) at both ends are given, the slopes per step. The quantities are positive
    at both ends; within, they are taken for the cubics with these slopes.
    """
    (low, falls), (high, rises) = before, after
    suspects = (low > 0.0) & (high > 0.0) & (falls < 0.0) & (rises > 0.0) & np.isfinite(low)
    if not suspects.any():
        return None
    parts = np.linspace(0.0, 1.0, 21)[1:-1, None]
    cubic = (
        (1.0 + 2.0 * parts) * (1.0 - parts) ** 2 * low[suspects]
        + parts * (1.0 - parts) ** 2 * falls[suspects]
        + parts**2 * (3.0 - 2.0 * parts) * high[suspects]
        + parts**2 * (parts - 1.0) * rises[suspects]
    )
    deep = cubic.min(axis=1)
    k = int(deep.argmin())
    return float(parts[k, 0]) if deep[k] < 0.0 else None


def root(
    value: Callable[[float], float], low: float, high: float, xtol: float, rtol: float = _EPSILON
) -> float:
    """Return where a quantity is 0 between two places; if rounding hides it, the best place."""
    from scipy.optimize import brentq  # slow to import

    return float(brentq(value, low, high, xtol=xtol, rtol=rtol, disp=False))


def piece_of(model: Model, here: Stage) -> Model:
    """Return the model whose cables stay taut or slack as they are from ``here`` on."""
    taut = here.taut
    assert taut is not None
    return lambda share: model(share).keeping(taut)


def begun(model: Model, here: Stage) -> Stage:
    """Return an equilibrium with the cables that are taut from there on."""
    taut = here.arm.continued_tensions(here.pose) >= 0.0
    here = here._replace(taut=taut)
    return here._replace(taut=_sides(model, here))


def next_on_piece(model: Model, here: Stage, share: float) -> Stage | None:
    """Return the next equilibrium, at ``share`` or where the piece ends before; None: none found.

    It is None, too, if K_θ is not positive definite from ``here`` on.
    """
    if not is_held(model, here):
        return None
    piece = piece_of(model, here)
    speed = rate(piece, under(piece, here, here.taut))

    def at(part: float) -> Stage | None:
        stage = equilibrium_near(piece, part, here, speed)
        if stage is None:
            return None
        between = stable_between(stage.arm.at, here.pose.q, stage.pose.q)
        return stage if between else None

    end = at(share)
    # before a root, other values may have changed their sign that have it again behind the root
    for _ in range(here.pose.q.size + here.pose.cable_lengths.size):
        if end is None or end.share == here.share:
            break
        missed = end if _passed(here, end).any() else _dipped(piece, here, end, at)
        if missed is None:
            break
        end = _end_of_smooth(at, here, missed)
    if end is None:
        return None
    stage = under(model, end, here.taut)
    stage = stage._replace(taut=_sides(model, stage))
    if end.share == here.share and np.array_equal(stage.taut, here.taut):  # type: ignore[arg-type]
        return None  # what follows contradicts the sides
    return stage


def is_held(model: Model, here: Stage) -> bool:
    """Return whether K_θ is positive definite with the cables that are taut from ``here`` on.

    Joints that may leave their stops here count as free.
    """
    state = piece_of(model, here)(here.share).at_pose(here.pose)
    free = (here.balance.gaps(here.point.x) >= -_TOUCH).all(axis=0)
    unit = here.balance.unit
    K = (state.stiffness * unit * unit[:, None])[np.ix_(free, free)]
    values = np.linalg.eigvalsh(K + K.T)
    return not free.any() or bool(values[0] > -NEUTRAL * abs(values).max())


def _sides(model: Model, here: Stage) -> Flags:
    """Return which cables are taut from here on (C,).

    Of cables at 0 N the motion decides: they are taut if it stretches them. What is assumed of
    them changes one by one until nothing contradicts it (Murty, Linear Algebra Appl. 7, 1974),
    which ends if K_θ without them is positive definite.
    """
    taut = here.taut
    assert taut is not None
    F = here.arm.continued_tensions(here.pose)
    even = _EVEN * float(abs(here.point.state.tension).max(initial=0.0))
    near = abs(F) <= np.maximum(even, here.arm.tension_rounding(here.pose))
    for _ in range(4 * int(near.sum())):
        piece = piece_of(model, here._replace(taut=taut))
        stage = under(piece, here, taut)
        rates = slope(piece, stage, lambda stage: stage.arm.continued_tensions(stage.pose))
        clear = abs(rates) > _CHANGE * abs(rates).max(initial=0.0)
        wrong = np.flatnonzero(near & clear & (taut != (rates > 0.0)))
        if not wrong.size:
            break
        taut = taut ^ (np.arange(taut.size) == wrong[-1])
    return taut


def _values(here: Stage, stage: Stage) -> tuple[Array, Array]:
    """Return what is positive while a piece goes on from ``here``, and its rounding.

    Tensions (C,) over the largest, negative of slack cables; ways to both stops (2 nv,), negative
    of those that push.
    """
    F = stage.arm.continued_tensions(stage.pose)
    size = float(abs(here.point.state.tension).max(initial=0.0)) or 1.0
    even = np.maximum(_EVEN, stage.arm.tension_rounding(stage.pose) / size)
    gaps = stage.balance.gaps(stage.point.x).ravel()
    pushed = here.balance.gaps(here.point.x).ravel() < 0.0
    taut = here.taut
    assert taut is not None
    value = np.append(np.where(taut, F, -F) / size, np.where(pushed, -gaps, gaps))
    return value, np.append(even, np.full(gaps.size, _TOUCH))


def _passed(here: Stage, stage: Stage) -> Flags:
    """Return which values are negative at a stage of the piece from ``here``."""
    before, even = _values(here, here)
    undecided = np.arange(before.size) >= here.pose.cable_lengths.size
    undecided &= abs(before) <= even  # a stop that just touches
    return np.asarray((_values(here, stage)[0] < -even) & ~undecided)


def _end_of_smooth(at: Callable[[float], Stage | None], here: Stage, there: Stage) -> Stage | None:
    """Return ``there``, or the equilibrium where the first value is 0; None if it is lost."""
    passed = _passed(here, there)
    if not passed.any():
        return there
    before, even = _values(here, here)
    known = {here.share: before, there.share: _values(here, there)[0]}

    def value(share: float, i: int) -> float:
        if share not in known:
            stage = at(share)
            if stage is None:
                raise _LOST
            known[share] = _values(here, stage)[0]
        return float(known[share][i])

    first = there.share
    try:
        for i in np.flatnonzero(passed).tolist():
            if before[i] <= even[i]:
                return here
            if value(first, i) < 0.0:
                precision = PRECISION * (there.share - here.share)
                change = abs(before[i] - value(first, i))
                first = root(partial(value, i=i), here.share, first, precision)
                if abs(value(first, i)) > _JUMP * change + _EVEN:
                    return None  # the search found another branch on the far side
    except CdsmError:
        return None
    return at(first)


def _dipped(
    piece: Model, here: Stage, there: Stage, at: Callable[[float], Stage | None]
) -> Stage | None:
    """Return an equilibrium within a step at which a value has dipped below zero, or None."""
    step = there.share - here.share

    def value(stage: Stage) -> Array:
        return _values(here, stage)[0]

    first, last = [(value(end), step * slope(piece, end, value)) for end in (here, there)]
    part = dip(first, last)
    middle = None if part is None else at(here.share + part * step)
    return middle if middle is not None and _passed(here, middle).any() else None
