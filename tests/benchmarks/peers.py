"""The joint stiffness as an automatic differentiator computes it: the Hessian of the potential.

The arm is that of :class:`~tests.benchmarks.naive.NaiveArm`, written once for JAX and for CasADi.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdsm.support.values import Array
from cdsm.urdf import CROSS_MASS
from tests.benchmarks.naive import NaiveArm


@dataclass(frozen=True)
class Tools:
    """What the potential needs of a package."""

    cos: Callable[[Any], Any]
    sin: Callable[[Any], Any]
    matrix: Callable[[Sequence[Sequence[Any]]], Any]
    norms: Callable[[Any], Any]  # of the columns of a matrix
    add: Callable[[Any, int, Any], Any]  # to the entries from some place on
    dot: Callable[[Any, Any], Any]


def state(arm: NaiveArm, q: Any, lengths: Any, tools: Tools) -> tuple[Any, Any, Any]:
    """Cable lengths, potential energy of the weight, tip position; lengths begin with zeros."""
    matrix = tools.matrix
    R, x = matrix(np.eye(3).tolist()), matrix([[arm.base], [0.0], [0.0]])
    offset = np.array([[arm.h], [0.0], [0.0]])
    weight = matrix([arm.gravity.tolist()])
    energy: Any = 0.0
    for k in range(arm.n):
        holes = arm.holes[:, arm.m * k :]
        before = x + R @ matrix((holes - offset).tolist())
        energy -= CROSS_MASS * weight @ x
        a, b = q[2 * k], q[2 * k + 1]
        ca, sa, cb, sb = tools.cos(a), tools.sin(a), tools.cos(b), tools.sin(b)
        R = R @ matrix([[ca, 0.0, sa], [0.0, 1.0, 0.0], [-sa, 0.0, ca]])
        R = R @ matrix([[cb, -sb, 0.0], [sb, cb, 0.0], [0.0, 0.0, 1.0]])
        after = x + R @ matrix((holes + offset).tolist())
        lengths = tools.add(lengths, arm.m * k, tools.norms(after - before))
        lengths = tools.add(lengths, arm.m * (k + 1), arm.link - 2 * arm.h)
        energy -= arm.mass * weight @ (x + R[:, :1] * arm.link / 2)
        x = x + R[:, :1] * arm.link
    return lengths, energy[0, 0], x


def with_jax(arm: NaiveArm, rigidity: float) -> Callable[[Array, Array, Array], Any]:
    """K_θ (B, nv, nv) of q (B, nv), F (B, C) and a force (B, 3), compiled at the first call."""
    import jax
    from jax import numpy as jnp

    jax.config.update("jax_enable_x64", True)
    tools = Tools(
        jnp.cos,
        jnp.sin,
        jnp.array,
        lambda columns: jnp.sqrt((columns**2).sum(0)),
        lambda total, first, part: total.at[first:].add(part),
        jnp.dot,
    )

    def potential(q: Any, tension: Any, force: Any) -> Any:
        lengths, energy, tip = state(arm, q, jnp.zeros(arm.n * arm.m), tools)
        here = jax.lax.stop_gradient(lengths)
        springs = (rigidity + tension) / here  # EA/l_0
        cables = tension @ lengths + (springs * (lengths - here) ** 2).sum() / 2.0
        return cables + energy - force @ tip[:, 0]

    compiled: Callable[[Array, Array, Array], Any] = jax.jit(jax.vmap(jax.hessian(potential)))
    return compiled


def with_casadi(arm: NaiveArm, rigidity: float) -> Any:
    """The function from q (nv,), F (1, C) and a force (3,) to K_θ (nv, nv), dense."""
    import casadi as ca

    def add(total: Any, first: int, part: Any) -> Any:
        if first == total.shape[1]:
            return total
        return ca.horzcat(total[:, :first], total[:, first:] + part)

    def matrix(rows: Sequence[Sequence[Any]]) -> Any:
        return ca.vertcat(*(ca.horzcat(*map(ca.SX, row)) for row in rows))

    tools = Tools(ca.cos, ca.sin, matrix, lambda columns: ca.sqrt(ca.sum1(columns**2)), add, ca.dot)
    count = arm.n * arm.m
    q, force = ca.SX.sym("q", 2 * arm.n), ca.SX.sym("force", 3)
    tension, here = ca.SX.sym("tension", 1, count), ca.SX.sym("here", 1, count)
    lengths, energy, tip = state(arm, q, ca.SX.zeros(1, count), tools)
    springs = (rigidity + tension) / here  # EA/l_0
    cables = ca.dot(tension, lengths) + ca.sum2(springs * (lengths - here) ** 2) / 2.0
    hessian, _ = ca.hessian(cables + energy - ca.dot(force, tip), q)
    joint = ca.densify(ca.substitute(hessian, here, lengths))
    return ca.Function("joint_stiffness", [q, tension, force], [joint])
