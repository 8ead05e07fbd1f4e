"""Declare options for files to write, which are checked before a command computes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

import cdsm


def file_option(*names: str, endings: Sequence[str] = (), **shown: Any) -> Any:
    """Declare an option for a file to write; its path is checked before the command computes.

    The path must end in one of ``endings``, if there are any. ``shown`` are help and metavar.
    """

    def checked(path: Path | None) -> Path | None:
        if path is not None:
            from cdsm.support.extras import need
            from cdsm.support.files import as_path, require_writable

            if endings and path.suffix.lower() not in endings:
                raise typer.BadParameter(f"{path} ends in none of {', '.join(endings)}.")
            try:
                require_writable(as_path(path))
                if path.suffix.lower() == ".nc":
                    need("sweep", "netCDF4")
            except cdsm.CdsmError as error:
                raise typer.BadParameter(str(error)) from None
            if not os.access(path.resolve().parent, os.W_OK):
                raise typer.BadParameter(f"{path}: the folder is read-only; choose another.")
        return path

    return typer.Option(*names, callback=checked, **shown)


out_option = partial(file_option, "--out", "-o")
out_folder = partial(typer.Option, "--out", "-o")
data_option = partial(
    out_option, endings=(".nc", ".csv"), help="File to write: .nc (NetCDF) or .csv, SI units."
)
picture_option = partial(file_option, endings=(".pdf", ".svg", ".png"), metavar="FILE.pdf|svg|png")
Picture = Annotated[Path | None, picture_option(help="Figure to write: vectors, or 300 dpi.")]
