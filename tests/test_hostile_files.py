"""Files that were cut, shuffled and poisoned: an error of ours, or numbers, and nothing else."""

import random
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import cdsm
from tests.foreign import TREE, crab
from tests.test_caspr import cable, folder, link

TOKENS = (
    *("nan", "inf", "-1", "1e400", "1e-320", "0", "0 0 0", "1 2", "9" * 25, "true", "é", "\n", "="),
    *('""', "<", ">", "&lt;", "&x;", "'", '"', "[", "]", "{", "}", "<!--", "-->", "<![CDATA["),
    *("revolute", "prismatic", "fixed", "continuous", "link", "name", "tip"),
)
NUMBERS = ("nan", "inf", "-1", "0", "1e300", "-1e300", "1e-300", "1e12", "x", "", " 1 1", "-0.0")
CASES = 120
"""Of each kind of file; thousands were tried by hand."""


def shuffled(text: str, rng: random.Random) -> str:
    """A few cuts, insertions, changed letters and repeated pieces."""
    letters = list(text)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8))):
        i = rng.randrange(len(letters))
        what = rng.random()
        if what < 0.3:
            del letters[i : i + rng.randrange(1, 12)]
        elif what < 0.6:
            letters[i:i] = rng.choice(TOKENS)
        elif what < 0.8:
            letters[i] = chr(rng.randrange(32, 127))
        else:
            j = rng.randrange(len(letters))
            letters[i:i] = letters[j : j + rng.randrange(1, 60)]
        letters = letters or ["x"]
    return "".join(letters)


def renumbered(text: str, rng: random.Random) -> str:
    """One number replaced by one that is none, or too large, or too small."""
    found = rng.choice(list(re.finditer(r"-?\d+\.?\d*", text)))
    return text[: found.start()] + rng.choice(NUMBERS) + text[found.end() :]


def read_urdf(text: str, path: Path) -> cdsm.Manipulator:
    (path / "robot.urdf").write_text(text, encoding="utf-8")
    return cdsm.Manipulator.from_urdf(path / "robot.urdf", crab().cables, tip="tip")


def read_cables(text: str, path: Path) -> cdsm.Manipulator:
    (path / "cables.toml").write_text(text, encoding="utf-8")
    return crab().with_cables(cdsm.read_cables(path / "cables.toml"))


def read_bodies(text: str, path: Path) -> cdsm.Manipulator:
    (path / "toy_bodies.xml").write_text(text, encoding="utf-8")
    return cdsm.read_caspr(path, elasticity=cdsm.LinearElasticity(1e4))


def read_caspr_cables(text: str, path: Path) -> cdsm.Manipulator:
    (path / "toy_cables.xml").write_text(text, encoding="utf-8")
    return cdsm.read_caspr(path, elasticity=cdsm.LinearElasticity(1e4))


KINDS: dict[str, Callable[[str, Path], cdsm.Manipulator]] = {
    "robot.urdf": read_urdf,
    "cables.toml": read_cables,
    "toy_bodies.xml": read_bodies,
    "toy_cables.xml": read_caspr_cables,
}


@pytest.mark.parametrize("change", [shuffled, renumbered])
@pytest.mark.parametrize("name", KINDS)
def test_spoilt_files_are_refused_or_read(
    name: str, change: Callable[[str, random.Random], str], tmp_path: Path
) -> None:
    folder(tmp_path, link(1, "R_Y") + link(2, "U_XZ"), cable())
    (tmp_path / "robot.urdf").write_text(TREE, encoding="utf-8")
    cdsm.write_cables(crab().cables, tmp_path / "cables.toml")
    whole = (tmp_path / name).read_text(encoding="utf-8")
    rng = random.Random(f"{name} {change.__name__}")
    read = refused = 0
    for _ in range(CASES):
        try:
            arm = KINDS[name](change(whole, rng), tmp_path)
            q = np.clip(np.full(arm.nv, 0.05), arm.lower, arm.upper)
            K = cdsm.stiffness(arm.at(q), np.full(len(arm.cables), 20.0))
            assert np.isfinite(K.joint).all()
            cdsm.to_mjcf(arm)
            read += 1
        except cdsm.CdsmError:
            refused += 1
    assert read + refused == CASES
    assert refused > CASES // 4  # the changes do spoil something
    assert read > 0  # and not everything
