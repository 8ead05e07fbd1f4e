"""A term of the energy is one class: here a torsional spring that is quartic in the angle."""

import pickle
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import cdsm
from cdsm.support.values import Array
from tests.support import arms, locked
from tests.support.differences import assert_second_order, gravity_energy
from tests.support.rough import rough


@dataclass(frozen=True)
class QuarticSpring:
    """U = ¼ k Σ θ⁴."""

    k: float
    name: str = "quartic"

    def energy(self, pose: cdsm.Posture) -> float:
        return float(0.25 * self.k * (pose.q**4).sum())

    def torque(self, pose: cdsm.Posture) -> Array:
        return self.k * pose.q**3

    def stiffness(self, pose: cdsm.Posture) -> Array:
        return np.diag(3.0 * self.k * pose.q**2)


SPRING = QuarticSpring(30.0)


def sprung(kind: str = "universal") -> tuple[cdsm.Posture, cdsm.Tension]:
    arm = arms.random_arm(3, 2, kind).with_terms([SPRING])
    pose = arms.random_posture(arm, 5, 0.4)
    return pose, cdsm.distribute_tension(pose, 30.0, wrench=(0.0, 0.5, -1.0, 0.0, 0.0, 0.0))


def out_of_balance(pose: cdsm.Posture, pulled: Array, wrench: Array) -> float:
    """Largest torque [N m], of everything but the spring from the public arrays of the posture."""
    spring = SPRING.k * pose.q**3
    torque = pulled + pose.gravity_torque - wrench @ pose.jacobian + spring
    assert abs(spring).max() > 1e-3  # of the size of what it is compared with
    return float(abs(torque).max())


def test_stiffness_has_the_term_and_is_the_hessian_of_the_energy() -> None:
    pose, pull = sprung()
    K = cdsm.stiffness(pose, pull)
    assert list(K.terms) == ["active", "passive", "gravity", "load", "springs", "quartic"]
    np.testing.assert_array_equal(K.terms["quartic"], np.diag(3.0 * SPRING.k * pose.q**2))
    np.testing.assert_allclose(K.joint, sum(K.terms.values()), rtol=1e-15, atol=1e-13)
    F, W, k, L = K.tension, K.wrench, K.cable_stiffness, pose.cable_lengths

    def energy(q: Array) -> Array:
        moved = pose.arm.at(q, check_limits=False)
        longer = moved.cable_lengths - L
        cables = F @ longer + 0.5 * k @ longer**2
        load = W[:3] @ (moved.tip[:3, 3] - pose.tip[:3, 3])
        spring = 0.25 * SPRING.k * (q**4).sum()
        return np.array(cables + gravity_energy(moved) - load + spring)

    size = float(abs(F @ L))
    assert_second_order(energy, K.joint, pose.q, order=2, size=size, tolerance=1e-6)
    assert abs(K.residual).max() < 1e-10 * size


def test_tensions_balance_it() -> None:
    pose, pull = sprung()
    assert out_of_balance(pose, pull.values @ pose.length_jacobian, pull.wrench) < 1e-10
    assert abs(pull.residual).max() < 1e-10


def test_shares_and_print_name_it() -> None:
    pose, pull = sprung()
    K = cdsm.stiffness(pose, pull)
    shares = K.shares("z")
    assert shares.total == pytest.approx(K.along("z"), rel=1e-9)
    assert shares.terms["quartic"] > 0.0
    assert "quartic" in str(shares)
    assert "  of it quartic" in str(K)
    assert K.pseudoinverse("quartic").shape == (3, 3)
    assert K.to_dict()["quartic_Nm_per_rad"] == K.terms["quartic"].tolist()


def test_equilibrium_and_weight_test_feel_it() -> None:
    pose, pull = sprung()
    load = pull.wrench + np.array([0.0, 0.0, -2.0, 0.0, 0.0, 0.0])
    rest = cdsm.equilibrium(pose, pull, load)
    pulled = rest.tension @ rest.pose.length_jacobian
    assert out_of_balance(rest.pose, pulled, load) < 1e-8
    weighed = cdsm.weight_test(pose, pull, [0.0, 0.0, -1e-3])
    assert weighed.stiffness == pytest.approx(cdsm.stiffness(pose, pull).along("z"), rel=1e-4)


def test_forward_statics_of_a_hinge_ends_where_pull_and_spring_agree() -> None:
    arm = locked.hinge().with_terms([SPRING]).with_springs({"joint1": 0.01})
    rest = cdsm.forward_statics(arm, tension=[10.0, 20.0])

    def torque(angle: float) -> float:
        pulls = 10.0 * locked.half(1, angle)[1] + 20.0 * locked.half(-1, angle)[1]
        return pulls + 0.01 * angle + SPRING.k * angle**3

    assert rest.pose.q[0] == pytest.approx(brentq(torque, -1.0, 1.0, xtol=1e-14), rel=1e-9)


@pytest.mark.parametrize("mu", [0.0, 0.2])
def test_load_cycle_passes_through_equilibria_with_it(mu: float) -> None:
    pose, pull = sprung("hinged")
    pose = rough(pose.arm, mu).at(pose.q)
    pull = cdsm.distribute_tension(pose, 30.0)
    wrenches = np.array([[0.0, 0.0, -3.0, 0.0, 0.0, 0.0], [0.0, 2.0, 0.0, 0.0, 0.0, 0.0]])
    history = cdsm.load_cycle(pose, pull, wrenches)
    for i, wrench in enumerate(wrenches):
        state = history.pose(i)
        T = np.concatenate([tensions[i] for tensions in history.tensions])
        pulled = T @ state.segments.length_jacobian
        assert out_of_balance(state, pulled, wrench) < 1e-7


def test_report_differentiates_it() -> None:
    pose, pull = sprung()
    report = cdsm.stiffness(pose, pull).report()
    rows = {row.name: row for row in report.comparisons}
    assert rows["quartic"].verdict == rows["quartic torque"].verdict == "agrees"
    assert (rows["batch"].verdict, rows["batch"].reason) == (
        "not possible",
        "no kernel for quartic",
    )
    assert report.passed, report.faults

    class Wrong(QuarticSpring):
        def stiffness(self, pose: cdsm.Posture) -> Array:
            return 1.001 * super().stiffness(pose)

    wrong = pose.arm.with_terms([Wrong(SPRING.k)]).at(pose.q)
    K = cdsm.stiffness(wrong, pull.values, wrench=pull.wrench)
    differing = {row.name for row in K.report().comparisons if row.verdict == "DIFFERS"}
    assert "quartic" in differing
    assert differing <= {"quartic", "joint"}


def test_plans_count_it() -> None:
    arm = cdsm.presets.virtual_prototype().with_terms([SPRING])
    pose = arm.at(np.full(arm.nv, 0.15))
    least = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 30.0)).along("z")
    F = cdsm.plan_stiffness(pose, "z", 1.1 * least, 30.0).tension
    assert cdsm.stiffness(pose, F).along("z") == pytest.approx(1.1 * least, rel=1e-6)
    assert out_of_balance(pose, F.values @ pose.length_jacobian, F.wrench) < 1e-8


def test_arm_is_equal_to_its_pickle_and_differs_from_another_spring() -> None:
    arm = sprung()[0].arm
    assert pickle.loads(pickle.dumps(arm)) == arm
    assert arm.with_gravity("-y").terms[-1] == SPRING
    assert arm != arm.with_terms([QuarticSpring(31.0)])
    assert arm != arm.with_terms([])


@pytest.mark.parametrize(
    ("terms", "said"),
    [
        (SPRING, "give a list of terms"),
        ([object()], "is no term"),
        ([QuarticSpring(1.0, "gravity")], "'gravity' is in use"),
        ([SPRING, SPRING], "'quartic' is in use"),
    ],
)
def test_what_is_no_term_is_refused(terms: object, said: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=said):
        locked.hinge().with_terms(terms)  # type: ignore[arg-type]


# --- chapters and terms -----------------------------------------------------------------------

POSE, PULL = sprung()
ARM = POSE.arm

ABLE: dict[str, Callable[[], object]] = {
    "kinematics": lambda: cdsm.inverse_kinematics(ARM, POSE.tip[:3, 3]),
    "tension": lambda: cdsm.distribute_tension(POSE, 30.0),
    "stiffness": lambda: cdsm.stiffness(POSE, PULL),
    "report": lambda: cdsm.stiffness(POSE, PULL).report(),
    "friction": lambda: cdsm.breakaway(POSE, PULL, "z"),
    "equilibrium": lambda: cdsm.equilibrium(POSE, PULL),
    "load cycle": lambda: cdsm.load_cycle(POSE, PULL, np.zeros((1, 6))),
    "weight test": lambda: cdsm.weight_test(POSE, PULL, [0.0, 0.0, -1.0]),
    "modes": lambda: cdsm.modes(cdsm.stiffness(POSE, PULL)),
    "payload": lambda: cdsm.payload(POSE, "z", 1.0, 200.0),
    "force polytope": lambda: cdsm.force_polytope(POSE, 1.0, 200.0),
    "isotropy": lambda: cdsm.isotropy(cdsm.stiffness(POSE, PULL)),
    "plan": lambda: cdsm.stiffness_range(POSE, "z", 30.0, 200.0),
    "gradient": lambda: cdsm.stiffness_gradient(cdsm.stiffness(POSE, PULL)),
    "plot": lambda: cdsm.plots.plot_shares(cdsm.stiffness(POSE, PULL).shares("z")),
}
REFUSING: dict[str, Callable[[], object]] = {
    "batch": lambda: cdsm.evaluate(ARM, POSE.q[None], PULL.values),
    "batch of tensions": lambda: cdsm.distribute_tensions(ARM, POSE.q[None], 30.0),
    "sweep": lambda: cdsm.sweep(ARM, POSE.q[None], minimum=30.0, outputs=["margin"]),
    "tolerances": lambda: cdsm.uncertainty(
        POSE, PULL, cdsm.Tolerances(hole_radius=1e-4), direction="z"
    ),
    "design": lambda: cdsm.DesignProblem(
        arm=ARM, variables=(), objectives=(), postures=POSE.q[None]
    ),
    "MuJoCo": lambda: cdsm.to_mjcf(ARM),
    "ARM.toml": lambda: ARM.write(Path("never-written.toml")),
}


@pytest.mark.parametrize("chapter", ABLE)
def test_chapter_takes_the_term(chapter: str) -> None:
    ABLE[chapter]()


@pytest.mark.parametrize("chapter", REFUSING)
def test_chapter_refuses_the_term_by_its_name(chapter: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match="quartic"):
        REFUSING[chapter]()
