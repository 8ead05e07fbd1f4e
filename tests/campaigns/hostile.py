"""Every reader of the library, a whole file for each, and what strangers may make of such files.

Run as a module it reads attacks one after the other under a limit of memory, and tells on each line
what became of one::

    python -m tests.campaigns.hostile FOLDER LARGEST READER …

LARGEST is the size in bytes of the files to try.
"""

import json
import os
import random
import re
import resource
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import cdsm
from cdsm.cli.path_file import read_path
from cdsm.support.files import MAXIMUM_BYTES
from tests.interchange.test_caspr import cable, folder, link
from tests.support.arms import mixed_arm
from tests.support.foreign import TREE, crab
from tests.support.sweeps import short_arm

LAW = cdsm.LinearElasticity(1e4)


class Reader(NamedTuple):
    """How a kind of file is read.

    Attributes:
        file: Its name in the folder of :func:`whole_files`.
        read: From its path to whatever it describes.
    """

    file: str
    read: Callable[[Path], Any]

    @property
    def kind(self) -> str:
        """What the file is written in."""
        return self.file.rsplit(".", 1)[-1].replace("urdf", "xml")


def _arm(arm: cdsm.Manipulator) -> cdsm.Stiffness:
    """What is read is used, too."""
    q = np.clip(np.full(arm.nv, 0.05), arm.lower, arm.upper)
    K = cdsm.stiffness(arm.at(q), np.full(len(arm.cables), 20.0))
    assert np.isfinite(K.joint).all()
    cdsm.to_mjcf(arm)
    return K


def _geometry(path: Path) -> cdsm.Stiffness:
    return _arm(cdsm.Manipulator(cdsm.Geometry.read(path), LAW))


def _elasticity(path: Path) -> None:
    law = cdsm.Elasticity.read(path)
    last = min(law.high, law.low + 1e3)
    F = np.linspace(law.low, last, 7)
    assert np.isfinite([law.rigidity(F), law.strain(F), law.energy(F)]).all()


def _tensile(path: Path) -> None:
    test = cdsm.read_tensile_csv(path)
    assert np.isfinite(test.displacement).all()
    assert np.isfinite(test.force).all()


def _sweep(path: Path) -> None:
    found = cdsm.read_sweep(path if path.suffix == ".nc" else path.parent)
    found.load()
    cdsm.write_sweep(found, path.with_name("again.csv"))


def _path(path: Path) -> None:
    found = read_path(path, short_arm())
    for array in (found.angles, found.tips, found.target):
        assert array is None or np.isfinite(array).all()


READERS: dict[str, Reader] = {
    "geometry": Reader("full.toml", _geometry),
    "short geometry": Reader("short.toml", _geometry),
    "arm": Reader("arm.toml", lambda path: _arm(cdsm.Manipulator.read(path))),
    "arm of a urdf": Reader("finger.toml", lambda path: _arm(cdsm.Manipulator.read(path))),
    "cables": Reader("cables.toml", lambda path: _arm(crab().with_cables(cdsm.read_cables(path)))),
    "linear wire": Reader("linear.toml", _elasticity),
    "strand": Reader("strand.toml", _elasticity),
    "table": Reader("table.toml", _elasticity),
    "urdf": Reader(
        "robot.urdf",
        lambda path: _arm(cdsm.Manipulator.from_urdf(path, crab().cables, tip="tip")),
    ),
    "caspr bodies": Reader(
        "toy_bodies.xml", lambda path: _arm(cdsm.read_caspr(path.parent, elasticity=LAW))
    ),
    "caspr cables": Reader(
        "toy_cables.xml", lambda path: _arm(cdsm.read_caspr(path.parent, elasticity=LAW))
    ),
    "tensile test": Reader("tensile.csv", _tensile),
    "path": Reader("path.csv", _path),
    "store": Reader("store/zarr.json", _sweep),
    "store of an array": Reader("store/status/zarr.json", lambda path: _sweep(path.parent)),
    "netcdf": Reader("sweep.nc", _sweep),
}
TEXTS = tuple(name for name, reader in READERS.items() if "store" not in name and name != "netcdf")


def whole_files(path: Path) -> Path:
    """Fill a folder with a whole file for every reader."""
    mixed_arm().geometry.write(path / "full.toml")
    (path / "short.toml").write_text(
        "[universal]\njoints = 5\ncables_per_joint = 3\nlink_length = 0.04\nbase_length = 0.02\n"
        "disk_offset = 0.01\nhole_radius = 0.03\nlink_mass = 0.5\n",
        encoding="utf-8",
    )
    mixed_arm().write(path / "arm.toml")
    crab().write(path / "finger.toml")
    cdsm.write_cables(crab().cables, path / "cables.toml")
    LAW.write(path / "linear.toml")
    cdsm.presets.STRAND_1X19.write(path / "strand.toml")
    table = cdsm.TabulatedElasticity((0.0, 20.0, 100.0, 300.0), (0.0, 2e-3, 5e-3, 9e-3))
    table.write(path / "table.toml")
    (path / "robot.urdf").write_text(TREE, encoding="utf-8")
    folder(path, link(1, "R_Y") + link(2, "U_XZ"), cable())
    rows = "\n".join(f"{0.01 * i:.3f},{3.0 * i:.2f}" for i in range(20))
    (path / "tensile.csv").write_text(
        f"# gauge_length = 500 mm\ndisplacement [mm],force [N]\n{rows}\n", encoding="utf-8"
    )
    joints = ",".join(f"{name} [deg]" for name in short_arm().joint_names)
    rows = "\n".join(",".join([str(i)] * short_arm().nv) + ",1.5" for i in range(6))
    (path / "path.csv").write_text(f"# a path\n{joints},target [N/mm]\n{rows}\n", encoding="utf-8")
    poses = cdsm.GridPoses({"joint1_1": [-0.1, 0.0, 0.1]})
    found = cdsm.sweep(short_arm(), poses, minimum=10.0, store=path / "store")
    cdsm.write_sweep(found, path / "sweep.nc")
    return path


# --- mutations ------------------------------------------------------------------------------

TOKENS = (
    *("nan", "inf", "-1", "1e400", "1e-320", "0", "0 0 0", "1 2", "9" * 25, "true", "é", "\n"),
    *('""', "<", ">", "&lt;", "&x;", "'", '"', "[", "]", "{", "}", "<!--", "-->", "<![CDATA["),
    *("=", ",", ";", "\t", "\r", "#", "[[", "]]", ".", "0x1", "1_0", "٣", "𝟛", "１"),
    *("revolute", "prismatic", "fixed", "continuous", "link", "name", "tip", "null", "mm"),
    *(b"\x00", b"\xff", b"\xfe\xff", b"\xef\xbb\xbf", b"\xed\xa0\x80", b"\x1a", b"\x85", b"\x0c"),
)
NUMBERS = (
    *("nan", "inf", "-1", "0", "1e300", "-1e300", "1e-300", "1e12", "x", "", " 1 1", "-0.0"),
    *("5e-324", "1e999", "0x10", "1e15", "1e16", "2147483648", "-9223372036854775809"),
)


def _bytes(token: str | bytes) -> bytes:
    return token.encode() if isinstance(token, str) else token


def shuffled(whole: bytes, rng: random.Random) -> bytes:
    """A few cuts, insertions, flipped bits, changed bytes and repeated pieces."""
    data = bytearray(whole)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8))):
        i = rng.randrange(len(data))
        what = rng.random()
        if what < 0.25:
            del data[i : i + rng.randrange(1, 12)]
        elif what < 0.5:
            data[i:i] = _bytes(rng.choice(TOKENS))
        elif what < 0.65:
            data[i] = rng.randrange(32, 127)
        elif what < 0.75:
            data[i] ^= 1 << rng.randrange(8)
        elif what < 0.8:
            del data[i:]
        else:
            j = rng.randrange(len(data))
            data[i:i] = data[j : j + rng.randrange(1, 60)]
        data = data or bytearray(b"x")
    return bytes(data)


def renumbered(whole: bytes, rng: random.Random) -> bytes:
    """One number replaced by one that is none, or too large, or too small."""
    found = rng.choice(list(re.finditer(rb"-?\d+\.?\d*(?:e-?\d+)?", whole)))
    return whole[: found.start()] + _bytes(rng.choice(NUMBERS)) + whole[found.end() :]


def rearranged(whole: bytes, rng: random.Random) -> bytes:
    """Lines or elements left out, doubled or exchanged."""
    parts = re.split(rb"(?<=[\n>,])", whole)
    i, j = rng.randrange(len(parts)), rng.randrange(len(parts))
    what = rng.random()
    if what < 0.3:
        del parts[i]
    elif what < 0.6:
        parts.insert(j, parts[i])
    else:
        parts[i], parts[j] = parts[j], parts[i]
    return b"".join(parts)


MUTATIONS = {each.__name__: each for each in (shuffled, renumbered, rearranged)}

# --- attacks --------------------------------------------------------------------------------

_DEEP = 100_000
_LARGE = MAXIMUM_BYTES - 4096  # just not too large to be read


def attacks(whole: bytes, kind: str) -> Iterator[tuple[str, bytes]]:
    """What files of a kind are attacked with, by name."""
    yield "empty", b""
    yield "blank", b" \n\t\n"
    for part in range(1, 24):
        yield f"cut at {part}/24", whole[: part * len(whole) // 24]
    yield "nothing but NUL", bytes(100_000)
    yield "noise", random.Random(1).randbytes(100_000)
    yield "20 MB on one line", b"a" * 20_000_000
    yield "as large as can be", b"a" * _LARGE
    yield "twice", whole + whole
    yield "20 MB of white space", b" " * 20_000_000
    if kind == "nc":
        for start in range(0, len(whole), max(1, len(whole) // 200)):
            yield f"ones at {start}", whole[:start] + b"\xff" * 8 + whole[start + 8 :]
        return
    text = whole.decode()
    for encoding in ("utf-16", "utf-16-le", "utf-32", "utf-7", "utf-8-sig", "cp500"):
        yield encoding, text.encode(encoding)
    yield "latin-1", "é".encode("latin-1") + whole
    yield "NUL bytes", whole.replace(b"\n", b"\x00\n", 3)
    yield "CRLF", text.replace("\n", "\r\n").encode()
    yield "CR", text.replace("\n", "\r").encode()
    yield from {"toml": _toml, "xml": _xml, "csv": _csv, "json": _json}[kind](whole)


def _toml(whole: bytes) -> Iterator[tuple[str, bytes]]:
    number = re.search(rb"= *\[?\s*(-?\d+\.\d+)", whole)
    assert number is not None
    at, end = number.span(1)
    for what, value in {
        "nested arrays": b"[" * _DEEP + b"]" * _DEEP,
        "nested tables": b"{a=" * _DEEP + b"1" + b"}" * _DEEP,
        "a long integer": b"9" * 100_000,
        "a long hexadecimal integer": b"0x" + b"f" * 100_000,
        "a long float": b"1." + b"9" * 1_000_000,
        "a large exponent": b"1e999999999",
        "a text of 9 MB": b'"' + b"a" * (_LARGE - len(whole)) + b'"',
        "a date": b"1979-05-27T07:32:00Z",
        "a time": b"07:32:00",
        "infinite": b"inf",
        "nan": b"nan",
        "a million numbers": b"[" + b"1," * 1_000_000 + b"]",
        "a table": b"{}",
        "true": b"true",
    }.items():
        yield what, whole[:at] + value + whole[end:]
    yield "dotted keys", whole + b"\n" + b".".join([b"a"] * _DEEP) + b" = 1\n"
    yield "dotted headers", whole + b"\n[" + b".".join([b"a"] * _DEEP) + b"]\n"
    yield "dotted keys in front", b".".join([b"a"] * _DEEP) + b" = 1\n" + whole
    yield "many keys", b"".join(b"k%d = 1\n" % i for i in range(300_000)) + whole
    yield "a key of 9 MB", b"k" * (_LARGE - len(whole) - 10) + b" = 1\n" + whole
    tables = b"".join(b"[[cables]]\nname = 'c%d'\n" % i for i in range(100_000))
    yield "many tables", whole + b"\n" + tables
    yield "a key twice", re.sub(rb"(?m)^(\w+ = .*)$", rb"\1\n\1", whole, count=1)
    yield "a header twice", re.sub(rb"(?m)^(\[[^\n]*\])$", rb"\1\n\1", whole, count=1)


def _xml(whole: bytes) -> Iterator[tuple[str, bytes]]:
    body = re.sub(rb"<\?xml[^>]*\?>|<!DOCTYPE[^>]*>", b"", whole).strip()
    found = re.match(rb"<(\w+)", body)
    assert found is not None
    root, inside = found[1], found.end()

    def filled(more: bytes) -> bytes:
        start = body.index(b">") + 1
        return body[:start] + more + body[start:]

    laughs = b"".join(b'<!ENTITY l%d "%s">' % (i, b"&l%d;" % (i - 1) * 10) for i in range(1, 12))
    blow = b'<!ENTITY l "%s">' % (b"x" * 100_000)
    for what, doctype, use in (
        ("billion laughs", b'<!ENTITY l0 "ha">' + laughs, b"&l11;"),
        ("quadratic blow-up", blow, b"&l;" * 50_000),
        ("a file as entity", b'<!ENTITY x SYSTEM "file:///etc/passwd">', b"&x;"),
        ("a page as entity", b'<!ENTITY x SYSTEM "http://127.0.0.1:9/x">', b"&x;"),
        ("a parameter entity", b'<!ENTITY % x SYSTEM "file:///dev/zero"> %x;', b""),
        ("recursive entities", b'<!ENTITY a "&b;"><!ENTITY b "&a;">', b"&a;"),
        ("default attributes", b'<!ATTLIST link name CDATA "x">', b""),
    ):
        yield what, b"<!DOCTYPE %s [%s]>" % (root, doctype) + filled(use)
    yield "a DTD", b'<!DOCTYPE %s SYSTEM "file:///dev/zero">' % root + body
    yield "a public DTD", b'<!DOCTYPE %s PUBLIC "x" "http://127.0.0.1:9/x">' % root + body
    yield "nested elements", filled(b"<a>" * _DEEP + b"</a>" * _DEEP)
    yield "nested and open", filled(b"<a>" * _DEEP)
    yield "nested a little", filled(b"<a>" * 200 + b"</a>" * 200)
    yield "many elements", filled(b"<a/>" * 1_000_000)
    yield "many links", filled(b"".join(b'<link name="n%d"/>' % i for i in range(300_000)))
    yield "many equal links", filled(b'<link name="n"/>' * 300_000)
    yield (
        "many attributes",
        filled(b"<a " + b" ".join(b'a%d=""' % i for i in range(300_000)) + b"/>"),
    )
    yield "a name of 9 MB", filled(b'<link name="%s"/>' % (b"n" * (_LARGE - len(whole) - 100)))
    yield "a tag of 9 MB", filled(b"<%s/>" % (b"n" * (_LARGE - len(whole) - 100)))
    yield "a text of 9 MB", filled(b"n" * (_LARGE - len(whole) - 100))
    yield "a comment of 9 MB", filled(b"<!--%s-->" % (b"n" * (_LARGE - len(whole) - 100)))
    yield "an instruction of 9 MB", filled(b"<?a %s?>" % (b"n" * (_LARGE - len(whole) - 100)))
    yield (
        "XInclude",
        filled(b'<x:include xmlns:x="http://www.w3.org/2001/XInclude" href="/etc/passwd"/>'),
    )
    yield "another namespace", body[:inside] + b' xmlns="urn:x"' + body[inside:]
    yield "an attribute twice", body[:inside] + b' name="a" name="b"' + body[inside:]
    for encoding in (b"utf-16", b"ebcdic-cp-us", b"utf-7", b"no-such"):
        yield f"says {encoding.decode()}", b'<?xml version="1.0" encoding="%s"?>' % encoding + body
    for child in re.findall(rb"<(link|joint|link_rigid|cable_ideal|cable_set)\b", body)[:1]:
        part = re.search(rb"<%s\b.*?(?:</%s>|/>)" % (child, child), body, re.DOTALL)
        assert part is not None
        count = (_LARGE - len(body)) // len(part[0])
        yield (
            "one element many times",
            body[: part.start()] + part[0] * count + body[part.start() :],
        )


def _csv(whole: bytes) -> Iterator[tuple[str, bytes]]:
    head, rest = whole.rsplit(b"\n", 3)[0], b"\n1,2,3\n"
    yield "a cell of 200 kB", head + b"\n" + b"1" * 200_000 + rest
    yield "a cell of 9 MB", head + b"\n" + b"1" * (_LARGE - len(head) - 20) + rest
    yield "a quoted cell of 9 MB", head + b'\n"' + b"1" * (_LARGE - len(head) - 20) + b'"' + rest
    yield "an open quote", head + b'\n"1,2' + rest * 10
    yield "many columns", head + b"\n" + b"1," * 4_000_000 + rest
    yield "many rows", head + rest[:-1] * 1_000_000
    yield "many columns in front", b"displacement [mm]," * 500_000 + b"\n" + whole
    yield "many blank lines", b"\n" * 5_000_000 + whole
    yield "many comments", b"# gauge_length = 1 mm\n" * 400_000 + whole
    yield "a comment of 9 MB", b"#" + b"gauge length " * 700_000 + b"\n" + whole
    yield "a comment of digits", b"# gauge length = " + b"1" * 5_000_000 + b"\n" + whole
    yield "a comment of blanks", b"# gauge length" + b" " * 5_000_000 + b"\n" + whole
    yield "a header of brackets", b"[" * 5_000_000 + b"\n" + whole
    yield "a header of blanks", b"x" + b" " * 300_000 + b"x,y\n" + whole
    yield "a header of underscores", b"force" + b"_" * 100_000 + b" ,displacement [mm]\n1,2\n"
    yield "a second header of brackets", head.split(b"\n")[0] + b"\n(" + b" " * 100_000 + b"1,2\n"
    yield "underscores in numbers", head + b"\n1_0,2_0,3_0\n"
    yield "other digits", head + "\n١,٢,٣\n".encode()
    yield "strange ends of line", whole.replace(b"\n", "\u2028".encode())


def _json(whole: bytes) -> Iterator[tuple[str, bytes]]:
    yield "nested lists", b"[" * _DEEP + b"]" * _DEEP
    yield "nested objects", b'{"a":' * _DEEP + b"1" + b"}" * _DEEP
    yield "null", b"null"
    yield "a list", b"[]"
    yield "a number", b"1e999"
    yield "no attributes", re.sub(rb'"attributes"', b'"attribute"', whole)
    for key in (b"shape", b"chunk_shape", b"flag_values", b"order", b"flag_meanings"):
        for value in (b"[1000000000000000]", b"[-1]", b"[]", b"1", b"null", b'"x"', b'["a", "b"]'):
            yield (
                f"{key.decode()} {value.decode()}",
                re.sub(rb'"%s": *(\[[^\]]*\]|"[^"]*")' % key, b'"%s": %s' % (key, value), whole),
            )


# --- reading them ---------------------------------------------------------------------------


def outcome(reader: Reader, path: Path) -> str:
    """``read``, or the error of the library's own that a file is refused with."""
    try:
        reader.read(path)
    except cdsm.CdsmError as error:
        text = str(error)
        assert len(text.split()) > 3, text
        assert len(text) < 20_000, f"a message of {len(text)} characters: {text[:300]}"
        return type(error).__name__
    return "read"


SECONDS = 120
"""Of the processor in which any file is to be read or refused; the slowest takes a fifteenth."""


def _too_long(*_: object) -> None:
    raise TimeoutError(f"not read after {SECONDS} s")


def limit_memory() -> None:
    """Leave this process 1 GB to spare."""
    size = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    limit = size * os.sysconf("SC_PAGE_SIZE") + 2**30
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def main(where: str, largest: str, *names: str) -> None:
    """Read all attacks on some readers, and tell what became of each as a line of JSON."""
    warnings.simplefilter("error")
    warnings.simplefilter("ignore", cdsm.CdsmWarning)
    path = Path(where)
    signal.signal(signal.SIGPROF, _too_long)
    limit_memory()
    for name in names or tuple(READERS):
        reader = READERS[name]
        whole = (path / reader.file).read_bytes()
        for attack, data in attacks(whole, reader.kind):
            if len(data) > int(largest):
                continue
            (path / reader.file).write_bytes(data)
            start = time.process_time()
            signal.setitimer(signal.ITIMER_PROF, SECONDS)
            try:
                result = outcome(reader, path / reader.file)
            except BaseException as error:  # that is what is looked for
                result = f"FAULT {type(error).__name__}: {str(error)[:300]}"
            signal.setitimer(signal.ITIMER_PROF, 0)
            took = time.process_time() - start
            line = {"reader": name, "attack": attack, "result": result, "seconds": took}
            print(json.dumps(line), flush=True)
        (path / reader.file).write_bytes(whole)


if __name__ == "__main__":
    main(*sys.argv[1:])
