"""Files are written whole or not at all, and nothing else is touched."""

import os
import stat
from pathlib import Path

import pytest

import cdsm
from cdsm.support.files import write_text


def test_link_is_followed_and_mode_is_kept(tmp_path: Path) -> None:
    target = tmp_path / "real.toml"
    target.write_text("old", encoding="utf-8")
    target.chmod(0o600)
    link = tmp_path / "link.toml"
    link.symlink_to(target)
    write_text(link, "new")
    assert link.is_symlink()
    assert target.read_text(encoding="utf-8") == "new"
    assert stat.S_IMODE(target.stat().st_mode) == 0o600


def test_what_is_not_a_file_is_left_alone(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(cdsm.FileError, match="not a regular file"):
        write_text(pipe, "text")
    assert stat.S_ISFIFO(pipe.stat().st_mode)
