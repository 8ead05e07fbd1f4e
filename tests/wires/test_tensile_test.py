"""Tensile tests as testing machines write them: titles, units, commas, encodings.

``instron_strand.csv`` and ``zwick_seil.csv`` of tests/data are invented in the form of the
machines' exports. Their wire has EA = E (F + F_0)/(F + F_1) with E = 48 kN, F_0 = 15 N and
F_1 = 120 N, and noise of 0.2 N and 0.25 N.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm

DATA = Path(__file__).parents[1] / "data"
INSTRON, ZWICK = DATA / "instron_strand.csv", DATA / "zwick_seil.csv"
GERMAN = ("Standardweg", "Standardkraft")
CHOSEN = ("stroke [mm]", "Load")
HALF: dict[str, Any] = {"gauge_length": 0.5}


def written(tmp_path: Path, text: str, encoding: str = "utf-8") -> Path:
    path = tmp_path / "test.csv"
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.parametrize(
    ("path", "given", "length", "points"),
    [(INSTRON, {}, 0.3, 396), (ZWICK, {"columns": GERMAN, **HALF}, 0.5, 244)],
)
def test_machine_file_gives_the_law_it_was_made_with(
    path: Path, given: dict[str, Any], length: float, points: int
) -> None:
    test = cdsm.read_tensile_csv(path, **given)
    assert (test.gauge_length, test.force.size) == (length, points)
    fit = cdsm.fit_tensile_test(test.displacement, test.force, test.gauge_length)
    F = np.linspace(20.0, 585.0, 200)
    expected = 48e3 * (F + 15.0) / (F + 120.0)
    np.testing.assert_allclose(fit.elasticity.rigidity(F), expected, rtol=0.01)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "cp1252", "utf-16"])
def test_encodings(encoding: str, tmp_path: Path) -> None:
    path = written(tmp_path, ZWICK.read_text(encoding="cp1252"), encoding)
    test, wanted = (cdsm.read_tensile_csv(p, columns=GERMAN, **HALF) for p in (path, ZWICK))
    np.testing.assert_array_equal(test.displacement, wanted.displacement)


@pytest.mark.parametrize(
    ("head", "given"),
    [
        ("Gauge length;500,0;mm\n\nStroke (mm);Load (kN)\n0;0\n1,5;0,1\n", {}),
        ("# gauge-length = 50,0 cm\nExtension (mm)\tLoad (daN)\n0\t0\n1,5\t10,0\n", {}),
        ("Gage Length (in): 19.68504\nPosition in mm,force_cN\n0,0\n1.5,1e4\n", {}),
        ("# gauge_length=500mm\nTime,Extension,Load\n(s),(mm),(N)\n0,0,0\n1,1.5,100\n", {}),
        ("displacement µm,load/lbf\n0,0\n1500,22.48089431\n", HALF),
        ("displacement [μm],load [N]\n0,0\n1500,100\n", HALF),  # the Greek letter
        ("displacement,force\n0,0\n1.5,0.1\n", {"units": ("mm", "kN"), **HALF}),
        ("strain [%],force [N]\n0,0\n0.3,100\n", HALF),
        ("Strain,force [N]\n0,0\n0.003,100\n", {"units": ("strain", "N"), **HALF}),
        ("Tensile strain (Extension) [%],Extension [mm],Load [N]\n0,0,0\n9,1.5,100\n", HALF),
        ("Displacement (Strain 1)\tLoad\n(mm)\t(N)\n0\t0\n1.5\t100\n", HALF),
        ("Extension at Maximum Load [mm];Extension [mm];Load [N]\n9;0;0\n9;1.5;100\n", HALF),
        ("Stroke [in];Stroke [mm];Load [N]\n9;0;0\n9;1,5;100\n", {"columns": CHOSEN, **HALF}),
        ("Extension [m];Load [N]\n0;0\n0,0015;1,000e2\nstopped by hand\n", HALF),
        ("Stroke [µm];Load [N]\n0;0\n1.500,00;100\n", {"decimal": ",", **HALF}),
        ('Stroke [um],Load [N]\n0,0\n"1,500.0",100\nEnd of test,\n', {"decimal": ".", **HALF}),
    ],
)
def test_dialects(head: str, given: dict[str, Any], tmp_path: Path) -> None:
    test = cdsm.read_tensile_csv(written(tmp_path, head), **given)
    np.testing.assert_allclose(test.displacement, [0.0, 1.5e-3], rtol=1e-9)
    np.testing.assert_allclose(test.force, [0.0, 100.0], rtol=1e-9)
    assert test.gauge_length == pytest.approx(0.5)


def test_of_two_gauges_none_is_chosen_silently() -> None:
    path = DATA / "tensile_two_gauges.csv"
    with pytest.raises(cdsm.FileError, match=r"Crosshead \[mm\] and Extensometer \[mm\] may both"):
        cdsm.read_tensile_csv(path, **HALF)
    ends = [
        cdsm.read_tensile_csv(path, columns=(name, "load"), **HALF).displacement[-1]
        for name in ("crosshead", "Extensometer [mm]")
    ]
    assert ends[0] > 2.0 * ends[1] > 0.0


def test_columns_of_one_name_are_told_apart_by_number(tmp_path: Path) -> None:
    head = "Extension [mm],Load [N],Extension [mm],Load [N]\n"
    path = written(tmp_path, f"Specimen 1,,Specimen 2,\n{head}0,0,0,0\n1,100,2,300\n")
    for columns in (None, ("Extension", "Load")):
        with pytest.raises(cdsm.FileError, match=r"give --columns 1,2 or --columns 3,4"):
            cdsm.read_tensile_csv(path, columns=columns, **HALF)
    second = cdsm.read_tensile_csv(path, columns=("3", "4"), **HALF)
    assert (second.displacement[-1], second.force[-1]) == (2e-3, 300.0)
    assert "(column 3)" in second.source


@pytest.mark.parametrize(
    ("text", "given", "said"),
    [
        ("", {}, "is empty; give a header and a line for each reading"),
        ("displacement [mm],force [N]\n", {}, "holds no readings: no line has numbers; its first"),
        ("weight [N],force [N]\n0,0\n", {}, "there are weight [N], force [N]; which"),
        ("Zeit [s];Weg [mm];Kraft [N]\n0;0;0\n", {}, "give --columns Weg,Kraft, or, in Python"),
        ("s,F\n0,0\n", {"columns": ("Weg", "F")}, "names Weg and F"),
        ("force [N],load [N],stroke [mm]\n0,0,0\n", {}, "force [N] and load [N] may both"),
        ("displacement,force [N]\n0,0\n", {}, "the displacement 'displacement' in no unit"),
        ("displacement [mm],force\n0,0\n", {}, "give one of N, cN, mN, daN, kN, MN, lbf, kgf"),
        ("stroke [mm],force [N]\n0,0\n", {"units": ("mm", "kN")}, "in N, and kN is given"),
        ("displacement [mm],force [N]\n0,0\n1,nan\n2,2\n", {}, "line 3: 'nan' under 'for"),
        ("displacement [mm],force [N]\n0,0\n,1\n2,2\n", {}, "line 3: '' under 'displ"),
        ("stroke [mm],force [N]\n0,0\n", {"gauge_length": -5.0}, "gauge_length: -5 m given"),
        ("displacement [mm],force [N]\n0,1,0,2\n0,2,0,3\n", {}, "line 2"),
        ("stroke [mm];force [N]\n0;998\n1;1,002.32\n2;1100\n", {}, "line 3"),
        ("stroke [mm];force [N]\n0,1;998\n1;1.004\n", {}, "commas and with points. Write"),
        ("displacement [mm],force [N]\n0,0\n1,2\n", {}, "has no gauge length"),
        ("# gauge_length = 500\ndisplacement [mm],force [N]\n0,0\n", {}, "gauge_length ="),
        ("displacement [mm],force [N]\n" + "1" * 200_000 + ",2\n", {}, "line 2"),
        ("stroke [mm],force [N]\n0,0\n", {"decimal": "·"}, "decimal: '·' given"),
    ],
)  # fmt: skip
def test_faulty_files_are_refused_with_a_remedy(
    text: str, given: dict[str, Any], said: str, tmp_path: Path
) -> None:
    with pytest.raises(cdsm.CdsmError, match=re.escape(said)):
        cdsm.read_tensile_csv(written(tmp_path, text), **given)
