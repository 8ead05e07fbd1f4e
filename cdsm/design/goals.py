"""Goals of a design: quantities over all postures and loads, to optimise or to bound."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, NamedTuple, final

from cdsm.errors import InvalidInput
from cdsm.support.format import coordinates
from cdsm.support.validation import Direction, one_of, scalar, unit_direction
from cdsm.support.values import Array


class Kind(NamedTuple):
    """Properties of a kind of quantity: its name, its units, and which values are best."""

    words: str  # its name
    unit: str  # SI unit
    shown: tuple[str, float]  # unit shown to the user, and its size in SI
    best: Literal["most", "least"]  # whether the largest or the smallest value is best
    directed: bool = False  # whether it has a direction


_ONE = ("", 1.0)
_MM = ("mm", 1e-3)
_STIFF = ("N/mm", 1e3)
_N = ("N", 1.0)

KINDS: Final[dict[str, Kind]] = {
    "stiffness": Kind("least stiffness along", "N/m", _STIFF, "most", directed=True),
    "softest": Kind("least stiffness in any direction", "N/m", _STIFF, "most"),
    "margin": Kind("least eigenvalue of K", "N m/rad", ("N m/rad", 1.0), "most"),
    "deflection": Kind("largest first-order deflection under the load", "m", _MM, "least"),
    "motor_force": Kind("largest tension", "N", _N, "least"),
    "payload": Kind("least payload along", "N", _N, "most", directed=True),
    "force_radius": Kind("least payload in any direction", "N", _N, "most"),
    "tension_factor": Kind("least tension factor", "1", _ONE, "most"),
    "cable_clearance": Kind("least clearance between cables", "m", _MM, "most"),
    "link_clearance": Kind("least clearance of cables from links", "m", _MM, "most"),
    "disk_clearance": Kind("least clearance of cables from rims and other disks", "m", _MM, "most"),
    "workspace": Kind("volume around the tips held", "m3", ("dm³", 1e-3), "most"),
    "held": Kind("share of postures held", "1", ("%", 1e-2), "most"),
    "mass": Kind("mass of the links", "kg", ("kg", 1.0), "least"),
    "length": Kind("length", "m", _MM, "most"),
    "wire_length": Kind("wire, leads included", "m", ("m", 1.0), "least"),
}
"""Quantities of a design. If a quantity depends on posture or load, its value is the worst one over
all postures and loads that are held, except for ``workspace``, ``held`` and ``wire_length``."""


@dataclass(frozen=True)
class Measure:
    """A quantity of a design, such as its mass or its stiffness along a direction.

    Attributes:
        of: Name of the quantity, a key of :data:`KINDS`.
        direction: Direction of a stiffness or a payload: an axis such as ``"-z"``, or (3,); else
            None.
    """

    of: str
    direction: Direction | None = None

    def __post_init__(self) -> None:
        one_of("quantity of a design", self.of, KINDS)
        if KINDS[self.of].directed and self.direction is None:
            raise InvalidInput("direction", f"is needed for {self.of}.")
        if self.direction is not None:
            if not KINDS[self.of].directed:
                raise InvalidInput("direction", f"has no meaning for {self.of}.")
            u = unit_direction("direction", self.direction)
            self.__dict__.update(direction=tuple(u.tolist()))

    @property
    def key(self) -> str:
        """Name of the column of the quantity, such as ``mass`` or ``stiffness (0, 0, 1)``."""
        return self.of + self._along

    @property
    def words(self) -> str:
        """Name of the quantity as text, with its direction."""
        return KINDS[self.of].words + self._along

    @property
    def _along(self) -> str:
        u = self.direction
        return "" if u is None else f" {coordinates(u, '.3g')}"  # type: ignore[arg-type]

    @property
    def unit(self) -> tuple[str, float]:
        """Unit shown to the user, such as ``mm``, and its size in SI."""
        return KINDS[self.of].shown

    def shown(self, value: float) -> str:
        """Return a value [SI] as text, in the unit shown to the user."""
        unit, size = self.unit
        return f"{value / size:.4g} {unit}".rstrip()


@final
@dataclass(frozen=True)
class Objective(Measure):
    """A quantity that a search maximises or minimises.

    Attributes:
        of: ``"stiffness"``, ``"softest"``, ``"margin"``, ``"deflection"``, ``"motor_force"``,
            ``"payload"``, ``"force_radius"``, ``"tension_factor"``, ``"cable_clearance"``,
            ``"link_clearance"``, ``"disk_clearance"``, ``"workspace"``, ``"held"``, ``"mass"``,
            ``"length"`` or ``"wire_length"``. A posture is held under a load if tensions within
            the bounds balance it and the arm is stable. If the value depends on posture or load,
            it is the worst one over all that are held. ``stiffness``, ``softest`` and ``margin``
            are computed with the least tensions under the load. ``deflection`` is |C_vv f| with the
            force f of the load, to first order. Its C_vv is computed with the least tensions
            without the load, since the motors are locked before the load acts, as in
            :func:`~cdsm.payload` and :func:`~cdsm.weight_test`. The deflection is inf if the arm is
            not held without load. ``payload`` is the largest force along u that tensions within the
            bounds balance in addition to the load; ``force_radius`` is the largest force that
            they balance in every direction. ``workspace`` is the volume of the convex hull of the
            tips of held postures, ``held`` the fraction of pairs of posture and load that are held.
            :func:`~cdsm.clearance` defines clearances.
        direction: u of ``stiffness`` and ``payload``: an axis such as ``"-z"``, or (3,).
        goal: ``"most"`` to maximise, ``"least"`` to minimise; None: the usual one, e.g. the most
            stiffness, the least mass.

    Raises:
        InvalidInput: ``of`` or ``goal`` is unknown. ``direction`` is missing, or is given for a
            quantity without a direction.
    """

    goal: Literal["most", "least"] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        goal = KINDS[self.of].best if self.goal is None else self.goal
        self.__dict__.update(goal=one_of("goal", goal, ("most", "least")))

    @property
    def sign(self) -> float:
        """−1 if the quantity is maximised, else 1: searches minimise sign · value."""
        return -1.0 if self.goal == "most" else 1.0


@final
@dataclass(frozen=True)
class Constraint(Measure):
    """A quantity that must stay above or below a limit at all postures and loads.

    Attributes:
        of: Name of the quantity; :class:`Objective` lists the names.
        direction: u of ``stiffness`` and ``payload``: an axis such as ``"-z"``, or (3,).
        at_least: Smallest value allowed, in SI: [N/m], [N m/rad], [m], [N], [kg] or [-]; or None.
        at_most: Largest value allowed, in SI: [N/m], [N m/rad], [m], [N], [kg] or [-]; or None.

    Raises:
        InvalidInput: ``of`` is unknown. No limit is given, or two; or ``direction`` is missing, or
            is given for a quantity without a direction.
    """

    at_least: float | None = None
    at_most: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.at_least is None) == (self.at_most is None):
            raise InvalidInput(self.of, "needs at_least or at_most, one of them.")
        scalar(f"{self.of}.{'at_most' if self.at_least is None else 'at_least'}", self.limit)

    @property
    def limit(self) -> float:
        """``at_least`` or ``at_most``, the one that is given, in SI."""
        limit = self.at_most if self.at_least is None else self.at_least
        assert limit is not None
        return limit

    @property
    def asked(self) -> str:
        """The limit as text, such as ``at most 5 mm``."""
        return f"at {'most' if self.at_least is None else 'least'} {self.shown(self.limit)}"

    def distance(self, value: Array) -> Array:
        """Return how far values [SI] are inside the limit, divided by it [-]; negative if outside.

        If the limit is 0, it is divided by the size of the unit shown to the user.
        """
        size = abs(self.limit) or self.unit[1]
        return (value - self.limit) / (size if self.at_most is None else -size)
