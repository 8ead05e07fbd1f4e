"""Sweeps say of every entry what the functions of the single posture say, under the right label."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import cdsm
from cdsm.measures.payload import largest_force
from cdsm.measures.polytope import balanced
from cdsm.stiffness_matrix.principal import principal_stiffness
from cdsm.support.values import Array
from cdsm.sweeps.blocks import blocks, extents, postures
from cdsm.sweeps.evaluation import _BATCH_NAMES
from cdsm.sweeps.quantities import QUANTITIES
from cdsm.sweeps.status import LOST
from cdsm.tension import checked_bounds
from tests.support.sweeps import CASES, EVERYTHING, GRID, LAWS, STEEL, WRENCHES, short_arm

Status = cdsm.SweepStatus


@pytest.fixture(scope="module")
def everything() -> xr.Dataset:
    return cdsm.sweep(short_arm(), GRID, maximum=90.0, outputs=EVERYTHING, **CASES)


# --- against the single functions ------------------------------------------------------------


def single(
    arm: cdsm.Manipulator, q: Array, minimum: float, maximum: float, wrench: Array
) -> tuple[set[Status], dict[str, Any]]:
    """Everything that exists of one entry, and what may stand in its status."""
    found: dict[str, Any] = {}
    try:
        pose = arm.at(q)
    except cdsm.JointLimitError:
        return {Status.BEYOND_LIMITS}, found
    found["tip_position"] = pose.tip[:3, 3]
    found["cable_lengths"], found["gravity_torque"] = pose.cable_lengths, pose.gravity_torque
    found["gravity_stiffness"] = pose.gravity_stiffness
    found["tension_factor"] = cdsm.tension_factor(pose)
    clear = cdsm.clearance(pose)
    for kind in ("cable", "link", "disk"):
        found[f"{kind}_clearance"] = getattr(clear, f"{kind}s")
    try:
        pull = cdsm.distribute_tension(pose, minimum, maximum, wrench)
    except cdsm.InfeasibleTension:
        return {Status.INFEASIBLE}, found
    found["tension"] = pull.values
    low, high = checked_bounds(arm, minimum, maximum)
    ways = [balanced(pose, u[:, None], wrench, low, high) for u in np.eye(3)]
    found["payload"] = np.array([largest_force(each) for each in ways])
    try:
        K = cdsm.stiffness(pose, pull)
    except cdsm.ElasticityRangeError:
        return {Status.OUTSIDE_ELASTICITY}, found
    found |= {f"{name}_stiffness": getattr(K, name) for name in ("active", "passive", "load")}
    found |= {"joint_stiffness": K.joint, "cable_stiffness": K.cable_stiffness, "margin": K.margin}
    found["translational_compliance"] = K.compliance[:3, :3]
    found["along"] = np.array([K.along(u) for u in np.eye(3)])
    status = {Status.OK if K.margin > 0.0 else Status.UNSTABLE}
    try:
        found["cartesian"], found["pseudoinverse"] = K.cartesian, K.pseudoinverse()
    except cdsm.SingularStiffness:
        status = {Status.IMMOBILE} if K.margin > 0.0 else status
    if K.margin > 0.0:
        found |= principal_stiffness(K.compliance[:3, :3])
    return status, found


@pytest.mark.slow
def test_every_entry_is_what_the_single_functions_say(everything: xr.Dataset) -> None:
    seen: set[int] = set()
    springy = short_arm(spring=1500.0).with_friction(0.1)
    soft = cdsm.sweep(springy, GRID, minimum=[40.0, 100.0], outputs=EVERYTHING)
    flat = cdsm.sweep(short_arm(), np.zeros((1, 6)), minimum=20.0, outputs=EVERYTHING)
    for arm, dataset, maximum in (
        (short_arm(), everything, 90.0),
        (springy, soft, np.inf),
        (short_arm(), flat, np.inf),
    ):
        stacked = dataset.stack(entry=dataset.status.dims)
        for i in range(stacked.sizes["entry"]):
            entry = stacked.isel(entry=i)
            law = LAWS.get(str(entry.coords.get("elasticity", xr.DataArray("")).item()))
            cables = [
                cdsm.Cable(
                    cable.name,
                    cable.sites,
                    law or cable.elasticity,
                    lead=cable.lead,
                    series_stiffness=cable.series_stiffness,
                )
                for cable in arm.cables
            ]
            q = np.array(
                [float(entry[name]) for name in arm.joint_names]
                if "q" not in entry.coords
                else entry.q.values
            )
            status, found = single(
                cdsm.Manipulator(arm.geometry, cables=cables, gravity=arm.gravity),
                q,
                float(entry["minimum"]),
                maximum,
                np.concatenate([entry["force"].values, entry["moment"].values]),
            )
            assert int(entry["status"]) in status
            seen |= status
            for name in EVERYTHING:
                value = entry[name].values
                if name not in found:
                    assert np.isnan(value).all(), name
                    continue
                size = np.max(abs(found[name]), initial=0.0, where=np.isfinite(found[name]))
                # the stiffest is the smallest eigenvalue of C_vv, 1e-5 of the largest here
                rtol = 1e-7 if QUANTITIES[name].stage == "principal" else 1e-9
                np.testing.assert_allclose(
                    value, found[name], rtol=rtol, atol=rtol / 100.0 * size, err_msg=name
                )
    assert seen == {
        Status.OK,
        Status.BEYOND_LIMITS,
        Status.INFEASIBLE,
        Status.OUTSIDE_ELASTICITY,
        Status.IMMOBILE,
        Status.UNSTABLE,
    }


def test_nothing_is_missing_where_the_status_does_not_say_so(everything: xr.Dataset) -> None:
    for name in EVERYTHING:
        inner = [dim for dim in everything[name].dims if dim not in everything.status.dims]
        missing = everything[name].isnull()
        assert bool((missing.any(inner) == missing.all(inner)).all())  # an entry, or all of it
        for status in np.unique(everything.status):
            lost = QUANTITIES[name].stage in LOST[Status(status)]
            there = missing.all(inner).broadcast_like(everything.status)
            assert bool((there.where(everything.status == status, lost) == lost).all()), name


def test_softest_and_stiffest_are_extremes_of_along_in_their_directions() -> None:
    pose = short_arm().at([0.2, -0.1, 0.3, 0.1, -0.2, 0.15])
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 30.0, wrench=WRENCHES["pulled"]))
    found = principal_stiffness(K.compliance[:3, :3])
    rng = np.random.default_rng(0)
    tried = [K.along(u) for u in rng.normal(size=(2000, 3))]
    assert found["softest"] <= min(tried) <= 1.01 * found["softest"]
    assert found["stiffest"] / 1.05 <= max(tried) <= found["stiffest"]
    for name in ("softest", "stiffest"):
        u = found[f"{name}_direction"]
        assert np.linalg.norm(u) == pytest.approx(1.0, abs=1e-14)
        assert K.along(u) == pytest.approx(float(found[name]), rel=1e-9)
    assert found["isotropy"] == pytest.approx(float(found["softest"] / found["stiffest"]))


def test_a_flat_arm_is_infinitely_stiff_along_itself() -> None:
    flat = cdsm.sweep(short_arm(), np.zeros((1, 6)), minimum=20.0)
    assert int(flat.status[0]) == Status.OK
    assert np.isposinf(flat.stiffest[0])
    assert flat.isotropy[0] == 0.0
    assert np.isposinf(flat.along.sel(direction="x")[0])


def test_a_tip_that_cannot_move_is_as_stiff_in_all_directions() -> None:
    found = principal_stiffness(np.zeros((3, 3)))
    assert np.isposinf(found["softest"])
    assert found["isotropy"] == 1.0


@pytest.mark.parametrize("chunk", [1, 7, 10_000])
def test_no_bit_depends_on_the_size_of_the_blocks(everything: xr.Dataset, chunk: int) -> None:
    again = cdsm.sweep(
        short_arm(), GRID, maximum=90.0, outputs=EVERYTHING, chunk=chunk, progress=False, **CASES
    )
    xr.testing.assert_identical(again, everything)


def test_every_output_can_be_asked_for_alone(everything: xr.Dataset) -> None:
    for name in EVERYTHING:
        alone = cdsm.sweep(short_arm(), GRID, maximum=90.0, outputs=name, **CASES)
        assert list(alone.data_vars) == [name, "status"]
        xr.testing.assert_equal(alone[name], everything[name])
    assert set(_BATCH_NAMES) <= set(QUANTITIES)


# --- labels ----------------------------------------------------------------------------------


def test_dimensions_and_coordinates_are_those_of_the_question(everything: xr.Dataset) -> None:
    poses, cases = ("joint1_1", "joint3_2"), ("elasticity", "wrench", "minimum")
    assert everything.status.dims == (*poses, *cases)
    assert everything.tip_position.dims == (*poses, "axis")
    assert everything.tension.dims == (*poses, "wrench", "minimum", "cable")
    assert everything.along.dims == (*poses, *cases, "direction")
    assert everything.joint_stiffness.dims == (*poses, *cases, "joint", "joint_column")
    np.testing.assert_array_equal(everything.joint1_1, [-0.4, 0.1, 2.0])
    np.testing.assert_array_equal(everything.minimum, CASES["minimum"])
    assert everything.joint2_1 == 0.2
    assert everything.joint1_2 == 0.0
    assert everything.elasticity.values.tolist() == list(LAWS)
    np.testing.assert_array_equal(everything.force.sel(wrench="pulled"), WRENCHES["pulled"][:3])
    np.testing.assert_array_equal(everything.moment.sel(wrench="pulled"), WRENCHES["pulled"][3:])
    assert everything.joint.values.tolist() == list(short_arm().joint_names)
    assert everything.cable.values.tolist() == [cable.name for cable in short_arm().cables]


def test_dimensions_stand_only_where_several_are_given() -> None:
    one = cdsm.sweep(short_arm(), np.zeros((2, 6)), minimum=20.0, direction=(0.0, 0.0, 2.0))
    assert one.status.dims == one.along.dims == ("pose",)
    np.testing.assert_array_equal(one.direction_vector, [0.0, 0.0, 1.0])
    np.testing.assert_array_equal(one.q, np.zeros((2, 6)))
    several = cdsm.sweep(
        short_arm(), np.zeros((2, 6)), minimum=[20.0], direction=np.eye(3)[:2], wrench=[[0.0] * 6]
    )
    assert several.along.dims == ("pose", "wrench", "minimum", "direction")
    assert several.direction.values.tolist() == [0, 1]


def test_everything_has_a_name_in_words_and_numbers_have_a_unit(everything: xr.Dataset) -> None:
    for variable in everything.variables.values():
        assert variable.attrs["long_name"]
        assert ("units" in variable.attrs) == (variable.dtype.kind != "U")
    assert everything.along.units == "N m-1"
    assert everything.margin.units == "N m rad-1"
    assert everything.joint1_1.units == "rad"
    told = everything.status.attrs
    assert told["flag_meanings"].split() == [status.name.lower() for status in Status]
    assert told["flag_values"] == [int(status) for status in Status]


def test_attributes_say_which_arm_it_was(everything: xr.Dataset) -> None:
    arm = short_arm()
    assert cdsm.Geometry.from_toml(everything.attrs["geometry"]) == arm.geometry
    assert everything.attrs["source"] == f"cdsm {cdsm.__version__}"
    np.testing.assert_array_equal(everything.gravity, arm.gravity)
    cables = json.loads(everything.attrs["cables"])
    assert [cable["name"] for cable in cables] == [cable.name for cable in arm.cables]
    assert json.loads(everything.attrs["cable_elasticities"]) == [repr(STEEL)]
    assert json.loads(everything.attrs["elasticity"]) == {n: repr(law) for n, law in LAWS.items()}


# --- pose sets -------------------------------------------------------------------------------


def test_path_is_even_along_straight_lines() -> None:
    corners = np.zeros((3, 6))
    corners[1, 0], corners[2, :2] = 0.3, [0.3, 0.1]
    found = cdsm.sweep(short_arm(), cdsm.PathPoses(corners, 9), minimum=20.0)
    np.testing.assert_allclose(found.distance, np.linspace(0.0, 0.4, 9), atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(np.diff(found.q, axis=0), axis=1), 0.05, rtol=1e-12)
    np.testing.assert_allclose(found.q[6], corners[1], atol=1e-15)
    own = cdsm.sweep(short_arm(), cdsm.PathPoses(corners), minimum=20.0)
    np.testing.assert_array_equal(own.q, corners)


def test_random_postures_fill_the_limits_and_come_again_with_their_seed() -> None:
    arm = short_arm()
    first, again, other = (
        cdsm.sweep(arm, cdsm.RandomPoses(n, seed), outputs="tip_position").q.values
        for n, seed in ((256, 3), (100, 3), (256, 4))
    )
    np.testing.assert_array_equal(first[:100], again)
    assert not np.array_equal(first, other)
    assert ((first > arm.lower) & (first < arm.upper)).all()
    # a Sobol sequence has one of its first 256 points in each 256th of every axis
    place = np.floor(256 * (first - arm.lower) / (arm.upper - arm.lower)).astype(int)
    assert all(np.array_equal(np.sort(column), np.arange(256)) for column in place.T)


@pytest.mark.parametrize("most", [1, 2, 3, 4, 7, 12, 50, 1000])
def test_blocks_cover_the_postures_in_order_without_gaps(most: int) -> None:
    sizes = {"a": 3, "b": 4, "c": 5}
    cut = blocks(sizes, extents(sizes, most))
    numbers = np.arange(60).reshape(3, 4, 5)
    inside = [numbers[tuple(block.values())].ravel() for block in cut]
    np.testing.assert_array_equal(np.concatenate(inside), np.arange(60))
    assert [each.size for each in inside] == [postures(block) for block in cut]
    assert max(each.size for each in inside) <= most


# --- bad input -------------------------------------------------------------------------------

Q = np.zeros((2, 6))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"arm": 3}, "arm: 3 given; a Manipulator is needed"),
        ({"q": np.zeros(6)}, r"q: shape \(6,\) given, \(N, 6\) needed"),
        ({"q": np.zeros((0, 6))}, "one or more postures"),
        ({"q": [[np.nan] * 6]}, r"q: entry \[0, 0\] is nan"),
        ({"q": cdsm.GridPoses({"joint1": [0.1]})}, "no joint is called 'joint1'; did you mean"),
        ({"q": cdsm.PathPoses(np.eye(5))}, r"waypoints: shape \(5, 5\) given, \(N, 6\)"),
        ({"minimum": -1.0}, "minimum: -1 N given; cables only pull"),
        ({"minimum": []}, "minimum: is empty"),
        ({"minimum": [5.0, 5.0]}, "minimum: holds 5 twice"),
        ({"minimum": [[5.0]]}, "minimum: shape"),
        ({"maximum": 10.0}, "maximum: 10 N given, below a minimum of 20 N"),
        ({"maximum": np.array([80.0, 90.0])}, "maximum: shape"),
        ({"elasticity": 48e3}, "elasticity: 48000.0 given; give an Elasticity, or a mapping"),
        ({"elasticity": {}}, "elasticity: is empty"),
        ({"elasticity": {1: STEEL}}, "name of elasticity: 1 given; a name is needed"),
        ({"wrench": np.zeros(3)}, r"wrench: shape \(3,\) given, \(6,\) needed"),
        ({"wrench": {"a": np.zeros(3)}}, r"wrench\['a'\]: shape"),
        ({"direction": np.zeros((0, 3))}, "direction: is empty"),
        ({"direction": np.zeros((1, 3))}, r"direction\[0\]: is the zero vector"),
        ({"outputs": ()}, "outputs: is empty"),
        ({"outputs": ("margin", "margin")}, "outputs: holds 'margin' twice"),
        ({"outputs": "margins"}, "no output is called 'margins'; did you mean 'margin'"),
        ({"outputs": 3}, "outputs: 3 given; names are needed"),
        (
            {"q": cdsm.GridPoses({f"joint{k}_1": np.linspace(0, 1, 10**6) for k in (1, 2, 3)})},
            "tip_position has 1000000 x .* more than fits into memory; .* or give store=",
        ),
        ({"store": 3}, "path: 3 given; the path of a file is needed"),
        ({"chunk": 0}, "chunk: 0 given; a whole number from 1 on"),
        ({"client": "here"}, "client: 'here' given; a synchronous dask Client"),
    ],
)
def test_bad_input_is_named(arguments: dict[str, Any], said: str) -> None:
    given = {"arm": short_arm(), "q": Q, "minimum": 20.0, **arguments}
    with pytest.raises(cdsm.CdsmError, match=said):
        cdsm.sweep(given.pop("arm"), given.pop("q"), **given)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: cdsm.GridPoses({}), "angles: is empty"),
        (lambda: cdsm.GridPoses([0.1]), r"angles: \[0.1\] given; a mapping"),  # type: ignore[arg-type]
        (lambda: cdsm.GridPoses({"joint1_1": []}), r"angles\['joint1_1'\]: is empty"),
        (lambda: cdsm.GridPoses({"joint1_1": [0.1, 0.1]}), "holds 0.1 twice"),
        (lambda: cdsm.GridPoses({"joint1_1": 0.1}, {"joint1_1": 0.0}), "rest: joint1_1 is swept"),
        (lambda: cdsm.PathPoses(np.zeros((1, 6))), "two or more postures"),
        (lambda: cdsm.PathPoses(np.zeros((2, 6)), 5), "are all the same posture"),
        (lambda: cdsm.PathPoses(np.eye(6), 1), "count: 1 given; a whole number from 2 to"),
        (lambda: cdsm.RandomPoses(0), "count: 0 given; a whole number from 1 to"),
        (lambda: cdsm.RandomPoses(8.0), "count: 8.0 given; a whole number"),  # type: ignore[arg-type]
        (lambda: cdsm.RandomPoses(8, -1), "seed: -1 given"),
    ],
)
def test_bad_pose_sets_are_named(make: Callable[[], object], said: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=said):
        make()


def renamed(joint: str) -> cdsm.Manipulator:
    """The short arm from a URDF, in which joint2_1 has another name."""
    arm = short_arm()
    urdf = arm.urdf.replace('"joint2_1"', f'"{joint}"')
    return cdsm.Manipulator.from_urdf(urdf, arm.cables, tip=arm.tip_link, gravity=arm.gravity)


@pytest.mark.parametrize("swept", [True, False])
@pytest.mark.parametrize(
    ("name", "why"),
    [
        *((name, "is a name that the Dataset has already") for name in ("along", "tip_position")),
        *((name, "is a name that the Dataset has already") for name in ("status", "direction")),
        *((name, "is a name that the Dataset has already") for name in ("force", "axis")),
        *((name, "is no name of a variable") for name in ("a/b", "a\\b", "(y)", ".y", "y ")),
    ],
)
def test_a_joint_whose_name_cannot_label_a_grid_is_refused(
    name: str, why: str, swept: bool, tmp_path: Path
) -> None:
    arm = renamed(name)
    grid = cdsm.GridPoses({name if swept else "joint1_1": [0.0, 0.1]})
    said = rf"^angles: each joint .* {re.escape(repr(name))} {why}.* Rename this"
    for store in (None, tmp_path / "s.zarr"):
        with pytest.raises(cdsm.InvalidInput, match=said):
            cdsm.sweep(arm, grid, minimum=20.0, store=store)
    assert not list(tmp_path.iterdir())
    assert bool((cdsm.sweep(arm, [[0.1] * 6], minimum=20.0).status == 0).all())


@pytest.mark.parametrize("name", ["gelenk 1 (y)", "ü", "_1", "pose", "distance", "payload"])
def test_a_joint_with_any_other_name_labels_a_grid(name: str, tmp_path: Path) -> None:
    grid = cdsm.GridPoses({name: [0.0, 0.1]})
    found = cdsm.sweep(renamed(name), grid, minimum=20.0, store=tmp_path / "s.zarr")
    assert found[name].values.tolist() == [0.0, 0.1]
    xr.testing.assert_identical(cdsm.sweep(renamed(name), grid, minimum=20.0), found)
    path = cdsm.write_sweep(found, tmp_path / "s.nc")
    xr.testing.assert_identical(cdsm.read_sweep(path), found)
    cdsm.plots.plot_map(found)
