"""Bad input: the right error, which names the offender, the value and the remedy; never NaN."""

import math
import re
import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import qpsolvers
import scipy.linalg
from scipy.optimize import linprog

import cdsm
from cdsm.kernels import tension as tension_kernels
from cdsm.kernels.tension import DISTANCE, OPTIMALITY
from cdsm.support.validation import Array
from cdsm.tension import _polished, _shortfall
from tests.support import foreign
from tests.support.arms import (
    STEEL,
    mixed_arm,
    random_arm,
    random_posture,
    random_tension,
    random_wrench,
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
    "too long": ([0.0] * 7, ("shape (7,) given", "(6,) needed")),
    "empty": ([], ("shape (0,) given", "(6,) needed")),
    "scalar": (0.0, ("shape () given", "(6,) needed")),
    "row": (np.zeros((1, 6)), ("shape (1, 6) given", "(6,) needed")),
    "column": (np.zeros((6, 1)), ("shape (6, 1) given", "(6,) needed")),
    "NaN": (except_at(6, 2, NAN), ("entry [2] is nan", "finite numbers")),
    "infinite": (except_at(6, 4, INF), ("entry [4] is inf", "finite numbers")),
    "minus infinite": (except_at(6, 4, -INF), ("entry [4] is -inf", "finite numbers")),
    "longdouble beyond float": (
        np.full(6, np.finfo(np.longdouble).max),
        ("entry [0] is inf", "finite numbers"),
    ),
    "masked": (np.ma.masked_array(np.zeros(6), except_at(6, 1, 1)), ("masked", "fill or drop")),
    "masked entry in a list": (except_at(6, 1, np.ma.masked), ()),
    "strings": (["0.1"] * 6, ("<U3", "real numbers")),
    "string": ("joint", ("<U5", "real numbers")),
    "bytes": ([b"1"] * 6, ("S1", "real numbers")),
    "complex": (np.zeros(6, complex), ("complex128", "real numbers")),
    "object": (np.zeros(6, object), ("object", "real numbers")),
    "None": (None, ("object", "real numbers")),
    "None inside": (except_at(6, 0, None), ("object", "real numbers")),
    "bool": ([True] * 6, ("bool", "real numbers")),
    "dates": (np.zeros(6, "M8[s]"), ("datetime64", "real numbers")),
    "record": (np.zeros(6, [("a", float)]), ("'a'", "real numbers")),
    "ragged": ([[0.0], [0.0, 1.0]], ("not an array of numbers",)),
    "huge integers": ([10**400] * 6, ("object", "real numbers")),
    "dictionary": ({"joint1_1": 0.1}, ("object", "real numbers")),
    "generator": ((x for x in range(6)), ("object", "real numbers")),
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
        ("elasticity: 200000.0", "one Elasticity", str(C)),
    ),
    "too few elasticities": (
        lambda: cdsm.Manipulator(GEOMETRY, [STEEL]),
        cdsm.InvalidInput,
        ("elasticity", f"one for each of {C}"),
    ),
    "elasticities that are none": (
        lambda: cdsm.Manipulator(GEOMETRY, [1.0] * C),  # type: ignore[list-item]
        cdsm.CableError,
        ("cable1_1", "elasticity: 1.0", "Elasticity is needed"),
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
    "gravity a number": (
        lambda: cdsm.Manipulator(GEOMETRY, STEEL, gravity=-9.81),
        cdsm.InvalidInput,
        ("gravity: shape ()",),
    ),
    "no cables": (
        lambda: cdsm.Manipulator(GEOMETRY, cables=()),
        cdsm.InvalidInput,
        ("cables: none given", "at least one"),
    ),
    "cables that are none": (
        lambda: cdsm.Manipulator(GEOMETRY, cables=(1,)),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("cables: ", "Cable is needed"),
    ),
    "cables a number": (
        lambda: cdsm.Manipulator(GEOMETRY, cables=3),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("cables: 3", "Cable is needed"),
    ),
    "one cable instead of a list": (
        lambda: cdsm.Manipulator(GEOMETRY, cables=ARM.cables[0]),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("cables: ", "Cable is needed"),
    ),
    "duplicate cable names": (
        lambda: cdsm.Manipulator(GEOMETRY, cables=[cdsm.Cable("a", (BASE, END), STEEL)] * 2),
        cdsm.CableError,
        ("cable 'a'", "used twice", "its own"),
    ),
    "unknown link": (
        lambda: cdsm.Manipulator(
            GEOMETRY,
            cables=[cdsm.Cable("a", (BASE, cdsm.Site("lnk1", (0.0, 0.0, 0.0))), STEEL)],
        ),
        cdsm.CableError,
        ("cable 'a'", "'lnk1'", "did you mean 'link1'", "Known: base_link, base_disk"),
    ),
    "joint instead of a link": (
        lambda: cdsm.Manipulator(
            GEOMETRY,
            cables=[cdsm.Cable("a", (BASE, cdsm.Site("joint1_1", (0.0, 0.0, 0.0))), STEEL)],
        ),
        cdsm.CableError,
        ("cable 'a'", "'joint1_1'", "Known: base_link"),
    ),
    "coincident sites on one link": (
        lambda: cdsm.Manipulator(GEOMETRY, cables=[cdsm.Cable("a", (BASE, BASE, END), STEEL)]),
        cdsm.CableError,
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
    "site text": (lambda: cdsm.Site("link1", "xyz"), cdsm.InvalidInput, ("position",)),  # type: ignore[arg-type]
    "cable without a name": (
        lambda: cdsm.Cable("", (BASE, END), STEEL),
        cdsm.CableError,
        ("name: ", "a name is needed"),
    ),
    "cable name a number": (
        lambda: cdsm.Cable(3, (BASE, END), STEEL),  # type: ignore[arg-type]
        cdsm.CableError,
        ("name: ", "a name is needed"),
    ),
    "cable of one site": (
        lambda: cdsm.Cable("a", (BASE,), STEEL),
        cdsm.CableError,
        ("cable 'a'", "sites: 1 given", "two or more"),
    ),
    "cable of numbers": (
        lambda: cdsm.Cable("a", (1, 2), STEEL),  # type: ignore[arg-type]
        cdsm.CableError,
        ("cable 'a'", "sites", "Site"),
    ),
    "cable sites a number": (
        lambda: cdsm.Cable("a", 3, STEEL),  # type: ignore[arg-type]
        cdsm.CableError,
        ("cable 'a'", "sites", "Site"),
    ),
    "cable sites one site": (
        lambda: cdsm.Cable("a", BASE, STEEL),  # type: ignore[arg-type]
        cdsm.CableError,
        ("cable 'a'", "sites", "Site"),
    ),
    "cable elasticity a number": (
        lambda: cdsm.Cable("a", (BASE, END), 2e5),  # type: ignore[arg-type]
        cdsm.CableError,
        ("cable 'a'", "elasticity: 200000.0", "Elasticity is needed"),
    ),
    "unknown control": (
        lambda: cdsm.Cable("a", (BASE, END), STEEL, control="frce"),  # type: ignore[arg-type]
        cdsm.CableError,
        ("cable 'a'", "'frce'", "did you mean 'force'?"),
    ),
    "series stiffness of none": (
        lambda: cdsm.Cable("a", (BASE, END), STEEL, series_stiffness=0.0),
        cdsm.CableError,
        ("cable 'a'", "series_stiffness: 0 N/m", "or inf is needed"),
    ),
    "series stiffness negative": (
        lambda: cdsm.Cable("a", (BASE, END), STEEL, series_stiffness=-INF),
        cdsm.CableError,
        ("cable 'a'", "series_stiffness: -inf"),
    ),
    "series stiffness NaN": (
        lambda: cdsm.Cable("a", (BASE, END), STEEL, series_stiffness=NAN),
        cdsm.CableError,
        ("cable 'a'", "series_stiffness: nan"),
    ),
    "series stiffness of two": (
        lambda: cdsm.Cable("a", (BASE, END), STEEL, series_stiffness=[1.0, 2.0]),  # type: ignore[arg-type]
        cdsm.CableError,
        ("cable 'a'", "series_stiffness", "one number"),
    ),
    **{
        f"lead {value!r}": (
            lambda v=value: cdsm.Cable("a", (BASE, END), STEEL, lead=v),  # type: ignore[misc]
            cdsm.CableError,
            ("cable 'a'", "lead"),
        )
        for value in (-1.0, NAN, INF, [1.0], [1.0, 2.0], "x", None, 1j, True)
    },
    # --- serpentine_cables
    "cables of a number": (
        lambda: cdsm.serpentine_cables(3, STEEL),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("geometry", "3"),
    ),
    "cables of no elasticity": (
        lambda: cdsm.serpentine_cables(GEOMETRY, None),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("elasticity: None", "one Elasticity"),
    ),
    "cables of too few elasticities": (
        lambda: cdsm.serpentine_cables(GEOMETRY, [STEEL] * (C - 1)),
        cdsm.InvalidInput,
        ("elasticity", f"one for each of {C}"),
    ),
    "cables of unknown control": (
        lambda: cdsm.serpentine_cables(GEOMETRY, STEEL, control="forces"),  # type: ignore[arg-type]
        cdsm.CableError,
        ("cable1_1", "'forces'", "did you mean 'force'?"),
    ),
    "cables of negative series stiffness": (
        lambda: cdsm.serpentine_cables(GEOMETRY, STEEL, series_stiffness=-1.0),
        cdsm.CableError,
        ("cable1_1", "series_stiffness: -1 N/m"),
    ),
    # --- Posture
    "pose of an unknown link": (
        lambda: POSE.link_pose("tol0"),
        cdsm.UnknownName,
        ("no link", "'tol0'", "did you mean 'tool0'?", "Known: base_link"),
    ),
    "pose of a joint": (lambda: POSE.link_pose("joint1_1"), cdsm.UnknownName, ("'joint1_1'",)),
    "pose of the universe": (lambda: POSE.link_pose("universe"), cdsm.UnknownName, ("universe",)),
    "pose of a number": (lambda: POSE.link_pose(3), cdsm.UnknownName, ("no link", "3")),  # type: ignore[arg-type]
    "pose of None": (lambda: POSE.link_pose(ANY), cdsm.UnknownName, ("no link", "None")),
    # --- distribute_tension
    "distribute at a number": (
        lambda: cdsm.distribute_tension(3),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("pose: 3", "Posture is needed"),
    ),
    "distribute at an arm": (
        lambda: cdsm.distribute_tension(ARM),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("pose", "Posture is needed"),
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
    "minimum minus infinite": (
        lambda: cdsm.distribute_tension(POSE, minimum=-INF),
        cdsm.InvalidInput,
        ("minimum: -inf N", "not negative"),
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
    "maximum minus infinite": (
        lambda: cdsm.distribute_tension(POSE, maximum=-INF),
        cdsm.InvalidInput,
        ("maximum: -inf N", "below its minimum"),
    ),
    "maximum below minimum": (
        lambda: cdsm.distribute_tension(POSE, minimum=5.0, maximum=except_at(C, 2, 3.0, 9.0)),
        cdsm.InvalidInput,
        ("maximum: 3 N", ARM.cables[2].name, "minimum of 5 N", "raise maximum or lower minimum"),
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
            (1j, "real numbers"),
            (True, "real numbers"),
            (np.ma.zeros(C), "masked"),
        )
    },
    "unknown solver": (
        lambda: cdsm.distribute_tension(POSE, solver="dapq"),
        cdsm.UnknownName,
        ("solver", "'dapq'", "did you mean 'daqp'?", "Known: "),
    ),
    "solver None": (
        lambda: cdsm.distribute_tension(POSE, solver=ANY),
        cdsm.UnknownName,
        ("solver", "None", "Known: "),
    ),
    "solver a list": (
        lambda: cdsm.distribute_tension(POSE, solver=["daqp"]),  # type: ignore[arg-type]
        cdsm.UnknownName,
        ("solver", "['daqp']", "Known: "),
    ),
    # --- stiffness
    "stiffness at None": (
        lambda: cdsm.stiffness(ANY, PULL),
        cdsm.InvalidInput,
        ("pose: None", "Posture is needed"),
    ),
    "stiffness at an arm": (
        lambda: cdsm.stiffness(ARM, PULL),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("pose", "Posture is needed"),
    ),
    "tension None": (lambda: cdsm.stiffness(POSE, ANY), cdsm.InvalidInput, ("tension: ",)),
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
    "tension infinite": (
        lambda: cdsm.stiffness(POSE, except_at(C, 3, INF)),
        cdsm.InvalidInput,
        ("tension: entry [3] is inf",),
    ),
    "tension negative": (
        lambda: cdsm.stiffness(POSE, except_at(C, 5, -2.5, 1.0)),
        cdsm.InvalidInput,
        ("tension: -2.5 N", ARM.cables[5].name, "only pull"),
    ),
    "tension a little negative": (
        lambda: cdsm.stiffness(POSE, except_at(C, 2, -1e-3, 1.0)),
        cdsm.InvalidInput,
        ("tension: -0.001 N", ARM.cables[2].name, "only pull"),
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
        ("tension", "another posture"),
    ),
    "wrench beside a Tension": (
        lambda: cdsm.stiffness(POSE, PULL, np.zeros(6)),
        cdsm.InvalidInput,
        ("wrench", "comes with the Tension", "leave it out"),
    ),
    "tension beyond the elasticity": (
        lambda: cdsm.stiffness(STRAND_POSE, except_at(15, 14, 900.0, 50.0)),
        cdsm.ElasticityRangeError,
        ("900 N", STRAND_ARM.cables[14].name, "(2.2 N, 810 N]", "maximum="),
    ),
    "distributed tension below the elasticity": (
        lambda: cdsm.stiffness(STRAND_POSE, cdsm.distribute_tension(STRAND_POSE)),
        cdsm.ElasticityRangeError,
        ("cable cable", "(2.2 N, 810 N]", "minimum="),
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
            ((0.0, INF, 1.0), "entry [1] is inf"),
            ("x", "real numbers"),
            (None, "real numbers"),
            (0, "shape ()"),
        )
    },
    "unknown term": (
        lambda: K.pseudoinverse("activ"),  # type: ignore[arg-type]
        cdsm.UnknownName,
        ("stiffness term", "'activ'", "did you mean 'active'?", "passive, gravity, load, joint"),
    ),
    "term None": (lambda: K.pseudoinverse(ANY), cdsm.UnknownName, ("None", "Known: active")),
    "private term": (lambda: K.pseudoinverse("_solve"), cdsm.UnknownName, ("'_solve'",)),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("case", CASES)
def test_bad_input_is_named_with_its_value_and_a_remedy(case: str) -> None:
    call, kind, said = CASES[case]
    with pytest.raises(kind) as caught:
        call()
    assert type(caught.value) is kind
    for part in said:
        assert part in str(caught.value)


# what the machine's numbers cannot hold: refused, or answered with finite numbers
EXTREMES: dict[str, Callable[[], Array]] = {
    "gravity": lambda: (
        cdsm.Manipulator(STRAND_ARM.geometry, STEEL, gravity=(1e308, 1e308, 0.0))
        .at(STRAND_POSE.q)
        .gravity_torque
    ),
    "angles": lambda: ARM.at(np.full(6, 1e300), check_limits=False).tip,
    "wrench to balance": lambda: cdsm.distribute_tension(POSE, wrench=np.full(6, 1.7e308)).residual,
    "minimum": lambda: cdsm.distribute_tension(POSE, minimum=1.7e308).values,
    "tension": lambda: cdsm.stiffness(POSE, np.full(C, 1.7e308)).joint,
    "wrench": lambda: cdsm.stiffness(POSE, np.ones(C), np.full(6, 1.7e308)).joint,
    "rigidity": lambda: (
        cdsm.stiffness(
            cdsm.Manipulator(GEOMETRY, cdsm.LinearElasticity(1.7e308)).at(POSE.q), np.ones(C)
        ).joint
    ),
    "direction": lambda: np.array([K.along([1.7e308] * 3), K.along([5e-324] * 3)]),
    **{
        key: lambda k=key, v=value: np.append(  # type: ignore[misc]
            (
                pose := cdsm.Manipulator(
                    cdsm.Geometry.universal(
                        **{
                            "joints": 2,
                            "cables_per_joint": 3,
                            "link_length": 0.04,
                            "base_length": 0.02,
                            "disk_offset": 0.01,
                            "hole_radius": 0.03,
                            "link_mass": 0.5,
                            k: v,
                        }
                    ),
                    STEEL,
                ).at(np.full(4, 0.01))
            ).gravity_torque,
            cdsm.stiffness(pose, cdsm.distribute_tension(pose)).margin,
        )
        for key, value in (
            ("link_length", 1e200),
            ("base_length", 1e300),
            ("hole_radius", 1e300),
            ("link_mass", 1e306),
            ("lead", 1e308),
        )
    },
}


@pytest.mark.parametrize("case", EXTREMES)
def test_extreme_magnitudes_are_refused_or_give_finite_numbers(case: str) -> None:
    with warnings.catch_warnings(action="ignore"):
        try:
            result = EXTREMES[case]()
        except cdsm.CdsmError:
            return
    assert np.isfinite(result).all()


# --- good input in odd dress ----------------------------------------------------------------

EIGHTHS = np.array([1.0, -2.0, 3.0, 0.0, -1.0, 2.0]) / 8.0
DRESSES: dict[str, Callable[[Array], Any]] = {
    "big-endian": lambda q: q.astype(">f8"),
    "float32": lambda q: q.astype(np.float32),
    "float16": lambda q: q.astype(np.float16),
    "longdouble": lambda q: q.astype(np.longdouble),
    "strided": lambda q: np.repeat(q, 2)[::2],
    "reversed": lambda q: q[::-1].copy()[::-1],
    "column of a matrix": lambda q: np.stack([q, q + 1.0], axis=1)[:, 0],
    "list": lambda q: q.tolist(),
    "tuple of numpy numbers": tuple,
    "memory": lambda q: memoryview(q),  # type: ignore[arg-type]
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


@pytest.mark.parametrize("kind", [np.int8, np.uint16, np.int64, ">i4", int])
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


# --- limits ---------------------------------------------------------------------------------


def test_angles_beyond_their_limits_are_an_error_with_data() -> None:
    arm = mixed_arm()
    q = np.array([0.0, 2.0, 0.0, -0.41, 0.0])
    with pytest.raises(cdsm.JointLimitError) as caught:
        arm.at(q)
    assert caught.value.joints == ("joint1_2", "joint3_1")
    assert caught.value.angles == (2.0, -0.41)
    assert caught.value.limits == ((arm.lower[1], arm.upper[1]), (-0.4, 0.4))
    for part in ("joint1_2 = 2 rad", "joint3_1 = -0.41 rad", "[-0.4, 0.4]", "check_limits=False"):
        assert part in str(caught.value)
    assert np.isfinite(arm.at(q, check_limits=False).tip).all()


def test_only_the_first_joints_beyond_their_limits_are_named() -> None:
    q = np.full(ARM.nv, 3.0)
    with pytest.raises(cdsm.JointLimitError) as caught:
        ARM.at(q)
    assert len(caught.value.joints) == ARM.nv
    assert str(caught.value).count("is outside") == 4
    assert f"; and {ARM.nv - 4} joints more." in str(caught.value)


def test_ways_beyond_their_limits_are_in_metres() -> None:
    q = foreign.POSTURE.copy()
    q[[0, 1]] = 2.0
    with pytest.raises(cdsm.JointLimitError) as caught:
        foreign.crab().at(q)
    for part in (
        "a = 2 rad is outside [-0.9, 1.1] rad (114.6° of -51.57° to 63.03°)",
        "b = 2 m is outside [-0.9, 1.1] m",
    ):
        assert part in str(caught.value)


def test_angles_at_their_limits_are_inside_even_through_degrees() -> None:
    for sign in (-1.0, 1.0):
        ARM.at(sign * ARM.upper)
        ARM.at(np.deg2rad(np.rad2deg(sign * ARM.upper)))
    with pytest.raises(cdsm.JointLimitError):
        ARM.at(ARM.upper + 1e-6)


# --- infeasible tension ---------------------------------------------------------------------


def torque_of(pose: cdsm.Posture, wrench: Array) -> Array:
    """τ of Eq. 13: what the cables have to exert."""
    return wrench @ pose.jacobian - pose.gravity_torque


def least_missing(pose: cdsm.Posture, low: Array, high: Array, wrench: Array) -> float:
    """A proven lower bound of Σ|τ − J_Lᵀ F|, from the dual linear program.

    For any y with |y_i| <= 1 and any F within the bounds, Σ|τ − J_Lᵀ F| >= y·τ − (J_L y)·F, and
    with J_L y = p − n, p and n >= 0, that is at least y·τ − high·p + low·n.
    """
    tau, J = torque_of(pose, wrench), pose.length_jacobian
    count, nv = J.shape
    bounded = np.isfinite(high)
    best = linprog(
        np.concatenate([-tau, np.where(bounded, high, 0.0), -low]),
        A_eq=np.hstack([J, -np.eye(count), np.eye(count)]),
        b_eq=np.zeros(count),
        bounds=[
            *[(-1.0, 1.0)] * nv,
            *[(0.0, None) if b else (0.0, 0.0) for b in bounded],
            *[(0.0, None)] * count,
        ],
        method="highs",
    )
    assert best.status == 0
    return -float(best.fun)


def refused(
    pose: cdsm.Posture, low: Array, high: Array, wrench: Array, solver: str = "daqp"
) -> cdsm.InfeasibleTension:
    with pytest.raises(cdsm.InfeasibleTension) as caught:
        cdsm.distribute_tension(pose, low, high, wrench, solver)
    return caught.value


def check_missing(
    error: cdsm.InfeasibleTension, pose: cdsm.Posture, low: Array, high: Array, wrench: Array
) -> None:
    """``missing`` is attained by tensions within the bounds, and no tensions do better."""
    tau, J = torque_of(pose, wrench), pose.length_jacobian
    count, nv = J.shape
    # variables: F, then the largest |J_Lᵀ F − (τ − missing)|
    attained = linprog(
        except_at(count + 1, count, 1.0),
        A_ub=np.vstack([np.hstack([J.T, -np.ones((nv, 1))]), np.hstack([-J.T, -np.ones((nv, 1))])]),
        b_ub=np.concatenate([tau - error.missing, error.missing - tau]),
        bounds=[*zip(low, high, strict=True), (0.0, None)],
        method="highs",
    )
    assert attained.status == 0
    assert attained.fun < 1e-9
    assert abs(error.missing).sum() == pytest.approx(least_missing(pose, low, high, wrench), 1e-9)
    assert error.joint == pose.arm.joint_names[int(abs(error.missing).argmax())]
    assert f"at {error.joint}" in str(error)
    assert not error.missing.flags.writeable


@pytest.mark.parametrize("seed", range(8))
def test_bounds_too_tight_say_what_is_missing_and_how_far_to_widen(seed: int) -> None:
    pose = random_posture(random_arm(seed, 3), seed)
    count = len(pose.arm.cables)
    low = np.random.default_rng(seed).uniform(5.0, 30.0, count)
    high = low + 0.5
    wrench = random_wrench(seed)
    error = refused(pose, low, high, wrench)
    check_missing(error, pose, low, high, wrench)
    assert 0.0 < error.relaxation < INF
    assert set(error.binding) <= {cable.name for cable in pose.arm.cables}
    assert "Lower minimum, raise maximum" in str(error)

    enough = error.relaxation * (1.0 + 1e-6)
    pull = cdsm.distribute_tension(pose, np.maximum(low - enough, 0.0), high + enough, wrench)
    assert abs(pull.residual).max() < 1e-9
    less = 0.9 * error.relaxation
    refused(pose, np.maximum(low - less, 0.0), high + less, wrench)


def test_cables_that_stand_at_either_bound_are_named() -> None:
    arm = cdsm.Manipulator(cdsm.presets.experimental_prototype_geometry(), STEEL)
    pose = arm.at(np.zeros(3))
    # nothing but its own pair reaches the last joint, and nearly the same tension balances it
    low, high = np.full(6, 20.0), np.full(6, 400.0)
    low[4], high[5] = 300.0, 30.0
    with pytest.raises(cdsm.InfeasibleTension) as caught:
        cdsm.distribute_tension(pose, low, high)
    assert set(caught.value.binding) >= {"cable3_1", "cable3_2"}
    assert "cable3_1" in str(caught.value)


@pytest.mark.parametrize("seed", range(8))
def test_widening_by_the_number_in_the_message_is_enough(seed: int) -> None:
    pose = random_posture(random_arm(seed, 3), seed)
    low = np.random.default_rng(seed).uniform(5.0, 30.0, len(pose.arm.cables))
    error = refused(pose, low, low + 0.5, random_wrench(seed))
    advice = re.search(r"Widening every bound by (\S+) N would be enough", str(error))
    assert advice is not None
    wider = float(advice[1])
    cdsm.distribute_tension(
        pose, np.maximum(low - wider, 0.0), low + 0.5 + wider, random_wrench(seed)
    )


def test_only_the_upper_bound_may_be_too_tight() -> None:
    wrench = np.array([0.0, 0.0, 50.0, 0.0, 0.0, 0.0])
    low, high = np.zeros(C), np.full(C, 1.0)
    error = refused(POSE, low, high, wrench)
    check_missing(error, POSE, low, high, wrench)
    cdsm.distribute_tension(POSE, 0.0, 1.0 + error.relaxation * (1.0 + 1e-6), wrench)
    refused(POSE, low, high + 0.9 * error.relaxation, wrench)


def weak_arm() -> cdsm.Manipulator:
    """One cable per universal joint: most torques are beyond it, whatever the tension."""
    geometry = cdsm.Geometry.universal(
        joints=3,
        cables_per_joint=1,
        link_length=0.05,
        base_length=0.02,
        disk_offset=0.01,
        hole_radius=0.03,
        link_mass=0.2,
    )
    return cdsm.Manipulator(geometry, STEEL)


@pytest.mark.parametrize("maximum", [INF, 100.0])
@pytest.mark.parametrize("solver", ["daqp", "osqp"])
def test_torque_the_cables_cannot_exert_at_all_has_no_relaxation(
    maximum: float, solver: str
) -> None:
    pose = random_posture(weak_arm(), 4)
    low, high, wrench = np.zeros(3), np.full(3, maximum), np.zeros(6)
    error = refused(pose, low, high, wrench, solver)
    assert error.relaxation == INF
    check_missing(error, pose, low, high, wrench)
    for part in ("No bounds would help", "Change the posture, the load, or the routing"):
        assert part in str(error)


def test_infeasible_and_feasible_agree_between_solvers() -> None:
    wrench = np.array([0.0, 0.0, 5.0, 0.0, 0.0, 0.0])
    errors = [
        refused(POSE, np.zeros(C), np.full(C, 0.5), wrench, solver) for solver in ("daqp", "osqp")
    ]
    assert errors[0].relaxation == pytest.approx(errors[1].relaxation)
    assert abs(errors[0].missing).sum() == pytest.approx(abs(errors[1].missing).sum())


# --- coincident sites -----------------------------------------------------------------------


def test_sites_that_meet_at_a_posture_are_named_there() -> None:
    geometry = cdsm.Geometry(
        base_length=0.02,
        hole_radius=0.03,
        joints=(cdsm.Joint(axes=((0.0, 0.0, 1.0),), disk_offset=0.01, limit=3.0),) * 2,
        links=(cdsm.Link(length=0.05, mass=0.1),) * 2,
        cables=(cdsm.CableRoute(joint=1, angle=0.0),),
    )
    sites = (
        cdsm.Site("base_disk", (0.02, 0.02, 0.0)),  # 20 mm beside the joint, reached at 90 degrees
        cdsm.Site("link1", (0.02, 0.0, 0.0)),
    )
    arm = cdsm.Manipulator(geometry, cables=[cdsm.Cable("loop", sites, STEEL)])
    assert np.isfinite(arm.at([1.5, 0.0]).length_jacobian).all()
    with pytest.raises(cdsm.CableError, match=r"coincide at q = \[1\.57.*Move a site") as caught:
        arm.at([math.pi / 2.0, 0.0])
    assert caught.value.cable == "loop"


# --- singular and unstable stiffness --------------------------------------------------------


def soft_posture() -> cdsm.Posture:
    """Without gravity an arm on soft cables is stable when slack and buckles under tension."""
    arm = random_arm(3, 3, elasticity=cdsm.LinearElasticity(2000.0))
    free = cdsm.Manipulator(arm.geometry, cdsm.LinearElasticity(50.0), gravity=(0.0, 0.0, 0.0))
    return random_posture(free, 1)


def brink() -> cdsm.Stiffness:
    """The stiffness at the very tension at which the arm buckles, by bisection."""
    pose = soft_posture()
    unit = random_tension(pose.arm, 1)

    def at(scale: float) -> cdsm.Stiffness:
        return cdsm.stiffness(pose, scale * unit)

    low, high = 0.0, 1.0
    while at(high).margin > 0.0:
        high *= 2.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if at(middle).margin > 0.0 else (low, middle)
    return min((at(low), at(high)), key=lambda K: abs(K.margin))


def test_stiffness_on_the_brink_of_buckling_is_singular_and_still_prints() -> None:
    brittle = brink()
    assert abs(brittle.margin) < 1e-13 * abs(brittle.joint).max()
    for call in (
        lambda: brittle.compliance,
        lambda: brittle.cartesian,
        lambda: brittle.along((0.0, 0.0, 1.0)),
        lambda: brittle.shares((0.0, 0.0, 1.0)),
    ):
        with pytest.raises(cdsm.SingularStiffness, match=r"singular.*buckle.*Change") as caught:
            call()
        # the same motion, up to its sign
        assert abs(caught.value.direction @ brittle.critical_direction) == pytest.approx(1.0)
        assert np.linalg.norm(caught.value.direction) == pytest.approx(1.0)
    assert "smallest joint stiffness" in str(brittle)
    assert "nan" not in str(brittle)
    assert "nan" not in brittle._repr_html_()
    assert np.isfinite(brittle.pseudoinverse()).all()


def led(arm: cdsm.Manipulator) -> cdsm.Manipulator:
    """The arm with leads of 5 m, which let tension buckle it."""
    assert arm.geometry is not None
    cables = [replace(cable, lead=5.0) for cable in arm.geometry.cables]
    geometry = replace(arm.geometry, cables=tuple(cables))
    return cdsm.Manipulator(geometry, arm.cables[0].elasticity, gravity=arm.gravity)


def test_one_joint_on_the_brink_is_singular_though_its_stiffness_is_the_largest_there_is() -> None:
    """The parts of its K_θ cancel to some digits, and no more of its inverse is known."""
    arm = led(random_arm(3, 1, "hinged", cdsm.LinearElasticity(50.0)))
    pose = cdsm.Manipulator(arm.geometry, arm.cables[0].elasticity, gravity=np.zeros(3)).at([0.1])
    # k = (EA + F)/L, so that K_θ is affine in F
    slack, unit = (float(cdsm.stiffness(pose, np.full(2, F)).joint[0, 0]) for F in (0.0, 1.0))
    critical = slack / (slack - unit)
    for off, digits in ((1e-10, 6), (1e-5, 11)):
        F = np.full((1, 2), critical * (1.0 - off))
        K = cdsm.stiffness(pose, F[0])
        assert K.margin == pytest.approx(off * slack, rel=1e-4)
        batch = cdsm.evaluate(pose.arm, [pose.q], F, outputs=("compliance",))
        if digits > 6:
            assert batch.ok.all()
            np.testing.assert_array_equal(batch["compliance"][0], K.compliance)
            continue
        assert batch.status[0] == cdsm.Status.SINGULAR
        with pytest.raises(cdsm.SingularStiffness, match="just about to buckle"):
            _ = K.compliance


def test_a_joint_held_by_nothing_has_no_compliance() -> None:
    geometry = cdsm.Geometry(
        name="flat",
        base_length=0.02,
        hole_radius=0.03,
        joints=(cdsm.Joint(axes=((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), disk_offset=0.01),),
        links=(cdsm.Link(length=0.04, mass=0.0),),
        cables=(cdsm.CableRoute(joint=1, angle=0.0),),
    )
    pose = cdsm.Manipulator(geometry, STEEL).at([0.0, 0.0])
    F = np.zeros(1)
    stiff = cdsm.stiffness(pose, F)
    with pytest.raises(cdsm.SingularStiffness, match="next to nothing holds the arm") as caught:
        _ = stiff.compliance
    np.testing.assert_array_equal(caught.value.direction, [1.0, 0.0])
    batch = cdsm.evaluate(pose.arm, [pose.q], F[None], outputs=("compliance",))
    assert batch.status[0] == cdsm.Status.SINGULAR


def test_batch_finds_every_singular_stiffness_that_the_single_posture_does() -> None:
    """Though pivots need not be small where K_θ is singular."""
    for seed in range(12):
        arm = led(random_arm(seed, 5, "hinged", cdsm.LinearElasticity(2e3)))
        pose = random_posture(arm, seed)
        unit = random_tension(arm, seed)
        rest = cdsm.stiffness(pose, 0.0 * unit).joint
        change = cdsm.stiffness(pose, unit).joint - rest  # k = (EA + F)/L: affine in F
        factors = scipy.linalg.eigvals(rest, -change)
        scale = float(factors.real[abs(factors.imag) < 1e-9 * abs(factors)].max())
        F = scale * (1.0 + 1e-10) * unit
        with pytest.raises(cdsm.SingularStiffness):
            _ = cdsm.stiffness(pose, F).compliance
        batch = cdsm.evaluate(arm, [pose.q], F, outputs=("compliance",))
        assert batch.status[0] == cdsm.Status.SINGULAR


@pytest.mark.parametrize("seed", range(4))
def test_a_torque_missing_by_less_than_linear_programs_care_for_is_named(seed: int) -> None:
    """Nobody claims then that there are tensions after all."""
    pose = random_posture(random_arm(seed, 3), seed)
    J, count = pose.length_jacobian, len(pose.arm.cables)
    size = abs(J).max()
    # the least upper bound of all cables that balances the arm
    found = linprog(
        np.append(np.zeros(count), 1.0),
        A_ub=np.column_stack([np.eye(count), -np.ones(count)]),
        b_ub=np.zeros(count),
        A_eq=np.column_stack([J.T / size, np.zeros(pose.arm.nv)]),
        b_eq=-pose.gravity_torque / size,
        bounds=[*[(20.0, None)] * count, (0.0, None)],
    )
    bound = float(found.x[-1])
    assert cdsm.distribute_tension(pose, 20.0, bound * (1.0 + 1e-8)).values.max() <= bound * 1.1
    with pytest.raises(cdsm.InfeasibleTension) as caught:
        cdsm.distribute_tension(pose, 20.0, bound * (1.0 - 1e-8))
    assert 0.0 < abs(caught.value.missing).max() < 1e-6
    assert caught.value.relaxation == pytest.approx(1e-8 * bound, rel=1.0)


def test_unstable_stiffness_says_so() -> None:
    pose = soft_posture()
    tension = random_tension(pose.arm, 1)
    slack, tight = (cdsm.stiffness(pose, scale * tension) for scale in (1e-6, 100.0))
    assert slack.is_stable
    assert slack.margin > 0.0
    assert "UNSTABLE" not in str(slack) + repr(slack) + slack._repr_html_()
    assert not tight.is_stable
    assert tight.margin < 0.0
    for text in (str(tight), repr(tight), tight._repr_html_()):
        assert "UNSTABLE" in text
    assert np.isfinite(tight.compliance).all()


def test_direction_the_tip_cannot_move_in_is_infinitely_stiff() -> None:
    straight = ARM.at(np.zeros(6))
    stiff = cdsm.stiffness(straight, cdsm.distribute_tension(straight, minimum=10.0))
    assert stiff.along((1.0, 0.0, 0.0)) == INF
    for call, remedy in (
        (lambda: stiff.cartesian, "Use along"),
        (lambda: stiff.pseudoinverse(), "Use along"),
        (lambda: stiff.shares((1.0, 0.0, 0.0)), "infinite"),
    ):
        with pytest.raises(cdsm.SingularStiffness, match=remedy) as caught:
            call()
        assert abs(caught.value.direction) == pytest.approx([1.0, 0.0, 0.0])
    assert "inf" in str(stiff)
    assert "nan" not in str(stiff)


def test_however_little_negative_a_stiffness_is_the_arm_is_unstable() -> None:
    for margin, stable in ((-1e-9, False), (0.0, False), (1e-9, True)):
        stiff = replace(K, joint=margin * np.eye(ARM.nv))
        assert (stiff.margin, stiff.is_stable) == (margin, stable)


# --- lying solvers --------------------------------------------------------------------------

Lie = Callable[[qpsolvers.Solution], qpsolvers.Solution]


def point(solution: qpsolvers.Solution) -> Array:
    return np.array(solution.x, dtype=np.float64)


def with_x(solution: qpsolvers.Solution, x: Array | None) -> qpsolvers.Solution:
    solution.x = x
    return solution


def other_feasible(solution: qpsolvers.Solution) -> Array:
    """Another point that keeps bounds and balance, but is not the least."""
    _, _, rows = np.linalg.svd(np.asarray(solution.problem.A))
    step = rows[-1] if rows[-1].sum() > 0.0 else -rows[-1]
    return np.asarray(point(solution) + 1e-3 * step)


def without_duals(solution: qpsolvers.Solution, *names: str) -> qpsolvers.Solution:
    for name in names:
        setattr(solution, name, None)
    return solution


LIES: dict[str, Lie] = {
    "a bound is broken": lambda s: with_x(s, point(s) - 1e-3),
    "balance is broken": lambda s: with_x(s, point(s) * 1.001),
    "not the least": lambda s: with_x(s, other_feasible(s)),
    "NaN": lambda s: with_x(s, point(s) * NAN),
    "infinite": lambda s: with_x(s, point(s) + INF),
    "zero": lambda s: with_x(s, point(s) * 0.0),
    "no point": lambda s: with_x(s, None),
    "no multipliers": lambda s: without_duals(s, "y", "z", "z_box"),
    "no multipliers of the balance": lambda s: without_duals(s, "y"),
    "no multipliers of the bounds": lambda s: without_duals(s, "z_box"),
}


MENDABLE = ("balance is broken", "not the least")
"""Near the optimum, so that polishing finds it; what is returned is the optimum all the same."""


def test_every_optimality_condition_is_checked() -> None:
    A = POSE.length_jacobian.T
    low, high = np.full(A.shape[1], 10.0), np.full(A.shape[1], INF)
    problem = tension_kernels.Scaled(A / 0.01, -POSE.gravity_torque / 0.01, low, high, 0.01, 1.0)
    qp = qpsolvers.Problem(
        np.eye(low.size), np.zeros(low.size), A=problem.A, b=problem.b, lb=low, ub=high
    )
    solution = qpsolvers.solve_problem(qp, "daqp", primal_tol=1e-9)
    x, y, z = (np.asarray(each) for each in (solution.x, solution.y, solution.z_box))
    assert _shortfall(problem, (x, y, z)) == ""
    one = np.eye(low.size)[int(x.argmax())]  # a cable that is not at its bound
    for wrong in (
        (other_feasible(solution), y, z),  # not the least
        (x + 1e-3 * one, y, z),  # not balanced
        (x, y + 1e-3, z),  # multipliers of another point
        (x, y, z + 1e-3 * one),  # a multiplier of a bound that is not there
        (x, y, 2.0 * z),
    ):
        assert _shortfall(problem, wrong)
    # and as qpsolvers itself measures
    ours = tension_kernels.optimality(*problem[:4], x, y + 1e-3, z)
    solution.y = y + 1e-3
    theirs = (solution.primal_residual(), solution.dual_residual(), solution.duality_gap())
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-12)


def slightly_off(excess: float) -> tuple[tension_kernels.Scaled, tuple[Array, ...]]:
    """Two cables that share 10; the one has a little more, and multipliers that hide it.

    Constraints and stationarity hold exactly. The gap is 2e² + 9e; the optimum is √2 e away, but to
    know that one would have to know the optimum.
    """
    A, b = np.ones((1, 2)), np.array([10.0])
    problem = tension_kernels.Scaled(A, b, np.ones(2), np.full(2, 10.0), 1.0, 1.0)
    e = excess
    return problem, (np.array([5.0 - e, 5.0 + e]), np.array([-5.0]), np.array([e, -e]))


def test_duality_gap_bounds_the_distance_from_the_optimum() -> None:
    # √(2·9e) of 5: e from 1e-6 of it; rounding of a gap of 1e-11 is some 1e-14
    edge = (DISTANCE * 5.0) ** 2 / 18.0
    assert _shortfall(*slightly_off(0.9 * edge)) == ""
    assert "1.0e-06 away (1e-06 is allowed" in _shortfall(*slightly_off(1.1 * edge))


def test_what_is_missed_is_told_relative_to_the_largest_tension() -> None:
    problem, (x, y, z) = slightly_off(1.0)
    # 0.5 too much of 6.5; of the multipliers 1 is missing; the gap is 16 + 42.25 − 50 + 10 − 2.5
    said = _shortfall(problem, (x + np.array([0.0, 0.5]), y, z - np.array([0.0, 1.5])))
    for part in (
        f"balance and bounds are missed by {0.5 / 6.5:.1e}",
        f"stationarity by {1.0 / 6.5:.1e} (1e-09 is allowed)",
        f"may be {math.sqrt(2.0 * 15.75) / 6.5:.1e} away (1e-06 is allowed",
    ):
        assert part in said

    # and to 1 where all tensions are less: then the torque or the lower bounds set the scale
    small = problem._replace(b=0.1 * problem.b, low=0.1 * problem.low, high=0.1 * problem.high)
    said = _shortfall(small, (0.1 * x + np.array([0.0, 0.05]), 0.1 * y, 0.1 * z))
    assert "balance and bounds are missed by 5.0e-02" in said


def test_stationarity_is_asked_for_to_a_billionth_of_the_largest_tension() -> None:
    # two cables held at 5, so that multipliers of opposite sign leave no gap
    fixed = np.full(2, 5.0)
    problem = tension_kernels.Scaled(np.ones((1, 2)), np.array([10.0]), fixed, fixed, 1.0, 1.0)
    for part, accepted in ((0.9, True), (1.1, False)):
        off = part * OPTIMALITY * 5.0
        said = _shortfall(problem, (fixed, np.array([-5.0]), np.array([off, -off])))
        assert (said == "") == accepted


def test_gap_counts_a_small_multiplier_at_the_bound_it_belongs_to() -> None:
    # two cables that share 10, of which the first may pull 4.75: z = 5.25 − 4.75
    problem = tension_kernels.Scaled(
        np.ones((1, 2)), np.array([10.0]), np.ones(2), np.array([4.75, INF]), 1.0, 1.0
    )
    point = np.array([4.75, 5.25]), np.array([-5.25]), np.array([0.5, 0.0])
    assert tension_kernels.optimality(*problem[:4], *point) == (0.0, 0.0, 0.0)


def test_polishing_makes_a_near_optimum_the_optimum_at_either_bound() -> None:
    # the first cable may pull 4, the third has a weak arm and stands at 1; y = −6 frees the second
    A, b = np.array([[1.0, 1.0, 0.1]]), np.array([10.1])
    problem = tension_kernels.Scaled(A, b, np.ones(3), np.array([4.0, INF, INF]), 1.0, 1.0)
    x, y, z = np.array([4.0, 6.0, 1.0]), np.array([-6.0]), np.array([2.0, 0.0, -0.4])
    assert _shortfall(problem, (x, y, z)) == ""
    near = x + np.array([-1e-6, 2e-6, 1e-6]), y, z
    assert _shortfall(problem, near)
    for got, exact in zip(_polished(problem, near), (x, y, z), strict=True):
        np.testing.assert_allclose(got, exact, rtol=1e-15, atol=1e-15)


@pytest.mark.parametrize("lie", LIES)
def test_solver_that_calls_a_wrong_point_optimal_is_caught(
    lie: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    solve = qpsolvers.solve_problem
    truth = cdsm.distribute_tension(POSE, minimum=10.0).values

    def lying(problem: qpsolvers.Problem, solver: str, **options: Any) -> qpsolvers.Solution:
        solution = LIES[lie](solve(problem, solver, **options))
        solution.found = True
        return solution

    monkeypatch.setattr(qpsolvers, "solve_problem", lying)
    if lie in MENDABLE:
        np.testing.assert_allclose(
            cdsm.distribute_tension(POSE, minimum=10.0).values, truth, rtol=1e-12
        )
    else:
        with pytest.raises(cdsm.SolverError, match="solver 'daqp'") as caught:
            cdsm.distribute_tension(POSE, minimum=10.0, maximum=500.0)
        assert caught.value.solver == "daqp"
        if found := re.search(r"tensions of up to (\S+) N", str(caught.value)):
            assert 10.0 <= float(found[1]) <= 500.0


def test_solver_that_raises_is_reported_with_its_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*_: object, **__: object) -> qpsolvers.Solution:
        raise RuntimeError("out of cheese")

    monkeypatch.setattr(qpsolvers, "solve_problem", failing)
    with pytest.raises(cdsm.SolverError, match=r"'osqp' failed: out of cheese.*daqp") as caught:
        cdsm.distribute_tension(POSE, solver="osqp")
    assert isinstance(caught.value.__cause__, RuntimeError)


def test_solver_that_finds_nothing_where_something_is_gets_the_blame(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def blind(problem: qpsolvers.Problem, *_: object, **__: object) -> qpsolvers.Solution:
        return qpsolvers.Solution(problem, found=False, x=np.full(C, 2143289344.0))

    monkeypatch.setattr(qpsolvers, "solve_problem", blind)
    with pytest.raises(cdsm.SolverError, match="though one exists") as caught:
        cdsm.distribute_tension(POSE, minimum=10.0)
    assert caught.value.solver == "daqp"


# --- near a posture in which the tip cannot move everywhere ------------------------------------


def nearly_flat(size: float) -> cdsm.Stiffness:
    """All but straight beyond a bent first joint: the tip moves along the arm ever less."""
    arm = cdsm.Manipulator(GEOMETRY, cdsm.LinearElasticity(48e3))
    q = size * np.array([0.0, 0.0, 1.0, -0.7, 0.3, 0.5])
    q[:2] = 0.3, 0.25
    return cdsm.stiffness(arm.at(q), np.full(len(arm.cables), 50.0))


def test_cartesian_stiffness_is_accurate_up_to_where_it_is_refused() -> None:
    for size in (1e-2, 1e-4, 2e-5):
        stiff = nearly_flat(size)
        # softest first; the two soft ones must not drown beside the stiff one
        ours = np.sort(np.linalg.eigvalsh(stiff.cartesian))
        soft = 1.0 / np.sort(np.linalg.eigvalsh(stiff.compliance[:3, :3]))[::-1]
        np.testing.assert_allclose(ours[:2], soft[:2], rtol=1e-3)
    for size in (1e-6, 1e-8, 1e-10):
        stiff = nearly_flat(size)
        for read in (lambda s=stiff: s.cartesian, stiff.pseudoinverse):
            with pytest.raises(cdsm.SingularStiffness, match="cannot move along"):
                read()
        assert np.isfinite(stiff.along((0.0, 1.0, 0.0)))


# --- an elasticity of the user's own -------------------------------------------------------------


class Own(cdsm.Elasticity):
    """An elasticity that answers with whatever it is told to."""

    def __init__(self, answer: Callable[[Array], Any]) -> None:
        self.answer = answer

    def __eq__(self, other: object) -> bool:  # so it cannot be hashed
        return self is other

    @property
    def domain(self) -> cdsm.Domain:
        return cdsm.Domain(0.0, INF)

    def rigidity(self, tension: Any) -> Array:
        return self.answer(tension)  # type: ignore[no-any-return]

    def strain(self, tension: Any) -> Array:
        return np.log1p(np.asarray(tension) / 1e3)

    def energy(self, tension: Any) -> Array:
        raise AssertionError("not needed for stiffness")


def test_own_elasticity_need_not_be_hashable() -> None:
    arm = cdsm.Manipulator(GEOMETRY, Own(lambda tension: 1e3 + tension))
    stiff = cdsm.stiffness(arm.at(np.zeros(arm.nv)), np.full(len(arm.cables), 50.0))
    l0 = stiff.posture.cable_lengths / (1.0 + np.log(1.05))  # ε = ∫ dF/(1 kN + F)
    np.testing.assert_allclose(stiff.cable_stiffness, 1050.0 / l0)


@pytest.mark.parametrize(
    "answer",
    [
        lambda tension: tension * NAN,
        lambda tension: -tension,
        lambda tension: 0.0 * tension,
        lambda tension: tension + INF,
        lambda tension: np.array([1e3]),
        lambda tension: 1e3,
    ],
    ids=["NaN", "negative", "zero", "infinite", "one for all", "a scalar"],
)
def test_own_elasticity_without_a_positive_rigidity_is_refused(
    answer: Callable[[Array], Any],
) -> None:
    arm = cdsm.Manipulator(GEOMETRY, Own(answer))
    with pytest.raises(cdsm.InvalidInput, match=r"elasticity.*rigidity.*positive"):
        cdsm.stiffness(arm.at(np.zeros(arm.nv)), np.full(len(arm.cables), 50.0))


@pytest.mark.parametrize(
    "make",
    [
        lambda: cdsm.Domain(5.0, 1.0),
        lambda: cdsm.Domain(NAN, 1.0),
        lambda: cdsm.Domain(-1.0, 1.0),
        lambda: cdsm.LinearElasticity(5e-324),
    ],
)
def test_domain_and_rigidity_must_be_usable(make: Callable[[], object]) -> None:
    with pytest.raises(cdsm.InvalidInput):
        make()


def test_a_solver_that_calls_the_infeasible_optimal_is_not_believed() -> None:
    """One cable for two axes: DAQP finds an optimum, which balances nothing."""
    sizes = {"link_length": 0.1, "base_length": 0.02, "disk_offset": 0.01, "hole_radius": 0.03}
    geometry = cdsm.Geometry.universal(joints=1, cables_per_joint=1, link_mass=0.1, **sizes)  # type: ignore[arg-type]
    for y, z in ((-0.0955, -0.4484), (0.1, 0.2), (-0.3, 0.05), (0.2, -0.6)):
        with pytest.raises(cdsm.InfeasibleTension):
            cdsm.distribute_tension(cdsm.Manipulator(geometry, STEEL).at([y, z]))


def test_a_slight_torque_that_no_cable_exerts_is_missing_all_the_same() -> None:
    """Less than HiGHS takes for nothing, 1e-7 of the largest, and more than is ever left over."""
    geometry = cdsm.Geometry(
        base_length=0.0,
        hole_radius=0.01,
        joints=(cdsm.Joint(axes=((0.0, 1.0, 0.0),), disk_offset=0.005),),
        links=(cdsm.Link(length=0.016, mass=0.0),),
        cables=(cdsm.CableRoute(joint=1, angle=0.0),),
    )
    pose = cdsm.Manipulator(geometry, STEEL).at([0.0])
    with pytest.raises(cdsm.InfeasibleTension) as caught:
        cdsm.distribute_tension(pose, minimum=1.0)
    np.testing.assert_allclose(caught.value.missing, -pose.gravity_torque, rtol=1e-9)


def test_bound_that_vanishes_in_products_is_refused() -> None:
    pose = mixed_arm().at(np.zeros(mixed_arm().nv))
    with pytest.raises(cdsm.InvalidInput, match=r"minimum: .* is 4.94066e-324; give newtons"):
        cdsm.distribute_tension(pose, minimum=5e-324)
    assert cdsm.distribute_tension(pose, minimum=0.0).values.min() >= 0.0
