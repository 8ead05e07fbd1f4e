"""Options that commands share."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.cli.test_commands import call

_FILES = [
    ("urdf", "--out", ".urdf"),
    ("check", "--out", ".html"),
    ("weigh", "--figure", ".png"),
    ("cycle", "--out", ".nc"),
    ("cycle", "--figure", ".pdf"),
    ("buckle", "--figure", ".svg"),
    ("plan", "--out", ".csv"),
    ("plan", "--animation", ".gif"),
    ("sweep", "--out", ".csv"),
    ("map", "--out", ".png"),
    ("track", "--out", ".nc"),
    ("track", "--animate", ".gif"),
    ("track", "--figure", ".png"),
    ("fit", "--out", ".toml"),
    ("fit", "--tolerances", ".toml"),
    ("identify", "--figure", ".png"),
    ("export", "--out", ".xml"),
    ("export", "--cables-out", ".toml"),
]
_ANY_ENDING = (".urdf", ".html", ".toml", ".xml")


def _said(command: str, option: str, path: object) -> str:
    """Return the error of a file to write; no input exists, so nothing has been computed."""
    result = call(command, "absent", option, path)
    assert result.exit_code == 2
    said = " ".join(result.stderr.replace("│", " ").split())
    assert option in said
    return said


@pytest.mark.parametrize(("command", "option", "ending"), _FILES)
def test_a_file_that_cannot_be_written_is_refused_before_the_work(
    command: str, option: str, ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path(f"folder{ending}").mkdir()
    assert "the folder absent does not exist; create it" in _said(
        command, option, f"absent/a{ending}"
    )
    assert "is not a regular file" in _said(command, option, f"folder{ending}")
    if not (ending in _ANY_ENDING or (command, option) == ("plan", "--out")):
        assert "a.txt ends in none of" in _said(command, option, "a.txt")
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert "is read-only; choose another" in _said(command, option, f"a{ending}")
