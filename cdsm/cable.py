"""Cables through sites and over pulleys of the links, and those of a serpentine arm."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Final, Literal, SupportsIndex, final, get_args, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.cable_path import PathElement, Pulley, Sheath, Site, check_cable_path
from cdsm.errors import CdsmError, InvalidInput, listed
from cdsm.geometry import Geometry
from cdsm.support.format import plural
from cdsm.support.validation import (
    check_numbers,
    instance,
    number,
    number_array,
    one_of,
    positive,
    text,
    vector,
)
from cdsm.support.values import Array
from cdsm.wires.catalogue import label
from cdsm.wires.elasticity import Elasticity, checked_law
from cdsm.wires.ropes import breaking_force

Control = Literal["position", "force"]


@final
@dataclass(frozen=True)
class Cable:
    """A cable through an ordered list of sites and pulleys, actuator side first.

    Its length L is ``lead`` plus the straight segments between sites; the lead must be long enough
    for the series spring. The original length of the wire is `l_0 = (L − ΔF/k_series)/(1 + ε(F))`,
    with `ΔF = F − F_0` and the strain ε zero at `F_0`, :attr:`Elasticity.rest`. The cable stiffness
    is `k = 1/(l_0/EA(F) + 1/k_series)`, and 0 if the motor controls force.

    The cable ends at its last site and passes all others, which are holes. The lead is parallel to
    x of the first site's link. Without a lead, the first site is the actuator, not a hole. Between
    sites the cable runs straight, or around pulleys, with their arcs in L, or through a sheath.

    Attributes:
        name: Unique name within an arm.
        sites: Two or more sites, from the actuator to the end of the cable, with the pulleys and
            sheaths between them (:class:`Site`, :class:`Pulley`, :class:`Sheath`).
        elasticity: Law EA(F).
        lead: Straight cable between the actuator and the first site [m].
        series_stiffness: `k_series` of a spring (Fig. 11) or drive in series [N/m]; inf: none.
        control: What the motor keeps constant, ``"position"``: length; ``"force"``: tension.
        minimum: Smallest allowed tension [N]; every tension distribution respects both bounds.
        maximum: Largest allowed tension [N]; inf: no limit.
        slack: Wire that the motor takes in from the straight arm before the cable pulls [m].
        gain: Wire taken in per pull that the motor reports [-], as of a drum of another radius.
            Slack and gain count where a pull is given (:func:`~cdsm.forward_statics`).

    Raises InvalidInput, which names the cable and the fault. Its methods take F [N], any shape, and
    `l_0` [m], ``free_length``: InvalidInput if it is not positive, ElasticityRangeError if a
    tension is outside the law, or no tension gives an elongation.

    Example:
        >>> import cdsm
        >>> sites = [("base_link", (-0.02, 0.03, 0.0)), ("link1", (-0.01, 0.03, 0.0))]
        >>> sites = tuple(cdsm.Site(*site) for site in sites)
        >>> cable = cdsm.Cable("cable1", sites, cdsm.LinearElasticity(48e3), lead=0.3)
        >>> cable.friction, cable.control
        ((0.0,), 'position')
    """

    name: str
    sites: tuple[PathElement, ...]
    elasticity: Elasticity
    lead: float = number("length", 0.0, zero=True)
    # what follows are keys of ARM.toml, for all cables or for one
    series_stiffness: float = number("stiffness", math.inf, infinite=True)
    control: Control = "position"
    minimum: float = number("tension", 0.0, zero=True)
    maximum: float = number("tension", math.inf, zero=True, infinite=True)
    slack: float = number("slack", 0.0, zero=True)
    gain: float = number("gain", 1.0)

    def __post_init__(self) -> None:
        try:
            text("name", self.name)
            checked_law(self.elasticity)
            one_of("control", self.control, get_args(Control))
            check_numbers(self)
            sites = check_cable_path(self.sites, self.lead)
            if self.minimum > self.maximum:
                bounds = f"tensions from {self.minimum:g} to {self.maximum:g} N"
                raise CdsmError(f"{bounds}; give minimum <= maximum.")
        except CdsmError as error:
            raise InvalidInput(f"cable {self.name!r}", str(error)) from None
        self.__dict__["sites"] = sites
        for i in {0, len(sites) - 1}.difference(self._holes):
            end = sites[i]
            if isinstance(end, Site) and (end.friction or end.wrap):
                why = "ends there; only" if i else "starts there. Give a lead; only"
                problem = f"site {i + 1} has friction or wrap, but the cable {why} holes have them."
                raise InvalidInput(f"cable {self.name!r}", problem)

    @property
    def _holes(self) -> range:
        return range(0 if self.lead > 0.0 else 1, len(self.sites) - 1)

    @property
    def friction(self) -> tuple[float, ...]:
        """Friction coefficient μ [-] of all that the cable passes, actuator side first.

        These are holes, pulleys and sheaths; of a pulley on a bearing, :attr:`Pulley.bearing`.
        """
        passed = [self.sites[i] for i in self._holes]
        if isinstance(self.sites[0], Sheath):
            passed.insert(0, self.sites[0])
        return tuple(
            element.friction or (element.bearing if isinstance(element, Pulley) else 0.0)
            for element in passed
        )

    def only_sites(self, lacks: str) -> tuple[Site, ...]:
        """Return a path that is made of sites alone.

        InvalidInput if it has pulleys or sheaths: ``lacks`` says what cannot handle them.
        """
        for element in self.sites:
            if not isinstance(element, Site):
                what = "through a sheath"
                if isinstance(element, Pulley):
                    what = f"over the pulley on {element.link}"
                raise InvalidInput(f"cable {self.name!r}", f"runs {what}, and {lacks}")
        return tuple(element for element in self.sites if isinstance(element, Site))

    @property
    def guided(self) -> float:
        """Length [m] that no joint changes: the lead, and the sheaths of the path."""
        sheaths = (element.length for element in self.sites if isinstance(element, Sheath))
        return sum(sheaths, self.lead)

    @property
    def pulleys(self) -> tuple[Pulley, ...]:
        """Pulleys of the path, actuator side first."""
        return tuple(element for element in self.sites if isinstance(element, Pulley))

    @property
    def is_plain(self) -> bool:
        """Whether the cable runs through sites alone, over no pulley and through no sheath."""
        return all(isinstance(element, Site) for element in self.sites)

    def with_friction(self, friction: float) -> Cable:
        """Return the same cable with μ = ``friction`` (0 to 2) in all holes that it passes.

        Pulleys and sheaths keep theirs.
        """
        sites = self.sites
        holes = self._holes
        rough = [
            replace(site, friction=friction) if isinstance(site, Site) else site
            for site in sites[holes.start : holes.stop]
        ]
        return replace(self, sites=(*sites[: holes.start], *rough, *sites[holes.stop :]))

    def elongation(self, tension: ArrayLike, free_length: float) -> Array:
        """Compute the elongation `l_0 ε(F) + (F − F_0)/k_series` [m]; `F_0` is ``rest``."""
        wire = _length(free_length) * self.elasticity.strain(tension)
        spring = (np.asarray(tension) - self.elasticity.rest) / self.series_stiffness
        return np.asarray(wire + spring)

    def tangent_stiffness(self, tension: ArrayLike, free_length: float) -> Array:
        """Compute `dF/dΔl = 1/(l_0/EA(F) + 1/k_series)` [N/m], whatever ``control`` is."""
        wire = _length(free_length) / self.elasticity.rigidity(tension)
        return np.asarray(1.0 / (wire + 1.0 / self.series_stiffness))

    def energy(self, tension: ArrayLike, free_length: float) -> Array:
        """Compute the energy `l_0 ∫ F dε + (F² − F_0²)/(2 k_series)` [J]; `F_0` is ``rest``."""
        wire = _length(free_length) * self.elasticity.energy(tension)
        squares = np.asarray(tension) ** 2 - self.elasticity.rest**2
        return np.asarray(wire + squares / (2.0 * self.series_stiffness))

    def tension(self, elongation: ArrayLike, free_length: float) -> Array:
        """Compute F [N] at elongations Δl [m], any shape: the inverse of :meth:`elongation`."""
        wanted = number_array("elongation", elongation)
        l_0 = _length(free_length)
        return self.elasticity._tension_of(wanted, "elongation", l_0, 1.0 / self.series_stiffness)


_OF_ONE: Final = ("name", "sites", "elasticity", "lead")
SETTINGS: Final = tuple(setting.name for setting in fields(Cable) if setting.name not in _OF_ONE)
"""Fields of a :class:`Cable` that files have as keys, for all cables or for one."""


class Cables(tuple[Cable, ...]):
    """Cables of an arm, in the order of every (C,) array: ``cables[0]``, ``cables["cable1_1"]``."""

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
        return super().__getitem__(self.number_of(which) if isinstance(which, str) else which)

    def number_of(self, name: object) -> int:
        """Return the place of a cable in every (C,) array; InvalidInput if there is no such one."""
        return self.names.index(one_of("cable", name, self.names))

    def tension_vector(self, tension: ArrayLike) -> Array:
        """Return tensions (C,) [N]; InvalidInput if it is not one for each cable, or negative."""
        F = vector("tension", tension, len(self), "one tension [N] per cable", "tension")
        self.require_pulling("tension", F)
        return F

    def require_pulling(self, argument: str, tension: Array) -> None:
        """Raise InvalidInput if an entry of an ``argument``, tensions (…, C) [N], is negative."""
        if tension.min(initial=0.0) < 0.0:
            *row, c = np.unravel_index(int(tension.argmin()), tension.shape)
            where = f"{self[c].name} in row {row[0]}" if row else self[c].name
            problem = f"{tension.min():g} N given for {where}; cables only pull."
            raise InvalidInput(argument, problem)


def _length(value: float) -> float:
    return positive("free_length", value, "m")


def serpentine_cables(
    geometry: Geometry,
    elasticity: Elasticity | Sequence[Elasticity],
    *,
    series_stiffness: float = math.inf,
    control: Control = "position",
) -> tuple[Cable, ...]:
    """Return the cables of a serpentine arm, routed through the holes of its disks.

    A cable of joint k passes all disks before it, and ends on the first disk after it. Its hole in
    a disk is at `(x, R cos φ, R sin φ)` in the frame of the link: x is the position of the disk, φ
    the angle of the :class:`~cdsm.CableRoute`, R the radius of the route, or the hole radius of the
    disk. The i-th cable of joint k has the name ``cable{k}_{i}``.

    Args:
        geometry: The arm.
        elasticity: One law for all cables, or one law per cable in the geometry's order.
        series_stiffness: `k_series` of all cables [N/m], as in :class:`Cable`.
        control: Motor control of all cables, as in :class:`Cable`.

    Raises:
        InvalidInput: ``elasticity`` is not a law, or not one for each cable.

    Example:
        >>> import cdsm
        >>> geometry = cdsm.presets.virtual_prototype_geometry()
        >>> cables = cdsm.serpentine_cables(geometry, cdsm.presets.STRAND_1X19)
        >>> len(cables), cables[-1].name, len(cables[-1].sites)
        (15, 'cable5_3', 10)
    """
    names = instance("geometry", geometry, Geometry).cable_names
    n = len(geometry.cables)
    laws: Sequence[Elasticity]
    laws = elasticity if isinstance(elasticity, (list, tuple)) else [checked_law(elasticity)] * n
    if len(laws) != n:
        raise InvalidInput("elasticity", f"{len(laws)} laws given; give 1, or 1 for each of {n}.")
    new = partial(Cable, series_stiffness=series_stiffness, control=control)
    cables = []
    for name, route, law in zip(names, geometry.cables, laws, strict=True):
        mu = route.friction
        passed = geometry.disks_of(route)
        friction = [mu if route.lead else 0.0, *[mu] * (len(passed) - 2), 0.0]
        holes = zip(passed, friction, strict=True)
        sites = tuple(Site(disk.link, disk.hole(route), mu) for disk, mu in holes)
        cables.append(new(name=name, sites=sites, elasticity=law, lead=route.lead))
    return tuple(cables)


def holes_like(cable: Cable, other: Cable) -> tuple[Site, ...]:
    """Return the sites of ``cable``, with the friction and the wrap of the holes of ``other``.

    A hole that only ``cable`` passes gets the friction of the nearest hole that ``other`` passes.
    """
    lacks = "a geometry has none to vary."
    sites = list(cable.only_sites(lacks))
    theirs = other.only_sites(lacks)
    known = other._holes
    for i in cable._holes if known else ():
        near = min(max(i, known[0]), known[-1])
        wrap = theirs[near].wrap if i == near else 0.0
        sites[i] = replace(sites[i], friction=theirs[near].friction, wrap=wrap)
    return tuple(sites)


def require_own_cables(geometry: Geometry, cables: Sequence[Cable]) -> None:
    """Refuse the ``cables`` of an arm that are not routed and led as its ``geometry`` says.

    What is built from values of the geometry would replace them. Raises InvalidInput.
    """
    routed = serpentine_cables(geometry, cables[0].elasticity)
    routed_paths = {cable.name: _path(cable) for cable in routed}
    paths = {c.name: _path(c) for c in cables}
    if list(routed_paths.items()) != list(paths.items()):
        other = listed(
            [name for name in routed_paths | paths if routed_paths.get(name) != paths.get(name)]
        )
        raise InvalidInput(
            "arm",
            f"the lead or the holes of {other} are not those of its geometry, which alone is "
            "varied. Describe springs and wires in [cables.NAME] of the ARM.toml.",
        )


def _path(cable: Cable) -> tuple[float, list[object]]:
    return cable.lead, [
        (element.link, element.position) if isinstance(element, Site) else element
        for element in cable.sites
    ]


def breaking_forces(cables: Sequence[Cable]) -> Array:
    """Return the least breaking forces (C,) [N] of ropes; NaN for wires without one."""
    return np.array([breaking_force(cable.elasticity) for cable in cables])


def largest_share(cables: Sequence[Cable], tension: Array) -> str:
    """Describe which cable comes nearest to its breaking force, of tensions (…, C) [N].

    The text is empty if no breaking force is known.
    """
    shares = tension / breaking_forces(cables)
    if np.isnan(shares).all():
        return ""
    c = int(np.unravel_index(np.nanargmax(shares), shares.shape)[-1])
    force = breaking_force(cables[c].elasticity)
    most = float(np.nanmax(shares))
    return (
        f"largest share of a breaking force: {cables[c].name}, {most * force:.4g} N of {force:.4g} "
        f"N, {100.0 * most:.3g} %" + ": THE ROPE BREAKS" * (most >= 1.0)
    )


def wires_text(cables: Sequence[Cable]) -> str:
    """Describe the wires of cables and their series springs; more than three kinds are counted."""
    counts = Counter[str]()
    for cable in cables:
        spring = f" on a spring of {cable.series_stiffness / 1e3:.4g} N/mm"
        counts[label(cable.elasticity) + spring * math.isfinite(cable.series_stiffness)] += 1
    if len(counts) > 3:
        return f"of {len(counts)} kinds"
    texts = [f"{name} ({count} of {len(cables)})" for name, count in counts.items()]
    return ", ".join(texts if len(counts) > 1 else counts)
