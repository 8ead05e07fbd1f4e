"""Inner kernels, made callable from Python, and blocks of postures."""

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from cdsm.support.values import Array


def from_python(kernel: Any) -> Any:
    """Compile an inner kernel once more, with an entry for Python."""
    return numba.njit(error_model="numpy")(kernel.py_func)


def block(rows: NDArray[np.floating[Any]]) -> Array:
    """Return values (W, …) of some postures with the posture as last axis, copied."""
    return np.array(np.moveaxis(rows, 0, -1), dtype=np.float64, order="C")
