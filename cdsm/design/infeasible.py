"""Error of a search in which no design meets all constraints: what the nearest design misses."""

from __future__ import annotations

from typing import NoReturn

import numpy as np

from cdsm.design.evaluation import Designs
from cdsm.design.goals import KINDS
from cdsm.design.quantities import quiet_arm, with_margin
from cdsm.errors import CdsmError, InfeasibleDesign, JointLimitError
from cdsm.stiffness_matrix import stiffness
from cdsm.support.format import plural
from cdsm.tension import distribute_tension


def explain(designs: Designs) -> NoReturn:
    """Raise InfeasibleDesign, with the design of the smallest sum of violations.

    The error says in words which constraints this design violates, and by how much.
    """
    problem, missed = designs.problem, designs.violations
    total = np.where(np.isfinite(missed), missed, np.inf).sum(axis=1)
    arms = np.array([not fault for fault in designs.faults])
    if not arms.any():
        raise InfeasibleDesign(
            f"none of {plural(len(designs), 'design')} is an arm: {designs.faults[0]}", (), ()
        )
    total[~arms] = np.inf
    order = np.lexsort((np.nan_to_num(missed, posinf=1e9).sum(axis=1), total))
    best = int(next(i for i in order if arms[i]))
    row = designs.designs[best]
    chosen = [
        f"{each.name} {each.shown(value)}"
        for each, value in zip(problem.variables, problem.values(row), strict=True)
    ]
    said, names = [], []
    if missed[best, 0] > 0.0:
        names.append("held")
        said.append(
            f"{100.0 * missed[best, 0]:.3g} % of its postures and loads are not held: "
            + _first_reason(designs, best)
        )
    for constraint, miss in zip(problem.constraints, missed[best, 1:], strict=True):
        if miss > 0.0:
            value = float(designs[constraint.key][best])
            names.append(constraint.key)
            is_now = "does not exist" if np.isnan(value) else constraint.shown(value)
            far = f", {100.0 * miss:.3g} % off" if np.isfinite(miss) else ""
            words = with_margin(problem, constraint, constraint.words)
            said.append(f"{words} {is_now}, {constraint.asked} is asked{far}")
    for objective in problem.objectives:
        value = float(designs[objective.key][best])
        if not np.isfinite(value) and objective.key not in names:
            names.append(objective.key)
            said.append(f"{objective.words} is {objective.shown(value)}")
    raise InfeasibleDesign(
        f"none of {plural(len(designs), 'design')} meets all constraints. The nearest one "
        f"({', '.join(chosen)}) misses: {'; '.join(said).rstrip('.')}. Loosen what it misses, "
        "widen a variable, or search longer.",
        tuple(names),
        tuple(row.tolist()),
    )


def _first_reason(designs: Designs, best: int) -> str:
    """Return a text: the first posture that design number ``best`` does not hold, and why.

    Either no tensions balance it under one of the loads, or the arm is unstable, or another error
    is raised. If all postures are held here, the text says that the tensions are at the edge.
    """
    problem, row = designs.problem, designs.designs[best]
    bounds, worst = (problem.minimum_of(row), problem.maximum), problem.worst_friction
    number = 0
    try:
        arm = quiet_arm(problem, row)
        for number, q in enumerate(problem.postures_of(arm)):
            pose = arm.at(q)
            for load in problem.loads:
                tension = distribute_tension(pose, *bounds, load, worst_friction=worst)
                K = stiffness(pose, tension)
                if not K.is_stable:
                    margin = f"{KINDS['margin'].words} {K.margin:.3g} N m/rad"
                    return f"posture {number}: UNSTABLE, {margin}"
    except CdsmError as error:
        why = error.problem if isinstance(error, JointLimitError) else error
        return f"posture {number}: {why}"
    return "its tensions are at the edge"
