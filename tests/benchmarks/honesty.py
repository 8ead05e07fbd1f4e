"""How often wrong answers come back without a flag, from cdsm and from naive ways to compute them.

python -m tests.benchmarks.honesty [--problems 100000] [--seed 0] [--processes 2]

Every question is answered by cdsm one by one and as a batch, and by the naive route of its family,
and judged against the truth of :mod:`tests.benchmarks.exact`.
"""

import argparse
import math
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np
import pinocchio as pin
import qpsolvers
from numpy.polynomial.polynomial import polyval
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

import cdsm
from cdsm.support.values import Array
from tests.benchmarks.exact import EXTENDED, Motion
from tests.benchmarks.questions import FAMILIES, ROWS, Group
from tests.benchmarks.verdicts import (
    AXES,
    Outcome,
    Pull,
    Reading,
    Verdict,
    judge_stiffness,
    judge_tension,
    true_stiffness,
    true_tension,
)

# --- cdsm -----------------------------------------------------------------------------------


def single_tension(group: Group) -> list[Pull]:
    assert group.low is not None
    assert group.high is not None
    pulls = []
    for q, low, high, wrench in zip(group.q, group.low, group.high, group.wrench, strict=True):
        try:
            pull = cdsm.distribute_tension(group.arm.at(q), low, high, wrench)
            pulls.append(Pull(pull.values))
        except cdsm.CdsmError as error:
            pulls.append(Pull(None, isinstance(error, cdsm.InfeasibleTension)))
    return pulls


def batch_tension(group: Group) -> list[Pull]:
    assert group.low is not None
    assert group.high is not None
    found = cdsm.distribute_tensions(
        group.arm, group.q, group.low, group.high, group.wrench, threads=1
    )
    return [
        Pull(F if status == cdsm.Status.OK else None, status == cdsm.Status.INFEASIBLE)
        for F, status in zip(found.values, found.status, strict=True)
    ]


def single_stiffness(group: Group) -> list[Reading]:
    assert group.tension is not None
    return [
        _read(group.arm.at(q), F, W)
        for q, F, W in zip(group.q, group.tension, group.wrench, strict=True)
    ]


def _read(pose: cdsm.Posture, tension: Array, wrench: Array) -> Reading:
    try:
        K = cdsm.stiffness(pose, tension, wrench)
    except cdsm.CdsmError:
        return Reading(flagged=True)
    found = Reading(K.joint, K.is_stable, K.margin)
    try:
        found = found._replace(along=np.array([K.along(u) for u in AXES]), compliance=K.compliance)
        return found._replace(cartesian=K.cartesian)
    except cdsm.SingularStiffness:
        return found._replace(flagged=True)


def batch_stiffness(group: Group) -> list[Reading]:
    outputs = ("joint", "margin", "along", "compliance", "cartesian")
    found = cdsm.evaluate(
        group.arm, group.q, group.tension, group.wrench, outputs, direction=AXES, threads=1
    )
    readings = []
    for status, *row in zip(found.status, *(found[name] for name in outputs), strict=True):
        joint, margin, along, compliance, cartesian = row
        if status not in (cdsm.Status.OK, cdsm.Status.SINGULAR, cdsm.Status.IMMOBILE):
            readings.append(Reading(flagged=True))
            continue
        reading = Reading(joint, bool(margin > 0.0), float(margin), flagged=bool(status))
        if status != cdsm.Status.SINGULAR:
            reading = reading._replace(along=along, compliance=compliance)
        if status == cdsm.Status.OK:
            reading = reading._replace(cartesian=cartesian)
        readings.append(reading)
    return readings


# --- naive routes ---------------------------------------------------------------------------


def osqp_defaults(group: Group) -> list[Pull]:
    """Tensions by qpsolvers and OSQP as they come, in newtons and newton metres."""
    assert group.low is not None
    assert group.high is not None
    pulls = []
    for q, low, high, wrench in zip(group.q, group.low, group.high, group.wrench, strict=True):
        pose = group.arm.at(q)
        with warnings.catch_warnings(action="ignore"):
            F = qpsolvers.solve_qp(
                np.eye(low.size),
                np.zeros(low.size),
                A=pose.length_jacobian.T.copy(),
                b=pose.jacobian.T @ wrench - pose.gravity_torque,
                lb=low,
                ub=high,
                solver="osqp",
            )
        pulls.append(Pull(F))
    return pulls


def unrepaired_hessian(group: Group) -> list[Reading]:
    """The load part by Pinocchio's kinematic Hessian as it is returned."""
    assert group.tension is not None
    model = pin.buildModelFromXML(group.arm.urdf)
    data, tip = model.createData(), model.getFrameId("tool0", pin.FrameType.BODY)
    readings = []
    for q, F, W in zip(group.q, group.tension, group.wrench, strict=True):
        K = cdsm.stiffness(group.arm.at(q), F, W)
        pin.computeJointKinematicHessians(model, data, q)
        pin.updateFramePlacements(model, data)
        hessian = pin.getFrameKinematicHessian(model, data, tip, pin.LOCAL_WORLD_ALIGNED)
        load = -np.einsum("a,aij->ij", W, np.asarray(hessian).reshape(6, len(q), len(q)))
        joint = K.active + K.passive + K.gravity + load
        least = np.linalg.eigvalsh((joint + joint.T) / 2.0)[0]
        readings.append(Reading(joint, bool(least > 0.0), float(least)))
    return readings


def pseudoinverse(group: Group) -> list[Reading]:
    """The stiffness in x, y and z as the diagonal of J⁺ᵀ K J⁺, taken for that of a hung weight."""
    assert group.tension is not None
    readings = []
    for q, F, W in zip(group.q, group.tension, group.wrench, strict=True):
        pose = group.arm.at(q)
        inverse = np.linalg.pinv(pose.jacobian[:3])
        K = cdsm.stiffness(pose, F, W).joint
        readings.append(Reading(along=np.diag(inverse.T @ K @ inverse)))
    return readings


def eq19_as_printed(group: Group) -> list[Reading]:
    """K_θ with the first coefficient of Eq. 19 as it is printed, wherever it is asked for."""
    assert group.tension is not None
    strand = cdsm.presets.STRAND_1X19
    lower, upper = strand.coefficients
    readings = []
    for q, F in zip(group.q, group.tension, strict=True):
        pose = group.arm.at(q)
        active = np.einsum("c,cij->ij", F, pose.length_hessian)
        strain = strand.strain(np.clip(F, strand.low, strand.high))
        EA = np.where(F <= 31.0, polyval(F, (*lower[:-1], -1e-3)), polyval(F, upper))
        springs = EA * (1.0 + strain) / pose.cable_lengths
        passive = (pose.length_jacobian.T * springs) @ pose.length_jacobian
        joint = active + passive + pose.gravity_stiffness
        least = np.linalg.eigvalsh(joint)[0]
        readings.append(Reading(joint, bool(least > 0.0), float(least)))
    return readings


# --- counting -------------------------------------------------------------------------------

TENSION: dict[str, Callable[[Group], list[Pull]]] = {
    "cdsm": single_tension,
    "cdsm, batch": batch_tension,
    "OSQP, defaults": osqp_defaults,
}
STIFFNESS: dict[str, tuple[Callable[[Group], list[Reading]], tuple[str, ...]]] = {
    "cdsm": (single_stiffness, ("singular postures", "edge of buckling", "ends of Eq. 19")),
    "cdsm, batch": (batch_stiffness, ("singular postures", "edge of buckling", "ends of Eq. 19")),
    "unrepaired Hessian": (unrepaired_hessian, ("singular postures", "edge of buckling")),
    "pseudo-inverse as hung weight": (pseudoinverse, ("singular postures", "edge of buckling")),
    "Eq. 19 as printed": (eq19_as_printed, ("ends of Eq. 19",)),
}
OURS = ("cdsm", "cdsm, batch")


class Tally(NamedTuple):
    """What became of the questions, by route and family.

    Attributes:
        counts: How many, by route, family and outcome.
        worst: The largest error among answers, over what is allowed, by route.
        wrong: Wrong answers of cdsm in words.
    """

    counts: Counter[tuple[str, str, Outcome]]
    worst: dict[str, float]
    wrong: list[str]

    def add(self, other: "Tally") -> None:
        self.counts.update(other.counts)
        self.wrong.extend(other.wrong)
        for route, error in other.worst.items():
            self.worst[route] = max(error, self.worst.get(route, 0.0))

    def total(self, route: str, outcome: Outcome | None = None, family: str = "") -> int:
        return sum(
            count
            for (who, where, what), count in self.counts.items()
            if who == route and outcome in (None, what) and family in ("", where)
        )


def ask(family: str, seed: int, number: int) -> Tally:
    """Draw one arm and its questions, let every route answer, and judge."""
    random = np.random.default_rng([seed, number, list(FAMILIES).index(family)])
    with warnings.catch_warnings(action="ignore", category=cdsm.CdsmWarning):  # odd arms are wanted
        group = FAMILIES[family](random)
    motions = [group.exact.at(q) for q in group.q]
    tally = Tally(Counter(), {}, [])
    for route, verdicts in _verdicts(group, motions):
        for row, verdict in enumerate(verdicts):
            tally.counts[route, family, verdict.outcome] += 1
            if math.isfinite(verdict.error):
                tally.worst[route] = max(verdict.error, tally.worst.get(route, 0.0))
            if verdict.outcome is Outcome.WRONG and route in OURS:
                where = f"{family!r}, {seed}, {number}, row {row}"
                tally.wrong.append(f"{route}, {where}: {verdict.what}, {verdict.error:.3g}")
    return tally


def _verdicts(group: Group, motions: list[Motion]) -> Iterator[tuple[str, list[Verdict]]]:
    if group.tension is None:
        proofs = [true_tension(group, motion, row) for row, motion in enumerate(motions)]
        for route, answer in TENSION.items():
            yield (
                route,
                [
                    judge_tension(group, motion, row, *proof, pull)
                    for row, (motion, proof, pull) in enumerate(
                        zip(motions, proofs, answer(group), strict=True)
                    )
                ],
            )
        return
    truths = [true_stiffness(group, motion, row) for row, motion in enumerate(motions)]
    for route, (read, families) in STIFFNESS.items():
        if group.family in families:
            pairs = zip(truths, read(group), strict=True)
            yield route, [judge_stiffness(truth, reading) for truth, reading in pairs]


def _some(family: str, seed: int, numbers: range) -> Tally:
    tally = Tally(Counter(), {}, [])
    for number in numbers:
        tally.add(ask(family, seed, number))
    return tally


def count(problems: int, seed: int, processes: int = 1, progress: Progress | None = None) -> Tally:
    """Ask that many questions, as many of each family."""
    groups = math.ceil(problems / (ROWS * len(FAMILIES)))
    tally = Tally(Counter(), {}, [])
    parts = [
        (family, seed, range(start, min(start + 10, groups)))
        for start in range(0, groups, 10)
        for family in FAMILIES
    ]
    bar = progress.add_task("asking", total=len(parts)) if progress else None
    if processes == 1:
        for part in parts:
            tally.add(_some(*part))
        return tally
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        for done in as_completed([pool.submit(_some, *part) for part in parts]):
            tally.add(done.result())
            if progress and bar is not None:
                progress.advance(bar)
    return tally


def table(tally: Tally) -> Table:
    """One row for each route, and for cdsm one for each family as well."""
    shown = Table("route", "asked", *(each.value for each in Outcome), "worst")
    for route in dict.fromkeys((*TENSION, *STIFFNESS)):
        families = FAMILIES if route in OURS else ()
        for family in ("", *families):
            cells = [tally.total(route, outcome, family) for outcome in (None, *Outcome)]
            worst = "" if family else f"{tally.worst.get(route, 0.0):.2g}"
            shown.add_row(f"  {family}" if family else route, *map(str, cells), worst)
    return shown


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--problems", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--processes", type=int, default=2)
    given = parser.parse_args()
    screen = Console()
    if not EXTENDED:
        raise SystemExit("long double is no longer than double here: there is no truth to be had.")
    with Progress(console=Console(stderr=True)) as progress:
        tally = count(given.problems, given.seed, given.processes, progress)
    for each in tally.wrong[:20]:
        screen.print(each, markup=False)
    screen.print(table(tally))


if __name__ == "__main__":
    main()
