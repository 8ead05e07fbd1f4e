"""Paths in CSV files: what is read, and what is refused."""

from pathlib import Path

import pytest

import cdsm
from cdsm.cli.path_file import read_path
from tests.cli.test_commands import call
from tests.support.tracking import small_path


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """The small arm and its path as files."""
    plan = small_path()
    path = plan.write(tmp_path / "path.csv")
    columns = [line.split(",")[2 : 2 + plan.arm.nv] for line in path.read_text().splitlines()]
    path.write_text("\n".join(map(",".join, columns)), encoding="utf-8")
    return plan.arm.write(tmp_path / "arm.toml"), path


def refused(files: tuple[Path, Path]) -> str:
    """Return the error of a plan along the path."""
    arm, path = files
    shown = call("plan", arm, "--path", path, "--direction", "z", "--target", "15")
    assert shown.exit_code == 1
    return " ".join(shown.stderr.replace("│", " ").split())


def test_path_without_columns_is_named(files: tuple[Path, Path]) -> None:
    files[1].write_text("a,b\n1,2\n", encoding="utf-8")
    assert "path.csv: has columns for neither of joint angles" in refused(files)


def test_misspelt_columns_and_unknown_joints_are_refused(files: tuple[Path, Path]) -> None:
    path = files[1].read_text(encoding="utf-8")
    for old, new in (("joint2", "joint9"), ("\n", ",targt [N/mm]\n")):
        files[1].write_text(path.replace(old, new, 1), encoding="utf-8")
        assert "did you mean" in refused(files)
    files[1].write_text(path.replace("\n", ",joint3_1 [rad]\n", 1), encoding="utf-8")
    assert "has a column joint3_1, which is not known" in refused(files)
    files[1].write_text(path.replace("\n", ",time [s]\n", 1), encoding="utf-8")
    assert read_path(files[1], cdsm.Manipulator.read(files[0])).angles is not None
