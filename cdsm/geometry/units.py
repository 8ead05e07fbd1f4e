"""Doubts about the units of lengths and angles, as texts of warnings."""

from __future__ import annotations

from collections.abc import Iterable

# a longer arm, a larger hole radius or disk offset than this [m] was probably given in millimetres
LONGEST, WIDEST = 30.0, 1.0


def doubts_about_units(length: float, sizes: Iterable[tuple[str, float, float]] = ()) -> list[str]:
    """Return a warning text if lengths [m] look as if they are not in metres, else an empty list.

    ``length`` is that of the arm; ``sizes`` are names, values and their largest plausible values.
    """
    if 0.0 < length < 1e-3:
        unit = "another unit; give them in metres, or in mm as options of the command line."
        return [f"the arm is {length:.4g} m long: it looks as if lengths are in {unit}"]
    every = [("the arm", length, LONGEST), *sizes]
    large = ", ".join(f"{what} is {size:.4g} m" for what, size, most in every if size > most)
    return [f"{large}: it looks as if lengths are in mm; give them in metres."] if large else []


def doubts_about_angle(what: str, angle: float, most: float) -> list[str]:
    """Return a warning text if ``angle`` [rad] is larger than any plausible one, ``most`` [rad]."""
    doubt = f"{what} {angle:g} rad: it looks as if it is in degrees; give rad."
    return [doubt] if abs(angle) > most else []
