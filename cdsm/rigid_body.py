"""Rigid-body model of an arm. Only this module imports Pinocchio.

Pinocchio crashes on wrong ids, misreads unusual memory layouts, and its scratch data are not
thread-safe. Therefore this module finds links by name, and each thread has scratch data of its own.
Callers must pass checked arrays; they receive copies.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from cdsm.errors import InvalidInput, UrdfError
from cdsm.kernels.bodies import Masses
from cdsm.kernels.tree import Tree
from cdsm.support.validation import one_of, sequence_of
from cdsm.support.values import Array, frozen


class Shapes(NamedTuple):
    """Shapes of a URDF that a viser server draws: how to move them, and which joints have any."""

    place: Callable[[Array], None]  # moves the shapes to joint angles (nv,) [rad]
    rows: frozenset[int]  # rows in Tree of the joints whose links have shapes


class RigidBody:
    """A Pinocchio model of a tree of revolute and prismatic joints, with one tip frame.

    The URDF text must have passed :mod:`cdsm.urdf_reader`. Arguments and errors are as for
    :meth:`cdsm.Manipulator.from_urdf`.
    """

    def __init__(
        self, urdf: str, tip: str, gravity: Array, joint_names: Sequence[str] | None = None
    ) -> None:
        try:
            self._model = model = pin.buildModelFromXML(urdf)
        except ValueError as error:
            raise UrdfError(f"Pinocchio does not accept the URDF: {error}") from None
        model.gravity.linear = np.array(gravity)
        names = tuple(model.names)[1:]
        if model.nq != len(names) or model.nv != len(names):
            raise UrdfError(
                "the URDF has a joint with more than one coordinate; cdsm takes revolute and "
                "prismatic ones."
            )
        self.joint_names = names if joint_names is None else _reordered(names, joint_names)
        # index in Pinocchio's order of each of our coordinates, and the inverse permutation
        self._theirs = frozen(np.array([names.index(name) for name in self.joint_names]))
        self._ours = frozen(np.argsort(self._theirs))
        self._ids: tuple[int, ...] = tuple((1 + self._theirs).tolist())
        self.nv: int = model.nv
        self.name: str = model.name
        self.lower: Array = frozen(np.array(model.lowerPositionLimit)[self._theirs])
        self.upper: Array = frozen(np.array(model.upperPositionLimit)[self._theirs])
        self._frames = {
            frame.name: index
            for index, frame in enumerate(model.frames)
            if frame.type == pin.FrameType.BODY
        }
        self._tip = self._frame(tip)
        self._scratch = threading.local()
        self._twists = frozen(self._local_twists())
        self.slides = frozen(np.asarray(~self._twists[:, 3:].any(axis=1)))

    @property
    def link_names(self) -> tuple[str, ...]:
        """Names of all links."""
        return tuple(self._frames)

    def locate(self, link: str) -> tuple[int, Array, Array]:
        """Return the row in :class:`Tree` of the joint that carries a link, and the link's frame.

        The frame is a rotation (3, 3) and a translation (3,) [m] in the frame of this joint. Raises
        UnknownName if the arm has no such link.
        """
        frame = self._model.frames[self._frame(link)]
        return (
            self._row(frame.parentJoint),
            frame.placement.rotation.copy(),
            frame.placement.translation.copy(),
        )

    def tree(self) -> Tree:
        """Build the kinematic tree as plain arrays."""
        model = self._model
        rows = (0, *self._ids)
        return Tree.of(
            parent=np.array([self._row(model.parents[i]) for i in rows], dtype=np.intp),
            order=1 + self._ours,
            rotation=np.array([model.jointPlacements[i].rotation for i in rows]),
            translation=np.array([model.jointPlacements[i].translation for i in rows]),
            axis=np.vstack([np.zeros(3), self._twists[:, 3:]]),
            slide=np.vstack([np.zeros(3), self._twists[:, :3]]),
        )

    @property
    def length(self) -> float:
        """Length of the path from the base through the joints to the tip at q = 0 [m]."""
        frame = self._model.frames[self._tip]
        length = float(np.linalg.norm(frame.placement.translation))
        for joint in reversed(self._path(frame.parentJoint)):
            length += float(np.linalg.norm(self._model.jointPlacements[joint].translation))
        return length

    def _local_twists(self) -> Array:
        """Compute the unit twist of each joint in the joint's frame (nv, 6), linear part first."""
        model, data = self._model, self._data()
        pin.computeJointJacobians(model, data, pin.neutral(model))
        return np.array(
            [
                pin.getJointJacobian(model, data, i, pin.LOCAL).reshape(6, -1)[:, i - 1]
                for i in self._ids
            ]
        )

    def masses(self) -> Masses:
        """Return masses of the bodies that the joints carry, gravity, and the tip's frame."""
        model, tip = self._model, self._model.frames[self._tip]
        inertias = [model.inertias[i] for i in (0, *self._ids)]
        return Masses(
            mass=np.array([inertia.mass for inertia in inertias]),
            centre=np.array([inertia.lever for inertia in inertias]),
            gravity=np.array(model.gravity.linear),
            tip=self._row(tip.parentJoint),
            tip_joints=np.array([self._row(j) - 1 for j in self._path(tip.parentJoint)], np.intp),
            rotation=tip.placement.rotation.copy(),
            point=tip.placement.translation.copy(),
        )

    def pseudo_inertias(self) -> Array:
        """Compute :func:`pseudo_inertia` (1 + nv, 4, 4) of what the base and the joints carry."""
        bodies = [self._model.inertias[i] for i in (0, *self._ids)]
        return np.array([pseudo_inertia(each.mass, each.lever, each.inertia) for each in bodies])

    def tip(self, q: Array) -> tuple[Array, Array]:
        """Compute the pose (4, 4) of the tip and its Jacobian (6, nv), at joint angles q (nv,).

        The Jacobian has the linear rows first, in base axes.
        """
        model, data = self._model, self._data()
        pin.computeJointJacobians(model, data, q[self._ours])
        jacobian = pin.getFrameJacobian(model, data, self._tip, pin.LOCAL_WORLD_ALIGNED)
        pose: Array = pin.updateFramePlacement(model, data, self._tip).homogeneous
        # for a model with one joint, Pinocchio returns a vector
        return pose, jacobian.reshape(6, self.nv).take(self._theirs, axis=1)

    def placement(self, q: Array, link: str) -> Array:
        """Compute the pose of a link's frame in the base frame (4, 4), or raise UnknownName."""
        model, data, frame = self._model, self._data(), self._frame(link)
        pin.forwardKinematics(model, data, q[self._ours])
        placement: Array = pin.updateFramePlacement(model, data, frame).homogeneous
        return placement

    def potential_energy(self, q: Array) -> float:
        """Compute the gravitational energy V of all links [J] at joint angles (nv,) [rad]."""
        return float(pin.computePotentialEnergy(self._model, self._data(), q[self._ours]))

    def mass_matrix(self, q: Array) -> Array:
        """Compute the joint-space mass matrix M (nv, nv) [kg m²] at joint angles (nv,) [rad]."""
        M = np.array(pin.crba(self._model, self._data(), q[self._ours])).reshape(self.nv, self.nv)
        ours: Array = M[np.ix_(self._theirs, self._theirs)]
        return ours

    def visualizer(self, urdf: str, server: object, node: str) -> Shapes | None:
        """Draw the visual shapes of a URDF below a node of a viser server, and return them.

        Returns None if the URDF has no shapes. Raises UrdfError, and draws nothing, if a shape
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
            raise UrdfError(
                f"the shapes of the URDF cannot be drawn: {str(error).strip().rstrip('.')}. Meshes "
                "of a package:// are looked for in the folders of ROS_PACKAGE_PATH."
            ) from None
        rows = frozenset(self._row(shape.parentJoint) for shape in shapes.geometryObjects)
        return Shapes(lambda q: drawn.display(q[self._ours]), rows)

    def _path(self, joint: int) -> list[int]:
        """Return Pinocchio's indices of the joints from the base to ``joint``, included."""
        return list(self._model.supports[joint])[1:]

    def _row(self, joint: int) -> int:
        """Convert Pinocchio's index of a joint to its row in :class:`Tree`; the base is 0."""
        return 1 + int(self._ours[joint - 1]) if joint else 0

    def _frame(self, link: str) -> int:
        # Pinocchio fails if it searches a name that is not UTF-8
        return self._frames[one_of("link", link, self._frames)]

    def _data(self) -> pin.Data:
        # scratch memory: one per thread, made once, since it takes milliseconds for long arms
        if not hasattr(self._scratch, "data"):
            self._scratch.data = self._model.createData()
        return self._scratch.data


def _reordered(names: tuple[str, ...], wanted: Sequence[str]) -> tuple[str, ...]:
    """Return ``wanted``, the order of joints; InvalidInput unless it has each of ``names`` once."""
    wanted = sequence_of("joint_names", wanted, str)
    if sorted(wanted) != sorted(names):
        missing = [name for name in names if name not in wanted]
        others = [name for name in wanted if name not in names or wanted.count(name) > 1]
        faults = ", ".join(
            f"{what} {', '.join(map(repr, dict.fromkeys(some)))}"
            for what, some in (("leaves out", missing), ("has too many of", others))
            if some
        )
        raise InvalidInput("joint_names", f"{faults}; name each joint that moves once.")
    return wanted


def pseudo_inertia(mass: float, centre: Array, inertia: Array) -> Array:
    """Compute the second moments ∫(r, 1)(r, 1)ᵀ dm (4, 4) of a body, which add up.

    ``inertia`` (3, 3) is about the centre of mass.
    """
    moments = np.empty((4, 4))
    about_centre = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    moments[:3, :3] = about_centre + mass * np.outer(centre, centre)
    moments[:3, 3] = moments[3, :3] = mass * centre
    moments[3, 3] = mass
    return moments


def accepts(urdf: str) -> bool:
    """Return whether Pinocchio reads a URDF."""
    try:
        pin.buildModelFromXML(urdf)
    except ValueError:
        return False
    return True


def rotation_vector(rotation: Array) -> tuple[Array, Array]:
    """Compute the rotation vector φ (3,) [rad] of a rotation (3, 3), and its derivative (3, 3).

    The derivative maps an angular velocity ω in base axes to the rate of change of φ.
    """
    return pin.log3(rotation), pin.Jlog3(rotation).T
