"""Rigid-body model of an arm: everything that Pinocchio says about joint angles.

Only this module imports Pinocchio. It crashes on wrong ids, misreads unusual memory layouts, and
its scratch data are not thread-safe. Therefore this module finds links by name, and each thread has
scratch data of its own. Callers must pass checked arrays; they receive copies.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from lxml import etree
from numpy.typing import NDArray

from cdsm.errors import GeometryError, InvalidInput, listed
from cdsm.joints import coupling_of, limits_of, mimics_of
from cdsm.support.validation import one_of
from cdsm.support.values import Array, frozen

GRAVITY = (0.0, 0.0, -9.81)
"""Default gravity in base axes [m/s²]."""

LIMIT_SLACK = 1e-9
"""Angle [rad] beyond a limit that is accepted as rounding, e.g. of a conversion from degrees."""

_ENDLESS = 1e300  # limit of a continuous joint in the text that Pinocchio reads


class State(NamedTuple):
    """What Pinocchio computes at joint angles q; all in base axes, joints in the order of q.

    Of n joints, nv are independent.
    """

    tip: Array  # pose of the tip (4, 4), translation in m
    jacobian: Array  # J_X (6, nv) at the tip, linear rows first
    gravity_torque: Array  # g = ∂V/∂q (nv,)
    gravity_stiffness: Array  # ∂g/∂q (nv, nv)
    twist: Array  # (v, z) (6, n): a point x that joint j moves has ∂x/∂θ_j = v_j + z_j × x
    placement: Array  # poses (n+1, 4, 4) of the base and of the joints' frames


class TreeArrays(NamedTuple):
    """The kinematic tree as plain arrays: row 0 is the base, row i Pinocchio's joint i."""

    parent: NDArray[np.intp]  # row of the joint before, a smaller one, (nv+1,)
    rotation: Array  # frame of each joint in that of its parent at q = 0 (nv+1, 3, 3)
    translation: Array  # (nv+1, 3) [m]
    twist: Array  # unit twist of each joint in its own frame (nv+1, 6), linear part first
    mass: Array  # of what each joint carries (nv+1,) [kg]
    centre: Array  # centre of these masses in the joint's frame (nv+1, 3) [m]
    tip: int  # row of the joint that carries the tip
    tip_rotation: Array  # frame of the tip in that of its joint (3, 3)
    tip_point: Array  # (3,) [m]


class Shapes(NamedTuple):
    """Shapes of a URDF that a viser server draws."""

    place: Callable[[Array], None]  # moves the shapes to joint angles (nv,) [rad]
    rows: frozenset[int]  # rows in TreeArrays of the joints whose links have shapes
    nodes: Mapping[str, list[str]]  # names of the nodes by their links


class RigidBody:
    """A Pinocchio model of a tree of revolute and prismatic joints, with one tip frame.

    The URDF text must have passed :mod:`cdsm.urdf_reader`. Arguments and errors are as for
    :meth:`cdsm.Manipulator.from_urdf`.
    """

    def __init__(
        self, urdf: str, tip: str, gravity: Array, joint_names: Sequence[str] | None = None
    ) -> None:
        robot = etree.fromstring(urdf.encode())
        try:
            self._model = model = pin.buildModelFromXML(_bounded(robot))
        except ValueError as error:
            raise GeometryError(f"Pinocchio does not accept the URDF: {error}") from None
        model.gravity.linear = np.array(gravity)
        names = tuple(model.names)[1:]
        mimics = mimics_of(robot)
        free = tuple(name for name in names if name not in mimics)
        self.joint_names = free if joint_names is None else _reordered(free, joint_names)
        self.all_joints = names
        self.coupling = coupling_of(mimics, names, self.joint_names)
        self.nv = len(self.joint_names)
        self.name: str = model.name
        self.lower: Array = frozen(_unlimited(model.lowerPositionLimit))
        self.upper: Array = frozen(_unlimited(model.upperPositionLimit))
        self.narrowing: tuple[tuple[str, ...], ...] = ((),) * self.nv
        if self.coupling:
            limits = limits_of(self.coupling, names, self.lower, self.upper)
            self.lower = limits.lower
            self.upper = limits.upper
            self.narrowing = limits.narrowing
        self.lowest = frozen(self.lower - LIMIT_SLACK)
        self.highest = frozen(self.upper + LIMIT_SLACK)
        self._frames = {
            frame.name: index
            for index, frame in enumerate(model.frames)
            if frame.type == pin.FrameType.BODY
        }
        self.link_names = tuple(self._frames)
        joints = robot.iterfind("joint")
        self._before = {joint.get("name"): joint.find("parent").get("link") for joint in joints}
        self._tip = self._frame(tip)
        self._scratch = threading.local()
        self.parent: list[int] = list(model.parents)
        to_tip = self.joints_to(model.frames[self._tip].parentJoint)
        self.tip_row, _, self.tip_offset = self.locate(tip)
        self.tip_joints = frozen(np.array(to_tip, np.intp) - 1)
        self._twists = frozen(self._local_twists())
        slides = np.asarray(~self._twists[1:, 3:].any(axis=1))
        self.all_units = tuple(np.where(slides, "m", "rad").tolist())
        self.slides = frozen(slides[list(self.coupling.leaders)] if self.coupling else slides)

    @property
    def joint_units(self) -> tuple[str, ...]:
        """Unit of each joint's coordinate (nv,): rad, or m for a prismatic joint."""
        return tuple("m" if slides else "rad" for slides in self.slides)

    @property
    def branches(self) -> bool:
        """Whether two joints hang on one link, so that the order of joints is not plain."""
        return len({*self.parent[1:]}) < len(self.parent) - 1

    def state(self, q: Array) -> State:
        """Compute everything at joint angles q (nv,)."""
        model = self._model
        data = self._data()
        slope = pin.computeGeneralizedGravityDerivatives(model, data, self._angles(q))
        jacobian = pin.getFrameJacobian(model, data, self._tip, pin.LOCAL_WORLD_ALIGNED)
        # for a model with one joint, Pinocchio returns vectors
        n = len(self.all_joints)
        J = jacobian.reshape(6, n).copy()
        twist = data.J.reshape(6, n).copy()
        torque = data.g.copy()
        slope = slope.reshape(n, n).copy()
        if self.coupling:
            S = self.coupling.matrix
            J = J @ S
            torque = torque @ S
            slope = self.coupling.square(slope)
        tip = pin.updateFramePlacement(model, data, self._tip).homogeneous
        placement = np.array([frame.homogeneous for frame in data.oMi])
        return State(tip, J, torque, slope, twist, placement)

    def tip(self, q: Array) -> tuple[Array, Array]:
        """Compute only the pose (4, 4) of the tip and J_X (6, nv) of :meth:`state`."""
        model = self._model
        data = self._data()
        pin.computeJointJacobians(model, data, self._angles(q))
        jacobian = pin.getFrameJacobian(model, data, self._tip, pin.LOCAL_WORLD_ALIGNED)
        pose: Array = pin.updateFramePlacement(model, data, self._tip).homogeneous
        J = jacobian.reshape(6, -1)
        return pose, J @ self.coupling.matrix if self.coupling else J

    def link_placements(self, q: Array) -> dict[str, Array]:
        """Compute the poses (4, 4) of the frames of all links in base axes, by name."""
        data = self._data()
        pin.framesForwardKinematics(self._model, data, self._angles(q))
        return {name: data.oMf[index].homogeneous for name, index in self._frames.items()}

    def potential_energy(self, q: Array) -> float:
        """Compute the gravitational energy V of all links [J] at joint angles (nv,) [rad]."""
        return float(pin.computePotentialEnergy(self._model, self._data(), self._angles(q)))

    def mass_matrix(self, q: Array) -> Array:
        """Compute the joint-space mass matrix M (nv, nv) [kg m²] at joint angles (nv,) [rad]."""
        M: Array = np.array(pin.crba(self._model, self._data(), self._angles(q)))
        M = M.reshape(2 * (len(self.all_joints),))
        return self.coupling.square(M) if self.coupling else M

    def locate(self, link: str) -> tuple[int, Array, Array]:
        """Return the row of the joint that carries a link, and the link's frame in the joint's.

        The frame is a rotation (3, 3) and a translation (3,) [m]. InvalidInput if there is no
        such link.
        """
        frame = self._model.frames[self._frame(link)]
        place = frame.placement
        return int(frame.parentJoint), place.rotation.copy(), place.translation.copy()

    @cached_property
    def moved_by(self) -> Array:
        """1 where joint a, the column, moves what joint b, the row, carries; else 0 (n, n)."""
        moves = np.eye(len(self.all_joints))
        for b, row in enumerate(self.parent[1:]):
            if row:
                moves[b] += moves[row - 1]
        return frozen(moves)

    def joint_axis(self, joint: str) -> tuple[str, Array, Array]:
        """Return the link before a joint, and a point of the joint's axis and the axis (3,) there.

        Raises InvalidInput if there is no such joint that turns.
        """
        turning = [n for n, t in zip(self.all_joints, self._twists[1:], strict=True) if t[3:].any()]
        row = 1 + self.all_joints.index(one_of("joint", joint, turning))
        place = self._model.jointPlacements[row]
        link = self._before[joint]
        _, rotation, translation = self.locate(link)
        axis = place.rotation @ self._twists[row, 3:]
        return link, rotation.T @ (place.translation - translation), rotation.T @ axis

    @cached_property
    def straight(self) -> Array:
        """Joint angles (nv,) [rad] of the straight arm: 0, or the limit nearest to 0."""
        return frozen(np.clip(np.zeros(self.nv), self.lower, self.upper))

    def joints_to(self, row: int) -> list[int]:
        """Return the rows of the joints from the base to the joint in ``row``, included."""
        rows: list[int] = []
        while row:
            rows.insert(0, row)
            row = self.parent[row]
        return rows

    @property
    def length(self) -> float:
        """Length of the path from the base through the joints to the tip at q = 0 [m]."""
        model = self._model
        steps = [model.jointPlacements[1 + joint] for joint in self.tip_joints.tolist()]
        steps.append(model.frames[self._tip].placement)
        return float(sum(np.linalg.norm(step.translation) for step in steps))

    def arrays(self) -> TreeArrays:
        """Return the kinematic tree as plain arrays."""
        model = self._model
        tip = self._model.frames[self._tip]
        places = list(model.jointPlacements)
        inertias = list(model.inertias)
        return TreeArrays(
            parent=np.array(self.parent, dtype=np.intp),
            rotation=np.array([place.rotation for place in places]),
            translation=np.array([place.translation for place in places]),
            twist=self._twists,
            mass=np.array([inertia.mass for inertia in inertias]),
            centre=np.array([inertia.lever for inertia in inertias]),
            tip=int(tip.parentJoint),
            tip_rotation=tip.placement.rotation.copy(),
            tip_point=tip.placement.translation.copy(),
        )

    def visualizer(self, urdf: str, server: object, node: str) -> Shapes | None:
        """Draw the visual shapes of a URDF below a node of a viser server, and return them.

        Returns None if the URDF has no shapes. Raises GeometryError, and draws nothing, if a shape
        cannot be read.
        """
        from pinocchio.visualize import ViserVisualizer

        model = self._model.copy()  # a visualiser may change the model
        try:
            shapes = pin.buildGeomFromUrdfString(model, urdf, pin.GeometryType.VISUAL)
            if not shapes.ngeoms:
                return None
            drawn = ViserVisualizer(model, pin.GeometryModel(), shapes)
            drawn.initViewer(viewer=server)
            drawn.loadViewerModel(node)
        except Exception as error:  # mesh loaders raise many types of errors
            server.scene.remove_by_name(node)  # type: ignore[attr-defined]
            raise GeometryError(
                f"the shapes of the URDF cannot be drawn: {str(error).strip().rstrip('.')}. Meshes "
                "of a package:// are looked for in the folders of ROS_PACKAGE_PATH."
            ) from None
        rows = frozenset(int(shape.parentJoint) for shape in shapes.geometryObjects)
        nodes: dict[str, list[str]] = {}
        for shape in shapes.geometryObjects:
            link = model.frames[shape.parentFrame].name
            nodes.setdefault(link, []).append(f"{node}/visual/{shape.name}")
        return Shapes(lambda q: drawn.display(self._angles(q)), rows, nodes)

    def _local_twists(self) -> Array:
        """Compute the unit twist of each joint in its own frame (nv+1, 6), linear part first."""
        model = self._model
        data = self._data()
        pin.computeJointJacobians(model, data, pin.neutral(model))
        columns = [
            pin.getJointJacobian(model, data, 1 + j, pin.LOCAL).reshape(6, -1)[:, j]
            for j in range(len(self.all_joints))
        ]
        return np.vstack([np.zeros(6), *columns])

    def _angles(self, q: Array) -> Array:
        return self.coupling.angles(q) if self.coupling else q

    def _frame(self, link: str) -> int:
        # Pinocchio fails if it searches a name that is not UTF-8
        return self._frames[one_of("link", link, self._frames)]

    def _data(self) -> pin.Data:
        # scratch memory: one per thread, made once, since it takes milliseconds for long arms
        if not hasattr(self._scratch, "data"):
            self._scratch.data = self._model.createData()
        return self._scratch.data


def _bounded(robot: etree._Element) -> str:
    """Return a URDF without continuous joints, which have two coordinates in Pinocchio."""
    copy = deepcopy(robot)
    for joint in copy.iterfind("joint[@type='continuous']"):
        joint.set("type", "revolute")
        for limit in joint.findall("limit"):
            joint.remove(limit)
        ends = {"lower": -_ENDLESS, "upper": _ENDLESS, "effort": 0, "velocity": 0}
        etree.SubElement(joint, "limit", {key: str(end) for key, end in ends.items()})
    return str(etree.tostring(copy, encoding="unicode"))


def _unlimited(limits: Array) -> Array:
    """Return joint limits with ±inf for those of continuous joints, which Pinocchio cannot read."""
    limits = np.array(limits)
    return np.where(abs(limits) >= _ENDLESS, np.copysign(np.inf, limits), limits)


def _reordered(names: tuple[str, ...], wanted: Sequence[str]) -> tuple[str, ...]:
    """Return ``wanted``, the order of joints; InvalidInput unless it has each of ``names`` once."""
    faults = [f"leaves out {name!r}" for name in names if name not in wanted]
    more = [name for name in dict.fromkeys(wanted) if wanted.count(name) > names.count(name)]
    if faults := faults + [f"has too many of {name!r}" for name in more]:
        raise InvalidInput("joint_names", f"{listed(faults)}; name each joint that moves once.")
    return tuple(wanted)


def rotation_vector(rotation: Array) -> tuple[Array, Array]:
    """Compute the rotation vector φ (3,) [rad] of a rotation (3, 3), and its derivative (3, 3).

    The derivative maps an angular velocity ω in base axes to the rate of change of φ.
    """
    return pin.log3(rotation), pin.Jlog3(rotation).T
