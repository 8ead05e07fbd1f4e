"""Read and write whole files: named errors, a size limit, no half-written files.

XML is read strictly: no recovery, no expansion of entities, no network access.
"""

from __future__ import annotations

import codecs
import math
import os
import re
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from cdsm.errors import CdsmError, FileError, InvalidInput
from cdsm.support.validation import LARGEST

if TYPE_CHECKING:
    from lxml import etree

MAXIMUM_BYTES = 10_000_000
"""Largest size of a file that is read; a larger file is a mistake."""


def read_text(path: str | os.PathLike[str], *, any_encoding: bool = False) -> str:
    """Return the text of a file: UTF-8, or with ``any_encoding`` also UTF-16 or Windows-1252.

    Raises FileError if the file is missing, no file, too large, not readable, or of another
    encoding.
    """
    path = as_path(path)
    try:
        with path.open("rb") as file:
            data = file.read(MAXIMUM_BYTES + 1)
        if len(data) > MAXIMUM_BYTES:
            raise FileError(path, f"is larger than the {MAXIMUM_BYTES} bytes that are read.")
        utf_16 = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        if any_encoding and utf_16:
            return data.decode("utf-16")
        if b"\0" in data and not utf_16:
            raise FileError(path, "is a binary file; a text file is needed.")
        return data.decode("utf-8-sig")  # with or without a byte-order mark
    except FileNotFoundError:
        raise missing_file(path) from None
    except UnicodeDecodeError as error:
        if any_encoding:
            return data.decode("cp1252", errors="replace")
        at = f"is not UTF-8 text (byte {error.start}); save it as UTF-8."
        raise FileError(path, at) from None
    except (OSError, ValueError) as error:
        raise _failure(path, "read", error) from None


def write_text(path: str | os.PathLike[str], text: str) -> Path:
    """Write UTF-8 text with newline endings, completely or not at all; return the path."""
    return write_file(path, lambda aside: aside.write_bytes(text.encode()))


def write_file(path: str | os.PathLike[str], fill: Callable[[Path], object]) -> Path:
    """Call ``fill`` with the path of a temporary file, then rename this file to ``path``.

    If ``path`` is a link, its target is replaced. An existing file keeps its mode. On failure, such
    as a full disk, the file at ``path`` stays unchanged, and a FileError says why.
    """
    path = as_path(path)
    try:
        require_writable(path)
        target = path.resolve()
        with tempfile.TemporaryDirectory(prefix=".", dir=target.parent) as folder:
            aside = Path(folder, target.name)
            fill(aside)
            if target.exists():
                shutil.copymode(target, aside)
            aside.replace(target)
    except (OSError, ValueError) as error:
        raise _failure(path, "written", error) from None
    except RuntimeError as error:  # of netCDF, which does not name the cause
        raise FileError(path, f"cannot be written: {error}; is the disk full?") from None
    return path


def require_writable(path: Path) -> None:
    """Raise a FileError if ``path`` is no regular file, or the user must not write it."""
    if path.exists() and not path.is_file():
        raise FileError(path, "is not a regular file; give the path of a file.")
    require_folder(path)


def require_folder(path: Path) -> None:
    """Raise a FileError if the folder of ``path`` is missing, or one of both is protected."""
    folder = path.resolve().parent
    if not folder.is_dir():
        raise FileError(path, f"the folder {path.parent} does not exist; create it.")
    for place, mode in ((folder, os.W_OK | os.X_OK), (path, os.W_OK)):
        if place.exists() and not os.access(place, mode):
            raise FileError(path, f"you may not write to {place}; give another place.")


def make_folder(path: str | os.PathLike[str]) -> Path:
    """Create a folder and its parents if missing, return its path; FileError on failure."""
    path = as_path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
        require_folder(path / "file")
    except OSError as error:  # also that of require_folder
        raise _failure(path, "created as a folder", error) from None
    return path


def as_path(path: str | os.PathLike[str]) -> Path:
    """Return a path; InvalidInput if it is none, FileError if it is empty."""
    if isinstance(path, str) and not path:  # which Path takes for the folder
        raise FileError("''", "is an empty path; give a file or folder.")
    try:
        return Path(path)
    except TypeError:
        raise InvalidInput("path", f"{path!r:.100} given; the path of a file is needed.") from None


def missing_file(path: str | os.PathLike[str]) -> FileError:
    """Return the error that a file does not exist."""
    return FileError(path, f"does not exist (looked in {Path.cwd()}).")


def _failure(path: Path, done: str, error: Exception) -> CdsmError:
    """Return the error of a path that cannot be ``done``, or the CdsmError that it already is."""
    if isinstance(error, CdsmError):
        return error
    return FileError(path, f"cannot be {done}: {getattr(error, 'strerror', None) or error}.")


class XmlFault(ValueError):
    """Fault of an XML document; callers raise the error of their file format instead."""


def parse_xml(text: str, root: str, doctype: str | None = None) -> etree._Element:
    """Parse an XML text and return its root element, which must have the name ``root``.

    A DOCTYPE is allowed only if it just names a DTD that matches the pattern ``doctype``; the DTD
    is not read. Other DOCTYPEs could define entities or name files to read.
    Raises XmlFault if the text is not well-formed or too deep, or has another root.
    """
    from lxml import etree  # slow to import

    parser = etree.XMLParser(
        encoding="utf-8",
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        recover=False,
        huge_tree=False,  # at most 256 levels
        remove_comments=True,
        remove_pis=True,
    )
    try:
        # these bytes are UTF-8, even if the XML declaration names another encoding
        document = etree.fromstring(text.encode(), parser).getroottree()
    except (etree.XMLSyntaxError, ValueError) as error:
        raise XmlFault(f"is not well-formed XML: {error!s:.160}") from None
    if document.docinfo.internalDTD is not None and not (doctype and _names_dtd(text, doctype)):
        raise XmlFault("has a DOCTYPE, which could define entities or name files; remove it")
    top = document.getroot()
    if top.tag != root:
        raise XmlFault(f"has the root element <{top.tag!s:.160}>; <{root}> is needed")
    return top


def _names_dtd(text: str, system: str) -> bool:
    """Return whether the only DOCTYPE of a text just names a DTD of the pattern ``system``."""
    literal = rf"""(?:"{system}"|'{system}')"""
    alone = rf"""<!DOCTYPE\s+[^\s"'<>\[]+\s+(?:SYSTEM|PUBLIC\s+(?:""|''))\s+{literal}\s*>"""
    return text.count("<!DOCTYPE") == 1 and re.search(alone, text) is not None


def read_numbers(where: str, text: str | None, count: int) -> tuple[float, ...]:
    """Return the ``count`` finite numbers in a text; else raise XmlFault, which names ``where``."""
    try:
        values = tuple(map(float, (text or "").split()))
    except ValueError:
        values = ()
    if len(values) != count:
        wanted = "a number is" if count == 1 else f"{count} numbers are"
        raise XmlFault(f"{where}: {text or ''!r:.160} given; {wanted} needed")
    if not all(math.isfinite(value) and abs(value) <= LARGEST for value in values):
        raise XmlFault(f"{where}: {text!r:.160} given; it must be finite, to {LARGEST:g}")
    return values
