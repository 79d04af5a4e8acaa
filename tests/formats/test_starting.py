"""``lag2fmu new``: the start file runs as it is, shows the whole format, and nothing is overwritten."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from schema_faults import faults

import lag2fmu
from lag2fmu.errors import LoadError, MechanismError
from lag2fmu.formats.keys import NAMED, SINGLE, TABLES
from lag2fmu.formats.loading import load
from lag2fmu.formats.schema import FILE_NAME
from lag2fmu.formats.starting import write_start
from lag2fmu.formats.text import read_file


@pytest.fixture
def text(tmp_path: Path) -> str:
    path, _ = write_start("my_cart", tmp_path)
    return path.read_text("utf-8")


def with_examples(text: str) -> str:
    """``text`` with the lines that are commented out as examples."""
    return re.sub(r"^#(?=[\[a-z])", "", text, flags=re.MULTILINE)


def test_it_loads_under_its_name_without_warnings(tmp_path: Path) -> None:
    path, schema = write_start("my_cart", tmp_path)
    assert (path, schema) == (tmp_path / "my_cart.toml", tmp_path / FILE_NAME)
    mechanism = read_file(path)
    assert mechanism.name == "my_cart"
    assert [q.name for q in mechanism.coordinates] == ["x", "theta"]
    assert mechanism.strict_units
    assert not mechanism.warnings


def test_it_names_its_own_file_and_the_schema_beside_it(text: str, tmp_path: Path) -> None:
    assert "start.toml" not in text
    assert "lag2fmu validate my_cart.toml" in text
    (directive,) = re.findall(r"^#:schema (\S+)$", text, re.MULTILINE)
    assert text.startswith("#:schema")
    assert (tmp_path / directive).is_file()


def test_it_shows_every_table_and_every_key(text: str) -> None:
    for table in TABLES:
        assert re.search(rf"^#?\[{table}[\].]", text, re.MULTILINE), table
    for keys in (*SINGLE.values(), *NAMED.values()):
        for key in keys:
            assert re.search(rf"\b{key} = ", text), key


def test_text_and_examples_are_valid_under_the_schema(text: str) -> None:
    examples = with_examples(text)
    assert examples.count("\n[") > text.count("\n[") + 12
    assert faults(text) == []
    assert faults(examples) == []


@pytest.mark.slow
@pytest.mark.fmu
def test_it_exports_and_validates(tmp_path: Path) -> None:
    path, _ = write_start("my_cart", tmp_path)
    fmu = lag2fmu.export(load(str(path)), tmp_path / "my_cart.fmu")
    report = lag2fmu.validate(fmu)
    assert report.passed, report
    run = lag2fmu.simulate(fmu, stop_time=0.5)
    assert run["theta"][0] == pytest.approx(0.523598775598)  # 30 degrees
    assert run["height"][0] == pytest.approx(1.0 - 0.5 * 3**0.5)
    assert run["tip_x"][0] == 0.0
    assert run["tip_x"][-1] < -0.1  # on its way down


@pytest.mark.parametrize("name", ["", "2carts", "my cart", "my-cart", "../cart", "cart.toml", 'x"', "größe"])
def test_what_is_no_identifier_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(MechanismError, match="is no name; use letters, digits and underscores"):
        write_start(name, tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_name_that_is_too_long_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MechanismError, match=r"'x{20}\.\.\.' has 129 letters; a name has 128 at most"):
        write_start("x" * 129, tmp_path)


def test_a_file_that_exists_is_not_overwritten(tmp_path: Path) -> None:
    mine = tmp_path / "cart.toml"
    mine.write_text("mine", "utf-8")
    with pytest.raises(LoadError, match=r"cart\.toml' exists and is not overwritten"):
        write_start("cart", tmp_path)
    assert mine.read_text("utf-8") == "mine"
    assert list(tmp_path.iterdir()) == [mine]


def test_another_schema_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / FILE_NAME).write_text("{}", "utf-8")
    with pytest.raises(LoadError, match="is no schema of lag2fmu"):
        write_start("cart", tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [FILE_NAME]
    assert (tmp_path / FILE_NAME).read_text("utf-8") == "{}"


def test_the_schema_of_another_version_is_replaced(tmp_path: Path) -> None:
    write_start("one", tmp_path)
    schema = tmp_path / FILE_NAME
    new = schema.read_text("utf-8")
    schema.write_text(new.replace('"type"', '"older"', 1), "utf-8")
    write_start("two", tmp_path)
    assert schema.read_text("utf-8") == new


def test_a_second_start_file_shares_the_schema(tmp_path: Path) -> None:
    write_start("one", tmp_path)
    write_start("two", tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [FILE_NAME, "one.toml", "two.toml"]


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(LoadError, match="cannot be written: No such file"):
        write_start("cart", tmp_path / "absent")
