"""Print answers and errors of all commands as text or JSON, write files, and set exit codes."""

from __future__ import annotations

import json
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import typer

import cdsm
from cdsm.cli.conditions import Conditions
from cdsm.cli.words import in_options

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console

    from cdsm.support.values import Array

Json = dict[str, object]
"""Answer for JSON: numbers in SI, units in the keys. Arrays and infinite numbers are allowed."""

debug_wanted: ContextVar[bool] = ContextVar("debug_wanted", default=False)
"""Whether the running command shows tracebacks."""

FAILED, MISUSED, UNMET, INTERRUPTED = 1, 2, 3, 130
"""Exit codes: an error; a wrong option; the arm does not do what was asked; Ctrl-C.

UNMET is the exit code of every answer with a warning: the arm is unstable or has left its
reference, some samples cannot be planned, no entry of a sweep is ok, or a report
fails. It is also the exit code of errors that say what the arm cannot do.
"""

_LIST = re.compile(r"(?<=\[)\n[^][{}\"]*\n\s*(?=\])")
"""Pattern of a JSON list of numbers with a line for each number; it is printed in one line."""

_UsageError = cast(type[typer.BadParameter], typer.BadParameter.__mro__[1])
"""Base class of errors of usage, of which typer has no public name."""


@cache
def console() -> Console:
    """Return the console for progress and errors. Answers go to standard output."""
    from rich.console import Console

    return Console(stderr=True)


def answer(
    as_json: bool, as_dict: Callable[[], Json], *parts: object, warnings: Sequence[str] = ()
) -> None:
    """Print an answer, its warnings first: ``parts`` as text, or ``as_dict()`` as strict JSON.

    If there are warnings, the command ends here with exit code 3. So a command must write its files
    before it calls this function.
    """
    if as_json:
        numbers: Json = {"warnings": warnings}
        for part in parts:
            if isinstance(part, Conditions):
                numbers |= part.to_dict()
        _print_json(numbers | as_dict())
    else:
        texts = (
            "\n".join(line for line in in_options(str(part)).splitlines() if line not in warnings)
            for part in parts
        )
        typer.echo("\n".join([*warnings, "\n\n".join(texts)]))
    if warnings:
        raise typer.Exit(UNMET)


def _print_json(numbers: Json) -> None:
    from cdsm.support.format import plain

    text = json.dumps(plain(numbers), indent=1, allow_nan=False, default=str)
    typer.echo(_LIST.sub(lambda found: re.sub(r"\s+", " ", found[0]).strip(), text))


def by_cable(arm: cdsm.Manipulator, values: Array) -> Json:
    """Return ``values``, one per cable (C,), by the name of the cable, for JSON."""
    return dict(zip(arm.cables.names, values.tolist(), strict=True))


def write(path: Path | None, fill: Callable[[Path], object]) -> None:
    """If a path is given, write the file by ``fill(path)``; print its path on standard error."""
    if path is not None:
        fill(path)
        typer.echo(f"written: {path}", err=True)


def write_picture(path: Path | None, draw: Callable[[], Figure]) -> None:
    """If a path is given, write the figure that ``draw`` returns."""
    write(path, lambda file: cdsm.plots.save_figure(draw(), file))


def _show(
    usual: Callable[..., None], message: Warning, category: type[Warning], *where: Any
) -> None:
    """Print a warning of cdsm in one line, and other warnings by ``usual``, Python's function."""
    if not issubclass(category, cdsm.CdsmWarning):
        return usual(message, category, *where)
    text = f"warning: {message}"
    return console().print(text, style="yellow", markup=False, highlight=False, soft_wrap=True)


@contextmanager
def misuse_reported(as_json: bool) -> Iterator[None]:
    """If ``as_json``, print an error of usage as JSON and exit with 2; else typer reports it."""
    try:
        yield
    except _UsageError as error:
        if debug_wanted.get() or not as_json:
            raise
        _print_json({"error": "UsageError", "message": error.format_message(), "data": {}})
        raise typer.Exit(MISUSED) from None


@contextmanager
def reported(as_json: bool) -> Iterator[None]:
    """Turn an error into a message (JSON if ``as_json``) and an exit code.

    With --debug, the error is raised. A warning of cdsm is printed in one line.
    """
    try:
        with misuse_reported(as_json), warnings.catch_warnings():
            warnings.showwarning = partial(_show, warnings.showwarning)
            yield
    except (KeyboardInterrupt, SystemError) as error:
        # Ctrl-C within a compiled kernel raises SystemError from KeyboardInterrupt
        if debug_wanted.get() or not isinstance(error.__cause__ or error, KeyboardInterrupt):
            raise
        console().print("interrupted: no file is half-written; what was saved stays")
        raise typer.Exit(INTERRUPTED) from None
    # OSError: of the terminal or pipe
    except (cdsm.CdsmError, OSError) as error:
        if debug_wanted.get():
            raise
        message = in_options(str(error))
        if as_json:
            kind = type(error).__name__
            _print_json({"error": kind, "message": message, "data": vars(error)})
        else:
            console().print(
                f"error: {message}", style="red", markup=False, highlight=False, soft_wrap=True
            )
        cannot = (
            cdsm.InfeasibleDesign,
            cdsm.InfeasibleTension,
            cdsm.EquilibriumError,
            cdsm.UnreachableStiffness,
        )
        raise typer.Exit(UNMET if isinstance(error, cannot) else FAILED) from None
