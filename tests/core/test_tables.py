"""Tables in text files: rows with their line numbers, delimiters, decimal commas, units."""

from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest

from cdsm.support.tables import read_table


def refuse(problem: str) -> NoReturn:
    raise ValueError(problem)


@pytest.mark.parametrize(
    ("text", "delimiter"),
    [
        ("a, b\n1.5, 2\n\n3, 4\n", ","),
        ("a; b\n1,5; 2\n\n3; 4\n", ";"),
        ("a\tb\n1.5\t2\n3\t4", "\t"),
    ],
)
def test_columns_are_numbers_whatever_separates_them(
    text: str, delimiter: str, tmp_path: Path
) -> None:
    path = tmp_path / "table.csv"
    path.write_text("# a remark\n" + text, encoding="utf-8")
    table = read_table(path, ";\t,")
    assert table.delimiter == delimiter
    assert table.header == ["a", "b"]
    assert table.comments == ["# a remark"]
    np.testing.assert_array_equal(table.column(0, refuse), [1.5, 3.0])
    np.testing.assert_array_equal(table.column(1, refuse, first=2), [4.0])


@pytest.mark.parametrize(("cell", "at"), [("x", 0), ("inf", 0), ("1", 1)])
def test_a_cell_that_is_no_number_is_refused_with_its_line(
    cell: str, at: int, tmp_path: Path
) -> None:
    path = tmp_path / "table.csv"
    path.write_text(f"a\n\n{cell}\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"line 3: '.*' is not a finite number"):
        read_table(path).column(at, refuse)
