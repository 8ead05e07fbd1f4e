"""Write the pages that follow from the code: tutorials, the interface, the commands."""

import re
from importlib import import_module, metadata
from inspect import isclass, ismodule
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

import typer.main
import yaml
from sphinx.pycode import ModuleAnalyzer

import cdsm
from cdsm.cli import app

HERE = Path(__file__).parent
GENERATED = HERE / "generated"

CHAPTERS = {
    "geometry": "Arms and their parts",
    "manipulator": "Arms and their parts",
    "cable": "Arms and their parts",
    "arm_file": "Arms and their parts",
    "urdf": "Arms and their parts",
    "elasticity": "Wires",
    "wires": "Wires",
    "posture": "Posture, tension, stiffness",
    "tolerance": "Uncertainty",
    "tension": "Posture, tension, stiffness",
    "stiffness_matrix": "Posture, tension, stiffness",
    "report": "Posture, tension, stiffness",
    "friction": "Friction in the holes",
    "measures": "Measures of an arm",
    "statics": "Weights, buckling, vibration",
    "kinematics": "Kinematics",
    "batch": "Many postures",
    "sweeps": "Many postures",
    "support": "Many postures",
    "planning": "Planning",
    "tolerancing": "Uncertainty",
    "identification": "Identification",
    "parameters": "Identification",
    "interchange": "Other programs",
    "control": "Control",
    "design": "Design",
    "errors": "Errors",
}
"""Page of the reference that shows the public names of a chapter."""

MODULES = {
    "control": "Motor laws, sensors, plants",
    "presets": "Arms and strand of the paper",
    "plots": "Figures",
    "paper": "The paper recomputed",
    "view": "Live view",
}
"""Public modules, each with a page of its own."""


def version() -> str:
    """Return the version of the distribution."""
    return metadata.version("cdsm-stiffness")


def all_pages() -> None:
    """Write all generated pages; pages whose text is the same keep their date."""
    pages = {**_tutorials(), **interface(), **commands(), **citation()}
    for name, text in pages.items():
        path = GENERATED / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
    for path in GENERATED.rglob("*.*"):
        if path.relative_to(GENERATED).as_posix() not in pages:
            path.unlink()


def _tutorials() -> dict[str, str]:
    folder = HERE.parent / "notebooks"
    return {
        f"tutorials/{path.name}": path.read_text(encoding="utf-8")
        for path in sorted(folder.glob("*.ipynb"))
    }


def slug(title: str) -> str:
    """Return the file name of a title."""
    return re.sub(r"\W+", "-", title.lower())


def interface() -> dict[str, str]:
    """Return the pages of all public names."""
    grouped: dict[str, list[str]] = {title: [] for title in CHAPTERS.values()}
    for name in cdsm.__all__:
        if name not in cdsm._MODULES:
            chapter = cdsm._HOME[name].split(".")[1]
            grouped.setdefault(CHAPTERS.get(chapter, chapter.capitalize()), []).append(name)
    pages = {
        f"interface/{slug(title)}.md": _page(title, "cdsm", names)
        for title, names in grouped.items()
        if names
    }
    for module in cdsm._MODULES:
        title = MODULES.get(module, module.capitalize())
        source = import_module(f"cdsm.{module}")
        names = [
            name
            for name in source.__all__
            if not ismodule(getattr(source, name)) and name not in cdsm.__all__
        ]
        pages[f"interface/{slug(title)}.md"] = _page(title, f"cdsm.{module}", names, own=True)
    entries = [f"{Path(page).stem}" for page in pages]
    listed = "\n".join(entries)
    pages["interface/index.md"] = (
        "# Python\n\n"
        "Every public name. Values are SI: m, rad, N, kg. Results are frozen, their arrays "
        "read-only, and each keeps the question it answers.\n\n"
        f"```{{toctree}}\n:maxdepth: 1\n\n{listed}\n```\n"
    )
    return pages


def _page(title: str, module: str, names: list[str], own: bool = False) -> str:
    rows = [f"# {title}", "", "```{eval-rst}"]
    rows += [f".. automodule:: {module}" if own else f".. currentmodule:: {module}", ""]
    home = import_module(module)
    for name in sorted(names, key=lambda name: (name[0].isupper(), name.lower())):
        thing = getattr(home, name)
        if isclass(thing):
            rows += [f".. autoclass:: {module}.{name}", "   :members:"]
            if issubclass(thing, Exception):
                rows.append("   :show-inheritance:")
            elif any(_is_part(base) for base in thing.__bases__):
                rows.append("   :inherited-members: ReadOnlyState")
        elif callable(thing):
            rows.append(f".. autofunction:: {module}.{name}")
        else:
            rows += [f".. autodata:: {_where(module, name)}.{name}", "   :no-value:"]
        rows.append("")
    return "\n".join([*rows, "```", ""])


def _is_part(base: type) -> bool:
    """Check whether a class is one of cdsm that users do not know by name, but its methods."""
    hidden = base.__module__.startswith("cdsm.") and base.__name__ not in cdsm.__all__
    return hidden and base.__name__ not in ("Printed", "ReadOnlyState")


def _where(module: str, name: str) -> str:
    """Return the module that documents a constant: this one, or one inside it."""
    inside = [each.name for each in iter_modules(getattr(import_module(module), "__path__", []))]
    for each in (module, *(f"{module}.{inner}" for inner in inside)):
        if ("", name) in ModuleAnalyzer.for_module(each).find_attr_docs():
            return each
    raise LookupError(f"{module}.{name} is public and has no docstring")


def commands() -> dict[str, str]:
    """Return the page of all commands."""
    group = typer.main.get_command(app)
    found = group.commands  # type: ignore[attr-defined]
    rows = [
        "# Commands",
        "",
        "`cdsm COMMAND --help` prints the same. Lengths are in mm, angles in degrees, stiffness in "
        "N/mm, forces in N. Every command takes `--json`; before the command, `--debug` shows "
        "where an error comes from.",
        "",
    ]
    for name, command in found.items():
        rows += [f"(command-{name})=", f"## cdsm {name}", "", _plain(command.help or ""), ""]
        for option in command.params:
            kind = (
                ""
                if getattr(option, "is_flag", False)
                else option.metavar or option.display_type(typer.Context(command))
            )
            words = [] if option.param_type_name == "argument" else option.opts
            rows.append(" ".join(f"`{word}`" for word in (*words, kind) if word))
            meaning = _plain(option.help or "")
            if option.show_default and option.default not in (None, False, ()):
                meaning += f" Default: `{option.default}`."
            rows += [f": {meaning}", ""]
    return {"commands.md": "\n".join(rows)}


def citation() -> dict[str, str]:
    """Return the page that says how to cite: the software and the paper of CITATION.cff."""
    cff = yaml.safe_load((HERE.parent / "CITATION.cff").read_text(encoding="utf-8"))
    rows = [
        "# Cite",
        cff["message"],
        f"```bibtex\n{_entry(cff, 'cdsm')}\n\n{_entry(cff['references'][0], 'dai')}\n```",
        f"The licence of cdsm is {cff['license']}. `CITATION.cff` also names the solvers inside.\n",
    ]
    return {"cite.md": "\n\n".join(rows)}


def _entry(work: dict[str, Any], key: str) -> str:
    """Write a work of CITATION.cff as an entry of BibTeX, with ``notes`` as its note."""
    people = [
        f"{{{each['name']}}}" if "name" in each else "{family-names}, {given-names}".format(**each)
        for each in work["authors"]
    ]
    fields = {"author": " and ".join(people), "title": f"{{{work['title']}}}"}
    names = {"journal": "journal", "year": "year", "version": "version", "notes": "note"}
    fields |= {field: work[name] for name, field in names.items() if name in work}
    lines = "".join(f"  {name} = {{{value}}},\n" for name, value in fields.items())
    return f"@{work['type']}{{{key},\n{lines}}}"


def _plain(text: str) -> str:
    """Escape what Markdown would take for its own, but not in code."""
    parts = text.replace("\b", "").strip().split("`")
    parts[::2] = [re.sub(r"([\[\]*_<>])", r"\\\1", part) for part in parts[::2]]
    return "`".join(parts)
