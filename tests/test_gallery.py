"""Examples by robot: each prints what the gallery shows, draws its picture, and is fast."""

import re
import resource
from itertools import zip_longest
from pathlib import Path

import pytest
from PIL import Image

from docs import gallery
from tests.notebooks.test_notebooks import same

MOST_SECONDS = 20.0
"""Computing time of one example."""


def shown(name: str) -> str:
    """What the page shows of the print of an example."""
    page = gallery.PAGE.read_text(encoding="utf-8")
    found = re.search(rf"gallery/{name}\.png\)\n\n```text\n(.*?)```", page, re.DOTALL)
    assert found, name
    return found[1]


def test_the_page_shows_every_example_with_a_main_function_of_a_folder() -> None:
    scripts = (gallery.ROOT / "examples").glob("*.py")
    named = {each.stem for each in scripts if "def main(folder: Path)" in each.read_text("utf-8")}
    assert named == set(gallery.NAMES)
    assert {each.stem for each in gallery.PICTURES.iterdir()} == named
    for name in named:
        assert shown(name).count("\n") >= 3
        assert (gallery.PICTURES / f"{name}.png").stat().st_size < 1.5e5
        assert f"literalinclude}} ../examples/{name}.py" in gallery.PAGE.read_text("utf-8")
        assert 20 <= (gallery.ROOT / f"examples/{name}.py").read_text("utf-8").count("\n") <= 60


@pytest.mark.examples
@pytest.mark.parametrize("name", gallery.NAMES)
def test_an_example_prints_what_the_page_shows(name: str, tmp_path: Path) -> None:
    if name == "finger_edu":
        pytest.importorskip("example_robot_data", reason="the extra [robots] is not installed")
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    printed = gallery.run(name, tmp_path)
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before < MOST_SECONDS
    pairs = zip_longest(printed.split(), shown(name).split(), fillvalue="")
    assert [pair for pair in pairs if not same(*pair)] == []
    with (
        Image.open(tmp_path / f"{name}.png") as drawn,
        Image.open(gallery.PICTURES / f"{name}.png") as kept,
    ):
        assert drawn.width > 500
        assert abs(drawn.height / drawn.width - kept.height / kept.width) < 0.02
