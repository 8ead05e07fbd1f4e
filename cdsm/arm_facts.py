"""Properties of an arm (names, cables, limits, gravity), and copies with some of them changed."""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, Self, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.arm_model import ArmModel, ArmParts
from cdsm.cable import Cable, Cables
from cdsm.cable_laws import OriginalLength
from cdsm.errors import CableError, InvalidInput
from cdsm.geometry import LONGEST, Geometry, doubts_about_units
from cdsm.rigid_body import RigidBody
from cdsm.support.directions import Direction, gravity_vector
from cdsm.support.format import JointUnits, plural
from cdsm.support.validation import instance, one_of, sequence_of
from cdsm.support.values import Array, Printed
from cdsm.support.warning import warn
from cdsm.tolerances import Tolerances
from cdsm.wires.elasticity import Elasticity

CablesOrFile = Cable | Sequence[Cable] | str | os.PathLike[str]
"""One or more cables, or the path of their file."""

_FARTHEST = 5.0
"""Longest plausible lead, and distance of a site from its link [m]; or ten arm lengths, if more."""

ANOTHER_ARM = (
    "another arm; distribute it for this one. with_cables, with_friction, with_gravity and "
    "with_tolerances return another arm."
)
"""What is wrong with tensions of another arm, and what to do."""


class ArmFacts(Printed):
    """Base class of :class:`~cdsm.Manipulator`: properties; methods that return a changed arm."""

    _cables: Cables
    _gravity: Array
    _model: ArmModel
    _parts: ArmParts

    @property
    def geometry(self) -> Geometry:
        """Geometry from which the arm was built; InvalidInput for an arm from a URDF."""
        if self._parts.geometry is None:
            raise InvalidInput(
                "geometry", f"{self.name} was made from a URDF and has none; see arm.urdf."
            )
        return self._parts.geometry

    @property
    def is_serpentine(self) -> bool:
        """Whether the arm was built from a :class:`~cdsm.Geometry`."""
        return self._parts.geometry is not None

    @property
    def name(self) -> str:
        """Name of the robot."""
        return self._model.body.name

    @cached_property
    def length(self) -> float:
        """Length of the path from the base through the joints to the tip, all joints at zero [m].

        For an arm from a URDF the length is at least the largest distance of a cable site from the
        joint that moves the site. So the length is never zero: tolerances are multiples of it.
        """
        if self.is_serpentine:
            return self.geometry.length
        reach = float(np.linalg.norm(self._model.routing.point, axis=1).max())
        return max(self._model.body.length, reach)

    @property
    def tip_link(self) -> str:
        """Name of the link whose frame is the tip."""
        return self._parts.tip

    @property
    def urdf(self) -> str:
        """URDF text of the arm."""
        return self._parts.urdf

    @property
    def cables(self) -> Cables:
        """Cables of the arm, in the order of every (C,) array; ``cables["cable1_1"]`` is one."""
        return self._cables

    @property
    def gravity(self) -> Array:
        """Gravity in base axes (3,) [m/s²]."""
        return self._gravity

    @property
    def original_length(self) -> OriginalLength:
        """Length of a wire that is l_0 in EA/l_0: ``"unstrained"``, or ``"stretched"`` (paper)."""
        return self._parts.original_length

    @cached_property
    def has_friction(self) -> bool:
        """Whether any cable has friction in a hole. Results that neglect this friction say so."""
        return any(any(cable.friction) for cable in self.cables)

    @property
    def tolerances(self) -> Tolerances:
        """Uncertainties of the arm's dimensions and measured values; zero if none were given."""
        return self._parts.tolerances

    @property
    def nv(self) -> int:
        """Number of degrees of freedom."""
        return self._model.body.nv

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in the order of every (nv,) array."""
        return self._model.body.joint_names

    @property
    def slides(self) -> NDArray[np.bool_]:
        """Whether each joint is prismatic (nv,); its coordinate is then a length [m]."""
        return self._model.body.slides

    @property
    def joint_units(self) -> tuple[str, ...]:
        """Unit of each joint's coordinate (nv,): rad, or m for a prismatic joint."""
        return JointUnits(self.slides).coordinates

    def torque_unit(self, joint: int | None = None) -> str:
        """Return the unit of torque of a joint or, if None, of all: "N m", "N" or "N m or N"."""
        return JointUnits(self.slides).torque(joint)

    def stiffness_unit(self) -> str:
        """Return the unit of eigenvalues of K_θ: "N m/rad", "N/m" or "N m/rad or N/m"."""
        return JointUnits(self.slides).stiffness()

    @property
    def lower(self) -> Array:
        """Lower joint limits (nv,) [rad]; [m] for prismatic joints."""
        return self._model.body.lower

    @property
    def upper(self) -> Array:
        """Upper joint limits (nv,) [rad]; [m] for prismatic joints."""
        return self._model.body.upper

    def __repr__(self) -> str:
        return f"<Manipulator {self}>"

    def __str__(self) -> str:
        free = plural(self.nv, "degree") + " of freedom"
        if self.is_serpentine:
            free = f"{plural(len(self.geometry.joints), 'joint')} ({free})"
        return f"{self.name}: {free}, {plural(len(self.cables), 'cable')}, {self.length:.6g} m long"

    def _build(
        self,
        geometry: Geometry | None,
        urdf: str,
        cables: CablesOrFile,
        tip: str,
        gravity: ArrayLike,
        original_length: OriginalLength,
        joint_names: Sequence[str] | None = None,
        tolerances: Tolerances = Tolerances(),  # noqa: B008  # frozen
        *,
        told: Sequence[str] = (),
    ) -> None:
        """Check the arguments of :class:`Manipulator`, and set all attributes from them.

        ``urdf`` is a text that has been checked. ``tip`` is the link whose frame is the tip.
        :attr:`_doubts` are issued as warnings, except those in ``told``, which the user has seen.
        """
        self._cables = cables = _checked_cables(cables)
        self._gravity = gravity_vector("gravity", gravity)
        one_of("original_length", original_length, get_args(OriginalLength))
        body = RigidBody(urdf, tip, self._gravity, joint_names)
        self._model = ArmModel(body, cables, original_length)
        g = tuple(self._gravity.tolist())
        self._parts = ArmParts(
            geometry, urdf, cables, tip, g, original_length, body.joint_names, tolerances
        )
        for doubt in self._doubts:
            if doubt not in told:
                warn(f"{self.name}: {doubt}")

    @cached_property
    def _doubts(self) -> list[str]:
        """Texts of warnings: lengths look as if not in metres, or no joint moves the tip."""
        length = self._model.body.length
        # without lengths between the joints, the frame of the robot may be as long as any arm
        most = max(_FARTHEST, 10.0 * length) if length > 0.0 else LONGEST
        sizes = [(f"the lead of {each.name}", each.lead, most) for each in self._cables]
        sizes += [
            (f"a site of {each.name}", math.hypot(*site.position), most)
            for each in self._cables
            for site in each.sites
        ]
        # a geometry warns of its own length
        largest = max(sizes, key=lambda size: size[1])
        doubts = doubts_about_units(0.0 if self.is_serpentine else length, [largest])
        if not self._model.masses.tip_joints.size:
            doubts.append(
                f"no joint moves its tip {self._parts.tip}, so its stiffness is infinite; give "
                "another link as tip."
            )
        return doubts

    def __eq__(self, other: object) -> bool:
        return isinstance(other, type(self)) and self._parts == other._parts

    def __hash__(self) -> int:
        return hash(self.urdf)

    def __getstate__(self) -> ArmParts:
        return self._parts

    def __setstate__(self, parts: ArmParts) -> None:
        self._build(*parts)

    def with_cables(self, cables: CablesOrFile) -> Self:
        """Return an arm with the same robot and other cables.

        Args:
            cables: One or more cables, or the path of their file.

        Raises:
            InvalidInput: ``cables`` is empty, or not a list or tuple of cables.
            CableError: Two cables have the same name, or a cable is on an unknown link.
            FileError: The file cannot be read or does not describe cables.
            MissingWire: The file names no wire for some cables.
        """
        return self._replace(cables=_checked_cables(cables))

    def with_friction(self, friction: float) -> Self:
        """Return the same arm with one friction coefficient μ [-] in all holes.

        Raises:
            InvalidInput: ``friction`` is negative, above 2, or not a number.
        """
        return self._replace(cables=tuple(cable.with_friction(friction) for cable in self.cables))

    def with_tolerances(self, tolerances: Tolerances) -> Self:
        """Return the same arm with other :class:`Tolerances`; InvalidInput for another type."""
        return self._replace(tolerances=instance("tolerances", tolerances, Tolerances))

    def with_gravity(self, gravity: Direction) -> Self:
        """Return the same arm under another gravity (3,) [m/s²] in base axes.

        The name of an axis, such as ``"-y"``, means 9.81 m/s² along this axis.

        Raises:
            InvalidInput: Gravity is neither an axis nor three numbers.
        """
        return self._replace(gravity=gravity)

    def _with_laws(self, laws: Sequence[Elasticity]) -> Self:
        """Return the same arm with other laws, one per cable; faster, since its robot is kept."""
        pairs = zip(self.cables, laws, strict=True)
        cables = Cables(replace(cable, elasticity=law) for cable, law in pairs)
        arm = type(self).__new__(type(self))
        arm._cables, arm._gravity = cables, self._gravity
        arm._model, arm._parts = self._model.with_laws(cables), self._parts._replace(cables=cables)
        return arm

    def _replace(self, **changes: Any) -> Self:
        arm = type(self).__new__(type(self))
        arm._build(*self._parts._replace(**changes), told=self._doubts)
        return arm


def _checked_cables(cables: CablesOrFile) -> Cables:
    if isinstance(cables, (str, os.PathLike)):
        from cdsm.arm_file.cables import read_cables

        return Cables(read_cables(cables))
    given = [cables] if isinstance(cables, Cable) else cables
    cables = Cables(sequence_of("cables", given, Cable))
    if not cables:
        raise InvalidInput("cables", "none given; an arm needs at least one.")
    counts = Counter(cable.name for cable in cables)
    for name, count in counts.items():
        if count > 1:
            raise CableError(name, "the name is used twice; every cable needs its own.")
    return cables
