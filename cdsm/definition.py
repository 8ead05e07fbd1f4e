"""What defines an arm, and the terms of its energy that it may have besides those of every arm."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, final

from cdsm.cable import Cable, Cables
from cdsm.cable_path import positions
from cdsm.dead_loads import Load
from cdsm.errors import InvalidInput, listed
from cdsm.geometry import Geometry
from cdsm.joint_springs import Spring
from cdsm.motors import Motor, checked_motors
from cdsm.rigid_body import GRAVITY, RigidBody
from cdsm.support.validation import (
    LONGEST,
    doubts_about_units,
    gravity_vector,
    instance,
    sequence_of,
    text,
)
from cdsm.support.values import Array
from cdsm.tolerances import Tolerances

TERMS_OF_K = ("active", "passive", "gravity", "load", "springs")
"""Names of the terms of K_θ that every arm has, in the order of Eq. 16."""

RESERVED = ("joint", "batch")
"""Names of rows of a report that are no terms."""


class Term(Protocol):
    """A term of the energy U(θ) of an arm; :mod:`cdsm.terms` has those of this library.

    A class of your own needs no base class. ``pose`` is the :class:`~cdsm.Posture`, which this
    module is below.
    """

    @property
    def name(self) -> str:
        """Its name in tables, exports and reports."""

    def energy(self, pose: Any) -> float:
        """Compute U [J], up to a constant."""

    def torque(self, pose: Any) -> Array:
        """Compute ∂U/∂θ (nv,) [N m]."""

    def stiffness(self, pose: Any) -> Array:
        """Compute ∂²U/∂θ² (nv, nv) [N m/rad]."""


def checked_terms(terms: object) -> tuple[Term, ...]:
    """Return further terms of an arm; InvalidInput if one is no term, or its name is in use."""
    if not isinstance(terms, (list, tuple)):
        raise InvalidInput("terms", f"{terms!r} given; give a list of terms.")
    names = [*TERMS_OF_K, *RESERVED]
    for term in terms:
        methods = ("energy", "torque", "stiffness")
        lacking = [name for name in methods if not callable(getattr(term, name, None))]
        name = getattr(term, "name", None)
        if lacking or not isinstance(name, str) or not name:
            raise InvalidInput(
                "terms",
                f"{term!r} is no term: it needs the methods energy, torque and stiffness, and a "
                "name; see cdsm.terms.",
            )
        if name in names:
            raise InvalidInput("terms", f"the name {name!r} is in use; give the term another one.")
        names.append(name)
    return tuple(terms)


def refuse_terms(terms: Iterable[Term], why: str, argument: str = "arm") -> None:
    """Raise InvalidInput if there are any terms; ``why`` comes before their names."""
    if names := [term.name for term in terms]:
        raise InvalidInput(argument, f"{why} {listed(names)}.")


@final
@dataclass(frozen=True, kw_only=True)
class ArmDefinition:
    """All that defines an arm: arms are equal if their definitions are, and files hold these.

    Attributes:
        urdf: URDF text, which :func:`~cdsm.urdf_reader.read_urdf` has checked.
        cables: One or more cables.
        tip_link: Name of the link whose frame is the tip.
        gravity: Gravity in base axes (3,) [m/s²]; given as three numbers or an axis.
        joint_names: Names of the joints in the order of q; None: in Pinocchio's order.
        geometry: Geometry from which the URDF was made; None: it was not.
        tolerances: Uncertainties of dimensions and measured values.
        springs: Springs by the name of their joint, as for :meth:`Manipulator.with_springs`; None:
            those of the geometry.
        terms: Further terms of the energy, as for :meth:`Manipulator.with_terms`.
        motors: Motors that move several cables, or yield, as for :meth:`Manipulator.with_motors`;
            a cable that none of them moves has a motor of its own.
        loads: Loads that belong to the arm, as for :meth:`Manipulator.with_loads`.

    Raises:
        InvalidInput: Gravity is not three numbers, or joint names are no texts. There are no
            cables, two have the same name, or a term is none. A motor does not fit the cables.
    """

    urdf: str
    cables: Cables
    tip_link: str
    gravity: tuple[float, ...] = GRAVITY
    joint_names: tuple[str, ...] | None = None
    geometry: Geometry | None = None
    tolerances: Tolerances = Tolerances()  # noqa: RUF009  # frozen
    springs: Mapping[str, Spring] | None = None
    terms: tuple[Term, ...] = ()
    motors: tuple[Motor, ...] = ()
    loads: tuple[Load, ...] = ()

    def __post_init__(self) -> None:  # fields may be given as other sequences, or an axis
        gravity = gravity_vector("gravity", self.gravity)
        names = self.joint_names
        cables = _checked_cables(self.cables)
        no_motors = isinstance(self.motors, (list, tuple)) and not self.motors
        if self.geometry is not None:
            instance("geometry", self.geometry, Geometry)
        checked = {
            "urdf": text("urdf", self.urdf),
            "cables": cables,
            "gravity": tuple(gravity.tolist()),
            "joint_names": None if names is None else sequence_of("joint_names", names, str),
            "tolerances": instance("tolerances", self.tolerances, Tolerances),
            "terms": checked_terms(self.terms),
            "motors": () if no_motors else checked_motors(self.motors, cables),
            "loads": sequence_of("loads", self.loads, Load),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    def __hash__(self) -> int:
        return hash(self.urdf)

    def has_body_of(self, other: ArmDefinition) -> bool:
        """Return whether a :class:`RigidBody` of one definition is that of the other, too."""
        names = ("urdf", "tip_link", "gravity", "joint_names")
        return all(getattr(self, name) == getattr(other, name) for name in names)

    def doubts(self, body: RigidBody) -> tuple[str, ...]:
        """Return texts of warnings: lengths look as if not in metres, or no joint moves the tip."""
        length = body.length
        # without lengths between the joints, the frame of the robot may be as long as any arm
        most = max(_FARTHEST, 10.0 * length) if length > 0.0 else LONGEST
        sizes = []
        for cable in self.cables:
            sizes.append((f"the lead of {cable.name}", cable.lead, most))
            if length > 0.0:
                sizes.append((f"the slack of {cable.name}", cable.slack, length))
            far = max(math.hypot(*element.position) for element in positions(cable.sites))
            sizes.append((f"a site of {cable.name}", far, most))
        largest = max(sizes, key=lambda size: size[1] / size[2])
        # a geometry warns of its own length
        doubts = doubts_about_units(length if self.geometry is None else 0.0, [largest])
        if not body.tip_joints.size:
            still = f"no joint moves its tip {self.tip_link}, so its stiffness is infinite"
            doubts.append(f"{still}; give another link as tip.")
        return tuple(doubts)


_FARTHEST = 5.0  # longest plausible lead and distance of a site [m]; or ten arm lengths, if more


def _checked_cables(cables: Cable | Sequence[Cable]) -> Cables:
    """Return one or more cables, each with a name of its own."""
    several = [cables] if isinstance(cables, Cable) else cables
    checked = Cables(sequence_of("cables", several, Cable))
    if not checked:
        raise InvalidInput("cables", "none given; an arm needs at least one.")
    name, count = Counter(checked.names).most_common(1)[0]
    if count > 1:
        raise InvalidInput(f"cable {name!r}", "the name is used twice; every cable needs its own.")
    return checked
