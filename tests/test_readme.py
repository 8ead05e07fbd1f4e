"""README and the pages: every Python snippet runs, and prints the text block that follows it."""

import io
import os
import re
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

import pytest

import cdsm

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
PAGES = [
    page
    for page in (README, *sorted((ROOT / "docs").rglob("*.md")))
    if "```python" in page.read_text(encoding="utf-8")
]


@pytest.mark.parametrize("page", PAGES, ids=[page.stem for page in PAGES])
def test_snippets_print_what_the_page_shows(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocks = re.findall(r"```(\w+)\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    monkeypatch.chdir(tmp_path)
    namespace: dict[str, object] = {}
    printed = ""
    for language, code in blocks:
        if language == "python":
            with redirect_stdout(io.StringIO()) as out:
                exec(code, namespace)
            printed = out.getvalue()
        elif language == "text":
            assert printed == code
    if page == README:  # its arm is that of `cdsm new`, and of the first notebook
        assert namespace["arm"] == cdsm.Manipulator.read(ROOT / "examples/arm.toml").with_cables(
            namespace["arm"].cables  # type: ignore[attr-defined]
        )
        notebook = (ROOT / "notebooks/01_stiffness_of_an_arm.ipynb").read_text(encoding="utf-8")
        assert all(line in notebook for line in printed.splitlines())


def test_its_commands_run_as_printed(tmp_path: Path) -> None:
    """All but those that make the environment; and the view, which does not end."""
    text = README.read_text(encoding="utf-8")
    commands = re.findall(r"^\.venv/bin/cdsm (?!view).*", text, re.MULTILINE)
    assert len(commands) == 2
    (tmp_path / ".venv").symlink_to(sys.prefix)
    path = os.pathsep.join(["/usr/bin", "/bin"])  # a shell that activated nothing
    environment = os.environ | {"PATH": path, "PYTHONPATH": str(ROOT)}
    for command in commands:
        run = subprocess.run(
            command, shell=True, cwd=tmp_path, env=environment, capture_output=True, text=True
        )
        assert run.returncode == 0, f"{command}\n{run.stdout}{run.stderr}"
    assert "along                          46.76       3.296       3.215" in run.stdout
    assert (tmp_path / "REPORT.html").stat().st_size > 0


def test_its_links_lead_somewhere() -> None:
    text = README.read_text(encoding="utf-8")
    links = [*re.findall(r'<img src="(.*?)"', text), *re.findall(r"\]\((.*?)\)", text)]
    assert [link for link in links if not (ROOT / link).exists()] == []
    assert text.count("\n") <= 100
