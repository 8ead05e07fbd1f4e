"""Properties of an arm that do not depend on its posture: names, cables, limits, gravity."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cdsm.arm_model import ArmModel, ArmParts
from cdsm.cable import Cables
from cdsm.cable_laws import OriginalLength
from cdsm.errors import InvalidInput
from cdsm.geometry import Geometry
from cdsm.support.format import JointUnits, plural
from cdsm.support.values import Array, Printed
from cdsm.tolerance import Tolerances


class ArmFacts(Printed):
    """Base class of :class:`~cdsm.Manipulator`, which sets its fields."""

    _cables: Cables
    _gravity: Array
    _model: ArmModel
    _parts: ArmParts

    @property
    def geometry(self) -> Geometry:
        """Geometry from which the arm was built.

        Raises:
            InvalidInput: The arm was built from a URDF.
        """
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

        For a robot from a URDF: this length, or the largest distance of a cable site from its
        joint if that is longer. Tolerances scale with the length, so it must not be zero.
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
        """Cables of the arm, in the order of every (C,) array; ``cables[0]`` or by name."""
        return self._cables

    @property
    def gravity(self) -> Array:
        """Gravity in base axes (3,) [m/s²]."""
        return self._gravity

    @property
    def original_length(self) -> OriginalLength:
        """Which length of a wire is l_0 in EA/l_0; see :class:`Manipulator`."""
        return self._parts.original_length

    @property
    def has_friction(self) -> bool:
        """Whether a cable has friction in a hole. Results that neglect friction say so."""
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
        """Whether each joint slides, is prismatic (nv,); its coordinate is then a length [m]."""
        return self._model.body.slides

    @property
    def joint_units(self) -> tuple[str, ...]:
        """Unit of each joint's coordinate (nv,): rad, or m where the joint slides."""
        return JointUnits(self.slides).coordinates

    def torque_unit(self, joint: int | None = None) -> str:
        """Return the torque unit of a joint, N m or (if it slides) N; None: of all joints."""
        return JointUnits(self.slides).torque(joint)

    def stiffness_unit(self) -> str:
        """Return the unit of the diagonal and eigenvalues of K_θ: N m/rad, N/m if joints slide."""
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
        free = plural(self.nv, "degree") + " of freedom"
        if self.is_serpentine:
            free = f"{plural(len(self.geometry.joints), 'joint')} ({free})"
        return f"{self.name}: {free}, {plural(len(self.cables), 'cable')}, {self.length:.6g} m long"
