"""Options that commands share."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.cli.test_commands import SHORT, call

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
_ANY_ENDING = (".urdf", ".toml", ".xml")


def _refused(*arguments: object) -> str:
    """Return the error of a command that was used wrongly."""
    result = call(*arguments)
    assert result.exit_code == 2
    return " ".join(result.stderr.replace("│", " ").split())


def _said(command: str, option: str, path: object) -> str:
    """Return the error of a file to write; no input exists, so nothing has been computed."""
    said = _refused(command, "absent", option, path)
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


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ("stiffness", "{geometry}", "--wire", 48e3, "--angles", "joint2_1=x"),
            "'x' is no number; give an angle, as joint2_1=10.",
        ),
        (
            ("stiffness", "{geometry}", "--wire", 48e3, "--direction", "w"),
            "'w' is no number; give an axis such as -y, or X,Y,Z.",
        ),
        (("fit", "absent.csv", "--gauge-length", "-300"), "--gauge-length"),
        (("plan", "{geometry}", "--direction", "z", "--target", "-1"), "--target"),
    ],
)
def test_what_is_no_number_or_negative_is_named(
    arguments: tuple[object, ...], said: str, tmp_path: Path
) -> None:
    geometry = tmp_path / "arm.toml"
    geometry.write_text(SHORT, encoding="utf-8")
    assert said in _refused(*(str(each).format(geometry=geometry) for each in arguments))
