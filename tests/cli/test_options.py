"""Options that commands share."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.cli.test_commands import SHORT, call

_FILES = [
    ("urdf", "--out", ".urdf"),
    ("new", None, ".toml"),
    ("check", "--out", ".html"),
    ("weigh", "--figure", ".png"),
    ("cycle", "--out", ".nc"),
    ("cycle", "--figure", ".pdf"),
    ("buckle", "--figure", ".svg"),
    ("plan", "--out", ".csv"),
    ("plan", "--animation", ".gif"),
    ("sweep", "--out", ".csv"),
    ("map", "--out", ".png"),
    ("fit", "--out", ".toml"),
    ("identify", "--figure", ".png"),
    ("export", "--out", ".xml"),
    ("export", "--cables-out", ".toml"),
]


def _refused(*arguments: object) -> str:
    """Return the error of a command that was used wrongly."""
    result = call(*arguments)
    assert result.exit_code == 2
    return " ".join(result.stderr.replace("│", " ").split())


def _said(command: str, option: str | None, path: object) -> str:
    """Return the error of a file to write; no input exists, so nothing has been computed."""
    said = _refused(command, *(["absent", option] if option else []), path)
    assert option is None or option in said
    return said


@pytest.mark.parametrize(("command", "option", "ending"), _FILES)
def test_a_file_that_cannot_be_written_is_refused_before_the_work(
    command: str, option: str | None, ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path(f"folder{ending}").mkdir()
    assert "the folder absent does not exist; create it" in _said(
        command, option, f"absent/a{ending}"
    )
    assert "is not a regular file" in _said(command, option, f"folder{ending}")
    assert "a.txt does not end in ." in _said(command, option, "a.txt")
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert "is read-only; choose another" in _said(command, option, f"a{ending}")


@pytest.mark.parametrize(
    ("arguments", "option", "same"),
    [
        (("export", "a.toml", "--cables-out", "a.toml"), "--cables-out", "ARM"),
        (("export", "a.toml", "--cables-out", "../{here}/a.toml"), "--cables-out", "ARM"),
        (("export", "a.toml", "--cables-out", "link.toml"), "--cables-out", "ARM"),
        (
            ("export", "a.urdf", "--cables", "b.toml", "--tip", "t", "--cables-out", "b.toml"),
            "--cables-out",
            "--cables",
        ),
        (
            ("export", "a.toml", "--wire", "b.toml", "--cables-out", "b.toml"),
            "--cables-out",
            "--wire",
        ),
        (
            ("plan", "a.toml", "--path", "t.csv", "--direction", "z", "--out", "t.csv"),
            "--out",
            "--path",
        ),
    ],
)
def test_a_file_that_is_read_or_written_twice_is_refused(
    arguments: tuple[str, ...],
    option: str,
    same: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Nothing is computed: the files that are read are empty, and stay so."""
    monkeypatch.chdir(tmp_path)
    for name in ("a.toml", "b.toml", "a.urdf", "t.csv"):
        Path(name).touch()
    Path("link.toml").symlink_to("a.toml")
    said = _refused(*(each.format(here=tmp_path.name) for each in arguments))
    assert f"{option}: " in said
    assert f" is also {same}; give another file." in said
    assert not any(path.stat().st_size for path in tmp_path.iterdir())


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
        (("stiffness", "{geometry}", "--angles", "1,,2"), "--angles: '' is no number"),
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
