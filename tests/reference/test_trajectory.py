"""The record Trajectory and its CSV form."""

from pathlib import Path

import numpy as np
import pytest

from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.reference import Trajectory, parse_csv, read_csv


def test_csv_reads_back_to_the_same_bits(tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    time = np.cumsum(random.uniform(1e-9, 1, 50))
    trajectory = Trajectory(
        time, ("a", "b,c"), random.normal(size=(50, 2)) * 10.0 ** random.integers(-300, 300, (50, 2))
    )
    trajectory.write_csv(tmp_path / "x.csv")
    again = read_csv(tmp_path / "x.csv")
    assert again.names == trajectory.names
    assert (again.time == trajectory.time).all()
    assert (again.values == trajectory.values).all()
    assert [path.name for path in tmp_path.iterdir()] == ["x.csv"]


def test_columns_and_iteration() -> None:
    trajectory = Trajectory.of([0, 1, 3], {"a": [1, 2, 4], "b": 7.0})
    assert trajectory["b"].tolist() == [7, 7, 7]
    assert (len(trajectory), list(trajectory), "a" in trajectory, "c" in trajectory) == (3, ["a", "b"], True, False)
    assert trajectory[["b", "a"]].tolist() == [[7, 1], [7, 2], [7, 4]]
    assert trajectory.interpolated([0.5, 2.0])["a"].tolist() == [1.5, 3.0]
    with pytest.raises(SimulationError, match="no column 'c, d'; there are a, b"):
        trajectory.columns(["a", "c", "d"])
    with pytest.raises(SimulationError, match=r"3\.5 s is outside of its range, .*3\.0.* s"):
        trajectory.interpolated([1.0, 3.5])


def test_arrays_are_frozen_copies() -> None:
    values = np.ones((2, 1))
    trajectory = Trajectory(np.array([0.0, 1.0]), ("a",), values)
    values[0, 0] = 5
    assert trajectory["a"][0] == 1
    with pytest.raises(ValueError, match="read-only"):
        trajectory.values[0, 0] = 2


@pytest.mark.parametrize(
    ("time", "names", "values", "message"),
    [
        ([0, 1], ("a",), [[1.0]], "do not fit"),
        ([], (), np.empty((0, 0)), "no times"),
        ([0, 0], ("a",), [[1.0], [2.0]], r"0\.0 s does not come after 0\.0 s \(row 2\)"),
        ([0, np.nan], ("a",), [[1.0], [2.0]], "time nan is not finite"),
        ([0, 1], ("a",), [[1.0], [np.inf]], r"'a' is inf at time .*1\.0"),
        ([0], ("a", "a"), [[1.0, 2.0]], "'a' stands twice"),
        ([0], ("time",), [[1.0]], "'time' stands twice"),
    ],
)
def test_refuses_arrays(time: list, names: tuple, values: list, message: str) -> None:
    with pytest.raises(SimulationError, match=message):
        Trajectory(time, names, values)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: the first column is missing"),
        ("t,a\n0,1\n", "line 1: the first column is 't', expected 'time'"),
        ("time\ta\n0\t1\n", "separate columns by commas"),
        ("time,a\n0,1\n \n1\n", "line 4: 1 values for 2 columns; column 'a' is missing"),
        ("time,a\n# all in SI\n0,1\n", "line 2: 1 values for 2 columns; leave comments out"),
        ("time,a\n0,1,5\n", "3 values for 2 columns; decimals have a point"),
        ("time,a\n0,\N{MINUS SIGN}2\n", "is not a finite number; write -2"),
        ("time,a,a\n0,1,2\n", r"line 1: the name 'a' stands twice \(column 3\)"),
        ("time,a,\n0,1,2\n", "line 1: column 3 has no name"),
        ("time,a\n", "no rows below the header"),
        ("time,a\n0,1\n1\n", "line 3: 1 values for 2 columns; column 'a' is missing"),
        ("time,a\n0,1,2\n", "line 2: 3 values for 2 columns"),
        ("time,a\n0,1\n1,two\n", "line 3, column 'a': 'two' is not a finite number"),
        ("time,a\n0,1\n\n1,nan\n", "line 4, column 'a': 'nan' is not a finite number"),
        ("time,a\n0,1_000\n", "line 2, column 'a': '1_000' is not a finite number"),
        ("time,a\nx,1\n", "line 2, column 'time': 'x' is not a finite number"),
        ("time,a\n0,1\n2,1\n1,1\n", r"line 4, column 'time': 1\.0 s does not come after 2\.0 s"),
        ("time,a\n0,1\n0,1\n", r"line 3, column 'time': 0\.0 s does not .*: let a jump take a short time"),
    ],
)
def test_refuses_csv(text: str, message: str) -> None:
    with pytest.raises(LoadError, match=message):
        parse_csv(text)


def test_refuses_files(tmp_path: Path) -> None:
    with pytest.raises(LoadError, match=r"cannot read .*missing\.csv"):
        read_csv(tmp_path / "missing.csv")
    (tmp_path / "binary.csv").write_bytes(b"time,a\n\xff\xfe")
    with pytest.raises(LoadError, match="no text in UTF-8"):
        read_csv(tmp_path / "binary.csv")
    trajectory = Trajectory.of([0.0], {"a": 1.0})
    for target in (tmp_path / "no" / "x.csv", tmp_path):
        with pytest.raises(SimulationError, match="cannot write"):
            trajectory.write_csv(target)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["binary.csv"]


def test_reads_what_spreadsheets_write(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_bytes(b"\xef\xbb\xbftime, a\r\n0,1\r\n1,2e-3\r\n")
    assert read_csv(tmp_path / "x.csv")["a"].tolist() == [1, 0.002]
