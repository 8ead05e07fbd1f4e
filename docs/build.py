"""Build the site into build/site: ``.venv/bin/python docs/build.py``.

Notebooks that are out of date are run, and the cells of all pages. Warnings, dead links and pages
that ask another server for a script, a style or a picture are errors.
"""

import os
import sys
from pathlib import Path
from urllib.parse import unquote, urldefrag

from lxml import html
from sphinx.cmd.build import build_main

HERE = Path(__file__).parent
ROOT = HERE.parent
SITE = ROOT / "build" / "site"

KERNEL = """\
c.Application.log_level = "ERROR"
c.IPKernelApp.matplotlib = "inline"
c.InlineBackend.figure_formats = ["retina"]
c.InteractiveShellApp.exec_lines = ['import logging; logging.getLogger("cdsm").setLevel("ERROR")']
"""
"""Settings of the kernels that run cells: figures are sharp; nothing is said of compiling."""


def main() -> int:
    """Build the site, then check its links; return the exit code."""
    os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    paths = [str(ROOT), str(ROOT / "examples"), os.environ.get("PYTHONPATH", "")]
    os.environ["PYTHONPATH"] = os.pathsep.join(paths)
    profile = ROOT / "build" / "ipython" / "profile_default"
    profile.mkdir(parents=True, exist_ok=True)
    (profile / "ipython_kernel_config.py").write_text(KERNEL, encoding="utf-8")
    os.environ["IPYTHONDIR"] = str(profile.parent)
    # for commands that pages show
    os.environ |= {"TERM": "dumb", "NO_COLOR": "1", "COLUMNS": "100"}
    doctrees = str(ROOT / "build" / "doctrees")
    options = ["-W", "--keep-going", "-q", "-j", "auto", "-d", doctrees]
    failed = build_main([*options, str(HERE), str(SITE)])
    dead = dead_links(SITE)
    sys.stderr.writelines(f"{each}\n" for each in dead)
    if not failed and not dead:
        print(f"{SITE / 'index.html'}: {len(list(SITE.rglob('*.html')))} pages, no dead link")
    return failed or bool(dead)


def dead_links(site: Path) -> list[str]:
    """List links to pages and places that do not exist, and what would be fetched elsewhere."""
    trees = {path: html.parse(path).getroot() for path in site.rglob("*.html")}
    places = {
        path: {*tree.xpath("//@id"), *tree.xpath("//a/@name")} for path, tree in trees.items()
    }
    dead = []
    for page, tree in trees.items():
        fetched = {*tree.xpath("//img/@src"), *tree.xpath("//script/@src")}
        fetched |= set(tree.xpath("//link[@rel='stylesheet']/@href"))
        for link in fetched | set(tree.xpath("//a/@href")):
            where = f"{page.relative_to(site)}: {link}"
            if link.startswith(("http:", "https:", "//")):
                if link in fetched:
                    dead.append(f"{where}: is fetched from another server")
                continue
            if link.startswith(("mailto:", "data:")):
                continue
            address, place = urldefrag(link)
            target = (page.parent / unquote(address.split("?")[0])).resolve() if address else page
            if target.is_dir():
                target /= "index.html"
            if not target.exists():
                dead.append(f"{where}: no such page")
            elif place and target in places and unquote(place) not in places[target]:
                dead.append(f"{where}: no such place")
    return sorted(dead)


if __name__ == "__main__":
    sys.exit(main())
