"""Goals of a design: quantities over all postures and loads, to optimise or to bound."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, final

from cdsm.errors import InvalidInput
from cdsm.quantities import QUANTITIES, Quantity, require_name
from cdsm.support.format import coordinates
from cdsm.support.validation import Direction, one_of, scalar, unit_direction
from cdsm.support.values import Array

_WHOLE: Final = ("all postures", "arm")
"""What quantities need that are not the worst one of all postures and loads that are held."""


@dataclass(frozen=True)
class Measure:
    """A quantity of a design, such as its mass or its stiffness along a direction.

    If it depends on posture or load, its value is the worst one of all that are held.

    Attributes:
        of: Name of the quantity, one of a design in :data:`~cdsm.quantities.QUANTITIES`.
        direction: Direction of a stiffness or a payload: an axis such as ``"-z"``, or (3,); else
            None.
    """

    of: str
    direction: Direction | None = None

    def __post_init__(self) -> None:
        require_name("quantity of a design", self.of, "design")
        has_direction = "direction" in self.quantity.dims
        if has_direction and self.direction is None:
            raise InvalidInput("direction", f"is needed for {self.of}.")
        if self.direction is not None:
            if not has_direction:
                raise InvalidInput("direction", f"has no meaning for {self.of}.")
            u = unit_direction("direction", self.direction)
            self.__dict__.update(direction=tuple(u.tolist()))

    @property
    def quantity(self) -> Quantity:
        """Description of the quantity."""
        return QUANTITIES[self.of]

    @property
    def key(self) -> str:
        """Name of the column of the quantity, such as ``mass`` or ``along (0, 0, 1)``."""
        return f"{self.of} {self._along}".rstrip()

    @property
    def words(self) -> str:
        """Name of the quantity as text, with its direction, as that of the worst case."""
        words = self.quantity.along(self._along)
        if self.quantity.needs in _WHOLE or words.startswith(("smallest", "largest")):
            return words
        return f"{'least' if self.quantity.best == 'most' else 'largest'} {words}"

    @property
    def _along(self) -> str:
        u = self.direction
        return "" if u is None else coordinates(u, ".3g")  # type: ignore[arg-type]

    @property
    def unit(self) -> tuple[str, float]:
        """Unit shown to the user, such as ``mm``, and its size in SI."""
        return self.quantity.display

    def shown(self, value: float) -> str:
        """Return a value [SI] as text, in the unit shown to the user."""
        unit, size = self.unit
        return f"{value / size:.4g} {unit}".rstrip()


@final
@dataclass(frozen=True)
class Objective(Measure):
    """A quantity that a search maximises or minimises.

    Attributes:
        of: ``"along"``, ``"softest"``, ``"margin"``, ``"deflection"``, ``"tension"``,
            ``"payload"``, ``"force_radius"``, ``"tension_factor"``, ``"cable_clearance"``,
            ``"link_clearance"``, ``"disk_clearance"``, ``"workspace"``, ``"held"``, ``"mass"``,
            ``"length"`` or ``"wire_length"``. A posture is held under a load if tensions within the
            bounds balance it and the arm is stable. If the value depends on posture or load, it is
            the worst one over all that are held. ``along``, ``softest`` and ``margin`` are computed
            with the least tensions under the load. ``deflection`` is `|C_vv f|` with the force f of
            the load, to first order. Its `C_vv` is computed with the least tensions without the
            load, since the motors are locked before the load acts, as in :func:`~cdsm.payload` and
            :func:`~cdsm.weight_test`. The deflection is inf if the arm is not held without load.
            ``payload`` is the largest force along u that tensions within the bounds balance in
            addition to the load; ``force_radius`` is the largest force that they balance in every
            direction. ``workspace`` is the volume of the convex hull of the tips of held postures,
            ``held`` the fraction of pairs of posture and load that are held.
            :func:`~cdsm.clearance` defines clearances.
        direction: u of ``along`` and ``payload``: an axis such as ``"-z"``, or (3,).
        goal: ``"most"`` to maximise, ``"least"`` to minimise; None: the usual one, e.g. the most
            stiffness, the least mass.

    Raises:
        InvalidInput: ``of`` or ``goal`` is unknown. ``direction`` is missing, or is given for a
            quantity without a direction.

    Example:
        >>> import cdsm
        >>> cdsm.Objective("along", direction="z", goal="most").direction
        (0.0, 0.0, 1.0)
    """

    goal: Literal["most", "least"] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        goal = self.quantity.best if self.goal is None else self.goal
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
        direction: u of ``along`` and ``payload``: an axis such as ``"-z"``, or (3,).
        at_least: Smallest value allowed, in SI: [N/m], [N m/rad], [m], [N], [kg] or [-]; or None.
        at_most: Largest value allowed, in SI: [N/m], [N m/rad], [m], [N], [kg] or [-]; or None.

    Raises:
        InvalidInput: ``of`` is unknown. No limit is given, or two; or ``direction`` is missing, or
            is given for a quantity without a direction.

    Example:
        >>> import cdsm
        >>> cdsm.Constraint("payload", direction="-z", at_least=2.0).limit
        2.0
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
