"""README and the pages: every Python snippet runs, and prints the text block that follows it."""

import io
import os
import re
import subprocess
import sys
from contextlib import redirect_stdout
from operator import attrgetter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
NAME = attrgetter("stem")
PAGES = [README, *sorted((ROOT / "docs").rglob("*.md"))]


@pytest.mark.parametrize(
    "page", [each for each in PAGES if "```python" in each.read_text(encoding="utf-8")], ids=NAME
)
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


@pytest.mark.slow
def test_shell_commands_run_as_printed(tmp_path: Path) -> None:
    """All but those that make the environment; and the view, which does not end."""
    text = README.read_text(encoding="utf-8")
    blocks = re.findall(r"```sh\n(.*?)```", text, re.DOTALL)
    lines = [line for block in blocks for line in block.splitlines() if "pip install" not in line]
    commands = [line for line in lines if line.split()[0].endswith("cdsm")]
    assert len(commands) == 4
    (tmp_path / ".venv").symlink_to(sys.prefix)
    path = os.pathsep.join(["/usr/bin", "/bin"])  # a shell that activated nothing
    environment = os.environ | {"PATH": path, "PYTHONPATH": str(ROOT)}
    for command in commands:
        if " view " in command:
            continue
        run = subprocess.run(
            command, shell=True, cwd=tmp_path, env=environment, capture_output=True, text=True
        )
        assert run.returncode == 0, f"{command}\n{run.stdout}{run.stderr}"
    assert (tmp_path / "REPORT.html").stat().st_size > 0


def test_readme_links_to_what_exists() -> None:
    text = README.read_text(encoding="utf-8")
    for path in (*re.findall(r'<img src="(.*?)"', text), *re.findall(r"\]\((.*?)\)", text)):
        assert (ROOT / path).exists(), path
