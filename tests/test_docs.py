"""The pages of the site name functions and tests that exist; building it is part of .ci/run."""

import ast
import re
from pathlib import Path

import pytest

import cdsm

DOCS = Path(__file__).parents[1] / "docs"
PAGES = [page for page in DOCS.rglob("*.md") if "generated" not in page.parts]


def named_in(source: ast.AST, prefix: str = "") -> set[str]:
    """Names of the functions and classes of a module, and of those inside its classes."""
    found = set()
    for node in ast.iter_child_nodes(source):
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            found.add(prefix + node.name)
            if isinstance(node, ast.ClassDef):
                found |= named_in(node, f"{node.name}.")
    return found


def test_functions_and_tests_beside_equations_exist() -> None:
    held = [
        each
        for page in PAGES
        for line in re.findall(r"\{held\} (.*)", page.read_text(encoding="utf-8"))
        for each in line.split()
    ]
    assert len(held) > 80
    gone = []
    for each in held:
        path, name = each.split(":")
        file = DOCS.parent / path
        if not file.exists() or name not in named_in(ast.parse(file.read_text(encoding="utf-8"))):
            gone.append(each)
    assert gone == []


@pytest.mark.parametrize("number", range(1, 21))
def test_every_equation_of_the_paper_has_a_place(number: int) -> None:
    table = (DOCS / "theory" / "index.md").read_text(encoding="utf-8")
    ranges = re.findall(r"^\| (\d+)(?: to (\d+)|, (\d+))?", table, re.M)
    covered = {
        n
        for first, last, other in ranges
        for n in [*range(int(first), int(last or first) + 1), *([int(other)] if other else [])]
    }
    assert number in covered


def test_public_names_that_pages_link_to_exist() -> None:
    for page in PAGES:
        for name in re.findall(r"\{py:\w+\}`~?cdsm\.([\w.]+)`", page.read_text(encoding="utf-8")):
            thing: object = cdsm
            for part in name.split("."):
                thing = getattr(thing, part)


def test_every_public_constant_has_a_page_and_a_docstring() -> None:
    """Where one has none, the site is not built."""
    pytest.importorskip("sphinx")
    from docs import generate

    pages = generate.interface()
    for name in cdsm.__all__:
        if name not in cdsm._MODULES:
            assert any(f":: cdsm.{name}\n" in page for page in pages.values()), name
    assert "## cdsm stiffness" in generate.commands()["commands.md"]
