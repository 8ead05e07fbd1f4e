"""What all figures share: names, colours and the units of their axes."""

from __future__ import annotations

from typing import Final

AXES: Final = ("x", "y", "z")
COLORS: Final = ("#3b6fb6", "#c8553d", "#4f8f5b")
STYLES: Final = ("-", "--", "-.", ":")
MM: Final = 1e3
N_PER_MM: Final = 1e-3
