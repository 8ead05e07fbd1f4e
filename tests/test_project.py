"""What stands around the code: citation, recipe, workflows, article, catalogue of wires."""

import ast
import math
import re
import tomllib
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any

import pytest
import yaml

import cdsm

ROOT = Path(__file__).parents[1]
SETTINGS: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
PROJECT, TOOLS = SETTINGS["project"], SETTINGS["tool"]

CONDA = {"pin": "pinocchio", "matplotlib": "matplotlib-base"}
"""Names on conda-forge that differ from those on PyPI."""

POUND_PER_SQUARE_INCH = 6894.757293168
"""[Pa]"""


def read(name: str) -> Any:
    return yaml.safe_load((ROOT / name).read_text(encoding="utf-8"))


def test_one_version_everywhere() -> None:
    versions = {
        PROJECT["version"],
        read("CITATION.cff")["version"],
        read("packaging/recipe.yaml")["context"]["version"],
    }
    assert versions == {cdsm.__version__}


def test_the_recipe_wants_what_the_package_wants() -> None:
    wanted = {"python >=${{ python_min }}"}
    for requirement in PROJECT["dependencies"]:
        name, versions = re.fullmatch(r"([\w-]+)(.*)", requirement).groups()  # type: ignore[union-attr]
        wanted.add(f"{CONDA.get(name, name)} {versions}")
    recipe = read("packaging/recipe.yaml")
    assert set(recipe["requirements"]["run"]) == wanted
    assert recipe["build"]["python"]["entry_points"] == [
        f"{name} = {target}" for name, target in PROJECT["scripts"].items()
    ]


def test_the_workflow_runs_every_supported_python_on_both_systems() -> None:
    matrix = read(".github/workflows/test.yml")["jobs"]["versions"]["strategy"]["matrix"]
    classified = "Programming Language :: Python :: "
    versions = {
        each.removeprefix(classified)
        for each in PROJECT["classifiers"]
        if each.startswith(classified)
    }
    assert set(matrix["python"]) == versions
    assert matrix["os"] == ["ubuntu-latest", "macos-latest"]
    assert read(".github/workflows/release.yml")["jobs"]["publish"]["permissions"]


@pytest.mark.parametrize("path", sorted((ROOT / ".github/ISSUE_TEMPLATE").glob("*_*.yml")))
def test_issue_templates_have_what_a_form_needs(path: Path) -> None:
    form = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert {"name", "description", "body"} <= form.keys()
    assert all(entry["attributes"]["label"] for entry in form["body"])


def test_the_article_is_short_and_cites_what_exists() -> None:
    text = (ROOT / "paper/paper.md").read_text(encoding="utf-8").split("---", 2)[2]
    assert len(text.split()) <= 1000
    cited = set(re.findall(r"@(\w+)", text))
    entries = set(re.findall(r"@\w+\{(\w+),", (ROOT / "paper/paper.bib").read_text("utf-8")))
    assert cited == entries


def imported(node: ast.AST) -> Iterator[str]:
    """Dotted names that code imports, also in functions, but not for type checkers alone."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.ImportFrom):
            yield from (f"{child.module}.{name.name}" for name in child.names)
        elif not (isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test)):
            yield from imported(child)


def test_no_file_imports_itself_through_others() -> None:
    package = ROOT / "cdsm"
    files = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
        for path in package.rglob("*.py")
    }
    uses = {
        name: {
            used if used in files else used.rpartition(".")[0]
            for used in imported(ast.parse(path.read_text(encoding="utf-8")))
            if used.startswith("cdsm.")
        }
        for name, path in files.items()
    }
    assert list(TopologicalSorter(uses).static_order())  # CycleError names a circle


def test_the_house_is_small() -> None:
    layers = TOOLS["importlinter"]["contracts"][0]["layers"]
    assert len(layers) <= 14
    assert sum(path.is_file() for path in (ROOT / "cdsm").iterdir()) <= 16


def strand(diameter: float, stretch_factor: float) -> float:
    """EA [N] of the stretch in % that makers tabulate, G W/D² in pounds and inches."""
    modulus = 100.0 / stretch_factor * POUND_PER_SQUARE_INCH
    return modulus * diameter**2


@pytest.mark.parametrize(
    ("name", "rigidity"),
    [
        ("1x19-1.2mm-datasheet", strand(1.2e-3, 7.79e-6)),
        ("7x7-1mm", strand(1e-3, 1.2e-5)),
        ("7x19-1.5mm", strand(1.5e-3, 1.62e-5)),
        ("nitinol-0.5mm", 83e9 * math.pi / 4.0 * 0.5e-3**2),
        ("uhmwpe-sk75-1760dtex", 124.5 * 176.0),
    ],
)
def test_wires_are_as_rigid_as_their_source_says(name: str, rigidity: float) -> None:
    path = ROOT / "examples" / "wires" / f"{name}.toml"
    law = cdsm.Elasticity.read(path)
    # the files have five digits
    assert float(law.rigidity(10.0)) == pytest.approx(rigidity, rel=5e-5)
    text = path.read_text(encoding="utf-8")
    assert "Band: rigidity = 0." in text
    arm = cdsm.Manipulator.read(ROOT / "examples" / "arm.toml", wire=path)
    pose = arm.at([0.1] * arm.nv)
    assert cdsm.stiffness(pose, cdsm.distribute_tension(pose, 5.0)).cable_stiffness.min() > 0.0


def test_every_wire_of_the_catalogue_is_tested() -> None:
    assert len(list((ROOT / "examples" / "wires").glob("*.toml"))) == 5
