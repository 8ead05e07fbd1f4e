"""Entry point of the commands ``cdsm`` and ``python -m cdsm``."""

import sys

import cdsm


def main() -> None:
    """Run a command."""
    if sys.argv[1:] == ["--version"]:  # typer would load pydantic to parse the option
        print(f"cdsm {cdsm.__version__}")
    else:
        from cdsm.cli import app

        app()


if __name__ == "__main__":
    main()
