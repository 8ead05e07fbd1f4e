"""Command line of cdsm. Options take mm, degrees and N/mm.

A command imports slow modules only when it runs, so that help pages appear at once.
"""

from __future__ import annotations

import io
import logging
import sys
from typing import Annotated

import typer

import cdsm
from cdsm.cli.arm import check, export, stiffness, urdf
from cdsm.cli.command import Command, as_command
from cdsm.cli.design import design
from cdsm.cli.identify import identify
from cdsm.cli.loads import buckle, cycle, weigh
from cdsm.cli.new import new
from cdsm.cli.output import debug_wanted
from cdsm.cli.paper import reproduce
from cdsm.cli.plan import plan
from cdsm.cli.sweep import map_sweep, sweep
from cdsm.cli.view import view
from cdsm.cli.wire import fit

app = typer.Typer(
    name="cdsm",
    help="Stiffness of cable-driven serpentine manipulators.",
    no_args_is_help=True,
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
        bool,
        typer.Option(
            "--version", callback=_version, is_eager=True, help="Show the version and exit."
        ),
    ] = False,
    debug: Annotated[
        bool,
        typer.Option("--debug", help="Show the traceback of an error. Give it before the command."),
    ] = False,
    verbose: Annotated[
        bool,
        typer.Option(
            "--verbose", "-v", help="Show the log of long runs. Give it before the command."
        ),
    ] = False,
) -> None:
    """Stiffness of cable-driven serpentine manipulators."""
    debug_wanted.set(debug)
    if verbose:
        logging.basicConfig(format="%(message)s")
        logging.getLogger("cdsm").setLevel(logging.INFO)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a terminal without Greek letters shows "?"
            stream.reconfigure(errors="replace")


_ALL = (
    *(new, urdf, stiffness, check, weigh, cycle, buckle, plan, sweep, map_sweep),
    *(design, view, fit, identify, export, reproduce),
)
for command in _ALL:
    name = "map" if command is map_sweep else command.__name__
    app.command(name, cls=Command)(as_command(command))
