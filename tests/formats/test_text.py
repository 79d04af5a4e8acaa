"""The text format: what is written reads back the same, and whatever is wrong gets one clear error with its place."""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest
from everything import everything
from excessive import excessive
from sympy import sin

from lag2fmu.errors import TextError
from lag2fmu.formats.loading import bundled, load
from lag2fmu.formats.text import MAX_BYTES, read, read_file
from lag2fmu.formats.write import write
from lag2fmu.language.expressions import symbol
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.mechanism import (
    Mechanism,
    Parameter,
    coordinate,
)

BROKEN = {
    path.stem: path.read_text("utf-8") for path in (Path(__file__).parent / "broken").glob("*.toml")
} | excessive()
"""Name -> a text with one fault; its first line says what the error should be."""

PENDULUM = """
[mechanism]
name = "p"
[coordinates]
theta = { unit = "deg", start = 30, velocity = 90, max = 360 }
[parameters]
l = { value = 250, unit = "mm", min = 1 }
T0 = { value = 20, unit = "degC" }
[bodies.bob]
mass = 2
position = ["l*sin(theta)", "-l*cos(theta)"]
"""


# ------------------------------------------------------------------------------------------------------ round trip


@pytest.mark.parametrize("name", bundled())
def test_models_read_back_the_same(name: str) -> None:
    mechanism = load(name)
    assert read(write(mechanism), name) == mechanism


def test_everything_reads_back_the_same() -> None:
    mechanism = everything()
    text = write(mechanism)
    again = read(text, "everything.toml")
    assert again == mechanism
    assert again.warnings == mechanism.warnings
    assert write(again) == text
    ports = ["bead_force_x", "bead_force_y", "rod_torque"]
    assert [u.name for u in again.inputs] == ["F", "y0", "z0_target", *ports, "push_x", "push_y", "turn"]


@pytest.mark.parametrize("unit", ["deg", "mm", "rpm", "degC", "km/h", "lbf", "kN", "%", "eV", "1"])
def test_values_in_other_units_read_back_exactly(unit: str) -> None:
    values = [0.1, 1 / 3, -2.718281828459045, 1e-12, 6.02e23, 0.1 + 0.2, 299792458.0, 5e-5, 273.15, 1e-300]
    mechanism = load("pendulum")
    odd = [Parameter(f"a{i}", value, parse_unit(unit), minimum=-1e24, maximum=value) for i, value in enumerate(values)]
    changed = Mechanism(
        "p", coordinates=mechanism.coordinates, parameters=[*mechanism.parameters, *odd], bodies=mechanism.bodies
    )
    assert read(write(changed), "p.toml") == changed


def test_values_are_written_as_short_as_they_were_meant() -> None:
    text = write(read(PENDULUM, "p.toml"))
    assert 'theta = { unit = "deg", start = 30.0, velocity = 90.0, max = 360.0 }' in text
    assert 'l = { value = 250.0, unit = "mm", min = 1.0 }' in text
    assert 'T0 = { value = 20.0, unit = "degC" }' in text
    assert "mass = 2\n" in text


# --------------------------------------------------------------------------------------------------------- reading


def test_numbers_are_converted_to_si() -> None:
    mechanism = read(PENDULUM, "p.toml")
    (theta,), (rod, T0) = mechanism.coordinates, mechanism.parameters
    assert theta.start == pytest.approx(0.5235987755982988, rel=1e-15)
    assert theta.velocity == pytest.approx(1.5707963267948966)
    assert theta.nominal == parse_unit("deg").factor
    assert theta.maximum == pytest.approx(6.283185307179586)
    assert (rod.value, rod.minimum, T0.value) == (0.25, 0.001, 293.15)
    assert mechanism.bodies[0].mass == 2
    assert mechanism.bodies[0].position[0] == symbol("l") * sin(symbol("theta"))


def test_text_and_python_mean_the_same_numbers() -> None:
    declared = coordinate("theta", "deg", start=30, velocity=90, maximum=360).declaration
    assert read(PENDULUM, "p.toml").coordinates[0] == declared


def test_an_input_load_becomes_inputs() -> None:
    mechanism = read(PENDULUM + '[loads.push]\npoint = "bob"\ninput = true\n', "p.toml")
    assert [(u.name, u.unit) for u in mechanism.inputs] == [("push_x", parse_unit("N")), ("push_y", parse_unit("N"))]
    assert mechanism.loads[0].force == (symbol("push_x"), symbol("push_y"))


def test_a_mismatching_unit_is_a_warning_unless_strict() -> None:
    text = PENDULUM.replace("mass = 2", 'mass = "l"')
    assert read(text, "p.toml").warnings == ("bodies.bob.mass: 'l' is in m, expected kg",)


def test_a_message_quotes_both_ends_of_a_long_expression() -> None:
    long = " + ".join(f"l**3*cos(0.{k})" for k in range(100, 140))
    (warning,) = read(PENDULUM.replace("mass = 2", f'mass = "{long}"'), "p.toml").warnings
    assert re.fullmatch(r"bodies\.bob\.mass: 'l\*\*3\*.{50,} \.\.\. .{50,}' is in m3, expected kg", warning)
    assert len(warning) < 200


# ---------------------------------------------------------------------------------------------------------- errors


def test_there_are_enough_broken_texts() -> None:
    assert len(BROKEN) >= 30


@pytest.mark.parametrize("name", sorted(BROKEN))
def test_a_broken_text_gets_one_clear_error(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / f"{name}.toml"
    path.write_text(BROKEN[name], "utf-8", newline="")
    expected = re.match(r"# expect: (.*)", BROKEN[name])
    assert expected is not None, "the first line says what the error should be"
    began = time.process_time()
    with pytest.raises(TextError) as caught:
        read_file(path)
    assert time.process_time() - began < 1.0
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert re.match(expected[1], message[len(f"{path}: ") :]), message
    assert len(message) < 1000
    assert "\n" not in message
    assert list(tmp_path.iterdir()) == [path], "something was executed"


def test_a_large_file_is_refused_by_its_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "large.toml"
    path.write_bytes(b"# " + b"x" * 10_000_000)
    monkeypatch.setattr(Path, "read_bytes", lambda self: pytest.fail("the file was read"))
    began = time.process_time()
    with pytest.raises(TextError, match=r"large\.toml: has 10000002 bytes; .* more than 1000000 bytes is not read"):
        read_file(path)
    assert time.process_time() - began < 1.0


def test_a_text_that_grows_too_large_is_refused() -> None:
    with pytest.raises(TextError, match=r"p\.toml: has 1000001 characters"):
        read(" " * (MAX_BYTES + 1), "p.toml")


@pytest.mark.parametrize(
    ("content", "expected"),
    [(b"[mechanism]\nname = \"\xff\"", "byte 20 .0xff. is not UTF-8"), (b"\x00", "no valid TOML: .*line 1, column 1")],
)  # fmt: skip
def test_other_bytes_are_refused(content: bytes, expected: str, tmp_path: Path) -> None:
    (tmp_path / "p.toml").write_bytes(content)
    with pytest.raises(TextError, match=expected):
        read_file(tmp_path / "p.toml")


@pytest.mark.parametrize("text", ["", "# a comment\n", "[coordinates]\n"])
def test_a_text_without_a_mechanism_is_told_how_to_begin(text: str) -> None:
    with pytest.raises(TextError, match=r"'mechanism' is missing; a mechanism begins with \[mechanism\]"):
        read(text, "p.toml")


def test_a_byte_order_mark_is_let_pass(tmp_path: Path) -> None:
    (tmp_path / "p.toml").write_bytes(b"\xef\xbb\xbf" + PENDULUM.encode())
    assert read_file(tmp_path / "p.toml") == read(PENDULUM, "p.toml")


def test_a_missing_file_and_a_folder_are_errors(tmp_path: Path) -> None:
    for path in (tmp_path / "none.toml", tmp_path):
        with pytest.raises(TextError, match=re.escape(f"{path}: cannot be read")):
            read_file(path)


@pytest.mark.parametrize("line", ["a.b.c = 1\n" * 20000, "[a]\n" * 20000, "x = [" * 100000, "a = '''" + "\n" * 900000])
def test_large_nonsense_is_refused_soon(line: str) -> None:
    began = time.process_time()
    with pytest.raises(TextError, match=r"^p\.toml: "):
        read(line[: MAX_BYTES - 1], "p.toml")
    assert time.process_time() - began < 1.0


def test_an_exponent_beyond_all_bounds_is_named() -> None:
    with pytest.raises(TextError, match=r"x\.toml: no valid TOML: the exponent of a number has too many digits"):
        read(f'[mechanism]\nname = "m"\n[experiment]\nstop_time = 1e-{"9" * 30}\n', "x.toml")


@pytest.mark.parametrize(
    ("value", "remedy"),
    [("\N{MINUS SIGN}5", "a minus is written with '-'"), ("\u201ekg\u201c", "texts have straight quotes")],
    ids=["minus", "quotes"],
)
def test_signs_of_word_processors_get_their_remedy(value: str, remedy: str) -> None:
    with pytest.raises(TextError, match=remedy):
        read(f'[mechanism]\nname = "x"\n[parameters]\nm = {value}\n', "x.toml")


def test_a_decimal_comma_is_told_from_other_faults() -> None:
    with pytest.raises(TextError, match=r"decimals have a point: 1\.5 instead of 1,5"):
        read('[mechanism]\nname = "x"\n[parameters]\nm = { value = 1,5 }\n', "x.toml")
