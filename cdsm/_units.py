"""Units in the keys of JSON."""

from __future__ import annotations


def key(name: str, unit: str) -> str:
    """A key that names its unit: ``margin`` in ``N m/rad`` is ``margin_Nm_per_rad``."""
    words = unit.replace("N m", "Nm").replace("/", " per ").split()
    return "_".join([name, *words])
