"""Speed of a step of control at n = 5, against the functions for one posture."""

import numpy as np

import cdsm
from cdsm import control
from cdsm.control.estimates import Observer
from cdsm.control.laws import Moment
from cdsm.control.stiffness_loop import StiffnessLoop
from cdsm.support.values import Array
from tests.benchmarks.timing import Clock
from tests.support.tracking import WANTED, circle


def test_control_step_takes_less_than_half_of_single_solutions(
    clock: Clock | None,
) -> None:
    plan = circle(0.1)
    arm, low, high = plan.arm, np.full(15, 10.0), np.full(15, 250.0)
    run = cdsm.track(plan, "stiffness", steps=2, minimum=10.0, maximum=250.0)
    observer = Observer(arm, cdsm.Sensors(tension_noise=0.5))
    truth = [state.true for state in run.states]
    loop = StiffnessLoop(arm, run.directions, low, high, np.full(15, 10.0))
    first = control.Reference(run.angles[0], run.tension[0], truth[0].wire, np.full(15, 5e4))
    start = observer.update(observer.begin(run.angles[0], truth[0]), truth[0])
    forced = np.arange(15) % 3 == 0

    def step() -> tuple[Array, control.Command]:
        estimate = observer.update(start, truth[1])
        wanted = loop.next(first, np.array([WANTED]), estimate, run.tension[0]).reference
        moment = Moment(wanted, truth[1], wanted, truth[1], truth[1].wire, low, high, forced)
        return estimate.pose.q, control.mixed(moment)

    def naive() -> tuple[Array, cdsm.StiffnessPlan]:
        lengths = np.array(
            [
                wire + float(cable.elongation(F, wire))
                for cable, wire, F in zip(arm.cables, *truth[1], strict=True)
            ]
        )
        q = cdsm.solve_joint_angles(arm, lengths, run.angles[0], tolerance=1e-2).angles
        return q, cdsm.plan_stiffness(arm.at(q), "z", WANTED, 10.0, 250.0, progress=False)

    (q, command), (other, plan_there) = step(), naive()
    assert abs(q - run.angles[1]).max() < np.deg2rad(0.1)
    assert abs(other - q).max() < np.deg2rad(0.5)
    assert plan_there.reached
    assert ((command.tension >= 10.0) & (command.tension <= 250.0)).all()
    if clock:
        what = "control step, n = 5: faster than single solutions"
        clock.race(what, naive, step, least=2.5, fast_repeat=5, rounds=6)
