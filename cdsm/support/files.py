"""Read and write whole files: named errors, size limits, no half-written files."""

from __future__ import annotations

import codecs
import contextlib
import os
import secrets
import stat
from collections.abc import Callable
from pathlib import Path

from cdsm.errors import CdsmError, FileError, InvalidInput

MAXIMUM_BYTES = 10_000_000
"""Largest size of a file that is read; a larger file is a mistake or an attack."""

_MARKS = codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE


def read_text(path: str | os.PathLike[str], *, any_encoding: bool = False) -> str:
    """Return the text of a file: UTF-8, or with ``any_encoding`` also UTF-16 or Windows-1252.

    Raises FileError if the file is missing, not regular, too large, not readable, or of another
    encoding.
    """
    path = as_path(path)
    try:
        # O_NONBLOCK: opening a pipe without a writer would wait forever
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise FileError(path, "is not a regular file; give the path of a file.")
            data = file.read(MAXIMUM_BYTES + 1)
        if len(data) > MAXIMUM_BYTES:
            raise FileError(path, f"is larger than the {MAXIMUM_BYTES} bytes that are read.")
        return _decoded(data) if any_encoding else data.decode("utf-8-sig")  # may have a mark
    except CdsmError:
        raise
    except FileNotFoundError:
        raise FileError(path, f"does not exist (looked in {Path.cwd()}).") from None
    except UnicodeDecodeError as error:
        if b"\0" in data and not data.startswith(_MARKS):
            raise FileError(path, "is a binary file; a text file is needed.") from None
        raise FileError(
            path, f"is not UTF-8 text (byte {error.start}); save it as UTF-8."
        ) from None
    except (OSError, ValueError) as error:
        raise FileError(path, f"cannot be read: {_reason(error)}.") from None


def _decoded(data: bytes) -> str:
    """Decode the text of a file in UTF-16, UTF-8 or, if it is neither, Windows-1252.

    UTF-16 has a byte-order mark, or a zero among its first two bytes.
    """
    if data.startswith(_MARKS):
        return data.decode("utf-16")
    if b"\0" in data[:2]:
        return data.decode("utf-16-be" if data[0] == 0 else "utf-16-le")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252")


def write_text(path: str | os.PathLike[str], text: str) -> Path:
    """Write UTF-8 text with newline endings, completely or not at all; return the path."""
    return write_file(path, lambda aside: aside.write_bytes(text.encode()))


def write_file(path: str | os.PathLike[str], fill: Callable[[Path], object]) -> Path:
    """Call ``fill`` with the path of a temporary file, then rename this file to ``path``.

    If ``path`` is a link, its target is replaced. An existing file keeps its mode. On failure the
    file at ``path`` stays unchanged, and a FileError says why.
    """
    path = as_path(path)
    aside: Path | None = None
    try:
        require_writable(path)
        target = path.resolve()
        aside = target.with_name(f".{target.stem}-{secrets.token_hex(4)}{target.suffix}")
        mode = stat.S_IMODE(target.stat().st_mode) if target.exists() else 0o666
        os.close(os.open(aside, os.O_CREAT | os.O_EXCL | os.O_WRONLY, mode))
        fill(aside)
        aside.replace(target)
    except CdsmError:
        raise
    except (OSError, ValueError) as error:
        raise FileError(path, f"cannot be written: {_reason(error)}.") from None
    finally:
        if aside is not None:
            with contextlib.suppress(OSError):
                aside.unlink()
    return path


def require_writable(path: Path) -> None:
    """Raise a FileError if a file cannot be written at ``path``.

    The reason is that its folder is missing, or that ``path`` is a folder or a device.
    """
    if path.exists() and not path.is_file():
        raise FileError(path, "is not a regular file; give the path of a file.")
    require_folder(path)


def require_folder(path: Path) -> None:
    """Raise a FileError if the parent folder of ``path`` does not exist."""
    if not path.resolve().parent.is_dir():
        raise FileError(path, f"the folder {path.parent} does not exist; create it.")


def make_folder(path: str | os.PathLike[str]) -> Path:
    """Create a folder and its parents if missing, return its path; FileError on failure."""
    path = as_path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise FileError(path, f"cannot be created as a folder: {_reason(error)}.") from None
    return path


def as_path(path: str | os.PathLike[str]) -> Path:
    """Return a path that the system can use; the file may or may not exist.

    Raises InvalidInput if ``path`` is not a path; FileError if it is too long, not text, or not
    accessible.
    """
    try:
        found = Path(path)
    except TypeError:
        raise InvalidInput("path", f"{path!r:.100} given; the path of a file is needed.") from None
    if path == "":  # which Path takes for the folder
        raise FileError("''", "is an empty path; give a file or folder.")
    try:
        found.lstat()
    except (FileNotFoundError, NotADirectoryError):
        pass
    except (OSError, ValueError) as error:
        raise FileError(path, f"is no path that can be used: {_reason(error)}.") from None
    return found


def _reason(error: Exception) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
