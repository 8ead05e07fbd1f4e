"""Run the command line: ``cdsm`` and ``python -m cdsm``."""

import sys

import cdsm


def main() -> None:
    """Print the version, or run a command."""
    if sys.argv[1:] == ["--version"]:  # typer would take longer to import than all the rest
        print(f"cdsm {cdsm.__version__}")
        return
    from cdsm.cli import app

    app()


if __name__ == "__main__":
    main()
