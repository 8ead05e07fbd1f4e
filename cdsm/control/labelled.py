"""Convert a closed-loop run to a Dataset, a table over time, numbers for JSON, or printed lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cdsm.support.format import plural
from cdsm.support.tidy import data_frame, dataset
from cdsm.support.values import Array

if TYPE_CHECKING:
    import pandas
    import xarray

    from cdsm.control.run import TrackingRun

_LISTED = 3  # largest number of motors whose names are printed


def labelled(run: TrackingRun) -> xarray.Dataset:
    """Return the run as a Dataset over time, in SI units."""
    arm, names = run.plan.arm, "xyz"
    labels: dict[str, Sequence[object] | NDArray[Any]] = {
        "time": run.time,
        "axis": list(names),
        "component": [f"{kind}{axis}" for kind in "fm" for axis in names],
        "joint": arm.joint_names,
        "cable": arm.cables.names,
    }
    angle, of_cable = "rad, or m where a joint slides", ("time", "cable")
    variables: dict[str, tuple[tuple[str, ...], NDArray[Any], str]] = {
        "goal": (("time", "axis"), run.goals, "m"),
        "tip": (("time", "axis"), run.tips, "m"),
        "tip_error": (("time",), run.tip_error, "m"),
        "target": (("time", "direction"), run.target, "N/m"),
        "stiffness": (("time", "direction"), run.stiffness, "N/m"),
        "direction_vector": (("direction", "axis"), run.directions, "1"),
        "margin": (("time",), run.margin, arm.stiffness_unit()),
        "joint_position": (("time", "joint"), run.angles, angle),
        "estimated_joint_position": (("time", "joint"), run.estimated_angles, angle),
        "wanted_tension": (of_cable, run.wanted_tension, "N"),
        "commanded_tension": (of_cable, run.commanded_tension, "N"),
        "commanded_wire": (of_cable, run.commanded_wire, "m"),
        "measured_tension": (of_cable, run.measured_tension, "N"),
        "tension": (of_cable, run.tension, "N"),
        "saturated": (of_cable, run.saturated, "1"),
        "out_of_reach": (("time",), run.short, "1"),
        "first_order_band": (("time",), run.band, "m"),
        "displacement": (("time",), run.displacement, "m"),
        "wrench": (("time", "component"), run.wrench, "N, N m"),
        "estimated_force": (("time", "axis"), run.estimated_force, "N"),
        "rigidity": (("time",), run.rigidity, "1"),
    }
    title = f"{arm.name} in closed loop, law {run.law}"
    data = dataset(variables, labels, title=title, outcome=run.outcome, reason=run.reason)
    data["time"].attrs["units"] = "s"
    return data


def table(run: TrackingRun) -> pandas.DataFrame:
    """Return the run as a table over time: angles, tip, tensions and stiffness, in SI units."""
    arm = run.plan.arm
    joints = [
        f"{name} [{unit}]" for name, unit in zip(arm.joint_names, arm.joint_units, strict=True)
    ]
    columns = dict(zip(joints, run.angles.T, strict=True))
    columns |= {f"tip {axis} [m]": run.tips[:, k] for k, axis in enumerate("xyz")}
    columns |= {
        f"{name} tension [N]": F for name, F in zip(arm.cables.names, run.tension.T, strict=True)
    }
    for d, (wanted, found) in enumerate(zip(run.target.T, run.stiffness.T, strict=True)):
        columns |= {f"wanted stiffness {d + 1} [N/m]": wanted, f"stiffness {d + 1} [N/m]": found}
    return data_frame(columns, "time [s]", run.time)


def numbers(run: TrackingRun) -> dict[str, Any]:
    """Return the numbers of the run's printed table, in SI with units in the keys."""
    off = abs(run.stiffness_error)
    known = off[np.isfinite(off).all(axis=1)]
    return {
        "law": run.law,
        "steps": len(run.time),
        "outcome": run.outcome,
        "reason": run.reason,
        "ended_s": run.end,
        "tip_error_mean_m": _mean(run.tip_error),
        "tip_error_largest_m": float(run.tip_error.max(initial=0.0)),
        "stiffness_error_mean": _mean(known.ravel()),
        "stiffness_error_largest": float(known.max()) if known.size else math.nan,
        "least_tension_N": float(run.tension.min(initial=math.inf)),
        "largest_tension_N": float(run.tension.max(initial=0.0)),
        "least_margin_Nm_per_rad": float(np.nanmin(run.margin, initial=math.inf)),
        "saturated_motors": run.saturated_motors,
        "steps_not_planned": len(run.refused),
        "steps_out_of_reach": np.count_nonzero(run.short),
        "steps_with_band": len(run.inside),
        "share_inside_first_order_band": _mean(run.inside.astype(float)),
        "estimated_rigidity": float(run.rigidity[-1]) if len(run.rigidity) else math.nan,
    }


def rows(run: TrackingRun) -> list[tuple[str, str]]:
    """Return the lines of the run's printed table: name and value."""
    n = numbers(run)
    low, high = n["least_tension_N"], n["largest_tension_N"]
    lacking = int(np.isnan(run.margin).sum())
    unknown = f" (none known at {plural(lacking, 'step')})" if lacking else ""
    return [
        ("tip error, mean and largest", f"{1e3 * n['tip_error_mean_m']:.3g}, "
         f"{1e3 * n['tip_error_largest_m']:.3g} mm"),
        ("frictionless stiffness error, mean and largest",
         f"{100.0 * n['stiffness_error_mean']:.3g}, "
         f"{100.0 * n['stiffness_error_largest']:.3g} %"),
        ("true tensions at the motors", f"{low:.4g} to {high:.4g} N"),
        ("least margin to buckling", f"{n['least_margin_Nm_per_rad']:.4g} "
         f"{run.plan.arm.stiffness_unit()}{unknown}"),
        ("motors clamped at a tension bound",
         _names_or_count(run.saturated_motors, run.tension.shape[1])),
        ("rigidity of the wires, as estimated", f"{100.0 * n['estimated_rigidity']:.4g} %"),
        ("inside the first-order band", _inside(run)),
    ]  # fmt: skip


def _names_or_count(names: tuple[str, ...], count: int) -> str:
    listed = ", ".join(names) if len(names) <= _LISTED else f"{len(names)} of {count}"
    return listed or "none"


def _inside(run: TrackingRun) -> str:
    if not run.inside.size:
        return "no step has a band"
    return f"{100.0 * run.inside.mean():.4g} % of {plural(len(run.inside), 'step')}"


def _mean(values: Array) -> float:
    return float(values.mean()) if values.size else math.nan
