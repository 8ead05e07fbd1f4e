"""What an arm can have, crossed with what it can be asked: an answer, or a refusal by name.

``FEATURES`` has a row for each thing that an arm can have, ``ASKED`` one for each question with a
check of its answer, ``REFUSED`` one for each pair that is refused, with words of the message. The
table is crossed for each feature alone, for all pairs, and for all features together.
"""

import re
from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm

Arm = cdsm.Manipulator

SIZES = {
    "link_length": 0.05,
    "base_length": 0.02,
    "disk_offset": 0.012,
    "hole_radius": 0.025,
    "link_mass": 0.08,
    "lead": 0.2,
}
LOADS = [
    cdsm.Load("link1", (0.0, 0.3, -0.8), point=(0.02, 0.0, -0.01)),
    cdsm.Load("tool0", (0.0, 0.0, -0.4)),
]
OWN = cdsm.Load("link2", (0.1, 0.0, -0.6), (0.0, 0.01, 0.0))
PAIR = {"cable1_1": 0.012, "cable1_2": 0.012}


def _base(coupled: bool) -> Arm:
    """Three universal joints with springs, alike if they are coupled; three cables for each."""
    geometry = cdsm.Geometry.universal(
        joints=3, cables_per_joint=3, coupled=coupled, joint_stiffness=1.5, **SIZES
    )
    return cdsm.Manipulator(geometry, cdsm.LinearElasticity(4e4))


def _over_pulleys(arm: Arm) -> Arm:
    """Return the arm with two more cables, which run over pulleys on its first link."""
    law = cdsm.LinearElasticity(4e4)
    more = [
        cdsm.Cable(
            f"over{side:+d}",
            (
                cdsm.Site("base_disk", (0.0, 0.02 * side, 0.0)),
                cdsm.Pulley("link1", (0.025, 0.016 * side, 0.0), (0.0, 0.0, -side), 0.006),
                cdsm.Site("link2", (0.03, 0.02 * side, 0.0)),
            ),
            law,
            lead=0.2,
        )
        for side in (1, -1)
    ]
    return arm.with_cables([*arm.cables, *more])


def _with_laws(arm: Arm) -> Arm:
    law = cdsm.SpringLaw.power(stiffness=1.5, exponent=0.7, scale=0.05)
    return arm.with_springs(dict.fromkeys(arm.body.all_joints, law))


FEATURES: dict[str, Callable[[Arm], Arm]] = {
    "pulleys": _over_pulleys,  # first: the others change the cables or what belongs to the arm
    "friction": lambda arm: arm.with_friction(0.05),
    "laws of springs": _with_laws,
    "own loads": lambda arm: arm.with_loads(OWN),
    "rigid motors": lambda arm: arm.with_motors([cdsm.Motor("pair", PAIR)]),
    "yielding motors": lambda arm: arm.with_motors([cdsm.Motor("pair", PAIR, stiffness=15.0)]),
    "coupled joints": lambda arm: arm,  # of the geometry
    "loads": lambda arm: arm,  # of the question
}

ALONE = [frozenset[str](), *(frozenset([name]) for name in FEATURES)]
PAIRS = [
    frozenset(pair)
    for pair in combinations(FEATURES, 2)
    if set(pair) != {"rigid motors", "yielding motors"}
]
ALL = [frozenset(FEATURES) - {name} for name in ("rigid motors", "yielding motors")]
CELLS = [*ALONE, *PAIRS, *ALL]


MINIMUM = 5.0
MAXIMUM = 600.0
DOWN = np.array([0.0, 0.0, -0.05])


class Case:
    """An arm with some features, its posture, tensions, and what acts."""

    def __init__(self, features: frozenset[str]) -> None:
        arm = _base("coupled joints" in features)
        for name, change in FEATURES.items():
            if name in features:
                arm = change(arm)
        self.arm = arm
        self.pose = arm.at(np.linspace(0.12, -0.08, arm.nv))
        self.tension = np.linspace(30.0, 36.0, len(arm.cables))
        self.wrench: Any = LOADS if "loads" in features else np.zeros(6)


def _stiffness(case: Case, _: Path) -> None:
    """Each term is the derivative of its torque, the torque that of its energy; batches agree."""
    K = cdsm.stiffness(case.pose, case.tension, case.wrench)
    wrong = [check for check in K.report().comparisons if check.verdict != "agrees"]
    assert not wrong, wrong


def _tension(case: Case, _: Path) -> None:
    tension = cdsm.distribute_tension(case.pose, MINIMUM, MAXIMUM, case.wrench)
    assert abs(tension.residual).max() < 1e-9
    assert tension.values.min() > MINIMUM - 1e-9


def _tensions(case: Case, _: Path) -> None:
    rows = [case.pose.q, case.pose.q / 2.0]
    found = cdsm.distribute_tensions(case.arm, rows, MINIMUM, MAXIMUM, case.wrench)
    for row, q in enumerate(rows):
        alone = cdsm.distribute_tension(case.arm.at(q), MINIMUM, MAXIMUM, case.wrench)
        np.testing.assert_allclose(found.values[row], alone.values, rtol=1e-8)


def _rest(case: Case, _: Path) -> None:
    """A little more load moves the rest as its stiffness says."""
    rest = cdsm.equilibrium(case.pose, case.tension, case.wrench)
    assert abs(rest.residual).max() < 1e-9
    W = 0.02 * np.eye(6)[2]
    base = LOADS if case.wrench is LOADS else []
    more = [
        cdsm.equilibrium(case.pose, case.tension, [*base, cdsm.Load("link2", tuple(s * W[:3]))])
        for s in (1.0, -1.0)
    ]
    moved = (more[0].pose.q - more[1].pose.q) / 0.04
    J = rest.stiffness.jacobian_at("link2", None)
    np.testing.assert_allclose(moved, rest.stiffness.joint_compliance() @ J[2], rtol=1e-3)


def _held(case: Case, _: Path) -> None:
    rest = cdsm.forward_statics(case.arm, tension=case.tension / 3.0, wrench=case.wrench)
    assert abs(rest.residual).max() < 1e-8
    assert (rest.path is not None) == case.arm.has_friction


def _pulled(case: Case, _: Path) -> None:
    wire = np.full(len(case.arm.cables), 2e-4)
    rest = cdsm.forward_statics(case.arm, pull=wire, wrench=case.wrench)
    assert abs(rest.residual).max() < 1e-8
    assert (rest.path is not None) == case.arm.has_friction
    assert 5.0 < rest.tension.max() < 100.0


def _turned(case: Case, _: Path) -> None:
    """A motor that turns leaves shorter wires, and balances what acts."""
    arm = case.arm
    assembly = arm.assemble(case.pose, case.tension)
    turn = 0.02 if arm.motors.given else 2e-4
    command = {arm.motors.names[0]: turn}
    rest = cdsm.forward_statics(arm, motors=command, assembly=assembly, wrench=case.wrench)
    assert abs(rest.residual).max() < 1e-8
    assert (rest.path is not None) == arm.has_friction
    shorter = assembly.free_lengths - rest.stiffness.free_lengths
    np.testing.assert_allclose(shorter, turn * arm.motors.matrix[:, 0], atol=1e-15)


def _assembled(case: Case, _: Path) -> None:
    """Tensions of an assembly balance the arm, with the wires that its motors leave."""
    arm = case.arm
    before = cdsm.distribute_tension(case.pose, 20.0, MAXIMUM, case.wrench)
    assembly = arm.assemble(case.pose, before)
    pose = arm.at(0.998 * case.pose.q)  # twins on a drum leave little choice
    tension = cdsm.distribute_tension(pose, 0.1, MAXIMUM, case.wrench, assembly=assembly)
    assert abs(tension.residual).max() < 1e-9
    assert tension.values.min() > 0.1 - 1e-9
    smooth = {"motors": tension.commands, "wrench": case.wrench, "friction": False}
    rest = cdsm.forward_statics(arm, assembly=assembly, start=pose.q, **smooth)
    np.testing.assert_allclose(rest.pose.q, pose.q, atol=1e-8)


def _weighed(case: Case, _: Path) -> None:
    test = cdsm.weight_test(case.pose, case.tension, DOWN, wrench=case.wrench, link="link2")
    assert test.frictionless == pytest.approx(test.tangent, rel=1e-2)
    if case.arm.has_friction:
        assert test.stiffness >= 0.99 * test.frictionless


def _cycled(case: Case, _: Path) -> None:
    base = LOADS if case.wrench is LOADS else []
    rows = [[*base, cdsm.Load("link2", (0.0, 0.0, z))] for z in (-2.0, 0.0, -2.0, 0.0)]
    history = cdsm.load_cycle(case.pose, case.tension, rows)
    np.testing.assert_allclose(history.angles[3], history.angles[1], atol=2e-4)
    lost = float(history.dissipated[2:].sum())
    assert (lost > 0.0) if case.arm.has_friction else (abs(lost) < 1e-12)


def _stuck(case: Case, _: Path) -> None:
    first = cdsm.breakaway(case.pose, case.tension, "-z", case.wrench, "link2")
    K = cdsm.stiffness(case.pose, case.tension, case.wrench)
    sticks = first.stiffness.along("-z", link="link2")
    assert sticks >= (1.0 - 1e-9) * K.along("-z", link="link2")
    assert (first.load > 0.0) == case.arm.has_friction


def _plan(case: Case, _: Path) -> None:
    along = cdsm.stiffness(
        case.pose, cdsm.distribute_tension(case.pose, MINIMUM, MAXIMUM, case.wrench)
    ).along("z")
    least = (MINIMUM, MAXIMUM, case.wrench)
    plan = cdsm.plan_stiffness(case.pose, "z", 0.99 * along, *least, at_least=True)
    assert plan.reached
    K = cdsm.stiffness(case.pose, plan.tension)
    assert K.along("z") >= 0.99 * along * (1.0 - 1e-6)
    assert abs(K.residual).max() < 1e-9


def _payload(case: Case, _: Path) -> None:
    held = cdsm.payload(case.pose, "-z", MINIMUM, MAXIMUM, case.wrench, link="link2")
    force = held.limits["tension"]
    base = LOADS if case.wrench is LOADS else []
    within, beyond = (
        [*base, cdsm.Load("link2", (0.0, 0.0, -part * force))] for part in (0.999, 1.001)
    )
    cdsm.distribute_tension(case.pose, MINIMUM, MAXIMUM, within)
    with pytest.raises(cdsm.InfeasibleTension):
        cdsm.distribute_tension(case.pose, MINIMUM, MAXIMUM, beyond)
    assert held.locked is not None


def _mujoco(case: Case, _: Path) -> None:
    """The model of a rest without given loads holds still."""
    mujoco = pytest.importorskip("mujoco")
    rest = cdsm.equilibrium(case.pose, case.tension)
    model = mujoco.MjModel.from_xml_string(cdsm.to_mjcf(case.arm, rest.pose, rest.tension))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    net = data.qfrc_passive - data.qfrc_bias + data.qfrc_actuator
    followers = case.arm.body.coupling
    if followers:
        net = net @ followers.matrix
    if case.arm.wraps:  # beside their plane, its pulleys differ
        assert "are smooth cylinders" in cdsm.to_mjcf(case.arm)
    else:
        assert abs(net).max() < 1e-9


def _written(case: Case, folder: Path) -> None:
    assert cdsm.Manipulator.read(case.arm.write(folder / "arm.toml")) == case.arm


def _sure(case: Case, _: Path) -> None:
    tolerances = cdsm.Tolerances(joint_angle=1e-3)
    for_z: Any = {"direction": "z", "wrench": case.wrench}
    budget = cdsm.uncertainty(case.pose, case.tension, tolerances, **for_z)
    ends = []
    for i in range(case.arm.nv):
        q = case.pose.q + 1e-4 * np.outer([1.0, -1.0], np.eye(case.arm.nv)[i])
        K = [cdsm.stiffness(case.arm.at(row), case.tension, case.wrench) for row in q]
        ends.append((K[0].along("z") - K[1].along("z")) / 2e-4)
    expected = 1e-3 * float(np.linalg.norm(ends))
    assert budget.standard_uncertainty == pytest.approx(expected, rel=1e-3)


def _modes(case: Case, _: Path) -> None:
    K = cdsm.stiffness(case.pose, case.tension, case.wrench)
    found = cdsm.modes(K)
    M = case.arm.body.mass_matrix(case.pose.q)
    symmetric = (K.joint + K.joint.T) / 2.0
    for shape, omega in zip(found.shapes.T, found.frequencies, strict=True):
        left = symmetric @ shape - (2.0 * np.pi * omega) ** 2 * (M @ shape)
        assert abs(left).max() < 1e-6 * abs(symmetric @ shape).max()


ASKED: dict[str, Callable[[Case, Path], None]] = {
    "stiffness and batch": _stiffness,
    "least tension": _tension,
    "least tensions of a batch": _tensions,
    "rest": _rest,
    "rest under held tensions": _held,
    "rest under pulls": _pulled,
    "rest of turned motors": _turned,
    "tensions of an assembly": _assembled,
    "weight": _weighed,
    "load cycle": _cycled,
    "stuck": _stuck,
    "plan": _plan,
    "payload": _payload,
    "MuJoCo": _mujoco,
    "ARM.toml": _written,
    "uncertainty": _sure,
    "vibration": _modes,
}

Refusal = tuple[str, frozenset[str], str]
_FREE = r"(?:tensions|lengths) of \d+ cables are not free: \d+ motors move them\. \w"
_ROUGH = "pair yields: friction in the holes would couple all cables that it moves. Take friction 0"
REFUSED: list[Refusal] = [
    *(
        (asked, frozenset([motors]), _FREE)
        for asked in (
            "rest under held tensions",
            "rest under pulls",
            "least tensions of a batch",
            "plan",
            "payload",
        )
        for motors in ("rigid motors", "yielding motors")
    ),
    *(
        (asked, frozenset(["yielding motors", "friction"]), _ROUGH)
        for asked in (
            "rest under held tensions",
            "rest under pulls",
            "rest of turned motors",
            "weight",
            "load cycle",
            "stuck",
        )
    ),
    ("MuJoCo", frozenset(["yielding motors"]), "pair yields, and a model in MuJoCo has rigid"),
]


def _name(features: frozenset[str]) -> str:
    return " + ".join(name for name in FEATURES if name in features) or "nothing"


@pytest.mark.parametrize("features", CELLS, ids=_name)
@pytest.mark.parametrize("asked", ASKED)
def test_each_cell_is_answered_or_refused_by_name(
    asked: str, features: frozenset[str], tmp_path: Path
) -> None:
    words = [text for what, which, text in REFUSED if what == asked and which <= features]
    if not words:
        ASKED[asked](Case(features), tmp_path)
        return
    with pytest.raises(cdsm.InvalidInput) as refused:
        ASKED[asked](Case(features), tmp_path)
    message = str(refused.value)
    assert any(re.search(text, message) for text in words), message
