"""An arm with its cables.

:class:`Manipulator` has all data that do not depend on the joint angles. :class:`Posture` has all
results that depend only on them. Both are frozen: :meth:`Manipulator.at` makes each posture.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

from numpy.typing import ArrayLike

from cdsm.arm import ComputedArm
from cdsm.assembly import Assembly, assemble
from cdsm.cable import Cable, serpentine_cables
from cdsm.dead_loads import Load
from cdsm.definition import ArmDefinition, Term
from cdsm.errors import InvalidInput
from cdsm.geometry import Geometry
from cdsm.joint_springs import Spring
from cdsm.motors import Motor
from cdsm.posture import Posture
from cdsm.rigid_body import GRAVITY
from cdsm.support.files import write_text
from cdsm.support.validation import Direction, instance
from cdsm.support.values import frozen
from cdsm.terms import Gravity, JointSprings
from cdsm.tolerances import Tolerances
from cdsm.urdf import TIP, to_urdf
from cdsm.urdf_reader import read_urdf
from cdsm.wires.elasticity import Elasticity

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cdsm.wires.catalogue import Wire

CablesOrFile = Cable | Sequence[Cable] | str | os.PathLike[str]
"""One or more cables, or the path of their file."""

ANOTHER_ARM = (
    "another arm; distribute it for this one. with_cables, with_friction, with_gravity and "
    "with_tolerances return another arm."
)
"""What is wrong with tensions of another arm, and what to do."""


@final
@dataclass(frozen=True, init=False, repr=False)
class Manipulator(ComputedArm):
    """A cable-driven arm: rigid links, joints, cables.

    Args:
        geometry: The arm.
        elasticity: One law for all cables, or one law per cable. The cables are then routed by
            :func:`~cdsm.serpentine_cables`.
        cables: The cables, or the path of their file (:func:`~cdsm.read_cables`), if ``elasticity``
            is not given. Their sites may be on any links of :attr:`urdf`.
        gravity: Gravity in base axes (3,) [m/s²], or an axis such as ``"-y"`` for 9.81 m/s² along
            it; (0, 0, 0) for none.
        motors: Motors that move several cables, or yield: see :meth:`with_motors`.

    Attributes:
        springs: Springs at the joints: ``springs.stiffness`` k (n,) [N m/rad] and
            ``springs.angle`` `q_0` (n,) [rad], at which they have no torque; of all n joints, also
            those that follow others. Of a spring with a law, k is the tangent at `q_0`.
        motors: All motors: ``motors.matrix`` is B (C, M) [m/rad], ``motors.names`` are their names.

    Raises:
        InvalidInput: ``elasticity`` and ``cables`` are both given or both missing, or gravity is
            not three numbers. Two cables have the same name, or a cable is on an unknown link. A
            motor does not fit the cables.
        FileError: The file of the cables cannot be read.

    Example:
        >>> import cdsm
        >>> geometry = cdsm.presets.virtual_prototype_geometry()
        >>> arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(48e3))
        >>> arm
        <Manipulator virtual_prototype: 5 joints (10 degrees of freedom), 15 cables, 0.22 m long>
    """

    def __init__(
        self,
        geometry: Geometry,
        elasticity: Elasticity | Sequence[Elasticity] | None = None,
        *,
        cables: CablesOrFile | None = None,
        gravity: Direction = GRAVITY,
        motors: Sequence[Motor] = (),
    ) -> None:
        if isinstance(geometry, str | os.PathLike):
            problem = f"{str(geometry)!r} given; a Geometry is needed. "
            problem += "Read the file of a robot with Manipulator.from_urdf()."
            raise InvalidInput("geometry", problem)
        described = instance("geometry", geometry, Geometry)
        if (elasticity is None) == (cables is None):
            problem = "give one of elasticity= (for the cables of the geometry) and cables=; "
            problem += f"{'neither was' if cables is None else 'both were given'}."
            raise InvalidInput("elasticity", problem)
        routed = _read(cables) if elasticity is None else serpentine_cables(described, elasticity)
        urdf = to_urdf(described)
        defined: Any = {"cables": routed, "gravity": gravity, "geometry": described}
        defined["motors"] = motors
        self.compute(ArmDefinition(urdf=urdf, tip_link=TIP, **defined))

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
        motors: Sequence[Motor] = (),
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
            motors: As for :meth:`with_motors`.

        Raises:
            FileError: The file of the URDF or of the cables cannot be read.
            GeometryError: The URDF is not a supported robot; lists every fault.
            InvalidInput: As for :class:`Manipulator`. No link is called ``tip``, or ``joint_names``
                does not name each moving joint once.

        Example:
            >>> import cdsm
            >>> arm = cdsm.presets.virtual_prototype()
            >>> path = "urdf/virtual_prototype.urdf"
            >>> cdsm.Manipulator.from_urdf(path, tip="tool0", cables=arm.cables).nv
            10
        """
        text = read_urdf(urdf, check_inertia=check_inertia)
        defined: Any = {"cables": _read(cables), "joint_names": joint_names, "gravity": gravity}
        defined |= {"springs": springs, "motors": motors}
        return cls.of(ArmDefinition(urdf=text, tip_link=tip, **defined))

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
        writes a first one, with comments. An arm without ``name`` has that of its file.

        Args:
            path: The file; :meth:`write` writes one.
            wire: Wire of all cables, instead of the wires in the file: a law, a name, EA [N], or
                the path of a file of :meth:`Elasticity.write`.
            changes: Values to lay over the keys of the file, as --set of the commands:
                ``{"minimum": 5.0, "universal.link_mass": 0.06}``, or tables in tables. Cables and
                sections of a list go by name, or number from 1.

        Raises:
            FileError: The file cannot be read or does not describe an arm. Every fault is listed.
                The file has no wire for some cables, and ``wire`` is not given.
            GeometryError, InvalidInput: As :meth:`from_urdf`.

        Example:
            >>> import cdsm
            >>> cdsm.Manipulator.read("examples/arm.toml").name
            'arm'
        """
        from cdsm.arm_file.arm import read_arm  # pydantic: slow to import

        definition = read_arm(path, wire, changes)
        try:
            return cls.of(definition)
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

        return write_text(path, arm_text(self.definition))

    def plot(self, q: ArrayLike | None = None, ax: Axes | None = None, **options: Any) -> Axes:
        """Plot the arm in mm at q (nv,) [rad]; None: each angle is 0, or the limit nearest to 0.

        Other options are those of :func:`cdsm.plots.plot_arm`. Raises InvalidInput as :meth:`at`.
        """
        pose = self.at(self.body.straight if q is None else q)
        return pose.plot(ax=ax, **options)

    def at(self, q: ArrayLike, *, check_limits: bool = True) -> Posture:
        """Evaluate the arm at joint angles q: kinematics, cable lengths and gravity.

        Pinocchio gives tip, `J_X` and gravity; L and `J_L` follow from its twists and placements.

        Args:
            q: Joint angles (nv,) [rad], in the order of :attr:`joint_names`.
            check_limits: Refuse angles beyond the joint limits.

        Raises:
            InvalidInput: q is not (nv,) finite real numbers, or ``check_limits`` is not a bool. An
                angle is beyond its limit, and ``check_limits`` is True. Two neighbouring sites of a
                cable coincide at this posture.

        Example:
            >>> import cdsm
            >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
            >>> (1e3 * pose.tip[:3, 3]).round(2).tolist()  # mm
            [198.68, 57.55, -56.48]
        """
        q = self.checked_angles(q, check_limits)
        routing = self.routing
        state = self.body.state(q)
        wrapping = self.wraps.at(state.twist, state.placement) if self.wraps else None
        if wrapping is None:
            site = routing.sites(state.placement)
            spans = routing.spans(state.twist, site)
            self.require_apart(spans.length, q)
            lengths = routing.lengths(spans.length)
            jacobian = routing.jacobian(spans)
        else:
            site = wrapping.node
            spans = wrapping.spans
            lengths = wrapping.lengths
            jacobian = wrapping.jacobian
        return Posture(
            arm=self,
            q=q,
            tip=frozen(state.tip),
            jacobian=frozen(state.jacobian),
            cable_lengths=frozen(lengths),
            length_jacobian=frozen(jacobian),
            gravity_torque=frozen(state.gravity_torque),
            gravity_stiffness=frozen(state.gravity_stiffness),
            twist=frozen(state.twist),
            placements=frozen(state.placement),
            sites=frozen(site),
            spans=spans,
            wrapping=wrapping,
        )

    @cached_property
    def terms(self) -> tuple[Term, ...]:
        """Terms of the energy without cables and loads: gravity, springs, further ones."""
        return Gravity(), JointSprings(self.springs), *self.definition.terms

    def with_geometry(self, geometry: Geometry, cables: Sequence[Cable]) -> Manipulator:
        """Return the arm of another geometry with these cables, otherwise like this one."""
        urdf = to_urdf(geometry)
        return self.replace(geometry=geometry, cables=cables, urdf=urdf, joint_names=None)

    def with_cables(self, cables: CablesOrFile) -> Manipulator:
        """Return an arm with the same robot and other cables, given as for :class:`Manipulator`."""
        return self.replace(cables=_read(cables))

    def with_friction(self, friction: float) -> Manipulator:
        """Return the same arm with one friction coefficient μ [-], from 0 to 2, in all holes.

        Example:
            >>> import cdsm
            >>> arm = cdsm.presets.virtual_prototype().with_friction(0.1)
            >>> arm.cables[-1].friction
            (0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1)
        """
        return self.replace(cables=[cable.with_friction(friction) for cable in self.cables])

    def with_tolerances(self, tolerances: Tolerances) -> Manipulator:
        """Return the same arm with other :class:`Tolerances`; InvalidInput for another type."""
        return self.replace(tolerances=tolerances)

    def with_springs(self, springs: Mapping[str, Spring]) -> Manipulator:
        """Return the same arm with these springs at its joints, and no others.

        Args:
            springs: By the name of the joint: stiffness k [N m/rad], or [N/m] if it is prismatic;
                or (k, `q_0`) with the angle [rad] or way [m] without torque, which is 0 otherwise;
                or a :class:`~cdsm.SpringLaw`.

        Raises:
            InvalidInput: A stiffness is negative, or no number. There is no such joint. A function
                of a law fails or does not rise between the limits of the joint.
        """
        return self.replace(springs=springs)

    def with_terms(self, terms: Sequence[Term]) -> Manipulator:
        """Return the same arm with these further terms of its energy, and no others.

        Args:
            terms: Objects with a ``name``, and methods ``energy(pose)`` U [J], ``torque(pose)``
                `∂U/∂θ` (nv,) and ``stiffness(pose)`` `∂²U/∂θ²` (nv, nv), as in ``cdsm/terms.py``.
                They count in balance and `K_θ`. What cannot take them refuses them by name:
                batches, and what computes by them, such as sweeps and designs; MuJoCo models;
                ARM.toml.

        Raises:
            InvalidInput: An object is no term, or a name is in use.

        Example:
            >>> import cdsm
            >>> arm = cdsm.presets.virtual_prototype()
            >>> arm.with_terms([]) == arm
            True
        """
        return self.replace(terms=terms)

    def with_motors(self, motors: Sequence[Motor]) -> Manipulator:
        """Return the same arm whose cables are moved by these motors.

        A cable that none of them names has a rigid motor of its own. Rigid motors leave `K_θ` as it
        is, whatever they move together: only which tensions they can reach differs. Motors that
        yield soften it: with B (C, M) [m/rad] = ``arm.motors.matrix`` and `K_L = diag k`, its
        passive term is `J_Lᵀ K_eff J_L`, `K_eff = K_L − K_L B (k_m + Bᵀ K_L B)⁻¹ Bᵀ K_L`.

        Args:
            motors: Motors with the radii of the drums by cable; none: one for each cable.

        Raises:
            InvalidInput: A motor moves no cable, an unknown one, or one that controls force; its
                name is in use; or turns of some motors undo each other in all cables.

        Example:
            >>> import cdsm
            >>> pair = cdsm.Motor("m1", {"cable1_1": 0.012, "cable1_2": -0.012}, stiffness=20.0)
            >>> arm = cdsm.presets.virtual_prototype()
            >>> poses = [a.at([0.1] * 10) for a in (arm, arm.with_motors([pair]))]
            >>> [round(cdsm.stiffness(pose, [60.0] * 15).margin, 1) for pose in poses]
            [61.3, 38.6]
        """
        return self.replace(motors=motors)

    def with_loads(self, loads: Load | Sequence[Load]) -> Manipulator:
        """Return the same arm with these loads that belong to it, and no others.

        They act wherever the arm does, besides any ``wrench``: such as the weight of a gripper or
        a camera. They count in ``K.load``; as dead forces they do not follow ``gravity``.

        Args:
            loads: One or more :class:`~cdsm.Load`.

        Raises:
            InvalidInput: A link does not exist or is the base, or two loads act at one point.

        Example:
            >>> import cdsm
            >>> gripper = cdsm.Load("link5", force=(0.0, -2.0, 0.0))
            >>> arm = cdsm.presets.virtual_prototype()
            >>> poses = [a.at([0.1] * 10) for a in (arm, arm.with_loads(gripper))]
            >>> F = [cdsm.distribute_tension(pose, minimum=5.0).values for pose in poses]
            >>> [round(float(each.max()), 2) for each in F]
            [33.13, 35.69]
        """
        return self.replace(loads=[loads] if isinstance(loads, Load) else loads)

    def assemble(self, pose: Posture, tension: ArrayLike) -> Assembly:
        """Return how long the wires are that have these tensions at a posture, with motors at 0.

        Motors that are fewer than cables keep `Nᵀ l_0` of it (`Nᵀ B = 0`): what they can do later,
        :func:`~cdsm.distribute_tension` and :func:`~cdsm.forward_statics` say with ``assembly=``.

        Args:
            pose: The posture of the assembly, of this arm.
            tension: F (C,) [N] there, or the result of :func:`~cdsm.distribute_tension`.

        Raises:
            InvalidInput: The posture is of another arm; tensions are not (C,), negative, or of
                another posture.
            ElasticityRangeError: A tension is outside the domain of its law.

        Example:
            >>> import cdsm
            >>> pair = cdsm.Motor("m1", {"cable1_1": 0.012, "cable1_2": -0.012})
            >>> arm = cdsm.presets.virtual_prototype().with_motors([pair])
            >>> straight = arm.at([0.0] * 10)
            >>> assembly = arm.assemble(straight, cdsm.distribute_tension(straight, minimum=60.0))
            >>> wire = assembly.missing_wire(arm.at([0.1] * 10))
            >>> (1e3 * wire[:3]).round(2).tolist()
            [0.5, 0.5, 0.0]
        """
        require_own(self, pose)
        return assemble(pose, tension)

    def with_gravity(self, gravity: Direction) -> Manipulator:
        """Return the same arm under another gravity: (3,) [m/s²] in base axes, or an axis.

        Example:
            >>> import cdsm
            >>> arm = cdsm.presets.virtual_prototype().with_gravity((0.0, 0.0, -9.81))
            >>> arm.gravity.tolist()
            [0.0, 0.0, -9.81]
        """
        return self.replace(gravity=gravity)


def _read(cables: CablesOrFile | None) -> Cable | Sequence[Cable]:
    """Return cables, given as such or as the path of their file."""
    if isinstance(cables, (str, os.PathLike)):
        from cdsm.arm_file.arm import read_cables

        return read_cables(cables)
    return () if cables is None else cables


def require_own(arm: Manipulator, pose: Posture) -> None:
    """Raise InvalidInput if a posture is of another arm."""
    if instance("pose", pose, Posture).arm is not arm and pose.arm != arm:
        raise InvalidInput("pose", "is of another arm; take arm.at(q).")
