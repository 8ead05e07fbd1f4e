"""Settings of the site. ``docs/build.py`` builds it; nothing is fetched while it does."""

import sys
from importlib.util import find_spec
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.inspect import TypeAliasForwardRef

from docs import generate


def _mathjax() -> str:
    """Return the script that typesets formulas; a package ships it, so no page asks a server."""
    spec = find_spec("sphinx-mathjax-offline")
    assert spec is not None
    assert spec.submodule_search_locations is not None
    return str(Path(spec.submodule_search_locations[0], "static", "mathjax", "tex-svg.js"))


project = "cdsm"
author = copyright = "The cdsm developers"
version = release = generate.version()

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "sphinx_design",
]
exclude_patterns = ["static", "pictures", "joss"]
nitpicky = True
nitpick_ignore_regex = [
    # other projects' types, whose indexes are on the network; and types of ours without a page
    ("py:.*", r"(?!cdsm\.).*"),
    ("py:data", r"cdsm\..*"),
    ("py:.*", r"cdsm\.(?!paper|plots|presets|view)[a-z_]+\..*"),
    ("py:.*", r"cdsm\.[a-z_]+\.[a-z_]+\..*"),
]

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath", "fieldlist"]
myst_heading_anchors = 3
nb_execution_mode = "auto"
nb_execution_excludepatterns = ["generated/tutorials/*"]  # they keep their outputs
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 600
nb_render_markdown_format = "myst"
nb_merge_streams = True

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_type_aliases = {name: name for name in ("Array", "ArrayLike", "Direction")}
TypeAliasForwardRef.__repr__ = lambda self: self.name  # type: ignore[method-assign]  # in unions
autodoc_preserve_defaults = True
napoleon_numpy_docstring = False
napoleon_attr_annotations = False
napoleon_use_ivar = True
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 80

html_theme = "furo"
html_title = "cdsm"
html_static_path = ["static/site.css", _mathjax()]
html_css_files = ["site.css"]
html_show_sourcelink = html_show_sphinx = False
html_copy_source = False
html_theme_options = {"source_edit_link": "", "navigation_with_keys": True}
mathjax_path = "tex-svg.js"
mathjax3_config = {"svg": {"mtextInheritFont": True}, "options": {"enableMenu": False}}
copybutton_prompt_text = r"\$ |>>> "
copybutton_prompt_is_regexp = True


def _escape(
    app: Sphinx, kind: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Keep the bars of ``|x|`` in docstrings, which are absolute values."""
    for i, line in enumerate(lines):
        parts = line.split("``")
        parts[::2] = [part.replace("|", r"\|") for part in parts[::2]]
        lines[i] = "``".join(parts)


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


def _show_as_shell(app: Sphinx, page: nodes.document) -> None:
    """Show cells of commands as a shell takes them, without the ! that runs them."""
    for block in page.findall(nodes.literal_block):
        lines = block.astext().splitlines()
        if lines and all(line.startswith("!") for line in lines):
            block.rawsource = "\n".join(line[1:] for line in lines)
            block.children = [nodes.Text(block.rawsource)]
            block["language"] = "sh"


def _describe(app: Sphinx, page: nodes.document) -> None:
    """Give figures without a text the title of their section, for who cannot see them."""
    for image in page.findall(lambda node: isinstance(node, nodes.image) and "alt" not in node):
        section = image.parent
        while not isinstance(section, nodes.section):
            section = section.parent
        image["alt"] = f"Figure: {section[0].astext()}"


def setup(app: Sphinx) -> None:
    """Write the generated pages before Sphinx looks for pages."""
    app.connect("config-inited", lambda *_: generate.all_pages())
    app.connect("doctree-read", _show_as_shell)
    app.connect("doctree-read", _describe)
    app.connect("autodoc-process-docstring", _keep_colon, priority=400)  # before napoleon
    app.connect("autodoc-process-docstring", _escape)
    app.connect("autodoc-process-signature", _shorten)
    # the constants of presets are found there, not where their classes are
    own = {"cdsm.presets": "cdsm.presets"}
    app.connect("viewcode-follow-imported", lambda _, module, name: own.get(module))
