"""Cables that run straight from site to site of the links; their stiffness and energy."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, SupportsIndex, final, get_args, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.errors import CableError, CdsmError, InvalidInput, listed
from cdsm.support.format import plural
from cdsm.support.validation import (
    number_array,
    one_of,
    quantity,
    scalar,
    sequence_of,
    text,
    vector,
)
from cdsm.support.values import Array
from cdsm.wires.elasticity import Elasticity, checked_law

Control = Literal["position", "force"]


@final
@dataclass(frozen=True)
class Site:
    """A point fixed to a link. A cable passes through it or ends at it.

    Attributes:
        link: Name of the link in the URDF.
        position: Position in the link's frame [m].
        friction: μ [-]: Coulomb friction coefficient between the cable and the hole.
        wrap: Wrap angle [rad] in addition to the angle between the two segments at the site, e.g.
            in a curved tube.

    Raises:
        InvalidInput: ``position`` is not three finite numbers, ``link`` is not a name, or
            ``friction`` or ``wrap`` is negative or too large (above 2, or 4π).
    """

    link: str
    position: tuple[float, float, float]
    friction: float = 0.0
    wrap: float = 0.0

    def __post_init__(self) -> None:
        text("link", self.link)
        position = vector("position", self.position, 3, f"a point on {self.link} [m]", "length")
        friction = quantity("friction", self.friction, "friction", zero=True)
        wrap = quantity("wrap", self.wrap, "wrap", zero=True)
        # the class is frozen: plain assignment is refused
        self.__dict__.update(position=tuple(position.tolist()), friction=friction, wrap=wrap)


@final
@dataclass(frozen=True)
class Cable:
    """A cable through an ordered list of sites, actuator side first.

    The cable length L is ``lead`` plus the straight segments between neighbouring sites. The cable
    stiffness is k = 1/(l_0/EA(F) + 1/k_series); it is 0 if the motor controls force. The original
    length of the wire is l_0 = (L − ΔF/k_series)/(1 + ε(F)), with ΔF = F − F_0. The strain ε is
    zero at F_0, :attr:`Elasticity.rest`. L includes the series spring, so the lead must be long
    enough to contain it.

    The cable ends at its last site. All other sites are holes that it passes. Without a lead, the
    first site is the actuator, not a hole. The lead is parallel to x of the first site's link. For
    a lead in another direction, give the position of the actuator as the first site.

    Attributes:
        name: Unique name within an arm.
        sites: Two or more sites, from the actuator to the end of the cable.
        elasticity: Law EA(F).
        lead: Straight cable between the actuator and the first site [m].
        series_stiffness: k_series of a spring or drive in series [N/m]; inf: no spring.
        control: What the motor keeps constant, ``"position"``: length; ``"force"``: tension.
        minimum: Smallest allowed tension [N]; every tension distribution respects it.
        maximum: Largest allowed tension [N]; every tension distribution respects it; inf: no limit.

    Raises:
        CableError: An attribute is invalid, or a site that is not a hole has friction; the error
            names the cable and the fault.
    """

    name: str
    sites: tuple[Site, ...]
    elasticity: Elasticity
    lead: float = 0.0
    series_stiffness: float = math.inf
    control: Control = "position"
    minimum: float = 0.0
    maximum: float = math.inf

    def __post_init__(self) -> None:
        try:
            text("name", self.name)
            checked_law(self.elasticity)
            sites = sequence_of("sites", self.sites, Site)
            one_of("control", self.control, get_args(Control))
            lead = quantity("lead", self.lead, "length", zero=True)
            series = quantity("series_stiffness", self.series_stiffness, "stiffness", infinite=True)
            least = quantity("minimum", self.minimum, "tension", zero=True)
            most = quantity("maximum", self.maximum, "tension", zero=True, infinite=True)
            if len(sites) < 2:
                raise InvalidInput("sites", f"{len(sites)} given; two or more Site are needed.")
        except CdsmError as error:
            raise CableError(str(self.name), str(error)) from None
        if least > most:
            raise CableError(
                self.name,
                f"tensions from {least:g} to {most:g} N given; minimum <= maximum is needed.",
            )
        start, end = sites[0], sites[-1]
        if end.friction or end.wrap:
            raise CableError(
                self.name,
                f"site {len(sites)} has friction or wrap, but the cable ends there; only holes "
                "that it passes have them.",
            )
        if lead == 0.0 and (start.friction or start.wrap):
            raise CableError(
                self.name,
                "site 1 has friction or wrap, but without a lead the cable leaves its actuator "
                "there; only holes that it passes have them. Give a lead.",
            )
        # the class is frozen: plain assignment is refused
        self.__dict__.update(
            sites=sites, lead=lead, series_stiffness=series, minimum=least, maximum=most
        )

    @property
    def _holes(self) -> range:
        """Indices of the sites that are holes, through which the cable passes."""
        return range(0 if self.lead > 0.0 else 1, len(self.sites) - 1)

    @property
    def friction(self) -> tuple[float, ...]:
        """Friction coefficient μ [-] of each hole that the cable passes, actuator side first."""
        return tuple(self.sites[i].friction for i in self._holes)

    def with_friction(self, friction: float) -> Cable:
        """Return the same cable with one friction coefficient μ [-] in all holes that it passes.

        Raises:
            InvalidInput: ``friction`` is negative, above 2, or not a number.
        """
        sites = list(self.sites)
        for i in self._holes:
            sites[i] = replace(sites[i], friction=friction)
        return replace(self, sites=tuple(sites))

    def elongation(self, tension: ArrayLike, free_length: float) -> Array:
        """Compute the elongation Δl = l_0 ε(F) + (F − F_0)/k_series [m], zero at F_0 = ``rest``.

        The wire and the series spring carry the same tension; their elongations add up. The spring
        may be a real one, as in the paper's hybrid cable (Fig. 11), or a compliant drive.

        Args:
            tension: F [N], any shape.
            free_length: l_0 of the wire [m].

        Raises:
            InvalidInput: ``free_length`` is not a positive number.
            ElasticityRangeError: A tension is outside the domain of the elasticity.
        """
        wire = _length(free_length) * self.elasticity.strain(tension)
        spring = (np.asarray(tension) - self.elasticity.rest) / self.series_stiffness
        return np.asarray(wire + spring)

    def tangent_stiffness(self, tension: ArrayLike, free_length: float) -> Array:
        """Compute dF/dΔl = 1/(l_0/EA(F) + 1/k_series) [N/m], whatever ``control`` is.

        Arguments (F, l_0), shapes and errors are those of :meth:`elongation`.
        """
        rigidity = self.elasticity.rigidity(tension)
        return np.asarray(1.0 / (_length(free_length) / rigidity + 1.0 / self.series_stiffness))

    def energy(self, tension: ArrayLike, free_length: float) -> Array:
        """Compute the energy l_0 ∫ F dε + (F² − F_0²)/(2 k_series) [J], zero at F_0 = ``rest``.

        Arguments (F, l_0), shapes and errors are those of :meth:`elongation`.
        """
        wire = _length(free_length) * self.elasticity.energy(tension)
        squares = np.asarray(tension) ** 2 - self.elasticity.rest**2
        return np.asarray(wire + squares / (2.0 * self.series_stiffness))

    def tension(self, elongation: ArrayLike, free_length: float) -> Array:
        """Compute F [N] at an elongation: the inverse of :meth:`elongation`.

        Args:
            elongation: Δl [m], 0 at the elasticity's ``rest``; any shape.
            free_length: l_0 of the wire [m].

        Raises:
            InvalidInput: ``elongation`` is not numbers, or ``free_length`` is not positive.
            ElasticityRangeError: No tension in the domain gives one of the elongations.
        """
        return self.elasticity._tension_of(
            number_array("elongation", elongation),
            "elongation",
            _length(free_length),
            1.0 / self.series_stiffness,
        )


class Cables(tuple[Cable, ...]):
    """Cables of an arm, in the order of every (C,) array: ``cables[0]`` or ``cables["cable1_1"]``.

    Raises:
        UnknownName: No cable has the name that is asked for.
    """

    __slots__ = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the cables, in their order."""
        return tuple(cable.name for cable in self)

    @property
    def position_controlled(self) -> NDArray[np.bool_]:
        """Whether each cable's motor controls its length (True) or its tension (False) (C,)."""
        return np.array([cable.control == "position" for cable in self])

    def __repr__(self) -> str:
        return f"<{plural(len(self), 'cable')}: {listed(self.names)}>"

    @overload
    def __getitem__(self, which: SupportsIndex | str, /) -> Cable: ...
    @overload
    def __getitem__(self, which: slice, /) -> tuple[Cable, ...]: ...
    def __getitem__(self, which: SupportsIndex | slice | str, /) -> Cable | tuple[Cable, ...]:
        if isinstance(which, str):
            return super().__getitem__(self.names.index(one_of("cable", which, self.names)))
        return super().__getitem__(which)


def _length(value: float) -> float:
    length = scalar("free_length", value)
    if length <= 0.0:
        raise InvalidInput("free_length", f"{length:g} m given; it must be positive.")
    return length
