"""Why a result does not exist: one enum of causes, each with its message."""

from __future__ import annotations

from enum import IntEnum, unique
from typing import Final, Self


@unique
class Status(IntEnum):
    """Whether a result exists, and if not, why.

    It serves batches, sweeps, plans along a path, closed loops, the live view and errors: the
    ``status`` of a :class:`~cdsm.CdsmError` is a member. The status of one posture of a batch or
    sweep names its first failure, and says which quantities exist; others are NaN. A negative
    margin (unstable arm) and an infinite stiffness ``along`` (immobile direction) are not failures;
    a sweep tells the first apart as UNSTABLE.

    Attributes:
        message: The cause in words.
    """

    message: str

    def __new__(cls, code: int, message: str = "") -> Self:
        """Make the member with this code and message."""
        member = int.__new__(cls, code)
        member._value_ = code
        member.message = message
        return member

    OK = 0, "the result exists"
    """All requested quantities exist."""
    BEYOND_LIMITS = 1, "a joint angle is beyond its limit"
    """A joint angle is beyond its limit (InvalidInput): no quantity exists."""
    COINCIDENT_SITES = 2, "two neighbouring sites coincide, or a cable cannot run over its pulley"
    """Two neighbouring sites of a cable coincide, or one is inside a pulley or too far beside its
    groove (InvalidInput): no quantity exists."""
    INFEASIBLE = 3, "no tensions within the bounds balance the arm"
    """No tensions within the bounds balance the arm (InfeasibleTension): only quantities of the
    joint angles alone exist."""
    SOLVER_FAILED = 4, "the solver finds no solution, though one may exist"
    """The solver finds no tensions, though some exist (CdsmError): only quantities of the joint
    angles alone exist."""
    OUTSIDE_ELASTICITY = 5, "a tension is outside the domain of its law"
    """A tension is outside the domain of its law (ElasticityRangeError): tensions, residual, active
    and load terms exist; quantities that need the cable stiffness do not."""
    SINGULAR = 6, "the stiffness matrix is singular, or no tensions make the arm stable"
    """`K_θ` is singular (SingularStiffness): along, compliance and cartesian do not exist. If the
    tip is also IMMOBILE, pseudoinverse does not exist."""
    IMMOBILE = 7, "the tip can hardly move in some direction"
    """The tip can hardly move in some direction (SingularStiffness): cartesian and pseudoinverse do
    not exist, all other quantities exist."""
    UNSTABLE = 8, "the arm buckles"
    """The arm buckles (margin ≤ 0), or does so without the cables at 0 N, which only pull; then
    along does not exist. In sweeps, softest, stiffest and isotropy do not exist; if the
    tip is also IMMOBILE, cartesian and pseudoinverse do not exist."""
    PENDING = 9, "not computed yet"
    """Only in stores of sweeps: not computed yet, no quantity exists."""
    OUT_OF_REACH = 10, "the tip cannot reach its target"
    """The tip cannot reach a target position: no quantity exists."""
    UNREACHABLE_STIFFNESS = 11, "no admissible tensions give the stiffness"
    """No admissible tensions give the wanted stiffness (UnreachableStiffness)."""
    CHANGE_LIMITED = 12, "no tensions within the largest change give the stiffness"
    """Tensions give the wanted stiffness, but none within the largest change from those before."""
    NO_EQUILIBRIUM = 13, "no equilibrium was found: the arm buckles"
    """A loaded arm has no equilibrium, or buckles before the full load (EquilibriumError)."""
    DIVERGED = 14, "the closed loop is unstable"
    """A closed loop is unstable: the tip left its path, or the plant diverged."""
    MOVED = 15, "the arm is unstable, and moved to another equilibrium"
    """The arm is unstable as set, and moved to another equilibrium."""
    NEUTRAL = 16, "the arm rests here, but not firmly"
    """The arm rests at an equilibrium that is not strictly stable."""
    AT_MAXIMUM = 17, "a tension is at its upper bound"
    """A tension is at its upper bound."""
    UNBOUNDED = 18, "nothing bounds the result"
    """A largest value does not exist: nothing bounds it."""
    INFEASIBLE_DESIGN = 19, "no design met all constraints"
    """No design met all constraints (InfeasibleDesign)."""
    INVALID_INPUT = 20, "an argument is invalid"
    """An argument has a wrong type, shape or value (InvalidInput, GeometryError)."""
    FAILED = 21, "an error without a more precise cause"
    """Any other error."""
    UNSTABLE_TO_ONE_SIDE = 22, "the arm buckles without the cables at 0 N"
    """The arm is stable only if cables at 0 N are counted as taut; they only pull."""
    AT_STOP = 23, "a joint rests on its stop"
    """A joint rests on its stop, which carries a part of the load."""
    UNBALANCED = 24, "the tensions do not balance the arm"
    """The tensions do not balance the arm."""
    ABOVE_MAXIMUM = 25, "a tension is above the maximum of its cable"
    """A tension is above the maximum of its cable."""
    SLACK = 26, "a cable is at 0 N, and can only add tension"
    """A cable is at 0 N, and can only add tension."""
    SELF_CONTACT = 27, "links of the arm overlap"
    """Links of the arm overlap, which are no neighbours: the arm passes through itself."""

    @property
    def word(self) -> str:
        """The name as tables and JSON have it: ``outside_elasticity``."""
        return self.name.lower()

    @property
    def title(self) -> str:
        """The name as people read it: ``OUTSIDE ELASTICITY``."""
        return "NOT IN BALANCE" if self is Status.UNBALANCED else self.name.replace("_", " ")

    @property
    def is_unmet(self) -> bool:
        """Whether the arm cannot do what was asked; then a command has an exit code of its own."""
        return self in _UNMET

    @property
    def is_fault(self) -> bool:
        """Whether the call is at fault, so that no other posture would help."""
        return self in (Status.INVALID_INPUT, Status.FAILED)


ENTRY_STATUSES: Final = tuple(status for status in Status if status <= Status.OUT_OF_REACH)
"""Members that entries of batches and sweeps can have."""

_UNMET: Final = (
    Status.INFEASIBLE,
    Status.UNREACHABLE_STIFFNESS,
    Status.NO_EQUILIBRIUM,
    Status.INFEASIBLE_DESIGN,
)
