"""Bad input: the right error, which names the offender, the value and the remedy; never NaN."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array
from tests.support.arms import (
    STEEL,
    random_arm,
    random_posture,
)

Case = tuple[Callable[[], object], type[cdsm.CdsmError], tuple[str, ...]]

ARM = random_arm(1, 3)
POSE = random_posture(ARM, 1)
C = len(ARM.cables)
PULL = cdsm.distribute_tension(POSE, minimum=10.0)
K = cdsm.stiffness(POSE, PULL)
GEOMETRY = ARM.geometry
BASE = cdsm.Site("base_disk", (0.0, 0.01, 0.0))
END = cdsm.Site("link1", (0.01, 0.01, 0.0))
STRAND_ARM = cdsm.presets.virtual_prototype()
STRAND_POSE = STRAND_ARM.at(np.full(10, 0.1))

ANY: Any = None
NAN, INF = math.nan, math.inf


def except_at(size: int, index: int, value: object, fill: float = 0.0) -> list[Any]:
    numbers: list[Any] = [fill] * size
    numbers[index] = value
    return numbers


# what is not a vector of six finite real numbers, and what the message says of it
NOT_SIX_NUMBERS: dict[str, tuple[Any, tuple[str, ...]]] = {
    "too short": ([0.0] * 5, ("shape (5,) given", "(6,) needed")),
    "scalar": (0.0, ("shape () given", "(6,) needed")),
    "row": (np.zeros((1, 6)), ("shape (1, 6) given", "(6,) needed")),
    "NaN": (except_at(6, 2, NAN), ("entry [2] is nan", "finite numbers")),
    "minus infinite": (except_at(6, 4, -INF), ("entry [4] is -inf", "finite numbers")),
    "strings": (["0.1"] * 6, ("<U3", "real numbers")),
    "complex": (np.zeros(6, complex), ("complex128", "real numbers")),
    "None": (None, ("object", "real numbers")),
    "bool": ([True] * 6, ("bool", "real numbers")),
    "ragged": ([[0.0], [0.0, 1.0]], ("not an array of numbers",)),
    "dictionary": ({"joint1_1": 0.1}, ("a dict given", "its numbers alone")),
}

CASES: dict[str, Case] = {}
for what, (given, said) in NOT_SIX_NUMBERS.items():
    CASES[f"q {what}"] = (lambda v=given: ARM.at(v), cdsm.InvalidInput, ("q: ", *said))  # type: ignore[misc]
    CASES[f"wrench to balance {what}"] = (
        lambda v=given: cdsm.distribute_tension(POSE, wrench=v),  # type: ignore[misc]
        cdsm.InvalidInput,
        ("wrench: ", *said),
    )
    if given is not None:
        CASES[f"wrench {what}"] = (
            lambda v=given: cdsm.stiffness(POSE, [1.0] * C, v),  # type: ignore[misc]
            cdsm.InvalidInput,
            ("wrench: ", *said),
        )

CASES |= {
    # --- Manipulator
    "geometry a number": (
        lambda: cdsm.Manipulator(3, STEEL),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("geometry: 3", "Geometry is needed"),
    ),
    "elasticity and cables": (
        lambda: cdsm.Manipulator(GEOMETRY, STEEL, cables=ARM.cables),
        cdsm.InvalidInput,
        ("elasticity", "one of elasticity=", "cables="),
    ),
    "neither elasticity nor cables": (
        lambda: cdsm.Manipulator(GEOMETRY),
        cdsm.InvalidInput,
        ("elasticity", "one of elasticity=", "cables="),
    ),
    "elasticity a number": (
        lambda: cdsm.Manipulator(GEOMETRY, 2e5),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("elasticity: 200000.0", "an Elasticity is needed: LinearElasticity(EA)"),
    ),
    "elasticity a function": (
        lambda: cdsm.Manipulator(GEOMETRY, lambda F: 5e4),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("elasticity: <function", "Elasticity.from_rigidity(EA, low, high)"),
    ),
    "elasticity a name": (
        lambda: cdsm.Manipulator(GEOMETRY, "1x19-1.2mm"),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("elasticity: '1x19-1.2mm'", "only in files, and by wire= of Manipulator.read"),
    ),
    "too few elasticities": (
        lambda: cdsm.Manipulator(GEOMETRY, [STEEL]),
        cdsm.InvalidInput,
        ("elasticity", f"1 for each of {C}"),
    ),
    "gravity of two": (
        lambda: cdsm.Manipulator(GEOMETRY, STEEL, gravity=(0.0, -9.81)),
        cdsm.InvalidInput,
        ("gravity: shape (2,)", "(3,) needed", "m/s²"),
    ),
    "gravity NaN": (
        lambda: cdsm.Manipulator(GEOMETRY, STEEL, gravity=(0.0, 0.0, NAN)),
        cdsm.InvalidInput,
        ("gravity: entry [2] is nan",),
    ),
    "no cables": (
        lambda: cdsm.Manipulator(GEOMETRY, cables=()),
        cdsm.InvalidInput,
        ("cables: none given", "at least one"),
    ),
    "cables a number": (
        lambda: cdsm.Manipulator(GEOMETRY, cables=3),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("cables: 3", "Cable is needed"),
    ),
    "cables without a path": (
        lambda: ARM.with_cables(""),
        cdsm.FileError,
        ("'': is an empty path", "give a file or folder"),
    ),
    "a URDF of bytes": (
        lambda: cdsm.Manipulator.from_urdf(ARM.urdf.encode(), ARM.cables, tip="tool0"),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("urdf: b'<?xml", "the path of a URDF or its text needed"),
    ),
    "duplicate cable names": (
        lambda: cdsm.Manipulator(GEOMETRY, cables=[cdsm.Cable("a", (BASE, END), STEEL)] * 2),
        cdsm.InvalidInput,
        ("cable 'a'", "used twice", "its own"),
    ),
    "unknown link": (
        lambda: cdsm.Manipulator(
            GEOMETRY,
            cables=[cdsm.Cable("a", (BASE, cdsm.Site("lnk1", (0.0, 0.0, 0.0))), STEEL)],
        ),
        cdsm.InvalidInput,
        ("cable 'a'", "'lnk1'", "did you mean 'link1'", "Known: base_link, base_disk"),
    ),
    "coincident sites on one link": (
        lambda: cdsm.Manipulator(GEOMETRY, cables=[cdsm.Cable("a", (BASE, BASE, END), STEEL)]),
        cdsm.InvalidInput,
        ("cable 'a'", "sites 1 and 2 coincide", "leave one out"),
    ),
    # --- Site and Cable
    "site link a number": (
        lambda: cdsm.Site(3, (0.0, 0.0, 0.0)),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("link: 3", "a name is needed"),
    ),
    "site of two numbers": (
        lambda: cdsm.Site("link1", (0.0, 0.0)),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("position: shape (2,)", "(3,) needed", "link1"),
    ),
    "site NaN": (
        lambda: cdsm.Site("link1", (0.0, NAN, 0.0)),
        cdsm.InvalidInput,
        ("position: entry [1] is nan",),
    ),
    "cable without a name": (
        lambda: cdsm.Cable("", (BASE, END), STEEL),
        cdsm.InvalidInput,
        ("name: ", "a name is needed"),
    ),
    "cable of one site": (
        lambda: cdsm.Cable("a", (BASE,), STEEL),
        cdsm.InvalidInput,
        ("cable 'a'", "sites: 1 given", "two or more"),
    ),
    "cable elasticity a number": (
        lambda: cdsm.Cable("a", (BASE, END), 2e5),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("cable 'a'", "elasticity: 200000.0", "Elasticity is needed"),
    ),
    "unknown control": (
        lambda: cdsm.Cable("a", (BASE, END), STEEL, control="frce"),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("cable 'a'", "'frce'", "did you mean 'force'?"),
    ),
    "series stiffness of none": (
        lambda: cdsm.Cable("a", (BASE, END), STEEL, series_stiffness=0.0),
        cdsm.InvalidInput,
        ("cable 'a'", "series_stiffness: 0 N/m", "or inf is needed"),
    ),
    "series stiffness negative": (
        lambda: cdsm.Cable("a", (BASE, END), STEEL, series_stiffness=-INF),
        cdsm.InvalidInput,
        ("cable 'a'", "series_stiffness: -inf"),
    ),
    **{
        f"lead {value!r}": (
            lambda v=value: cdsm.Cable("a", (BASE, END), STEEL, lead=v),  # type: ignore[misc]
            cdsm.InvalidInput,
            ("cable 'a'", "lead"),
        )
        for value in (-1.0, NAN, [1.0, 2.0], "x", None)
    },
    # --- serpentine_cables
    "cables of too few elasticities": (
        lambda: cdsm.serpentine_cables(GEOMETRY, [STEEL] * (C - 1)),
        cdsm.InvalidInput,
        ("elasticity", f"1 for each of {C}"),
    ),
    # --- Posture
    "pose of an unknown link": (
        lambda: POSE.link_pose("tol0"),
        cdsm.InvalidInput,
        ("no link", "'tol0'", "did you mean 'tool0'?", "Known: base_link"),
    ),
    "pose of a number": (lambda: POSE.link_pose(3), cdsm.InvalidInput, ("no link", "3")),  # type: ignore[arg-type]
    # --- distribute_tension
    "distribute at a number": (
        lambda: cdsm.distribute_tension(3),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("pose: 3", "Posture is needed"),
    ),
    "minimum negative": (
        lambda: cdsm.distribute_tension(POSE, minimum=except_at(C, 3, -1.0)),
        cdsm.InvalidInput,
        ("minimum: -1 N", ARM.cables[3].name, "not negative"),
    ),
    "minimum infinite": (
        lambda: cdsm.distribute_tension(POSE, minimum=INF),
        cdsm.InvalidInput,
        ("minimum: inf N", "finite"),
    ),
    "minimum NaN": (
        lambda: cdsm.distribute_tension(POSE, minimum=NAN),
        cdsm.InvalidInput,
        ("minimum", "entry [0] is nan", "give newtons"),
    ),
    "maximum NaN": (
        lambda: cdsm.distribute_tension(POSE, maximum=except_at(C, 0, NAN, 5.0)),
        cdsm.InvalidInput,
        ("maximum", "entry [0] is nan", "or inf"),
    ),
    "maximum below minimum": (
        lambda: cdsm.distribute_tension(POSE, minimum=5.0, maximum=except_at(C, 2, 3.0, 9.0)),
        cdsm.InvalidInput,
        ("maximum: 3 N", ARM.cables[2].name, "below 5 N", "raise the one or lower the other"),
    ),
    "minimum too short": (
        lambda: cdsm.distribute_tension(POSE, minimum=[1.0, 2.0]),
        cdsm.InvalidInput,
        ("minimum: shape (2,)", f"({C},)"),
    ),
    "maximum of two axes": (
        lambda: cdsm.distribute_tension(POSE, maximum=np.ones((1, C))),
        cdsm.InvalidInput,
        (f"maximum: shape (1, {C})", f"({C},)"),
    ),
    **{
        f"{name} {value!r:.10}": (
            lambda n=name, v=value: cdsm.distribute_tension(POSE, **{n: v}),  # type: ignore[misc]
            cdsm.InvalidInput,
            (f"{name}: ", part),
        )
        for name in ("minimum", "maximum")
        for value, part in (
            ("5", "real numbers"),
            (None, "real numbers"),
        )
    },
    "unknown solver": (
        lambda: cdsm.distribute_tension(POSE, solver="dapq"),
        cdsm.InvalidInput,
        ("solver", "'dapq'", "did you mean 'daqp'?", "Known: "),
    ),
    # --- stiffness
    "stiffness at None": (
        lambda: cdsm.stiffness(ANY, PULL),
        cdsm.InvalidInput,
        ("pose: None", "Posture is needed"),
    ),
    "tension scalar": (
        lambda: cdsm.stiffness(POSE, 5.0),
        cdsm.InvalidInput,
        ("tension: shape ()", f"({C},) needed", "one tension [N] per cable"),
    ),
    "tension too long": (
        lambda: cdsm.stiffness(POSE, [1.0] * (C + 1)),
        cdsm.InvalidInput,
        (f"tension: shape ({C + 1},)", f"({C},) needed"),
    ),
    "tension NaN": (
        lambda: cdsm.stiffness(POSE, except_at(C, 3, NAN)),
        cdsm.InvalidInput,
        ("tension: entry [3] is nan",),
    ),
    "tension negative": (
        lambda: cdsm.stiffness(POSE, except_at(C, 5, -2.5, 1.0)),
        cdsm.InvalidInput,
        ("tension: -2.5 N", ARM.cables[5].name, "only pull"),
    ),
    "tension of another posture": (
        lambda: cdsm.stiffness(ARM.at(0.5 * POSE.q), PULL),
        cdsm.InvalidInput,
        ("tension", "another posture", "distribute it at this one"),
    ),
    "tension of another arm at the same angles": (
        lambda: cdsm.stiffness(
            cdsm.Manipulator(GEOMETRY, STEEL, gravity=(0.0, 0.0, 1.0)).at(POSE.q), PULL
        ),
        cdsm.InvalidInput,
        ("tension: was distributed for another arm", "with_gravity"),
    ),
    "tension as a dict": (
        lambda: cdsm.stiffness(POSE, dict(PULL)),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("tension: a dict given", "its numbers alone, in order"),
    ),
    "wrench beside a Tension": (
        lambda: cdsm.stiffness(POSE, PULL, np.zeros(6)),
        cdsm.InvalidInput,
        ("wrench", "comes with the Tension", "leave it out"),
    ),
    "tension beyond the elasticity": (
        lambda: cdsm.stiffness(STRAND_POSE, except_at(15, 14, 900.0, 50.0)),
        cdsm.ElasticityRangeError,
        ("900 N", STRAND_ARM.cables[14].name, "[2.2 N, 810 N]", "maximum="),
    ),
    "distributed tension below the elasticity": (
        lambda: cdsm.stiffness(STRAND_POSE, cdsm.distribute_tension(STRAND_POSE)),
        cdsm.ElasticityRangeError,
        ("cable cable", "[2.2 N, 810 N]", "minimum="),
    ),
    # --- Stiffness
    **{
        f"{method} {value!r:.20}": (
            lambda m=method, v=value: getattr(K, m)(v),  # type: ignore[misc]
            cdsm.InvalidInput,
            ("direction: ", part),
        )
        for method in ("along", "shares")
        for value, part in (
            ((0.0, 0.0, 0.0), "zero vector"),
            ((1.0, 0.0), "shape (2,)"),
            ((NAN, 0.0, 1.0), "entry [0] is nan"),
            (None, "real numbers"),
        )
    },
    "unknown term": (
        lambda: K.pseudoinverse("activ"),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        (
            "stiffness term",
            "'activ'",
            "did you mean 'active'?",
            "passive, gravity, load, springs, joint",
        ),
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_bad_input_is_named_with_its_value_and_a_remedy(case: str) -> None:
    call, kind, said = CASES[case]
    with pytest.raises(kind) as caught:
        call()
    assert type(caught.value) is kind
    for part in said:
        assert part in str(caught.value)


# --- good input in odd dress ----------------------------------------------------------------

EIGHTHS = np.array([1.0, -2.0, 3.0, 0.0, -1.0, 2.0]) / 8.0
DRESSES: dict[str, Callable[[Array], Any]] = {
    "big-endian": lambda q: q.astype(">f8"),
    "float32": lambda q: q.astype(np.float32),
    "strided": lambda q: np.repeat(q, 2)[::2],
    "list": lambda q: q.tolist(),
    "tuple of numpy numbers": tuple,
}


def read_only(q: Array) -> Array:
    q = q.copy()
    q.flags.writeable = False
    return q


@pytest.mark.parametrize("dress", [*DRESSES, "read-only"])
def test_angles_in_any_dress_give_the_native_answer(dress: str) -> None:
    q = {**DRESSES, "read-only": read_only}[dress](EIGHTHS)
    plain, pose = ARM.at(EIGHTHS), ARM.at(q)
    for name in ("q", "tip", "jacobian", "cable_lengths", "length_jacobian", "gravity_torque"):
        np.testing.assert_array_equal(getattr(pose, name), getattr(plain, name))
    assert pose.q.dtype == np.dtype(np.float64)
    assert pose.q.dtype.isnative


@pytest.mark.parametrize("kind", [np.int8, np.int64, int])
def test_integer_angles_give_the_native_answer(kind: Any) -> None:
    ones = np.ones(6)
    np.testing.assert_array_equal(
        ARM.at(ones.astype(kind), check_limits=False).tip, ARM.at(ones, check_limits=False).tip
    )


@pytest.mark.parametrize("dress", [*DRESSES, "read-only"])
def test_bounds_wrench_and_tension_in_any_dress_give_the_native_answer(dress: str) -> None:
    wear = {**DRESSES, "read-only": read_only}[dress]
    low, high, wrench = np.full(C, 8.0), np.full(C, 4096.0), np.array([1.0, -2, 0.5, 0, 0.25, 0])
    plain = cdsm.distribute_tension(POSE, low, high, wrench)
    pull = cdsm.distribute_tension(POSE, wear(low), wear(high), wear(wrench))
    np.testing.assert_array_equal(pull.values, plain.values)
    np.testing.assert_array_equal(
        cdsm.stiffness(POSE, wear(low), wear(wrench)).joint,
        cdsm.stiffness(POSE, low, wrench).joint,
    )


def test_later_changes_to_the_callers_arrays_change_nothing() -> None:
    q, low, wrench = EIGHTHS.copy(), np.full(C, 8.0), np.ones(6)
    pose = ARM.at(q)
    pull = cdsm.distribute_tension(pose, low, wrench=wrench)
    own = cdsm.stiffness(pose, low, wrench)
    for array in (q, low, wrench):
        assert array.flags.writeable
        array[:] = 77.0
    assert (pose.q == EIGHTHS).all()
    assert (pull.minimum == 8.0).all()
    assert (own.tension == 8.0).all()
    assert (pull.wrench == 1.0).all()
    assert (own.wrench == 1.0).all()


OUT_OF_RANGE: dict[str, tuple[Callable[[], object], str]] = {
    "gravity": (
        lambda: cdsm.Manipulator(GEOMETRY, STEEL, gravity=(0.0, 0.0, -9810.0)),
        r"gravity: entry \[2\] is -9810; finite numbers up to 1000 m/s²",
    ),
    "angles": (lambda: ARM.at(np.full(6, 1e300), check_limits=False), r"q: .* up to 1e\+15"),
    "wrench": (lambda: cdsm.stiffness(POSE, np.ones(C), np.full(6, 1e10)), r"wrench: .* 1e\+09 N"),
    "tension": (lambda: cdsm.stiffness(POSE, np.full(C, 1e10)), r"tension: .* up to 1e\+09 N"),
    "minimum": (
        lambda: cdsm.distribute_tension(POSE, minimum=1e10),
        r"minimum: .* is 1e\+10; give newtons from 1e-09 to 1e\+09, 0 or inf",
    ),
    "fixed": (
        lambda: cdsm.distribute_tension(POSE, fixed={"cable1_1": 1e10}),
        r"fixed\['cable1_1'\]: 1e\+10 N given; 0, or 1e-09 to 1e\+09 N",
    ),
    "rigidity": (lambda: cdsm.LinearElasticity(1e13), r"1e\+13 N given; 1e-06 to 1e\+12 N"),
    "site": (lambda: cdsm.Site("link1", (0.0, 1e5, 0.0)), r"position: .* up to 10000 m"),
    "link": (lambda: cdsm.Link(length=1e5, mass=0.1), r"length: 100000 m given; 1e-06 to 10000 m"),
    "mass": (lambda: cdsm.Link(length=0.1, mass=1e7), r"1e\+07 kg given; 0, or 1e-09 to 1e\+06 kg"),
}


@pytest.mark.parametrize("case", OUT_OF_RANGE)
def test_what_no_machine_has_is_refused_with_the_range(case: str) -> None:
    call, message = OUT_OF_RANGE[case]
    with pytest.raises(cdsm.CdsmError, match=message):
        call()
