"""Make typer commands of our functions: shared options, errors as text or JSON."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import wraps
from typing import Any

import typer.core

from cdsm.cli.files import require_apart
from cdsm.cli.output import misuse_reported, reported


class Command(typer.core.TyperCommand):
    """A typer command that prints errors of usage as JSON with --json."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the words of ``args`` and check them."""
        with misuse_reported("--json" in args):
            rest = super().parse_args(ctx, args)
            require_apart(ctx)
            return rest

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help page: join the lines of a paragraph, and print units such as [mm].

        Without this, typer would take a unit in brackets for markup and leave it out.
        """
        self.help = re.sub(r"(?<!\n)\n(?!\n)", " ", self.help or "")
        for option in self.params:
            text = getattr(option, "help", None)
            if text:
                option.help = re.sub(r"(?<!\\)\[(?=[a-z])", r"\\[", text)  # type: ignore[attr-defined]
        super().format_help(ctx, formatter)


def as_command(function: Callable[..., None]) -> Callable[..., None]:
    """Wrap a function for typer: one parameter per option, and errors printed as messages.

    typer reads the options from the signature of a function. In ours, a dataclass such as
    :class:`~cdsm.cli.options.ArmOptions` stands for options that several commands share; the
    wrapper has a parameter for each of its fields instead.
    """
    groups: dict[str, Any] = {}
    options: list[inspect.Parameter] = []
    for each in inspect.signature(function, eval_str=True).parameters.values():
        if is_dataclass(each.annotation):
            groups[each.name] = each.annotation
            options += inspect.signature(groups[each.name], eval_str=True).parameters.values()
        else:
            options.append(each)

    @wraps(function)
    def command(**given: Any) -> None:
        for name, group in groups.items():
            given[name] = group(**{field.name: given.pop(field.name) for field in fields(group)})
        with reported(given["as_json"]):
            function(**given)

    command.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [option.replace(kind=inspect.Parameter.KEYWORD_ONLY) for option in options]
    )
    return command
