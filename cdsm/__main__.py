"""Entry point of the commands ``cdsm`` and ``python -m cdsm``."""

from cdsm.cli import app as main

if __name__ == "__main__":
    main()
