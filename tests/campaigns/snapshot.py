"""Answers of one checkout as arrays, to compare with another's before a chapter is rebuilt.

    PYTHONPATH=FORMER python tests/campaigns/snapshot.py write former.npz
    PYTHONPATH=$PWD   python tests/campaigns/snapshot.py write now.npz
    python tests/campaigns/snapshot.py compare former.npz now.npz

An answer whose name is gone is printed and left out. Each answer has a tolerance, relative to its
largest entry: ``EXACT`` for linear wires, ``LAW`` for strands, ``END`` where an optimiser or a root
finder ends. No tension is between 29.3 and 32.7 N, where the law of the strand bridges its corner.
"""

# answers are asked for before the next is named, so that loop variables need not be bound
# ruff: noqa: B023
from __future__ import annotations

import sys
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

EXACT, LAW, END = 1e-9, 1e-8, 1e-6
ROUNDING = 1e-13  # of joint torques and the like, which may be zero
Asked = Iterator[tuple[str, Callable[[], Any], float]]

WEIGHT = np.array([0.3, 0.2, -1.0, 0.01, -0.02, 0.01])
FORCE = np.array([0.3, 0.2, -1.0, 0.0, 0.0, 0.0])
U = np.array([0.2, 0.3, 1.0])


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
    }


def tree() -> str:
    """A URDF with branches and prismatic joints."""
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
    return f'<robot name="crab">{"".join(parts)}</robot>'


def tree_cables(cdsm: Any) -> list[Any]:
    """Cables along and across the branches; one is force-controlled, some have springs."""
    ways = "floor trunk,floor slider arm tip,tail hand,fin trunk arm,floor tail fin,trunk hand"
    ways = ",".join([ways, "fin tip,floor fin,slider arm hand,tip floor,hand floor,floor arm"] * 3)
    rng = np.random.default_rng(3)
    return [
        cdsm.Cable(
            name=f"c{i}",
            sites=tuple(cdsm.Site(link, tuple(rng.uniform(-0.6, 0.6, 3))) for link in way.split()),
            elasticity=cdsm.LinearElasticity(48e3),
            lead=0.1 * (i % 3),
            series_stiffness=4e4 if i % 4 == 1 else np.inf,
            control="force" if i == 7 else "position",
        )
        for i, way in enumerate(ways.split(","))
    ]


def arms(cdsm: Any) -> dict[str, tuple[Any, float]]:
    """An arm of every kind, and the tolerance of its answers."""
    linear, strand = cdsm.LinearElasticity(48e3), cdsm.presets.STRAND_1X19
    mixed = cdsm.Geometry(
        name="mixed",
        base_length=0.03,
        hole_radius=0.02,
        joints=(
            cdsm.Joint(axes=((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), disk_offset=0.008),
            cdsm.Joint(axes=((0.1, 1.0, 0.3),), disk_offset=0.006, limit=0.5),
            cdsm.Joint(axes=((0.0, 0.3, 1.0), (0.0, 1.0, 0.2)), disk_offset=0.01, limit=0.4),
        ),
        links=tuple(cdsm.Link(length=a, mass=m) for a, m in ((0.05, 0.2), (0.03, 0), (0.06, 0.35))),
        cables=tuple(
            cdsm.CableRoute(joint=k, angle=angle, lead=0.1 * (k % 2))
            for k, angles in ((1, (0.1, 2.3, 4.0)), (2, (0.9, 4.1)), (3, (0.4, 2.0, 3.3, 5.5)))
            for angle in angles
        ),
    )
    made = {
        "virtual": (cdsm.presets.virtual_prototype(), LAW),
        "virtual_stretched": (
            cdsm.presets.virtual_prototype(linear, lead=0.3, original_length="stretched"),
            EXACT,
        ),
        "mixed": (cdsm.Manipulator(mixed, linear, gravity=(1.0, -3.0, -9.0)), EXACT),
        "crab": (cdsm.Manipulator.from_urdf(tree(), tree_cables(cdsm), tip="tip"), EXACT),
        "reread": (
            cdsm.Manipulator.from_urdf(
                cdsm.to_urdf(mixed), cdsm.serpentine_cables(mixed, linear), tip="tool0"
            ),
            EXACT,
        ),
        "friction": (
            cdsm.Manipulator(
                cdsm.Geometry.universal(cables_per_joint=3, **sizes(7, 3)), linear
            ).with_friction(0.1),
            EXACT,
        ),
    }
    for n in (1, 2, 3, 5, 8):
        law = strand if n == 3 else linear
        gravity = np.random.default_rng(n).normal(0.0, 6.0, 3)
        universal = cdsm.Geometry.universal(cables_per_joint=3 + n % 2, **sizes(n, n))
        made[f"universal{n}"] = (
            cdsm.Manipulator(universal, law, gravity=gravity),
            LAW if n == 3 else EXACT,
        )
        hinged = cdsm.Geometry.hinged(twist=0.5 + 0.1 * n, **sizes(n, n))
        cables = cdsm.serpentine_cables(hinged, linear, series_stiffness=5e4)
        made[f"hinged{n}"] = (cdsm.Manipulator(hinged, cables=cables), EXACT)
    return made


def postures(arm: Any) -> Iterator[tuple[str, Any]]:
    rng = np.random.default_rng(arm.nv)
    middle, half = (arm.lower + arm.upper) / 2.0, (arm.upper - arm.lower) / 2.0
    for i, reach in enumerate((0.1, 0.3, 0.6)):
        yield f"pose{i}", arm.at(middle + reach * half * rng.uniform(-1.0, 1.0, arm.nv))


def core(cdsm: Any) -> Asked:
    """Postures, tensions, stiffness."""
    of_pose = ("tip", "jacobian", "cable_lengths", "length_jacobian", "length_hessian")
    of_K = ("active", "passive", "gravity", "load", "joint", "cable_stiffness", "compliance")
    for name, (arm, tolerance) in arms(cdsm).items():
        bare = np.random.default_rng(3).uniform(40.0, 120.0, len(arm.cables))
        for i, pose in postures(arm):
            for each in (*of_pose, "gravity_torque"):
                yield f"{name}/{i}/{each}", lambda: getattr(pose, each), EXACT
            kinds: dict[str, Callable[[], Any]] = {
                "least": lambda: cdsm.stiffness(pose, cdsm.distribute_tension(pose, 40.0)),
                "wrench": lambda: loaded(cdsm, pose),
                "bare": lambda: cdsm.stiffness(pose, bare, wrench=WEIGHT),
            }
            for kind, K in kinds.items():
                where = f"{name}/{i}/{kind}"
                yield f"{where}/tension", lambda: K().tension, EXACT
                for each in (*of_K, "cartesian", "margin"):
                    yield f"{where}/{each}", lambda: getattr(K(), each), tolerance
                yield f"{where}/along", lambda: K().along(U), tolerance
                yield f"{where}/pseudoinverse", lambda: K().pseudoinverse(), tolerance


def loaded(cdsm: Any, pose: Any) -> Any:
    return cdsm.stiffness(pose, cdsm.distribute_tension(pose, 40.0, 900.0, WEIGHT))


def batch(cdsm: Any) -> Asked:
    """Rows within and beyond the limits, feasible and not."""
    columns = ("tip", "joint", "along", "compliance", "margin", "cable_stiffness")
    for name, (arm, tolerance) in arms(cdsm).items():
        rng = np.random.default_rng(5)
        middle, half = (arm.lower + arm.upper) / 2.0, (arm.upper - arm.lower) / 2.0
        q = middle + half * rng.uniform(-1.05, 1.05, (200, arm.nv)) * rng.uniform(0, 1, (200, 1))
        wrench = rng.normal(0.0, 2.0, (200, 6)) * [1.0, 1.0, 1.0, 0.05, 0.05, 0.05]
        pulls = cdsm.distribute_tensions(arm, q, 40.0, 400.0, wrench)
        yield f"{name}/rows/values", lambda: pulls.values, EXACT
        yield f"{name}/rows/status", lambda: np.asarray(pulls.status), EXACT
        rows = cdsm.evaluate(arm, q, pulls, None, columns, direction=U)
        for each in columns:
            yield f"{name}/rows/{each}", lambda: rows[each], tolerance


def laws(cdsm: Any) -> Asked:
    F = np.concatenate([np.linspace(2.21, 29.0, 100), np.linspace(33.0, 810.0, 300)])
    linear, strand = cdsm.LinearElasticity(48e3), cdsm.presets.STRAND_1X19
    for name, law, tolerance in (
        ("linear", linear, EXACT),
        ("strand", strand, LAW),
        ("scaled", strand.scaled(1.3), LAW),
        ("slack", strand.slack_below(), LAW),
    ):
        for each in ("rigidity", "strain", "secant_rigidity"):
            yield f"{name}/{each}", lambda: getattr(law, each)(F), tolerance
        yield f"{name}/energy", lambda: law.energy(F), END
        yield f"{name}/tension", lambda: law.tension(law.strain(F)), LAW
    points, strains = (0.0, 5.0, 20.0, 60.0, 150.0), (0.0, 2e-4, 6e-4, 13e-4, 26e-4)
    table = cdsm.TabulatedElasticity(points, strains)
    yield "table/strain", lambda: table.strain(np.array(points)), LAW


def statics(cdsm: Any) -> Asked:
    for name, (arm, _) in arms(cdsm).items():
        for i, pose in list(postures(arm))[:2]:
            pull = cdsm.distribute_tension(pose, 60.0)
            K = cdsm.stiffness(pose, pull)
            where = f"{name}/{i}"
            yield f"{where}/rest/q", lambda: cdsm.equilibrium(pose, pull, FORCE).pose.q, END
            yield (
                f"{where}/rest/K",
                lambda: cdsm.equilibrium(pose, pull, FORCE).stiffness.joint,
                END,
            )
            yield f"{where}/rest/stable", lambda: cdsm.equilibrium(pose, pull, FORCE).stable, END
            yield f"{where}/modes", lambda: cdsm.modes(pose, K).frequencies, EXACT * 100
            yield f"{where}/mass", lambda: cdsm.modes(pose, K).mass, EXACT
            force = (0.0, 0.3, -1.0)
            yield f"{where}/weigh", lambda: cdsm.weight_test(pose, pull, force).displacement, END
        yield f"{name}/critical_tension", lambda: cdsm.critical_tension(pose).minimum, END
        given = (10.0 * FORCE, 40.0, 800.0)
        yield f"{name}/critical_load", lambda: cdsm.critical_load(pose, *given).factor, END
    arm = arms(cdsm)["friction"][0]
    pose = next(postures(arm))[1]
    pull = cdsm.distribute_tension(pose, 60.0)
    yield "friction/stuck", lambda: cdsm.stuck_stiffness(pose, pull).joint, EXACT
    yield "friction/breakaway", lambda: cdsm.breakaway(pose, pull, U).load, 1e-2
    band = cdsm.rest_band(pose, pull, U)  # it was proved once, and wider than that of first order
    yield "friction/band", lambda: getattr(band, "first_order", band.high), EXACT
    loads = np.array([0.0, 1.0, 2.0, 0.0, -2.0, 0.0])[:, None] * FORCE
    yield "friction/cycle", lambda: cdsm.load_cycle(pose, pull, loads).tip, 5e-3


def effort(plan: Any) -> float:
    return float(plan.tension.values @ plan.tension.values)


def planning(cdsm: Any) -> Asked:
    made = arms(cdsm)
    for name in ("universal2", "universal3", "universal5", "virtual", "hinged3", "mixed"):
        arm = made[name][0]
        for i, pose in list(postures(arm))[:2]:
            K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 60.0))
            bounds = (40.0, 500.0)
            found = cdsm.stiffness_range(pose, U, *bounds)
            yield f"{name}/{i}/low", lambda: found.low, 1e-4
            yield f"{name}/{i}/high", lambda: found.high, 1e-4
            given = (pose, U, 0.5 * (found.low + found.high), *bounds)
            yield f"{name}/{i}/effort", lambda: effort(cdsm.plan_stiffness(*given)), 5e-3
            yield f"{name}/{i}/gradient", lambda: cdsm.stiffness_gradient(K).along(U), LAW * 10
    arm = made["universal5"][0]
    pose = next(postures(arm))[1]
    near, tip = pose.q + 0.02, pose.tip[:3, 3]
    yield "inverse", lambda: cdsm.inverse_kinematics(arm, tip, near).angles, END
    yield "angles", lambda: cdsm.solve_joint_angles(arm, pose.cable_lengths, near).angles, END
    yield "payload", lambda: cdsm.payload(pose, (0.0, 0.0, -1.0), 40.0, 500.0).force, END
    yield "clearance", lambda: cdsm.clearance(pose).cables, 1e-3


def inference(cdsm: Any) -> Asked:
    arm, _ = arms(cdsm)["universal2"]
    pose = next(postures(arm))[1]
    pull = cdsm.distribute_tension(pose, 60.0)
    off = cdsm.Tolerances(
        hole_radius=cdsm.Tolerance(1e-4),
        rigidity=cdsm.Tolerance(0.05),
        tension=cdsm.Tolerance(0.03),
        lead=cdsm.Tolerance(1e-3),
        joint_angle=cdsm.Tolerance(2e-3),
    )
    yield "u", lambda: cdsm.uncertainty(pose, pull, off, direction=U).standard_uncertainty, 1e-3
    yield "u value", lambda: cdsm.uncertainty(pose, pull, off, direction=U).value, EXACT
    F = np.linspace(2.3, 400.0, 120)
    strain = cdsm.LinearElasticity(48e3).strain(F)
    at = np.array([50.0, 200.0, 350.0])
    given = (0.5 * (strain - strain[0]), F, 0.5)
    yield "tensile", lambda: cdsm.fit_tensile_test(*given).elasticity.rigidity(at), 1e-3


CHAPTERS = {f.__name__: f for f in (core, batch, laws, statics, planning, inference)}


def write(path: str, chapters: list[str]) -> None:
    """Write the answers of the ``cdsm`` that Python finds."""
    import cdsm

    print(f"cdsm of {cdsm.__file__}")
    found: dict[str, Any] = {}
    for chapter in chapters or CHAPTERS:
        start, count, refused = time.perf_counter(), len(found), Counter[str]()
        try:
            for name, ask, tolerance in CHAPTERS[chapter](cdsm):
                try:
                    answer = np.asarray(ask(), dtype=float)
                except cdsm.CdsmError as error:
                    answer, tolerance = np.array([np.nan]), 0.0
                    refused[type(error).__name__] += 1
                except (AttributeError, TypeError, ImportError) as error:
                    print(f"  {chapter}/{name} is gone: {error}")
                    continue
                found[f"{chapter}/{name}"] = answer
                found[f"{chapter}/{name} tolerance"] = tolerance
        except Exception:
            traceback.print_exc()
        asked = (len(found) - count) // 2
        seconds = time.perf_counter() - start
        print(f"{chapter}: {asked} answers in {seconds:.0f} s, {dict(refused)}", flush=True)
    np.savez(path, **found)


def compare(former: str, now: str) -> int:
    """Print each answer that differs by more than its tolerance; return how many do."""
    with np.load(former) as a, np.load(now) as b:
        names = [name for name in a.files if not name.endswith(" tolerance")]
        missing = [name for name in names if name not in b]
        wrong = 0
        for name in names:
            if name in missing:
                continue
            x, y, tolerance = a[name], b[name], float(a[f"{name} tolerance"])
            if x.shape != y.shape or not np.array_equal(np.isfinite(x), np.isfinite(y)):
                print(f"{name}: {x.shape} {x.ravel()[:4]} became {y.shape} {y.ravel()[:4]}")
                wrong += 1
                continue
            ok = np.isfinite(x)
            gap, size = abs(x[ok] - y[ok]).max(initial=0.0), abs(x[ok]).max(initial=0.0)
            if gap > tolerance * size + ROUNDING:
                print(f"{name}: off by {gap / size if size else gap:.2g}, allowed {tolerance:.0e}")
                wrong += 1
    print(f"{len(names) - len(missing)} answers compared, {wrong} differ, {len(missing)} are gone")
    return wrong


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    action, *given = sys.argv[1:]
    if action == "write":
        write(given[0], given[1:])
    else:
        raise SystemExit(compare(*given) > 0)
