"""A weight at the tip of an arm with friction, in Newton and in cdsm.

    pip install newton
    python examples/newton_rest.py         # without friction; about a minute on a CPU
    python examples/newton_rest.py 0.3     # with a friction coefficient

Newton (1.8.0 was tried) simulates in time; here it is damped until it rests. Each cable becomes a
routed tendon: an anchor at the motor, one pinhole for each hole, an anchor at the end. Every span
between two holes has the compliance of its wire, every hole its friction coefficient.

Without friction, both say within 1 % how far the weight lowers the tip. With friction the position
of rest depends on what came before: in Newton wire also slips in the iterations of a step, so the
tip ends a few percent lower than `cdsm.load_cycle` says; slower loading and more iterations make it
less. It lies in the band of `cdsm.rest_band`, which is proved for all earlier loads.

Joints are stiff springs in Newton, and its numbers have 32 bits: the cables here are soft cords,
beside which such joints are rigid. Of steel wire they would take part of the tension.
"""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np

import cdsm
from cdsm.support.values import Array

STEP = 1e-4
STEPS = 400
ITERATIONS = 20
DAMPING = 0.98
"""Time step [s]; steps of each phase (settle, load, rest), and iterations of each step; part of the
velocity that a step leaves, so that the arm comes to rest."""

HELD, TURNED = 1e7, 1e3
"""Stiffness of joints [N/m], [N m/rad] where they do not turn. Where the second is much larger, the
iterations do not converge: the cables go slack, and the arm falls."""

WEIGHT = 0.981
"""Hung at the tip [N]."""


class Guide(NamedTuple):
    """A point of a tendon, and the span that ends there.

    Attributes:
        link: Index of the link from 1, or 0 for the base.
        offset: Position in the frame of the link [m].
        friction: Coefficient of the hole; None at an anchor, where the wire is held.
        rest: Unstretched length of the span before this point [m]; -1 at the motor, for none.
        compliance: rest/EA of that span [m/N].
    """

    link: int
    offset: tuple[float, ...]
    friction: float | None
    rest: float
    compliance: float


def arm(friction: float) -> cdsm.Manipulator:
    """Build an arm of two hinges at right angles, its cords of EA = 2 kN, with friction."""
    geometry = cdsm.Geometry.hinged(
        joints=2, twist=np.pi / 2.0, cables_per_joint=2, link_length=0.06, base_length=0.03,
        disk_offset=0.005, hole_radius=0.02, link_mass=0.05, lead=0.1, friction=friction,
    )  # fmt: skip
    return cdsm.Manipulator(geometry, elasticity=cdsm.LinearElasticity(2e3))


def guides(pose: cdsm.Posture, tension: cdsm.Tension) -> list[list[Guide]]:
    """Return the points of each cable, with spans that carry its tension at this posture.

    The rest length of a span is ℓ/(1 + F/EA) with its length ℓ and the tension F of its cable. The
    first span is the lead and the way to the first hole.
    """
    spans = iter(pose.segments.lengths.tolist())
    tendons = []
    for cable, force in zip(pose.arm.cables, tension.values.tolist(), strict=True):
        rigidity = float(cable.elasticity.rigidity(force))
        first, last = cable.sites[0], cable.sites[-1]
        x, y, z = first.position
        points = [Guide(0, (x - cable.lead, y, z), None, -1.0, 0.0)]
        for site in cable.sites:
            rest = next(spans) / (1.0 + force / rigidity)
            link = int(site.link.removeprefix("link")) if site.link.startswith("link") else 0
            friction = None if site is last else site.friction
            points.append(Guide(link, tuple(site.position), friction, rest, rest / rigidity))
        tendons.append(points)
    return tendons


def rest(pose: cdsm.Posture, tension: cdsm.Tension, weight: float) -> tuple[Array, Array]:
    """Bring the arm to rest in Newton; return the tip before and under the weight (3,) [m]."""
    import newton
    import warp as wp

    geometry = pose.arm.geometry
    build = newton.ModelBuilder(gravity=tuple(pose.arm.gravity.tolist()))
    bodies, joints = [-1], []
    origins = [geometry.base_length, *(link.length for link in geometry.links)]
    for link, joint, x in zip(geometry.links, geometry.joints, origins, strict=False):
        body = build.add_link(
            mass=link.mass,
            com=(link.length / 2.0, 0.0, 0.0),
            inertia=wp.mat33(np.eye(3) * 2e-5),  # [kg m²]; it does not matter at rest
            lock_inertia=True,
        )
        place = wp.transform((x, 0.0, 0.0))
        axis = tuple(joint.axes[0])
        joints.append(build.add_joint_revolute(bodies[-1], body, axis=axis, parent_xform=place))
        bodies.append(body)
    build.add_articulation(joints)
    build.joint_q[:] = pose.q.tolist()
    kinds = newton.TendonGuideType
    for points in guides(pose, tension):
        build.add_tendon(
            [
                newton.TendonGuide(
                    body=bodies[each.link],
                    guide_type=kinds.ANCHOR if each.friction is None else kinds.PINHOLE,
                    offset=each.offset,
                    mu=each.friction or 0.0,
                    rest_length=each.rest,
                    compliance=each.compliance,
                )
                for each in points
            ]
        )
    build.color()
    model = build.finalize(device="cpu")
    solver = newton.solvers.SolverVBD(
        model, iterations=ITERATIONS, rigid_joint_linear_ke=HELD, rigid_joint_angular_ke=TURNED,
        rigid_joint_linear_kd=0.0, rigid_joint_angular_kd=0.0, tendon_settle_tol=1e-6,
    )  # fmt: skip
    state, other, control = model.state(), model.state(), model.control()
    newton.eval_fk(model, model.joint_q, model.joint_qd, state)
    length, tips = geometry.links[-1].length, []

    def along(distance: float) -> Array:
        """Return a vector along the last link, in base axes."""
        x, y, z, w = state.body_q.numpy()[-1, 3:].astype(float)
        return distance * np.array(
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + z * w), 2.0 * (x * z - y * w)]
        )

    for k in range(3 * STEPS):
        force = np.array([0.0, 0.0, -weight * min(1.0, max(0.0, k / STEPS - 1.0))])
        wrench = np.zeros((len(joints), 6), np.float32)
        wrench[-1] = [*force, *np.cross(along(length / 2.0), force)]  # about the centre of mass
        state.body_f.assign(wrench)
        solver.step(state, other, control, None, STEP)
        other.body_qd.assign(DAMPING * other.body_qd.numpy())
        state, other = other, state
        if (k + 1) % STEPS == 0:
            tips.append(state.body_q.numpy()[-1, :3].astype(float) + along(length))
    return tips[0], tips[2]


def main() -> None:
    """Hang the weight in both, and print how far the tip sinks."""
    friction = float(sys.argv[1]) if len(sys.argv) > 1 else 0.0
    pose = arm(friction).at([0.1, 0.1])
    tension = cdsm.distribute_tension(pose, minimum=20.0)
    wrench = [0.0, 0.0, -WEIGHT, 0.0, 0.0, 0.0]
    free = cdsm.equilibrium(pose, tension, wrench)
    before, under = rest(pose, tension, WEIGHT)
    sinks = 1e3 * (before - under)[2]
    expected = -1e3 * free.displacement[2]
    print(f"Newton: {WEIGHT} N at the tip lower it by {sinks:.4f} mm")
    print(f"cdsm, without friction:           {expected:.4f} mm")
    if friction:
        band = cdsm.rest_band(free.pose, free.tension, "z", wrench)
        low, high = expected - 1e3 * band.high, expected - 1e3 * band.low
        inside = "inside" if low <= sinks <= high else "OUTSIDE"
        path = -1e3 * (cdsm.load_cycle(pose, tension, [wrench]).tip[0] - pose.tip[:3, 3])[2]
        print(f"cdsm, μ = {friction}, loaded once:       {path:.4f} mm")
        print(f"cdsm, whatever came before: {low:.4f} to {high:.4f} mm; Newton is {inside}")
    else:
        print(f"they differ by {100.0 * abs(sinks / expected - 1.0):.2f} %")


if __name__ == "__main__":
    main()
