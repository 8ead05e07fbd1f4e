"""Directives of the site: where an equation is in the code, and which test holds it."""

from pathlib import Path
from typing import ClassVar

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).parents[1]


class Held(SphinxDirective):
    """Show the function that computes an equation, and the test that holds it.

    Each argument is ``path.py:name``. The source is included: a name that is gone fails the build.
    """

    required_arguments = 1
    final_argument_whitespace = True
    option_spec: ClassVar[dict[str, object]] = {}

    def run(self) -> list[nodes.Node]:
        """Return one closed box for each argument, with its source."""
        rows = []
        for each in self.arguments[0].split():
            path, name = each.split(":")
            kind = "Test" if path.startswith("tests/") else "Code"
            include = "/" + str(Path("..") / path)
            rows += [
                f":::::{{dropdown}} {kind}: {path}: {name}",
                ":animate: fade-in",
                f"```{{literalinclude}} {include}",
                f":pyobject: {name}",
                ":language: python",
                "```",
                ":::::",
                "",
            ]
        return self.parse_text_to_nodes("\n".join(rows))


def setup(app: Sphinx) -> None:
    """Register the directives."""
    app.add_directive("held", Held)
