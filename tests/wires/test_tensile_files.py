"""Tensile tests as testing machines write them: titles, languages, commas, units, encodings.

Both files of tests/data are invented in the form of the machines' exports. Their wire has
EA = E (F + F_0)/(F + F_1) with E = 48 kN, F_0 = 15 N, F_1 = 120 N, and noise of 0.2 N and 0.25 N.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import cdsm
from cdsm.cli import app
from cdsm.support.values import Array
from cdsm.wires.catalogue import as_wire

DATA = Path(__file__).parents[1] / "data"
INSTRON, ZWICK = DATA / "instron_strand.csv", DATA / "zwick_seil.csv"


def rigidity(F: Array) -> Array:
    return np.asarray(48e3 * (F + 15.0) / (F + 120.0))


def written(tmp_path: Path, text: str, encoding: str = "utf-8") -> Path:
    path = tmp_path / "test.csv"
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.parametrize(("path", "gauge", "points"), [(INSTRON, 0.3, 396), (ZWICK, 0.5, 244)])
def test_machine_file_gives_the_law_it_was_made_with(path: Path, gauge: float, points: int) -> None:
    test = cdsm.read_tensile_csv(path)
    assert (test.gauge_length, test.force.size) == (gauge, points)
    fit = cdsm.fit_tensile_test(test.displacement, test.force, test.gauge_length)
    F = np.linspace(20.0, 585.0, 200)
    np.testing.assert_allclose(fit.elasticity.rigidity(F), rigidity(F), rtol=0.01)
    truth = rigidity(fit.band.tensions)
    inside = (fit.band.low <= truth) & (truth <= fit.band.high)
    assert inside.mean() > 0.85  # 95 % of the tensions on average


def test_source_names_what_was_read_and_what_was_not() -> None:
    assert cdsm.read_tensile_csv(ZWICK).source == (
        "'Standardweg' [mm] and 'Standardkraft' [N] of line 8; not read: 'Dehnung' [%]"
    )
    assert "'Extension' [mm] and 'Load' [N]" in cdsm.read_tensile_csv(INSTRON).source


def test_strain_is_a_displacement_over_the_gauge_length() -> None:
    way = cdsm.read_tensile_csv(ZWICK)
    strain = cdsm.read_tensile_csv(ZWICK, columns=("Dehnung", "Standardkraft"))
    np.testing.assert_allclose(strain.displacement, way.displacement, atol=1e-7)  # its digits
    np.testing.assert_array_equal(strain.force, way.force)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16", "utf-16-le"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_encodings(encoding: str, end: str, tmp_path: Path) -> None:
    text = ZWICK.read_text(encoding="cp1252").replace("\n", end)
    test, wanted = (
        cdsm.read_tensile_csv(written(tmp_path, text, encoding)),
        cdsm.read_tensile_csv(ZWICK),
    )
    np.testing.assert_array_equal(test.displacement, wanted.displacement)
    assert test.gauge_length == wanted.gauge_length


HEADERS = {  # header: places of displacement and force
    "Standardweg;Standardkraft\nmm;N": (0, 1),
    "Prüfkraft [N];Traversenweg [mm]": (1, 0),
    "Weg/mm;Kraft/N": (0, 1),
    "Verlängerung in mm;Kraft in N": (0, 1),
    "Déplacement (mm);Force (N)": (0, 1),
    "Allongement (mm);Charge (N)": (0, 1),
    "Fuerza [N];Desplazamiento [mm]": (1, 0),
    "Spostamento [mm];Carico [N]": (0, 1),
    "Deslocamento (mm);Força (N)": (0, 1),
    "Verplaatsing [mm];Kracht [N]": (0, 1),
    "时间(s);位移(mm);力(N)": (1, 2),
    "ストローク;試験力\n(mm);(N)": (0, 1),
    "Crosshead (mm);Load (N);Time (s)": (0, 1),
    "Tensile extension (mm);Tensile load (N)": (0, 1),
    "Displacement (Strain 1)\tLoad\n(mm)\t(N)": (0, 1),
    "Extension at Maximum Load [mm];Extension [mm];Load [N]": (1, 2),
    "Load rate [N/s];Load [N];Extension [mm]": (2, 1),
}


@pytest.mark.parametrize("header", HEADERS)
@pytest.mark.parametrize("titles", [0, 12, 48])
def test_header_in_the_languages_of_machines(header: str, titles: int, tmp_path: Path) -> None:
    way, force = HEADERS[header]
    separator = "\t" if "\t" in header else ";"
    lines = [f"Titel {k}" for k in range(titles)] + header.splitlines()
    for k in range(10):
        row = ["99"] * 3
        row[way], row[force] = f"{0.5 * k}".replace(".", ","), f"{10.5 * k}".replace(".", ",")
        lines.append(separator.join(row))
    test = cdsm.read_tensile_csv(written(tmp_path, "\n".join(lines)), gauge_length=0.4)
    np.testing.assert_allclose(test.displacement, 5e-4 * np.arange(10), rtol=1e-12)
    np.testing.assert_allclose(test.force, 10.5 * np.arange(10), rtol=1e-12)


def test_strain_of_a_machine_without_a_displacement(tmp_path: Path) -> None:
    header = "Tensile strain (Displacement) (mm/mm),Force (N)\n"
    path = written(tmp_path, header + "".join(f"{1e-3 * k},{k}\n" for k in range(9)))
    test = cdsm.read_tensile_csv(path, gauge_length=0.4)
    np.testing.assert_allclose(test.displacement, 4e-4 * np.arange(9), rtol=1e-12)
    assert "1 m" not in test.source


def test_a_strain_needs_no_gauge_length(tmp_path: Path) -> None:
    path = written(
        tmp_path, "strain [%],force [N]\n" + "".join(f"{k},{50 * k}\n" for k in range(9))
    )
    test = cdsm.read_tensile_csv(path)
    np.testing.assert_allclose(test.displacement / test.gauge_length, 1e-2 * np.arange(9))
    assert test.source.endswith("no gauge length: displacements are those of 1 m of wire")
    found = CliRunner().invoke(app, ["fit", str(path)])
    assert found.exit_code == 0, found.output
    assert "no gauge length: displacements are those of 1 m of wire" in found.output
    law = cdsm.fit_tensile_test(test.displacement, test.force, test.gauge_length).elasticity
    np.testing.assert_allclose(law.rigidity([50.0, 350.0]), 5000.0, rtol=1e-6)


def test_a_table_of_results_before_the_points_is_not_the_test(tmp_path: Path) -> None:
    results = '"Extension [mm]","Load [N]"\n"4.5","812.3"\n"4.6","811.9"\n\n'
    rows = "".join(f"{0.1 * k:.1f},{5 * k}\n" for k in range(9))
    path = written(tmp_path, results + "Extension,Load\nmm,kN\n" + rows)
    np.testing.assert_allclose(
        cdsm.read_tensile_csv(path, gauge_length=0.5).force, 5e3 * np.arange(9)
    )


def test_columns_units_and_skip_say_what_the_header_does_not(tmp_path: Path) -> None:
    rows = "".join(f"{k},{0.1 * k:.1f},{5 * k}\n" for k in range(9))
    path = written(tmp_path, "made,by,hand\n1,2,3\nrun,s,F\n" + rows)
    for columns, skip in (((2, 3), 2), (("s", "F"), 0), (("2", "3"), 3)):
        test = cdsm.read_tensile_csv(
            path, columns=columns, skip=skip, units=("mm", "kN"), gauge_length=0.5
        )
        np.testing.assert_allclose(test.displacement, 1e-4 * np.arange(9), atol=1e-18)
        np.testing.assert_allclose(test.force, 5e3 * np.arange(9))
    one = cdsm.read_tensile_csv(
        path, columns=("s", "F"), displacement_unit="mm", force_unit="kN", gauge_length=0.5
    )
    np.testing.assert_array_equal(one.force, test.force)


@pytest.mark.parametrize(
    "title",
    [
        "Gauge length;300,0;mm",
        "Gage Length (mm);300",
        "Messlänge L0: 0,3 m",
        "Gauge length [cm]: 30",
    ],
)
def test_title_line_gives_the_gauge_length(title: str, tmp_path: Path) -> None:
    text = f"{title}\nWeg [mm];Kraft [N]\n" + "".join(f"{k};{k}\n" for k in range(9))
    path = written(tmp_path, text)
    assert cdsm.read_tensile_csv(path).gauge_length == pytest.approx(0.3)
    assert cdsm.read_tensile_csv(path, gauge_length=0.2).gauge_length == 0.2  # what is said counts
    both = written(tmp_path, f"{title}\nEinspannlänge;500;mm\n" + text)
    with pytest.raises(cdsm.TensileTestError, match="300 mm and 500 mm; give one"):
        cdsm.read_tensile_csv(both)


# --- what goes wrong ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"columns": ("Weg", "Kraft")}, "there is no column 'Weg' in the header ["),
        ({"columns": (3, 9)}, "there is no column 9 in"),
        ({"columns": ("Weg",)}, "give two"),
        ({"units": "mm"}, "give two"),
        ({"units": ("mm", "kN")}, "the header has the force in N, but force_unit='kN'"),
        ({"skip": -1}, "skip"),
    ],
)
def test_wrong_choices_are_named(given: dict[str, Any], said: str) -> None:
    with pytest.raises(cdsm.CdsmError, match=re.escape(said)):
        cdsm.read_tensile_csv(ZWICK, **given)


def test_two_columns_that_fit_are_both_named(tmp_path: Path) -> None:
    text = "Standardweg [mm];Dehnung [mm];Kraft [N]\n" + "".join(f"{k};{k};{k}\n" for k in range(9))
    path = written(tmp_path, text)
    with pytest.raises(cdsm.TensileTestError, match=r"'Standardweg' \[mm\] and 'Dehnung' \[mm\]"):
        cdsm.read_tensile_csv(path, gauge_length=0.5)
    by_name = cdsm.read_tensile_csv(path, columns=("dehnung", "Kraft [N]"), gauge_length=0.5)
    assert by_name.displacement[-1] == 8e-3


def test_gauge_length_in_another_unit_is_the_mistake() -> None:
    test = cdsm.read_tensile_csv(INSTRON)
    with pytest.raises(cdsm.TensileTestError, match=r"is 0\.3 mm and should be 300 mm") as caught:
        cdsm.fit_tensile_test(test.displacement, test.force, 3e-4)
    assert "the displacement is in" not in str(caught.value)
    with pytest.raises(cdsm.TensileTestError, match="the displacement is in mm"):
        cdsm.fit_tensile_test(1e3 * test.displacement, test.force, 0.3)


def test_command_line_speaks_of_its_options(tmp_path: Path) -> None:
    def said(*arguments: object) -> str:
        result = CliRunner().invoke(app, ["fit", *map(str, arguments)])
        assert result.exit_code != 0
        text = " ".join(result.stderr.split())
        assert not re.search(r"\w=", text)  # no keyword of Python
        return text

    bare = written(tmp_path, "s;F\n" + "".join(f"{k};{k}\n" for k in range(9)))
    assert "--columns Extension,Load" in said(bare)
    assert "--units mm,N" in said(bare, "--columns", "1,2")
    assert "--gauge-length [mm]" in said(bare, "--columns", "s,F", "--units", "mm,N")
    assert "should be 300 mm" in said(INSTRON, "--gauge-length", 0.3)
    assert "--units" in said(ZWICK, "--units", "mm,kN")
    assert "--columns" in said(ZWICK, "--columns", "Dehnung")
    found = CliRunner().invoke(
        app, ["fit", str(bare), "--columns", "s,F", "--units", "µm,kN", "--gauge-length", "500"]
    )
    assert found.exit_code == 0, found.output
    assert f"{bare}: 's' and 'F' of line 1" in found.output


@pytest.mark.parametrize("path", [INSTRON, ZWICK])
def test_measured_points_are_no_law_of_a_wire(path: Path) -> None:
    with pytest.raises(cdsm.FileError, match="Fit it first: `cdsm fit`"):
        cdsm.Elasticity.read(path)
    with pytest.raises(cdsm.FileError, match="Fit it first: `cdsm fit`"):
        as_wire(str(path))  # as --wire does


@pytest.mark.parametrize(
    ("rows", "force"),
    [
        ("0,0833;1.100 0,1;1.200", [1100, 1200]),
        ("0,08;998,5 0,09;1.004,25", [998.5, 1004.25]),
        ("0.08;998.5 0.09;1,004.25", [998.5, 1004.25]),
        ("0.08;998 0.09;1,004", [998, 1004]),
        ("1;1.234.567 2;1.234.568", [1234567, 1234568]),
        ("1;1,100 2;1,200", [1.1, 1.2]),
        ("1;1.1E+03;9,5 2;1.2E+03;n/a", [1100, 1200]),
    ],
)
def test_columns_tell_decimals_from_thousands(
    rows: str, force: list[float], tmp_path: Path
) -> None:
    path = written(tmp_path, "Weg [mm];Kraft [N]\n" + rows.replace(" ", "\n"))
    assert cdsm.read_tensile_csv(path, gauge_length=0.5).force.tolist() == force


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("0,0833;1.1052 0,1;1.2", "line 2, column 1: '0,0833' and line 2, column 2: '1.1052'"),
        ("1,100;1.100 2,200;2.200", "same decimal mark"),
        ("1,5;1 2.5;2", "line 2, column 1: '1,5' and line 3, column 1: '2.5'"),
        ("1;998 2;1.004", "line 3, column 2: '1.004': it is not clear"),
        ("0,1;998 0,2;0.999", "line 3, column 2: '0.999'"),
        ("0,1;1200 0,2;1.300", "line 3, column 2: '1.300'"),
    ],
)
def test_marks_that_stay_unclear_are_refused(rows: str, said: str, tmp_path: Path) -> None:
    path = written(tmp_path, "Weg [mm];Kraft [N]\n" + rows.replace(" ", "\n"))
    with pytest.raises(cdsm.TensileTestError) as caught:
        cdsm.read_tensile_csv(path, gauge_length=0.5)
    assert said in str(caught.value)


def test_gauge_length_is_read_with_the_mark_of_the_points(tmp_path: Path) -> None:
    title = "# gauge_length = 1.500 mm\nWeg [mm];Kraft [N]\n"
    path = written(tmp_path, title + "0,1;1,5\n0,2;2,5\n")
    assert cdsm.read_tensile_csv(path).gauge_length == 1.5
    path = written(tmp_path, title + "1;1\n2;2\n")
    with pytest.raises(cdsm.TensileTestError, match=r"'1\.500' 'mm' is not understood"):
        cdsm.read_tensile_csv(path)
