"""Numbers of others beside those of cdsm: ``PYTHONPATH=examples python -m tests.validation.table``.

Nothing is fitted here. docs/reference/validation.md shows the table and says what its columns are.
"""

import math
from collections.abc import Iterator
from importlib.util import find_spec
from typing import NamedTuple

import numpy as np
import simplex as tensegrity

import cdsm
from cdsm.support.values import Array

SIMPLEX = "Feron, Rhode-Barbarigos, Latteur, J. Struct. Eng. 149(7), 2023"
PAPER = "Dai, Wang, Wang, Yuan, RA-L 2026"
ELASTICA = "Bisshopp and Drucker, Q. Appl. Math. 3, 1945: elastica"


class Row(NamedTuple):
    """One number of others, and that of cdsm."""

    what: str
    source: str
    unit: str
    theirs: float
    ours: float
    uncertainty: float  # what theirs leaves open; nan where that is not known


def rows() -> list[Row]:
    """Compute the whole table; MuJoCo's rows are left out where it is not installed."""
    found = [*simplex(), *hinge(), *capstan(), *elastica()]
    return [*found, *(tendons() if find_spec("mujoco") else ()), *paper()]


def simplex() -> Iterator[Row]:
    rest = tensegrity.at_rest()
    stress = np.linalg.svd(cdsm.presets.simplex().at(np.zeros(12)).length_jacobian.T)[2][-1]
    yield Row("simplex: force in a strut", SIMPLEX, "kN", 1.5, rest.tension[9] / 1e3, 0.05)
    for name, cable, theirs in (("horizontal", 0, 0.393), ("diagonal", 6, 0.681)):
        ratio = float(stress[cable] / stress[9])
        yield Row(f"simplex: {name} cable over strut", SIMPLEX, "-", theirs, ratio, 5e-4)
    frequency = float(cdsm.modes(rest.stiffness).frequencies[0])
    yield Row("simplex: lowest mode, lumped masses", SIMPLEX, "Hz", 2.166, frequency, 5e-4)
    share = 100.0 * tensegrity.active_share(rest)
    own = "numpy program of its own"
    yield Row("simplex: active share of that mode", own, "%", 81.0, share, 0.5)


def hinge() -> Iterator[Row]:
    h, R, lead, EA, F = 0.012, 0.025, 0.2, 48e3, 400.0
    geometry = cdsm.Geometry.hinged(
        joints=1, twist=0.0, link_length=0.05, base_length=0.03, disk_offset=h, hole_radius=R,
        link_mass=0.0, lead=lead,
    )  # fmt: skip
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(EA), gravity=(0, 0, 0))
    ours = float(cdsm.stiffness(arm.at([0.0]), np.full(2, F)).joint[0, 0])
    theirs = 2.0 * EA * (1.0 + F / EA) / (lead + 2.0 * h) * R**2 - F * h
    yield Row(
        "hinge under 400 N", r"$2\,EA/l_0\,R^2 - F h$", "N m/rad", theirs, ours, 1e-12 * theirs
    )


def capstan() -> Iterator[Row]:
    """Pull one cable of a bent arm through all its holes: the tension falls by exp(−μ Σβ)."""
    friction = 0.1
    geometry = cdsm.Geometry.hinged(
        joints=3, twist=0.0, link_length=0.06, base_length=0.03, disk_offset=0.012,
        hole_radius=0.025, link_mass=0.0, lead=0.1, spread=math.radians(10.0), friction=friction,
    )  # fmt: skip
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(48e3), gravity=(0, 0, 0))
    pose = arm.at(np.deg2rad([15.0, 15.0, 15.0]))
    taken = np.zeros((1, len(arm.cables)))
    taken[0, -1] = 2e-3
    history = cdsm.load_cycle(pose, np.full(len(arm.cables), 50.0), np.zeros((1, 6)), motors=taken)
    segments = arm.at(history.angles[-1]).segments
    start = segments.chains.start
    passed = segments.chains.hole >= start[-2]
    T = history.segment_tensions[-1][start[-2] :]
    theirs = math.exp(-friction * segments.wrap[passed].sum())
    ours = float(T[-1] / T[0])
    source = rf"$\exp(-\mu\sum\beta)$, {np.count_nonzero(passed)} holes, μ = {friction:g}"
    what = "tension at the end of a pulled cable over that of its motor"
    yield Row(what, source, "-", theirs, ours, 1e-9)


def many_joints(joints: int) -> tuple[cdsm.Posture, Array, float]:
    """Build a straight chain of hinges, one metre long, whose bending stiffness EI is uniform.

    Each joint has two cables of its own, from the disk before it to the disk after it, and K =
    2 EA/l_0 R² − F h as above: EI = K L/n. Joints in the middle of as many pieces are the second
    order rule for the bending of a beam. Returns the chain, its tensions [N] and EI [N m²].
    """
    piece = 1.0 / joints
    h, R, lead, EA, F = piece / 8.0, 0.01, 0.5, 1e6, 1e4
    geometry = cdsm.Geometry.hinged(  # spread: of holes that no cable uses
        joints=joints, twist=0.0, link_length=[*[piece] * (joints - 1), piece / 2.0], spread=1e-3,
        base_length=piece / 2.0, disk_offset=h, hole_radius=R, link_mass=0.0, joint_limit=1.0,
    )  # fmt: skip
    law, cables = cdsm.LinearElasticity(EA), []
    for k in range(joints):
        link, at = (f"link{k}", piece - h) if k else ("base_disk", piece / 2.0 - h)
        for name, z in (("above", R), ("below", -R)):
            ends = cdsm.Site(link, (at, 0.0, z)), cdsm.Site(f"link{k + 1}", (h, 0.0, z))
            cables.append(cdsm.Cable(f"{name}{k + 1}", ends, law, lead))
    arm = cdsm.Manipulator(geometry, cables=cables, gravity=(0, 0, 0))
    EI = piece * (2.0 * EA * (1.0 + F / EA) / (lead + 2.0 * h) * R**2 - F * h)
    return arm.at(np.zeros(joints)), np.full(2 * joints, F), EI


def elastica(joints: int = 40) -> Iterator[Row]:
    # beside the beam that a chain becomes as the number of its joints grows
    pose, F, EI = many_joints(joints)
    left = 1.0 / joints**2  # what the second-order rule leaves out, up to a factor
    K = cdsm.stiffness(pose, F)
    bent = f"beam, {joints} joints"
    # −∂(J_Xᵀ W)/∂θ of a push P along the chain is P times that of a push of 1 N
    push = -cdsm.stiffness(pose, F, [-1, 0, 0, 0, 0, 0]).load
    critical = 1.0 / float(np.linalg.eigvals(np.linalg.solve(K.joint, push)).real.max())
    yield Row("tip stiffness across", f"3 EI/L³, {bent}", "-", 3.0, K.along("z") / EI, 3.0 * left)
    euler = math.pi**2 / 4.0
    yield Row("buckling load P L²/EI", f"Euler, {bent}", "-", euler, critical / EI, euler * left)
    for load, theirs in ((1.0, 0.30172), (2.0, 0.49346)):
        wrench = [0.0, 0.0, -load * EI, 0.0, 0.0, 0.0]
        tip = cdsm.equilibrium(pose, F, wrench).pose.tip[:3, 3]
        what = f"tip deflection over L at P L²/EI = {load:g}, {joints} joints"
        yield Row(what, ELASTICA, "-", theirs, -float(tip[2]), theirs * left)


def tendons() -> Iterator[Row]:
    import mujoco

    arm = cdsm.presets.virtual_prototype(cdsm.LinearElasticity(48e3))
    pose = arm.at(np.full(arm.nv, math.radians(10.0)))
    tension = cdsm.distribute_tension(pose, minimum=50.0)
    model = mujoco.MjModel.from_xml_string(cdsm.to_mjcf(arm, pose, tension))
    data, step = mujoco.MjData(model), 1e-5

    def torque(q: Array) -> Array:
        data.qpos[:], data.qvel[:] = q, 0.0
        mujoco.mj_forward(model, data)
        return np.array(data.qfrc_bias - data.qfrc_actuator - data.qfrc_passive)

    there, moves = data.qpos.copy(), step * np.eye(model.nv)
    joint = np.array([(torque(there + e) - torque(there - e)) / (2.0 * step) for e in moves]).T
    torque(there)
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, "tool0")
    linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, linear, angular, site)
    compliance = linear @ np.linalg.solve(joint, linear.T)
    K = cdsm.stiffness(pose, tension)
    for axis, u in zip("xyz", np.eye(3), strict=True):
        theirs = 1e-3 / float(u @ compliance @ u)
        what = f"virtual prototype, 50 N: stiffness along {axis}"
        yield Row(what, "MuJoCo, differences", "N/mm", theirs, K.along(axis) / 1e3, 1e-6 * theirs)


def paper() -> Iterator[Row]:
    from cdsm.paper.simulation import figure_4, figure_6, figure_7

    for claim in (each for figure in (figure_4, figure_6, figure_7) for each in figure().claims):
        if claim.difference is None or claim.paper is None:
            continue
        for axis, theirs, ours in zip("xyz", claim.paper, claim.computed, strict=True):
            what = f"{claim.figure}: {claim.quantity}, {axis}"
            yield Row(what, f"{PAPER}; {claim.assumption}", claim.unit, theirs, ours, math.nan)


def markdown(table: list[Row]) -> str:
    lines = ["| what | theirs | cdsm | uncertainty | source |", "|---|--:|--:|--:|---|"]
    for row in table:
        open_ = "not stated" if math.isnan(row.uncertainty) else f"{row.uncertainty:.1g}"
        unit = "" if row.unit == "-" else f" {row.unit}"
        numbers = f"{row.theirs:.4g}{unit} | {row.ours:.4g}{unit} | {open_}"
        lines.append(f"| {row.what} | {numbers} | {row.source} |")
    return "\n".join(lines)


if __name__ == "__main__":
    print(markdown(rows()))
