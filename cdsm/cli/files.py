"""Declare options for files to write; their paths are checked before a command computes."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

import cdsm
from cdsm.cli.values import misuse

_WRITTEN = "cdsm.cli.files"
"""Key of the context of a command: paths of the files that it will write, by parameter name."""


def file_option(
    *names: str,
    endings: Sequence[str],
    declare: Callable[..., Any] = typer.Option,
    **shown: Any,
) -> Any:
    """Declare an option for a file to write; its path is checked before the command computes.

    The path must end in one of ``endings``. ``declare`` is typer's Option or Argument. ``shown``
    are its keywords, such as help and metavar.
    """

    def checked(
        context: typer.Context, parameter: typer.CallbackParam, path: Path | None
    ) -> Path | None:
        if path is not None:
            from cdsm.support.extras import need
            from cdsm.support.files import as_path, require_writable

            if path.suffix.lower() not in endings:
                raise typer.BadParameter(f"{path} does not end in {' or '.join(endings)}.")
            try:
                require_writable(as_path(path))
                if path.suffix.lower() == ".nc":
                    need("sweep", "netCDF4")
            except cdsm.CdsmError as error:
                raise typer.BadParameter(str(error)) from None
            if not os.access(path.resolve().parent, os.W_OK):
                raise typer.BadParameter(f"{path}: the folder is read-only; choose another.")
            context.meta.setdefault(_WRITTEN, {})[parameter.name] = path
        return path

    return declare(*names, callback=checked, **shown)


def require_apart(context: typer.Context) -> None:
    """Raise BadParameter if the path of a file to write is also given for another option."""
    names = {
        each.name: each.opts[0] if each.opts[0].startswith("-") else str(each.metavar)
        for each in context.command.params
    }
    for name, path in context.meta.get(_WRITTEN, {}).items():
        for other, given in context.params.items():
            if other != name and isinstance(given, (str, Path)) and _alike(path, Path(given)):
                raise misuse(names[name], f"{path} is also {names[other]}; give another file.")


def _alike(a: Path, b: Path) -> bool:
    """Return whether two paths lead to the same file, which may not exist yet."""
    with contextlib.suppress(OSError, ValueError):
        return a.resolve() == b.resolve() or a.samefile(b)
    return False


out_option = partial(file_option, "--out", "-o")
out_folder = partial(typer.Option, "--out", "-o")
data_option = partial(
    out_option, endings=(".nc", ".csv"), help="File to write: .nc (NetCDF) or .csv, SI units."
)
picture_option = partial(file_option, endings=(".pdf", ".svg", ".png"), metavar="FILE.pdf|svg|png")
Picture = Annotated[Path | None, picture_option(help="Figure to write: vectors, or 300 dpi.")]
