"""Hypothesis strategies: geometries, laws, cables and arms of every kind."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple, TypeVar

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import cdsm
from cdsm.cable import Control
from tests.support.foreign import joint_element, link_element

Strategy = st.SearchStrategy
_Value = TypeVar("_Value")

UNIVERSAL_AXES = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

_vectors = st.tuples(*[st.floats(-10.0, 10.0)] * 3)
_hinges = _vectors.filter(lambda axis: math.hypot(*axis) > 1e-3).map(lambda axis: (axis,))
_crosses = st.tuples(_vectors, _vectors).filter(lambda pair: math.hypot(*np.cross(*pair)) > 1e-3)
_names = st.from_regex(r"[A-Za-z][A-Za-z0-9_]{0,63}", fullmatch=True)


def decades(low: float, high: float) -> Strategy[float]:
    """Positive numbers, every decade as likely as any other."""
    return st.floats(math.log10(low), math.log10(high)).map(lambda power: 10.0**power)


class Sizes(NamedTuple):
    """Where the measures of an arm are drawn from."""

    length: Strategy[float]
    disk_offset: Strategy[float]
    hole_radius: Strategy[float]
    mass: Strategy[float]
    lead: Strategy[float]


PLAUSIBLE = Sizes(
    length=st.floats(0.01, 0.2),
    disk_offset=st.floats(0.003, 0.02),
    hole_radius=st.floats(0.005, 0.06),
    mass=st.just(0.0) | decades(1e-3, 1.0),
    lead=st.just(0.0) | st.floats(1e-6, 2.0),
)
EXTREME = Sizes(*[decades(1e-4, 10.0)] * 3, *[st.just(0.0) | decades(1e-6, 100.0)] * 2)
"""From a tenth of a millimetre to ten metres, and in any proportion."""


# --- geometries -----------------------------------------------------------------------------


@st.composite
def uniform_geometries(
    draw: st.DrawFn, sizes: Sizes = PLAUSIBLE, most_joints: int = 12
) -> cdsm.Geometry:
    """Universal joints or hinges, one like the other."""
    offset = draw(sizes.disk_offset)
    keywords: dict[str, Any] = {
        "joints": draw(st.integers(1, most_joints)),
        "cables_per_joint": draw(st.sampled_from([3, 3, 3, 4, 2, 1])),
        "link_length": 2.0 * offset + draw(sizes.length),
        "base_length": draw(st.just(0.0) | sizes.length),
        "disk_offset": offset,
        "hole_radius": draw(sizes.hole_radius),
        "link_mass": draw(sizes.mass),
        "lead": draw(sizes.lead),
        "joint_limit": draw(st.none() | st.floats(0.01, math.pi)),
    }
    if draw(st.booleans()):
        return cdsm.Geometry.universal(**keywords)
    return cdsm.Geometry.hinged(twist=draw(st.floats(-math.pi, math.pi)), **keywords)


@st.composite
def mixed_geometries(
    draw: st.DrawFn, sizes: Sizes = PLAUSIBLE, most_joints: int = 12
) -> cdsm.Geometry:
    """Every joint, link and cable another one; some joints may have no cable of their own."""
    count = draw(st.integers(1, most_joints))
    axes = st.just(UNIVERSAL_AXES) | _hinges | _crosses
    joints = tuple(
        cdsm.Joint(
            axes=draw(axes),
            disk_offset=draw(sizes.disk_offset),
            limit=draw(st.none() | st.floats(1e-6, math.pi)),
        )
        for _ in range(count)
    )
    offsets = [*(joint.disk_offset for joint in joints), 0.0]
    links = tuple(
        cdsm.Link(length=offsets[k] + offsets[k + 1] + draw(sizes.length), mass=draw(sizes.mass))
        for k in range(count)
    )
    route = st.builds(
        cdsm.CableRoute,
        joint=st.integers(1, count),
        angle=st.floats(-math.pi, math.pi) | st.floats(-1e3, 1e3),
        lead=sizes.lead,
    )
    # three around every joint, so that most arms can be balanced
    spread = tuple(
        cdsm.CableRoute(joint=k, angle=2.1 * j + 0.7 * k)
        for k in range(1, count + 1)
        for j in range(3)
    )
    return cdsm.Geometry(
        name=draw(_names),
        base_length=draw(st.just(0.0) | sizes.length),
        hole_radius=draw(sizes.hole_radius),
        joints=joints,
        links=links,
        cables=tuple(draw(st.lists(route, min_size=1, max_size=4 * count)))
        + draw(st.sampled_from([spread, spread, ()])),
    )


@st.composite
def sectioned_geometries(draw: st.DrawFn) -> cdsm.Geometry:
    """Arms of one to three sections: radii per joint, rings of their own, friction, spread."""
    sections, radius = [], PLAUSIBLE.hole_radius
    for part in draw(st.lists(mixed_geometries(PLAUSIBLE, 3), min_size=1, max_size=3)):
        sections.append(
            part.replace(
                joints=[replace(j, hole_radius=draw(st.none() | radius)) for j in part.joints],
                links=[replace(link, length=link.length + 0.02) for link in part.links],
                cables=[
                    replace(
                        route,
                        radius=draw(st.none() | radius),
                        friction=draw(st.sampled_from([0.0, 0.1, 1e-3])),
                    )
                    for route in part.cables
                ],
            )
        )
    spread = draw(st.just(0.0) | st.floats(0.0, 0.5))
    joined = cdsm.Geometry.sections(sections, spread=spread, name=draw(_names))
    outer = draw(st.none() | st.floats(0.07, 0.1))  # beyond all holes
    return joined.replace(joints=[replace(joint, disk_radius=outer) for joint in joined.joints])


def geometries(most_joints: int = 12) -> Strategy[cdsm.Geometry]:
    """Any valid geometry: uniform or mixed, of plausible or extreme sizes."""
    kinds = (uniform_geometries, mixed_geometries)
    return st.one_of([kind(of, most_joints) for of in (PLAUSIBLE, EXTREME) for kind in kinds])


# --- cables ---------------------------------------------------------------------------------


@st.composite
def tabulated_elasticities(draw: st.DrawFn) -> cdsm.TabulatedElasticity:
    """A curve through a few points, each piece of another rigidity; from zero or from a toe on."""
    count = draw(st.integers(1, 8))
    start = draw(st.just(0.0) | decades(0.01, 30.0))
    steps = draw(st.lists(decades(0.1, 300.0), min_size=count, max_size=count))
    rigidity = draw(st.lists(decades(1e2, 1e6), min_size=count, max_size=count))
    return cdsm.TabulatedElasticity(
        tuple(np.cumsum([start, *steps]).tolist()),
        tuple(np.cumsum([0.0, *np.divide(steps, rigidity)]).tolist()),
    )


@st.composite
def strand_elasticities(draw: st.DrawFn) -> cdsm.StrandElasticity:
    """Two ranges of rising polynomials that meet."""
    low = draw(st.just(0.0) | decades(0.01, 20.0))
    join, high = (low + np.cumsum(draw(st.tuples(*[decades(1.0, 300.0)] * 2)))).tolist()
    row = st.tuples(decades(1e3, 1e6), st.floats(0.0, 100.0), st.floats(0.0, 0.1))
    below, (_, b, c) = draw(row), draw(row)
    meet = float(np.polyval(below[::-1], join) - (b + c * join) * join)
    return cdsm.StrandElasticity((below, (meet, b, c)), (join,), low, high)


def elasticities() -> Strategy[cdsm.Elasticity]:
    """Constant, Eq. 19, polynomial, table."""
    linear = decades(1e2, 1e7).map(cdsm.LinearElasticity)
    strand = st.just(cdsm.presets.STRAND_1X19)
    return st.one_of(linear, strand, strand_elasticities(), tabulated_elasticities())


_springs = st.just(math.inf) | decades(1e2, 1e7)
_controls: Strategy[Control] = st.sampled_from(["position", "position", "position", "force"])


@st.composite
def cables(
    draw: st.DrawFn, links: tuple[str, ...], size: float = 0.1, most: int = 12
) -> tuple[cdsm.Cable, ...]:
    """Cables that pass any of the links, in any order, through any point within a size [m]."""
    place = st.tuples(*[st.floats(-size, size)] * 3)
    sites = st.lists(
        st.builds(cdsm.Site, link=st.sampled_from(links), position=place), min_size=2, max_size=5
    )
    few = draw(st.lists(elasticities(), min_size=1, max_size=3))
    made = []
    for i in range(draw(st.integers(1, most))):
        least = draw(st.just(0.0) | decades(0.1, 50.0))
        cable = cdsm.Cable(
            name=f"c{i}",
            sites=tuple(draw(sites)),
            elasticity=few[i % len(few)],
            lead=draw(st.just(0.0) | st.floats(1e-6, 2.0)),
            series_stiffness=draw(_springs),
            control=draw(_controls),
            minimum=least,
            maximum=least + draw(st.just(math.inf) | decades(10.0, 1e4)),
        )
        made.append(cable)
    return tuple(made)


# --- arms -----------------------------------------------------------------------------------

gravities = st.sampled_from([(0.0, 0.0, -9.81), (0.0, 0.0, 0.0), (0.0, -9.81, 0.0)]) | st.tuples(
    *[st.floats(-20.0, 20.0)] * 3
)


@st.composite
def serpentine_arms(draw: st.DrawFn, shapes: Strategy[cdsm.Geometry]) -> cdsm.Manipulator:
    """Arms with the cables of their geometry, of one law or of several in turn."""
    geometry = draw(shapes)
    few = draw(st.lists(elasticities(), min_size=1, max_size=3))
    laws = [few[c % len(few)] for c in range(len(geometry.cables))]
    routed = cdsm.serpentine_cables(
        geometry, laws, series_stiffness=draw(_springs), control=draw(_controls)
    )
    return cdsm.Manipulator(geometry, cables=routed, gravity=draw(gravities))


@st.composite
def routed_arms(draw: st.DrawFn, shapes: Strategy[cdsm.Geometry]) -> cdsm.Manipulator:
    """Arms with cables from anywhere to anywhere, most beside those of their geometry."""
    geometry = draw(shapes)
    links = ("base_link", "tool0", *dict.fromkeys(disk.link for disk in geometry.disks))
    routed, gravity = draw(cables(links, size=geometry.hole_radius)), draw(gravities)
    if draw(st.sampled_from([True, True, True, False])):  # most can be balanced then
        routed += cdsm.serpentine_cables(geometry, draw(elasticities()))
    try:
        return cdsm.Manipulator(geometry, cables=routed, gravity=gravity)
    except cdsm.InvalidInput:  # sites coincide
        assume(False)
        raise


def _antagonists(joint: str, kind: str, frame: list[str], law: cdsm.Elasticity) -> Iterator[Any]:
    """Two cables across one joint of a URDF, which pull it one way and the other."""
    parent, child, place, turn, axis = frame
    origin, angles, direction = (np.array(text.split(), float) for text in (place, turn, axis))
    turned, along = Rotation.from_euler("xyz", angles), direction / np.linalg.norm(direction)
    across = np.cross(along, np.eye(3)[abs(along).argmin()])
    across /= np.linalg.norm(across)
    way = 0.2 * along if kind == "prismatic" else 0.1 * np.cross(along, across)
    for name, sign in (("forth", 1.0), ("back", -1.0)):
        start, end = origin + turned.apply(0.1 * across + sign * way), 0.1 * across
        sites = (cdsm.Site(parent, tuple(start.tolist())), cdsm.Site(child, tuple(end.tolist())))
        yield cdsm.Cable(name=f"{joint} {name}", sites=sites, elasticity=law)


@st.composite
def trees(draw: st.DrawFn) -> cdsm.Manipulator:
    """Robots from a URDF: branches, slides, fixed links, masses anywhere."""
    kinds = draw(st.lists(st.sampled_from(["revolute", "prismatic", "fixed"]), max_size=7))
    kinds = ["revolute", *kinds]
    numbers = st.tuples(*[st.floats(-0.3, 0.3)] * 3)
    parts, pairs, law = [link_element("l0")], list[cdsm.Cable](), draw(elasticities())
    for i, kind in enumerate(kinds, start=1):
        place, turn, axis = (
            " ".join(map(repr, values))
            for values in (draw(numbers), draw(numbers), draw(_hinges)[0])
        )
        frame = [f"l{draw(st.integers(0, i - 1))}", f"l{i}", place, turn, axis]
        parts += [link_element(f"l{i}", draw(PLAUSIBLE.mass))]
        parts += [joint_element(f"j{i}", kind, *frame)]
        if kind != "fixed":
            pairs += _antagonists(f"j{i}", kind, frame, law)
    links = tuple(f"l{i}" for i in range(len(kinds) + 1))
    routed, tip = draw(cables(links, size=0.2)), draw(st.sampled_from(links))
    routed += draw(st.sampled_from([tuple(pairs), tuple(pairs), ()]))
    urdf = f'<robot name="tree">{"".join(parts)}</robot>'
    gravity = draw(gravities)
    try:
        return cdsm.Manipulator.from_urdf(urdf, routed, tip=tip, gravity=gravity)
    except cdsm.InvalidInput:  # sites coincide
        assume(False)
        raise
