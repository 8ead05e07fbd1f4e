"""Jobs: the command line, the paper, public names and signatures."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import importlib
import inspect
import io
import json
import os
import re
import runpy
import sys
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import Any

from tests.campaigns.snapshot.entries import attempt, clean
from tests.campaigns.snapshot.environment import Named, cdsm
from tests.campaigns.snapshot.jobs import job, slow
from tests.campaigns.snapshot.models import (
    caspr,
    laws,
    tree,
    tree_cables,
)

COMMANDS: tuple[str, ...] = ("urdf", "stiffness", "check", "weigh", "buckle", "plan", "sweep")
COMMANDS += ("map", "view", "fit", "export", "reproduce")
COMMANDS += ("new", "cycle", "design", "track", "identify", "warm")


def command(*words: Any) -> str:
    """Exit code, output and errors of ``python -m cdsm``, run in this process."""
    streams = [io.TextIOWrapper(io.BytesIO(), encoding="utf-8") for _ in range(2)]
    before = sys.argv
    sys.argv = ["cdsm", *map(str, words)]
    try:
        with contextlib.redirect_stdout(streams[0]), contextlib.redirect_stderr(streams[1]):
            try:
                runpy.run_module("cdsm", run_name="__main__", alter_sys=True)
                code: object = 0
            except SystemExit as left:
                code = left.code or 0
            except Exception as error:
                code = f"{type(error).__name__}: {error}"
    finally:
        sys.argv = before
    told = []
    for stream in streams:
        stream.flush()
        told.append(stream.buffer.getvalue().decode())
    return f"exit code {code}\n--- stdout\n{told[0]}\n--- stderr\n{told[1]}"


@job
def helps() -> Named:
    for name in COMMANDS:
        yield name, command(name, "--help")
    yield "cdsm", command("--help")
    yield "version", command("--version")
    yield "nothing", command()


PROBE = """wire = "1x19-1.2mm"

[universal]
name = "probe"
joints = 3
cables_per_joint = 3
link_length = 0.05
base_length = 0.02
disk_offset = 0.01
hole_radius = 0.02
link_mass = 0.1
"""

RUNS = """
urdf probe.toml -o probe.urdf
urdf probe.toml -o absent/probe.urdf
export probe.toml --angles 5 --mjcf probe.xml --cables-out cables.toml --rigidity 48000
export probe.toml
export probe.toml --mjcf soft.xml --angles 5 --rigidity 1e9 --spring 0.2 --min-tension 60 --json
stiffness probe.toml
stiffness probe.toml --angles 5 --gravity 0,0,0
stiffness probe.toml --angles 10,-5,8,0,3,12 --min-tension 30 --wrench 1,0,-2,0,0.1,0 --json
stiffness probe.urdf --tip tool0 --cables cables.toml --angles 4,3,2,1,2,3
stiffness probe.urdf --cables cables.toml
stiffness crab.urdf --tip tip --cables crab.toml --angles 20
check crab.urdf --tip tip --cables crab.toml --angles 20 --min-tension 20
stiffness R_Z_U_XY --rigidity 20000
stiffness absent.toml
stiffness probe.toml --angles 80
stiffness probe.toml --angles ten
stiffness probe.toml --angles 1,2
stiffness probe.toml --min-tension 1
stiffness probe.toml --solver dapq
stiffness probe.toml --max-tension 10 --wrench 0,0,-90,0,0,0
stiffness probe.toml --wire wire.toml --rigidity 3
stiffness probe.toml --wire wire.toml --angles 6 --spring 20
check probe.toml --angles 8 --min-tension 40 --html report.html
check probe.toml --angles 8 --min-tension 31 --json
weigh probe.toml --angles 8 --force 0,0,-3 --steps 3 --min-tension 30 --figure weigh.png
weigh probe.toml --angles 8 --force 0,0,-3 --min-tension 30 --json
weigh probe.toml --force 0,0,0
buckle probe.toml --angles 5 --rigidity 1e9 --spring 2.5 --min-tension 3 --load -1,0,0,0,0,0
buckle probe.toml --angles 5 --rigidity 1e9 --spring 2.5 --json
buckle probe.toml --min-tension 20
plan probe.toml --angles 8 --direction 0,0,2 --target 45 --min-tension 30 --max-tension 400
plan probe.toml --angles 8 --direction 0,0,2 --target 45 --min-tension 30 --json --out plan.csv
plan probe.toml --direction 0,0,1 --target 9e9
plan probe.toml --path tips.csv --direction 0,0,1 --rate 8 -o path.csv
plan probe.toml --path bad.csv --direction 0,0,1 --target 20
sweep probe.toml --random 20 -o sweep.nc
sweep probe.toml --grid joint1_1=-20:20:3,joint2_1=5 --min-tension 10,40 -o sweep.csv
sweep probe.toml --grid nothing=1:2:3 -o other.nc
sweep probe.toml --grid joint1_1=-20:20:3 --quantities wire_safety --breaking-load 900 -o wire.csv
map sweep.nc -o map.png --json
map sweep.nc -o map.png --quantity nonsense
fit test.csv --gauge-length 500 -o fitted.toml
fit test.csv --gauge-length 500 --json
fit test.csv --method polynomial
fit bad.csv
new fresh.toml --universal 3
new fresh.toml --sections 2,3 --wire 48e3 --overwrite --json
new probe.toml --hinged 2
check fresh.toml --angles 5 --min-tension 30
stiffness probe.toml --angles 5 --friction 0.1 --min-tension 30 --tolerances sure.toml
stiffness probe.toml --angles 5 --friction 0.1 --min-tension 30 --tolerances sure.toml --json
cycle probe.toml --angles 5 --friction 0.1 --force 0,0,-2 --min-tension 30 --steps 3 -o cycle.csv
cycle probe.toml --angles 5 --force 0,0,-2 --min-tension 30 --steps 3 --figure cycle.txt
view absent.toml
view probe.toml --port nowhere
reproduce --out probe.toml
nonsense
--debug stiffness probe.toml --angles 80
"""


@job
def cli() -> Named:
    Path("probe.toml").write_text(PROBE)
    Path("crab.urdf").write_text(tree())
    Path("tips.csv").write_text(
        "x [mm], y [mm], z [mm], target [N/m]\n160,10,-20,20e3\n160,10,-21,21e3\n"
    )
    Path("sure.toml").write_text("rigidity = 0.05\nlead = 1e-3\n")
    Path("bad.csv").write_text("x [mm],y [mm],z [mm]\n1,2,3\n\n1,two,3\n")
    rows = "".join(f"{F / 96.0!r},{float(F)!r}\n" for F in range(2, 400, 7))
    Path("test.csv").write_text("displacement [mm],force [N]\n" + rows)
    laws()["table"].write("wire.toml")
    cdsm.write_cables(tree_cables(laws()["linear"]), "crab.toml")
    caspr(("R_Z", "U_XY"))
    given = set(os.listdir())
    for line in RUNS.strip().splitlines():
        yield line, command(*line.split())
    for name in sorted(set(os.listdir()) - given):
        data = Path(name).read_bytes()
        if Path(name).suffix in (".csv", ".toml", ".urdf", ".xml", ".html"):
            yield f"file {name}", data.decode()
        else:  # NetCDF holds its own times
            yield f"file {name}", "NetCDF" if name.endswith(".nc") else digest(data)


def digest(data: bytes) -> str:
    return f"{len(data)} bytes, {hashlib.sha256(data).hexdigest()}"


@slow
def reproduction() -> Named:
    yield "run", command("reproduce", "--out", "out")
    for path in sorted(Path("out").iterdir()):
        if path.suffix == ".json":
            yield path.name, json.loads(path.read_text())
        else:
            yield path.name, path.read_text() if path.suffix == ".md" else digest(path.read_bytes())


@slow
def paper() -> Named:
    module = importlib.import_module("cdsm.paper")
    results = [module.FIGURES[name]() for name in ("fig3", "fig4", "lead", "fig5", "fig6", "fig7")]
    yield "results", results
    for name in ("to_rows", "to_dict", "to_markdown"):
        yield name, attempt(getattr(module, name), results)


def signature(function: Any) -> str:
    """Kinds, names, types and defaults, without modules and without private parameters."""
    found = attempt(inspect.signature, function)
    if isinstance(found, Exception):
        return "no signature"

    def words(kind: Any) -> str:
        text = kind if isinstance(kind, str) else getattr(kind, "__name__", str(kind))
        return re.sub(r"(?:\b[A-Za-z_]\w*\.)+(?=[A-Za-z_])", "", text)

    told = []
    for each in found.parameters.values():
        if each.name.startswith("_"):
            continue
        default = "" if each.default is each.empty else f" = {clean(repr(each.default))}"
        kind = "" if each.annotation is each.empty else f": {words(each.annotation)}"
        told.append(f"{each.kind.description} {each.name}{kind}{default}")
    end = found.return_annotation
    return "\n".join([*told, f"-> {'?' if end is found.empty else words(end)}"])


def listed(module: Any) -> list[str]:
    """Names that a module lists; or its constants, and the functions that it defines."""
    own = [
        name
        for name, value in vars(module).items()
        if name.isupper() or str(getattr(value, "__module__", "")).startswith(module.__name__)
    ]
    return sorted(getattr(module, "__all__", own))


@job
def names() -> Named:
    for path in ("cdsm", "cdsm.plots", "cdsm.paper", "cdsm.presets", "cdsm.planning", "cdsm.batch"):
        module = attempt(importlib.import_module, path)
        yield f"{path} module", module
        if isinstance(module, Exception):
            continue
        yield f"{path} module doc", bool(module.__doc__)
        yield f"{path} names", ", ".join(listed(module))
        for name in listed(module):
            value = getattr(module, name)
            yield from described(f"{path}.{name}", value)
            if not callable(value):
                yield f"{path}.{name} value", value


def described(path: str, value: Any) -> Named:
    """Signature, bases, fields and members of something public."""
    yield path, signature(value) if callable(value) else type(value).__name__
    yield f"{path} doc", bool(getattr(value, "__doc__", None))
    if not inspect.isclass(value):
        return
    yield f"{path} bases", ", ".join(b.__name__ for b in value.__mro__ if b.__name__[0] != "_")
    if dataclasses.is_dataclass(value):
        fields = [field for field in dataclasses.fields(value) if field.name[0] != "_"]
        yield f"{path} fields", "\n".join(f"{f.name} {f.init} {f.kw_only}" for f in fields)
    if issubclass(value, Enum):
        yield f"{path} values", ", ".join(f"{each.name} = {each.value}" for each in value)
    for name in sorted(dir(value)):
        if name[0] == "_" or issubclass(value, int):
            continue
        member = inspect.getattr_static(value, name)
        if isinstance(member, (property, cached_property)):
            function = member.fget if isinstance(member, property) else member.func
            yield f"{path}.{name}", f"property {signature(function)}"
        else:
            member = getattr(value, name)
            yield f"{path}.{name}", signature(member) if callable(member) else "attribute"
        yield f"{path}.{name} doc", bool(inspect.getdoc(getattr(value, name)))
