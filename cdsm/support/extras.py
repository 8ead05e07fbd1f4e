"""Check that optional packages are installed."""

from __future__ import annotations

import importlib

from cdsm.errors import CdsmError


def need(extra: str, *packages: str) -> None:
    """Raise :class:`~cdsm.CdsmError` if one of the ``packages`` of ``extra`` is missing."""
    for package in packages:
        try:
            importlib.import_module(package)
        except ImportError:
            said = f"{package} is missing; run pip install -e '.[{extra}]' in cdsm's clone."
            raise CdsmError(said) from None
