"""A new key of a cable is one line: reading, writing and --set follow."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import cdsm

PACKAGE = Path(cdsm.__file__).parent
LINE = '    breaking_force: float = number("force", 1e9)\n'
PROGRAM = """
import sys, cdsm
changes = {"cables": {"cable1_2": {"breaking_force": 700.0}}}
arm = cdsm.Manipulator.read(sys.argv[1], changes=changes)
print([cable.breaking_force for cable in arm.cables][:3])
print(cdsm.Manipulator.read(arm.write(sys.argv[2])) == arm)
print("breaking_force = 900.0" in open(sys.argv[2]).read())
for value in ("-1.0", "true"):
    try:
        cdsm.Manipulator.read(sys.argv[1], changes={"breaking_force": eval(value.title())})
    except cdsm.FileError as error:
        print(str(error).splitlines()[-1].strip())
"""


def test_a_new_key_of_a_cable_is_one_line(tmp_path: Path) -> None:
    shutil.copytree(PACKAGE, tmp_path / "cdsm", ignore=shutil.ignore_patterns("__pycache__"))
    file = tmp_path / "cdsm" / "cable.py"
    text = file.read_text(encoding="utf-8")
    last = '    gain: float = number("gain", 1.0)\n'
    assert text.count(last) == 1
    file.write_text(text.replace(last, last + LINE), encoding="utf-8")
    example = PACKAGE.parent / "examples" / "arm.toml"
    arm = tmp_path / "ARM.toml"
    key = "breaking_force = 900.0\n"
    arm.write_text(key + example.read_text(encoding="utf-8"), encoding="utf-8")
    program = [sys.executable, "-c", PROGRAM, str(arm), str(tmp_path / "again.toml")]
    env = os.environ | {"PYTHONPATH": str(tmp_path)}
    ran = subprocess.run(program, env=env, cwd=tmp_path, capture_output=True, text=True, check=True)
    values, equal, written, low, kind = ran.stdout.splitlines()
    assert values == "[900.0, 700.0, 900.0]"
    assert (equal, written) == ("True", "True")
    assert "breaking_force: -1 N given" in low
    assert "breaking_force: input should be a valid number" in kind
