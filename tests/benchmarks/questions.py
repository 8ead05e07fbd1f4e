"""Random questions where answers go wrong: near singular, infeasible, buckling, and out of domain.

Each family draws an arm and some questions about it. "Near" is a factor of 10 to the power of
something uniform, so that every order of magnitude is met, the last digits included.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
from scipy.optimize import linprog

import cdsm
from cdsm.support.values import Array
from tests.benchmarks.exact import EQ19_LOW, ExactArm, Wide, eq19, eq19_strain, wide

ROWS = 10
"""Questions about one arm."""


class Group(NamedTuple):
    """Questions about one arm, a row for each.

    Attributes:
        family: Its name.
        arm: The arm.
        exact: The same, in extended precision.
        q: (B, nv).
        wrench: (B, 6).
        tension: (B, C), whose stiffness is asked for; or
        low: lower bounds (B, C), and
        high: upper bounds (B, C) of the least tensions that are asked for.
    """

    family: str
    arm: cdsm.Manipulator
    exact: ExactArm
    q: Array
    wrench: Array
    tension: Array | None = None
    low: Array | None = None
    high: Array | None = None

    def springs(self, lengths: Wide, tension: Array) -> Wide:
        """K_L (C,) of Eq. 16, from the numbers of the cables: EA/l_0, l_0 unstrained."""
        cable = self.arm.cables[0]
        series, F = 1 / wide(cable.series_stiffness), wide(tension)
        if isinstance(cable.elasticity, cdsm.LinearElasticity):
            EA = wide(cable.elasticity.rigidity(1.0))
            free = (lengths - F * series) / (1 + F / EA)
        else:
            EA = eq19(tension)
            free = (lengths - (F - wide(EQ19_LOW)) * series) / (1 + eq19_strain(tension))
        return np.asarray(1 / (free / EA + series))


Random = np.random.Generator


def near(rng: Random, digits: float) -> float:
    """A number between 10^-digits and 1, of either sign, its order of magnitude uniform."""
    return float(rng.choice([-1.0, 1.0]) * 10.0 ** -rng.uniform(0.0, digits))


def _sizes(rng: Random) -> dict[str, Any]:
    h = rng.uniform(0.006, 0.012)
    return {
        "link_length": rng.uniform(0.03, 0.08),
        "base_length": rng.uniform(0.0, 0.05),
        "disk_offset": h,
        "hole_radius": h * rng.uniform(1.5, 4.0),
        "link_mass": rng.choice([0.0, rng.uniform(0.02, 0.5)]),
        "lead": rng.uniform(0.0, 0.5),
    }


def _geometry(rng: Random) -> cdsm.Geometry:
    if rng.random() < 0.6:
        return cdsm.Geometry.universal(
            joints=int(rng.integers(1, 4)), cables_per_joint=int(rng.integers(3, 5)), **_sizes(rng)
        )
    # an axis within 1e-12 of y is y to Pinocchio's parser: less than that is no question
    twist = rng.choice([0.0, near(rng, 11.0), rng.uniform(-1.5, 1.5)])
    return cdsm.Geometry.hinged(joints=int(rng.integers(1, 6)), twist=twist, **_sizes(rng))


def _arm(
    rng: Random, geometry: cdsm.Geometry, law: cdsm.Elasticity | None = None, spring: float = np.inf
) -> tuple[cdsm.Manipulator, ExactArm]:
    law = law or cdsm.LinearElasticity(10.0 ** rng.uniform(3.5, 5.5))
    cables = cdsm.serpentine_cables(geometry, law, series_stiffness=spring)
    arm = cdsm.Manipulator(geometry, cables=cables, gravity=rng.normal(0.0, 6.0, 3))
    return arm, ExactArm(geometry, arm.gravity)


def _postures(rng: Random, arm: cdsm.Manipulator) -> Array:
    return rng.uniform(-0.6, 0.6, (ROWS, arm.nv)) * arm.upper


def _wrenches(rng: Random) -> Array:
    loads = rng.normal(0.0, 3.0, (ROWS, 6)) * [1.0, 1.0, 1.0, 0.1, 0.1, 0.1]
    loads[rng.random(ROWS) < 0.3, 3:] = 0.0
    return loads


def singular_posture(rng: Random) -> Group:
    """Arms nearly straight, nearly in a plane, or with joints that nearly agree."""
    arm, exact = _arm(rng, _geometry(rng))
    q = _postures(rng, arm)
    for row in q:
        kind = rng.integers(4)
        if kind == 0:
            row *= near(rng, 16.0)
        elif kind == 1:
            row[int(rng.integers(2)) :: 2] *= near(rng, 16.0) * rng.integers(2)
        elif kind == 2:
            row[:] = row[0] * (1.0 + near(rng, 16.0) * rng.normal(size=arm.nv) * 0.1)
        else:
            row *= rng.random(arm.nv) < 0.5
    count = len(arm.cables)
    return Group(
        "singular postures", arm, exact, q, _wrenches(rng), rng.uniform(20.0, 120.0, (ROWS, count))
    )


def singular_actuation(rng: Random) -> Group:
    """Cables that nearly lie in a plane with the axis: one motion of a joint is hardly held."""
    plain = cdsm.Geometry.universal(
        joints=int(rng.integers(1, 3)), cables_per_joint=int(rng.integers(3, 5)), **_sizes(rng)
    )
    angle, spread = rng.uniform(0.0, 2.0 * math.pi), near(rng, 5.0)
    routes = [
        replace(route, angle=angle + math.pi * (c % 2) + spread * rng.uniform(-1.0, 1.0))
        if rng.random() < 0.9
        else route
        for c, route in enumerate(plain.cables)
    ]
    arm, exact = _arm(rng, replace(plain, cables=tuple(routes)))
    count = len(arm.cables)
    low = np.full((ROWS, count), rng.choice([0.0, 20.0]))
    high = np.where(rng.random((ROWS, 1)) < 0.5, np.inf, 10.0 ** rng.uniform(2.0, 6.0, (ROWS, 1)))
    high = np.repeat(high, count, axis=1)
    q = _postures(rng, arm) * rng.choice([0.0, 0.3, 1.0], (ROWS, 1))
    wrench = _wrenches(rng) * 10.0 ** rng.uniform(-6.0, 0.0, (ROWS, 1))
    return Group("singular actuation", arm, exact, q, wrench, None, low, high)


def edge_of_feasibility(rng: Random) -> Group:
    """Loads and upper bounds just within and just beyond what some tensions balance."""
    arm, exact = _arm(rng, _geometry(rng))
    count = len(arm.cables)
    q, wrench = _postures(rng, arm) * 0.7, _wrenches(rng)
    low = np.repeat(rng.uniform(0.0, 50.0, (ROWS, 1)), count, axis=1)
    if rng.random() < 0.5:
        low = low * rng.uniform(0.5, 1.0, low.shape)
    high = low + 10.0 ** rng.uniform(0.5, 2.5, low.shape)
    for r in range(ROWS):
        motion = exact.at(q[r])
        A, weight = motion.slopes.T.astype(float), -motion.torque.astype(float)
        load = motion.jacobian.T.astype(float) @ wrench[r]
        arm_scale = abs(A).max()
        factor = 1.0 + near(rng, 8.0) * 0.1
        if rng.random() < 0.5:  # the largest multiple of the load
            found = linprog(
                np.append(np.zeros(count), -1.0),
                A_eq=np.column_stack([A, -load]) / arm_scale,
                b_eq=weight / arm_scale,
                bounds=[*zip(low[r], high[r], strict=True), (0.0, None)],
            )
            if found.status == 0:
                wrench[r] *= found.x[-1] * factor
        else:  # the least upper bound of all
            found = linprog(
                np.append(np.zeros(count), 1.0),
                A_ub=np.column_stack([np.eye(count), -np.ones(count)]),
                b_ub=np.zeros(count),
                A_eq=np.column_stack([A, np.zeros(len(A))]) / arm_scale,
                b_eq=(weight + load) / arm_scale,
                bounds=[*((x, None) for x in low[r]), (0.0, None)],
            )
            if found.status == 0:
                high[r] = np.maximum(found.x[-1] * factor, low[r])
    return Group("edge of feasibility", arm, exact, q, wrench, None, low, high)


def edge_of_buckling(rng: Random) -> Group:
    """Soft springs, and tensions or a load just below and just above where K_θ is singular."""
    spring = 10.0 ** rng.uniform(2.0, 4.0)
    arm, exact = _arm(rng, _geometry(rng), spring=spring)
    q, wrench = _postures(rng, arm), _wrenches(rng)
    tension = rng.uniform(20.0, 120.0, (ROWS, len(arm.cables)))
    group = Group("edge of buckling", arm, exact, q, wrench, tension)
    for r in range(ROWS):
        motion = exact.at(q[r])
        springs = group.springs(motion.lengths, tension[r])
        parts = motion.parts(tension[r], springs, wrench[r]).astype(np.float64)
        parts = (parts + parts.transpose(0, 2, 1)) / 2.0
        grows = 0 if rng.random() < 0.6 else 3
        factors = scipy.linalg.eigvals(parts.sum(axis=0) - parts[grows], -parts[grows])
        real = np.real(factors[abs(np.imag(factors)) < 1e-9 * abs(factors)])
        real = real[(real > 0.0) & (real < 1e6)]
        if real.size:
            row = tension if grows == 0 else wrench
            row[r] *= real.min() * (1.0 + near(rng, 11.0) * 0.1)
    return group


def ends_of_eq19(rng: Random) -> Group:
    """Strands of Eq. 19, some of their tensions beside the ends of its domain.

    None is near 31 N, where a quintic of the strand bridges the corner of Eq. 19.
    """
    arm, exact = _arm(rng, _geometry(rng), cdsm.presets.STRAND_1X19)
    count = len(arm.cables)
    tension = 10.0 ** rng.uniform(math.log10(2.3), math.log10(800.0), (ROWS, count))
    tension = np.where(abs(tension - 31.0) < 2.0, tension + 4.0, tension)
    place = rng.choice([2.2, 810.0], (ROWS, count))
    beside = rng.random((ROWS, count)) < 0.5
    for r, c in np.argwhere(beside):
        away = 0.05 * near(rng, 16.0)
        if rng.random() < 0.95:  # into the domain, or most were refused
            away = abs(away) if place[r, c] == 2.2 else -abs(away)
        tension[r, c] = place[r, c] * (1.0 + away)
        if rng.random() < 0.1:
            tension[r, c] = np.nextafter(place[r, c], rng.choice([0.0, 31.0, np.inf]))
    return Group("ends of Eq. 19", arm, exact, _postures(rng, arm), np.zeros((ROWS, 6)), tension)


FAMILIES: dict[str, Callable[[Random], Group]] = {
    "singular postures": singular_posture,
    "singular actuation": singular_actuation,
    "edge of feasibility": edge_of_feasibility,
    "edge of buckling": edge_of_buckling,
    "ends of Eq. 19": ends_of_eq19,
}
