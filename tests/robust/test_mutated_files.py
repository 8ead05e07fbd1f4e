"""Files that were cut, shuffled and renumbered: an error of ours, or numbers, and nothing else."""

import random
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.cli.options import read_path
from tests.interchange.test_caspr import cable, folder, link
from tests.support.arms import mixed_arm
from tests.support.foreign import TREE, crab
from tests.support.sweeps import short_arm

LAW = cdsm.LinearElasticity(1e4)


def _arm(arm: cdsm.Manipulator) -> cdsm.Stiffness:
    """What is read is used, too."""
    q = np.clip(np.full(arm.nv, 0.05), arm.lower, arm.upper)
    K = cdsm.stiffness(arm.at(q), np.full(len(arm.cables), 20.0))
    assert np.isfinite(K.joint).all()
    cdsm.to_mjcf(arm)
    return K


def _elasticity(path: Path) -> None:
    law = cdsm.Elasticity.read(path)
    last = min(law.high, law.low + 1e3)
    F = np.linspace(law.low, last, 7)
    assert np.isfinite([law.rigidity(F), law.strain(F), law.energy(F)]).all()


def _tensile(path: Path) -> None:
    test = cdsm.read_tensile_csv(path)
    assert np.isfinite([test.displacement, test.force]).all()


def _path(path: Path) -> None:
    found = read_path(path, short_arm())
    for array in (found.angles, found.tips, found.target):
        assert array is None or np.isfinite(array).all()


def _caspr(path: Path) -> cdsm.Stiffness:
    return _arm(cdsm.read_caspr(path.parent, elasticity=LAW))


READERS: dict[str, Callable[[Path], Any]] = {
    "full.toml": lambda path: _arm(cdsm.Manipulator(cdsm.Geometry.read(path), LAW)),
    "arm.toml": lambda path: _arm(cdsm.Manipulator.read(path)),
    "finger.toml": lambda path: _arm(cdsm.Manipulator.read(path)),
    "cables.toml": lambda path: _arm(crab().with_cables(cdsm.read_cables(path))),
    "linear.toml": _elasticity,
    "strand.toml": _elasticity,
    "table.toml": _elasticity,
    "robot.urdf": lambda path: _arm(cdsm.Manipulator.from_urdf(path, crab().cables, tip="tip")),
    "toy_bodies.xml": _caspr,
    "toy_cables.xml": _caspr,
    "tensile.csv": _tensile,
    "path.csv": _path,
}
"""How each of the :func:`whole_files` is read, from its path to whatever it describes."""


def whole_files(path: Path) -> Path:
    """Fill a folder with a whole file for every reader."""
    mixed_arm().geometry.write(path / "full.toml")
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
    return path


TOKENS = [
    *b'nan inf -1 1e400 1e-320 0 999999999999999999999999 true "" < > &lt; &x; [ ] { } [['.split(),
    *b"= , ; # . ]] 0x1 1_0 revolute fixed link name tip null mm <!-- --> <![CDATA[ ' ".split(),
    *(token.encode() for token in ("é", "\n", "\t", "\r", "0 0 0", "٣", "𝟛", "１")),
    *(b"\x00", b"\xff", b"\xfe\xff", b"\xef\xbb\xbf", b"\xed\xa0\x80", b"\x1a", b"\x85", b"\x0c"),
]
NUMBERS = [
    *b"nan inf -1 0 1e300 -1e300 1e-300 1e12 x -0.0 5e-324 1e999 0x10 1e15 1e16".split(),
    *(b"", b" 1 1", b"2147483648", b"-9223372036854775809"),
]


def renumbered(whole: bytes, rng: random.Random) -> bytes:
    """One number replaced by one that is none, or too large, or too small."""
    found = rng.choice(list(re.finditer(rb"-?\d+\.?\d*(?:e-?\d+)?", whole)))
    return whole[: found.start()] + rng.choice(NUMBERS) + whole[found.end() :]


def shuffled(whole: bytes, rng: random.Random) -> bytes:
    """A few cuts, insertions, flipped bits and repeated pieces."""
    data = bytearray(whole)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8))):
        i, j = rng.randrange(len(data)), rng.randrange(len(data))
        match rng.randrange(5):
            case 0:
                del data[i : i + rng.randrange(1, 12)]
            case 1:
                data[i:i] = rng.choice(TOKENS)
            case 2:
                data[i] ^= 1 << rng.randrange(8)
            case 3:
                data[i:i] = data[j : j + rng.randrange(1, 60)]
            case _:
                del data[i + len(data) // 4 :]
        data = data or bytearray(b"x")
    return bytes(data)


def rearranged(whole: bytes, rng: random.Random) -> bytes:
    """Lines or elements left out, doubled or exchanged."""
    parts = re.split(rb"(?<=[\n>,])", whole)
    i, j = rng.randrange(len(parts)), rng.randrange(len(parts))
    parts[i], parts[j] = rng.choice(
        ((b"", parts[j]), (parts[i], parts[i] + parts[j]), (parts[j], parts[i]))
    )
    return b"".join(parts)


MUTATIONS = (shuffled, renumbered, rearranged)
FILES = 75
"""Files of each kind."""


@pytest.mark.parametrize("name", READERS)
def test_mutated_files_are_refused_or_read(name: str, tmp_path: Path) -> None:
    path = whole_files(tmp_path) / name
    whole, rng, read = path.read_bytes(), random.Random(f"{name} 1"), 0
    for i in range(FILES):
        path.write_bytes(MUTATIONS[i % len(MUTATIONS)](whole, rng))
        with suppress(cdsm.CdsmError):  # and no other error
            READERS[name](path)
            read += 1
    # the changes do spoil something, and not everything
    assert FILES > read > 0
