"""Replace arguments in messages of the library by options."""

from __future__ import annotations

import re
from typing import Final

# fmt: off
_ALIKE: Final = (
    "between", "bins", "columns", "count", "damping", "damping_ratio", "decimal", "diameter",
    "direction", "force", "gauge_length", "gravity", "host", "largest_force",
    "largest_tension", "port", "rate", "section", "seed", "solver", "steps", "target",
    "units", "wire", "wrench",
)
# fmt: on
"""Arguments of the library whose options have the same name."""

_OPTIONS: Final = {name: f"--{name.replace('_', '-')}" for name in _ALIKE} | {
    "displacement_std": "--reading-std",
    "maximum": "--max-tension",
    "minimum": "--min-tension",
    "max_change_per_sample": "--rate",
    "outputs": "--quantities",
    "q": "--angles",
    "store": "--resume",
}
"""Name of the option for each argument of the library that a message may name."""

_PYTHON: Final = (
    (", or, in Python, pass check_limits=False to compute beyond them.", "."),
    ("expected value. Give a small one.", "expected value. Give a small one: --friction 0.05."),
    ("by its slack_below()", "with --slack-below"),
    ("slack_below()", "--slack-below"),
    ("leave one, or use search_designs.", "leave one, or leave out --refine."),
    ("; use search_designs.", "; leave out --refine."),
    ("`cdsm fit`, or cdsm.read_tensile_csv and cdsm.fit_tensile_test.", "`cdsm fit`."),
    (", or start from a guess= nearer to it.", "."),
)
"""Remedies in messages that only Python has, each with the text that replaces it."""

_NAMES: Final = "|".join(_OPTIONS)
_ARGUMENT: Final = re.compile(rf"^({_NAMES})(?=: )|\b({_NAMES})=(?!\w)")
"""Pattern of an argument in a message: ``minimum=`` anywhere, or ``minimum: `` at its beginning."""


def in_options(message: str) -> str:
    """Replace arguments in a message of the library by options: ``minimum`` by --min-tension."""
    for remedy, left in _PYTHON:
        message = message.replace(remedy, left)
    return _ARGUMENT.sub(lambda found: _OPTIONS[found[1] or found[2]], message)
