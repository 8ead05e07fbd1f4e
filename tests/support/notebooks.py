"""Run notebooks, check their numbers, and keep the executed copies for the site.

``python -m tests.support.notebooks`` runs those whose copies are out of date, side by side.
"""

import os
import sys
from concurrent.futures import ThreadPoolExecutor
from hashlib import sha256
from pathlib import Path

import nbformat
from nbclient import NotebookClient

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "notebooks"
EXECUTED = ROOT / "build" / "notebooks"

_FIRST = """\
%matplotlib inline
%config InlineBackend.figure_formats = ["retina"]
import logging
logging.getLogger("cdsm").setLevel("ERROR")
"""
"""Runs before each notebook: figures are sharp; nothing is said of compiling."""


def run(name: str) -> Path:
    """Execute a notebook in a kernel of its own, check its numbers, return its executed copy.

    Raises:
        CellExecutionError: A cell fails, or a number is not what its text tells.
    """
    notebook = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
    cell = nbformat.v4.new_code_cell
    check = f"from tests.notebooks.test_numbers import check\ncheck({name!r}, globals())"
    notebook.cells = [cell(_FIRST), *notebook.cells, cell(check)]
    path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    client = NotebookClient(
        notebook, timeout=3600, kernel_name="python3", resources={"metadata": {"path": FOLDER}}
    )
    client.execute(env=os.environ | {"PYTHONPATH": path})
    notebook.cells = notebook.cells[1:-1]
    copy = _copy_of(name)
    copy.parent.mkdir(parents=True, exist_ok=True)
    aside = copy.with_suffix(f".{os.getpid()}")
    nbformat.write(notebook, aside)
    return aside.replace(copy)


def executed() -> dict[str, Path]:
    """Return the executed copies of all notebooks by name; run those that are out of date."""
    names = sorted(path.stem for path in FOLDER.glob("*.ipynb"))
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        copies = threads.map(lambda n: _copy_of(n) if _copy_of(n).exists() else run(n), names)
        return dict(zip(names, copies, strict=True))


def _copy_of(name: str) -> Path:
    """Name the copy by what its outputs depend on: the notebook, its data, cdsm."""
    sources = [FOLDER / f"{name}.ipynb", *FOLDER.glob("data/*"), *ROOT.glob("cdsm/**/*.py")]
    digest = sha256(b"".join(path.read_bytes() for path in sorted(sources))).hexdigest()[:16]
    return EXECUTED / f"{name}-{digest}.ipynb"


if __name__ == "__main__":
    sys.stdout.writelines(f"{path}\n" for path in executed().values())
