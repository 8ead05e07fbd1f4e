"""Entry point of the commands ``cdsm`` and ``python -m cdsm``."""

import sys

import cdsm


def main() -> None:
    """Print the version for ``--version``; otherwise run the command that the user gave."""
    if sys.argv[1:] == ["--version"]:  # typer would take longer to import than all the rest
        print(f"cdsm {cdsm.__version__}")
        return
    from cdsm.cli import app

    app()


if __name__ == "__main__":
    main()
