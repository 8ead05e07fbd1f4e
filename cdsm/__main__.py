"""Run the command line: ``python -m cdsm`` does the same as ``cdsm``."""

from cdsm.cli import app

app()
