"""What the live view costs for each move of a slider, as a ratio and, printed, in Hz.

pytest tests/benchmarks/test_view_speed.py -s
"""

import itertools

import numpy as np
import pytest

import cdsm
from cdsm.view import Setting, serve, show
from tests.benchmarks.timing import seconds, speed_ratio

pytest.importorskip("viser", reason="the extra [view] is not installed")


def test_a_moved_slider_costs_a_fifth_of_a_new_page() -> None:
    arm = cdsm.presets.virtual_prototype()  # n = 5, 15 cables
    angles = itertools.cycle(np.deg2rad(np.linspace(-10.0, 10.0, 40)))
    with serve(arm, port=0) as view:

        def move() -> None:
            setting = Setting(q=np.full(arm.nv, next(angles)), minimum=30.0, force=np.zeros(3))
            view._put(show(arm, setting))

        ratio = speed_ratio(
            lambda: serve(arm, port=0).close(),
            move,
            lambda ratio: ratio >= 5.0,
            fast_repeat=20,
            rounds=8,
        )
        best = min(seconds(move, 20) for _ in range(5))
    print(
        f"\nlive view, n = 5: {1.0 / best:.0f} updates/s, one {ratio:.0f} times cheaper than anew"
    )
    assert ratio >= 5.0
