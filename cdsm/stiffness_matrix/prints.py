"""What is said of a stiffness: the printed table, the notes below it, remedies if it is unstable.

Each remedy multiplies one quantity by a factor s at which the smallest eigenvalue λ of K_θ is 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Final, Literal, final

import numpy as np

from cdsm.errors import CdsmError, SingularStiffness, listed
from cdsm.support.format import MODEL, coordinates, key, rounded, span
from cdsm.support.values import Array
from cdsm.tension import distribute_tension

if TYPE_CHECKING:
    from cdsm.manipulator import Manipulator
    from cdsm.stiffness_matrix.value import Stiffness

_QUANTITIES: Final = {"wire": "EA of wires", "spring": "k_series", "tension": "lower bounds"}
# factors s that are tried, from 1 away, each row up to the first that makes the arm stable
_STIFFER: Final = ((10.0, 100.0, 1000.0),)  # few, since λ rises with s
_MORE_OR_LESS: Final = np.geomspace(1.0, 100.0, 21)[1:], np.geomspace(1.0, 1e-3, 31)[1:]


def readings(K: Stiffness) -> dict[str, object]:
    """Return what the JSON of a stiffness has besides its fields; None for what does not exist."""
    return {
        "tip_position_m": K.posture.tip[:3, 3],
        "cable_length_m": K.posture.cable_lengths,
        **_further_terms(K),
        "model": model_of(K),
        "along_N_per_m": [_existing(partial(K.along, u)) for u in "xyz"],
        "cartesian_N_per_m": _existing(lambda: K.cartesian),
        "pseudoinverse_N_per_m": _existing(K.pseudoinverse),
        "compliance": _existing(lambda: K.compliance),
        "stable": K.is_stable,
        "remedies": {each.change: each.factor for each in K.remedies},
    }


def _further_terms(K: Stiffness) -> dict[str, object]:
    """Return the terms of K_θ that only this arm has."""
    unit = K.posture.arm.stiffness_unit()
    return {key(term.name, unit): K.terms[term.name] for term in K.posture.arm.definition.terms}


def _existing(read: Callable[[], object]) -> object:
    with suppress(SingularStiffness):
        return read()
    return None


def table(K: Stiffness) -> list[str]:
    """Return the lines of the printed table: readings [N/mm] along x, y and z."""
    axes = np.eye(3)
    sprung = K.posture.arm.has_springs
    cables = ("passive", "active")
    terms = [name for name in K.terms if name not in cables and (sprung or name != "springs")]
    parts = (*cables, *terms)
    rows = np.full((3 + len(parts), 3), math.nan)
    for i, u in enumerate(axes):
        with suppress(SingularStiffness):
            rows[0, i] = K.along(u)
            shares = K.shares(u)
            sums = shares.passive.sum(), shares.active.sum(), *shares.others.values()
            rows[1:-2, i] = sums
    mobile = np.isfinite(rows[0])
    with suppress(SingularStiffness):
        if mobile.any():
            rows[-2, mobile] = K.cartesian_in(axes[mobile]).diagonal()
        rows[-1] = K.pseudoinverse().diagonal()
    cells = [["-" if math.isnan(k) else f"{k:.4g}" for k in row] for row in rows / 1e3]
    names = ["along", *(f"  of it {part}" for part in parts), "cartesian, diagonal"]
    names = ["stiffness [N/mm]", *names, "pseudoinverse, diagonal"]
    lines = zip(names, ["xyz", *cells], strict=True)
    return [f"{name:<24}{''.join(f'{cell:>12}' for cell in row)}" for name, row in lines]


def notes(K: Stiffness) -> tuple[str, ...]:
    """Return the lines below the table: why entries are missing, and whether the arm is stable."""
    missing = []
    try:
        _ = K.cartesian
    except SingularStiffness as error:
        missing = ["-: K_θ is singular, the arm is about to buckle"]
        if _existing(lambda: K.compliance) is not None:
            fixed = f"inf, -: the tip cannot move along {axis_of(error.direction)}"
            missing = [f"{fixed}; cartesian: in the plane of other axes"]
    state = "stable" if K.is_stable else "UNSTABLE"
    unit = K.posture.arm.stiffness_unit()
    least = f"{state}, smallest joint stiffness {K.margin:.4g} {unit} ({model_of(K)})"
    return (*missing, *K.posture.remarks, *missing_leads(K), least)


def missing_leads(K: Stiffness) -> tuple[str, ...]:
    """Return a line that names the cables whose spring stretches by more than the whole cable."""
    lost = [K.posture.arm.cables[c].name for c in np.flatnonzero(K.free_lengths <= 0.0)]
    said = f"the series spring stretches by more than the whole cable is long: {listed(lost)}. "
    return (said + "Give a longer lead; without it K is off by up to F/EA.",) if lost else ()


def model_of(K: Stiffness) -> str:
    """Return the assumptions behind the stiffness ``K`` in words, such as locked motors."""
    model = frictionless_model(K.posture.arm)
    if K.friction == "frictionless":
        return model
    mu = K.posture.segments.chains.friction
    said = span(mu, "{:g}".format) if mu.size else "0"
    return model.replace("frictionless", f"cables {K.friction}, μ = {said}")


def frictionless_model(arm: Manipulator) -> str:
    """Return the assumptions behind every stiffness of ``arm`` without friction, in words."""
    bends = arm.is_serpentine and (
        any(link.bending_stiffness for link in arm.geometry.links)
        or any(joint.bending_stiffness for joint in arm.geometry.joints)
    )
    return MODEL.replace("rigid links", "links that bend") if bends else MODEL


def axis_of(u: Array) -> str:
    """Write a direction (3,) as text; of u and −u, the one whose largest entry is positive."""
    return coordinates(np.round(u * np.sign(u[abs(u).argmax()]), 9), "z.3g")


@final
@dataclass(frozen=True)
class Remedy:
    """Change of one quantity of an unstable arm; made by :attr:`Stiffness.remedies`.

    ``change`` is ``"wire"``: EA of all wires; ``"spring"``: all k_series; ``"tension"``: the lower
    bounds. ``factor`` [-] is the one nearest to 1 at which the arm becomes stable, None if none is.
    """

    change: Literal["wire", "spring", "tension"]
    factor: float | None

    def __str__(self) -> str:
        what = _QUANTITIES[self.change]
        s = self.factor
        if s is None:
            return f"no other {what} alone would hold it"
        times = f"{rounded(s, up=s > 1.0)} times as high, or {'more' if s > 1.0 else 'less'}"
        return f"it would hold with {what} {times}"


def verdict(K: Stiffness) -> str:
    """Return a sentence about an unstable arm: which joint buckles most, and the margin."""
    arm = K.posture.arm
    worst = int(abs(K.critical_direction).argmax())
    margin = f"the smallest eigenvalue of K_θ is {K.margin:.4g} {arm.stiffness_unit()}"
    return f"UNSTABLE: the arm buckles, {arm.joint_names[worst]} most; {margin}"


def find_remedies(K: Stiffness) -> Iterator[Remedy]:
    """Yield the remedies of an unstable arm; none if friction or another l_0 makes it unstable."""
    from cdsm.stiffness_matrix.assembly import stiffness  # here, since it needs this module

    pose = K.posture
    given = K.distribution
    cables = pose.arm.cables

    def stiffer(wire: float = 1.0, spring: float = 1.0) -> float:
        stiff = [(each.elasticity.scaled(wire), spring * each.series_stiffness) for each in cables]
        pairs = zip(cables, stiff, strict=True)
        changed = [replace(c, elasticity=law, series_stiffness=k) for c, (law, k) in pairs]
        there = pose.arm.with_cables(changed).at(pose.q, check_limits=False)
        return stiffness(there, K.tension, K.wrench).margin

    if stiffness(pose, K.tension, K.wrench).margin > 0.0:
        return
    if pose.arm.laws.held:
        yield Remedy("wire", _factor(stiffer, _STIFFER))
    if pose.arm.laws.series[cables.position_controlled].any():
        yield Remedy("spring", _factor(lambda s: stiffer(spring=s), _STIFFER))
    if given is not None and given.least and given.minimum_held.any():
        low = given.minimum_held
        high = given.maximum_held
        solver = given.solver

        def tension(s: float) -> float:
            least = np.where(low < high, s * low, low)
            return stiffness(pose, distribute_tension(pose, least, high, K.wrench, solver)).margin

        yield Remedy("tension", _factor(tension, _MORE_OR_LESS))


def _factor(margin: Callable[[float], float], rows: Iterable[Iterable[float]]) -> float | None:
    """Return the factor nearest to 1 at which ``margin``, which is negative at 1, is zero."""
    from scipy.optimize import brentq  # slow to import

    found: list[float] = []
    for row in rows:
        before = 1.0
        try:
            for s in row:
                if margin(s) > 0.0:
                    found.append(brentq(margin, before, s, xtol=1e-300, rtol=1e-12))
                    break
                before = s
        except CdsmError:  # beyond what the arm, its laws or its bounds allow
            continue
    return min(found, key=lambda s: abs(math.log(s)), default=None)
