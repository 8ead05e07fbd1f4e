"""Command line of cdsm. Options take mm, degrees and N/mm.

A command imports slow modules only when it runs, so that help pages appear at once.
"""

from __future__ import annotations

import inspect
import io
import sys
from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Any, Final

import typer
import typer.core
import typer.main

import cdsm
from cdsm.cli.arm import export, new, view
from cdsm.cli.design import design
from cdsm.cli.estimate import estimate
from cdsm.cli.fit import fit
from cdsm.cli.identify import identify_parameters
from cdsm.cli.options import opt
from cdsm.cli.output import debug_wanted, reported
from cdsm.cli.plan import plan
from cdsm.cli.reproduce import reproduce
from cdsm.cli.stiffness import buckle, show_stiffness, weigh
from cdsm.cli.sweep import sweep_postures

COMMANDS: Final[dict[str, Callable[..., int]]] = {
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

_PLAIN: Final[dict[str, Any]] = {
    "add_completion": False,
    "rich_markup_mode": None,
    "pretty_exceptions_enable": False,
    "context_settings": {"help_option_names": ["-h", "--help"]},
}


def _first_line(text: str) -> str:
    """Return the first line; lists of the commands would cut it after 45 characters."""
    return text.partition("\n")[0]


class _OnDemand(Mapping[str, Any]):
    """The commands by name; the options of one, of which typer reads the types, when it is asked.

    For ``cdsm --help``, which needs none, those of all would cost a third of the time.
    """

    def __iter__(self) -> Iterator[str]:
        return iter(COMMANDS)

    def __len__(self) -> int:
        return len(COMMANDS)

    def __getitem__(self, name: str) -> Any:
        one = typer.Typer(**_PLAIN)
        text = inspect.getdoc(COMMANDS[name]) or ""
        one.command(name, help=text, short_help=_first_line(text))(reported(COMMANDS[name]))
        return typer.main.get_command(one)


class _Group(typer.core.TyperGroup):
    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self.commands: Any = _OnDemand()

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """List the commands without their options."""
        texts = {name: inspect.getdoc(command) or "" for name, command in COMMANDS.items()}
        with formatter.section("Commands"):
            formatter.write_dl([(name, _first_line(text)) for name, text in texts.items()])


app = typer.Typer(name="cdsm", cls=_Group, no_args_is_help=True, **_PLAIN)


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
