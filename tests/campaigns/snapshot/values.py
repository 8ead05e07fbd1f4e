"""Jobs: copies and figures of every result, and calls with wrong arguments."""

from __future__ import annotations

import copy
import dataclasses
import importlib
import inspect
import itertools
import pickle
from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from tests.campaigns.snapshot.commands import listed
from tests.campaigns.snapshot.comparison import differences
from tests.campaigns.snapshot.entries import Entries, attempt
from tests.campaigns.snapshot.environment import Named, cdsm
from tests.campaigns.snapshot.jobs import job
from tests.campaigns.snapshot.models import (
    arms,
    caspr,
    laws,
    probe,
    sizes,
)
from tests.campaigns.snapshot.problems import tensile


def answers() -> dict[str, Any]:
    """One of each kind of result, with what it is made of."""
    arm = probe(3, "linear", seed=3)
    pose = arm.at(0.3 * arm.upper * np.resize([1.0, -0.5, 0.8], arm.nv))
    pull = cdsm.distribute_tension(pose, 20.0, wrench=(1.0, 0.0, -1.0, 0.0, 0.0, 0.01))
    K, u = cdsm.stiffness(pose, pull), (0.0, 0.3, 1.0)
    pulls = cdsm.distribute_tensions(arm, [pose.q, pose.q / 2.0], 10.0)
    target = K.along(u)
    fit = cdsm.fit_tensile_test(*tensile(laws()["linear"], 300.0, 40, 0.2), 0.5)
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
        | {
            "coefficients": ((2e4, 30.0), (22100.0,)),
            "joins": (70.0,),
            "waypoints": [pose.q, u + u],
        }
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
        "read_tensile_csv": {"path": "test.csv", "gauge_length": 0.5},
    }
    things: dict[str, Any] = {name: getattr(cdsm, name) for name in cdsm.__all__}
    things |= {f"presets.{name}": getattr(cdsm.presets, name) for name in listed(cdsm.presets)}
    for kind in [thing for thing in things.values() if inspect.isclass(thing)]:
        for name in dir(kind):
            if isinstance(inspect.getattr_static(kind, name), classmethod) and name[0] != "_":
                things[f"{kind.__name__}.{name}"] = getattr(kind, name)
    for owner, value in found.items():
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
