"""Files from the outside are read with one policy, whatever they hold."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import polypod as pp
from polypod.errors import Fault
from polypod.files.csv_columns import CsvTable, read_rows
from polypod.files.text import read_text, replacing
from polypod.solution.poses_of_lengths import load_lengths

MECH = pp.load("lu-3spu-2rpu-r")
LENGTHS = "1 [mm], 2 [mm], 3 [mm], 4 [mm], 5 [mm]\n748, 744, 748, 754, 754\n"
MOTION = (
    "time [s], x [mm], y [mm], z [mm], alpha [deg], beta [deg]\n0, 0, 0, 700, 0, 20\n1, 0, 0, 710, 0, 20\n"
)

READERS: dict[str, tuple[str, Callable[[Path], Any]]] = {
    "mechanism": ("a.toml", pp.load),
    "motion.csv": ("a.csv", lambda path: pp.load_motion(path, MECH)),
    "motion.toml": ("a.toml", lambda path: pp.load_motion(path, MECH)),
    "lengths": ("a.csv", lambda path: load_lengths(path, MECH)),
}


def fault(read: Callable[[Path], Any], path: Path) -> Fault:
    """The one fault of a file."""
    with pytest.raises(pp.PolypodError) as caught:
        read(path)
    (found,) = caught.value.faults  # type: ignore[attr-defined]
    assert str(path) in str(caught.value)
    return found


@pytest.mark.parametrize("what", READERS)
def test_a_file_that_is_no_utf_8_is_told_alike(what: str, tmp_path: Path) -> None:
    name, read = READERS[what]
    path = tmp_path / name
    path.write_bytes("# Kräfte\n".encode("latin-1"))
    found = fault(read, path)
    assert found.place == "file"
    assert found.message.startswith("is not UTF-8 text: 'utf-8' codec can't decode byte 0xe4 in position 4")


@pytest.mark.parametrize("what", ["motion.csv", "motion.toml", "lengths"])
def test_a_missing_file_and_a_directory_are_told_alike(what: str, tmp_path: Path) -> None:
    name, read = READERS[what]
    assert fault(read, tmp_path / name) == Fault("file", "does not exist")
    (tmp_path / name).mkdir()
    found = fault(read, tmp_path / name)
    assert (found.place, found.message.partition(":")[0]) == ("file", "cannot be read")


def test_a_mechanism_may_be_a_name_so_that_what_is_no_file_is_an_unknown_one(tmp_path: Path) -> None:
    for path in (tmp_path / "a.toml", tmp_path):
        with pytest.raises(pp.UnknownNameError, match="no mechanism file or built-in mechanism"):
            pp.load(path)


@pytest.mark.parametrize("what", ["mechanism", "motion.toml"])
@pytest.mark.parametrize(
    ("text", "message", "line"),
    [
        ("name = 1\nx = = 3\n", "at column 5", 2),
        ("name = 1\nx = " + "1" * 5000 + "\n", "more than 4300 digits", 2),
        ("name = 1\nx = " + "[" * 5000 + "\n", "too deeply", 2),
    ],
    ids=["syntax", "digits", "depth"],
)
def test_faults_of_toml_have_their_line(
    what: str, text: str, message: str, line: int, tmp_path: Path
) -> None:
    name, read = READERS[what]
    path = tmp_path / name
    path.write_text(text)
    found = fault(read, path)
    assert (found.place, found.line) == ("toml", line)
    assert message in found.message


@pytest.mark.parametrize(("what", "text"), [("motion.csv", MOTION), ("lengths", LENGTHS)])
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"], ids=["bare", "marked"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"], ids=["unix", "windows", "old mac"])
def test_marks_and_ends_of_lines_do_not_matter(
    what: str, text: str, mark: bytes, end: str, tmp_path: Path
) -> None:
    name, read = READERS[what]
    path = tmp_path / name
    path.write_bytes(mark + text.replace("\n", end).encode())
    found = read(path)
    assert np.isfinite(found if what == "lengths" else found.coordinates["z"]).all()


@pytest.mark.parametrize("what", ["motion.csv", "lengths"])
def test_a_cell_without_end_is_a_fault(what: str, tmp_path: Path) -> None:
    name, read = READERS[what]
    path = tmp_path / name
    path.write_text("1 [mm]\n" + "1" * 200_000 + "\n")
    found = fault(read, path)
    assert found.place == "line 2"
    assert "larger than field limit" in found.message


def test_the_reader_itself(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_bytes(b"\xef\xbb\xbfa\r\nb")
    assert read_text(path) == "a\nb"
    table = read_rows("# none\n\na, b\n1, 2\n# comment\n\n 3, x \n")
    assert isinstance(table, CsvTable)
    assert (table.place, table.header) == ("line 3", ["a", "b"])
    assert (table.places, table.cells) == (["line 4", "line 7"], [["1", "2"], ["3", "x"]])
    assert table.numbers is None


@pytest.mark.parametrize("end", ["", "\n", "\n\n \n"])
def test_rows_of_numbers_alone_are_not_kept_as_texts(end: str) -> None:
    table = read_rows("# none\n\na, b\n1, 2\n 3 ,-4e-1" + end)
    assert isinstance(table, CsvTable)
    assert table.cells is None
    assert table.numbers is not None
    assert table.numbers.tolist() == [[1.0, 2.0], [3.0, -0.4]]
    assert [*table.places] == ["line 4", "line 5"]
    assert table.places[1:] == ["line 5"]


@pytest.mark.parametrize(
    "rows", ["1,2\n\n3,4", "1,2\n3", "1,nan", "1,inf", "1,2 # a", '"1",2', "1,", "1,2,3", ""]
)
def test_other_rows_are_looked_at_cell_by_cell(rows: str) -> None:
    table = read_rows("a,b\n" + rows)
    assert isinstance(table, CsvTable)
    assert table.numbers is None
    assert table.cells is not None
    assert len(table.cells) == len(table.places)


def test_what_is_written_appears_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("before")

    def write(text: str) -> None:
        with replacing(path) as temporary:
            temporary.write_text("half")
            temporary.write_text(text.encode("ascii").decode())

    with pytest.raises(UnicodeEncodeError):
        write("ä")
    assert path.read_text() == "before"
    write("after")
    assert path.read_text() == "after"
    assert [*tmp_path.iterdir()] == [path]
