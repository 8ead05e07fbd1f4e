"""What is computed from the definition of an arm, and does not depend on the joint angles."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.cable import Cables
from cdsm.cable_laws import CableLaws
from cdsm.dead_loads import LinkPoint, Places, placed_loads
from cdsm.definition import ArmDefinition
from cdsm.errors import InvalidInput, listed, warn
from cdsm.geometry import Geometry
from cdsm.joint_springs import SpringOfJoint, Springs, springs_of
from cdsm.limits import beyond_limits, require_within_limits
from cdsm.motors import Motors
from cdsm.pulleys.wraps import Wraps, placed
from cdsm.rigid_body import RigidBody
from cdsm.routing import SHORTEST_SEGMENT, Routing
from cdsm.segments import Chains
from cdsm.status import Status
from cdsm.support.format import JointUnits, one_unit, plural
from cdsm.support.validation import flag, one_of, vector
from cdsm.support.values import Array, Printed, frozen
from cdsm.tolerances import Tolerances

_FAR = 2.0 * math.pi  # angles [rad] or ways [m] up to which functions of springs are checked


@dataclass(frozen=True, init=False, repr=False)
class ComputedArm(Printed):
    """The definition of an arm beside what is computed from it.

    Arms are equal if their definitions are.

    Attributes:
        definition: All that defines the arm.
        body: Its rigid bodies, joints and limits.
        springs: Springs at the joints: ``springs.stiffness`` k (n,) [N m/rad] and
            ``springs.angle`` q_0 (n,) [rad], at which they have no torque; of all n joints, also
            those that follow others. Of a spring with a law, k is the tangent at q_0.
        wraps: Cables over pulleys; None: there are none.
        routing: Sites and segments of the cables; contacts with all pulleys, if there are any.
        laws: Elasticities of the cables.
        motors: What moves the cables: ``arm.motors.matrix`` is B (C, M).
        own_loads: Loads that belong to the arm, such as a gripper: points of links, and wrenches
            (6,), base axes: force [N], then moment [N m].
    """

    definition: ArmDefinition
    body: RigidBody = field(compare=False)
    springs: Springs = field(compare=False)
    wraps: Wraps | None = field(compare=False)
    routing: Routing = field(compare=False)
    laws: CableLaws = field(compare=False)
    motors: Motors = field(compare=False)
    own_loads: tuple[tuple[LinkPoint, Array], ...] = field(compare=False)

    @classmethod
    def of(cls, definition: ArmDefinition, like: Self | None = None) -> Self:
        """Build the arm of a definition; warnings that ``like`` has given are not repeated.

        Raises InvalidInput if a cable, the tip, a spring, a joint name or a load does not fit it.
        """
        return cls.__new__(cls).compute(definition, like)

    def compute(self, definition: ArmDefinition, like: Self | None = None) -> Self:
        """Set the definition, and compute what follows from it."""
        if like is not None and definition.has_body_of(like.definition):
            body = like.body
        else:
            gravity = np.array(definition.gravity)
            names = definition.joint_names
            body = RigidBody(definition.urdf, definition.tip_link, gravity, names)
        springs, changed = _springs(definition, body)
        cables = placed(body, definition.cables)
        named = replace(definition, cables=cables, joint_names=body.joint_names, springs=changed)
        wraps = Wraps.of(body, cables) if any(cable.pulleys for cable in cables) else None
        routing = wraps.all_touching.routing if wraps else Routing.of(body, cables)
        laws = CableLaws(cables)
        # once; from here on the arm is frozen
        vars(self).update(definition=named, body=body, springs=springs, routing=routing, laws=laws)
        own_loads = placed_loads(named.loads, body, named.geometry, "loads")
        vars(self).update(wraps=wraps, motors=Motors(named.motors, cables), own_loads=own_loads)
        for doubt in self._doubts:
            if like is None or doubt not in like._doubts:
                warn(f"{self.name}: {doubt}")
        return self

    @cached_property
    def _doubts(self) -> tuple[str, ...]:
        doubts = self.definition.doubts(self.body)
        return doubts if self.wraps is None else (*doubts, *self.wraps.doubts)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self).of, (self.definition,)

    def replace(self, **changes: Any) -> Self:
        """Return an arm with other values of its definition; InvalidInput if it has no such."""
        known = [value.name for value in fields(self.definition)]
        for name in changes:
            one_of("value of an arm", name, known)
        return self.of(replace(self.definition, **changes), self)

    def with_forced(self, forced: NDArray[np.bool_]) -> Self:
        """Return the arm of which the motors of cables ``forced`` (C,) hold the tensions.

        These cables have no stiffness, so what else their motors move does not count any more.
        InvalidInput if a motor that yields moves such a cable beside another one.
        """
        pairs = zip(self.cables, forced, strict=True)
        cables = [replace(cable, control="force") if hold else cable for cable, hold in pairs]
        names = {cable.name for cable, hold in zip(self.cables, forced, strict=True) if hold}
        kept = [motor for motor in self.definition.motors if motor.yields]
        for motor in kept:
            both = names & motor.cables.keys()
            if both and both != motor.cables.keys():
                problem = f"yields, and moves {listed(sorted(both))}, which has no stiffness here, "
                problem += "beside others; this is not known of motors that yield."
                raise InvalidInput(f"motor {motor.name!r}", problem)
        motors = [motor for motor in kept if not names & motor.cables.keys()]
        return self.replace(cables=cables, motors=motors)

    @property
    def name(self) -> str:
        """Name of the robot."""
        return self.body.name

    @property
    def urdf(self) -> str:
        """URDF text of the arm."""
        return self.definition.urdf

    @property
    def cables(self) -> Cables:
        """Cables, in the order of every (C,) array; ``cables["cable1_1"]`` is one."""
        return self.definition.cables

    @property
    def tip_link(self) -> str:
        """Name of the link whose frame is the tip."""
        return self.definition.tip_link

    @cached_property
    def gravity(self) -> Array:
        """Gravity in base axes (3,) [m/s²]."""
        return frozen(np.array(self.definition.gravity))

    @property
    def tolerances(self) -> Tolerances:
        """Uncertainties of dimensions and measured values; zero if none were given."""
        return self.definition.tolerances

    @property
    def nv(self) -> int:
        """Number of degrees of freedom."""
        return self.body.nv

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in the order of every (nv,) array."""
        return self.body.joint_names

    @property
    def slides(self) -> NDArray[np.bool_]:
        """Whether each joint is prismatic (nv,); its coordinate is then a length [m]."""
        return self.body.slides

    @property
    def lower(self) -> Array:
        """Lower joint limits (nv,) [rad]; [m] for prismatic joints."""
        return self.body.lower

    @property
    def upper(self) -> Array:
        """Upper joint limits (nv,) [rad]; [m] for prismatic joints."""
        return self.body.upper

    @property
    def geometry(self) -> Geometry:
        """Geometry from which the arm was built; InvalidInput for an arm from a URDF."""
        if self.definition.geometry is None:
            missing = f"{self.name} was made from a URDF and has none; see arm.urdf."
            raise InvalidInput("geometry", missing)
        return self.definition.geometry

    @property
    def is_serpentine(self) -> bool:
        """Whether the arm was built from a :class:`~cdsm.Geometry`."""
        return self.definition.geometry is not None

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
    def has_springs(self) -> bool:
        """Whether a spring turns any joint."""
        return bool(self.springs.stiffness.any())

    @cached_property
    def has_friction(self) -> bool:
        """Whether any cable has friction in a hole. Results that neglect this friction say so."""
        return any(any(cable.friction) for cable in self.cables)

    @cached_property
    def own_places(self) -> Places:
        """Where the loads act that belong to the arm, and the tip behind them."""
        return Places.of(self.body, [*(at for at, _ in self.own_loads), None])

    @property
    def joint_units(self) -> tuple[str, ...]:
        """Unit of each joint's coordinate (nv,): rad, or m for a prismatic joint."""
        return self.body.joint_units

    @cached_property
    def levers(self) -> Array:
        """Lever of each joint (nv,): 1 if it turns, the arm's length [m] if it slides.

        A torque times it is in N m for all joints; a stiffness is multiplied twice.
        """
        return frozen(np.where(self.slides, self.length, 1.0))

    def torque_unit(self, joint: int | None = None) -> str:
        """Return the unit of torque of a joint or, if None, of a number of all joints.

        With joints of both kinds that is N m, and the text says how forces count.
        """
        return one_unit(JointUnits(self.slides).joined("N m", "N", joint))

    def stiffness_unit(self, joint: int | None = None) -> str:
        """Return the unit of stiffness of a joint or, if None, of a number of all joints.

        With joints of both kinds that is N m/rad, and the text says how ways count.
        """
        return one_unit(JointUnits(self.slides).joined("N m/rad", "N/m", joint))

    def __repr__(self) -> str:
        return f"<Manipulator {self}>"

    def __str__(self) -> str:
        free = plural(self.nv, "degree") + " of freedom"
        if self.is_serpentine:
            free = f"{plural(len(self.geometry.joints), 'joint')} ({free})"
        return f"{self.name}: {free}, {plural(len(self.cables), 'cable')}, {self.length:.4g} m long"

    def beyond_limits(self, q: Array) -> NDArray[np.bool_]:
        """Return for each joint angle of q (…, nv) whether it is beyond its limits (…, nv)."""
        return beyond_limits(self.body, q)

    @cached_property
    def meaning_of_q(self) -> str:
        """What an entry of q is, and the names of the joints, for messages."""
        coordinate = "angle [rad] or way [m]" if self.slides.any() else "angle [rad]"
        return f"one {coordinate} per joint, {', '.join(self.joint_names)}"

    def checked_angles(self, q: ArrayLike, check_limits: bool = True) -> Array:
        """Check joint angles (nv,) [rad] and return them read-only."""
        q = vector("q", q, self.nv, self.meaning_of_q)
        if flag("check_limits", check_limits):
            require_within_limits(self.body, q)
        return q

    def require_apart(self, length: Array, q: Array) -> None:
        """Raise InvalidInput if a segment, of the ``length`` (S,) [m], has no direction."""
        if length.min(initial=math.inf) < SHORTEST_SEGMENT:
            cable = self.cables[int(self.routing.cable[length.argmin()])]
            problem = f"two neighbouring sites coincide at q = {q.tolist()}, so the cable has no "
            problem += "direction there. Move a site, or change the posture."
            raise InvalidInput(f"cable {cable.name!r}", problem, Status.COINCIDENT_SITES)

    @cached_property
    def chains(self) -> Chains:
        """All cables of the arm, divided at their holes into segments."""
        return Chains.of(self.cables, self.body)


def _springs(
    definition: ArmDefinition, body: RigidBody
) -> tuple[Springs, dict[str, SpringOfJoint] | None]:
    """Return the springs, and by joint those that change the springs of the geometry, if any."""
    geometry = definition.geometry
    usual = geometry.springs if geometry else {}
    values = usual if definition.springs is None else definition.springs
    lower, upper = np.clip([body.lower, body.upper], -_FAR, _FAR)  # some joints have no limits
    ends = (lower, upper)
    if body.coupling:
        ends = body.coupling.angles(lower), body.coupling.angles(upper)
    springs = springs_of(values, body.all_joints, body.coupling, body.all_units, ends)
    if springs.given == usual:
        return springs, None
    none: dict[str, SpringOfJoint] = dict.fromkeys(usual, (0.0, 0.0))
    return springs, {**none, **springs.given}
