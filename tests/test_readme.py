"""README is executed: every Python snippet runs, and prints the text block that follows it."""

import io
import os
import re
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
CONTRIBUTING = ROOT / ".github" / "CONTRIBUTING.md"


def test_snippets_print_what_the_readme_shows() -> None:
    blocks = re.findall(r"```(\w+)\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    namespace: dict[str, object] = {}
    printed, compared = "", 0
    for language, code in blocks:
        if language == "python":
            with redirect_stdout(io.StringIO()) as out:
                exec(code, namespace)
            printed = out.getvalue()
        elif language == "text":
            assert printed == code
            compared += 1
    assert compared == 1


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


def test_readme_fits_a_page_and_links_to_what_exists() -> None:
    text = README.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 90
    shown = re.findall(r'<img src="(.*?)"', text)
    assert len(shown) == 2
    for path in (*shown, *re.findall(r"\]\((.*?)\)", text)):
        assert (ROOT / path).exists(), path


def test_a_result_is_shown_within_the_first_25_lines() -> None:
    head = README.read_text(encoding="utf-8").splitlines()[:25]
    assert any(line.startswith("along ") for line in head)


def test_files_and_constants_that_contributing_names_exist() -> None:
    text = CONTRIBUTING.read_text(encoding="utf-8")
    named = re.findall(r"`((?:cdsm|tests)/[\w./]+)`", text)
    assert len(set(named)) > 30
    assert [path for path in named if not (ROOT / path).exists()] == []
    for path, name in re.findall(r"`(cdsm/[\w/]+\.py)`: `(\w+)`", text):
        assert re.search(rf"\b{name}\b", (ROOT / path).read_text(encoding="utf-8")), (path, name)


def test_tolerances_that_contributing_lists_are_those_of_the_code() -> None:
    rows = re.findall(
        r"^\| `([\w/]+)` \| `([\w, ]+)` \| (.*?) \|", CONTRIBUTING.read_text("utf-8"), re.M
    )
    assert len(rows) > 50
    for module, name, value in rows:
        source = (ROOT / "cdsm" / f"{module}.py").read_text(encoding="utf-8")
        line = re.search(rf"^{name}(?:: \w+)? = (.*)", source, re.M)
        assert line is not None, (module, name)
        assert value in line[1], (module, name, line[1])
    listed = {(module, name) for module, names, _ in rows for name in names.split(", ")}
    sizes = {("interchange/mjcf", "_CABLE"), ("urdf", "CROSS_MASS"), ("urdf", "CROSS_INERTIA")}
    small = {
        (path.relative_to(ROOT / "cdsm").with_suffix("").as_posix(), name)
        for path in (ROOT / "cdsm").rglob("*.py")
        for name, value in re.findall(
            r"^(\w+)(?:: Final)? = (\d[\d.]*e-\d+)\b", path.read_text("utf-8"), re.M
        )
        if float(value) < 1e-3
    }
    assert small - listed == sizes
