"""Bad input: the right error, which names the offender, the value and the remedy; never NaN."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array
from tests.support.arms import STEEL, random_arm, random_posture

ARM = random_arm(1, 3)
POSE = random_posture(ARM, 1)
C = len(ARM.cables)
PULL = cdsm.distribute_tension(POSE, minimum=10.0)
K = cdsm.stiffness(POSE, PULL)
GEOMETRY = ARM.geometry
BASE = cdsm.Site("base_disk", (0.0, 0.01, 0.0))
END = cdsm.Site("link1", (0.01, 0.01, 0.0))
LOST = cdsm.Site("lnk1", (0.0, 0.0, 0.0))
STRAND_ARM = cdsm.presets.virtual_prototype()
STRAND_POSE = STRAND_ARM.at(np.full(10, 0.1))
NAN, INF = math.nan, math.inf
NAMES = ARM.cables.names


COUNTS: dict[str, Callable[[Any], object]] = {
    "steps: .* from 1 to 1000": lambda n: cdsm.weight_test(POSE, PULL, (0.0, 0.0, -1.0), steps=n),
    f"count: .* from 1 to {2**30}": cdsm.RandomPoses,
    f"count: .* from 2 to {2**30}": lambda n: cdsm.PathPoses(np.eye(2), n),
}


def except_at(size: int, index: int, value: object, fill: float = 0.0) -> list[Any]:
    numbers: list[Any] = [fill] * size
    numbers[index] = value
    return numbers


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ([0.0] * 5, r"shape \(5,\) given.*\(6,\) needed"),
        (np.zeros((1, 6)), r"shape \(1, 6\) given.*\(6,\) needed"),
        (except_at(6, 2, NAN), r"entry \[2\] is nan.*finite numbers"),
        (except_at(6, 4, -INF), r"entry \[4\] is -inf.*finite numbers"),
        (["0.1"] * 6, "<U3.*real numbers"),
        (np.zeros(6, complex), "complex128.*real numbers"),
        ([True] * 6, "bool.*real numbers"),
        ([[0.0], [0.0, 1.0]], "not an array of numbers"),
        ({"joint1_1": 0.1}, "a dict given.*its numbers alone"),
    ],
)
def test_what_is_no_vector_of_six_numbers_is_named(given: Any, said: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=f"^q: .*{said}"):
        ARM.at(given)
    if isinstance(given, dict):  # of loads by link
        said = r"joint1_1.*\(6,\) needed"
    with pytest.raises(cdsm.InvalidInput, match=f"^wrench.*{said}"):
        cdsm.stiffness(POSE, [1.0] * C, given)


def manipulator(*args: Any, **options: Any) -> Callable[[], object]:
    return lambda: cdsm.Manipulator(GEOMETRY, *args, **options)


def cable(*sites: cdsm.Site, **options: Any) -> Callable[[], object]:
    given: dict[str, Any] = {"name": "a", "elasticity": STEEL} | options
    return lambda: cdsm.Cable(sites=sites or (BASE, END), **given)


def distribute(pose: cdsm.Posture = POSE, **options: Any) -> Callable[[], object]:
    return lambda: cdsm.distribute_tension(pose, **options)


def own(**bound: float) -> cdsm.Posture:
    """Of an arm whose first cable has a bound of its own."""
    return ARM.with_cables([replace(ARM.cables[0], **bound), *ARM.cables[1:]]).at(POSE.q)  # type: ignore[arg-type]


def routed(*sites: cdsm.Site) -> Callable[[], object]:
    return manipulator(cables=[cdsm.Cable("a", sites, STEEL)])


def stiffness(*args: Any, pose: cdsm.Posture = POSE) -> Callable[[], object]:
    return lambda: cdsm.stiffness(pose, *args)


def read(**options: Any) -> Callable[[], object]:
    return lambda: cdsm.Manipulator.read("examples/arm.toml", **options)


def fit(**options: Any) -> Callable[[], object]:
    return lambda: cdsm.fit_spring([0.1, 0.2, 0.3], [1.0, 1.8, 2.4], **options)


def measured(**options: Any) -> Callable[[], object]:
    return lambda: cdsm.Measurement(1.0, "z", (0.1,), std=0.1, **options)


def swept(**options: Any) -> Callable[[], object]:
    return lambda: cdsm.sweep(ARM, POSE.q[None], **options)


PULLEY = partial(cdsm.Pulley, "link1", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.01)
THREE = except_at(C, 2, 3.0, 9.0)
ABOVE, BELOW = except_at(15, 14, 900.0, 50.0), cdsm.distribute_tension(STRAND_POSE)
CASES: dict[str, tuple[Callable[[], object], str]] = {
    name: (call, said)
    for name, call, said in (
        ("geometry", lambda: cdsm.Manipulator(3, STEEL), "geometry: 3.*Geometry is needed"),  # type: ignore[arg-type]
        ("two laws", manipulator(STEEL, cables=ARM.cables), "elasticity.*one of elasticity="),
        ("no law", manipulator(), "elasticity.*one of elasticity=.*cables="),
        ("law of numbers", manipulator(2e5), r"elasticity: 200000.0.*LinearElasticity\(EA\)"),
        ("law a name", manipulator("1x19-1.2mm"), "elasticity: '1x19-1.2mm'.*only in files"),
        ("few laws", manipulator([STEEL]), f"elasticity.*1 for each of {C}"),
        ("gravity", manipulator(STEEL, gravity=(0.0, NAN, 0.0)), r"gravity: entry \[1\] is nan"),
        ("mask", lambda: ARM.at(np.ma.masked_less(np.zeros(ARM.nv), 1.0)), "q: has a mask"),
        ("no cables", manipulator(cables=()), "cables: none given.*at least one"),
        ("cables a number", lambda: ARM.with_cables(5), "cables: .*list or tuple of Cable"),  # type: ignore[arg-type]
        ("one name", manipulator(cables=[ARM.cables[0]] * 2), "cable 'cable1_1'.*used twice"),
        ("lost link", routed(BASE, LOST), "'lnk1'.*did you mean 'link1'.*Known: base_link"),
        ("one place", routed(BASE, BASE, END), "cable 'a'.*sites 1 and 2 coincide"),
        ("site", lambda: cdsm.Site("link1", (0.0, NAN, 0.0)), r"position: entry \[1\] is nan"),
        ("cable's name", cable(name=""), "name: .*a name is needed"),
        ("one site", cable(BASE), "cable 'a'.*sites: 1 given.*two or more"),
        ("control", cable(control="frce"), "cable 'a'.*'frce'.*did you mean 'force'?"),
        ("spring", cable(series_stiffness=0.0), "cable 'a'.*series_stiffness: 0 N/m.*or inf is"),
        ("lead", cable(lead=-1.0), "cable 'a'.*lead"),
        ("stiff spring", cable(series_stiffness=1e13), r"series_stiffness.*to 1e\+12 N/m, or inf"),
        ("own minimum", cable(minimum=-1.0), "minimum.*-1 N given; cables only pull"),
        ("link of a pose", lambda: POSE.link_pose("tol0"), "'tol0'.*did you mean 'tool0'?"),
        ("pose", lambda: cdsm.distribute_tension(3), "pose: 3.*Posture is needed"),  # type: ignore[arg-type]
        ("minimum", distribute(minimum=except_at(C, 3, -1.0)), f"minimum: -1 N.*{NAMES[3]}"),
        ("minimum shape", distribute(minimum=[1.0, 2.0]), rf"minimum: shape \(2,\).*\({C},\)"),
        ("bounds", distribute(minimum=5.0, maximum=THREE), f"maximum: 3 N.*{NAMES[2]}.*below 5 N"),
        ("above own", distribute(own(maximum=30.0), minimum=40.0), "own maximum.*below 40 N"),
        ("below own", distribute(own(minimum=50.0), maximum=40.0), "40 N .*below 50 N .*own minim"),
        ("fixed lost", distribute(fixed={"cable1_9": 5.0}), "did you mean"),
        ("fixed pushes", distribute(fixed={NAMES[1]: -0.5}), "-0.5 N given"),
        ("fixed list", distribute(fixed=[5.0, 5.0]), "give a dict"),
        ("solver", distribute(solver="dapq"), "solver.*'dapq'.*did you mean 'daqp'?.*Known: "),
        ("tension scalar", stiffness(5.0), rf"tension: shape \(\).*\({C},\) needed.*per cable"),
        ("slack", stiffness(except_at(C, 5, -2.5, 1.0)), f"-2.5 N.*{NAMES[5]}.*only pull"),
        ("another posture", stiffness(PULL, pose=ARM.at(0.5 * POSE.q)), "another posture"),
        ("another arm", stiffness(PULL, pose=ARM.with_gravity("z").at(POSE.q)), "for another arm"),
        ("two wrenches", stiffness(PULL, np.zeros(6)), "wrench.*comes with the Tension"),
        ("no way", lambda: K.along((0.0, 0.0, 0.0)), "direction: .*zero vector"),
        ("way of two", lambda: K.shares((1.0, 0.0)), r"direction: .*shape \(2,\)"),
        ("term", lambda: K.pseudoinverse("activ"), "'activ'.*did you mean 'active'?.*passive"),  # type: ignore[arg-type]
        ("cables None", lambda: ARM.with_cables(None), "cables: none given"),  # type: ignore[arg-type]
        ("a key of an arm", lambda: ARM.replace(gravty="z"), "'gravty'; did you mean 'gravity'"),
        ("urdf", lambda: ARM.replace(urdf=3), "urdf: 3 given"),
        ("a geometry", lambda: ARM.with_geometry(3, ARM.cables), "geometry: 3 given"),  # type: ignore[arg-type]
        ("names", lambda: cdsm.ArmParameters(ARM, None), "names: None given; a list or tuple"),  # type: ignore[arg-type]
        (
            "bars",
            lambda: cdsm.plots.plot_tensions(None),
            "tension: None given; a Tension is needed",
        ),  # type: ignore[arg-type]
        ("arms", lambda: cdsm.plots.plot_arms(3), "cases: 3 given; give a list"),  # type: ignore[arg-type]
        (
            "ranges",
            lambda: cdsm.plots.plot_stiffness_ranges(None),
            "ranges: None given; give a dict",
        ),  # type: ignore[arg-type]
        ("pushed wire", lambda: STEEL.strain(-1.0), "-1 N: outside the domain .* minimum of 0 N"),
        ("file a number", lambda: cdsm.Manipulator.read(3), "path: 3 given; the path of a file"),  # type: ignore[arg-type]
        ("changes", read(changes=[1]), r"changes: \[1\] given; give a dict of values by keys"),
        ("sheath", lambda: cdsm.Sheath(0.1, pieces=10**9), "pieces: 10{9} given; .* 1 to 1000"),
        ("groove", lambda: PULLEY(groove=EIGHTHS), "groove: .*True or False is needed"),
        ("spring ends", fit(between=[[1], [2, 3]]), "between: is not an array of numbers"),
        (
            "spring way",
            fit(between=(2.0, 1.0)),
            r"between: \(2.0, 1.0\) given; .* in rad, low below",
        ),
        ("assembly", lambda: ARM.assemble(POSE, [[1.0], [2.0, 3.0]]), "tension: is not an array"),
        ("bound of a test", measured(minimum=[[1.0], [2.0, 3.0]]), "minimum: is not an array"),
        ("cases None", swept(wrench=None), "wrench: holds object entries"),
        ("no case", swept(wrench=np.zeros((0, 6))), r"wrench: shape \(0, 6\) given: no case"),
        ("a case", swept(wrench=5.0), r"wrench: shape \(\) given"),
        ("store", swept(store=np.zeros(2)), "path: .* given; the path of a file is needed"),
        # what no machine has is refused with the range
        ("huge gravity", manipulator(STEEL, gravity=(0.0, 0.0, -9810.0)), "up to 1000 m/s²"),
        ("huge q", lambda: ARM.at(np.full(6, 1e300), check_limits=False), r"q: .* up to 1e\+15"),
        ("huge wrench", stiffness(np.ones(C), np.full(6, 1e10)), r"wrench: .* 1e\+09 N"),
        ("huge minimum", distribute(minimum=1e10), r"minimum: .*newtons from 1e-09 to 1e\+09"),
        ("huge EA", lambda: cdsm.LinearElasticity(1e13), r"1e\+13 N given; 1e-06 to 1e\+12 N"),
        ("far site", lambda: cdsm.Site("link1", (0.0, 1e5, 0.0)), "position: .* up to 10000 m"),
        ("heavy link", lambda: cdsm.Link(length=0.1, mass=1e7), r"1e\+07 kg given; 0, or"),
        ("fixed too high", distribute(maximum=800.0, fixed={NAMES[1]: 4000.0}), "joint"),
        ("a path", lambda: ARM.with_cables(""), "'': is an empty path"),
        ("above the law", stiffness(ABOVE, pose=STRAND_POSE), r"900 N.*\[2.2 N, 810 N\].*maximum"),
        ("below the law", stiffness(BELOW, pose=STRAND_POSE), r"\[2.2 N, 810 N\].*minimum of"),
    )
}
KINDS = {
    "heavy link": cdsm.GeometryError,
    "fixed too high": cdsm.InfeasibleTension,
    "a path": cdsm.FileError,
    "pushed wire": cdsm.ElasticityRangeError,
    "above the law": cdsm.ElasticityRangeError,
    "below the law": cdsm.ElasticityRangeError,
}


@pytest.mark.parametrize("case", CASES)
def test_bad_input_is_named_with_its_value_and_a_remedy(case: str) -> None:
    (call, said), kind = CASES[case], KINDS.get(case, cdsm.InvalidInput)
    with pytest.raises(kind, match=f"(?s){said}") as caught:
        call()
    assert type(caught.value) is kind


EIGHTHS = np.array([1.0, -2.0, 2.0, 0.0, -1.0, 2.0]) / 8.0


@pytest.mark.parametrize(
    "wear",
    [
        lambda q: q.astype(">f8"),
        lambda q: q.astype(np.float32),
        lambda q: np.repeat(q, 2)[::2],
        np.ndarray.tolist,
        tuple,
        lambda q: np.frombuffer(q.tobytes()),  # which cannot be written
    ],
)
def test_numbers_in_any_dress_give_the_native_answer(wear: Callable[[Array], Any]) -> None:
    plain, pose = ARM.at(EIGHTHS), ARM.at(wear(EIGHTHS))
    for name in ("q", "tip", "jacobian", "cable_lengths", "length_jacobian", "gravity_torque"):
        np.testing.assert_array_equal(getattr(pose, name), getattr(plain, name))
    low, high, wrench = np.full(C, 8.0), np.full(C, 4096.0), np.array([1.0, -2, 0.5, 0, 0.25, 0])
    expected = cdsm.distribute_tension(POSE, low, high, wrench)
    pull = cdsm.distribute_tension(POSE, wear(low), wear(high), wear(wrench))
    np.testing.assert_array_equal(pull.values, expected.values)


def test_later_changes_to_the_callers_arrays_change_nothing() -> None:
    q, low, wrench = EIGHTHS.copy(), np.full(C, 8.0), np.ones(6)
    pose = ARM.at(q)
    pull, own = cdsm.distribute_tension(pose, low, wrench=wrench), cdsm.stiffness(pose, low, wrench)
    for array in (q, low, wrench):
        array[:] = 77.0
    assert (pose.q == EIGHTHS).all()
    assert (pull.minimum == 8.0).all()
    assert (own.tension == 8.0).all()
    assert (pull.wrench == own.wrench).all()


@pytest.mark.parametrize("said", COUNTS)
def test_a_count_is_bounded_and_a_flag_is_true_or_false(said: str) -> None:
    given: Any
    for given in (10**30, 0, 2.0, True):
        with pytest.raises(cdsm.InvalidInput, match=f"^{said} is needed"):
            COUNTS[said](given)
    for given in (np.array([True, False]), 1):
        with pytest.raises(cdsm.InvalidInput, match=r"^check_limits: .*True or False is needed"):
            ARM.at(POSE.q, check_limits=given)
    ARM.at(POSE.q, check_limits=np.True_)  # type: ignore[arg-type]


def test_tables_of_pandas_are_the_numbers_they_hold() -> None:
    pandas: Any = pytest.importorskip("pandas")
    q, tension = np.tile(POSE.q, (3, 1)), np.tile(PULL.values, (3, 1))
    angles = pandas.DataFrame(q, columns=ARM.joint_names)
    found = cdsm.evaluate(ARM, angles, pandas.DataFrame(tension))
    np.testing.assert_array_equal(found["tip"], cdsm.evaluate(ARM, q, tension)["tip"])
    with pytest.raises(cdsm.InvalidInput, match="q: holds object entries"):
        cdsm.evaluate(ARM, angles.astype(object), tension)
