"""CSV files of tables: units in the heading, what contradicts them, and rows that are not sorted."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from lag2fmu.errors import MechanismError, UnitError
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.mechanism import Table

UNITS = ("rpm", "deg", "mm", "N.m", "N/mm", "degC", "1", "kW")


def written(path: Path, text: str) -> Path:
    path.write_text(text, "utf-8")
    return path


@pytest.mark.parametrize("seed", range(8))
def test_units_of_the_heading_are_honoured(tmp_path: Path, seed: int) -> None:
    """Whatever separates the columns, the data are those of a table with these units."""
    rng = random.Random(seed)
    of_x, of_y = rng.choice(UNITS), rng.choice(UNITS)
    mark = (",", ";", "\t", "   ")[seed % 4]
    x, y = sorted(rng.sample(range(1000), 5)), [rng.uniform(-5, 5) for _ in range(5)]
    rows = [f"omega [{of_x}]{mark}a_b [{of_y}]", *(f"{a}{mark}{b!r}" for a, b in zip(x, y, strict=True))]
    file = written(tmp_path / "motor.csv", "# measured\n" + "\n".join(rows))
    table = Table("motor", file=file)
    assert table.grid == Table("motor", columns=[x, y], units=[of_x, of_y]).grid
    assert [unit.name for unit in table.units] == [parse_unit(of_x).name, parse_unit(of_y).name]
    assert Table("motor", file=file, units=[of_x, of_y]).grid == table.grid


WAYS = ("{0} [{1}]", "{0}[{1}]", "[{1}]", "{0} ({1})", "{0} / {1}", "{0} in {1}", "{0} [ {1} ]", '"{0} [{1}]"')


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("before", ["", "# ", "# measured\n\n#"])
def test_units_are_found_however_they_are_written(tmp_path: Path, way: str, before: str) -> None:
    """In brackets or after a sign, in a heading or, as NumPy writes it, in a comment above the numbers."""
    heading = before + ",".join([way.format("omega", "rpm"), way.format("torque", "N.mm")])
    file = written(tmp_path / "motor.csv", f"{heading}\n0,5\n100,4\n")
    assert Table("motor", file=file).grid == Table("motor", columns=[[0, 100], [5, 4]], units=["rpm", "N.mm"]).grid


@pytest.mark.parametrize(
    "heading", ["x (measured),y (2)", "x[1],x[2]", "rpm,m", "# x,y", "# [rpm] to [N]", "y(0),y / x0"]
)
def test_what_is_no_unit_is_none(tmp_path: Path, heading: str) -> None:
    assert Table("motor", file=written(tmp_path / "motor.csv", f"{heading}\n0,5\n100,4\n")).units == ()


def test_two_arguments_have_units_too(tmp_path: Path) -> None:
    file = written(tmp_path / "map.csv", "s [rpm],p [mm],F [kN]\n0,0,1\n0,1,2\n60,0,3\n60,1,4\n")
    assert (
        Table("map", file=file).grid
        == Table("map", columns=[[0, 60], [0, 1], [[1, 2], [3, 4]]], units=["rpm", "mm", "kN"]).grid
    )


def test_a_heading_that_contradicts_the_units(tmp_path: Path) -> None:
    file = written(tmp_path / "motor.csv", "omega [rpm],torque [N.m]\n0,5\n100,4\n")
    with pytest.raises(
        UnitError, match=r"tables\.motor\.units: 'rad/s' contradicts the heading of '.*', which has 'rpm'"
    ):
        Table("motor", file=file, units=["rad/s", "N.m"])
    assert Table("motor", file=file, units=["rpm", "N*m"]).grid == Table("motor", file=file).grid


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("omega [rpm],torque\n0,5\n1,4\n", r"heading of '.*' has no unit for 'torque'; give one unit for each"),
        ("omega [furlong],torque [N]\n0,5\n1,4\n", r"heading of '.*': .*furlong"),
        ("omega [rpm],torque [N.m],x [m]\n0,5\n1,4\n", r"has 3 names for 2 columns"),
        ("t [s],a [m],b [m],c [m]\n0,1,2,3\n1,5,4,5\n2,4,5,6\n", r"belong to no column of a grid; give 'units'"),
        ("omega [rpm],torque [N.m]\n0,5\n200,4\n150,3\n", r"line 4 of '.*': 150\.0 rpm follows 200\.0 rpm; .* sort"),
        ("x,y\n0,5\n2,4\n\n# twice\n2,3\n", r"line 6 of '.*': 2\.0 \(SI\) follows 2\.0 \(SI\)"),
        ("0,1,3,2\n0,5,4,3\n1,5,4,3\n", r"line 1 of '.*': 2\.0 \(SI\) follows 3\.0"),
        ("0,1,2,3\n1,5,4,3\n0,5,4,3\n", r"line 3 of '.*': 0\.0 \(SI\) follows 1\.0"),
    ],
)  # fmt: skip
def test_faults_name_the_place(tmp_path: Path, text: str, message: str) -> None:
    file = written(tmp_path / "motor.csv", text)
    with pytest.raises((MechanismError, UnitError), match=message):
        Table("motor", file=file)


def test_unsorted_columns_without_a_file() -> None:
    with pytest.raises(MechanismError, match=r"tables\.f\.columns\[0\], entry 3: 1\.0 mm follows 2\.0 mm"):
        Table("f", columns=[[0, 2, 1], [1, 2, 3]], units=["mm", "1"])
