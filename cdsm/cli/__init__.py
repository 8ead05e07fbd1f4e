"""Command line of cdsm. Options take mm, degrees and N/mm.

A command imports slow modules only when it runs, so that help pages appear at once.
"""

from __future__ import annotations

import inspect
import io
import sys
from collections.abc import Callable
from typing import Annotated

import typer

import cdsm
from cdsm.cli.arm import export, new, view
from cdsm.cli.estimate import estimate
from cdsm.cli.identify import fit, identify_parameters, reproduce
from cdsm.cli.options import opt
from cdsm.cli.output import debug_wanted, reported
from cdsm.cli.plan import design, plan, sweep_postures
from cdsm.cli.stiffness import buckle, show_stiffness, weigh

app = typer.Typer(
    name="cdsm",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"cdsm {cdsm.__version__}")
        raise typer.Exit


@app.callback()
def main(
    version: Annotated[
        bool, opt("Show the version.", None, "--version", callback=_version)
    ] = False,
    debug: Annotated[
        bool, opt("Show tracebacks; give it before the command.", None, "--debug")
    ] = False,
) -> None:
    """Stiffness of cable-driven serpentine manipulators; lengths in mm, angles in degrees."""
    debug_wanted.set(debug)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a terminal without Greek letters shows "?"
            stream.reconfigure(errors="replace")


COMMANDS: dict[str, Callable[..., int]] = {
    "new": new,
    "stiffness": show_stiffness,
    "weigh": weigh,
    "buckle": buckle,
    "plan": plan,
    "sweep": sweep_postures,
    "design": design,
    "view": view,
    "fit": fit,
    "identify": identify_parameters,
    "estimate": estimate,
    "export": export,
    "reproduce": reproduce,
}

for name, command in COMMANDS.items():
    text = inspect.getdoc(command) or ""
    # without short_help, lists of the commands cut the first line after 45 characters
    app.command(name, help=text, short_help=text.partition("\n")[0])(reported(command))
