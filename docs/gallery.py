"""Run the examples by robot and write the gallery: ``python -m docs.gallery``.

Writes docs/gallery.md and docs/pictures/gallery; both are committed.
"""

import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "gallery.md"
PICTURES = ROOT / "docs" / "pictures" / "gallery"
WIDTH = 1000
"""Width of a picture [px]."""

NAMES = (
    *("rod_one_tendon", "silicone_tentacle", "nitinol_segment", "spirob", "simplex", "sjtu_snake"),
    *("finger_with_pulleys", "rolling_arm", "finger_edu"),
    *("virtual_prototype", "experimental_prototype"),
)

HEAD = """\
# Gallery

One script for each robot, in the folder `examples`: it prints a table and draws a picture, in 20
to 50 lines to copy from. `python examples/spirob.py FOLDER` writes the picture to a folder; without
one, beside the script. What others measured on the first four, and state of the fifth, is on the
page [Validation](reference/validation.md).
"""

ENTRY = """
## {title}

![{title}](pictures/gallery/{name}.png)

```text
{printed}```

:::{{dropdown}} examples/{name}.py
```{{literalinclude}} ../examples/{name}.py
:language: python
```
:::
"""


def run(name: str, folder: Path) -> str:
    """Run an example, which writes its picture to a folder; return what it prints."""
    script = ROOT / "examples" / f"{name}.py"
    places = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    environment = os.environ | {"PYTHONPATH": places, "MPLBACKEND": "agg"}
    command = [sys.executable, "-W", "error", "-W", "ignore::cdsm.CdsmWarning", script, folder]
    return subprocess.run(
        command, env=environment, capture_output=True, text=True, check=True
    ).stdout


def title_of(name: str) -> str:
    """First sentence of the docstring of an example, up to its colon or full stop."""
    first = (ROOT / "examples" / f"{name}.py").read_text(encoding="utf-8").split('"""')[1]
    return first.splitlines()[0].partition(".")[0].partition(":")[0].partition(",")[0]


def write() -> None:
    """Write the page and its pictures."""
    PICTURES.mkdir(exist_ok=True)
    page = HEAD
    with TemporaryDirectory() as folder:
        for name in NAMES:
            printed = run(name, Path(folder))
            picture = Image.open(Path(folder, f"{name}.png")).convert("RGB")
            size = WIDTH, round(WIDTH * picture.height / picture.width)
            smaller = picture.resize(size, Image.Resampling.LANCZOS).quantize(200)
            smaller.save(PICTURES / f"{name}.png", optimize=True)
            page += ENTRY.format(title=title_of(name), name=name, printed=printed)
    PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    write()
