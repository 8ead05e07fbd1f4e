"""Every public answer of a tree, written to files and compared bit by bit with another tree's.

Run it in the folder of the tree that is to be looked at, which need not be the one it is kept in::

    python -m tests.campaigns.snapshot write FOLDER           # a minute and a half
    python /path/to/snapshot.py write FOLDER --all            # the paper too, one minute more
    python /path/to/snapshot.py write FOLDER --only plans cli
    python /path/to/snapshot.py compare FOLDER_A FOLDER_B     # exit code 1 if they differ

Every job writes JOB.npz, its arrays, and JOB.json, all else as text. A name tells how a value was
reached, such as ``pose1/least/K.joint``. Only public names are used, so that it runs on trees whose
files have moved; module paths, addresses, folders and times are taken out of texts. An object that
a job meets again is told as ``same as`` the first name, so sharing counts. To add a kind of answer,
yield it with a name from a function decorated with ``@job``.
"""

from __future__ import annotations

import argparse
import contextlib
import copy
import dataclasses
import difflib
import hashlib
import html
import importlib
import inspect
import io
import itertools
import json
import os
import pickle
import re
import runpy
import sys
import tempfile
import time
import types
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

FIXED = {"COLUMNS": "100", "LINES": "40", "NO_COLOR": "1", "TERM": "dumb", "MPLBACKEND": "Agg"}
FIXED |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""The environment in which answers do not depend on the terminal or the number of cores."""

TREE = os.getcwd()
if sys.path[0] != TREE:
    sys.path.insert(0, TREE)
cdsm: Any = importlib.import_module("cdsm") if "compare" not in sys.argv else None

Named = Iterator[tuple[str, Any]]
PLAIN = (bool, int, float, complex, str, bytes, type(None), np.generic)
BRIEF = {"Site", "Domain", "Joint", "Link", "CableRoute"}
"""Kinds whose repr says all."""

# --- values as named texts and arrays -------------------------------------------------------


def clean(text: str) -> str:
    """The text without what depends on where the code and the folders are."""
    text = text.replace(os.getcwd(), "<folder>").replace(TREE, "<tree>")
    text = re.sub(r"\bcdsm(?:\.\w+)*\.(?=[A-Z])", "", text)
    text = re.sub(r"\b(?:__main__|tests\.campaigns\.snapshot)\.", "", text)
    text = re.sub(r" at 0x[0-9a-f]+", " at <address>", text)
    return re.sub(r"\b\d+:\d\d:\d\d\b", "<time>", text)


def attempt(function: Callable[..., Any], *arguments: Any, **keywords: Any) -> Any:
    """What the call returns, or the error it raises."""
    try:
        return function(*arguments, **keywords)
    except Exception as error:
        return error


def attributes(value: Any) -> list[str]:
    """Names of the public data of a value: fields, properties, and what an error carries."""
    kind = type(value)
    computed = (property, cached_property)
    names = {name for name in dir(kind) if isinstance(inspect.getattr_static(kind, name), computed)}
    if dataclasses.is_dataclass(value):
        names |= {field.name for field in dataclasses.fields(value)}
    if isinstance(value, BaseException):
        names |= set(vars(value))
    return sorted(name for name in names if not name.startswith("_"))


class Entries:
    """The answers of a job, taken apart into texts and arrays."""

    def __init__(self) -> None:
        self.texts: dict[str, str] = {}
        self.arrays: dict[str, Any] = {}
        self._seen: dict[int, tuple[Any, str]] = {}

    def add(self, name: str, value: Any, depth: int = 8) -> None:
        """Record a value and, so many levels deep, all that it consists of."""
        if isinstance(value, np.ndarray) and value.dtype != object:
            self._put(self.arrays, name, value)
        elif isinstance(value, str):
            self._put(self.texts, name, clean(value))
        elif isinstance(value, (*PLAIN, Enum)) or depth <= 0:
            self._put(self.texts, name, clean(repr(value)))
        elif isinstance(value, Path):
            self._put(self.texts, name, f"Path {clean(str(value))}")
        elif isinstance(value, Mapping):
            self._put(self.texts, name, f"{type(value).__name__}: {', '.join(map(str, value))}")
            for key, part in value.items():
                self.add(f"{name}[{key}]", part, depth - 1)
        elif isinstance(value, (list, tuple)):
            if all(isinstance(part, PLAIN) for part in value):
                self._put(self.texts, name, clean(repr(value)))
                return
            self._put(self.texts, name, f"{type(value).__name__} of {len(value)}")
            for i, part in enumerate(value):
                self.add(f"{name}[{i}]", part, depth - 1)
        elif hasattr(value, "savefig"):
            self._figure(name, value)
        elif hasattr(value, "data_vars"):
            self._dataset(name, value)
        elif isinstance(value, BaseException) or type(value).__module__.startswith("cdsm"):
            self._object(name, value, depth)
        elif callable(value) or isinstance(value, types.ModuleType):
            self._put(self.texts, name, type(value).__name__)
        else:
            self._put(self.texts, name, clean(repr(value)))

    def _put(self, into: dict[str, Any], name: str, value: Any) -> None:
        assert name not in self.texts, name
        assert name not in self.arrays, name
        into[name] = value

    def _object(self, name: str, value: Any, depth: int) -> None:
        shown = clean(repr(value))
        if type(value).__name__ in BRIEF:
            self._put(self.texts, name, shown)
            return
        if id(value) in self._seen:
            self._put(self.texts, name, f"same as {self._seen[id(value)][1]}")
            return
        self._seen[id(value)] = (value, name)  # kept, so that no other gets its id
        self._put(self.texts, name, type(value).__name__)
        if not isinstance(value, BaseException):
            self._put(self.texts, f"{name} repr", shown)
        printed = attempt(str, value)
        if clean(str(printed)) != shown:
            self.add(f"{name} str", printed, 1)
        if hasattr(value, "_repr_html_"):
            page = attempt(value._repr_html_)
            if page != f"<pre>{html.escape(str(printed))}</pre>":
                self.add(f"{name} html", page, 1)
        for each in attributes(value):
            self.add(f"{name}.{each}", attempt(getattr, value, each), depth - 1)

    def _figure(self, name: str, figure: Any) -> None:
        """The pixels as a digest, and what was drawn, to see where another digest comes from."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        canvas: Any = FigureCanvasAgg(figure)
        canvas.draw()
        digest = hashlib.sha256(bytes(canvas.buffer_rgba())).hexdigest()
        self._put(self.texts, name, f"figure {canvas.get_width_height()} {digest}")
        for i, axes in enumerate(figure.axes):
            words = [axes.get_title(), axes.get_xlabel(), axes.get_ylabel()]
            words += [text.get_text() for text in axes.texts]
            self._put(self.texts, f"{name} words {i}", clean(" | ".join(words)))
            for j, line in enumerate(axes.lines):
                drawn = line.get_data_3d() if hasattr(line, "get_data_3d") else line.get_xydata()
                self._put(self.arrays, f"{name} line {i}.{j}", np.array(drawn, dtype=float))

    def _dataset(self, name: str, dataset: Any) -> None:
        self._put(self.texts, name, clean(f"{dict(dataset.sizes)} {list(dataset.variables)}"))
        self.add(f"{name} attributes", dict(dataset.attrs), 2)
        for each, variable in dataset.variables.items():
            values = np.asarray(variable.values)
            self.add(f"{name}.{each}", values if values.dtype != object else values.tolist())
            self.add(f"{name}.{each} attributes", [variable.dims, dict(variable.attrs)], 3)


# --- the jobs -------------------------------------------------------------------------------

JOBS: dict[str, Callable[[], Named]] = {}
SLOW: set[str] = set()


def job(function: Callable[[], Named]) -> Callable[[], Named]:
    """Take a function, which runs in an empty folder, into the list of jobs."""
    JOBS[function.__name__] = function
    return function


def slow(function: Callable[[], Named]) -> Callable[[], Named]:
    """A job that only runs with ``--all``."""
    SLOW.add(function.__name__)
    return job(function)


if cdsm:

    @dataclasses.dataclass(frozen=True)
    class Own(cdsm.Elasticity):  # type: ignore[misc]
        """A law of the user's own: EA = a + b F."""

        a: float = 2e4
        b: float = 50.0

        @property
        def domain(self) -> Any:
            return cdsm.Domain(0.0, 2000.0)

        def rigidity(self, tension: Any) -> Any:
            return self.a + self.b * self.domain.check(tension)

        def strain(self, tension: Any) -> Any:
            return np.log1p(self.b / self.a * self.domain.check(tension)) / self.b

        def energy(self, tension: Any) -> Any:
            values = self.domain.check(tension)
            return (values - self.a * self.strain(values)) / self.b


def laws() -> dict[str, Any]:
    forces = (0.0, 5.0, 20.0, 60.0, 150.0, 400.0, 900.0)
    return {
        "linear": cdsm.LinearElasticity(48e3),
        "wire": cdsm.LinearElasticity.of_wire(200e9, 1.2e-3),
        "strand": cdsm.presets.STRAND_1X19,
        "kink": cdsm.StrandElasticity(
            ((2e4, 30.0), (22100.0,)), joins=(70.0,), low=0.0, high=900.0
        ),
        "table": cdsm.TabulatedElasticity(forces, tuple(F**0.8 / 2e4 for F in forces)),
        "own": Own(),
    }


def sizes(seed: int, joints: int) -> dict[str, Any]:
    rng = np.random.default_rng([seed, joints])
    offset = rng.uniform(0.006, 0.012)
    return {
        "joints": joints,
        "link_length": rng.uniform(0.03, 0.08),
        "base_length": rng.uniform(0.0, 0.05),
        "disk_offset": offset,
        "hole_radius": rng.uniform(1.5, 4.0) * offset,
        "link_mass": rng.uniform(0.02, 0.5),
        "lead": rng.uniform(0.0, 0.5) if seed % 2 else 0.0,
        "name": f"arm{seed}_{joints}",
    }


def mixed() -> Any:
    """Hinges and universal joints, unequal links, cables that end early."""
    axes = (((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), ((0.1, 1.0, 0.3),), ((0.0, 0.3, 1.0), (0, 1, 0.2)))
    holes = ((1, (0.1, 2.3, 4.0)), (2, (0.9, 4.1)), (3, (0.4, 2.0, 3.3, 5.5)))
    limits = zip(axes, (0.008, 0.006, 0.01), (None, 0.5, 0.4), strict=True)
    return cdsm.Geometry(
        name="mixed",
        base_length=0.03,
        hole_radius=0.02,
        joints=tuple(cdsm.Joint(axes=a, disk_offset=h, limit=limit) for a, h, limit in limits),
        links=tuple(cdsm.Link(length=a, mass=m) for a, m in ((0.05, 0.2), (0.03, 0), (0.06, 0.35))),
        cables=tuple(
            cdsm.CableRoute(joint=k, angle=angle, lead=0.1 * (k % 2))
            for k, angles in holes
            for angle in angles
        ),
    )


def tree(name: str = "crab") -> str:
    """A URDF with branches and slides."""
    inside = (
        '<inertial><origin xyz="0.02 0.01 -0.02" rpy="0.3 0.2 0.1"/><mass value="{}"/><inertia '
        'ixx="2e-3" iyy="3e-3" izz="4e-3" ixy="1e-4" ixz="2e-4" iyz="-3e-4"/></inertial>'
    )
    limit = '<limit lower="-0.9" upper="1.1" effort="1" velocity="1"/>'
    masses = {"trunk": 0.8, "slider": 0.4, "arm": 0.3, "hand": 0.2, "tail": 0.5, "fin": 0.1}
    rows = (
        ("a", "revolute", "floor", "trunk", "0.1 0 0.2", "0.1 0 0.3", "0 1 0"),
        ("b", "prismatic", "trunk", "slider", "0.2 0.05 0", "0 0.2 0", "1 0.5 0"),
        ("c", "revolute", "slider", "arm", "0.15 0 0", "0 0 0.4", "0 0.6 0.8"),
        ("d", "prismatic", "arm", "hand", "0.1 0 0", "0.2 0 0", "0 0 1"),
        ("e", "revolute", "trunk", "tail", "-0.1 0 0.1", "0 0.5 0", "1 0 1"),
        ("f", "prismatic", "tail", "fin", "-0.1 0.1 0", "0 0 0", "0 1 0"),
        ("g", "fixed", "hand", "tip", "0.08 0 0.02", "0 0.3 0", "1 0 0"),
    )
    links = [f'<link name="{n}">{inside.format(m)}</link>' for n, m in masses.items()]
    joints = [
        f'<joint name="{n}" type="{kind}"><parent link="{p}"/><child link="{c}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>{"" if n == "g" else limit}</joint>'
        for n, kind, p, c, xyz, rpy, axis in rows
    ]
    parts = ['<link name="floor"/>', *links, '<link name="tip"/>', *joints]
    return f'<robot name="{name}">{"".join(parts)}</robot>'


def tree_cables(law: Any) -> tuple[Any, ...]:
    """Cables along and across the branches, some over several links."""
    ways = "floor trunk,floor slider arm tip,tail hand,fin trunk arm,floor tail fin,trunk hand"
    ways = ",".join([ways, "fin tip,floor fin,slider arm hand,tip floor,hand floor,floor arm"] * 3)
    rng = np.random.default_rng(3)
    return tuple(
        cdsm.Cable(
            name=f"c{i}",
            sites=tuple(cdsm.Site(link, tuple(rng.uniform(-0.6, 0.6, 3))) for link in way.split()),
            elasticity=law,
            lead=0.1 * (i % 3),
            series_stiffness=4e4 if i % 4 == 1 else np.inf,
            control="force" if i == 7 else "position",
        )
        for i, way in enumerate(ways.split(","))
    )


def caspr(kinds: tuple[str, ...]) -> Path:
    """A folder with a CASPR model of a chain of links, in the current folder."""
    folder = Path("_".join(kinds))
    folder.mkdir(exist_ok=True)
    counts = {"R": 1, "U": 2, "S": 3, "P": 1, "PLANAR": 3, "SPATIAL": 6, "T": 3}
    links = cables = ""
    for number, kind in enumerate(kinds, start=1):
        count = counts[kind.split("_")[0]]
        low, high = " ".join(["-0.5"] * count), " ".join(["0.6"] * count)
        links += (
            f'<link_rigid num="{number}" name="part {number}"><joint type="{kind}" '
            f'q_initial="0" q_min="{low}" q_max="{high}"/><physical><mass>0.3</mass>'
            "<com_location>0.01 0.05 -0.02</com_location><end_location>0 0.12 0</end_location>"
            '<inertia ref="com"><Ixx>0.003</Ixx><Iyy>0.002</Iyy><Izz>0.004</Izz><Ixy>0.0001</Ixy>'
            f"<Ixz>0</Ixz><Iyz>0</Iyz></inertia></physical><parent><num>{number - 1}</num>"
            "<location>0.01 0.1 0.03</location></parent></link_rigid>"
        )
    rng = np.random.default_rng(len(kinds))
    for i in range(30):
        sites = "".join(
            f"<attachment><link>{link}</link><location>{x:.3f} {y:.3f} {z:.3f}</location>"
            "</attachment>"
            for link in range(1 + len(kinds))
            for x, y, z in [rng.uniform(-0.6, 0.6, 3)]
        )
        cables += (
            f'<cable_ideal name="c{i}" attachment_reference="{"joint" if i % 2 else "com"}">'
            "<properties><force_min>1</force_min><force_max>900</force_max></properties>"
            f"<attachments>{sites}</attachments></cable_ideal>"
        )
    (folder / "toy_bodies.xml").write_text(f"<bodies_system><links>{links}</links></bodies_system>")
    sets = f'<cable_set id="all">{cables}</cable_set><cable_set id="none"></cable_set>'
    (folder / "toy_cables.xml").write_text(f'<cables default_cable_set="all">{sets}</cables>')
    return folder


def probe(joints: int = 2, law: str = "linear", seed: int = 1, **options: Any) -> Any:
    """A universal arm of random dimensions."""
    geometry = cdsm.Geometry.universal(cables_per_joint=3 + seed % 2, **sizes(seed, joints))
    gravity = np.random.default_rng(seed).normal(0.0, 6.0, 3)
    return cdsm.Manipulator(geometry, laws()[law], gravity=gravity, **options)


def arms() -> dict[str, Callable[[], Any]]:
    """How to make an arm of every kind."""
    presets, linear, order = cdsm.presets, laws()["linear"], list(laws())
    made: dict[str, Callable[[], Any]] = {
        "virtual": presets.virtual_prototype,
        "virtual_stretched": lambda: presets.virtual_prototype(
            laws()["linear"], lead=0.3, link_mass=0.2, original_length="stretched"
        ),
        "experimental": presets.experimental_prototype,
        "experimental_springs": lambda: presets.experimental_prototype(
            laws()["table"], series_stiffness=3e4, hole_radius=0.025, tool_length=0.15
        ),
        "mixed": lambda: cdsm.Manipulator(mixed(), laws()["wire"], gravity=(1.0, -3.0, -9.0)),
        "crab": lambda: cdsm.Manipulator.from_urdf(tree(), tree_cables(linear), tip="tip"),
        "crab_stretched": lambda: cdsm.Manipulator.from_urdf(
            tree(),
            tree_cables(laws()["table"]),
            tip="tip",
            joint_names=list("fedcba"),
            original_length="stretched",
        ),
        "reread": lambda: cdsm.Manipulator.from_urdf(
            cdsm.to_urdf(mixed()), cdsm.serpentine_cables(mixed(), linear), tip="tool0"
        ),
    }
    for kinds in (("R_Z", "U_XY"), ("S_FIXED_XYZ",), ("PLANAR_XZ", "P_X"), ("SPATIAL_EULER_XYZ",)):
        made["_".join(("caspr", *kinds))] = lambda kinds=kinds: cdsm.read_caspr(  # type: ignore[misc]
            caspr(kinds), elasticity=linear
        )
    for n in range(1, 7):
        law = order[n - 1]
        made[f"universal{n}"] = lambda n=n, law=law: probe(n, law, seed=n)  # type: ignore[misc]
        made[f"hinged{n}"] = lambda n=n, law=law: hinged(n, law)  # type: ignore[misc]
    return made


def hinged(joints: int, law: str) -> Any:
    """Hinges, cables with springs, one of them force-controlled."""
    twist = np.random.default_rng(joints).uniform(-1.5, 1.5)
    geometry = cdsm.Geometry.hinged(twist=twist, **sizes(joints, joints))
    first, *others = cdsm.serpentine_cables(geometry, laws()[law], series_stiffness=5e4)
    return cdsm.Manipulator(
        geometry,
        cables=[dataclasses.replace(first, control="force"), *others],
        original_length="stretched" if joints % 2 else "unstrained",
    )


def study(arm: Any, seed: int) -> Named:
    """All that can be asked of an arm at some postures."""
    rng = np.random.default_rng(seed)
    yield "arm", arm
    middle, half = (arm.lower + arm.upper) / 2.0, (arm.upper - arm.lower) / 2.0
    weight = np.array([0.3, 0.2, -1.0, 0.01, -0.02, 0.01])
    count = len(arm.cables)
    for i, reach in enumerate((0.0, 0.3, 0.6)):
        q = middle + reach * half * rng.uniform(-1.0, 1.0, arm.nv)
        pose = arm.at(q)
        yield f"pose{i}", pose
        links = sorted({site.link for cable in arm.cables for site in cable.sites})
        yield f"pose{i} links", [pose.link_pose(link) for link in links]
        pulls = {
            "least": attempt(cdsm.distribute_tension, pose, 30.0),
            "wrench": attempt(cdsm.distribute_tension, pose, 20.0, 800.0, weight),
            "vector": attempt(cdsm.distribute_tension, pose, rng.uniform(10.0, 60.0, count)),
            "narrow": attempt(cdsm.distribute_tension, pose, 30.0, 30.5, 5.0 * weight),
            "fixed": attempt(
                cdsm.distribute_tension, pose, 25.0, fixed={arm.cables[0].name: 40.0 + i}
            ),
            "osqp": attempt(cdsm.distribute_tension, pose, 30.0, solver="osqp"),
            "bare": rng.uniform(20.0, 120.0, count),
        }
        for name, pull in pulls.items():
            yield f"pose{i}/{name}", pull
            if isinstance(pull, Exception):
                continue
            given = (pose, pull, weight) if name == "bare" else (pose, pull)
            K = attempt(cdsm.stiffness, *given)
            yield f"pose{i}/{name}/K", K
            if isinstance(K, Exception):
                continue
            for u in (*np.eye(3), rng.normal(size=3)):
                told = ",".join(f"{x:.2g}" for x in u)
                yield f"pose{i}/{name}/K.along({told})", attempt(K.along, u)
                yield f"pose{i}/{name}/K.shares({told})", attempt(K.shares, u)
            for term in ("active", "passive", "gravity", "load", "joint"):
                yield f"pose{i}/{name}/K.pseudoinverse({term})", attempt(K.pseudoinverse, term)
            if name in ("least", "bare"):
                yield f"pose{i}/{name}/modes", attempt(cdsm.modes, pose, K)
                yield f"pose{i}/{name}/gradient", attempt(cdsm.stiffness_gradient, K)
                load = None if name == "least" else weight
                yield f"pose{i}/{name}/rest", attempt(cdsm.equilibrium, pose, pull, load)
            if name == "wrench":
                report = attempt(K.report)
                yield f"pose{i}/{name}/report", report
                yield f"pose{i}/{name}/report.to_dict", report.to_dict()
                yield f"pose{i}/{name}/report.to_html", report.to_html()
                yield f"pose{i}/{name}/mjcf", attempt(cdsm.to_mjcf, arm, pose, pull, damping=0.1)
                force = (0.0, 0.3, -1.0)
                yield f"pose{i}/weigh", attempt(cdsm.weight_test, pose, pull, force, steps=3)
                moved = pose.tip[:3, 3] + 1e-3 * rng.normal(size=3)
                yield f"pose{i}/inverse", attempt(cdsm.inverse_kinematics, arm, moved, q)
                lengths = pose.cable_lengths
                yield f"pose{i}/angles", attempt(cdsm.solve_joint_angles, arm, lengths, q + 0.01)
    yield "critical_tension", attempt(cdsm.critical_tension, pose)
    yield "critical_load", attempt(cdsm.critical_load, pose, 10.0 * weight, 30.0, 800.0)
    yield "saturation", attempt(cdsm.saturation, pose, (0.2, 0.3, 1.0), 30.0, 400.0)
    yield from rows(arm, rng)


def rows(arm: Any, rng: Any) -> Named:
    """The same by hundreds: beyond limits, infeasible, outside the law, with all columns."""
    names = attempt(cdsm.evaluate, arm, np.zeros((1, arm.nv)), outputs=("?",)).known
    middle, half = (arm.lower + arm.upper) / 2.0, (arm.upper - arm.lower) / 2.0
    q = middle + half * rng.uniform(-1.05, 1.05, (200, arm.nv)) * rng.uniform(0, 1, (200, 1))
    wrench = rng.normal(0.0, 2.0, (200, 6)) * [1.0, 1.0, 1.0, 0.05, 0.05, 0.05]
    minimum = rng.choice([0.0, 1.0, 20.0, 50.0], (200, 1)) * np.ones(len(arm.cables))
    pulls = attempt(cdsm.distribute_tensions, arm, q, minimum, 400.0, wrench)
    yield "rows/pulls", pulls
    u = rng.normal(size=(2, 3))
    yield "rows/batch", attempt(cdsm.evaluate, arm, q, pulls, None, names, direction=u)
    bare = rng.uniform(-5.0, 300.0, (200, len(arm.cables)))
    yield "rows/bare", attempt(cdsm.evaluate, arm, q, bare, wrench, names, direction=u)
    yield (
        "rows/bare_positive",
        attempt(cdsm.evaluate, arm, q, abs(bare), wrench, names, direction=u, check_limits=False),
    )
    yield "rows/direct", attempt(cdsm.evaluate, arm, q, minimum=10.0, maximum=500.0, threads=1)
    yield "rows/pose", attempt(cdsm.evaluate, arm, q, outputs=("tip", "jacobian", "cable_lengths"))


def _add_studies() -> None:
    for number, (name, make) in enumerate(arms().items()):

        def run(make: Callable[[], Any] = make, number: int = number) -> Named:
            return study(make(), number)

        JOBS[f"arm_{name}"] = run


if cdsm:
    _add_studies()


@job
def elasticities() -> Named:
    forces = np.array([0.0, 0.5, 2.2, 2.3, 11.0, 31.0, 70.0, 71.0, 300.0, 810.0, 900.0, 1e4])
    for name, law in laws().items():
        yield name, law
        for method in ("rigidity", "rigidity_slope", "strain", "energy", "secant_rigidity"):
            yield f"{name}.{method}", [attempt(getattr(law, method), F) for F in forces]
            inside = forces[[F in law.domain for F in forces]]
            yield f"{name}.{method} together", attempt(getattr(law, method), inside.reshape(-1, 1))
        yield f"{name}.tension", [attempt(law.tension, x) for x in (-1e-3, 0, 1e-4, 2e-3, 9.0)]
        yield f"{name} file", attempt(cdsm.write_elasticity, law, f"{name}.toml")
        if Path(f"{name}.toml").exists():
            yield f"{name} text", Path(f"{name}.toml").read_text()
            yield f"{name} read", attempt(cdsm.read_elasticity, f"{name}.toml")
        sites = (cdsm.Site("base", (0.0, 0.0, 0.1)), cdsm.Site("tip", (0.3, 0.0, 0.1)))
        cable = cdsm.Cable("c", sites, law, 0.1, series_stiffness=2e4)
        for method in ("elongation", "tangent_stiffness", "energy"):
            yield f"{name} cable.{method}", attempt(getattr(cable, method), [20.0, 90.0], 0.4)
        yield f"{name} cable.tension", attempt(cable.tension, [1e-4, 3e-3], 0.4)
    yield "polynomial", cdsm.presets.STRAND_1X19.polynomial(forces)
    yield "in_series", [attempt(cdsm.in_series, *k) for k in ((1e3,), (1e3, np.inf), (), (0.0,))]


@job
def files() -> Named:
    for name, make in arms().items():
        arm = make()
        yield f"{name} cables", attempt(cdsm.write_cables, arm.cables, f"{name}.cables")
        if Path(f"{name}.cables").exists():
            yield f"{name} cables text", Path(f"{name}.cables").read_text()
            yield f"{name} cables read", attempt(cdsm.read_cables, f"{name}.cables")
        yield f"{name} mjcf", attempt(cdsm.to_mjcf, arm)
        yield f"{name} mjcf file", attempt(cdsm.write_mjcf, arm, f"{name}.xml")
        if arm.is_serpentine:
            yield f"{name} geometry", arm.geometry.write(f"{name}.toml")
            yield f"{name} geometry text", Path(f"{name}.toml").read_text()
            yield f"{name} geometry read", cdsm.Geometry.read(f"{name}.toml") == arm.geometry
            yield f"{name} urdf", cdsm.to_urdf(arm.geometry)
            yield f"{name} urdf file", cdsm.write_urdf(arm.geometry, f"{name}.urdf")
    good = cdsm.Geometry.read("universal2.toml").to_toml()
    broken = {
        "empty": "",
        "noise": "a = [",
        "list": "cables = []",
        "short": "[universal]\njoints=2",
        **{f"less{i}": re.sub(r"(?m)^.*$", "", good, count=i) for i in range(5, 12)},
        **{f"odd{i}": good.replace("0.", word, 3) for i, word in enumerate(("-0.", "'x'", "1e9"))},
    }
    for name, text in broken.items():
        Path(f"{name}.toml").write_text(text)
        for reader in (cdsm.Geometry.from_toml, cdsm.Geometry.read):
            given = text if reader is cdsm.Geometry.from_toml else f"{name}.toml"
            yield f"{name} {reader.__name__}", attempt(reader, given)
        yield f"{name} cables", attempt(cdsm.read_cables, f"{name}.toml")
        yield f"{name} wire", attempt(cdsm.read_elasticity, f"{name}.toml")
        yield f"{name} test", attempt(cdsm.read_tensile_csv, f"{name}.toml")
        yield f"{name} sweep", attempt(cdsm.read_sweep, f"{name}.toml")
    cables = tree_cables(laws()["linear"])
    for i, (old, new) in enumerate(
        itertools.product(("revolute", '"trunk"', "0.3", "mass", "link"), ("x", "", "-1"))
    ):
        text = tree().replace(old, new, 2)
        yield f"urdf{i}", attempt(cdsm.Manipulator.from_urdf, text, cables, tip="tip")
    bodies, strings = (caspr(("R_Z", "U_XY")) / f"toy_{kind}.xml" for kind in ("bodies", "cables"))
    wire = laws()["linear"]
    for i, (path, old, new) in enumerate(
        itertools.product((bodies, strings), ("R_Z", "0.1", "num", "ideal", "1<"), ("x", "", "7"))
    ):
        text = path.read_text()
        path.write_text(text.replace(old, new, 2))
        yield f"caspr{i}", attempt(cdsm.read_caspr, bodies, strings, elasticity=wire)
        path.write_text(text)


@job
def plans() -> Named:
    makers = ("universal2", "universal3", "virtual", "hinged3", "mixed", "crab")
    made = {name: arms()[name]() for name in makers}
    for i in range(60):
        rng = np.random.default_rng([i, 5])
        arm = made[makers[i % len(makers)]]
        reach = 0.5 * rng.uniform(-1.0, 1.0, arm.nv)
        pose = arm.at((arm.lower + arm.upper) / 2.0 + reach * (arm.upper - arm.lower) / 2.0)
        u = rng.normal(size=3 if i % 4 else (2, 3))
        low, high = rng.uniform(15.0, 35.0), rng.uniform(200.0, 600.0)
        pull = attempt(cdsm.distribute_tension, pose, rng.uniform(20.0, 120.0))
        if isinstance(pull, Exception):
            yield f"{i} pull", pull
            continue
        K = cdsm.stiffness(pose, pull)
        target = [attempt(K.along, each) for each in np.reshape(u, (-1, 3))]
        wanted = np.array(target) * rng.uniform(0.9, 1.3)
        given: Any = (u, wanted if i % 4 else wanted[0]) if i % 4 == 0 else (u, wanted[0])
        given = (u, wanted) if i % 4 == 0 else given
        if i % 10 == 1:
            given = (None, attempt(lambda K=K: 1.1 * K.cartesian))
        plan = attempt(cdsm.plan_stiffness, pose, *given, low, high, seed=i)
        yield f"{i} plan", plan
        if i % 4 == 1:
            found = attempt(cdsm.stiffness_range, pose, u, low, high, starts=6, seed=i)
            yield f"{i} range", found
        if i % 4 == 2:
            yield f"{i} saturation", attempt(cdsm.saturation, pose, u, low, high)
        if i % 4 == 3:
            yield f"{i} gradient", attempt(cdsm.stiffness_gradient, K)
    arm = made["universal3"]
    q = np.linspace(0.1, 0.25, 5)[:, None] * arm.upper
    K = cdsm.stiffness(arm.at(q[0]), cdsm.distribute_tension(arm.at(q[0]), 40.0))
    target = K.along((0.0, 0.3, 1.0)) * np.array([1.0, 1.05, 1.1, 50.0, 1.15])
    one = ((0.0, 0.3, 1.0), target, 15.0, 500.0)
    tips = [arm.at(each).tip[:3, 3] for each in q]
    keywords: dict[str, dict[str, Any]] = {
        "angles": {"angles": q},
        "rate": {"angles": q, "rate": 5.0},
        "beyond": {"angles": np.vstack([q[:4], 9.0 * q[4:]])},
        "tips": {"tips": tips, "guess": q[0]},
        "both": {"tips": tips, "angles": q},
    }
    for name, options in keywords.items():
        path = attempt(cdsm.plan_path, arm, *one, progress=False, **options)
        yield f"path {name}", path
        if hasattr(path, "write_csv"):
            yield f"path {name} table", path.write_csv(f"{name}.csv").read_text()
    several = (np.eye(3)[1:], [K.along(each) for each in np.eye(3)[1:]], 15.0, 500.0)
    yield "path several", attempt(cdsm.plan_path, arm, *several, angles=q[:3], progress=False)
    cartesian = (None, K.cartesian, 15.0, 500.0)
    yield "path cartesian", attempt(cdsm.plan_path, arm, *cartesian, angles=q[:3], progress=False)


def measured(arm: Any, count: int, force: float = 0.0) -> list[Any]:
    rng, found = np.random.default_rng(count), []
    for i in range(count):
        pose = arm.at(rng.uniform(-0.4, 0.4, arm.nv))
        level, u = rng.uniform(20.0, 120.0), rng.normal(size=3)
        pull = cdsm.distribute_tension(pose, level)
        value = cdsm.stiffness(pose, pull).along(u) * (1.0 + 0.02 * rng.normal())
        held = {"minimum": level} if i % 2 else {"tension": tuple(pull.values)}
        angles, std = tuple(pose.q), 0.02 * value
        one = cdsm.Measurement(value, tuple(u), angles, std=std, force=force, **held)
        found.append(one)
    return found


@job
def identifications() -> Named:
    def model(hole_radius: float = 0.03, drive: float = 4e4, lead: float = 0.3) -> Any:
        law = laws()["linear"]
        return cdsm.presets.experimental_prototype(
            law, series_stiffness=drive, hole_radius=hole_radius, lead=lead
        ).with_cables(
            cdsm.serpentine_cables(
                cdsm.presets.experimental_prototype_geometry(hole_radius=hole_radius, lead=lead),
                law,
                series_stiffness=drive,
            )
        )

    free = {"hole_radius": (0.02, 0.05), "drive": (1e3, 1e6), "lead": (0.05, 1.0)}
    for name, count, names, force in (
        ("one", 5, ("drive",), 0.0),
        ("two", 8, ("hole_radius", "drive"), 0.0),
        ("forced", 4, ("lead",), 2.0),
    ):
        asked = {each: free[each] for each in names}
        found = attempt(cdsm.identify, model, measured(model(0.031, 5e4), count, force), asked)
        yield name, found
        if hasattr(found, "confidence"):
            yield f"{name} confidence", attempt(found.confidence)
            yield f"{name} scaled", attempt(found.confidence, 0.8, scaled=True)
            yield f"{name} plot", attempt(found.plot)
    yield "too few", attempt(cdsm.identify, model, measured(model(), 1), free)
    yield "unknown", attempt(cdsm.identify, model, measured(model(), 2), {"mass": (0.0, 1.0)})
    yield "fails", attempt(cdsm.identify, lambda x: 1 / 0, measured(model(), 2), {"x": (0.0, 1.0)})


def tensile(law: Any, high: float, count: int, noise: float) -> tuple[Any, Any]:
    rng = np.random.default_rng(count)
    force = np.linspace(2.3, high, count)
    shift = 0.5 * (law.strain(force) - law.strain(2.3)) + 1e-6 * rng.normal(size=count)
    return shift, force + noise * rng.normal(size=count)


@job
def tests_of_wires() -> Named:
    for name, law, high, count, noise in (
        ("strand", laws()["strand"], 810.0, 300, 0.3),
        ("linear", laws()["linear"], 400.0, 60, 0.5),
        ("table", laws()["table"], 800.0, 120, 0.2),
        ("few", laws()["own"], 300.0, 12, 0.1),
    ):
        shift, force = tensile(law, high, count, noise)
        for method in ("monotone", "polynomial"):
            fit = attempt(cdsm.fit_tensile_test, shift, force, 0.5, method, samples=40, seed=3)
            yield f"{name} {method}", fit
            if not isinstance(fit, Exception):
                yield f"{name} {method} plot", attempt(fit.plot)
                cdsm.write_elasticity(fit.elasticity, "fit.toml")
                yield f"{name} {method} text", Path("fit.toml").read_text()
        rows = "".join(f"{1e3 * x!r}, {F!r}\n" for x, F in zip(shift.tolist(), force, strict=True))
        Path("test.csv").write_text(
            "# gauge_length = 500 mm\ndisplacement [mm], force [N]\n" + rows
        )
        yield f"{name} csv", attempt(cdsm.read_tensile_csv, "test.csv")
        yield f"{name} csv in", attempt(cdsm.read_tensile_csv, "test.csv", gauge_length=0.1)


@job
def sweeps() -> Named:
    arm, strand = probe(3, "strand", seed=3), probe(3, "linear", seed=3)
    everything = attempt(cdsm.sweep, arm, np.zeros((1, arm.nv)), outputs=("?",)).known
    first, second = arm.joint_names[0], arm.joint_names[-1]
    grid = cdsm.GridPoses({first: [-0.2, 0.1, 2.0], second: np.linspace(-0.2, 0.2, 3)})
    path = cdsm.PathPoses(np.outer([0.0, 0.4, -0.3], arm.upper), 5)
    cases = {
        "minimum": [1.0, 20.0, 60.0],
        "elasticity": {"strand": laws()["strand"], "steel": laws()["linear"], "own": Own()},
        "wrench": {"none": np.zeros(6), "pulled": [1.0, 0.5, -2.0, 0.0, 0.05, 0.1]},
        "outputs": everything,
    }
    asked: dict[str, tuple[Any, Any, dict[str, Any]]] = {
        "grid": (arm, grid, cases),
        "path": (arm, path, {"minimum": 30.0, "direction": (0.0, 1.0, 1.0)}),
        "random": (strand, cdsm.RandomPoses(20, seed=4), {"minimum": 10.0, "maximum": 300.0}),
        "crab": (arms()["crab"](), cdsm.RandomPoses(10), {"outputs": everything}),
        "stored": (strand, grid, {"minimum": [5.0, 50.0], "store": "a.zarr", "chunk": 4}),
        "resumed": (strand, grid, {"minimum": [5.0, 50.0], "store": "a.zarr"}),
        "another": (strand, grid, {"minimum": [5.0, 51.0], "store": "a.zarr"}),
    }
    for name, (each, q, options) in asked.items():
        found = attempt(cdsm.sweep, each, q, progress=False, **options)
        yield name, found
        if isinstance(found, Exception):
            continue
        yield f"{name} csv", attempt(cdsm.write_sweep, found, f"{name}.csv")
        yield f"{name} table", Path(f"{name}.csv").read_text()
        yield f"{name} nc", attempt(cdsm.write_sweep, found, f"{name}.nc")
        yield f"{name} read", attempt(cdsm.read_sweep, f"{name}.nc")
    yield "poses", [grid, path, cdsm.RandomPoses(3)]


def answers() -> dict[str, Any]:
    """One of each kind of result, with what it is made of."""
    arm = probe(3, "linear", seed=3)
    pose = arm.at(0.3 * arm.upper * np.resize([1.0, -0.5, 0.8], arm.nv))
    pull = cdsm.distribute_tension(pose, 20.0, wrench=(1.0, 0.0, -1.0, 0.0, 0.0, 0.01))
    K, u = cdsm.stiffness(pose, pull), (0.0, 0.3, 1.0)
    pulls = cdsm.distribute_tensions(arm, [pose.q, pose.q / 2.0], 10.0)
    target = K.along(u)
    fit = cdsm.fit_tensile_test(*tensile(laws()["linear"], 300.0, 40, 0.2), 0.5, samples=40)
    return {
        "arm": arm,
        "geometry": arm.geometry,
        "cable": arm.cables[0],
        **{f"law {name}": law for name, law in laws().items()},
        "pose": pose,
        "pull": pull,
        "K": K,
        "shares": K.shares(u),
        "report": K.report(),
        "rest": cdsm.equilibrium(pose, pull, pull.wrench),
        "weigh": cdsm.weight_test(pose, pull, (0.0, 0.0, -1.0), steps=2),
        "modes": cdsm.modes(pose, K),
        "angles": cdsm.solve_joint_angles(arm, pose.cable_lengths),
        "inverse": cdsm.inverse_kinematics(arm, pose.tip),
        "gradient": cdsm.stiffness_gradient(K),
        "range": cdsm.stiffness_range(pose, u, 10.0, 200.0, starts=4),
        "plan": cdsm.plan_stiffness(pose, u, target, 10.0, 200.0),
        "path": cdsm.plan_path(
            arm, u, target, 10.0, 200.0, angles=[pose.q, 9.0 * pose.q, pose.q], progress=False
        ),
        "saturation": cdsm.saturation(pose, u, 10.0, 200.0),
        "critical_tension": cdsm.critical_tension(pose),
        "critical_load": cdsm.critical_load(pose, [0.0, 0.0, -1.0, 0.0, 0.0, 0.0], 10.0),
        "pulls": pulls,
        "batch": cdsm.evaluate(arm, pulls.q, pulls, outputs=("tip", "along"), direction=u),
        "fit": fit,
        "sample": cdsm.InfeasibleSample(3, "rate", "too far."),
        "poses": cdsm.RandomPoses(3),
        "status": list(cdsm.Status) + list(cdsm.SweepStatus),
    }


@job
def copies() -> Named:
    """Whether pickled, copied and replaced values are the same, bit by bit."""
    errors = {
        "limits": attempt(answers()["arm"].at, np.full(6, 9.0)),
        "infeasible": attempt(cdsm.distribute_tension, answers()["pose"], 1.0, 1.5),
        "geometry error": attempt(cdsm.Geometry.from_toml, "[universal]"),
        "domain": attempt(laws()["strand"].rigidity, 1.0),
    }
    for name, value in {**answers(), **errors}.items():
        ways: dict[str, Callable[[Any], Any]] = {
            "pickled": lambda x: pickle.loads(pickle.dumps(x)),
            "copied": copy.copy,
            "deeply": copy.deepcopy,
        }
        if dataclasses.is_dataclass(value):
            ways["replaced"] = lambda x: dataclasses.replace(x)
        first = Entries()
        first.add("value", value)
        for way, make in ways.items():
            second = Entries()
            second.add("value", attempt(make, value))
            found = list(differences(first, second))
            yield f"{name} {way}", "the same" if not found else "\n".join(found)[:2000]
        yield f"{name} hash", type(attempt(hash, value)).__name__
        yield f"{name} equal", bool(copy.deepcopy(value) == value)
        if dataclasses.is_dataclass(value):
            field = dataclasses.fields(value)[0].name
            yield f"{name} assigned", attempt(setattr, value, field, None)


@job
def figures() -> Named:
    plots, found = importlib.import_module("cdsm.plots"), answers()
    yield "arm", attempt(plots.plot_arm, found["pose"])
    yield "pulled", attempt(plots.plot_arm, found["pose"], found["pull"], found["K"])
    yield "crab", attempt(plots.plot_arm, arms()["crab"]().at(np.zeros(6)))
    yield "critical", attempt(plots.plot_critical_tension, found["critical_tension"])
    yield "weigh", attempt(plots.plot_weight_test, found["weigh"])
    yield "path", attempt(plots.plot_path_plan, found["path"])
    yield "plan", attempt(plots.plot_stiffness_plan, found["plan"], found["range"])
    dataset = cdsm.sweep(found["arm"], cdsm.RandomPoses(60), minimum=10.0, progress=False)
    for quantity in ("softest", "anisotropy", "along", "nonsense"):
        yield f"map {quantity}", attempt(plots.plot_map, dataset, quantity)
    yield "section", attempt(plots.plot_map, dataset, section=("z", 0.0, 0.02))


# --- wrong arguments ------------------------------------------------------------------------

nan, inf = float("nan"), float("inf")
WRONG: dict[str, Any] = (
    {"nan": nan, "inf": inf, "minus": -1.0, "zero": 0, "one": 1, "half": 0.5, "true": True}
    | {"huge": 1e300, "whole": 10**30, "tiny": 1e-300, "complex": 1 + 2j, "none": None}
    | {"text": "text", "nothing": "", "surrogate": "\ud800", "bytes": b"x", "object": object()}
    | {"empty": (), "nans": [nan, nan, nan], "infs": (inf,) * 3, "zeros": [0.0, 0.0, 0.0]}
    | {"threes": (1.0, -2.0, 3.0), "words": ["a", "b"], "ragged": [[1.0], [2.0, 3.0]]}
    | {"matrix": np.zeros((2, 2)), "long": np.ones(99), "cube": np.ones((2, 3, 4))}
    | {"masked": np.ma.masked_array([1.0, 2.0, 3.0], [False, True, False]), "dict": {"a": 1.0}}
    | {"class": float, "keyed": {"joint1_1": [0.1, nan]}}
)


def calls() -> dict[str, tuple[Callable[..., Any], list[str], dict[str, Any]]]:
    """Everything public that can be called: the function, its arguments, and a valid call.

    That is, whatever needs no other arguments than those that are known here by name.
    """
    found, law = answers(), laws()["linear"]
    arm, pose, K, u = found["arm"], found["pose"], found["K"], (0.0, 0.3, 1.0)
    shift, force = tensile(law, 300.0, 40, 0.2)
    dataset = cdsm.sweep(arm, [pose.q], minimum=10.0, progress=False)
    cdsm.write_sweep(dataset, "sweep.nc")
    lines = "".join(f"{i / 10}, {9 * i}\n" for i in range(20))
    Path("test.csv").write_text("displacement [mm], force [N]\n" + lines)
    one = cdsm.Measurement(K.along(u), u, tuple(pose.q), tuple(K.tension), std=K.along(u) / 50.0)
    known: dict[str, Any] = (
        {"arm": arm, "geometry": arm.geometry, "pose": pose, "stiffness": K, "elasticity": law}
        | {"cables": arm.cables, "tension": found["pull"].values, "direction": u, "q": pose.q}
        | {"target": K.along(u), "wrench": (0, 0, -1.0, 0, 0, 0), "tip": "tool0", "term": "joint"}
        | {"cable_lengths": pose.cable_lengths, "displacement": shift, "force": force}
        | {"gauge_length": 0.5, "path": "written.toml", "text": arm.geometry.to_toml()}
        | {"link": "link1", "position": (0.0, 0.1, 0.0), "low": 0.0, "high": 900.0, "count": 4}
        | {"rigidity": 1e4, "young_modulus": 2e11, "diameter": 1e-3, "free_length": 0.3}
        | {"coefficients": ((2e4, 30.0), (5e4,)), "joins": (70.0,), "waypoints": [pose.q, u + u]}
        | {"tensions": (0.0, 10.0, 50.0), "strains": (0.0, 1e-3, 3e-3), "strain": 1e-3}
        | {"elongation": 1e-4, "axes": ((0.0, 1.0, 0.0),), "length": 0.1, "mass": 0.2, "joint": 1}
        | {"angle": 0.2, "name": "a", "sites": arm.cables[0].sites, "urdf": arm.urdf}
        | {"value": 1e3, "angles": tuple(pose.q), "bodies": caspr(("R_Z", "U_XY")), "twist": 0.3}
        | {"model_of": lambda lead: arm, "measurements": [one] * 2, "free": {"lead": (0.0, 1.0)}}
        | {"dataset": dataset, **sizes(1, 2), "cables_per_joint": 3, "joints": 2}
    )
    bounds = {"minimum": 10.0, "maximum": 200.0}
    few = {**bounds, "starts": 2}
    special: dict[str, dict[str, Any]] = {
        "Geometry": {f: getattr(arm.geometry, f) for f in ("joints", "links", "cables")},
        "Geometry.read": {"path": arm.geometry.write("arm.toml")},
        "GridPoses": {"angles": {"joint1_1": [0.1]}},
        "Manipulator": {"elasticity": law},
        "Measurement": {"std": 20.0, "minimum": 9.0},
        "weight_test": {"force": u},
        "inverse_kinematics": {"target": pose.tip},
        "distribute_tension": bounds,
        "distribute_tensions": {**bounds, "q": [pose.q] * 2},
        "evaluate": {**bounds, "q": [pose.q] * 2},
        "sweep": {**bounds, "q": [pose.q], "outputs": ("along",), "progress": False},
        **dict.fromkeys(("critical_load", "saturation"), bounds),
        **dict.fromkeys(("stiffness_range", "plan_stiffness"), few),
        "plan_path": {**few, "angles": [pose.q] * 2, "progress": False},
        "fit_tensile_test": {"samples": 40},
        "identify": {"start": {"lead": 0.5}},
        "write_sweep": {"path": "again.nc"},
        "read_sweep": {"path": "sweep.nc"},
        "read_cables": {"path": cdsm.write_cables(arm.cables, "cables.toml")},
        "read_elasticity": {"path": cdsm.write_elasticity(law, "wire.toml")},
        "read_tensile_csv": {"path": "test.csv", "gauge_length": 0.5},
    }
    things: dict[str, Any] = {name: getattr(cdsm, name) for name in cdsm.__all__}
    things |= {f"presets.{name}": getattr(cdsm.presets, name) for name in listed(cdsm.presets)}
    for kind in [thing for thing in things.values() if inspect.isclass(thing)]:
        for name in dir(kind):
            if isinstance(inspect.getattr_static(kind, name), classmethod) and name[0] != "_":
                things[f"{kind.__name__}.{name}"] = getattr(kind, name)
    for owner, value in {**found, "domain": law.domain}.items():
        for name in dir(value):
            if name[0] != "_" and inspect.isfunction(inspect.getattr_static(type(value), name, 0)):
                things[f"{owner}.{name}"] = getattr(value, name)
    made = {}
    for label, thing in sorted(things.items()):
        if inspect.isclass(thing) and issubclass(thing, (Exception, Enum)):
            continue
        if inspect.isabstract(thing):  # whose message tells private names
            continue
        signed = attempt(inspect.signature, thing)
        if (
            not callable(thing)
            or isinstance(signed, Exception)
            or label in ("K.report", "fit.plot")
        ):
            continue
        usable = [p for p in signed.parameters.values() if p.kind not in (p.VAR_POSITIONAL, 4)]
        needed = {p.name for p in usable if p.default is p.empty}
        keywords = {**{n: known[n] for n in needed & known.keys()}, **special.get(label, {})}
        if needed <= keywords.keys():
            made[label] = (thing, [p.name for p in usable], keywords)
    return made


@job
def wrong_arguments() -> Named:
    """Each argument in turn replaced by each of the wrong ones."""
    for name, (function, arguments, keywords) in calls().items():
        yield f"{name}()", attempt(function, **keywords)
        yield f"{name}(nothing)", attempt(function)
        yield f"{name}(unknown)", attempt(function, **keywords, unknown_argument=1)
        for argument, (kind, wrong) in itertools.product(arguments, WRONG.items()):
            found = attempt(function, **{**keywords, argument: wrong})
            brief = Entries()
            brief.add("", found, 2 if isinstance(found, Exception) else 1)
            yield f"{name}({argument}={kind})", brief


# --- the command line -----------------------------------------------------------------------

COMMANDS: tuple[str, ...] = ("urdf", "stiffness", "check", "weigh", "buckle", "plan", "sweep")
COMMANDS += ("map", "view", "fit", "export", "reproduce")


def command(*words: Any) -> str:
    """Exit code, output and errors of ``python -m cdsm``, run in this process."""
    streams = [io.TextIOWrapper(io.BytesIO(), encoding="utf-8") for _ in range(2)]
    before = sys.argv
    sys.argv = ["cdsm", *map(str, words)]
    try:
        with contextlib.redirect_stdout(streams[0]), contextlib.redirect_stderr(streams[1]):
            try:
                runpy.run_module("cdsm", run_name="__main__", alter_sys=True)
                code: object = 0
            except SystemExit as left:
                code = left.code or 0
            except Exception as error:
                code = f"{type(error).__name__}: {error}"
    finally:
        sys.argv = before
    told = []
    for stream in streams:
        stream.flush()
        told.append(stream.buffer.getvalue().decode())
    return f"exit code {code}\n--- stdout\n{told[0]}\n--- stderr\n{told[1]}"


@job
def helps() -> Named:
    for name in COMMANDS:
        yield name, command(name, "--help")
    yield "cdsm", command("--help")
    yield "version", command("--version")
    yield "nothing", command()


PROBE = """[universal]
name = "probe"
joints = 3
cables_per_joint = 3
link_length = 0.05
base_length = 0.02
disk_offset = 0.01
hole_radius = 0.02
link_mass = 0.1
"""

RUNS = """
urdf probe.toml -o probe.urdf
urdf probe.toml -o absent/probe.urdf
export probe.toml --angles 5 --mjcf probe.xml --cables-out cables.toml --rigidity 48000
export probe.toml
export probe.toml --mjcf soft.xml --angles 5 --rigidity 1e9 --spring 0.2 --min-tension 60 --json
stiffness probe.toml
stiffness probe.toml --angles 5 --gravity 0,0,0
stiffness probe.toml --angles 10,-5,8,0,3,12 --min-tension 30 --wrench 1,0,-2,0,0.1,0 --json
stiffness probe.urdf --tip tool0 --cables cables.toml --angles 4,3,2,1,2,3
stiffness probe.urdf --cables cables.toml
stiffness crab.urdf --tip tip --cables crab.toml --angles 20
check crab.urdf --tip tip --cables crab.toml --angles 20 --min-tension 20
stiffness R_Z_U_XY --rigidity 20000
stiffness absent.toml
stiffness probe.toml --angles 80
stiffness probe.toml --angles ten
stiffness probe.toml --angles 1,2
stiffness probe.toml --min-tension 1
stiffness probe.toml --solver dapq
stiffness probe.toml --max-tension 10 --wrench 0,0,-90,0,0,0
stiffness probe.toml --wire wire.toml --rigidity 3
stiffness probe.toml --wire wire.toml --angles 6 --spring 20
check probe.toml --angles 8 --min-tension 40 --html report.html
check probe.toml --angles 8 --min-tension 31 --json
weigh probe.toml --angles 8 --force 0,0,-3 --steps 3 --min-tension 30 --figure weigh.png
weigh probe.toml --angles 8 --force 0,0,-3 --min-tension 30 --json
weigh probe.toml --force 0,0,0
buckle probe.toml --angles 5 --rigidity 1e9 --spring 2.5 --min-tension 3 --load -1,0,0,0,0,0
buckle probe.toml --angles 5 --rigidity 1e9 --spring 2.5 --json
buckle probe.toml --min-tension 20
plan probe.toml --angles 8 --direction 0,0,2 --target 45 --min-tension 30 --max-tension 400
plan probe.toml --angles 8 --direction 0,0,2 --target 45 --min-tension 30 --json --out plan.csv
plan probe.toml --direction 0,0,1 --target 9e9
plan probe.toml --path tips.csv --direction 0,0,1 --rate 8 -o path.csv
plan probe.toml --path bad.csv --direction 0,0,1 --target 20
sweep probe.toml --random 20 -o sweep.nc
sweep probe.toml --grid joint1_1=-20:20:3,joint2_1=5 --min-tension 10,40 -o sweep.csv
sweep probe.toml --grid nothing=1:2:3 -o other.nc
map sweep.nc -o map.png --json
map sweep.nc -o map.png --quantity nonsense
fit test.csv --gauge-length 500 -o fitted.toml
fit test.csv --gauge-length 500 --json
fit test.csv --method polynomial
fit bad.csv
view absent.toml
view probe.toml --port nowhere
reproduce --out probe.toml
nonsense
--debug stiffness probe.toml --angles 80
"""


@job
def cli() -> Named:
    Path("probe.toml").write_text(PROBE)
    Path("crab.urdf").write_text(tree())
    Path("tips.csv").write_text(
        "x [mm], y [mm], z [mm], target [N/m]\n160,10,-20,20e3\n160,10,-21,21e3\n"
    )
    Path("bad.csv").write_text("x [mm],y [mm],z [mm]\n1,2,3\n\n1,two,3\n")
    rows = "".join(f"{F / 96.0!r},{float(F)!r}\n" for F in range(2, 400, 7))
    Path("test.csv").write_text("displacement [mm],force [N]\n" + rows)
    cdsm.write_elasticity(laws()["table"], "wire.toml")
    cdsm.write_cables(tree_cables(laws()["linear"]), "crab.toml")
    caspr(("R_Z", "U_XY"))
    given = set(os.listdir())
    for line in RUNS.strip().splitlines():
        yield line, command(*line.split())
    for name in sorted(set(os.listdir()) - given):
        data = Path(name).read_bytes()
        if Path(name).suffix in (".csv", ".toml", ".urdf", ".xml", ".html"):
            yield f"file {name}", data.decode()
        else:  # NetCDF holds its own times
            yield f"file {name}", "NetCDF" if name.endswith(".nc") else digest(data)


def digest(data: bytes) -> str:
    return f"{len(data)} bytes, {hashlib.sha256(data).hexdigest()}"


@slow
def reproduction() -> Named:
    yield "run", command("reproduce", "--out", "out")
    for path in sorted(Path("out").iterdir()):
        if path.suffix == ".json":
            yield path.name, json.loads(path.read_text())
        else:
            yield path.name, path.read_text() if path.suffix == ".md" else digest(path.read_bytes())


@slow
def paper() -> Named:
    module = importlib.import_module("cdsm.paper")
    results = [module.FIGURES[name]() for name in ("fig3", "fig4", "lead", "fig5", "fig6", "fig7")]
    yield "results", results
    for name in ("to_rows", "to_dict", "to_markdown"):
        yield name, attempt(getattr(module, name), results)


# --- names and signatures -------------------------------------------------------------------


def signature(function: Any) -> str:
    """Kinds, names, types and defaults, without modules and without private parameters."""
    found = attempt(inspect.signature, function)
    if isinstance(found, Exception):
        return "no signature"

    def words(kind: Any) -> str:
        text = kind if isinstance(kind, str) else getattr(kind, "__name__", str(kind))
        return re.sub(r"(?:\b[A-Za-z_]\w*\.)+(?=[A-Za-z_])", "", text)

    told = []
    for each in found.parameters.values():
        if each.name.startswith("_"):
            continue
        default = "" if each.default is each.empty else f" = {clean(repr(each.default))}"
        kind = "" if each.annotation is each.empty else f": {words(each.annotation)}"
        told.append(f"{each.kind.description} {each.name}{kind}{default}")
    end = found.return_annotation
    return "\n".join([*told, f"-> {'?' if end is found.empty else words(end)}"])


def listed(module: Any) -> list[str]:
    """Names that a module lists; or its constants, and the functions that it defines."""
    own = [
        name
        for name, value in vars(module).items()
        if name.isupper() or str(getattr(value, "__module__", "")).startswith(module.__name__)
    ]
    return sorted(getattr(module, "__all__", own))


@job
def names() -> Named:
    for path in ("cdsm", "cdsm.plots", "cdsm.paper", "cdsm.presets", "cdsm.planning", "cdsm.batch"):
        module = attempt(importlib.import_module, path)
        yield f"{path} module", module
        if isinstance(module, Exception):
            continue
        yield f"{path} module doc", bool(module.__doc__)
        yield f"{path} names", ", ".join(listed(module))
        for name in listed(module):
            value = getattr(module, name)
            yield from described(f"{path}.{name}", value)
            if not callable(value):
                yield f"{path}.{name} value", value


def described(path: str, value: Any) -> Named:
    """Signature, bases, fields and members of something public."""
    yield path, signature(value) if callable(value) else type(value).__name__
    yield f"{path} doc", bool(getattr(value, "__doc__", None))
    if not inspect.isclass(value):
        return
    yield f"{path} bases", ", ".join(b.__name__ for b in value.__mro__ if b.__name__[0] != "_")
    if dataclasses.is_dataclass(value):
        fields = [field for field in dataclasses.fields(value) if field.name[0] != "_"]
        yield f"{path} fields", "\n".join(f"{f.name} {f.init} {f.kw_only}" for f in fields)
    if issubclass(value, Enum):
        yield f"{path} values", ", ".join(f"{each.name} = {each.value}" for each in value)
    for name in sorted(dir(value)):
        if name[0] == "_" or issubclass(value, int):
            continue
        member = inspect.getattr_static(value, name)
        if isinstance(member, (property, cached_property)):
            function = member.fget if isinstance(member, property) else member.func
            yield f"{path}.{name}", f"property {signature(function)}"
        else:
            member = getattr(value, name)
            yield f"{path}.{name}", signature(member) if callable(member) else "attribute"
        yield f"{path}.{name} doc", bool(inspect.getdoc(getattr(value, name)))


# --- writing and comparing ------------------------------------------------------------------


def run(name: str) -> Entries:
    """Do a job in a folder of its own; what it raises, and what it warns of, are answers too."""
    found, home = Entries(), os.getcwd()
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        os.chdir(folder)
        try:
            for each, value in JOBS[name]():
                if isinstance(value, Entries):
                    found.texts |= {f"{each}{key}": text for key, text in value.texts.items()}
                    found.arrays |= {f"{each}{key}": part for key, part in value.arrays.items()}
                else:
                    found.add(each, value)
        except Exception as error:
            found.add("CRASHED", f"{type(error).__name__}: {error}")
        finally:
            said = {clean(f"{each.category.__name__}: {each.message}") for each in warned}
            os.chdir(home)
    found.add("warnings", "\n".join(sorted(said)))
    return found


def write(folder: Path, chosen: Iterable[str]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    print(f"cdsm in {Path(cdsm.__file__).parent}")
    total = 0
    for name in chosen:
        start = time.perf_counter()
        found = run(name)
        np.savez(folder / f"{name}.npz", **found.arrays)
        text = json.dumps(found.texts, indent=0, ensure_ascii=True)
        (folder / f"{name}.json").write_text(text + "\n")
        count = len(found.texts) + len(found.arrays)
        total += count
        crash = f"  CRASHED: {found.texts['CRASHED']}" if "CRASHED" in found.texts else ""
        print(f"{name:<36}{count:>8}{time.perf_counter() - start:>8.1f} s{crash}", flush=True)
    print(f"{total} entries")


def read(folder: Path, name: str) -> Entries:
    found = Entries()
    found.texts = json.loads((folder / f"{name}.json").read_text())
    with np.load(folder / f"{name}.npz") as arrays:
        found.arrays = dict(arrays)
    return found


def differences(first: Entries, second: Entries) -> Iterator[str]:
    """A line or more for each entry that differs."""
    one, other = ({**each.texts, **each.arrays} for each in (first, second))
    for name in [*one, *(name for name in other if name not in one)]:
        if name not in other or name not in one:
            yield f"{name}: only in the {'first' if name in one else 'second'}"
        elif isinstance(one[name], str) and isinstance(other[name], str):
            if one[name] != other[name]:
                yield f"{name}: {_texts(one[name], other[name])}"
        elif said := _arrays(np.asarray(one[name]), np.asarray(other[name])):
            yield f"{name}: {said}"


def _texts(one: str, other: str) -> str:
    numbers = [
        attempt(float, re.sub(r"^np\.float64\((.*)\)$", r"\1", each)) for each in (one, other)
    ]
    if all(isinstance(number, float) for number in numbers):
        return _arrays(*map(np.asarray, numbers)) or f"{one} became {other}"
    lines = list(difflib.unified_diff(one.splitlines(), other.splitlines(), lineterm="", n=1))[2:]
    more = [f"… {len(lines) - 14} lines more"] if len(lines) > 14 else []
    return "\n    ".join(["text", *(line[:300] for line in lines[:14]), *more])


def _arrays(one: Any, other: Any) -> str:
    """How two arrays differ, or nothing if not in a bit."""
    if one.dtype != other.dtype or one.shape != other.shape:
        return f"{one.dtype} {one.shape} became {other.dtype} {other.shape}"
    if one.tobytes() == other.tobytes():
        return ""
    if one.dtype != np.float64:
        return f"{np.count_nonzero(one != other)} of {one.size} {one.dtype} differ"
    same = (one == other) | (np.isnan(one) & np.isnan(other))
    if same.all():
        return "signs of zeros or NaNs differ"
    a, b = one[~same], other[~same]
    with np.errstate(all="ignore"):
        gap = abs(a - b)
        relative = gap / np.maximum(abs(a), abs(b))
        last = gap / np.spacing(np.maximum(abs(a), abs(b)))
    bits = f"last bits only, {last.max():.0f} units" if last.max() <= 16 else "MORE than last bits"
    return (
        f"{a.size} of {one.size} numbers differ, by up to {gap.max():.3g}, "
        f"relative {relative.max():.3g}: {bits}"
    )


def compare(first: Path, second: Path) -> int:
    """Print what differs, and return how many entries do."""
    jobs = [{path.stem for path in folder.glob("*.json")} for folder in (first, second)]
    count = total = 0
    for name in sorted(jobs[0] ^ jobs[1]):
        print(f"{name}: only in {first if name in jobs[0] else second}")
        count += 1
    for name in sorted(jobs[0] & jobs[1]):
        one, other = read(first, name), read(second, name)
        total += len(one.texts) + len(one.arrays)
        for said in differences(one, other):
            print(f"{name}: {said}")
            count += 1
    print(f"{total} entries compared, {count} differ")
    return count


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.campaigns.snapshot")
    actions = parser.add_subparsers(dest="action", required=True)
    writing = actions.add_parser("write", help="write all answers of the tree in this folder")
    writing.add_argument("folder", type=Path)
    writing.add_argument("--all", action="store_true", help="the slow jobs too")
    writing.add_argument("--only", nargs="+", metavar="JOB", help="only jobs that begin so")
    comparing = actions.add_parser("compare", help="compare what two trees have answered")
    comparing.add_argument("first", type=Path)
    comparing.add_argument("second", type=Path)
    given = parser.parse_args()
    if given.action == "compare":
        raise SystemExit(compare(given.first, given.second) > 0)
    if any(os.environ.get(key) != value for key, value in FIXED.items()):
        os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], {**os.environ, **FIXED})
    chosen = [name for name in JOBS if given.all or name not in SLOW]
    if given.only:
        chosen = [name for name in JOBS if name.startswith(tuple(given.only))]
    write(given.folder.resolve(), chosen)


if __name__ == "__main__":
    main()
