"""Many postures at once give what each gives alone; and what becomes of those that give nothing."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.batch import Batch
from cdsm.presets import STRAND_1X19
from cdsm.quantities import QUANTITIES, names_of
from cdsm.support.values import Array
from tests.support.arms import STEEL, mixed_arm, random_arm
from tests.support.foreign import crab
from tests.support.rough import rough

OUTPUTS = names_of("batch")

ROUNDING = 1e-12
"""Of the largest entry: other orders of summation, and what inverses make of them."""

DIRECTIONS = np.array([[0.0, 0.3, 1.0], [1.0, -2.0, 0.1], [0.0, 1.0, 0.0]])


HARDENING = cdsm.Elasticity.from_rigidity(lambda F: 1e4 * (1.0 + F / 50.0), 1.0, 500.0)
"""An elasticity of the user's own."""


def custom_arm() -> cdsm.Manipulator:
    """Cables from anywhere to anywhere, past their own way back, of many kinds."""
    base = random_arm(4, 3)

    def cable(name: str, *where: Any, law: cdsm.Elasticity = STEEL, **more: Any) -> cdsm.Cable:
        return cdsm.Cable(name, tuple(cdsm.Site(link, at) for link, *at in where), law, **more)

    far, near = ("link3", 0.0, 0.0, 0.02), ("link1", 0.0, 0.02, -0.03)
    there = cable("there", ("link3", 0.01, 0.02, 0), ("base_disk", 0, 0.03, 0.01), law=STRAND_1X19)
    back = cable("back", ("base_disk", 0, -0.03, 0), far, near, law=HARDENING)
    own = ("link1", 0, 0.03, 0), ("link2", 0.01, 0.03, 0.01)
    spring = cable("spring", *own, series_stiffness=2e3)
    own = ("base_link", 0, 0, 0.04), ("link2", 0, 0, 0.03)
    motor = cable("motor", *own, control="force")
    own = ("link2", 0, 0.01, 0.03), ("link2", 0.01, 0.01, 0.03)
    cables = [*base.cables, there, back, spring, motor, cable("fixed", *own, law=STRAND_1X19)]
    return cdsm.Manipulator(base.geometry, cables=cables, gravity=(2.0, -4.0, -8.0))


def with_motors(arm: cdsm.Manipulator) -> cdsm.Manipulator:
    """Every third cable held by a motor that controls force."""
    held = [replace(c, control="force") if i % 3 == 0 else c for i, c in enumerate(arm.cables)]
    return arm.with_cables(held)


ARMS: dict[str, Callable[[], cdsm.Manipulator]] = {
    "universal": lambda: random_arm(1, 4),
    "hinged": lambda: random_arm(2, 5, "hinged"),
    "one hinge": lambda: random_arm(8, 1, "hinged"),
    "mixed": mixed_arm,
    "custom": custom_arm,
    "strands": cdsm.presets.virtual_prototype,
    "tree": crab,
    "motors": lambda: with_motors(random_arm(7, 4)),
    "slack": lambda: random_arm(6, 3, elasticity=STRAND_1X19.slack_below()),
    "rough mixed": lambda: rough(mixed_arm(), some_friction, series_stiffness=3e4),
    "rough strands": lambda: rough(
        cdsm.presets.virtual_prototype(lead=0.2), some_friction, control="force"
    ),
}


def some_friction(c: int, i: int) -> float:
    """Friction in two of three holes."""
    return 0.0 if (c + i) % 3 == 0 else 0.15


def problem(arm: cdsm.Manipulator, rows: int, seed: int = 0) -> tuple[Array, Array, Array]:
    """Joint angles, tensions and wrenches, none of which balance each other."""
    rng = np.random.default_rng([seed, arm.nv])
    wrench = rng.normal(0.0, 3.0, (rows, 6)) * np.array([1.0, 1.0, 1.0, 0.1, 0.1, 0.1])
    return (
        rng.uniform(-0.6, 0.6, (rows, arm.nv)) * arm.upper,
        rng.uniform(20.0, 120.0, (rows, len(arm.cables))),
        wrench,
    )


def alone(name: str, K: cdsm.Stiffness) -> Any:
    """A quantity as the single posture gives it."""
    if name == "along":
        return [K.along(u) for u in DIRECTIONS]
    if name == "pseudoinverse":
        return K.pseudoinverse()
    if name == "slack":
        return float(bool(K.slack))
    return getattr(K, name) if hasattr(K, name) else getattr(K.posture, name)


# --- equal to the single posture ------------------------------------------------------------


@pytest.mark.usefixtures("kernels")
@pytest.mark.parametrize("name", ARMS)
def test_every_quantity_of_every_row_is_that_of_the_single_posture(name: str) -> None:
    arm, rows = ARMS[name](), 7
    q, tension, wrench = problem(arm, rows)
    batch = cdsm.evaluate(arm, q, tension, wrench, OUTPUTS, direction=DIRECTIONS)
    lone = cdsm.evaluate(arm, q, tension, wrench, ("along",), direction=DIRECTIONS)
    np.testing.assert_allclose(lone["along"], batch["along"], rtol=1e-10)
    # fewer than three joints do not move the tip in all directions
    expected = cdsm.Status.OK if arm.nv >= 3 else cdsm.Status.IMMOBILE
    assert (batch.status == expected).all()
    for r in range(rows):
        K = cdsm.stiffness(arm.at(q[r]), tension[r], wrench[r])
        for output in OUTPUTS:
            if expected == cdsm.Status.IMMOBILE and output in ("cartesian", "pseudoinverse"):
                assert np.isnan(batch[output]).all()
                continue
            single = np.asarray(alone(output, K))
            assert batch[output].shape == (rows, *single.shape), output
            # a residual is a difference: its scale is that of its terms
            terms = abs(tension[r] @ abs(K.posture.length_jacobian)).max()
            size = abs(single[np.isfinite(single)]).max(initial=0.0)
            if output == "margin":  # an eigenvalue moves with the norm of the matrix (Weyl)
                size = abs(K.joint).max()
            off = ROUNDING * terms if output == "residual" else 1e-10 * size
            np.testing.assert_allclose(
                1.0 * batch[output][r], single, rtol=0.0, atol=off, err_msg=output
            )


def test_tensions_that_were_distributed_carry_their_wrench() -> None:
    arm = random_arm(1, 3)
    q, _, wrench = problem(arm, 6)
    pull = cdsm.distribute_tensions(arm, q, 10.0, wrench=wrench)
    assert pull.ok.all()
    batch = cdsm.evaluate(arm, q, pull, outputs=("residual", "joint", "length_jacobian"))
    np.testing.assert_array_equal(batch.wrench, wrench)
    # Eq. 13, of terms as large as moment arm times tension
    scale = abs(batch["length_jacobian"]).max() * pull.values.max()
    np.testing.assert_allclose(batch["residual"], 0.0, atol=1e-11 * scale)
    short = cdsm.evaluate(arm, q, None, wrench, ("residual", "joint", "tension"), minimum=10.0)
    np.testing.assert_array_equal(short["tension"], pull.values)
    np.testing.assert_array_equal(short["joint"], batch["joint"])
    assert short.minimum is not None
    assert short.tension is None


# --- rows, chunks and threads ---------------------------------------------------------------


@pytest.mark.usefixtures("kernels")
def test_rows_do_not_know_of_each_other() -> None:
    """The same numbers whatever the chunk, the thread and the neighbours of a row."""
    arm = random_arm(1, 2)
    q, tension, wrench = problem(arm, 3000)
    q[::7] *= 3.0  # some beyond their limits, in between
    names = ("joint", "margin", "cartesian", "gravity")
    whole = cdsm.evaluate(arm, q, tension, wrench, names, threads=1)
    assert 300 < np.count_nonzero(whole.status == cdsm.Status.BEYOND_LIMITS) < 700

    def check(part: Any, threads: int) -> None:
        batch = cdsm.evaluate(arm, q[part], tension[part], wrench[part], names, threads=threads)
        np.testing.assert_array_equal(batch.status, whole.status[part])
        for name in names:
            scale = np.nanmax(abs(whole[name]))
            np.testing.assert_allclose(
                batch[name], whole[name][part], rtol=0.0, atol=ROUNDING * scale
            )

    picked = np.random.default_rng(1).permutation(3000)[:777]
    for part, threads in ((slice(None), 2), (slice(None), 7), (picked, 1), (picked[:1], 1)):
        check(part, threads)
    one = cdsm.distribute_tensions(arm, q, 5.0, threads=1)
    several = cdsm.distribute_tensions(arm, q, 5.0, threads=5)
    np.testing.assert_allclose(one.values, several.values, rtol=1e-12)
    np.testing.assert_array_equal(one.status, several.status)


def test_no_rows_give_empty_results_of_the_right_shapes() -> None:
    arm = mixed_arm()
    q, tension, wrench = problem(arm, 4)
    full = cdsm.evaluate(arm, q, tension, wrench, OUTPUTS, direction=DIRECTIONS)
    none = cdsm.evaluate(arm, q[:0], tension[:0], wrench[:0], OUTPUTS, direction=DIRECTIONS)
    assert len(none) == none.status.size == 0
    for name in OUTPUTS:
        assert none[name].shape == (0, *full[name].shape[1:])
    assert "0 postures" in str(none)
    pull = cdsm.distribute_tensions(arm, q[:0], 5.0)
    assert pull.values.shape == (0, len(arm.cables))
    assert cdsm.evaluate(arm, q[:0], pull).status.shape == (0,)
    assert cdsm.evaluate(arm, q, tension, outputs=()).ok.all()


# --- statuses -------------------------------------------------------------------------------


def only(batch: Batch, row: int) -> set[str]:
    """Which quantities of a row exist: all of it, or nothing."""
    exists = {name: ~np.isnan(batch[name][row]) for name in batch.outputs if name != "slack"}
    assert all(there.all() or not there.any() for there in exists.values())
    return {name for name, there in exists.items() if there.all()}


def everything(arm: cdsm.Manipulator, q: Any, tension: Any = None, **more: Any) -> Batch:
    wrench = np.array([1.0, -2.0, 0.5, 0.1, 0.2, -0.1])
    return cdsm.evaluate(arm, q, tension, wrench, OUTPUTS, direction=DIRECTIONS, **more)


POSED = {name for name in names_of("batch") if QUANTITIES[name].needs == "posture"}
PULLED = {*POSED, "residual", "active", "load", "tension"}


def test_row_beyond_joint_limits_is_empty_and_its_neighbours_are_not() -> None:
    arm = random_arm(1, 3)
    q, tension, _ = problem(arm, 3)
    q[1, 4] = arm.upper[4] + 1e-6
    q[2] = arm.upper + 5e-10  # rounding, as of a conversion from degrees
    batch = everything(arm, q, tension)
    np.testing.assert_array_equal(batch.status, [0, cdsm.Status.BEYOND_LIMITS, 0])
    assert only(batch, 1) == set()  # not even the given tensions: the arm is not there
    assert only(batch, 0) == {*OUTPUTS} - {"slack"}
    free = everything(arm, q, tension, check_limits=False)
    assert free.ok.all()
    pose = arm.at(q[1], check_limits=False)
    np.testing.assert_allclose(free["tip"][1], pose.tip, rtol=0.0, atol=1e-15)


def test_row_where_sites_coincide_is_empty() -> None:
    geometry = cdsm.Geometry(
        name="loop",
        base_length=0.02,
        hole_radius=0.03,
        joints=(cdsm.Joint(axes=((0.0, 0.0, 1.0),), disk_offset=0.01, limit=3.0),) * 2,
        links=(cdsm.Link(length=0.05, mass=0.1),) * 2,
        cables=(cdsm.CableRoute(joint=1, angle=0.0),),
    )
    sites = (cdsm.Site("base_disk", (0.02, 0.02, 0.0)), cdsm.Site("link1", (0.02, 0.0, 0.0)))
    arm = cdsm.Manipulator(geometry, cables=[cdsm.Cable("loop", sites, STEEL)])
    q = np.array([[1.5, 0.0], [math.pi / 2, 0.0], [1.5, 0.0]])
    batch = cdsm.evaluate(arm, q, [10.0], outputs=[*POSED, *PULLED - POSED, "passive"])
    np.testing.assert_array_equal(batch.status, [0, cdsm.Status.COINCIDENT_SITES, 0])
    assert only(batch, 1) == set()
    # and leaves nothing behind for the next
    for value in batch.values:
        np.testing.assert_array_equal(value[0], value[2])
    with pytest.raises(cdsm.InvalidInput, match=r"'loop': .*coincide at q = \[1\.57.*Move a site"):
        arm.at(q[1])
    pull = cdsm.distribute_tensions(arm, q, 5.0)
    assert pull.status[1] == cdsm.Status.COINCIDENT_SITES
    assert np.isnan(pull.values[1]).all()


def test_row_without_tensions_keeps_what_the_joint_angles_give() -> None:
    arm = random_arm(1, 3)
    q, _, _ = problem(arm, 3)
    low = np.full((3, len(arm.cables)), 10.0)
    high = np.full_like(low, np.inf)
    high[1] = 10.0
    batch = everything(arm, q, minimum=low, maximum=high)
    np.testing.assert_array_equal(batch.status, [0, cdsm.Status.INFEASIBLE, 0])
    assert only(batch, 1) == POSED
    W = batch.wrench
    with pytest.raises(cdsm.InfeasibleTension):
        cdsm.distribute_tension(arm.at(q[1]), low[1], high[1], W)
    # nothing that needs tensions is asked for: nothing fails
    assert cdsm.evaluate(arm, q, outputs=("tip",), minimum=low, maximum=high).ok.all()
    pull = cdsm.distribute_tensions(arm, q, low, high, W)
    assert pull.status[1] == cdsm.Status.INFEASIBLE
    assert cdsm.evaluate(arm, q, pull, outputs=("tip",)).ok.all()
    carried = cdsm.evaluate(arm, q, pull, outputs=("joint", "gravity"))
    np.testing.assert_array_equal(carried.status, pull.status)
    assert only(carried, 1) == {"gravity"}


@pytest.mark.parametrize("law", [STRAND_1X19, HARDENING], ids=["strand", "own"])
def test_tension_outside_the_elasticity_leaves_what_needs_no_stiffness(
    law: cdsm.Elasticity,
) -> None:
    arm = random_arm(1, 3, elasticity=law)
    q, tension, _ = problem(arm, 4)
    tension[1, 2] = 0.5
    tension[3, 0] = 900.0
    batch = everything(arm, q, tension)
    outside = cdsm.Status.OUTSIDE_ELASTICITY
    np.testing.assert_array_equal(batch.status, [0, outside, 0, outside])
    assert only(batch, 1) == only(batch, 3) == PULLED
    K = cdsm.stiffness(arm.at(q[2]), tension[2], batch.wrench)
    np.testing.assert_allclose(batch["joint"][2], K.joint, rtol=0.0, atol=1e-12 * K.joint.max())
    with pytest.raises(cdsm.ElasticityRangeError):
        cdsm.stiffness(arm.at(q[1]), tension[1])
    assert cdsm.evaluate(arm, q, tension, outputs=("active", "tip")).ok.all()


def slack_arm() -> cdsm.Manipulator:
    """Two hinges: steel by the first, and by the second motors that control force."""
    arm = random_arm(1, 2, "hinged").with_gravity((0.0, 0.0, 0.0))
    held = [replace(c, control="force") if i > 1 else c for i, c in enumerate(arm.cables)]
    return arm.with_cables(held)


def test_singular_stiffness_is_no_error_but_a_status() -> None:
    arm = slack_arm()
    q = np.array([[0.1, 0.2], [0.1, 0.2]])
    tension = np.array([[10.0, 10.0, 0.0, 0.0], [10.0, 10.0, 5.0, 5.0]])
    batch = cdsm.evaluate(arm, q, tension, outputs=OUTPUTS, direction=DIRECTIONS)
    # two joints: the tip is immobile in one direction
    np.testing.assert_array_equal(batch.status, [cdsm.Status.SINGULAR, cdsm.Status.IMMOBILE])
    assert not only(batch, 0) & {"along", "compliance", "cartesian"}
    assert {"margin", "joint", "active"} <= only(batch, 1)
    with pytest.raises(cdsm.SingularStiffness):
        _ = cdsm.stiffness(arm.at(q[0]), tension[0]).compliance
    assert cdsm.evaluate(arm, q, tension, outputs=("joint", "margin")).ok.all()


@pytest.mark.usefixtures("kernels")
def test_nearly_singular_stiffness_is_decided_as_for_the_single_posture() -> None:
    """Not singular by its singular values, though the probing torque moves it far."""
    arm = slack_arm()
    q = np.array([[0.1, 0.2]])
    tension = np.array([[1e-15, 1e-15, 1e-7, 1e-7]])  # just taut
    K = cdsm.stiffness(arm.at(q[0]), tension[0])
    values = np.linalg.svd(K.joint, compute_uv=False)
    assert 1e-13 < values[-1] / values[0] < 1e-10
    names = ("along", "compliance", "joint")
    for u in (DIRECTIONS, DIRECTIONS[0]):
        batch = cdsm.evaluate(arm, q, tension, outputs=names, direction=u)
        assert batch.ok.all()
        np.testing.assert_allclose(batch["compliance"][0], K.compliance, rtol=1e-12)
        alone = np.reshape([K.along(d) for d in np.atleast_2d(u)], u.shape[:-1])
        assert batch["along"].shape == (1, *alone.shape)
        np.testing.assert_allclose(batch["along"][0], alone, rtol=1e-12)
    immobile = cdsm.evaluate(arm, q, tension, outputs=("pseudoinverse", "compliance"))
    assert immobile.status[0] == cdsm.Status.IMMOBILE
    assert only(immobile, 0) == {"compliance"}


# --- bad input ------------------------------------------------------------------------------

ARM = random_arm(1, 2)
Q, F, _ = problem(ARM, 3)
C = len(ARM.cables)


def changed(array: Array, row: int, column: int, value: float) -> Array:
    array = array.copy()
    array[row, column] = value
    return array


BELOW = changed(10.0 + 0.0 * F, 1, 2, 4.0)
SKEW: Any = {"outputs": ("along",), "direction": np.eye(3, k=1)}
BAD: dict[str, tuple[Callable[[], object], tuple[str, ...]]] = {
    "one posture": (lambda: cdsm.evaluate(ARM, Q[0], F), ("q: shape (4,)", "(B, 4)")),
    "q NaN": (lambda: cdsm.evaluate(ARM, changed(Q, 1, 2, math.nan), F), ("[1, 2] is nan",)),
    "tension short": (lambda: cdsm.evaluate(ARM, Q, F[:2]), (f"shape (2, {C})", f"(3, {C})")),
    "tension negative": (
        lambda: cdsm.evaluate(ARM, Q, changed(F, 2, 1, -1.5)),
        ("tension: -1.5 N", ARM.cables[1].name, "in row 2"),
    ),
    "no tension": (lambda: cdsm.evaluate(ARM, Q), ("tension: ", "depends on it", "minimum=")),
    "both": (lambda: cdsm.evaluate(ARM, Q, F, minimum=1.0), ("minimum", "not both")),
    "tensions of elsewhere": (
        lambda: cdsm.evaluate(ARM, Q, cdsm.distribute_tensions(ARM, 0.5 * Q)),
        ("tension: was distributed at other postures",),
    ),
    "tensions of another arm": (
        lambda: cdsm.evaluate(ARM.with_gravity("z"), Q, cdsm.distribute_tensions(ARM, Q)),
        ("tension: was distributed for another arm",),
    ),
    "output": (lambda: cdsm.evaluate(ARM, Q, F, outputs=("complience",)), ("'compliance'",)),
    "no direction": (lambda: cdsm.evaluate(ARM, Q, F, outputs=("along",)), ("direction", "both")),
    "zero": (lambda: cdsm.evaluate(ARM, Q, F, **SKEW), ("direction[2]: is the zero vector",)),
    "no threads": (lambda: cdsm.evaluate(ARM, Q, F, threads=0), ("threads: 0", "from 1 on")),
    "maximum below minimum": (
        lambda: cdsm.distribute_tensions(ARM, Q, 5.0, BELOW),
        ("maximum: 4 N", ARM.cables[2].name, "in row 1", "below 5 N"),
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_named(name: str) -> None:
    call, said = BAD[name]
    with pytest.raises(cdsm.InvalidInput) as caught:
        call()
    for part in said:
        assert part in str(caught.value)
