"""Hypothesis strategies: arms of every kind, what is asked of them, and what is broken by name."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

import cdsm
from cdsm.cable import Control
from cdsm.support.values import Array
from tests.support.foreign import joint_element, link_element

Strategy = st.SearchStrategy

_Value = TypeVar("_Value")

UNIVERSAL_AXES = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

components = st.tuples(*[st.floats(-10.0, 10.0)] * 3)
hinges = components.filter(lambda axis: math.hypot(*axis) > 1e-3).map(lambda axis: (axis,))
crosses = st.tuples(components, components).filter(lambda pair: math.hypot(*np.cross(*pair)) > 1e-3)
names = st.from_regex(r"[A-Za-z][A-Za-z0-9_]{0,63}", fullmatch=True)


def decades(low: float, high: float) -> Strategy[float]:
    """Positive numbers, every decade as likely as any other."""
    return st.floats(math.log10(low), math.log10(high)).map(lambda power: 10.0**power)


def _present(maybe: Strategy[_Value | None]) -> Strategy[_Value]:
    """What is not None."""
    return cast(Strategy[_Value], maybe.filter(lambda value: value is not None))


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
        "cables_per_joint": draw(st.sampled_from([1, 2, 3, 3, 3, 3, 3, 3, 4, 4])),
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
    usual = st.just(UNIVERSAL_AXES)
    axes = draw(st.sampled_from([usual, usual, usual | hinges | crosses]))
    joints = [
        cdsm.Joint(
            axes=draw(axes),
            disk_offset=draw(sizes.disk_offset),
            limit=draw(st.none() | st.floats(1e-6, math.pi)),
        )
        for _ in range(count)
    ]
    offsets = [*(joint.disk_offset for joint in joints), 0.0]
    links = [
        cdsm.Link(length=offsets[k] + offsets[k + 1] + draw(sizes.length), mass=draw(sizes.mass))
        for k in range(count)
    ]
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
        name=draw(names),
        base_length=draw(st.just(0.0) | sizes.length),
        hole_radius=draw(sizes.hole_radius),
        joints=tuple(joints),
        links=tuple(links),
        cables=tuple(draw(st.lists(route, min_size=1, max_size=4 * count)))
        + draw(st.sampled_from([(), spread, spread, spread])),
    )


@st.composite
def sectioned_geometries(draw: st.DrawFn) -> cdsm.Geometry:
    """Arms of one to three sections: radii per joint, rings of their own, friction, spread."""
    sections = []
    for part in draw(st.lists(mixed_geometries(PLAUSIBLE, 3), min_size=1, max_size=3)):
        radius = PLAUSIBLE.hole_radius
        radii = [draw(st.none() | radius) for _ in part.joints]
        rings = [draw(st.none() | st.none() | radius) for _ in part.cables]
        sections.append(
            part.replace(
                joints=[replace(j, hole_radius=R) for j, R in zip(part.joints, radii, strict=True)],
                links=[replace(link, length=link.length + 0.02) for link in part.links],
                cables=[
                    replace(route, radius=R, friction=draw(st.sampled_from([0.0, 0.1, 1e-3])))
                    for route, R in zip(part.cables, rings, strict=True)
                ],
            )
        )
    joined = cdsm.Geometry.sections(
        sections, spread=draw(st.just(0.0) | st.floats(0.0, 0.5)), name=draw(names)
    )
    outer = draw(st.none() | st.floats(0.07, 0.1))  # beyond all holes
    return joined.replace(joints=[replace(joint, disk_radius=outer) for joint in joined.joints])


def geometries(most_joints: int = 12) -> Strategy[cdsm.Geometry]:
    """Any valid geometry: uniform or mixed, of plausible or extreme sizes."""
    return st.one_of(
        [
            kind(sizes, most_joints)
            for sizes in (PLAUSIBLE, EXTREME)
            for kind in (uniform_geometries, mixed_geometries)
        ]
    )


# --- elasticities ---------------------------------------------------------------------------


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
    """Ranges of rising polynomials that meet."""
    low = draw(st.just(0.0) | decades(0.01, 20.0))
    widths = draw(st.lists(decades(1.0, 300.0), min_size=1, max_size=3))
    edges = np.cumsum([low, *widths]).tolist()
    row = st.tuples(decades(1e2, 1e6), st.floats(0.0, 1e3), st.floats(0.0, 1.0))
    rows = draw(st.lists(row, min_size=len(widths), max_size=len(widths)))
    for k, join in enumerate(edges[1:-1]):
        below, (_, b, c) = np.polyval(rows[k][::-1], join), rows[k + 1]
        rows[k + 1] = float(below - (b + c * join) * join), b, c
    return cdsm.StrandElasticity(tuple(rows), tuple(edges[1:-1]), edges[0], edges[-1])


@cache
def fitted_elasticities() -> tuple[cdsm.Elasticity, ...]:
    """What comes out of tensile tests of the paper's strand, and of a wire with a toe."""
    wires = (cdsm.presets.STRAND_1X19, cdsm.LinearElasticity(2e5))
    laws: list[cdsm.Elasticity] = []
    for wire in wires:
        force = np.linspace(wire.low + 0.1, 600.0, 80)
        laws.append(cdsm.fit_tensile_test(0.3 * wire.strain(force), force, 0.3).elasticity)
    force = np.linspace(0.0, 400.0, 60)
    toe = force / 8e4 + 1e-3 * (1.0 - np.exp(-force / 20.0))
    laws.append(cdsm.TabulatedElasticity(tuple(force.tolist()), tuple(toe.tolist())))
    return tuple(laws)


def elasticities() -> Strategy[cdsm.Elasticity]:
    """Every law the library has: constant, Eq. 19, polynomial, table, from a test."""
    return st.one_of(
        decades(1e2, 1e7).map(cdsm.LinearElasticity),
        st.just(cdsm.presets.STRAND_1X19),
        strand_elasticities(),
        tabulated_elasticities(),
        st.integers(0, 2).map(lambda which: fitted_elasticities()[which]),
    )


_CONTROLS: tuple[Control, ...] = ("position", "position", "position", "force")

# --- cables ---------------------------------------------------------------------------------


@st.composite
def pulled(draw: st.DrawFn) -> dict[str, Any]:
    """How a cable is held: by force or position, behind a spring or not, within bounds or not."""
    least = draw(st.sampled_from([0.0, 0.0, 0.0, 5.0]) | decades(0.1, 50.0))
    return {
        "series_stiffness": draw(st.just(math.inf) | decades(1e2, 1e7)),
        "control": draw(st.sampled_from(_CONTROLS)),
        "minimum": least,
        "maximum": least + draw(st.just(math.inf) | decades(10.0, 1e4)),
    }


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
    return tuple(
        cdsm.Cable(
            name=f"c{i}",
            sites=tuple(draw(sites)),
            elasticity=few[i % len(few)],
            lead=draw(st.just(0.0) | st.floats(1e-6, 2.0)),
            **draw(pulled()),
        )
        for i in range(draw(st.integers(1, most)))
    )


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
        geometry,
        laws,
        series_stiffness=draw(st.just(math.inf) | decades(1e2, 1e7)),
        control=draw(st.sampled_from(_CONTROLS)),
    )
    return cdsm.Manipulator(geometry, cables=routed, gravity=draw(gravities))


def _unless_sites_coincide(
    build: Callable[[], cdsm.Manipulator],
) -> cdsm.Manipulator | None:
    try:
        return build()
    except cdsm.InvalidInput:
        return None


@st.composite
def _routed_arms(draw: st.DrawFn, shapes: Strategy[cdsm.Geometry]) -> cdsm.Manipulator | None:
    geometry = draw(shapes)
    links = ("base_link", "tool0", *dict.fromkeys(disk.link for disk in geometry.disks))
    routed = draw(cables(links, size=geometry.hole_radius))
    if draw(st.sampled_from([True, True, True, False])):  # most can be balanced then
        routed += cdsm.serpentine_cables(geometry, draw(elasticities()))
    gravity = draw(gravities)
    return _unless_sites_coincide(
        lambda: cdsm.Manipulator(geometry, cables=routed, gravity=gravity)
    )


def routed_arms(shapes: Strategy[cdsm.Geometry]) -> Strategy[cdsm.Manipulator]:
    """Arms with cables from anywhere to anywhere, most beside those of their geometry."""
    return _present(_routed_arms(shapes))


def _antagonists(
    kind: str,
    parent: str,
    child: str,
    place: str,
    turn: str,
    axis: tuple[float, ...],
    law: cdsm.Elasticity,
) -> Iterator[cdsm.Cable]:
    """Two cables across one joint of a URDF, which pull it one way and the other."""
    origin = np.array(place.split(), dtype=np.float64)
    turned = Rotation.from_euler("xyz", np.array(turn.split(), dtype=np.float64))
    along = np.array(axis) / math.hypot(*axis)
    across = np.cross(along, np.eye(3)[abs(along).argmin()])
    across /= np.linalg.norm(across)
    way = 0.2 * along if kind == "prismatic" else 0.1 * np.cross(along, across)
    for name, sign in (("forth", 1.0), ("back", -1.0)):
        start, end = origin + turned.apply(0.1 * across + sign * way), 0.1 * across
        sites = (cdsm.Site(parent, tuple(start.tolist())), cdsm.Site(child, tuple(end.tolist())))
        yield cdsm.Cable(name=f"{child} {name}", sites=sites, elasticity=law)


@st.composite
def _trees(draw: st.DrawFn) -> cdsm.Manipulator | None:
    count = draw(st.integers(1, 8))
    triple = st.tuples(*[st.floats(-0.3, 0.3)] * 3)
    parts, pairs = [link_element("l0")], []
    kinds = draw(
        st.lists(
            st.sampled_from(["revolute", "revolute", "prismatic", "fixed"]),
            min_size=count,
            max_size=count,
        ).filter(lambda kinds: set(kinds) != {"fixed"})
    )
    for i, kind in enumerate(kinds, start=1):
        parent = draw(st.integers(0, i - 1))
        place, turn = (" ".join(map(repr, draw(triple))) for _ in "xr")
        direction = draw(hinges)[0]
        axis = " ".join(map(repr, direction))
        parts += [
            link_element(f"l{i}", draw(PLAUSIBLE.mass)),
            joint_element(f"j{i}", kind, f"l{parent}", f"l{i}", place, turn, axis),
        ]
        if kind != "fixed":
            pairs.append((kind, f"l{parent}", f"l{i}", place, turn, direction))
    links = tuple(f"l{i}" for i in range(count + 1))
    routed, tip, gravity = (
        draw(cables(links, size=0.2)),
        draw(st.sampled_from(links)),
        draw(gravities),
    )
    if draw(st.sampled_from([True, True, True, False])):  # most can be balanced then
        law = draw(elasticities())
        routed += tuple(cable for pair in pairs for cable in _antagonists(*pair, law))
    urdf = f'<robot name="tree">{"".join(parts)}</robot>'
    return _unless_sites_coincide(
        lambda: cdsm.Manipulator.from_urdf(urdf, routed, tip=tip, gravity=gravity)
    )


def trees() -> Strategy[cdsm.Manipulator]:
    """Robots from a URDF: branches, slides, fixed links, masses anywhere."""
    return _present(_trees())


ARMS: dict[str, Strategy[cdsm.Manipulator]] = {
    "uniform": serpentine_arms(uniform_geometries(PLAUSIBLE)),
    "mixed": serpentine_arms(mixed_geometries(PLAUSIBLE)),
    "extreme": serpentine_arms(uniform_geometries(EXTREME) | mixed_geometries(EXTREME)),
    "routed": routed_arms(geometries(5)),
    "trees": trees(),
}
"""Kinds of arms by name."""


# --- what is asked of them ------------------------------------------------------------------


@st.composite
def angles(draw: st.DrawFn, arm: cdsm.Manipulator) -> Array:
    """Joint angles within the limits: straight, at the limits, or anywhere (nv,) [rad]."""
    part = st.floats(0.0, 1.0)
    kind = draw(st.sampled_from(["straight", "corner", "even", "any", "any", "any"]))
    if kind == "straight":
        return np.asarray(np.clip(np.zeros(arm.nv), arm.lower, arm.upper))
    if kind == "corner":
        part = st.sampled_from([0.0, 0.5, 1.0])
    count = 1 if kind == "even" else arm.nv
    shares = draw(st.lists(part, min_size=count, max_size=count)) * (arm.nv // count)
    q = arm.lower + np.array(shares) * (arm.upper - arm.lower)
    return np.asarray(np.clip(q, arm.lower, arm.upper))


@st.composite
def wrenches(draw: st.DrawFn) -> Array:
    """Nothing, a weight, or any force and moment (6,)."""
    kind = draw(st.sampled_from(["none", "none", "none", "weight", "any", "any", "huge"]))
    if kind == "none":
        return np.zeros(6)
    if kind == "weight":
        return np.array([0.0, 0.0, -draw(decades(1e-3, 1e2)), 0.0, 0.0, 0.0])
    size = draw(decades(1e-3, 10.0)) if kind == "any" else draw(decades(10.0, 1e6))
    parts = draw(st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6))
    return np.asarray(size * np.array(parts) * np.array([1.0, 1.0, 1.0, 0.1, 0.1, 0.1]))


@st.composite
def bounds(draw: st.DrawFn) -> tuple[float, float]:
    """A lower and an upper bound of all tensions [N]."""
    low = draw(st.sampled_from([0.0, 5.0, 50.0]) | decades(1e-3, 1e3))
    return low, low + draw(st.sampled_from([math.inf, math.inf]) | decades(1.0, 1e4))


class Question(NamedTuple):
    """An arm, and what its tensions are to hold.

    Attributes:
        arm: The arm.
        q: Joint angles (nv,) [rad].
        minimum: Lower bounds of the tensions (C,) [N].
        maximum: Upper bounds (C,) [N].
        wrench: W (6,): force [N], then moment [N m].
    """

    arm: cdsm.Manipulator
    q: Array
    minimum: Array
    maximum: Array
    wrench: Array


@st.composite
def questions(draw: st.DrawFn, arms: Strategy[cdsm.Manipulator]) -> Question:
    """Any load and bounds for any arm; most times no more than it can hold, often just so much.

    Gravity and wrench are then a share of what a linear program finds to be the most that the
    cables hold within their bounds and elasticities, if they hold anything.
    """
    arm = draw(arms)
    q, (low, high), W = draw(angles(arm)), draw(bounds()), draw(wrenches())
    count = len(arm.cables)
    as_it_is = Question(arm, q, np.full(count, low), np.full(count, high), W)
    if not draw(st.sampled_from([True, True, True, True, True, False])):
        return as_it_is
    above, share = 1.0 + draw(decades(1e-3, 1.0)), draw(st.sampled_from([0.5, 0.9, 1 - 1e-9, 1.0]))
    own = np.array([(cable.minimum, cable.maximum) for cable in arm.cables])
    laws = [cable.elasticity for cable in arm.cables]
    lows = np.maximum(own[:, 0], [above * law.low for law in laws])
    highs = np.minimum(own[:, 1], [law.high for law in laws])
    highs = np.maximum(lows, highs)
    for nearer in (1.0, 0.3, 0.05):  # what is not balanced when bent may be when almost straight
        angle = np.clip(nearer * q, arm.lower, arm.upper)
        try:
            pose = arm.at(angle)
        except cdsm.CdsmError:
            continue
        unit = max(float(abs(pose.length_jacobian).max()), 1e-12 * arm.length)
        torque = (pose.jacobian.T @ W - pose.gravity_torque) / unit
        size = float(abs(torque).max()) or 1.0
        # J_Lᵀ F = s (J_Xᵀ W − g) for the largest s, which is in units that make it near one
        found = linprog(
            np.append(np.zeros(count), -1.0),
            A_eq=np.column_stack([pose.length_jacobian.T / unit, -torque / size]),
            b_eq=np.zeros(arm.nv),
            bounds=[*zip(lows, highs, strict=True), (0.0, size)],
            method="highs",
        )
        if found.status == 0:
            share *= float(found.x[-1]) / size
            return Question(_lighter(arm, share), angle, lows, highs, share * W)
    return as_it_is


def _lighter(arm: cdsm.Manipulator, share: float) -> cdsm.Manipulator:
    """The same arm under a share of the gravity."""
    gravity = share * arm.gravity
    if arm.is_serpentine:
        return cdsm.Manipulator(arm.geometry, cables=arm.cables, gravity=gravity)
    return cdsm.Manipulator.from_urdf(arm.urdf, arm.cables, tip=arm.tip_link, gravity=gravity)


@st.composite
def tensions(draw: st.DrawFn, arm: cdsm.Manipulator) -> Array:
    """Tensions that balance nothing, each within the domain of its cable (C,) [N]."""
    few = draw(st.lists(st.sampled_from([0.0, 1.0]) | st.floats(0.0, 1.0), min_size=1, max_size=5))
    values = []
    for c, cable in enumerate(arm.cables):
        law, share = cable.elasticity, few[c % len(few)]
        low, most = law.low, min(law.high, 2.0 * law.low + 1e3)
        values.append(min(low + share * (most - low), most))
    return np.array(values)


# --- broken ---------------------------------------------------------------------------------


class Broken(NamedTuple):
    """A value with a fault, by the name of the fault."""

    fault: str
    value: Any


@st.composite
def broken_vectors(draw: st.DrawFn, size: int, huge: bool = True) -> Broken:
    """What is no vector of so many real numbers; without ``huge`` only what is none at all."""
    whole = np.linspace(0.0, 0.1, size)
    at = draw(st.integers(0, size - 1))

    def spoilt(value: float) -> Array:
        array = whole.copy()
        array[at] = value
        return array

    faults: dict[str, Callable[[], Any]] = {
        "nan": lambda: spoilt(math.nan),
        "infinite": lambda: spoilt(draw(st.sampled_from([math.inf, -math.inf]))),
        "too short": lambda: whole[:-1],
        "too long": lambda: np.append(whole, 0.0),
        "a row": lambda: whole[None, :],
        "a column": lambda: whole[:, None],
        "of strings": lambda: [str(x) for x in whole],
        "of bytes": lambda: [b"1"] * size,
        "complex": lambda: whole.astype(complex),
        "of objects": lambda: whole.astype(object),
        "of truths": lambda: [True] * size,
        "ragged": lambda: [[0.0], [0.0, 1.0]],
        "nothing": lambda: None,
        "a text": lambda: draw(st.text(max_size=8)),
        "a dictionary": lambda: {"joint1_1": 0.1},
        "of dates": lambda: np.zeros(size, "M8[s]"),
    }
    if huge:
        faults["huge"] = lambda: spoilt(draw(st.sampled_from([1e16, -1e300, 1.7e308])))
    if size > 1:
        faults["a number"] = lambda: 0.1
    fault = draw(st.sampled_from(sorted(faults)))
    return Broken(fault, faults[fault]())


@st.composite
def foreign_vectors(draw: st.DrawFn, values: Array) -> Broken:
    """The same numbers in a form that is unusual and allowed: other byte order, stride or type."""
    forms: dict[str, Callable[[], Any]] = {
        "big-endian": lambda: values.astype(">f8"),
        "strided": lambda: np.repeat(values, 3)[::3],
        "backwards": lambda: values[::-1].copy()[::-1],
        "read-only": lambda: np.frombuffer(values.tobytes()),
        "a column of a matrix": lambda: np.asfortranarray(np.outer(values, [1.0, 2.0]))[:, 0],
        "longdouble": lambda: values.astype(np.longdouble),
        "a list": values.tolist,
        "a tuple of numpy numbers": lambda: tuple(values),
    }
    form = draw(st.sampled_from(sorted(forms)))
    return Broken(form, forms[form]())


broken_numbers: Strategy[Broken] = st.sampled_from(
    [
        Broken("nan", math.nan),
        Broken("infinite", math.inf),
        Broken("negative", -0.01),
        Broken("huge", 1e300),
        Broken("a text", "0.04"),
        Broken("a list", [0.04]),
        Broken("nothing at all", object()),
        Broken("complex", 1j),
        Broken("true", True),
        Broken("a huge integer", 10**400),
    ]
)
"""What no length, mass or rigidity can be."""


@st.composite
def broken_geometries(draw: st.DrawFn) -> Broken:
    """Keywords of a uniform geometry with one fault among them."""
    keywords: dict[str, Any] = {
        "joints": 3,
        "cables_per_joint": 3,
        "link_length": 0.04,
        "base_length": 0.02,
        "disk_offset": 0.01,
        "hole_radius": 0.03,
        "link_mass": 0.1,
    }
    key = draw(st.sampled_from([*keywords, "no such key", "missing", "overlap"]))
    if key == "missing":
        gone = draw(st.sampled_from(sorted(keywords)))
        return Broken(f"{gone} missing", {k: v for k, v in keywords.items() if k != gone})
    if key == "overlap":
        return Broken("disks overlap", keywords | {"disk_offset": draw(st.floats(0.02, 1e3))})
    broken = draw(broken_numbers)
    return Broken(f"{key} {broken.fault}", keywords | {key: broken.value})


@st.composite
def broken_elasticities(draw: st.DrawFn) -> Broken:
    """A call without arguments that makes no elasticity."""
    # beside a float, numpy makes a number of a truth
    number = draw(broken_numbers.filter(lambda broken: broken.fault != "true"))
    bad = number.value
    calls: dict[str, Callable[[], object]] = {
        "linear": lambda: cdsm.LinearElasticity(bad),
        "wire": lambda: cdsm.LinearElasticity.of_wire(2e11, bad),
        "strand coefficient": lambda: cdsm.StrandElasticity(((1e3, bad),), (), 0.0, -1.0),
        "strand end": lambda: cdsm.StrandElasticity(((1e3,),), (), 0.0, bad),
        "table tension": lambda: cdsm.TabulatedElasticity((0.0, bad), (0.0, -1.0)),
        "table strain": lambda: cdsm.TabulatedElasticity((0.0, 1.0), (0.0, bad)),
        "table of one": lambda: cdsm.TabulatedElasticity((1.0,), (0.0,)),
        "table that falls": lambda: cdsm.TabulatedElasticity((0.0, 1.0, 2.0), (0.0, 2e-3, 1e-3)),
    }
    kind = draw(st.sampled_from(sorted(calls)))
    return Broken(f"{kind}, {number.fault}", calls[kind])


@st.composite
def broken_cables(draw: st.DrawFn) -> Broken:
    """Keywords of a cable with one fault among them."""
    law = cdsm.LinearElasticity(1e4)
    sites = (cdsm.Site("base_disk", (0.0, 0.01, 0.0)), cdsm.Site("link1", (0.01, 0.01, 0.0)))
    keywords: dict[str, Any] = {"name": "c", "sites": sites, "elasticity": law}
    number = draw(broken_numbers.filter(lambda broken: broken.fault != "infinite"))
    faults: dict[str, dict[str, Any]] = {
        "no name": {"name": ""},
        "a number for a name": {"name": 3},
        "one site": {"sites": sites[:1]},
        "sites that are none": {"sites": ("base_disk", "link1")},
        "no elasticity": {"elasticity": 1e4},
        "strange control": {"control": "velocity"},
        f"lead {number.fault}": {"lead": number.value},
        f"spring {number.fault}": {"series_stiffness": number.value},
        "no spring": {"series_stiffness": 0.0},
        f"minimum {number.fault}": {"minimum": number.value},
        f"maximum {number.fault}": {"maximum": number.value},
        "bounds the wrong way round": {"minimum": 5.0, "maximum": 4.0},
    }
    fault = draw(st.sampled_from(sorted(faults)))
    return Broken(fault, keywords | faults[fault])
