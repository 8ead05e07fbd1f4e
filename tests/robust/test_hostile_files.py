"""Files that were cut, shuffled and poisoned: an error of ours, or numbers, and nothing else.

Here are a few of each kind, always the same; ``python -m tests.campaigns.mutated`` reads
a hundred thousand and counts what became of them. All attacks by name, the largest included::

    pytest -m long -s tests/robust/test_hostile_files.py
"""

import json
import os
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

import cdsm
from tests.campaigns.hostile import MUTATIONS, READERS, SECONDS, TEXTS, outcome, whole_files
from tests.campaigns.mutated import read, spoilt
from tests.support.patience import HANGS

SHORT = 25
"""Files of each kind and mutation; a store takes far longer to read than a text."""


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return whole_files(tmp_path_factory.mktemp("whole"))


@pytest.fixture
def folder(files: Path, tmp_path: Path) -> Path:
    """A folder of whole files, to be spoilt."""
    return Path(shutil.copytree(files, tmp_path / "spoilt"))


@pytest.mark.parametrize("name", TEXTS)
def test_mutated_files_are_refused_or_read(name: str, folder: Path) -> None:
    assert_some_are_read(Counter(spoilt(name, folder, SHORT * len(MUTATIONS), seed=1)))


@pytest.mark.parametrize("name", ["store", "store of an array"])
def test_mutated_stores_are_refused_or_read(name: str, folder: Path) -> None:
    assert_some_are_read(Counter(spoilt(name, folder, SHORT // 2, seed=1)))


@pytest.mark.slow
def test_mutated_netcdf_is_refused_or_read_and_crashes_nothing() -> None:
    # a process of its own reads it: netCDF's library is C
    assert_some_are_read(read("netcdf", 1, SHORT))


def assert_some_are_read(counts: Counter[str]) -> None:
    assert [what for what in counts if what.startswith("FAULT")] == []
    # the changes do spoil something, and not everything
    assert counts.total() > counts["read"] > 0


# --- attacks by name ------------------------------------------------------------------------


def attacked(folder: Path, largest: int, *names: str) -> list[dict[str, str]]:
    """What became of each attack, read one after the other by a process with 1 GB to spare."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.campaigns.hostile", str(folder), str(largest), *names],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        timeout=HANGS,
        check=False,
    )
    lines = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    last = lines[-1] if lines else "nothing"
    assert done.returncode == 0, f"ended with {done.returncode} after {last}: {done.stderr[-2000:]}"
    return lines


def assert_refused_or_read(results: list[dict[str, str]]) -> None:
    for each in results:
        assert not each["result"].startswith("FAULT"), each
        assert float(each["seconds"]) < SECONDS, each


@pytest.mark.slow
def test_billion_laughs_entities_and_deep_nesting_are_refused(folder: Path) -> None:
    results = attacked(folder, 1_500_000, "linear wire", "urdf")
    assert_refused_or_read(results)
    found = {each["attack"]: each["result"] for each in results if each["reader"] == "urdf"}
    refused = [
        *("billion laughs", "quadratic blow-up", "a file as entity", "a page as entity", "a DTD"),
        *("a parameter entity", "recursive entities", "a public DTD", "nested elements", "empty"),
        *("nested and open", "utf-32", "noise"),
    ]
    assert {name: found[name] for name in refused if found[name] == "read"} == {}


@pytest.mark.long
@pytest.mark.parametrize("name", READERS)
def test_every_reader_stands_every_attack(name: str, folder: Path) -> None:
    results = attacked(folder, 50_000_000, name)
    assert_refused_or_read(results)
    slowest = max(results, key=lambda each: float(each["seconds"]))
    counts = Counter(each["result"] for each in results)
    print(f"\n{name}: {len(results)} attacks, {dict(counts)}, slowest {slowest}")


@pytest.mark.parametrize("name", TEXTS)
def test_what_is_no_file_is_refused_and_not_waited_for(name: str, folder: Path) -> None:
    path = folder / READERS[name].file

    def refused() -> None:
        assert outcome(READERS[name], path) == "FileError"

    path.unlink()
    os.mkfifo(path)
    refused()  # nobody writes to the pipe
    path.unlink()
    for target in (path, Path("/dev/zero"), Path("/dev/full"), folder, Path("/no/such/file")):
        path.symlink_to(target)  # the first is a link to itself
        refused()
        path.unlink()


def test_a_sweep_is_no_pipe_and_no_device(tmp_path: Path) -> None:
    pipe = tmp_path / "sweep.nc"
    os.mkfifo(pipe)
    for path in (pipe, Path("/dev/zero"), Path("/dev/null")):
        with pytest.raises(cdsm.FileError):
            cdsm.read_sweep(path)


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is unreadable to root")
def test_a_file_that_may_not_be_read_is_named(folder: Path) -> None:
    for name in TEXTS:
        path = folder / READERS[name].file
        path.chmod(0)
        assert outcome(READERS[name], path) == "FileError"


# --- what could crash Pinocchio -------------------------------------------------------------

_CRASH = """
import sys, resource, warnings
import cdsm
warnings.simplefilter("ignore", cdsm.CdsmWarning)
from tests.support.foreign import joint_element, link_element

def chain(count, kind):
    links = [link_element(f"l{i}") for i in range(count + 1)]
    joints = [
        joint_element(f"j{i}", kind if i else "revolute", f"l{i}", f"l{i + 1}", *PLACE)
        for i in range(count)
    ]
    return "".join([*links, *joints])

def star(count):
    links = [link_element(f"l{i}") for i in range(count + 1)]
    joints = [joint_element(f"j{i}", "revolute", "l0", f"l{i + 1}", *PLACE) for i in range(count)]
    return "".join([*links, *joints])

PLACE = ("0.1 0 0", "0 0 0", "0 1 0")
two = link_element("l0") + link_element("l1")
hinge = joint_element("j", "revolute", "l0", "l1", *PLACE)
heavy = link_element("l0") + link_element("l1", 1.0)
ROBOTS = {
    "400 universal joints": chain(800, "revolute"),
    "4500 fixed joints": chain(4500, "fixed"),
    "3000 branches": star(3000),
    "a circle": two + hinge + joint_element("k", "revolute", "l1", "l0", *PLACE),
    "a loop": two + hinge + joint_element("k", "revolute", "l1", "l1", *PLACE),
    "two parents": two + hinge + joint_element("k", "revolute", "l0", "l1", *PLACE),
    "no such link": two + joint_element("j", "revolute", "l0", "l2", *PLACE),
    "no links": hinge,
    "no joints": two,
    "nothing": "",
    "nan mass": heavy.replace('mass value="1.0"', 'mass value="nan"') + hinge,
    "nan inertia": heavy.replace('ixx="2e-3"', 'ixx="nan"') + hinge,
    "infinite place": two + hinge.replace("0.1 0 0", "inf 0 0"),
    "huge place": two + hinge.replace("0.1 0 0", "1e300 0 0"),
    "no axis": two + hinge.replace('xyz="0 1 0"', 'xyz="0 0 0"'),
    "nan limits": two + hinge.replace('lower="-0.9"', 'lower="nan"'),
    "a huge name": two.replace("l0", "l" * 1_000_000) + hinge.replace("l0", "l" * 1_000_000),
    "an empty name": two.replace('"l0"', '""') + hinge.replace('"l0"', '""'),
    "a name called universe": two.replace("l0", "universe") + hinge.replace("l0", "universe"),
    "a joint called universe": two + hinge.replace('name="j"', 'name="universe"'),
    "a joint called root_joint": two + hinge.replace('name="j"', 'name="root_joint"'),
    "a joint called as its link": two + hinge.replace('name="j"', 'name="l1"'),
    "a mimic": two + hinge.replace("</joint>", '<mimic joint="j"/></joint>'),
    "floating": two + hinge.replace("revolute", "floating"),
    "a mesh that is not there": two.replace(
        '<link name="l1">',
        '<link name="l1"><visual><geometry><mesh filename="/no.stl"/></geometry></visual>'
        '<collision><geometry><mesh filename="package://no/no.dae"/></geometry></collision>',
    ) + hinge,
}
ALLOWED = {"a name called universe", "a joint called root_joint", "a joint called as its link",
           "a mesh that is not there", "a joint called universe", "huge place"}
resource.setrlimit(resource.RLIMIT_AS, (4 * 2**30,) * 2)
for name, inside in ROBOTS.items():
    links = ("l0", "l1")
    cable = cdsm.Cable(name="c", sites=tuple(cdsm.Site(l, (0.0, 0.01, 0.0)) for l in links),
                       elasticity=cdsm.LinearElasticity(1e4))
    try:
        arm = cdsm.Manipulator.from_urdf(f'<robot name="r">{inside}</robot>', (cable,), tip="l1")
        arm.at([0.1] * arm.nv)
        assert name in ALLOWED, name
        print("read", name)
    except cdsm.CdsmError as error:
        print(type(error).__name__, name)
"""


@pytest.mark.slow
def test_robots_that_crash_pinocchio_are_refused() -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", _CRASH],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        timeout=HANGS,
        check=False,
    )
    assert done.returncode == 0, f"{done.returncode}\n{done.stdout}\n{done.stderr[-3000:]}"
    assert "UrdfError 4500 fixed joints" in done.stdout
