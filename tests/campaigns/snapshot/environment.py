"""The tree whose answers are taken, and the environment of its run."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Iterator
from typing import Any

FIXED = {"COLUMNS": "100", "LINES": "40", "NO_COLOR": "1", "TERM": "dumb", "MPLBACKEND": "Agg"}
FIXED |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""The environment in which answers do not depend on the terminal or the number of cores."""

TREE = os.environ.get("CDSM_TREE", os.getcwd())
"""The folder of the tree; another than the one that holds this file has to be named."""

sys.path.insert(0, TREE)
cdsm: Any = importlib.import_module("cdsm")

Named = Iterator[tuple[str, Any]]
