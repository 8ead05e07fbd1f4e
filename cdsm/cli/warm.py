"""``cdsm warm``: compile the kernels."""

from __future__ import annotations

import time

from cdsm.cli.options import AsJson
from cdsm.cli.output import answer


def warm(as_json: AsJson = False) -> None:
    """Compile all kernels now, once on this machine, so that later commands start at once."""
    import numpy as np

    import cdsm
    from cdsm._former.compiling import at_once
    from cdsm.support.progress import progress_bar

    start = time.perf_counter()
    arm = cdsm.presets.virtual_prototype()
    with at_once(), progress_bar("compiling kernels, two or three minutes"):
        pose = arm.at(np.full(arm.nv, 0.05))
        tension = cdsm.distribute_tension(pose, minimum=40.0)
        K = cdsm.stiffness(pose, tension)
        str(K)
        up = (0.0, 0.0, 1.0)
        readings = ("margin", "along", "compliance", "cartesian", "pseudoinverse")
        rough = cdsm.presets.virtual_prototype(friction=0.1).at(pose.q)
        q, F = pose.q[None], tension.values
        for directions in (up, [up] * 999):  # so many numbers for a posture as if the arm were long
            cdsm.evaluate(arm, q, minimum=40.0, direction=directions, outputs=readings)
        cdsm.distribute_tensions(arm, q, 40.0, 60.0)  # runs the search for tensions
        cdsm.load_cycle(rough, F, np.zeros((1, 6)))
    seconds = time.perf_counter() - start
    answer(as_json, lambda: {"seconds": seconds}, f"kernels are compiled: {seconds:.0f} s")
