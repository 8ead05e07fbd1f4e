"""Base classes of errors and warnings, and functions that list many faults in a message."""

from __future__ import annotations

from collections.abc import Sequence


def listed(faults: Sequence[str], most: int | None = None) -> str:
    """Return a text with a line for each of the first ``most`` faults and the number of others."""
    more = "" if most is None or len(faults) <= most else f"\n  and {len(faults) - most} more"
    return "".join(f"\n  - {fault}" for fault in faults[:most]) + more


def counted(faults: Sequence[str], most: int | None = None) -> str:
    """Return a text with the number of faults, then the lines of :func:`listed`."""
    count = "1 fault" if len(faults) == 1 else f"{len(faults)} faults"
    return f"{count}:{listed(faults, most)}"


def first_of(said: Sequence[str], most: int, what: str) -> str:
    """Join the first ``most`` texts, and add the number of the others: ``…; and 3 joints more``.

    ``what`` is the noun after this number, such as ``joints``.
    """
    more = len(said) - most
    return "; ".join(said[:most]) + (f"; and {more} {what} more" if more > 0 else "")


NAMED = 4
"""Number of joints or cables that a message names; the attributes of the error list all."""


def named(words: Sequence[str]) -> str:
    """Join the first :data:`NAMED` words by commas; ``…`` at the end stands for the others."""
    return ", ".join(words[:NAMED]) + (", …" if len(words) > NAMED else "")


LONGEST = 8000
"""Largest number of characters of a message, since a name in a file can be very long."""


class CdsmError(Exception):
    """Base class of all errors raised by cdsm."""

    def __init__(self, message: str = "") -> None:
        more = len(message) - LONGEST
        super().__init__(message if more <= 0 else f"{message[:LONGEST]}… ({more} characters more)")

    def __reduce__(self) -> tuple[object, ...]:
        # subclasses have attributes, which Exception's own pickling would lose
        return (_restore, (type(self), self.args, self.__dict__))


def _restore(kind: type[CdsmError], args: tuple[object, ...], data: dict[str, object]) -> CdsmError:
    error = kind.__new__(kind, *args)
    error.args = args
    error.__dict__.update(data)
    for value in data.values():
        if hasattr(value, "setflags"):
            value.setflags(write=False)
    return error


class CdsmWarning(UserWarning):
    """Class of all warnings of cdsm: an input is possible, but probably not intended."""
