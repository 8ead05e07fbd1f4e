"""Solve the balance r(q) = 0 of an arm between its stops, for any model of its torques.

r is the residual torque, K = ∂r/∂q. A stop pushes, but does not pull. With the projection P onto
the angles between the stops, all of this is one equation without inequalities, Robinson's normal
map (Math. Oper. Res. 17, 1992):

    f(x) = r(P(x)) + k (x − P(x)) = 0.

The angles are q = P(x), and a joint at its stop is pushed by the torque k (P(x) − x). r need not be
the gradient of a potential: a moment at the tip and sliding cables have none.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from copy import copy
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import CdsmError, EquilibriumError
from cdsm.posture import Posture
from cdsm.readings import margin
from cdsm.support.values import Array, frozen

BALANCED = 1e-9  # largest |r| of an equilibrium, over the sum of the magnitudes of its terms
NEUTRAL = 1e-10  # an eigenvalue of K whose size is below this part of the largest is rounding
FAR = 0.1  # largest motion of a joint [rad] from one equilibrium to the next while loads change

_LONGEST = 0.2  # longest step of a joint [rad]
_DENSE = 0.02  # distance [rad] of the postures at which the way to an equilibrium is checked
_STEPS = 300  # most steps of the search for an equilibrium
_SHORTER = 4  # most times that a step which goes too far is shortened
_HALVINGS = 12  # most times that a step is halved around a kink
_KICK = 0.01  # step off a saddle [rad]
_NOISE = 1e-13  # |r| that is rounding, over the sum of magnitudes
_APART = 1e-6  # a joint stops this far [rad] before its disks touch: cables have no direction there
_CLOSE = 1e-3  # sites meet if their distance is below this part of that at the reference


@dataclass(frozen=True)
class ArmState:
    """State of a loaded arm at one posture, in balance or not."""

    pose: Posture
    tension: Array  # of each cable (C,), or of each segment (S,) [N]
    residual: Array  # r (nv,) [N m]
    stiffness: Array  # ∂r/∂q (nv, nv) [N m/rad]
    scale: Array  # sum of the magnitudes of the terms of r (nv,) [N m]


class Point(NamedTuple):
    """Normal map at x, in scaled coordinates: a sliding joint counts in lengths of the arm."""

    x: Array
    state: ArmState
    value: Array  # f (nv,) [N m]
    slope: Array  # ∂f/∂x (nv, nv)
    out: NDArray[np.bool_]  # which joints are beyond a stop (nv,)
    off: float  # largest |f| over the scale of r
    stop_torque: Array  # torque of the stops (nv,) [N m]; 0 where it is rounding


class Balance:
    """Normal map f(x) of the model ``at(q)``, with the torque ``holding`` subtracted from r.

    The stops are those of an arm that was locked at ``reference``; ``near`` is a state close by.
    ``has_walls`` says that r rises steeply within short ways, where cables stick.
    """

    def __init__(
        self,
        at: Callable[[Array], ArmState],
        reference: Posture,
        near: ArmState,
        holding: Array | float = 0.0,
        *,
        has_walls: bool = False,
    ) -> None:
        arm = reference.arm
        self.has_walls = has_walls
        self.reference = reference
        self._at = at
        self._holding = holding
        self.unit = np.where(arm.slides, arm.length, 1.0)
        touching = np.zeros(arm.nv, dtype=np.bool_)  # joints that their disks stop
        if arm.is_serpentine:
            stops = {axis.name: axis.stops for axis in arm.geometry.chain.axes}
            touching[:] = [stops[name] for name in arm.joint_names]
        apart = np.where(touching, _APART, 0.0)
        # the reference may be nearer to the stop
        self._lower = np.minimum(arm.lower + apart, reference.q) / self.unit
        self._upper = np.maximum(arm.upper - apart, reference.q) / self.unit
        self.k = float(abs(near.stiffness.diagonal() * self.unit**2).max()) or 1.0

    def __call__(self, x: Array) -> Point:
        """Return f, its derivative and the state at x (nv,)."""
        inside = self.inside(x)
        state = self._at(inside * self.unit)
        out = x != inside
        beyond = self.k * (x - inside)
        residual = state.residual - self._holding
        value = residual * self.unit + beyond
        slope = np.where(out, 0.0, state.stiffness * self.unit * self.unit[:, None])
        slope += np.diag(self.k * out)
        # the torques of a pendulum vanish where it hangs: 1e-3 rad are a part of the scale
        size = float((state.scale * self.unit).max()) + 1e-3 * self.k
        pushed = np.where(abs(beyond) > _NOISE * size, residual, 0.0)
        return Point(x, state, value, slope, out, float(abs(value).max()) / size, frozen(pushed))

    def inside(self, x: Array) -> Array:
        """Return P(x): the scaled angles between the stops."""
        return np.minimum(np.maximum(x, self._lower), self._upper)

    def gaps(self, x: Array) -> Array:
        """Return the way to both stops (2, nv), lower and upper, scaled; below 0: they push."""
        return np.array([x - self._lower, self._upper - x])

    def under(self, at: Callable[[Array], ArmState]) -> Balance:
        """Return the normal map of another model between the same stops."""
        other = copy(self)
        other._at = at
        return other

    def attempt(self, x: Array) -> Point | None:
        """Return f(x); None where the model does not exist, as where two sites coincide."""
        try:
            return self(x)
        except CdsmError:
            return None

    def limited(self, x: Array, step: Array) -> Array:
        """Return ``step``, shortened so that no joint moves by more than 0.2 rad."""
        beyond = x - self.inside(x)
        room = np.where(beyond == 0.0, 0.0, np.where(beyond * step < 0.0, abs(beyond), math.inf))
        return step / max(1.0, float((abs(step) / (_LONGEST + room)).max()))


def settle(f: Balance, q: Array, reached: float = 0.0, load: str = "the load") -> Point:
    """Find the stable equilibrium to which the arm descends from the angles q (nv,).

    Raises EquilibriumError, which says that the part ``reached`` of ``load`` was borne.
    """
    here, is_stable = _descend(f, f(q / f.unit), 1e-3 * f.k)
    if not is_stable:
        raise _not_found(f.reference, here, reached, load)
    return here


def continued(
    f: Balance, guesses: Iterable[Array], before: Array, steps: int = _STEPS
) -> Point | None:
    """Find the stable equilibrium near the angles ``before`` (nv,), as a load changes a little.

    The searches begin at the points ``guesses``. Returns None if none finds one to which no joint
    moves by more than 0.1 rad, in so many ``steps``.
    """
    for x in guesses:
        point = f.attempt(x)
        home = before / f.unit
        here, is_stable = _descend(f, point, 0.0, home, steps) if point else (None, False)
        if is_stable:
            return here
    return None


def stable_between(
    at: Callable[[Array], ArmState],
    before: Array,
    after: Array,
    least: Callable[[Array], Array | float] = margin,
) -> bool:
    """Return whether the ``least`` eigenvalue of K is positive on the way between two equilibria.

    If it is not, the arm snaps through, though the search has stepped over the unstable postures.
    The way is straight.
    """
    free = before != after
    length = float(abs(after - before).max())
    for part in np.arange(_DENSE, length, _DENSE) / max(length, _DENSE):
        K = at(before + part * (after - before)).stiffness[np.ix_(free, free)]
        if least(K) <= 0.0:
            return False
    return True


def least_eigenvalue(f: Balance, point: Point) -> float:
    """Return the smallest eigenvalue of the symmetric part of K, scaled, of the free joints."""
    free = ~point.out
    if not free.any():
        return math.inf
    return float(np.linalg.eigvalsh(_symmetric(f, point)[np.ix_(free, free)])[0])


def _descend(
    f: Balance, here: Point, shift: float, home: Array | None = None, steps: int = _STEPS
) -> tuple[Point, bool]:
    """Newton's method on K + ``shift``, which is raised to be positive definite.

    A step counts if the work ∫f·dx along it is negative. It ends at a stable equilibrium, not at a
    saddle, unless the stops bar both ways down; and if a joint is more than 0.1 rad from ``home``.
    """
    kicks = 0
    identity = np.eye(here.x.size)
    for _ in range(steps):
        if home is not None and abs(f.inside(here.x) - home).max() > FAR:
            break
        values = np.linalg.eigvalsh(K := _symmetric(f, here))
        # an eigenvalue that is rounding is 0
        lowest = 0.0 if abs(values[0]) <= NEUTRAL * abs(values).max() else float(values[0])
        saddle = here.off <= BALANCED
        if saddle and (lowest >= 0.0 or kicks == 2):
            return _polished(f, here), True
        if saddle:  # leave it to where f pushes; if it is where the last kick began, the other way
            mode = np.linalg.eigh(K)[1][:, 0]
            mode *= np.sign(mode[abs(mode).argmax()])
            side = -1.0 if here.value @ mode > _NOISE * f.k else 1.0
            step = side * (-1.0) ** kicks * _KICK * mode
            kicks = kicks + 1
        else:
            shifted = here.slope + max(shift, -1.5 * lowest) * identity
            step = f.limited(here.x, -_solved(shifted, here.value))
            kicks *= bool(abs(step).max() < _KICK)
        if saddle:
            there = f.attempt(here.x + step)
        else:
            there, step = _reached(f, here, step, far=home is None or f.has_walls)
        gain = float(here.value @ step)
        if there and (saddle or 0.0 > 0.5 * gain > (here.value + there.value) @ step):
            here = there
            shift = shift / 4.0
        else:
            shift = 4.0 * max(shift, -lowest, 1e-4 * f.k)
    return here, False


def _reached(f: Balance, here: Point, step: Array, *, far: bool) -> tuple[Point | None, Array]:
    """Return the point after a step, and the step: shortened where the arm would swing back.

    Where cables begin to stick or to pull, K grows within the step, and f·step has turned positive
    at its end: the next end is where f·step is 0 if it is linear along the step. If this end is far
    short of it, since K has grown at once, a search that may go ``far`` ends the step between both.
    Near a branch of equilibria that must not be left, small steps do, unless K has such walls that
    they would take hundreds.
    """
    there = f.attempt(here.x + step)
    beyond = 0.0  # f·step at a longer step that went too far, per length of this one
    whole = step
    for _ in range(_SHORTER):
        start = float(here.value @ step)
        if there is None or not 0.0 < -0.5 * start <= (end := float(there.value @ step)):
            break
        whole = step
        beyond = end
        step = start / (start - end) * step
        there = f.attempt(here.x + step)
    if far and there is not None and beyond:
        return _between(f, here, (there, step), whole)
    return there, step


def _between(
    f: Balance, here: Point, short: tuple[Point, Array], whole: Array
) -> tuple[Point | None, Array]:
    """Return the point between a step that is too ``short`` and the ``whole`` one, too far.

    Both are halved around the root of f·step, until it is half of what it is ``here`` or less.
    """
    start = float(here.value @ whole)
    there, step = short
    low = float(step @ whole) / float(whole @ whole)
    high = 1.0
    for _ in range(_HALVINGS):
        if float(there.value @ whole) > 0.5 * start:
            break
        middle = (low + high) / 2.0
        trial = f.attempt(here.x + middle * whole)
        if trial is None or float(trial.value @ whole) > -0.5 * start:
            high = middle
            continue
        low = middle
        there, step = trial, middle * whole
    return there, step


def _polished(f: Balance, here: Point) -> Point:
    """Return the point after Newton's steps, down to rounding."""
    for _ in range(4):
        there = None
        if here.off > 10.0 * _NOISE:
            there = f.attempt(here.x - _solved(here.slope, here.value))
        if there is None or there.off >= here.off:
            break
        here = there
    return here


def _symmetric(f: Balance, point: Point) -> Array:
    """Return the symmetric part of K of the joints off their stops; others have f.k."""
    K = np.where(point.out | point.out[:, None], 0.0, (point.slope + point.slope.T) / 2.0)
    return np.asarray(K + np.diag(f.k * point.out))


def _solved(K: Array, torque: Array) -> Array:
    """Solve K x = torque, or come nearest to it with the least x where K is singular."""
    try:
        return np.asarray(np.linalg.solve(K, torque))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.lstsq(K, torque, rcond=None)[0])


def _not_found(reference: Posture, point: Point, reached: float, load: str) -> EquilibriumError:
    """Return the error of a search that ended at ``point``; say if two sites of a cable meet."""
    pose = point.state.pose
    residual = frozen(np.where(point.out, 0.0, point.state.residual))
    worst = int(abs(residual).argmax())
    remedy = ""
    arm = pose.arm
    problem = (
        f"the arm finds no stable place to rest beyond {100.0 * reached:.3g} % of {load}; at the "
        f"last iterate {abs(residual[worst]):.4g} {arm.torque_unit(worst)} are out of balance at "
        f"{arm.joint_names[worst]}"
    )
    for cable, *paths in zip(arm.cables, reference.cable_paths, pose.cable_paths, strict=True):
        apart, left = (np.linalg.norm(np.diff(path, axis=0), axis=1) for path in paths)
        if (left < _CLOSE * apart).any():
            problem += f", where two sites of {cable.name} meet: disks touch there"
            remedy = "Set joint_limit to where disks touch, or leave it out, for a stop there."
            break
    return EquilibriumError(problem, residual, reached, arm.joint_names[worst], remedy)
