"""The arms of the tests written down for MuJoCo, and what it computes of them."""

from functools import cache

import mujoco
import numpy as np

import cdsm
from cdsm.support.values import Array
from cdsm.urdf import CROSS_INERTIA, CROSS_MASS


def _text(numbers: Array | tuple[float, ...]) -> str:
    return " ".join(repr(float(x)) for x in numbers)


@cache
def mujoco_model(arm: cdsm.Manipulator) -> mujoco.MjModel:
    """The same arm written down for MuJoCo, from its geometry and its cables' sites."""
    geometry = arm.geometry
    sites: dict[str, list[str]] = {}
    tendons = []
    for c, cable in enumerate(arm.cables):
        path = []
        for i, site in enumerate(cable.sites):
            name = f"site{c}_{i}"
            sites.setdefault(site.link, []).append(
                f'<site name="{name}" pos="{_text(site.position)}"/>'
            )
            path.append(f'<site site="{name}"/>')
        tendons.append(f'<spatial name="{cable.name}">{"".join(path)}</spatial>')

    def body(name: str, x: float, axes: tuple[tuple[float, ...], ...], inertia: str) -> str:
        hinges = "".join(f'<joint type="hinge" axis="{_text(axis)}"/>' for axis in axes)
        return f'<body name="{name}" pos="{x!r} 0 0">{hinges}{inertia}{"".join(sites[name])}'

    def inertial(x: float, mass: float) -> str:
        # gravity asks for the masses alone
        moments = _text((CROSS_INERTIA,) * 3)
        return f'<inertial pos="{x!r} 0 0" mass="{mass!r}" diaginertia="{moments}"/>'

    start, bodies, depth = geometry.base_length, "", 0
    sites.setdefault(f"link{len(geometry.links)}", []).append(
        f'<site name="tool0" pos="{geometry.links[-1].length!r} 0 0"/>'
    )
    for k, (joint, link) in enumerate(zip(geometry.joints, geometry.links, strict=True), start=1):
        sites.setdefault(f"link{k}", [])
        sites.setdefault(f"cross{k}", [])
        if len(joint.axes) == 2:
            bodies += body(f"cross{k}", start, joint.axes[:1], inertial(0.0, CROSS_MASS))
            start, depth = 0.0, depth + 1
        weight = inertial(link.length / 2, link.mass or CROSS_MASS)
        bodies += body(f"link{k}", start, joint.axes[-1:], weight)
        start, depth = link.length, depth + 1
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco>
          <compiler angle="radian"/>
          <option gravity="{_text(arm.gravity)}" jacobian="dense"/>
          <worldbody>{"".join(sites["base_disk"])}{bodies}{"</body>" * depth}</worldbody>
          <tendon>{"".join(tendons)}</tendon>
        </mujoco>"""
    )


def in_mujoco(pose: cdsm.Posture) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco_model(pose.arm)
    data = mujoco.MjData(model)
    data.qpos[:] = pose.q
    mujoco.mj_forward(model, data)
    return model, data


def tendon_jacobian(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    dense = np.zeros((model.ntendon, model.nv))
    for t, (start, count) in enumerate(zip(model.ten_J_rowadr, model.ten_J_rownnz, strict=True)):
        entries = slice(start, start + count)
        dense[t, model.ten_J_colind[entries]] = data.ten_J[entries]
    return dense


def mass(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Joint-space mass matrix (nv, nv) [kg m²]."""
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    return M
