"""The import graph of the package: it has no large circle."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

import cdsm

ROOT = Path(cdsm.__file__).parent
FILES = {
    ".".join(path.relative_to(ROOT.parent).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted(ROOT.rglob("*.py"))
}
REACH_UP = {("cdsm.support.values", "cdsm.plots"), ("cdsm.stiffness_matrix.value", "cdsm.report")}
"""Imports by name of a chapter above: of ``plot()`` of results, and of ``Stiffness.report()``."""


def imported_modules(path: Path) -> Iterator[str]:
    """Yield the modules of the package that a file imports anywhere, also by name or for types."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            names = [arg.value for arg in node.args if isinstance(arg, ast.Constant)]
        else:
            continue
        for name in names:
            if name in FILES:
                yield name
            elif name.rpartition(".")[0] in FILES:
                yield name.rpartition(".")[0]


def circles(arrows: set[tuple[str, str]]) -> list[list[str]]:
    """Return the circles of a graph: groups of files that import each other, largest first."""
    names = list(FILES)
    ends = np.array([[names.index(start), names.index(end)] for start, end in arrows]).T
    graph = coo_array((np.ones(len(arrows)), tuple(ends)), (len(names), len(names)))
    count, label = connected_components(graph, connection="strong")
    groups = [[names[i] for i in np.flatnonzero(label == group)] for group in range(count)]
    return sorted((group for group in groups if len(group) > 1), key=len, reverse=True)


def test_no_more_than_four_files_import_each_other():
    arrows = {(name, other) for name in FILES for other in imported_modules(FILES[name])}
    assert arrows >= REACH_UP, "a line that reaches up is gone; take it off REACH_UP"
    large = [circle for circle in circles(arrows - REACH_UP) if len(circle) > 4]
    assert not large, "\n".join(" ".join(circle) for circle in large)


def test_a_circle_is_noticed():
    chain = list(FILES)[:6]
    arrows = set(zip(chain, [*chain[1:], chain[0]], strict=True))
    assert circles(arrows) == [sorted(chain)]
    assert circles(arrows - {(chain[-1], chain[0])}) == []
