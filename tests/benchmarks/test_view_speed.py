"""What the live view costs for each move of a slider, as a ratio and, printed, in Hz."""

import itertools

import numpy as np
import pytest

import cdsm
from cdsm.view import Setting, serve, show
from tests.benchmarks.timing import Clock, seconds

pytest.importorskip("viser", reason="the extra [view] is not installed")


@pytest.mark.speed
@pytest.mark.parametrize("clock", ["speed"], indirect=True)
def test_a_moved_slider_costs_a_fifth_of_a_new_page(clock: Clock) -> None:
    arm = cdsm.presets.virtual_prototype()  # n = 5, 15 cables
    angles = itertools.cycle(np.deg2rad(np.linspace(-10.0, 10.0, 40)))
    with serve(arm, port=0) as view:

        def move() -> None:
            setting = Setting(q=np.full(arm.nv, next(angles)), minimum=30.0, force=np.zeros(3))
            view._put(show(arm, setting))

        best = min(seconds(move, 20) for _ in range(5))
        print(f"\nlive view, n = 5: {1.0 / best:.0f} updates/s")
        clock.race(
            "live view, n = 5: a moved slider cheaper than a new page",
            lambda: serve(arm, port=0).close(),
            move,
            least=5.0,
            fast_repeat=20,
            rounds=8,
        )
