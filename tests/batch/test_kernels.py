"""Which kernels compute a batch: compiled ones where they are at hand or pay, else numpy."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from cdsm.batch import solution


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A clone with kernels of its own, and an empty folder for what numba keeps."""
    clone = tmp_path / "clone" / "kernels.py"
    clone.parent.mkdir()
    shutil.copy(solution._source(), clone)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "numba"))
    monkeypatch.setattr(solution, "_source", lambda: clone)
    solution._is_kept.cache_clear()
    yield clone
    solution._is_kept.cache_clear()


def is_kept() -> bool:
    solution._is_kept.cache_clear()
    return solution._is_kept()


def test_kernels_are_kept_until_their_source_changes(source: Path) -> None:
    assert not is_kept()
    solution._keep_record()
    assert is_kept()
    source.write_text(source.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    assert not is_kept()


def test_kernels_of_another_clone_or_python_are_not_these(
    source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Files of numba below the same folder say nothing: one row would compile all kernels."""
    folder = tmp_path / "numba" / "other_clone"
    folder.mkdir(parents=True)
    (folder / "kernels.along-330.py39.1.nbi").touch()
    solution._keep_record()
    other = tmp_path / "other" / "kernels.py"
    other.parent.mkdir()
    shutil.copy(source, other)
    monkeypatch.setattr(solution, "_source", lambda: other)
    assert not is_kept()
