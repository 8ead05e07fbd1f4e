"""Build the output of ``--json``: SI numbers, units in the keys, null for infinite values."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import typer

from cdsm.errors import SingularStiffness
from cdsm.planning import PathPlan, StiffnessPlan, StiffnessRange
from cdsm.posture import Posture
from cdsm.statics.buckling import CriticalLoad, CriticalTension
from cdsm.statics.weight_test import WeightTest
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.datasets import status_names
from cdsm.support.format import MODEL, JointUnits, key
from cdsm.support.validation import Array
from cdsm.tension import Tension
from cdsm.wires.tensile.fit import TensileFit

if TYPE_CHECKING:
    import xarray

Json = dict[str, object]


def show_json(values: Json) -> None:
    """Print SI numbers as strict JSON."""
    typer.echo(json.dumps(values, indent=1, allow_nan=False))


def of_stiffness(tension: Tension, K: Stiffness) -> Json:
    """Return posture, tensions and stiffness."""

    def matrix(read: Callable[[], Array]) -> list[list[float]] | None:
        try:
            values: list[list[float]] = read().tolist()
        except SingularStiffness:
            return None
        return values

    pose = tension.posture
    unit = pose.arm.stiffness_unit()
    return {
        **_joints(pose),
        "tip_position_m": pose.tip[:3, 3].tolist(),
        "tension_N": _by_cable(pose, tension.values),
        "cable_length_m": pose.cable_lengths.tolist(),
        key("static_residual", pose.arm.torque_unit()): K.residual.tolist(),
        "model": MODEL,
        "along_N_per_m": [_finite(K.along(axis)) for axis in np.eye(3)],
        "cartesian_N_per_m": matrix(lambda: K.cartesian),
        "pseudoinverse_N_per_m": matrix(K.pseudoinverse),
        "compliance": matrix(lambda: K.compliance),
        key("joint_stiffness", unit): K.joint.tolist(),
        key("margin", unit): K.margin,
        "stable": K.is_stable,
    }


def of_weight_test(test: WeightTest) -> Json:
    """Return all steps of a weight test."""
    last, before = test.loaded[-1], test.without
    return {
        "before": {
            "tip_displacement_m": before.displacement.tolist(),
            "at_limit": list(before.at_limit),
            "slack": list(before.slack),
            "stable": before.stable,
        },
        "force_N": test.force.tolist(),
        "loads_N": test.loads.tolist(),
        "tip_displacements_m": test.displacements.tolist(),
        "linear_displacement_m": test.linear.displacement.tolist(),
        "stiffness_N_per_m": _finite(test.stiffness),
        "linear_stiffness_N_per_m": _finite(test.linear.stiffness),
        "cables": [cable.name for cable in last.pose.arm.cables],
        "tensions_N": test.tensions.tolist(),
        **_joints(last.pose),
        "slack": list(last.slack),
        "at_limit": list(last.at_limit),
        "stable": last.stable,
    }


def of_buckling(tension: CriticalTension, load: CriticalLoad | None) -> Json:
    """Return the critical tension, and the critical load if it was computed."""
    names = tension.posture.arm.joint_names
    answer: Json = {
        "critical_minimum_tension_N": _finite(tension.minimum),
        "stable_minimum_tension_N": [list(span) for span in tension.stable],
        "examined_minimum_tension_N": list(tension.examined),
        "mode": dict(zip(names, tension.mode.tolist(), strict=True)),
        "tension_N": tension.tension.tolist(),
    }
    if load is not None:
        answer |= {
            "load": load.wrench.tolist(),
            "critical_load_factor": _finite(load.factor),
            "limit": load.limit,
            "load_mode": dict(zip(names, load.mode.tolist(), strict=True)),
        }
    return answer


def of_plan(plan: StiffnessPlan, attainable: StiffnessRange) -> Json:
    """Return a plan at one posture, and the attainable range of stiffness."""
    pose = plan.tension.posture
    return {
        "direction": attainable.direction.tolist(),
        "low_N_per_m": attainable.low,
        "high_N_per_m": attainable.high,
        "target_N_per_m": plan.target,
        "achieved_N_per_m": plan.achieved,
        "tension_N": _by_cable(pose, plan.tension.values),
        "cable_length_m": _by_cable(pose, pose.cable_lengths),
        **_joints(pose),
        key("margin", pose.arm.stiffness_unit()): plan.stiffness.margin,
        "efforts_N": plan.efforts.tolist(),
        "iterations": plan.iterations,
    }


def of_path(plan: PathPlan) -> Json:
    """Return all samples of a planned path."""
    return {
        "cables": [cable.name for cable in plan.arm.cables],
        "target_N_per_m": plan.target.tolist(),
        "planned": list(plan.planned),
        "achieved_N_per_m": plan.achieved.tolist(),
        **JointUnits(plan.arm.slides).to_dict(plan.arm.joint_names, plan.angles),
        "tensions_N": plan.tensions.tolist(),
        "cable_lengths_m": plan.cable_lengths.tolist(),
        "half_way": [
            {
                "after": between.index,
                "target_N_per_m": between.target.tolist(),
                "achieved_N_per_m": (
                    None if between.achieved is None else between.achieved.tolist()
                ),
                "misfit": _finite(between.misfit),
                "reason": between.reason,
            }
            for between in plan.between
        ],
        "infeasible": [
            {"index": sample.index, "status": sample.status, "reason": sample.reason}
            for sample in plan.infeasible
        ],
        "iterations": plan.iterations,
    }


def of_tensile_fit(fit: TensileFit) -> Json:
    """Return the numbers of a fit to a tensile test."""
    return {
        "method": fit.method,
        "gauge_length_m": fit.test.gauge_length,
        "domain_N": [fit.elasticity.domain.low, fit.elasticity.domain.high],
        "rms_N": fit.rms,
        "stages_N": {stage.name: [stage.low, stage.high] for stage in fit.stages},
        "tension_N": fit.tensions.tolist(),
        "rigidity_N": np.asarray(fit.elasticity.rigidity(fit.tensions)).tolist(),
        "rigidity_low_N": None if fit.band is None else fit.band.low.tolist(),
        "rigidity_high_N": None if fit.band is None else fit.band.high.tolist(),
        "notes": list(fit.notes),
    }


def status_counts(dataset: xarray.Dataset) -> dict[str, int]:
    """Count the entries of a sweep by status."""
    status = dataset["status"].values
    return {word: int((status == value).sum()) for value, word in status_names(dataset).items()}


def _joints(pose: Posture) -> Json:
    return JointUnits(pose.arm.slides).to_dict(pose.arm.joint_names, pose.q)


def _by_cable(pose: Posture, values: Array) -> dict[str, float]:
    names = (cable.name for cable in pose.arm.cables)
    return dict(zip(names, values.tolist(), strict=True))


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
