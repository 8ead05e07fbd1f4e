"""An arm with its cables.

:class:`Manipulator` has all data that do not depend on the joint angles. :class:`Posture` has all
results that depend only on them. Both are frozen: :meth:`Manipulator.at` makes each posture.
"""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.cable import Cable, Cables, serpentine_cables
from cdsm.cable_laws import CableLaws
from cdsm.definition import Term, checked_terms
from cdsm.errors import InvalidInput, listed, warn
from cdsm.geometry import Geometry
from cdsm.joints import Spring, Springs, springs_of
from cdsm.posture import Posture
from cdsm.rigid_body import GRAVITY, RigidBody
from cdsm.routing import SHORTEST_SEGMENT, Routing
from cdsm.segments import Chains
from cdsm.status import Status
from cdsm.support.files import write_text
from cdsm.support.format import JointUnits, beyond, plural
from cdsm.support.validation import (
    LONGEST,
    Direction,
    doubts_about_units,
    flag,
    gravity_vector,
    instance,
    sequence_of,
    vector,
)
from cdsm.support.values import Array, Printed, frozen
from cdsm.terms import Gravity, JointSprings
from cdsm.tolerances import Tolerances
from cdsm.urdf import TIP, to_urdf
from cdsm.urdf_reader import read_urdf
from cdsm.wires.elasticity import Elasticity

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cdsm.wires.catalogue import Wire

CablesOrFile = Cable | Sequence[Cable] | str | os.PathLike[str]
"""One or more cables, or the path of their file."""

LIMIT_SLACK = 1e-9
"""Angle [rad] beyond a limit that is accepted as rounding, e.g. of a conversion from degrees."""

_STAY = "Stay inside, or widen joint_limit in the geometry (limit of a joint, or in a URDF)"

UNCHECKED = ", or, in Python, pass check_limits=False to compute beyond them"
"""What the error of angles beyond their limits advises besides, where that can be done."""

_FARTHEST = 5.0  # longest plausible lead and distance of a site [m]; or ten arm lengths, if more

_OF_BODY = ("name", "nv", "joint_names", "slides", "lower", "upper")

ANOTHER_ARM = (
    "another arm; distribute it for this one. with_cables, with_friction, with_gravity and "
    "with_tolerances return another arm."
)
"""What is wrong with tensions of another arm, and what to do."""


@final
@dataclass(frozen=True, init=False, eq=False, repr=False)
class Manipulator(Printed):
    """A cable-driven arm: rigid links, joints, cables.

    Args:
        geometry: The arm.
        elasticity: One law for all cables, or one law per cable. The cables are then routed by
            :func:`~cdsm.serpentine_cables`.
        cables: The cables, or the path of their file (:func:`~cdsm.read_cables`), if ``elasticity``
            is not given. Their sites may be on any links of :attr:`urdf`.
        gravity: Gravity in base axes (3,) [m/s²], or an axis such as ``"-y"`` for 9.81 m/s² along
            it; (0, 0, 0) for none.

    Attributes:
        name: Name of the robot.
        urdf: URDF text of the arm.
        cables: Cables, in the order of every (C,) array; ``cables["cable1_1"]`` is one.
        tip_link: Name of the link whose frame is the tip.
        gravity: Gravity in base axes (3,) [m/s²].
        tolerances: Uncertainties of dimensions and measured values; zero if none were given.
        springs: Springs at the joints: ``springs.stiffness`` k (n,) [N m/rad] and
            ``springs.angle`` q_0 (n,) [rad], at which they have no torque; of all n joints, also
            those that follow others.
        extra_terms: Further terms of the energy, of :meth:`with_terms`.
        nv: Number of degrees of freedom.
        joint_names: Names of the joints, in the order of every (nv,) array.
        slides: Whether each joint is prismatic (nv,); its coordinate is then a length [m].
        lower: Lower joint limits (nv,) [rad]; [m] for prismatic joints.
        upper: Upper joint limits (nv,) [rad]; [m] for prismatic joints.

    Raises:
        InvalidInput: ``elasticity`` and ``cables`` are both given or both missing, or gravity is
            not three numbers. Two cables have the same name, or a cable is on an unknown link.
        FileError: The file of the cables cannot be read.
    """

    name: str
    urdf: str
    cables: Cables
    tip_link: str
    gravity: Array
    tolerances: Tolerances
    springs: Springs
    nv: int
    joint_names: tuple[str, ...]
    slides: NDArray[np.bool_]
    lower: Array
    upper: Array
    _geometry: Geometry | None
    body: RigidBody
    routing: Routing
    laws: CableLaws
    own_springs: dict[str, tuple[float, float]] | None
    extra_terms: tuple[Term, ...]
    _doubts: tuple[str, ...]

    def __init__(
        self,
        geometry: Geometry,
        elasticity: Elasticity | Sequence[Elasticity] | None = None,
        *,
        cables: CablesOrFile | None = None,
        gravity: Direction = GRAVITY,
    ) -> None:
        if isinstance(geometry, str | os.PathLike):
            said = f"{str(geometry)!r} given; a Geometry is needed. "
            said += "Read the file of a robot with Manipulator.from_urdf()."
            raise InvalidInput("geometry", said)
        described = instance("geometry", geometry, Geometry)
        if (elasticity is None) == (cables is None):
            said = "give one of elasticity= (for the cables of the geometry) and cables=; "
            said += f"{'neither was' if cables is None else 'both were given'}."
            raise InvalidInput("elasticity", said)
        if elasticity is not None:
            cables = serpentine_cables(described, elasticity)
        assert cables is not None
        self._define(to_urdf(described), cables, TIP, gravity, None, described)

    @classmethod
    def from_urdf(
        cls,
        urdf: str | os.PathLike[str],
        cables: CablesOrFile,
        *,
        tip: str,
        joint_names: Sequence[str] | None = None,
        gravity: Direction = GRAVITY,
        check_inertia: bool = True,
        springs: Mapping[str, Spring] | None = None,
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
            gravity: As for :class:`Manipulator`.
            check_inertia: Refuse moments of inertia that no rigid body can have. Stiffness does not
                depend on them, but :func:`~cdsm.modes` do.
            springs: As for :meth:`with_springs`; a URDF has no element for them.

        Raises:
            FileError: The file of the URDF or of the cables cannot be read.
            GeometryError: The URDF is not a supported robot; lists every fault.
            InvalidInput: As for :class:`Manipulator`. No link is called ``tip``, or ``joint_names``
                does not name each moving joint once.
        """
        text = read_urdf(urdf, check_inertia=check_inertia)
        more: Any = {"joint_names": joint_names, "springs": springs}
        return cls.__new__(cls)._define(text, cables, tip, gravity, **more)

    @classmethod
    def read(
        cls,
        path: str | os.PathLike[str],
        wire: Wire | None = None,
        *,
        changes: Mapping[str, Any] | None = None,
    ) -> Manipulator:
        """Read an arm from an ARM.toml: robot, cables, wires, gravity, tolerances.

        The robot is a geometry in a form of :meth:`Geometry.read`, or a table ``[urdf]`` with
        ``tip`` and ``file`` (relative to the folder of the ARM.toml) or ``text``. ``cdsm new``
        writes a first one, with comments.

        Args:
            path: The file; :meth:`write` writes one.
            wire: Wire of all cables, instead of the wires in the file: a law, a name, EA [N], or
                the path of a file of :meth:`Elasticity.write`.
            changes: Values to lay over the keys of the file: ``{"minimum": 5.0, "universal":
                {"link_mass": 0.06}}``. Cables and sections of a list go by name, or number from 1.

        Raises:
            FileError: The file cannot be read or does not describe an arm. Every fault is listed.
                The file has no wire for some cables, and ``wire`` is not given.
            GeometryError, InvalidInput: As :meth:`from_urdf`.
        """
        from cdsm.arm_file.arm import read_arm  # pydantic: slow to import

        defined = read_arm(path, wire, changes)
        try:
            return cls.__new__(cls)._define(**defined)
        except InvalidInput as error:
            error.args = (f"{path}: {error}",)
            raise

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write an ARM.toml from which :meth:`read` builds an equal arm; return its path.

        The text of a URDF is written into the same file.

        Raises:
            InvalidInput: A wire of this kind, or a term of :meth:`with_terms`, cannot be written.
            FileError: The file cannot be written; an existing file stays unchanged.
        """
        from cdsm.arm_file.arm import arm_text

        return write_text(path, arm_text(self))

    def plot(self, q: ArrayLike | None = None) -> Figure:
        """Plot the arm in mm at q (nv,) [rad]; None: each angle is 0, or the limit nearest to 0.

        Raises InvalidInput as :meth:`at`.
        """
        return self.at(np.clip(0.0, self.lower, self.upper) if q is None else q).plot()

    def at(self, q: ArrayLike, *, check_limits: bool = True) -> Posture:
        """Evaluate the arm at joint angles q: kinematics, cable lengths and gravity.

        Pinocchio gives tip, J_X and gravity; L and J_L follow from its twists and placements.

        Args:
            q: Joint angles (nv,) [rad], in the order of :attr:`joint_names`.
            check_limits: Refuse angles beyond the joint limits.

        Raises:
            InvalidInput: q is not (nv,) finite real numbers, or ``check_limits`` is not a bool. An
                angle is beyond its limit, and ``check_limits`` is True. Two neighbouring sites of a
                cable coincide at this posture.
        """
        q = self._angles(q, check_limits)
        routing = self.routing
        state = self.body.state(q)
        site = routing.sites(state.placement)
        spans = routing.spans(state.twist, site)
        self._require_apart(spans.length, q)
        return Posture(
            arm=self,
            q=q,
            tip=frozen(state.tip),
            jacobian=frozen(state.jacobian),
            cable_lengths=frozen(routing.lengths(spans.length)),
            length_jacobian=frozen(routing.jacobian(spans)),
            gravity_torque=frozen(state.gravity_torque),
            gravity_stiffness=frozen(state.gravity_stiffness),
            twist=frozen(state.twist),
            placements=frozen(state.placement),
            sites=frozen(site),
            spans=spans,
        )

    def _angles(self, q: ArrayLike, check_limits: bool) -> Array:
        """Check joint angles (nv,) [rad] and return them read-only."""
        q = vector("q", q, self.nv, self.meaning_of_q)
        if flag("check_limits", check_limits) and (out := self.beyond_limits(q)).any():
            at = np.flatnonzero(out).tolist()
            names, units = ([of[i] for i in at] for of in (self.joint_names, self.joint_units))
            angles, low, high = (of[at].tolist() for of in (q, self.lower, self.upper))
            texts = list(map(beyond, names, angles, low, high, units))
            said = f"{listed(texts, 4, '; ')}. {_STAY}{UNCHECKED}."
            raise InvalidInput("q", said, Status.BEYOND_LIMITS)
        return q

    @cached_property
    def meaning_of_q(self) -> str:
        """What an entry of q is, and the names of the joints, for messages."""
        coordinate = "angle [rad] or way [m]" if self.slides.any() else "angle [rad]"
        return f"one {coordinate} per joint, {', '.join(self.joint_names)}"

    def beyond_limits(self, q: Array) -> NDArray[np.bool_]:
        """Return for each joint angle of q (nv,) whether it is beyond its limits (nv,)."""
        return np.asarray((q < self.lower - LIMIT_SLACK) | (q > self.upper + LIMIT_SLACK))

    def _require_apart(self, length: Array, q: Array) -> None:
        """Raise InvalidInput if a segment, of the ``length`` (S,) [m], has no direction."""
        if length.min(initial=math.inf) < SHORTEST_SEGMENT:
            cable = self.cables[int(self.routing.cable[length.argmin()])]
            said = f"two neighbouring sites coincide at q = {q.tolist()}, so the cable has no "
            said += "direction there. Move a site, or change the posture."
            raise InvalidInput(f"cable {cable.name!r}", said, Status.COINCIDENT_SITES)

    @property
    def geometry(self) -> Geometry:
        """Geometry from which the arm was built; InvalidInput for an arm from a URDF."""
        if self._geometry is None:
            said = f"{self.name} was made from a URDF and has none; see arm.urdf."
            raise InvalidInput("geometry", said)
        return self._geometry

    @property
    def is_serpentine(self) -> bool:
        """Whether the arm was built from a :class:`~cdsm.Geometry`."""
        return self._geometry is not None

    @cached_property
    def length(self) -> float:
        """Length of the path from the base through the joints to the tip, all joints at zero [m].

        For an arm from a URDF the length is at least the largest distance of a cable site from the
        joint that moves the site. So the length is never zero: tolerances are multiples of it.
        """
        if self.is_serpentine:
            return self.geometry.length
        reach = float(np.linalg.norm(self.routing.point, axis=1).max())
        return max(self.body.length, reach)

    @cached_property
    def terms(self) -> tuple[Term, ...]:
        """Terms of the energy without cables and loads: gravity, springs, further ones."""
        return Gravity(), JointSprings(self.springs), *self.extra_terms

    @cached_property
    def has_springs(self) -> bool:
        """Whether a spring turns any joint."""
        return bool(self.springs.stiffness.any())

    @cached_property
    def has_friction(self) -> bool:
        """Whether any cable has friction in a hole. Results that neglect this friction say so."""
        return any(any(cable.friction) for cable in self.cables)

    @property
    def joint_units(self) -> tuple[str, ...]:
        """Unit of each joint's coordinate (nv,): rad, or m for a prismatic joint."""
        return tuple("m" if slides else "rad" for slides in self.slides)

    def torque_unit(self, joint: int | None = None) -> str:
        """Return the unit of torque of a joint or, if None, of all: "N m", "N" or "N m or N"."""
        return JointUnits(self.slides).joined("N m", "N", joint)

    def stiffness_unit(self, joint: int | None = None) -> str:
        """Return the unit of stiffness of a joint or, if None, of all: "N m/rad or N/m"."""
        return JointUnits(self.slides).joined("N m/rad", "N/m", joint)

    def __repr__(self) -> str:
        return f"<Manipulator {self}>"

    def __str__(self) -> str:
        free = plural(self.nv, "degree") + " of freedom"
        if self.is_serpentine:
            free = f"{plural(len(self.geometry.joints), 'joint')} ({free})"
        return f"{self.name}: {free}, {plural(len(self.cables), 'cable')}, {self.length:.6g} m long"

    def _define(
        self,
        urdf: str,
        cables: CablesOrFile,
        tip_link: str,
        gravity: Direction,
        joint_names: Sequence[str] | None = None,
        geometry: Geometry | None = None,
        tolerances: Tolerances = Tolerances(),  # noqa: B008  # frozen
        springs: Mapping[str, Spring] | None = None,
        terms: Sequence[Term] = (),
        like: Manipulator | None = None,
    ) -> Self:
        """Set all attributes; ``urdf`` is checked, the user has seen the doubts about ``like``."""
        gravity = gravity_vector("gravity", gravity)
        if joint_names is not None:
            joint_names = sequence_of("joint_names", joint_names, str)
        cables = _checked(cables)
        same = like is not None and urdf is like.urdf and np.array_equal(gravity, like.gravity)
        body = like.body if like and same else RigidBody(urdf, tip_link, gravity, joint_names)
        usual = geometry.springs if geometry else {}
        own = springs_of(usual if springs is None else springs, body.all_joints, body.coupling)
        # those that change the springs of the geometry, if any do
        changed = None if own.given == usual else dict.fromkeys(usual, (0.0, 0.0)) | own.given
        self.__dict__.update({name: getattr(body, name) for name in _OF_BODY})
        self.__dict__.update(urdf=urdf, cables=cables, tip_link=tip_link, gravity=gravity)
        self.__dict__.update(tolerances=tolerances, springs=own)
        self.__dict__.update(_geometry=geometry, body=body, own_springs=changed)
        self.__dict__.update(extra_terms=checked_terms(terms))
        self.__dict__.update(routing=Routing.of(body, cables))
        self.__dict__.update(laws=CableLaws(cables), _doubts=_doubts(self))
        for doubt in self._doubts:
            if like is None or doubt not in like._doubts:
                warn(f"{self.name}: {doubt}")
        return self

    def __getstate__(self) -> dict[str, Any]:
        """Return what defines the arm: two arms are equal if these values are equal."""
        names = ("urdf", "cables", "tip_link", "joint_names", "tolerances")
        state = {name: getattr(self, name) for name in names}
        state |= {"geometry": self._geometry, "springs": self.own_springs}
        state |= {"terms": self.extra_terms}
        return state | {"gravity": tuple(self.gravity.tolist())}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._define(**state)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Manipulator) and self.__getstate__() == other.__getstate__()

    def __hash__(self) -> int:
        return hash(self.urdf)

    def replace(self, **changes: Any) -> Manipulator:
        """Return an arm of which some of the values in :meth:`__getstate__` are others."""
        state = {**self.__getstate__(), **changes}
        return Manipulator.__new__(Manipulator)._define(**state, like=self)

    def with_geometry(self, geometry: Geometry, cables: Sequence[Cable]) -> Manipulator:
        """Return the arm of another geometry with these cables, otherwise like this one."""
        urdf = to_urdf(geometry)
        return self.replace(geometry=geometry, cables=cables, urdf=urdf, joint_names=None)

    def with_cables(self, cables: CablesOrFile) -> Manipulator:
        """Return an arm with the same robot and other cables, given as for :class:`Manipulator`."""
        return self.replace(cables=cables)

    def with_friction(self, friction: float) -> Manipulator:
        """Return the same arm with one friction coefficient μ [-], from 0 to 2, in all holes."""
        return self.replace(cables=[cable.with_friction(friction) for cable in self.cables])

    def with_tolerances(self, tolerances: Tolerances) -> Manipulator:
        """Return the same arm with other :class:`Tolerances`; InvalidInput for another type."""
        return self.replace(tolerances=instance("tolerances", tolerances, Tolerances))

    def with_springs(self, springs: Mapping[str, Spring]) -> Manipulator:
        """Return the same arm with these springs at its joints, and no others.

        Args:
            springs: By the name of the joint: stiffness k [N m/rad], or [N/m] if it is prismatic;
                or (k, q_0) with the angle [rad] or way [m] without torque, which is 0 otherwise.

        Raises:
            InvalidInput: A stiffness is negative, or no number. There is no such joint.
        """
        return self.replace(springs=springs)

    def with_terms(self, terms: Sequence[Term]) -> Manipulator:
        """Return the same arm with these further terms of its energy, and no others.

        Args:
            terms: Objects with a ``name``, and methods ``energy(pose)`` U [J], ``torque(pose)``
                ∂U/∂θ (nv,) and ``stiffness(pose)`` ∂²U/∂θ² (nv, nv), as in ``cdsm/terms.py``. They
                count in balance and K_θ. What cannot take them refuses them by name: batches,
                and what computes by them, such as sweeps and designs; MuJoCo models; ARM.toml.

        Raises:
            InvalidInput: An object is no term, or a name is in use.
        """
        return self.replace(terms=terms)

    def with_gravity(self, gravity: Direction) -> Manipulator:
        """Return the same arm under another gravity: (3,) [m/s²] in base axes, or an axis."""
        return self.replace(gravity=gravity)

    @cached_property
    def chains(self) -> Chains:
        """All cables of the arm, divided at their holes into segments."""
        return Chains.of(self.cables, self.body)


def _checked(cables: CablesOrFile) -> Cables:
    """Return cables, given as such or as the path of their file; each needs a name of its own."""
    if isinstance(cables, (str, os.PathLike)):
        from cdsm.arm_file.arm import read_cables

        return Cables(read_cables(cables))
    given = [cables] if isinstance(cables, Cable) else cables
    cables = Cables(sequence_of("cables", given, Cable))
    if not cables:
        raise InvalidInput("cables", "none given; an arm needs at least one.")
    name, count = Counter(cables.names).most_common(1)[0]
    if count > 1:
        raise InvalidInput(f"cable {name!r}", "the name is used twice; every cable needs its own.")
    return cables


def _doubts(arm: Manipulator) -> tuple[str, ...]:
    """Return texts of warnings: lengths look as if not in metres, or no joint moves the tip."""
    length = arm.body.length
    # without lengths between the joints, the frame of the robot may be as long as any arm
    most = max(_FARTHEST, 10.0 * length) if length > 0.0 else LONGEST
    sizes = []
    for each in arm.cables:
        sizes.append((f"the lead of {each.name}", each.lead, most))
        if length > 0.0:
            sizes.append((f"the slack of {each.name}", each.slack, length))
        far = max(math.hypot(*site.position) for site in each.sites)
        sizes.append((f"a site of {each.name}", far, most))
    largest = max(sizes, key=lambda size: size[1] / size[2])
    # a geometry warns of its own length
    found = doubts_about_units(0.0 if arm.is_serpentine else length, [largest])
    if not arm.body.tip_joints.size:
        said = f"no joint moves its tip {arm.tip_link}, so its stiffness is infinite"
        found.append(f"{said}; give another link as tip.")
    return tuple(found)
