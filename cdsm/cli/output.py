"""Shared by all commands: answers as text or JSON, pictures, errors and exit codes."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import cdsm
from cdsm.cli.conditions import Conditions

if TYPE_CHECKING:
    from rich.console import Console

    from cdsm.support.values import Array

Json = dict[str, object]
"""Numbers of an answer in SI, with units in the keys. Arrays and infinite numbers are allowed."""

debug_wanted: ContextVar[bool] = ContextVar("debug_wanted", default=False)
"""Whether the running command shows tracebacks."""

UNMET = 3
"""Exit code of a negative answer (unstable, untrusted, infeasible); 1: error, 2: wrong option."""


@cache
def console() -> Console:
    """Return the console for progress and errors. Answers go to standard output."""
    from rich.console import Console

    return Console(stderr=True)


def answer(as_json: bool, as_dict: Callable[[], Json], *parts: object) -> None:
    """Print an answer: its parts as text, or its numbers as strict JSON."""
    if as_json:
        from cdsm.support.format import plain

        told = as_dict()
        for part in parts:
            if isinstance(part, Conditions):
                told = part.to_dict() | told
        typer.echo(json.dumps(plain(told), indent=1, allow_nan=False))
    else:
        typer.echo("\n\n".join(map(str, parts)))


def joints(arm: cdsm.Manipulator, q: Array) -> Json:
    """Return joint coordinates q (..., nv) by joint name, for JSON."""
    from cdsm.support.format import JointUnits

    return JointUnits(arm.slides).to_dict(arm.joint_names, q)


def by_cable(arm: cdsm.Manipulator, values: Array) -> Json:
    """Return one number per cable (C,) by the name of the cable, for JSON."""
    return dict(zip((cable.name for cable in arm.cables), values.tolist(), strict=True))


def write_picture(path: Path | None, draw: str, *results: object, err: bool = True) -> None:
    """Draw results with the function ``draw`` of :mod:`cdsm.plots`, if a path is given."""
    if path is not None:
        figure = getattr(cdsm.plots, draw)(*results)
        typer.echo(f"written: {cdsm.plots.save_figure(figure, path)}", err=err)


def _show(
    usual: Callable[..., None], message: Warning, category: type[Warning], *where: Any
) -> None:
    """Show a warning of cdsm in one line, and any other in the usual manner."""
    if not issubclass(category, cdsm.CdsmWarning):
        return usual(message, category, *where)
    text = f"warning: {message}"
    return console().print(text, style="yellow", markup=False, highlight=False, soft_wrap=True)


@contextmanager
def reported() -> Iterator[None]:
    """Turn an error into a message and exit code 1, Ctrl-C into 130; --debug changes nothing.

    A warning of cdsm becomes one line, too.
    """
    try:
        with warnings.catch_warnings():
            warnings.showwarning = partial(_show, warnings.showwarning)
            yield
    # OSError: of the terminal or pipe
    except (KeyboardInterrupt, cdsm.CdsmError, OSError) as error:
        if debug_wanted.get():
            raise
        if isinstance(error, KeyboardInterrupt):
            console().print("interrupted: no file is half-written, and what --resume keeps stays")
            raise typer.Exit(130) from None
        console().print(
            f"error: {error}", style="red", markup=False, highlight=False, soft_wrap=True
        )
        raise typer.Exit(1) from None
