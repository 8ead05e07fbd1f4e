"""Issue warnings of cdsm that point to a line of the user's program."""

from __future__ import annotations

import sys
import warnings

from cdsm.errors import CdsmWarning

_OURS = {"cdsm", "pydantic", "dataclasses", "contextlib"}


def warn(message: str) -> None:
    """Issue a :class:`CdsmWarning` that names the line of the first caller outside cdsm."""
    level, frame = 1, sys._getframe(1)
    while frame.f_back and frame.f_globals.get("__name__", "").partition(".")[0] in _OURS:
        level, frame = level + 1, frame.f_back
    warnings.warn(message, CdsmWarning, stacklevel=level + 1)
