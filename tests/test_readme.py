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


def place(path: str) -> Path | None:
    """Return the file or folder that CONTRIBUTING names; paths may leave out ``cdsm/``."""
    return next((base / path for base in (ROOT / "cdsm", ROOT) if (base / path).exists()), None)


def words(path: Path) -> set[str]:
    """Return all words of a file, or of the files in a folder."""
    files = [path] if path.is_file() else [*path.rglob("*.py"), *path.rglob("*.pyi")]
    return {word for file in files for word in re.findall(r"\w+", file.read_text(encoding="utf-8"))}


def test_files_and_names_that_contributing_mentions_exist() -> None:
    text = re.sub(r"```.*?```", "", CONTRIBUTING.read_text(encoding="utf-8"), flags=re.DOTALL)
    spans = {" ".join(span.split()) for span in re.findall(r"`([^`]+)`", text)}
    paths = {span for span in spans if re.fullmatch(r"[\w.]+/[\w./]*|\w+\.(?:py|pyi|md)", span)}
    constants = set(re.findall(r"^\| `([\w/]+)` \| `\w", text, re.MULTILINE))  # rows of tolerances
    built = {path for path in paths if path.startswith("build/")}
    assert len(paths) > 300
    assert {path for path in paths - constants - built if place(path) is None} == set()
    homes = ("cdsm", "tests", "docs", "examples", "pyproject.toml", ".ci/run")
    known = set[str]().union(*(words(ROOT / home) for home in homes))
    names = {name for span in spans - paths for name in re.findall(r"[A-Za-z_]\w+", span)}
    assert len(names) > 300
    assert names - known == set()


def test_names_that_contributing_finds_in_a_file_are_there() -> None:
    text = " ".join(CONTRIBUTING.read_text(encoding="utf-8").split())
    name, path = r"`(\w+)`", r"`([\w./]+\.(?:py|pyi)|\w+/)`"
    listed = rf"({name}(?:(?:, | and |, and ){name})*)"
    pairs = [(file, names) for file, names, *_ in re.findall(rf"{path}: {listed}", text)]
    pairs += [(each[-1], each[0]) for each in re.findall(rf"{listed} (?:in|of) {path}", text)]
    assert len(pairs) > 100
    for file, names in pairs:
        home = place(file)
        assert home is not None, file
        assert set(re.findall(name, names)) <= words(home), (file, names)


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
