"""Packages that only some need: asked for by the name of the extra that brings them."""

from __future__ import annotations

import importlib

from cdsm.errors import MissingExtra


def need(extra: str, *packages: str) -> None:
    """Raise :class:`~cdsm.MissingExtra` if one of the packages is not installed."""
    for package in packages:
        try:
            importlib.import_module(package)
        except ImportError:
            raise MissingExtra(package, extra) from None
