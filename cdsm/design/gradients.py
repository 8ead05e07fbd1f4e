"""Derivatives of the quantities of a design with respect to its continuous variables.

A kernel (:mod:`cdsm._former.sensitivity`) gives the derivatives of a stiffness with respect to
every hole, disk, link, lead and mass at constant tensions, and with respect to the tensions. The
least tensions depend on the design, and so do their bounds, which friction narrows. The chain rule
adds both effects. All these derivatives are exact.

The margin for tolerances contains such derivatives, so its own derivatives are second derivatives.
They are central differences of exact first derivatives, or one-sided ones at an end of a range; the
error of both is of second order in the step.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from cdsm.design.chain_rule import Chain, Posed
from cdsm.design.goals import Measure
from cdsm.design.problem import DesignProblem
from cdsm.design.quantities import balanced, has_margin, margin, quiet_arm
from cdsm.errors import InvalidInput, SingularStiffness
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.values import Array
from cdsm.tension import Tension
from cdsm.uncertainties.readings import Question

SMOOTH: Final = ("stiffness", "margin", "deflection", "motor_force", "mass", "length")
"""Quantities with exact derivatives."""

_ALIKE = 1e-20  # two unit vectors are equal if their squared distance is below this

_STEP = 1e-4
"""Step of differences of uncertainties, as a fraction of a variable's range; the error is 1e-6."""

_CENTRAL = {-1.0: -0.5, 1.0: 0.5}
_ONE_SIDED = {1.0: -2.5, 2.0: 4.0, 3.0: -1.5}
"""Weights in a one-sided difference of second order, by the number of steps from the design. The
design itself has no weight: at the end of a range it may be special, such as an arm without lead.
"""


def rows_and_gradients(
    problem: DesignProblem, design: Array, measure: Measure
) -> tuple[Array, Array]:
    """Compute the quantity ``measure`` of a design (n,) in R cases, and its derivatives (R, n).

    The cases are all combinations of postures and loads. For ``motor_force``, they are all
    combinations of postures, loads and cables; ``mass`` and ``length`` have one case only. A
    constrained quantity includes its margin for tolerances, ± coverage · u, where u is the standard
    uncertainty. If ``worst_friction`` is True, the bounds of the tensions are
    minimum · exp(Σ μ φ) and maximum · exp(−Σ μ φ). Their derivatives contain the change of the wrap
    angles φ (:mod:`cdsm.design.grip`).

    Raises:
        InvalidInput: The quantity has no exact derivatives, or the tensions have none for this
            design.
        InfeasibleTension: No tensions within the bounds balance the arm at a posture.
        ElasticityRangeError: A tension is outside the domain of its cable's law.
        SingularStiffness: The arm is unstable at a posture.
    """
    if measure.of not in SMOOTH:
        raise InvalidInput(measure.of, f"has no exact derivatives; {', '.join(SMOOTH)} have.")
    arm = quiet_arm(problem, design)
    chain = Chain(problem, design, arm)
    if measure.of in ("mass", "length"):
        links = arm.geometry.links
        value = sum(link.mass for link in links) if measure.of == "mass" else arm.geometry.length
        return np.array([value]), chain.of_links(f"link_{measure.of}")[None]
    values, slopes = [], []
    unloaded = balanced(problem, design, arm, np.zeros_like(problem.loads))
    for tension, loss in balanced(problem, design, arm, problem.loads):
        force, K = tension.wrench[:3], _stable(tension)
        if measure.of == "deflection":
            tension, loss = next(unloaded)
            K = _stable(tension)
        posed = chain.at(tension, loss)
        if measure.of == "motor_force":  # the largest tension along each cable
            for c, weights in enumerate(np.eye(len(tension))):
                F = float(tension.values[c])
                values.append(loss[c] * F)
                slopes.append(loss[c] * (posed.slopes({}, weights) + F * posed.grip[c]))
            continue
        value, slope = _reading(K, measure, posed, force)
        values.append(value)
        slopes.append(slope)
    if not has_margin(problem, measure):
        return np.array(values), np.array(slopes)
    return (
        np.array(values) + _margins(problem, design, measure),
        np.array(slopes) + _margin_slopes(problem, design, measure),
    )


def _stable(tension: Tension) -> Stiffness:
    """Return the stiffness under the least tensions; SingularStiffness if the arm is unstable."""
    K = stiffness(tension.posture, tension)
    if not K.is_stable:
        raise SingularStiffness("the arm is unstable here.", K.critical_direction)
    return K


def _margins(problem: DesignProblem, design: Array, measure: Measure) -> Array:
    """Compute the margins for tolerances (R,) in the R cases of :func:`rows_and_gradients`."""
    found = []
    arm = quiet_arm(problem, design)
    for tension, loss in balanced(problem, design, arm, problem.loads):
        cables = range(len(tension)) if measure.of == "motor_force" else (None,)
        found += [margin(problem, measure, tension, loss, c) for c in cables]
    return np.array(found)


def _margin_slopes(problem: DesignProblem, design: Array, measure: Measure) -> Array:
    """Compute the derivatives (R, n) of :func:`_margins` by finite differences."""
    found = []
    for n, (low, high) in enumerate(problem.bounds):
        step, weights = _STEP * (high - low), _CENTRAL
        if not low + step <= design[n] <= high - step:
            step, weights = np.copysign(step, low + high - 2.0 * design[n]), _ONE_SIDED
        slope = 0.0
        for count, weight in weights.items():
            moved = design.copy()
            moved[n] += count * step
            slope = slope + weight / step * _margins(problem, moved, measure)
        found.append(slope)
    return np.array(found).T


def _reading(K: Stiffness, measure: Measure, posed: Posed, force: Array) -> tuple[float, Array]:
    """Return the quantity ``measure`` of K, and its derivatives (n,) with respect to the variables.

    ``posed`` turns derivatives by the inputs of the arm, at the posture of K, into those by the
    variables. ``force`` (3,) [N] is that of the load; only the measure ``deflection`` uses it.
    """
    if measure.of == "deflection":
        value, partial = _displacement(K, force)
    else:
        u = None if measure.direction is None else np.array(measure.direction)
        question = Question("along" if u is not None else "margin", K, u)
        value, partial = question.value(), question.gradient()
    return value, posed.slopes(partial, partial["tension"])


def _displacement(K: Stiffness, force: Array) -> tuple[float, dict[str, Array]]:
    """Return the displacement |C_vv f| [m] of the tip by a force f (3,) [N], and its derivatives.

    C_vv is the translational block of the compliance. There is an array of derivatives for each
    kind of input, such as ``link_mass``, and for ``tension``. With c(u) = uᵀ C_vv u, whose
    derivatives are known, and the unit vectors n of the displacement and f̂ of the force,

        |C_vv f| = |f| nᵀ C_vv f̂ = |f| (c(n + f̂) − c(n − f̂))/4.
    """
    size = float(np.linalg.norm(force))
    moved = K.compliance[:3, :3] @ force
    value = float(np.linalg.norm(moved))
    n, u = moved / value, force / size
    total: dict[str, Array] = {}
    for sign in (1.0, -1.0):
        way = n + sign * u
        square = float(way @ way)
        if square < _ALIKE:
            continue
        question = Question("along", K, way / np.sqrt(square))
        weight = -sign * size * square / (4.0 * question.value() ** 2)
        for name, g in question.gradient().items():
            total[name] = total.get(name, 0.0) + weight * g
    return value, total
