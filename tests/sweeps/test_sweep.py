"""Sweeps say of every entry what the functions of one posture say, under the right label."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import cdsm
from cdsm.measures.payload import largest_force
from cdsm.measures.polytope import balanced
from cdsm.quantities import QUANTITIES
from cdsm.support.values import Array
from cdsm.tension import checked_bounds
from tests.support.sweeps import CASES, EVERYTHING, GRID, WRENCHES, short_arm

Status = cdsm.Status
STRAND = cdsm.presets.STRAND_1X19


@pytest.fixture(scope="module")
def everything() -> xr.Dataset:
    return cdsm.sweep(short_arm(STRAND), GRID, maximum=90.0, outputs=EVERYTHING, **CASES)


def single(
    arm: cdsm.Manipulator, q: Array, minimum: float, maximum: float, wrench: Array
) -> tuple[set[Status], dict[str, Any]]:
    """Everything that exists of one entry, and what may stand in its status."""
    found: dict[str, Any] = {}
    try:
        pose = arm.at(q)
    except cdsm.InvalidInput:
        return {Status.BEYOND_LIMITS}, found
    found["tip_position"] = pose.tip[:3, 3]
    found |= {"cable_lengths": pose.cable_lengths, "gravity_torque": pose.gravity_torque}
    found |= {"gravity": pose.gravity_stiffness, "springs": arm.springs.matrix}
    found["tension_factor"] = cdsm.tension_factor(pose)
    clear = cdsm.clearance(pose)
    found |= {f"{kind}_clearance": getattr(clear, f"{kind}s") for kind in ("cable", "link", "disk")}
    try:
        pull = cdsm.distribute_tension(pose, minimum, maximum, wrench)
    except cdsm.InfeasibleTension:
        return {Status.INFEASIBLE}, found
    found["tension"] = pull.values
    bounds = checked_bounds(arm, minimum, maximum)
    ways = [balanced(pose, u[:, None], wrench, *bounds) for u in np.eye(3)]
    found["payload"] = np.array([largest_force(each) for each in ways])
    try:
        K = cdsm.stiffness(pose, pull)
    except cdsm.ElasticityRangeError:  # these terms need no law
        of_steel = cdsm.stiffness(short_arm().at(q), pull.values, wrench=wrench)
        found |= {name: getattr(of_steel, name) for name in ("active", "load")}
        return {Status.OUTSIDE_ELASTICITY}, found
    found |= {name: getattr(K, name) for name in ("active", "passive", "load", "compliance")}
    found |= {"joint_stiffness": K.joint, "cable_stiffness": K.cable_stiffness, "margin": K.margin}
    C = found["translational_compliance"] = K.compliance[:3, :3]
    found["along"] = np.array([K.along(u) for u in np.eye(3)])
    found["slack"] = np.float64(bool(K.slack))
    status = {Status.OK if K.margin > 0.0 else Status.UNSTABLE}
    try:
        found["cartesian"], found["pseudoinverse"] = K.cartesian, K.pseudoinverse()
    except cdsm.SingularStiffness:
        status = {Status.IMMOBILE} if K.margin > 0.0 else status
    if K.margin > 0.0:
        values, vectors = np.linalg.eigh((C + C.T) / 2.0)
        stiffest = 1.0 / values[0] if values[0] > 1e-12 * values[2] else np.inf
        found |= {"softest": 1.0 / values[2], "stiffest": stiffest}
        found["isotropy"] = found["softest"] / stiffest
        for name, u in (("softest", vectors[:, 2]), ("stiffest", vectors[:, 0])):
            found[f"{name}_direction"] = u * np.sign(u[abs(u).argmax()])
    return status, found


def test_every_entry_is_what_the_single_functions_say(everything: xr.Dataset) -> None:
    seen: set[Status] = set()
    springy = short_arm(spring=8000.0, lead=0.3).with_friction(0.1)
    soft = cdsm.sweep(springy, GRID, minimum=[40.0, 100.0], outputs=EVERYTHING)
    flat = cdsm.sweep(short_arm(), np.zeros((1, 6)), minimum=20.0, outputs=EVERYTHING)
    for arm, dataset, maximum in (
        (short_arm(STRAND), everything, 90.0),
        (springy, soft, np.inf),
        (short_arm(), flat, np.inf),
    ):
        stacked = dataset.stack(entry=dataset.status.dims)
        for i in range(stacked.sizes["entry"]):
            entry = stacked.isel(entry=i)
            q = entry.get("q", [float(entry.get(name, np.nan)) for name in arm.joint_names])
            load = np.concatenate([entry["force"].values, entry["moment"].values])
            status, found = single(arm, np.asarray(q), float(entry["minimum"]), maximum, load)
            assert int(entry["status"]) in status
            seen |= status
            for name in EVERYTHING:
                value = entry[name].values
                if name not in found:
                    missing = ~value if value.dtype == np.bool_ else np.isnan(value)
                    assert missing.all(), name
                    continue
                size = np.max(abs(found[name]), initial=0.0, where=np.isfinite(found[name]))
                # the stiffest is the smallest eigenvalue of C_vv, 1e-5 of the largest here
                rtol = 1e-7 if QUANTITIES[name].needs == "stable arm" else 1e-9
                near = {"rtol": rtol, "atol": rtol / 100.0 * size}
                np.testing.assert_allclose(1.0 * value, found[name], **near, err_msg=name)
    names = "OK BEYOND_LIMITS INFEASIBLE OUTSIDE_ELASTICITY IMMOBILE UNSTABLE"
    assert seen == {Status[name] for name in names.split()}


@pytest.mark.parametrize("worst", [False, True])
def test_worst_friction_narrows_the_bounds_as_at_one_posture(worst: bool) -> None:
    arm, poses = short_arm().with_friction(0.1), cdsm.RandomPoses(8, 1)
    given: dict[str, Any] = {"maximum": 150.0, "diameter": 1.2e-3}
    outputs = ("tension", "force_radius", "cable_clearance")
    found = cdsm.sweep(
        arm, poses, minimum=[5.0, 149.9], outputs=outputs, worst_friction=worst, **given
    )
    assert ("worst_friction" in found.attrs) is worst
    assert {0, Status.INFEASIBLE} <= {*found.status.values.ravel().tolist()}
    for i, m in np.ndindex(8, 2):
        entry = found.isel(pose=i, minimum=m)
        pose, bounds = arm.at(entry.q.values), (float(entry["minimum"]), 150.0)
        clear = cdsm.clearance(pose, 1.2e-3)
        np.testing.assert_allclose(entry.cable_clearance, clear.cables, rtol=1e-12)
        try:
            pull = cdsm.distribute_tension(pose, *bounds, worst_friction=worst)
        except (cdsm.InfeasibleTension, cdsm.InvalidInput):  # or nothing between the bounds
            assert entry.status == Status.INFEASIBLE
            assert entry.tension.isnull().all()
            continue
        assert entry.status == 0
        np.testing.assert_allclose(entry.tension, pull.values, rtol=1e-9)
        polytope = cdsm.force_polytope(pose, *bounds, worst_friction=worst)
        np.testing.assert_allclose(entry.force_radius, polytope.radius, rtol=1e-7)


def test_bounds_that_held_stand_beside_those_asked() -> None:
    """A cable's own minimum of 10 N holds where less is asked; its label is what held."""
    arm = short_arm()
    own = [replace(cable, minimum=10.0 + 10.0 * (i == 2)) for i, cable in enumerate(arm.cables)]
    own[4] = replace(own[4], maximum=80.0)
    arm = arm.with_cables(own)
    found = cdsm.sweep(arm, cdsm.RandomPoses(4), minimum=[0.0, 15.0], maximum=90.0)
    np.testing.assert_array_equal(found.minimum, [0.0, 15.0])
    np.testing.assert_array_equal(found.minimum_held.sel(cable="cable1_2"), [10.0, 15.0])
    np.testing.assert_array_equal(found.minimum_held.sel(cable="cable1_3"), [20.0, 20.0])
    assert found.minimum_held.dims == ("minimum", "cable")
    assert float(found.maximum) == 90.0
    assert float(found.maximum_held.sel(cable="cable2_2")) == 80.0
    assert float(found.maximum_held.sel(cable="cable2_1")) == 90.0
    pull = cdsm.sweep(arm, cdsm.RandomPoses(4), minimum=5.0, outputs="tension")
    assert (pull.tension >= pull.minimum_held - 1e-9).where(pull.status == 0, True).all()


def test_dimensions_and_coordinates_are_those_of_the_question(
    everything: xr.Dataset, tmp_path: Path
) -> None:
    file = tmp_path / "arm.toml"
    file.write_text(everything.attrs["arm"], encoding="utf-8")
    poses, cases = ("joint1_1", "joint3_2"), ("wrench", "minimum")
    assert everything.status.dims == (*poses, *cases)
    assert everything.tip_position.dims == (*poses, "axis")
    assert everything.along.dims == (*poses, *cases, "direction")
    assert everything.joint_stiffness.dims == (*poses, *cases, "joint", "joint_column")
    np.testing.assert_array_equal(everything.joint1_1, [-0.4, 0.1, 2.0])
    np.testing.assert_array_equal(everything.minimum, CASES["minimum"])
    assert everything.joint2_1 == 0.2
    assert everything.joint1_2 == 0.0
    np.testing.assert_array_equal(everything.force.sel(wrench="pulled"), WRENCHES["pulled"][:3])
    np.testing.assert_array_equal(everything.moment.sel(wrench="pulled"), WRENCHES["pulled"][3:])
    assert everything.joint.values.tolist() == list(short_arm().joint_names)
    assert everything.cable.values.tolist() == [cable.name for cable in short_arm().cables]
    one = cdsm.sweep(short_arm(), np.zeros((2, 6)), minimum=20.0, direction=(0.0, 0.0, 2.0))
    assert one.status.dims == one.along.dims == ("pose",)
    np.testing.assert_array_equal(one.direction_vector, [0.0, 0.0, 1.0])
    np.testing.assert_array_equal(one.q, np.zeros((2, 6)))
    assert cdsm.Manipulator.read(file) == short_arm(STRAND)
    for variable in everything.variables.values():
        assert variable.attrs["long_name"]
        assert ("units" in variable.attrs) == (variable.dtype.kind != "O")
    alone = cdsm.sweep(short_arm(STRAND), GRID, maximum=90.0, outputs="margin", **CASES)
    assert list(alone.data_vars) == ["margin", "status"]
    xr.testing.assert_allclose(alone.margin, everything.margin, rtol=1e-10)


def test_path_is_even_along_straight_lines() -> None:
    corners = np.zeros((3, 6))
    corners[1, 0], corners[2, :2] = 0.3, [0.3, 0.1]
    found = cdsm.PathPoses(corners, 9).angles(short_arm())
    np.testing.assert_allclose(found.distance, np.linspace(0.0, 0.4, 9), atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(np.diff(found, axis=0), axis=1), 0.05, rtol=1e-12)
    np.testing.assert_allclose(found[6], corners[1], atol=1e-15)
    np.testing.assert_array_equal(cdsm.PathPoses(corners).angles(short_arm()), corners)


def test_random_postures_fill_the_limits_and_come_again_with_their_seed() -> None:
    arm = short_arm()
    first, again, other = (
        cdsm.RandomPoses(n, seed).angles(arm).values for n, seed in ((256, 3), (100, 3), (256, 4))
    )
    np.testing.assert_array_equal(first[:100], again)
    assert not np.array_equal(first, other)
    assert ((first > arm.lower) & (first < arm.upper)).all()
    # a Sobol sequence has one of its first 256 points in each 256th of every axis
    place = np.floor(256 * (first - arm.lower) / (arm.upper - arm.lower)).astype(int)
    assert all(np.array_equal(np.sort(column), np.arange(256)) for column in place.T)


Q = np.zeros((2, 6))
DATA = xr.DataArray(Q, dims=("row", "joint"))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"q": np.zeros(6)}, r"q: shape \(6,\) given, \(N, 6\) needed"),
        ({"q": [[np.nan] * 6]}, r"q: entry \[0, 0\] is nan"),
        ({"q": DATA[:, :5]}, r"q: .*'joint': 5.* given; postures x joint=6 is needed"),
        ({"q": DATA.assign_coords(joint=[*"abcdef"])}, "q: its joints are not joint1_1"),
        ({"q": cdsm.GridPoses({"joint1": [0.1]})}, "no joint is called 'joint1'; did you mean"),
        ({"q": cdsm.PathPoses(np.eye(5))}, r"waypoints: shape \(5, 5\) given, \(N, 6\)"),
        (
            {"q": cdsm.GridPoses({f"joint{k}_1": np.linspace(0, 1, 2000) for k in (1, 2, 3)})},
            "q: has 2000 x 2000 x 2000 postures; 2.30 are taken at most",
        ),
        ({"minimum": -1.0}, "minimum: -1 N given for cable1_1; cables only pull"),
        ({"minimum": [5.0, 5.0]}, r"minimum: \[5.0, 5.0\] given; give one or more different"),
        ({"maximum": 10.0}, r"maximum: 10 N \(maximum\) for cable1_1 is below 20 N"),
        ({"worst_friction": True}, "worst_friction: .* has no friction in its holes"),
        ({"wrench": np.zeros(3)}, r"wrench: shape \(3,\) given, \(6,\) for all"),
        ({"direction": np.zeros((1, 3))}, r"direction\[0\]: is the zero vector"),
        ({"outputs": ()}, r"outputs: \(\) given; name some of tip_position"),
        ({"outputs": "margins"}, "no output is called 'margins'; did you mean 'margin'"),
        (lambda: cdsm.GridPoses({}), "angles: {} .* mappings of joint names are needed"),
        (lambda: cdsm.GridPoses({"joint1_1": [0.1, 0.1]}), r"angles\['joint1_1'\]: .* different"),
        (lambda: cdsm.GridPoses({"joint1_1": 0.1}, {"joint1_1": 0.0}), "rest: joint1_1 is swept"),
        (lambda: cdsm.PathPoses(np.zeros((1, 6))), "two or more postures"),
        (lambda: cdsm.PathPoses(np.zeros((2, 6)), 5), "are all the same posture"),
        (lambda: cdsm.RandomPoses(8, -1), "seed: -1 given"),
    ],
)
def test_bad_input_is_named(given: Any, said: str) -> None:
    with pytest.raises(cdsm.CdsmError, match=said):
        given() if callable(given) else cdsm.sweep(short_arm(), **{"q": Q, "minimum": 20.0} | given)
