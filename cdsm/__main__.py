"""``python -m cdsm`` is ``cdsm``."""

from cdsm.cli import app

app()
