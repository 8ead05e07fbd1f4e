"""The loaded equilibrium and the laws it needs, against throw-away scripts."""

from typing import Any

import numpy as np
from scipy.integrate import quad
from scipy.optimize import minimize

import cdsm
from cdsm import presets
from cdsm.support.values import Array
from tests.benchmarks.naive import NaiveArm
from tests.benchmarks.test_speed import GRAVITY, RIGIDITY, SIZES, arm
from tests.benchmarks.timing import Clock

FORCE = np.array([10.0, 25.0, -50.0])


def minimised(naive: NaiveArm, q: Array, tension: Array) -> Any:
    """BFGS on the potential of cables, weight and load, its gradient by differences."""
    free = naive.state(q)[0]

    def potential(x: Array) -> float:
        lengths, energy, tip, _ = naive.state(x)
        stretched = tension * free / RIGIDITY + lengths - free
        cables = RIGIDITY / free * np.maximum(stretched, 0.0) ** 2 / 2.0
        return float(cables.sum() + energy - FORCE @ tip)

    return minimize(potential, q, method="BFGS")


def test_equilibrium_is_twenty_times_faster_than_minimising_the_potential(
    clock: Clock | None,
) -> None:
    one = arm(5)
    pose = one.at(np.full(one.nv, presets.TEN_DEGREES))
    pull = cdsm.distribute_tension(pose, 50.0)
    W = np.append(FORCE, np.zeros(3))
    naive = NaiveArm(5, gravity=GRAVITY, **SIZES)

    rest = cdsm.equilibrium(pose, pull, W)
    slow = minimised(naive, pose.q, pull.values)
    tip = naive.state(slow.x)[2]
    # differences of a potential of joules are good for 1e-5 N m; the crosses weigh 1e-6
    np.testing.assert_allclose(slow.x, rest.pose.q, atol=1e-5)
    np.testing.assert_allclose(tip, rest.pose.tip[:3, 3], atol=1e-6)
    assert np.linalg.norm(rest.displacement) > 1e-4

    if clock:
        clock.race(
            "equilibrium, n = 5: faster than BFGS on the potential",
            lambda: minimised(naive, pose.q, pull.values),
            lambda: cdsm.equilibrium(pose, pull, W),
            least=22.0,
            fast_repeat=20,
            rounds=5,
        )


def test_strain_is_three_hundred_times_faster_than_quadrature(clock: Clock | None) -> None:
    law = presets.STRAND_1X19
    tension = np.linspace(20.0, 100.0, 15)

    def integrated() -> list[float]:
        def compliance(F: float) -> float:
            return 1.0 / float(np.polyval(law.coefficients[int(F > 31.0)][::-1], F))

        ends = [(2.2, min(F, 31.0)) for F in tension] + [(31.0, F) for F in tension if F > 31.0]
        return [quad(compliance, *pair, epsabs=0.0, epsrel=1e-12)[0] for pair in ends]

    parts = integrated()
    total = np.array(parts[:15])
    total[tension > 31.0] += parts[15:]
    np.testing.assert_allclose(law.strain(tension), total, rtol=1e-12)
    if clock:
        clock.race(
            "strain of Eq. 19, 15 tensions: faster than quadrature",
            integrated,
            lambda: law.strain(tension),
            least=300.0,
            rounds=5,
        )
