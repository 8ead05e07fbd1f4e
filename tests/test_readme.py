"""README is executed: its Python prints the text below it, its commands run, its links exist."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import cdsm

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def test_its_python_prints_what_it_shows(capsys: pytest.CaptureFixture[str]) -> None:
    (code,), (text,) = blocks("python"), blocks("text")
    namespace: dict[str, object] = {}
    exec(code, namespace)
    assert capsys.readouterr().out == text
    # its arm is that of `cdsm new`, which writes this file, and that of the first notebook
    assert namespace["geometry"] == cdsm.Manipulator.read(ROOT / "examples" / "arm.toml").geometry
    notebook = (ROOT / "notebooks" / "01_stiffness_of_an_arm.ipynb").read_text(encoding="utf-8")
    for line in text.splitlines():
        assert line in notebook


@pytest.mark.slow
def test_its_commands_run_as_printed(tmp_path: Path) -> None:
    """All but those that make the environment; and the view, which does not end."""
    lines = [line for block in blocks("sh") for line in block.splitlines()]
    commands = [line for line in lines if re.match(r"\.venv/bin/cdsm (?!view)", line)]
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
    links = [*re.findall(r'<img src="(.*?)"', README), *re.findall(r"\]\((.*?)\)", README)]
    assert [link for link in links if not (ROOT / link).exists()] == []
    assert README.count("\n") <= 100
