"""``cdsm warm``: compile the kernels."""

from __future__ import annotations

import time

from cdsm.cli.options import AsJson
from cdsm.cli.output import answer


def warm(as_json: AsJson = False) -> None:
    """Compile all kernels now, once on this machine, so that later commands start at once."""
    import numpy as np

    import cdsm
    from cdsm.kernels.compiling import at_once
    from cdsm.support.progress import progress_bar

    start = time.perf_counter()
    arm = cdsm.presets.virtual_prototype()
    with at_once(), progress_bar("compiling kernels, up to two minutes"):
        pose = arm.at(np.full(arm.nv, 0.05))
        tension = cdsm.distribute_tension(pose, minimum=40.0)
        K = cdsm.stiffness(pose, tension)
        str(K)
        up = (0.0, 0.0, 1.0)
        cdsm.plan_stiffness(pose, up, 1.01 * K.along(up), minimum=40.0)
        readings = ("margin", "along", "compliance", "cartesian", "pseudoinverse")
        cdsm.evaluate(arm, pose.q[None], minimum=40.0, direction=up, outputs=readings)
        cdsm.distribute_tensions(arm, pose.q[None], 40.0, 60.0)  # runs the search for tensions
        rough = cdsm.presets.virtual_prototype(friction=0.1).at(pose.q)
        cdsm.evaluate(rough.arm, pose.q[None], tension.values, direction=up, outputs=("breakaway",))
        cdsm.load_cycle(rough, tension.values, np.zeros((1, 6)))
    seconds = time.perf_counter() - start
    answer(as_json, lambda: {"seconds": seconds}, f"kernels are compiled: {seconds:.0f} s")
