"""Reading and writing whole files: named errors, size caps, never a half-written file."""

from __future__ import annotations

import contextlib
import os
import secrets
import stat
from collections.abc import Callable
from pathlib import Path

from cdsm.errors import CdsmError, FileError, InvalidInput

MAXIMUM_BYTES = 10_000_000
"""No description of an arm comes near this; a larger file is a mistake or an attack."""


def read_text(path: str | os.PathLike[str]) -> str:
    """Return the UTF-8 text of a file.

    Raises:
        FileError: Missing, not readable, no regular file, larger than :data:`MAXIMUM_BYTES`, or not
            UTF-8.
    """
    path = as_path(path)
    try:
        # a pipe that nobody writes to would be waited for
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise FileError(path, "is not a regular file; give the path of a file.")
            data = file.read(MAXIMUM_BYTES + 1)
        if len(data) > MAXIMUM_BYTES:
            raise FileError(path, f"is larger than the {MAXIMUM_BYTES} bytes that are read.")
        return data.decode("utf-8-sig")  # some editors begin a file with a mark
    except CdsmError:
        raise
    except FileNotFoundError:
        raise FileError(path, f"does not exist (looked in {Path.cwd()}).") from None
    except UnicodeDecodeError as error:
        raise FileError(
            path, f"is not UTF-8 text (byte {error.start}); save it as UTF-8."
        ) from None
    except (OSError, ValueError) as error:
        raise FileError(path, f"cannot be read: {_reason(error)}.") from None


def write_text(path: str | os.PathLike[str], text: str) -> Path:
    """Write UTF-8 text with newline endings, whole or not at all; return the path."""
    return write_file(path, lambda aside: aside.write_bytes(text.encode()))


def write_file(path: str | os.PathLike[str], fill: Callable[[Path], object]) -> Path:
    """Let ``fill`` write a file beside the wanted one, then rename it into place.

    A failure, of ``fill`` or of the disk, leaves the wanted path as it was. A link is followed, and
    an existing file keeps its mode.

    Raises:
        FileError: The folder is missing or not writable, the disk refuses, or something that is not
            a file stands there.
    """
    path = as_path(path)
    aside: Path | None = None
    try:
        target = path.resolve()
        if target.exists() and not target.is_file():
            raise FileError(path, "is not a regular file; give the path of a file.")
        if not target.parent.is_dir():
            raise FileError(path, f"the folder {path.parent} does not exist; create it.")
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


def make_folder(path: str | os.PathLike[str]) -> Path:
    """Create a folder and its parents if missing; return it.

    Raises:
        FileError: It cannot be created, or a file stands in its place.
    """
    path = as_path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise FileError(path, f"cannot be made a folder: {_reason(error)}.") from None
    return path


def as_path(path: str | os.PathLike[str]) -> Path:
    """Return the path, of something that exists or could be made.

    Raises:
        InvalidInput: It is no path.
        FileError: The system cannot look there: too long, no text, forbidden.
    """
    try:
        found = Path(path)
    except TypeError:
        raise InvalidInput("path", f"{path!r} given; the path of a file is needed.") from None
    try:
        found.lstat()
    except (FileNotFoundError, NotADirectoryError):
        pass
    except (OSError, ValueError) as error:
        raise FileError(path, f"is no path that can be used: {_reason(error)}.") from None
    return found


def _reason(error: Exception) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
