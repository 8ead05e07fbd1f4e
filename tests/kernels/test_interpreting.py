"""Python runs kernels for wide blocks of postures with the bits of the compiled ones."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

import cdsm
from cdsm.batch.evaluation import OUTPUTS
from cdsm.kernels.compiling import at_once
from cdsm.support.values import Array
from tests.batch.test_evaluation import ARMS, DIRECTIONS, problem
from tests.support.patience import HANGS
from tests.support.processes import ROOT

IN_PYTHON = """
import sys
import numpy as np
from cdsm.kernels import compiling
from cdsm.batch.fused_kernel import evaluate_rows
from tests.kernels.test_interpreting import answers
compiling._PATIENCE = float("inf")
np.savez(sys.argv[1], **answers())
assert not evaluate_rows.signatures
"""


def answers() -> dict[str, Array]:
    """All quantities of many postures of many arms; some have none."""
    found: dict[str, Array] = {}
    for name, arm in ((name, make()) for name, make in ARMS.items()):
        q, tension, wrench = problem(arm, 40)
        q[7] *= 4.0
        tension[9] *= 20.0
        given = cdsm.evaluate(arm, q, tension, wrench, OUTPUTS, direction=DIRECTIONS)
        pulled = cdsm.evaluate(arm, q, minimum=20.0, maximum=400.0, outputs=("joint", "margin"))
        for batch in (given, pulled):
            values = zip(batch.outputs, batch.values, strict=True)
            own: dict[str, Any] = {"status": batch.status, **dict(values)}
            found |= {f"{name} {len(batch.outputs)} {key}": value for key, value in own.items()}
    return found


def test_wide_blocks_in_python_have_the_bits_of_compiled_ones(tmp_path: Path) -> None:
    subprocess.run(
        [sys.executable, "-c", IN_PYTHON, str(tmp_path / "python.npz")],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(tmp_path / "empty")},
        timeout=HANGS,
        check=True,
    )
    with at_once():
        compiled = answers()
    with np.load(tmp_path / "python.npz") as kept:
        for name, value in compiled.items():
            # the sign of NaN means nothing
            assert (np.isnan(kept[name]) == np.isnan(value)).all(), name
            same = np.nan_to_num(kept[name]).tobytes() == np.nan_to_num(value).tobytes()
            assert same, name
