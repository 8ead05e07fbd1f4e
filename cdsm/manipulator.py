"""An arm with its cables, and the postures it takes.

:class:`Manipulator` is what does not change, :class:`Posture` everything that depends on the joint
angles alone. A posture is frozen, and exists only once all of it is computed.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm import _kernels, _stiffness_kernels
from cdsm._checks import (
    LARGEST,
    SMALLEST,
    Array,
    ReadOnlyState,
    frozen,
    instance,
    sequence_of,
    vector,
)
from cdsm._rigid_body import RigidBody
from cdsm._routing import route
from cdsm.cable import Cable, serpentine_cables
from cdsm.elasticity import Elasticity
from cdsm.errors import (
    CableError,
    ElasticityRangeError,
    InvalidInput,
    JointLimitError,
)
from cdsm.geometry import Geometry
from cdsm.urdf import TIP, to_urdf
from cdsm.urdf_reader import read_urdf

GRAVITY = (0.0, 0.0, -9.81)
"""Default gravity in base axes [m/s²]."""

_LIMIT_SLACK = 1e-9
"""Angles this far [rad] beyond a limit are rounding, as of a conversion from degrees."""

_STEP = 1e-5
"""Relative step of the difference of dEA/dF."""


@final
class Manipulator:
    """A cable-driven arm: rigid links, revolute joints, frictionless cables.

    Args:
        geometry: The arm.
        elasticity: Of all cables, or one per cable; the cables are then those of
            :func:`~cdsm.cable.serpentine_cables`.
        cables: The cables, instead of ``elasticity``: any sites on any links of :attr:`urdf`.
        gravity: In base axes (3,) [m/s²]; (0, 0, 0) for none.

    Raises:
        InvalidInput: Both or neither of ``elasticity`` and ``cables``; gravity not three numbers.
        CableError: Two cables of one name, or one on a link that does not exist.
    """

    def __init__(
        self,
        geometry: Geometry,
        elasticity: Elasticity | Sequence[Elasticity] | None = None,
        *,
        cables: Sequence[Cable] | None = None,
        gravity: ArrayLike = GRAVITY,
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
        self._build(described, to_urdf(described), cables, TIP, gravity)

    @classmethod
    def from_urdf(
        cls,
        urdf: str | os.PathLike[str],
        cables: Sequence[Cable],
        *,
        tip: str,
        gravity: ArrayLike = GRAVITY,
        check_inertia: bool = True,
    ) -> Manipulator:
        """A robot of somebody else's: a tree of revolute, prismatic and fixed joints, and cables.

        Where a joint slides, its coordinate is in m, its torque a force [N], and so on.

        Args:
            urdf: Path of the file, or the text itself.
            cables: Its cables, as :func:`~cdsm.cable_file.read_cables` reads them.
            tip: The link whose frame is the tip, ``tool0`` of other docstrings.
            gravity: In base axes (3,) [m/s²]; (0, 0, 0) for none.
            check_inertia: Refuse moments of inertia that no body has. Stiffness does not depend on
                them, :func:`~cdsm.modes.modes` do.

        Raises:
            FileError: The file cannot be read.
            UrdfError: It is no such robot; every fault is listed.
            UnknownName: There is no link called ``tip``.
            CableError: Two cables of one name, or one on a link that does not exist.
        """
        arm = cls.__new__(cls)
        arm._build(None, read_urdf(urdf, check_inertia=check_inertia), cables, tip, gravity)
        return arm

    def _build(
        self,
        geometry: Geometry | None,
        urdf: str,
        cables: Sequence[Cable],
        tip: str,
        gravity: ArrayLike,
    ) -> None:
        """Set everything, once: from checked URDF text, and the geometry behind it if any."""
        self._geometry = geometry
        self._cables = _checked_cables(cables)
        self._gravity = vector("gravity", gravity, 3, "gravity in base axes [m/s²]")
        self._urdf, self._tip_link = urdf, tip
        self._body = RigidBody(urdf, tip, self._gravity)
        tree = self._body.tree()
        routing = route(self._body, tree, self._cables)
        self._tree, self._routing, self._masses = tree, routing, self._body.masses()
        self._constants = (*tree, *routing)
        self._segments = routing.segment, routing.joint

        way = "angle [rad] or way [m]" if self._body.slides.any() else "angle [rad]"
        self._meaning_of_q = f"one {way} per joint, {', '.join(self.joint_names)}"
        self._lowest = self._body.lower - _LIMIT_SLACK
        self._highest = self._body.upper + _LIMIT_SLACK

        held = [c for c, cable in enumerate(self._cables) if cable.control == "position"]
        by_law: dict[object, list[int]] = {}
        for c in held:
            by_law.setdefault(_key(self._cables[c].elasticity), []).append(c)
        # one law for all is the usual case, and a slice costs less than indices
        self._held_by_law = [
            (
                self._cables[cables[0]].elasticity,
                slice(None) if len(cables) == len(self._cables) else np.array(cables),
            )
            for cables in by_law.values()
        ]
        self._least = frozen(np.array([cable.minimum for cable in self._cables]))
        self._most = frozen(np.array([cable.maximum for cable in self._cables]))
        self._bounded = bool(self._least.any() or np.isfinite(self._most).any())
        series = np.array([cable.series_stiffness for cable in self._cables])
        self._series_compliance = 1.0 / series

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
        """Whether it was made from a :class:`~cdsm.geometry.Geometry`."""
        return self._geometry is not None

    @property
    def name(self) -> str:
        """Name of the robot."""
        return self._body.name

    @cached_property
    def _touching(self) -> NDArray[np.bool_]:
        """Which joints (nv,) are stopped by disks that touch."""
        if self._geometry is None:
            return np.zeros(self.nv, dtype=np.bool_)
        joints = self._geometry.joints
        return np.array([joint.limit is None for joint in joints for _ in joint.axes])

    @cached_property
    def length(self) -> float:
        """Way from the base over the joints to the tip, all joints at zero [m]."""
        return self._body.length if self._geometry is None else self._geometry.length

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
    def nv(self) -> int:
        """Degrees of freedom."""
        return self._body.nv

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints; their order is that of every (nv,) array."""
        return self._body.joint_names

    @property
    def lower(self) -> Array:
        """Lower joint limits (nv,) [rad]."""
        return self._body.lower

    @property
    def upper(self) -> Array:
        """Upper joint limits (nv,) [rad]."""
        return self._body.upper

    def __repr__(self) -> str:
        return f"<Manipulator {self}>"

    def __str__(self) -> str:
        if self._geometry is not None:
            return str(self._geometry)
        return (
            f"{self.name}: {self.nv} degrees of freedom, {len(self._cables)} cables, "
            f"{self.length:.4g} m long"
        )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Manipulator) and self._value == other._value

    def __hash__(self) -> int:
        return hash(self._urdf)  # an elasticity of the user's own need not be hashable

    @property
    def _value(self) -> tuple[Geometry | None, str, tuple[Cable, ...], str, tuple[float, ...]]:
        gravity = tuple(self._gravity.tolist())
        return self._geometry, self._urdf, self._cables, self._tip_link, gravity

    def __reduce__(self) -> tuple[object, ...]:
        return (_rebuild, self._value)

    def with_cables(self, cables: Sequence[Cable]) -> Manipulator:
        """The same robot with other cables.

        Args:
            cables: One or more.

        Raises:
            CableError: Two cables of one name, or one on a link that does not exist.
        """
        return _rebuild(self._geometry, self._urdf, tuple(cables), self._tip_link, self._gravity)

    def at(self, q: ArrayLike, *, check_limits: bool = True) -> Posture:
        """Evaluate the arm at joint angles q: kinematics, cable lengths and gravity.

        Args:
            q: Joint angles (nv,) [rad], in the order of :attr:`joint_names`.
            check_limits: Refuse angles beyond the joint limits.

        Raises:
            InvalidInput: q is not (nv,) finite real numbers.
            JointLimitError: An angle is beyond its limit, and ``check_limits`` is set.
            CableError: Two neighbouring sites of a cable coincide at this posture.
        """
        q = self._angles(q, check_limits)
        state = self._body.state(q)
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
            InvalidInput: q is not (nv,) finite real numbers.
            JointLimitError: An angle is beyond its limit, and ``check_limits`` is set.
            CableError: Two neighbouring sites of a cable coincide at this posture.
        """
        return self._routed(self._angles(q, check_limits))[1]

    def _angles(self, q: ArrayLike, check_limits: bool) -> Array:
        """Joint angles (nv,) [rad], checked and read-only."""
        q = vector("q", q, self.nv, self._meaning_of_q)
        if check_limits:
            beyond = (q < self._lowest) | (q > self._highest)
            if np.count_nonzero(beyond):
                raise JointLimitError(
                    [self.joint_names[i] for i in np.flatnonzero(beyond)],
                    q[beyond].tolist(),
                    list(zip(self.lower[beyond], self.upper[beyond], strict=True)),
                )
        return q

    def _routed(self, q: Array) -> tuple[_kernels.Frames, Array, Array]:
        """Where joints and cable sites are, L and J_L at checked joint angles.

        Raises:
            CableError: Two neighbouring sites of a cable coincide at this posture.
        """
        *frames, lengths, length_jacobian, coincident = _kernels.evaluate(*self._constants, q)
        if coincident >= 0:
            raise CableError(
                self._cables[self._segments[0][coincident, 0]].name,
                f"two neighbouring sites coincide at q = {q.tolist()}, so the cable has no "
                "direction there. Move a site, or change the posture.",
            )
        return _kernels.Frames(*map(frozen, frames)), frozen(lengths), frozen(length_jacobian)

    def _cable_stiffness(self, lengths: Array, tension: Array) -> Array:
        """Diagonal of K_L (C,) [N/m]: 1/(l_0/EA(F) + 1/k_series), 0 for force-controlled cables.

        Of checked free lengths (C,) [m] and tensions (C,) [N].

        Raises:
            ElasticityRangeError: Names the cables whose tension is outside their elasticity's
                domain.
            InvalidInput: An elasticity of the user's own gives no positive rigidity.
        """
        stiffness = np.zeros(len(self._cables))
        for law, held in self._held_by_law:
            pulled = tension[held]
            try:
                rigidity = checked_rigidity(law, pulled)
            except ElasticityRangeError as error:
                raise self._naming_cables(error, held) from None
            compliance = lengths[held] / rigidity + self._series_compliance[held]
            stiffness[held] = 1.0 / compliance
        return frozen(stiffness)

    def _cable_stiffness_slopes(self, tension: Array, stiffness: Array) -> tuple[Array, Array]:
        """dk/dF (C,) [1/m] and d²k/dF² (C,) [1/(N m)] of cables of stiffness k under F (C,) [N].

        k′ = (k² l_0/EA) EA′/EA = k (1 − k/k_series) EA′/EA: the free length need not be known. EA″
        is a difference, good for some five digits.

        Raises:
            ElasticityRangeError: As for :meth:`_cable_stiffness`.
            InvalidInput: An elasticity of the user's own gives no finite slope.
        """
        first, second = np.zeros_like(stiffness), np.zeros_like(stiffness)
        for law, held in self._held_by_law:
            F, k = tension[held], stiffness[held]
            last = np.array([*law.jumps, law.domain.high])[np.searchsorted(law.jumps, F)]
            step = _STEP * np.maximum(F, 1.0)
            beside = np.where(F + step <= last, F + step, F - step)
            try:
                slopes = np.asarray(law.rigidity_slope(np.stack([F, beside])))
                EA = law.rigidity(F)
            except ElasticityRangeError as error:
                raise self._naming_cables(error, held) from None
            if slopes.shape != (2, F.size) or not np.isfinite(slopes).all():
                raise InvalidInput(
                    "elasticity",
                    f"{law!r} gives the slopes {slopes} of its rigidity at tensions {F} N and "
                    "beside them; one finite number for each is needed.",
                )
            growth, wire = slopes[0] / EA, 1.0 - k * self._series_compliance[held]
            bend = (slopes[1] - slopes[0]) / (beside - F) / EA - growth**2
            first[held] = k * wire * growth
            second[held] = first[held] * growth * (2.0 * wire - 1.0) + k * wire * bend
        return frozen(first), frozen(second)

    def _naming_cables(
        self, error: ElasticityRangeError, held: slice | NDArray[np.intp]
    ) -> ElasticityRangeError:
        """The error of a law at the tensions of some cables, with their names and numbers."""
        outside = np.arange(len(self._cables))[held][list(error.indices)].tolist()
        names = [self._cables[c].name for c in outside]
        return ElasticityRangeError(error.problem, error.tension, outside, names)


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Posture(ReadOnlyState):
    """Everything that depends on the joint angles alone; made by :meth:`Manipulator.at`.

    All arrays are read-only and in base axes.

    Attributes:
        arm: The arm.
        q: Joint angles (nv,) [rad].
        tip: Pose of ``tool0`` (4, 4), translation in m (Eqs. 3–4).
        jacobian: J_X (6, nv): linear rows [m/rad] first, then angular, at ``tool0``.
        cable_lengths: L (C,) [m], lead included (Eq. 8).
        length_jacobian: J_L = ∂L/∂θ (C, nv) [m/rad].
        gravity_torque: g = ∂V/∂θ (nv,) [N m], V the potential energy: J_Hᵀ G_g of Eq. 13.
        gravity_stiffness: ∂g/∂θ (nv, nv) [N m/rad]: H_H G_g of Eq. 16.
    """

    arm: Manipulator
    q: Array
    tip: Array
    jacobian: Array
    cable_lengths: Array
    length_jacobian: Array
    gravity_torque: Array
    gravity_stiffness: Array
    _frames: _kernels.Frames

    def __repr__(self) -> str:
        x, y, z = self.tip[:3, 3]
        return f"<Posture of {self.arm.name}, tip at ({x:.4g}, {y:.4g}, {z:.4g}) m>"

    @cached_property
    def length_hessian(self) -> Array:
        """H_L[c, i, j] = ∂²L_c/∂θ_i∂θ_j, (C, nv, nv) [m/rad²], built on first use."""
        count, nv = self.length_jacobian.shape
        hessian = np.zeros((count, nv, nv))
        _kernels.add_length_hessian(
            *self.arm._segments, *self._frames, frozen(np.ones(count)), np.arange(count), hessian
        )
        return frozen(hessian)

    @cached_property
    def cable_paths(self) -> tuple[Array, ...]:
        """The sites of each cable in base axes, one array (sites, 3) per cable [m]."""
        counts = [len(cable.sites) for cable in self.arm.cables]
        paths = np.split(self._frames.site, np.cumsum(counts)[:-1])
        return tuple(frozen(path.copy()) for path in paths)

    @property
    def bones(self) -> tuple[Array, ...]:
        """Straight lines from joint to joint, and to the tip, (2, 3) each [m]: a stick figure."""
        origin, parent = self._frames.origin, self.arm._tree.parent
        tip = self.arm._masses.tip
        lines = [np.array([origin[parent[i]], origin[i]]) for i in range(1, len(origin))]
        lines.append(np.array([origin[tip], self.tip[:3, 3]]))
        return tuple(frozen(line) for line in lines if (line[0] != line[1]).any())

    def link_pose(self, link: str) -> Array:
        """Pose of a link's frame in the base, (4, 4) [m].

        Raises:
            UnknownName: There is no such link.
        """
        return frozen(self.arm._body.placement(self.q, link))

    def _joint_stiffness(
        self, tension: Array, cable_stiffness: Array, wrench: Array
    ) -> tuple[Array, Array, Array, Array]:
        """Active, passive, load and K_θ (nv, nv); of checked, read-only vectors."""
        active, passive, load, joint = _stiffness_kernels.joint_stiffness(
            *self.arm._segments,
            *self._frames,
            self.jacobian,
            self.length_jacobian,
            self.gravity_stiffness,
            tension,
            cable_stiffness,
            wrench,
        )
        return frozen(active), frozen(passive), frozen(load), frozen(joint)


def _rebuild(
    geometry: Geometry | None,
    urdf: str,
    cables: tuple[Cable, ...],
    tip: str,
    gravity: ArrayLike,
) -> Manipulator:
    arm = Manipulator.__new__(Manipulator)
    arm._build(geometry, urdf, cables, tip, gravity)
    return arm


def checked_rigidity(law: Elasticity, tension: Array) -> Array:
    """EA(F) [N] of a law, same shape as F [N], which need not be the library's own.

    Raises:
        ElasticityRangeError: A tension outside the domain of the law.
        InvalidInput: The law gives no positive rigidity.
    """
    rigidity = np.asarray(law.rigidity(tension))
    usable = (rigidity >= SMALLEST) & (rigidity <= LARGEST)  # false for NaN too
    if rigidity.shape != tension.shape or np.count_nonzero(usable) < tension.size:
        raise InvalidInput(
            "elasticity",
            f"{law!r} gives the rigidity {rigidity} N at tensions {tension} N; one positive "
            "number for each is needed.",
        )
    return rigidity


def _key(law: Elasticity) -> object:
    """What equal laws share; an elasticity of the user's own need not be hashable."""
    try:
        hash(law)
    except TypeError:
        return id(law)
    return law


def _checked_cables(cables: Sequence[Cable]) -> tuple[Cable, ...]:
    cables = sequence_of("cables", cables, Cable)
    if not cables:
        raise InvalidInput("cables", "none given; an arm needs at least one.")
    names = [cable.name for cable in cables]
    for name in names:
        if names.count(name) > 1:
            raise CableError(name, "the name is used twice; every cable needs its own.")
    return cables
