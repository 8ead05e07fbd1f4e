"""Settings of the site: ``sphinx-build -W docs build/site``. Nothing is run, nothing fetched."""

import shutil
import subprocess
import sys
from collections.abc import Iterator
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

from sphinx.application import Sphinx
from sphinx.util.inspect import TypeAliasForwardRef

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent), str(HERE)]

import formulas
import quantities
from docutils import nodes

import cdsm

# notebooks become pages, and typer writes that of the commands
shutil.rmtree(HERE / "notebooks", ignore_errors=True)
shutil.copytree(HERE.parent / "notebooks", HERE / "notebooks")
COMMANDS = ["-m", "typer", "cdsm.cli", "utils", "docs", "--name", "cdsm", "--title", "Commands"]
subprocess.run(
    [sys.executable, *COMMANDS, "--output", HERE / "reference" / "commands.md"],
    check=True,
    cwd=HERE.parent,
    stdout=subprocess.DEVNULL,
)

(HERE / "reference" / "quantities.md").write_text(quantities.page(), encoding="utf-8")


def _addresses() -> Iterator[tuple[str, str]]:
    """Yield two addresses of each public name: where it is used from, and where it is defined."""
    modules = {f"cdsm.{name}": getattr(cdsm, name) for name in cdsm._MODULES}
    for path, module in {"cdsm": cdsm, **modules}.items():
        for name in module.__all__:
            value = getattr(module, name)
            if not isinstance(value, ModuleType):
                home = f"{getattr(value, '__module__', '')}.{getattr(value, '__qualname__', '')}"
                yield f"{path}.{name}", home


listed = (HERE / "reference" / "api.rst").read_text(encoding="utf-8").split()
if missing := [name for name, home in _addresses() if not {name, home} & {*listed}]:
    raise LookupError(f"docs/reference/api.rst does not list {', '.join(missing)}")

# the script that typesets formulas; a package ships it, so no page asks a server
spec = find_spec("sphinx-mathjax-offline")
assert spec is not None
assert spec.submodule_search_locations is not None
MATHJAX = str(Path(spec.submodule_search_locations[0], "static", "mathjax", "tex-svg.js"))

project = "cdsm"
author = copyright = "The cdsm developers"
version = release = metadata.version("cdsm-stiffness")

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "sphinx_design",
]
nitpicky = True  # for what pages name in full, as cdsm.stiffness or cdsm.Stiffness.along
nitpick_ignore_regex = [
    ("py:.*", r"(?!cdsm\.(\w+|[A-Z]\w+\.\w+|control\.\w+)$).*"),
    ("py:mod", ".*"),
]
exclude_patterns = ["joss", "templates"]
templates_path = ["templates"]
myst_enable_extensions = ["colon_fence", "deflist", "dollarmath", "fieldlist"]
myst_heading_anchors = 3
nb_execution_mode = "off"  # notebooks are committed with their outputs
nb_merge_streams = True

default_role = "formula"
autosummary_ignore_module_all = False
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
# signatures name these types, and do not write them out
SHORT = "Applied Array ArrayLike Codes Direction Flags Joints LoadsLike OfCables Panels "
SHORT += "RowsOfLoads SlidingLike TensionOf WrenchesLike"
autodoc_type_aliases = {name: name for name in SHORT.split()}
TypeAliasForwardRef.__repr__ = lambda self: self.name  # type: ignore[method-assign]  # in unions
autodoc_preserve_defaults = True
napoleon_numpy_docstring = False
napoleon_attr_annotations = False
napoleon_use_ivar = True
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 80
linkcheck_ignore = [r"https://doi\.org/"]  # publishers turn programs away

html_theme = "furo"
html_title = "cdsm"
html_static_path = ["static/site.css", MATHJAX]
html_css_files = ["site.css"]
html_show_sourcelink = html_show_sphinx = html_copy_source = False
mathjax_path = "tex-svg.js"
copybutton_prompt_text = r"\$ |>>> "
copybutton_prompt_is_regexp = True


def _formula(
    role: str, marked: str, text: str, line: int, *_: object
) -> tuple[list[nodes.Node], list[nodes.system_message]]:
    """Typeset what stands in single backquotes."""
    return [nodes.math(marked, formulas.latex(text))], []


def _keep_colon(
    app: Sphinx, kind: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Keep napoleon from taking what is before a colon for the type of a property."""
    if kind in ("attribute", "property"):
        lines[:0] = ["..", ""]


def _shorten(*event: object) -> tuple[str, str] | None:
    """Write ... for defaults that are made, which Sphinx cannot read."""
    if event[-2] is None:
        return None
    return str(event[-2]).replace("<factory>", "..."), str(event[-1] or "")


def setup(app: Sphinx) -> None:
    """Connect what docstrings need."""
    app.connect("autodoc-process-docstring", _keep_colon, priority=400)  # before napoleon
    app.add_role("formula", _formula)
    app.connect("autodoc-process-signature", _shorten)
