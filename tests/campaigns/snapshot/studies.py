"""Jobs: arms at postures, batches, laws of rigidity, files."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tests.campaigns.snapshot.entries import attempt
from tests.campaigns.snapshot.environment import Named, cdsm
from tests.campaigns.snapshot.jobs import JOBS, job
from tests.campaigns.snapshot.models import (
    arms,
    caspr,
    laws,
    tree,
    tree_cables,
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


_add_studies()


@job
def elasticities() -> Named:
    forces = np.array([0.0, 0.5, 2.2, 2.3, 11.0, 31.0, 70.0, 71.0, 300.0, 810.0, 900.0, 1e4])
    for name, law in laws().items():
        yield name, law
        for method in ("rigidity", "rigidity_slope", "strain", "energy", "secant_rigidity"):
            yield f"{name}.{method}", [attempt(getattr(law, method), F) for F in forces]
            inside = forces[(law.low <= forces) & (law.high >= forces)]
            yield f"{name}.{method} together", attempt(getattr(law, method), inside.reshape(-1, 1))
        yield f"{name}.tension", [attempt(law.tension, x) for x in (-1e-3, 0, 1e-4, 2e-3, 9.0)]
        yield f"{name} file", attempt(law.write, f"{name}.toml")
        if Path(f"{name}.toml").exists():
            yield f"{name} text", Path(f"{name}.toml").read_text()
            yield f"{name} read", attempt(cdsm.Elasticity.read, f"{name}.toml")
        sites = (cdsm.Site("base", (0.0, 0.0, 0.1)), cdsm.Site("tip", (0.3, 0.0, 0.1)))
        cable = cdsm.Cable("c", sites, law, 0.1, series_stiffness=2e4)
        for method in ("elongation", "tangent_stiffness", "energy"):
            yield f"{name} cable.{method}", attempt(getattr(cable, method), [20.0, 90.0], 0.4)
        yield f"{name} cable.tension", attempt(cable.tension, [1e-4, 3e-3], 0.4)
    yield "polynomial", cdsm.presets.STRAND_1X19.polynomial(forces)


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
        yield f"{name} wire", attempt(cdsm.Elasticity.read, f"{name}.toml")
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
