"""Jobs: plans, identification, tensile tests, sweeps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tests.campaigns.snapshot.entries import attempt
from tests.campaigns.snapshot.environment import Named, cdsm
from tests.campaigns.snapshot.jobs import job
from tests.campaigns.snapshot.models import (
    arms,
    laws,
    own,
    probe,
)


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
            fit = attempt(cdsm.fit_tensile_test, shift, force, 0.5, method)
            yield f"{name} {method}", fit
            if not isinstance(fit, Exception):
                yield f"{name} {method} plot", attempt(fit.plot)
                fit.elasticity.write("fit.toml")
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
    known = attempt(cdsm.sweep, arm, np.zeros((1, arm.nv)), outputs=("?",)).known
    of_wires = ("wire_strain", "wire_safety", "wire_life")
    everything = [name for name in known if name not in ("capacity_margin", *of_wires)]
    wire = {"diameter": 1.2e-3, "bend_diameter": 2e-2, "breaking_load": 900.0}
    first, second = arm.joint_names[0], arm.joint_names[-1]
    grid = cdsm.GridPoses({first: [-0.2, 0.1, 2.0], second: np.linspace(-0.2, 0.2, 3)})
    path = cdsm.PathPoses(np.outer([0.0, 0.4, -0.3], arm.upper), 5)
    cases = {
        "minimum": [1.0, 20.0, 60.0],
        "elasticity": {"strand": laws()["strand"], "steel": laws()["linear"], "own": own()},
        "wrench": {"none": np.zeros(6), "pulled": [1.0, 0.5, -2.0, 0.0, 0.05, 0.1]},
        "outputs": everything,
    }
    asked: dict[str, tuple[Any, Any, dict[str, Any]]] = {
        "grid": (arm, grid, cases),
        "path": (arm, path, {"minimum": 30.0, "direction": (0.0, 1.0, 1.0)}),
        "random": (strand, cdsm.RandomPoses(20, seed=4), {"minimum": 10.0, "maximum": 300.0}),
        "bounded": (strand, grid, {"maximum": 300.0, "outputs": ("capacity_margin",)}),
        "wires": (strand, grid, {"minimum": 20.0, "outputs": of_wires, **wire}),
        "worst": (
            strand.with_friction(0.1),
            grid,
            {"minimum": 20.0, "outputs": of_wires, "worst_friction": True, **wire},
        ),
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
