"""Print answers and errors of all commands as text or JSON, write files, and set exit codes."""

from __future__ import annotations

import json
import math
import re
import warnings
from collections.abc import Callable, Iterable, Sequence
from contextvars import ContextVar
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import typer

import cdsm

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cdsm.plots.style import Panels

Json = dict[str, object]
"""Answer for JSON: numbers in SI, units in the keys. Arrays and infinite numbers are allowed."""

debug_wanted: ContextVar[bool] = ContextVar("debug_wanted", default=False)
"""Whether the running command shows tracebacks."""

FAILED = 1
UNMET = 3
INTERRUPTED = 130
"""Exit codes: an error; the arm does not do what was asked; Ctrl-C. A wrong option has 2.

UNMET is the exit code of answers such as that of an unstable arm, and of errors that say what the
arm cannot do. A warning that only qualifies numbers does not change it.
"""

_OF_PYTHON: Final = re.compile(r", or, in Python, .*?(?=\.(\s|$))")  # no remedy of a command


def misuse(option: str, problem: str) -> typer.BadParameter:
    """Return the error to raise for a wrong value of ``option``."""
    return typer.BadParameter(problem, param_hint=option)


def note(text: str) -> None:
    """Print a remark on standard error."""
    typer.echo(f"note: {text}", err=True)


def answer(
    as_json: bool,
    numbers: Json,
    *parts: object,
    warnings: Iterable[str] = (),
    unmet: bool | None = None,
) -> int:
    """Print an answer, its warnings first: ``parts`` as text, or ``numbers`` as strict JSON.

    Return the exit code: UNMET if the arm does not do what was asked, else 0. ``unmet`` says so; by
    default every warning does.
    """
    warnings = tuple(warnings)
    unmet = bool(warnings) if unmet is None else unmet
    if as_json:
        print_json({"warnings": warnings} | numbers | {"warnings": warnings})
    else:
        texts = (
            "\n".join(line for line in str(part).splitlines() if line not in warnings)
            for part in parts
        )
        typer.echo("\n".join([*warnings, "\n\n".join(texts)]))
    return UNMET if unmet else 0


def print_json(numbers: Json) -> None:
    """Print numbers, arrays and results as strict JSON."""
    from cdsm.support.format import prepare_json

    typer.echo(json.dumps(prepare_json(numbers), indent=1, allow_nan=False, default=str))


def header(
    subject: cdsm.Manipulator | cdsm.Posture,
    minimum: Sequence[float] = (),
    friction: str = "ignored",
    tension: cdsm.Tension | None = None,
) -> tuple[str, Json]:
    """Return what a result assumes of its arm, or of its only posture, as text and for JSON.

    ``minimum`` is the lower bound that was asked for, one for each case. What held of each cable is
    that of ``tension``, or else the larger of it and the cable's own. ``friction`` says what
    becomes of the arm's friction.
    """
    from cdsm.cable import wires_text
    from cdsm.support.format import coordinates, place, span, without_rounding
    from cdsm.tension import checked_bounds

    arm = subject.arm if isinstance(subject, cdsm.Posture) else subject
    held = [checked_bounds(arm, low, math.inf)[0] for low in minimum]
    held = held if tension is None else [tension.minimum_held]
    least = ", ".join(span(bounds, "{:g}".format) for bounds in held)
    rough = friction if arm.has_friction else "none"
    x, y, z = arm.gravity.tolist()
    words = [f"wire {wires_text(arm.cables)}", f"gravity {x:g}, {y:g}, {z:g} m/s²"]
    words += [f"least tension {least} N"] if held else []
    lines = [f"with {'; '.join(words)}; friction {rough}", str(arm)]
    if isinstance(subject, cdsm.Posture):
        joints = ", ".join(map(place, without_rounding(subject.q).tolist(), arm.joint_units))
        lines.append(f"at {joints}; tip at {coordinates(1e3 * subject.tip[:3, 3])} mm")
    assumptions = {"wire": wires_text(arm.cables), "gravity_m_per_s2": arm.gravity}
    assumptions |= {
        "least_tension_N": [dict(zip(arm.cables.names, low, strict=True)) for low in held],
        "friction": rough,
    }
    return "\n".join(lines), {"computed_with": assumptions}


def write(path: Path | None, fill: Callable[[Path], object]) -> None:
    """If a path is given, write the file by ``fill(path)``; print its path on standard error."""
    if path is not None:
        fill(path)
        typer.echo(f"written: {path}", err=True)


def write_picture(path: Path | None, draw: Callable[[], Axes | Panels]) -> None:
    """If a path is given, write the picture that ``draw`` draws."""
    write(path, lambda file: cdsm.plots.save_figure(draw(), file))


def _show_once() -> Callable[..., None]:
    """Return what prints each warning once, in one line."""
    shown = set[str]()

    def show(message: Warning | str, *_: object, **__: object) -> None:
        if (text := str(message)) not in shown:
            shown.add(text)
            typer.secho(f"warning: {text}", fg="yellow", err=True)

    return show


def reported(function: Callable[..., int]) -> Callable[..., None]:
    """Wrap a command, which returns its exit code: turn errors into a message (JSON with --json).

    With --debug, the error is raised. Warnings are printed in one line.
    """

    @wraps(function)
    def command(**arguments: Any) -> None:
        try:
            with warnings.catch_warnings():
                warnings.showwarning = _show_once()
                code = function(**arguments)
        except (KeyboardInterrupt, SystemError) as error:
            # Ctrl-C within a compiled kernel raises SystemError from KeyboardInterrupt
            if debug_wanted.get() or not isinstance(error.__cause__ or error, KeyboardInterrupt):
                raise
            typer.echo("interrupted: no file is half-written; what was saved stays", err=True)
            code = INTERRUPTED
        except typer.BadParameter as error:
            if not arguments["as_json"]:
                raise
            print_json({"error": "BadParameter", "message": error.format_message(), "data": {}})
            code = error.exit_code
        except (cdsm.CdsmError, OSError, MemoryError) as error:  # OSError: of terminal or pipe
            if debug_wanted.get():
                raise
            kind = type(error).__name__
            message = _OF_PYTHON.sub("", str(error))
            if isinstance(error, MemoryError):
                message = f"out of memory: compute less at once; a sweep can --store. {error}"
            if arguments["as_json"]:
                print_json({"error": kind, "message": message, "data": vars(error)})
            else:
                typer.secho(f"error: {message}", fg="red", err=True)
            unmet = isinstance(error, cdsm.CdsmError) and error.status.is_unmet
            code = UNMET if unmet else FAILED
        raise typer.Exit(code)

    return command
