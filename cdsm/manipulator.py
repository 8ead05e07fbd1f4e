"""An arm with its cables, and the postures it takes.

:class:`Manipulator` is what does not change, :class:`Posture` everything that depends on the joint
angles alone. A posture is frozen, and exists only once all of it is computed.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from functools import cached_property
from typing import final, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.arm_model import ArmModel, OriginalLength
from cdsm.cable import Cable, serpentine_cables
from cdsm.elasticity import Elasticity
from cdsm.errors import (
    CableError,
    InvalidInput,
    JointLimitError,
)
from cdsm.geometry import Geometry
from cdsm.kernels import segments
from cdsm.kernels.tree import Frames
from cdsm.posture import Posture
from cdsm.rigid_body import RigidBody
from cdsm.support.format import JointUnits
from cdsm.support.validation import flag, instance, one_of, sequence_of, vector
from cdsm.support.values import Array, Printed, frozen
from cdsm.urdf import TIP, to_urdf
from cdsm.urdf_reader import read_urdf

GRAVITY = (0.0, 0.0, -9.81)
"""Default gravity in base axes [m/s²]."""

_Value = tuple[
    Geometry | None,
    str,
    tuple[Cable, ...],
    str,
    tuple[float, ...],
    OriginalLength,
    tuple[str, ...],
]


@final
class Manipulator(Printed):
    """A cable-driven arm: rigid links, revolute joints, frictionless cables.

    Args:
        geometry: The arm.
        elasticity: Of all cables, or one per cable; the cables are then those of
            :func:`~cdsm.serpentine_cables`.
        cables: The cables, instead of ``elasticity``: any sites on any links of :attr:`urdf`.
        gravity: In base axes (3,) [m/s²]; (0, 0, 0) for none.
        original_length: Of which length of a locked wire EA/l_0 is taken: ``"unstrained"``, what
            the motor holds, ℓ/(1 + ε(F)) of a wire that is ℓ long under F; or ``"stretched"``, ℓ
            itself, as in the paper's figures, which makes K too low by the strain, 3–5 % for
            Eq. 19.

    Raises:
        InvalidInput: Both or neither of ``elasticity`` and ``cables``; gravity not three numbers;
            the rigidity of an elasticity of your own jumps.
        CableError: Two cables of one name, or one on a link that does not exist.
        UnknownName: No such ``original_length``.
    """

    def __init__(
        self,
        geometry: Geometry,
        elasticity: Elasticity | Sequence[Elasticity] | None = None,
        *,
        cables: Sequence[Cable] | None = None,
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
        cables: Sequence[Cable],
        *,
        tip: str,
        joint_names: Sequence[str] | None = None,
        gravity: ArrayLike = GRAVITY,
        check_inertia: bool = True,
        original_length: OriginalLength = "unstrained",
    ) -> Manipulator:
        """A robot of somebody else's: a tree of revolute, prismatic and fixed joints, and cables.

        Where a joint slides, its coordinate is in m, its torque a force [N], and so on.

        Args:
            urdf: Path of the file, or the text itself.
            cables: Its cables, as :func:`~cdsm.read_cables` reads them.
            tip: The link whose frame is the tip, ``tool0`` of other docstrings.
            joint_names: The joints that move, in the order that q is to have. None: from the base
                on, each branch to its end, branches in the order of their joints' names
                (Pinocchio's order).
            gravity: In base axes (3,) [m/s²]; (0, 0, 0) for none.
            check_inertia: Refuse moments of inertia that no body has. Stiffness does not depend on
                them, :func:`~cdsm.modes` do.
            original_length: As for :class:`Manipulator`.

        Raises:
            FileError: The file cannot be read.
            UrdfError: It is no such robot; every fault is listed.
            UnknownName: There is no link called ``tip``, or no such ``original_length``.
            InvalidInput: ``joint_names`` does not name each joint that moves once; the rigidity of
                an elasticity of your own jumps.
            CableError: Two cables of one name, or one on a link that does not exist.
        """
        text = read_urdf(urdf, check_inertia=check_inertia)
        return _rebuild(None, text, cables, tip, gravity, original_length, joint_names)

    def _build(
        self,
        geometry: Geometry | None,
        urdf: str,
        cables: Sequence[Cable],
        tip: str,
        gravity: ArrayLike,
        original_length: OriginalLength,
        joint_names: Sequence[str] | None = None,
    ) -> None:
        """Set everything, once: from checked URDF text, and the geometry behind it if any."""
        self._geometry = geometry
        self._cables = _checked_cables(cables)
        self._gravity = vector("gravity", gravity, 3, "gravity in base axes [m/s²]", "gravity")
        self._urdf, self._tip_link = urdf, tip
        one_of("original_length", original_length, get_args(OriginalLength))
        self._original_length: OriginalLength = original_length
        body = RigidBody(urdf, tip, self._gravity, joint_names)
        self._model = ArmModel.of(body, self._cables, original_length)

    @property
    def geometry(self) -> Geometry:
        """The geometry it was made from.

        Raises:
            InvalidInput: It was made from a URDF.
        """
        if self._geometry is None:
            raise InvalidInput(
                "geometry", f"{self.name} was made from a URDF and has none; see arm.urdf."
            )
        return self._geometry

    @property
    def is_serpentine(self) -> bool:
        """Whether it was made from a :class:`~cdsm.Geometry`."""
        return self._geometry is not None

    @property
    def name(self) -> str:
        """Name of the robot."""
        return self._model.body.name

    @cached_property
    def length(self) -> float:
        """Way from the base over the joints to the tip, all joints at zero [m].

        Of a robot from a URDF at least the largest distance of a cable's site from its joint: the
        tip may sit on a joint, and a length that errors are compared with is not zero.
        """
        if self._geometry is not None:
            return self._geometry.length
        reach = float(np.linalg.norm(self._model.routing.point, axis=1).max())
        return max(self._model.body.length, reach)

    @property
    def tip_link(self) -> str:
        """Name of the link whose frame is the tip."""
        return self._tip_link

    @property
    def urdf(self) -> str:
        """Its URDF text."""
        return self._urdf

    @property
    def cables(self) -> tuple[Cable, ...]:
        """Its cables; their order is that of every (C,) array."""
        return self._cables

    @property
    def gravity(self) -> Array:
        """Gravity in base axes (3,) [m/s²]."""
        return self._gravity

    @property
    def original_length(self) -> OriginalLength:
        """Of which length of a locked wire EA/l_0 is taken; see :class:`Manipulator`."""
        return self._original_length

    @property
    def nv(self) -> int:
        """Degrees of freedom."""
        return self._model.body.nv

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints; their order is that of every (nv,) array."""
        return self._model.body.joint_names

    @property
    def slides(self) -> NDArray[np.bool_]:
        """Whether each joint slides (nv,): its coordinate is a way [m], not an angle [rad]."""
        return self._model.body.slides

    @property
    def joint_units(self) -> tuple[str, ...]:
        """Unit of each joint's coordinate (nv,): rad, or m where it slides."""
        return JointUnits(self.slides).coordinates

    def torque_unit(self, joint: int | None = None) -> str:
        """Unit of the torque of a joint: N where it slides; or that of all of them together."""
        return JointUnits(self.slides).torque(joint)

    def stiffness_unit(self) -> str:
        """Unit of the diagonal of K_θ and of its eigenvalues: N/m where joints slide."""
        return JointUnits(self.slides).stiffness()

    @property
    def lower(self) -> Array:
        """Lower joint limits (nv,) [rad]; [m] where a joint slides."""
        return self._model.body.lower

    @property
    def upper(self) -> Array:
        """Upper joint limits (nv,) [rad]; [m] where a joint slides."""
        return self._model.body.upper

    def __repr__(self) -> str:
        return f"<Manipulator {self}>"

    def __str__(self) -> str:
        free = f"{self.nv} degrees of freedom"
        if self._geometry is not None:
            free = f"{len(self._geometry.joints)} joints ({free})"
        return f"{self.name}: {free}, {len(self._cables)} cables, {self.length:.6g} m long"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Manipulator) and self._value == other._value

    def __hash__(self) -> int:
        return hash(self._urdf)  # an elasticity of the user's own need not be hashable

    @property
    def _value(self) -> _Value:
        return (
            self._geometry,
            self._urdf,
            self._cables,
            self._tip_link,
            tuple(self._gravity.tolist()),
            self._original_length,
            self.joint_names,
        )

    def __reduce__(self) -> tuple[object, ...]:
        return (_rebuild, self._value)

    def with_cables(self, cables: Sequence[Cable]) -> Manipulator:
        """The same robot with other cables.

        Args:
            cables: One or more.

        Raises:
            InvalidInput: Not a list or tuple of cables.
            CableError: Two cables of one name, or one on a link that does not exist.
        """
        geometry, urdf, _, tip, gravity, original_length, names = self._value
        return _rebuild(geometry, urdf, cables, tip, gravity, original_length, names)

    def at(self, q: ArrayLike, *, check_limits: bool = True) -> Posture:
        """Evaluate the arm at joint angles q: kinematics, cable lengths and gravity.

        Args:
            q: Joint angles (nv,) [rad], in the order of :attr:`joint_names`.
            check_limits: Refuse angles beyond the joint limits.

        Raises:
            InvalidInput: q is not (nv,) finite real numbers, or ``check_limits`` no flag.
            JointLimitError: An angle is beyond its limit, and ``check_limits`` is set.
            CableError: Two neighbouring sites of a cable coincide at this posture.
        """
        q = self._angles(q, check_limits)
        state = self._model.body.state(q)
        # Pinocchio hands out placements one Python object per joint, 14 µs for ten joints; the
        # kernel places joints and cable sites itself in 2 µs. A test holds the two equal.
        frames, lengths, length_jacobian = self._routed(q)
        return Posture(
            arm=self,
            q=q,
            tip=frozen(state.tip),
            jacobian=frozen(state.jacobian),
            cable_lengths=lengths,
            length_jacobian=length_jacobian,
            gravity_torque=frozen(state.gravity_torque),
            gravity_stiffness=frozen(state.gravity_stiffness),
            _frames=frames,
        )

    def cable_lengths(self, q: ArrayLike, *, check_limits: bool = True) -> Array:
        """L(q) (C,) [m], lead included (Eq. 8): ``at(q).cable_lengths`` and nothing else.

        Args:
            q: Joint angles (nv,) [rad], in the order of :attr:`joint_names`.
            check_limits: Refuse angles beyond the joint limits.

        Raises:
            InvalidInput: q is not (nv,) finite real numbers, or ``check_limits`` no flag.
            JointLimitError: An angle is beyond its limit, and ``check_limits`` is set.
            CableError: Two neighbouring sites of a cable coincide at this posture.
        """
        return self._routed(self._angles(q, check_limits))[1]

    def _angles(self, q: ArrayLike, check_limits: bool) -> Array:
        """Joint angles (nv,) [rad], checked and read-only."""
        q = vector("q", q, self.nv, self._meaning_of_q)
        if flag("check_limits", check_limits):
            beyond = self._model.beyond_limits(q)
            if np.count_nonzero(beyond):
                raise JointLimitError(
                    [self.joint_names[i] for i in np.flatnonzero(beyond)],
                    q[beyond].tolist(),
                    list(zip(self.lower[beyond], self.upper[beyond], strict=True)),
                    [self.joint_units[i] for i in np.flatnonzero(beyond)],
                )
        return q

    @cached_property
    def _meaning_of_q(self) -> str:
        coordinate = "angle [rad] or way [m]" if self.slides.any() else "angle [rad]"
        return f"one {coordinate} per joint, {', '.join(self.joint_names)}"

    def _routed(self, q: Array) -> tuple[Frames, Array, Array]:
        """Where joints and cable sites are, L and J_L at checked joint angles."""
        routing = self._model.routing
        *arrays, lengths, length_jacobian, coincident = segments.cable_kinematics(
            self._model.tree, routing, q
        )
        if coincident >= 0:
            raise CableError(
                self._cables[routing.segment[coincident, 0]].name,
                f"two neighbouring sites coincide at q = {q.tolist()}, so the cable has no "
                "direction there. Move a site, or change the posture.",
            )
        return Frames(*map(frozen, arrays)), frozen(lengths), frozen(length_jacobian)


def _rebuild(
    geometry: Geometry | None,
    urdf: str,
    cables: Sequence[Cable],
    tip: str,
    gravity: ArrayLike,
    original_length: OriginalLength,
    joint_names: Sequence[str] | None,
) -> Manipulator:
    arm = Manipulator.__new__(Manipulator)
    arm._build(geometry, urdf, cables, tip, gravity, original_length, joint_names)
    return arm


def _checked_cables(cables: Sequence[Cable]) -> tuple[Cable, ...]:
    cables = sequence_of("cables", cables, Cable)
    if not cables:
        raise InvalidInput("cables", "none given; an arm needs at least one.")
    counts = Counter(cable.name for cable in cables)
    for name, count in counts.items():
        if count > 1:
            raise CableError(name, "the name is used twice; every cable needs its own.")
    return cables
