"""An arm with its cables.

:class:`Manipulator` has all data that do not depend on the joint angles. :class:`Posture` has all
results that depend only on them. A posture is frozen: :meth:`Manipulator.at` makes each one.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.arm_facts import ArmFacts, CablesOrFile
from cdsm.arm_model import GRAVITY
from cdsm.cable_laws import OriginalLength
from cdsm.errors import CableError, InvalidInput, JointLimitError
from cdsm.geometry import Geometry
from cdsm.geometry.cables import serpentine_cables
from cdsm.kernels.posture import single_pose
from cdsm.kernels.segments import SHORTEST_SEGMENT
from cdsm.kernels.tree import Frames
from cdsm.posture import Posture, site_paths
from cdsm.support.files import write_text
from cdsm.support.format import beyond
from cdsm.support.validation import flag, instance, vector
from cdsm.support.values import Array, frozen
from cdsm.urdf import TIP, to_urdf
from cdsm.urdf_reader import read_urdf
from cdsm.wires.elasticity import Elasticity

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cdsm.wires.catalogue import Wire


@final
class Manipulator(ArmFacts):
    """A cable-driven arm: rigid links, joints, cables.

    Args:
        geometry: The arm.
        elasticity: One law for all cables, or one law per cable. The cables are then routed by
            :func:`~cdsm.serpentine_cables`.
        cables: The cables, or the path of their file (:func:`~cdsm.read_cables`), if ``elasticity``
            is not given. Their sites may be on any links of :attr:`urdf`.
        gravity: Gravity in base axes (3,) [m/s²], or an axis such as ``"-y"`` for 9.81 m/s² along
            it; (0, 0, 0) for none.
        original_length: Which length is l_0 in the stiffness EA/l_0 of a wire of length ℓ under
            tension F. ``"unstrained"``: ℓ/(1 + ε(F)), constant if the motor is locked.
            ``"stretched"``: ℓ, as in the paper's figures; K is then too low by the strain, 3–5 %
            for Eq. 19.

    Raises:
        InvalidInput: ``elasticity`` and ``cables`` are both given or both missing, or gravity is
            not three numbers.
        CableError: Two cables have the same name, or a cable is on an unknown link.
        UnknownName: ``original_length`` is unknown.
        FileError: The file of the cables cannot be read.
        MissingWire: The file of the cables names no wire for some of them.
    """

    def __init__(
        self,
        geometry: Geometry,
        elasticity: Elasticity | Sequence[Elasticity] | None = None,
        *,
        cables: CablesOrFile | None = None,
        gravity: ArrayLike = GRAVITY,
        original_length: OriginalLength = "unstrained",
    ) -> None:
        described = instance("geometry", geometry, Geometry)
        if elasticity is not None and cables is None:
            cables = serpentine_cables(geometry, elasticity)
        elif elasticity is not None or cables is None:
            raise InvalidInput(
                "elasticity",
                "give one of elasticity= (for the cables of the geometry) and cables=; "
                + ("both were given." if cables is not None else "neither was."),
            )
        self._build(described, to_urdf(described), cables, TIP, gravity, original_length)

    @classmethod
    def from_urdf(
        cls,
        urdf: str | os.PathLike[str],
        cables: CablesOrFile,
        *,
        tip: str,
        joint_names: Sequence[str] | None = None,
        gravity: ArrayLike = GRAVITY,
        check_inertia: bool = True,
        original_length: OriginalLength = "unstrained",
    ) -> Manipulator:
        """Build an arm from a URDF and cables: a tree of revolute, prismatic and fixed joints.

        For prismatic joints the coordinate is in m, the torque in N and the stiffness in N/m.
        :attr:`urdf` has all numbers of the text written anew. A :class:`CdsmWarning` names joints
        with limits beyond two turns, as if in degrees, and links that move without mass.

        Args:
            urdf: Path of the URDF file, or its text.
            cables: Cables of the arm, or the path of their file: see :func:`~cdsm.read_cables`.
            tip: Link whose frame is the tip; other docstrings call it ``tool0``.
            joint_names: The moving joints in the order of q. None: Pinocchio's order: branch by
                branch, each from the base to its end, with the branches sorted by the names of
                their joints.
            gravity: Gravity in base axes (3,) [m/s²], or an axis such as ``"-y"`` for 9.81 m/s²
                along it; (0, 0, 0) for none.
            check_inertia: Refuse moments of inertia that no rigid body can have. Stiffness does not
                depend on them, but :func:`~cdsm.modes` do.
            original_length: As for :class:`Manipulator`.

        Raises:
            FileError: The file of the URDF or of the cables cannot be read.
            MissingWire: The file of the cables names no wire for some of them.
            UrdfError: The URDF is not a supported robot; lists every fault.
            UnknownName: No link is called ``tip``, or ``original_length`` is unknown.
            InvalidInput: ``urdf`` is neither a path nor a text, or ``joint_names`` does not name
                each moving joint once.
            CableError: Two cables have the same name, or a cable is on an unknown link.
        """
        text = read_urdf(urdf, check_inertia=check_inertia)
        arm = cls.__new__(cls)
        arm._build(None, text, cables, tip, gravity, original_length, joint_names)
        return arm

    @classmethod
    def read(cls, path: str | os.PathLike[str], wire: Wire | None = None) -> Manipulator:
        """Read an arm from an ARM.toml: robot, cables, wires, gravity.

        The file has a geometry in a form of :meth:`Geometry.read`, or a table ``[urdf]``. This
        table has ``tip``, and ``file`` (a path, relative to the folder of the ARM.toml) or ``text``
        (the URDF). It may have ``joint_names`` and ``check_inertia`` (see :meth:`from_urdf`). All
        other keys are optional:

        - ``wire``: the wire of all cables: a name such as ``"1x19-1.2mm"``, a constant EA [N], a
          table in the form of :meth:`Elasticity.read`, or the NAME of a table
          ``[wires.NAME]``.
        - ``series_stiffness`` [N/m], ``control``, ``minimum``, ``maximum`` [N]: attributes of all
          cables, as in :class:`Cable`.
        - ``[cables.NAME]``: the same keys for one cable of the geometry; or ``[[cables]]``: all
          cables through any points, as in :func:`~cdsm.read_cables`.
        - ``gravity`` [m/s²], ``original_length``: as for :class:`Manipulator`.
        - ``[tolerances]``: the sources of :class:`Tolerances`; see :meth:`Tolerances.read`.

        Args:
            path: The file; :meth:`write` writes one, ``cdsm new`` another with comments.
            wire: Wire of all cables, instead of the wires in the file: a law, a name, EA [N], or
                the path of a file of :meth:`Elasticity.write`.

        Raises:
            FileError: The file cannot be read or does not describe an arm. Every fault is listed.
            MissingWire: The file has no wire for some cables, and ``wire`` is not given.
            UrdfError: The URDF is not a supported robot; lists every fault.
            CableError: A cable is on an unknown link.
            UnknownName: No link is called ``tip``, or no wire has the name ``wire``.
            InvalidInput: ``joint_names`` does not name each moving joint once.
        """
        from cdsm.arm_file.arm import read_arm  # pydantic: slow to import

        arm = cls.__new__(cls)
        arm._build(*read_arm(path, wire))
        return arm

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write an ARM.toml from which :meth:`read` builds an equal arm; return its path.

        The text of a URDF is written into the same file.

        Raises:
            InvalidInput: An elasticity of this kind cannot be written to a file.
            FileError: The file cannot be written; an existing file stays unchanged.
        """
        from cdsm.arm_file.arm import arm_text

        return write_text(path, arm_text(self._parts))

    def plot(self, q: ArrayLike | None = None) -> Figure:
        """Plot the arm in mm at joint angles q (nv,) [rad].

        If q is None, each angle is 0, or the limit nearest to 0.

        Raises:
            InvalidInput: q is not (nv,) finite real numbers.
            JointLimitError: An angle is beyond its limit.
        """
        return self.at(np.clip(0.0, self.lower, self.upper) if q is None else q).plot()

    def at(self, q: ArrayLike, *, check_limits: bool = True) -> Posture:
        """Evaluate the arm at joint angles q: kinematics, cable lengths and gravity.

        Args:
            q: Joint angles (nv,) [rad], in the order of :attr:`joint_names`.
            check_limits: Refuse angles beyond the joint limits.

        Raises:
            InvalidInput: q is not (nv,) finite real numbers, or ``check_limits`` is not a bool.
            JointLimitError: An angle is beyond its limit, and ``check_limits`` is True.
            CableError: Two neighbouring sites of a cable coincide at this posture.
        """
        q = self._angles(q, check_limits)
        tip, jacobian, lengths, length_jacobian, torque, stiffness, *frames = self._pose(q)
        return Posture(
            arm=self,
            q=q,
            tip=frozen(tip),
            jacobian=frozen(jacobian),
            cable_lengths=frozen(lengths),
            length_jacobian=frozen(length_jacobian),
            gravity_torque=frozen(torque),
            gravity_stiffness=frozen(stiffness),
            _frames=Frames(*map(frozen, frames)),
        )

    def cable_lengths(self, q: ArrayLike, *, check_limits: bool = True) -> Array:
        """Compute only L(q) (C,) [m], lead included (Eq. 8); equal to ``at(q).cable_lengths``.

        The lead is the straight cable between actuator and base disk. Arguments and errors are
        those of :meth:`at`.
        """
        return frozen(self._pose(self._angles(q, check_limits))[2])

    def _angles(self, q: ArrayLike, check_limits: bool) -> Array:
        """Check joint angles (nv,) [rad] and return them read-only."""
        q = vector("q", q, self.nv, self._meaning_of_q)
        if flag("check_limits", check_limits):
            out = np.flatnonzero(self._model.beyond_limits(q)).tolist()
            if out:
                names = [self.joint_names[i] for i in out]
                limits = [(float(self.lower[i]), float(self.upper[i])) for i in out]
                units = [self.joint_units[i] for i in out]
                units = [self.joint_units[i] for i in out]
                texts = [
                    beyond(name, q[i], *limit, unit)
                    for i, name, limit, unit in zip(out, names, limits, units, strict=True)
                ]
                raise JointLimitError(texts, names, q[out].tolist(), limits)
        return q

    @cached_property
    def _meaning_of_q(self) -> str:
        coordinate = "angle [rad] or way [m]" if self.slides.any() else "angle [rad]"
        return f"one {coordinate} per joint, {', '.join(self.joint_names)}"

    def _pose(self, q: Array) -> tuple[Array, ...]:
        """Compute the fields of :class:`Posture` after ``q``, by the kernel ``single_pose``.

        q (nv,) [rad] must be checked. Raises CableError if two neighbouring sites coincide.
        """
        *pose, shortest = single_pose(self._model.arrays, q)
        if shortest < SHORTEST_SEGMENT:
            site = pose[-1]
            for cable, path in zip(self.cables, site_paths(self.cables, site), strict=True):
                if (np.linalg.norm(np.diff(path, axis=0), axis=1) < SHORTEST_SEGMENT).any():
                    raise CableError(
                        cable.name,
                        f"two neighbouring sites coincide at q = {q.tolist()}, so the cable has "
                        "no direction there. Move a site, or change the posture.",
                    )
        return tuple(pose)
