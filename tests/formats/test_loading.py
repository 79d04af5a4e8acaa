"""Loading: bundled names, model files, structural arguments and values."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from lag2fmu.dynamics import derive
from lag2fmu.errors import Lag2FmuError, LoadError, MechanismError, TextError
from lag2fmu.formats.loading import (
    as_mechanism,
    bundled,
    load,
    pairs_of,
    split_settings,
    structural_arguments,
    values_of,
    with_settings,
    with_values,
)
from lag2fmu.formats.write import write
from lag2fmu.language.expressions import symbol
from lag2fmu.mechanism import Mechanism
from lag2fmu.resources import resource_folder

MODEL = """
from lag2fmu.mechanism import Body, Mechanism, coordinate

def slider(n: int = 1, scale: float = 1.0, name: str = "slider", heavy: bool = False) -> Mechanism:
    x = coordinate("x", "m", start=scale)
    return Mechanism(name, coordinates=[x], bodies=[Body(f"b{i}", 9 if heavy else 1, (x + i, 0)) for i in range(n)])
"""


@pytest.fixture
def slider(tmp_path: Path) -> Path:
    path = tmp_path / "slider.py"
    path.write_text(MODEL, encoding="utf-8")
    return path


# ---------------------------------------------------------------------------------------------------------- models


@pytest.mark.parametrize("name", bundled())
def test_bundled_models_read_like_the_textbook(name: str) -> None:
    mechanism = load(name)
    assert mechanism.name == name
    assert mechanism.strict_units
    assert mechanism.warnings == ()
    assert mechanism.source
    assert mechanism.title
    parts = (*mechanism.coordinates, *mechanism.parameters, *mechanism.inputs, *mechanism.outputs)
    assert [part.name for part in parts if not part.doc or part.unit is None] == []
    text = bundled()[name].read_text(encoding="utf-8")
    assert len(text.splitlines()) < 110
    if bundled()[name].suffix == ".toml":  # a sentence and a sketch in the comment at its top
        assert re.match(r"# [A-Za-z][^\n]*: [^\n]+\.\n#\n#    ", text)
        return
    assert re.match(r'r?"""[A-Za-z][^\n]*: [^\n]+\.\n', text)
    assert "\n::\n" in text


def test_bundled_models_are_sorted_and_complete() -> None:
    names = list(bundled())
    assert names == sorted(names)
    assert {"pendulum", "double_pendulum", "cart_pole", "n_pendulum", "slides_problem_6"} <= set(names)


@pytest.mark.parametrize("relative", [False, True])
def test_one_link_is_the_pendulum(relative: bool) -> None:
    one, pendulum = load("n_pendulum", {"n": 1, "relative": relative}), load("pendulum")
    rename = {symbol(old): symbol(new) for old, new in (("m1", "m"), ("l1", "l"), ("theta1", "theta"))}
    (bob,), (other,) = one.bodies, pendulum.bodies
    assert [e.xreplace(rename) for e in (bob.mass, *bob.position)] == [other.mass, *other.position]
    assert one.gravity == pendulum.gravity


def test_relative_angles_add_up() -> None:
    relative, absolute = (load("n_pendulum", {"n": 3, "relative": r}) for r in (True, False))
    theta = [symbol(f"theta{i}") for i in (1, 2, 3)]
    total = {theta[1]: theta[0] + theta[1], theta[2]: theta[0] + theta[1] + theta[2]}
    assert [e.xreplace(total) for e in absolute.bodies[2].position] == list(relative.bodies[2].position)


@pytest.mark.parametrize("n", ["0", "201"])
def test_a_family_refuses_other_sizes(n: str) -> None:
    with pytest.raises(LoadError, match=rf"n_pendulum.py, line \d+: ValueError: n = {n} links"):
        load("n_pendulum", {"n": n})


# ----------------------------------------------------------------------------------------------------------- files


def test_a_model_file_takes_structural_arguments(slider: Path) -> None:
    mechanism = load(slider, {"n": "3", "scale": "0.5", "name": "s", "heavy": "true"})
    assert (len(mechanism.bodies), mechanism.coordinates[0].start, mechanism.name) == (3, 0.5, "s")
    assert mechanism.bodies[0].mass == 9
    assert load(str(slider), {"n": 2, "scale": 2, "heavy": False}).coordinates[0].start == 2.0
    assert list(structural_arguments(slider)) == ["n", "scale", "name", "heavy"]


def test_a_model_file_leaves_nothing_behind(slider: Path) -> None:
    modules = set(sys.modules)
    load(slider)
    assert sorted(p.name for p in slider.parent.iterdir()) == ["slider.py"]
    assert not {name for name in set(sys.modules) - modules if "slider" in name}


def test_a_model_file_may_define_dataclasses(slider: Path) -> None:
    future = "from __future__ import annotations\nfrom dataclasses import dataclass\n"
    slider.write_text(f"{future}@dataclass\nclass Size:\n    n: int = 1\n{MODEL}", encoding="utf-8")
    assert load(slider, {"n": "2"}).bodies[1].name == "b1"


def test_a_changed_model_file_is_read_again(slider: Path) -> None:
    assert len(load(slider).bodies) == 1
    slider.write_text(MODEL.replace("n: int = 1", "n: int = 2"), encoding="utf-8")
    assert len(load(slider).bodies) == 2


def test_the_only_function_may_have_another_name(tmp_path: Path) -> None:
    (tmp_path / "other.py").write_text(MODEL + "\ndef helper():\n    return 1\n", encoding="utf-8")
    assert load(tmp_path / "other.py").name == "slider"


def test_a_text_is_loaded(tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    path.write_text(write(load("pendulum")), encoding="utf-8")
    assert load(path) == load("pendulum")
    assert structural_arguments(path) == {}
    with pytest.raises(
        LoadError, match=r"has no structural arguments; parameters .*, as simulate\(\.\.\., values={'n'"
    ):
        load(path, {"n": 3})
    path.write_text("[mechanism", encoding="utf-8")
    with pytest.raises(TextError, match=re.escape(str(path))):
        load(path)


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("x = 1\ny = 1 / 0\n", r"m\.py, line 2: ZeroDivisionError: division by zero"),
        (
            "def m():\n    return helper()\ndef helper():\n    raise ValueError('no')\n",
            r"m\.py, line 4: ValueError: no",
        ),
        ("def m():\n    import json\n    return json.loads('{')\n", r"m\.py, line 3: JSONDecodeError"),
        ("def m(:\n", r"m\.py, line 1: SyntaxError: "),
        ("x = '\0'\n", r"m\.py.*: (SyntaxError|ValueError): "),
        ("import nowhere_to_be_found\n", r"m\.py, line 1: ModuleNotFoundError: No module named 'nowhere_to_be_found'"),
        ("raise SystemExit(3)\n", r"m\.py, line 1: SystemExit: 3"),
        ("def m():\n    return 3\n", r"m\.py: m returned int instead of a Mechanism"),
        ("def a():\n    pass\ndef b():\n    pass\n", r"m\.py: expected a function 'm' .* public functions there: a, b"),
        (
            "from lag2fmu import load\nswing = load('pendulum')\n",
            r"there: none; of objects tell which: \S*m\.py:swing$",
        ),
        ("from math import sin\n_x = 3\n", r"m\.py: expected a function 'm' .* public functions there: none"),
        ("def m(*args):\n    pass\n", r"m\.py: m takes '\*args'; structural arguments are plain"),
        ("def m(n):\n    pass\n", r"m\.py: m needs the structural argument.s. n"),
        ("def m(t, inputs):\n    pass\n", r"or of a controller the sample time: .*m\.py:m@0\.001"),
        (
            "from lag2fmu.mechanism import Mechanism\n\ndef m():\n    return Mechanism('m', coordinates=[])\n",
            r"m\.py, line 4: MechanismError: coordinates: mechanism 'm' has none",
        ),
    ],
)
def test_a_model_file_that_fails_is_named_with_its_line(source: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "m.py").write_text(source, encoding="utf-8")
    with pytest.raises(LoadError, match=message):
        load(tmp_path / "m.py")


@pytest.mark.parametrize(
    ("model", "message"),
    [
        ("pendulm", "unknown model 'pendulm'; did you mean 'pendulum'"),
        ("", "unknown model ''"),
        ("none.py", "model file 'none.py' does not exist"),
        ("none.toml", "model file 'none.toml' does not exist"),
        ("none.fmu", r"'none\.fmu' is an FMU; give the model it is exported from \(\.py, \.toml, \.urdf, \.xml\)"),
        (".", r"'\.' is a folder; a model is a file that ends in one of \.py"),
        ("a\0b.py", "is no model|does not exist"),
        ("x" * 5000 + ".py", "is no model"),
    ],
)
def test_a_missing_model_is_named(model: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(LoadError, match=message):
        load(model)


def test_a_folder_is_no_model(tmp_path: Path) -> None:
    (tmp_path / "m.py").mkdir()
    with pytest.raises(LoadError, match="is not a file"):
        load(tmp_path / "m.py")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"m": 3},
            "'m' is no structural argument of slider; known are: n, scale, name, heavy; parameters and starts go",
        ),
        ({"n": "2.5"}, "n expects int, got '2.5'"),
        ({"n": 2.5}, "n expects int, got 2.5"),
        ({"n": True}, "n expects int, got True"),
        ({"n": None}, "n expects int, got None"),
        ({"scale": "wide"}, "scale expects float, got 'wide'"),
        ({"heavy": "maybe"}, "heavy expects bool, got 'maybe'"),
    ],
)
def test_other_structural_arguments_are_refused(arguments: dict[str, object], message: str, slider: Path) -> None:
    with pytest.raises(LoadError, match=message):
        load(slider, arguments)


# ---------------------------------------------------------------------------------------------------------- values


def test_values_are_set_in_si() -> None:
    changed = with_values(load("cart_pole"), {"M": 2, "theta": 0.1, "x_dot": -1.0, "F": 3.0})
    assert changed.parameters[0].value == 2.0
    assert (changed.coordinates[1].start, changed.coordinates[0].velocity, changed.inputs[0].start) == (0.1, -1.0, 3.0)
    assert with_values(load("cart_pole"), {}) == load("cart_pole")


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        (
            {"thta": 1.0},
            LoadError,
            "'thta' is no parameter.*did you mean 'theta'.*known are M, m, l, c, d, g, x, x_dot, theta",
        ),
        ({"zzz": 1.0}, LoadError, "'zzz' is no parameter.*known are M, m, l"),
        ({"I0": 1.0}, LoadError, r"'I0' cannot be set in 'cart_pole': it follows from .*; known are M"),
        ({"M": float("nan")}, LoadError, "'M' cannot be set to nan; give a finite number"),
        ({"M": float("inf")}, LoadError, "'M' cannot be set to inf"),
        ({"M": "1"}, LoadError, "'M' cannot be set to '1'"),
        ({"M": True}, LoadError, "'M' cannot be set to True"),
    ],
)
def test_other_values_are_refused(settings: dict[str, float], error: type[Lag2FmuError], message: str) -> None:
    with pytest.raises(error, match=message):
        with_values(load("cart_pole"), settings)


def test_a_value_out_of_its_bounds_is_refused() -> None:
    with pytest.raises(MechanismError, match=r"parameters.l0.value: -1.0 is outside of \[1e-06, inf\]"):
        with_values(load("elastic_pendulum"), {"l0": -1.0})


def test_settings_are_split() -> None:
    assert split_settings("n_pendulum", ["n=12", "m3 = 2.5", "theta1=-1e-3"]) == (
        {"n": "12"},
        {"m3": "2.5", "theta1": "-1e-3"},
    )
    assert split_settings("pendulum", []) == ({}, {})


@pytest.mark.parametrize(
    ("items", "message"),
    [
        (["m"], "setting 'm': expected NAME=VALUE"),
        (["=3"], "expected NAME=VALUE"),
        (["m="], "expected NAME=VALUE"),
        (["m=1", "m=2"], "'m' is set twice, first to 1"),
        (["m=one"], "'one' is not a number"),
        (["m=nan"], "'m' cannot be set to nan"),
        (["m=1e999"], "'m' cannot be set to inf"),
    ],
)
def test_other_settings_are_refused(items: list[str], message: str) -> None:
    with pytest.raises(LoadError, match=message):
        with_settings(load("pendulum"), split_settings("pendulum", items)[1])
    assert values_of(pairs_of(["m=3"]), {}) == {"m": 3.0}


def test_loaded_mechanisms_are_mechanisms() -> None:
    assert isinstance(load(bundled()["pendulum"]), Mechanism)


def test_the_verbs_take_what_load_takes(tmp_path: Path) -> None:
    path = tmp_path / "my_pendulum.toml"
    path.write_text(write(load("pendulum")), "utf-8")
    for model in ("pendulum", path, str(path), load("pendulum")):
        assert as_mechanism(model).name == derive(model).mechanism.name == "pendulum"
    with pytest.raises(
        LoadError, match="expected a Mechanism, a model's name or path, or an object of SymPy's mechanics, got int"
    ):
        derive(3)  # type: ignore[arg-type]


def test_resource_folders_are_found_or_named() -> None:
    assert (resource_folder("models") / "pendulum.py").is_file()
    with pytest.raises(LoadError, match="the folder 'nowhere' of lag2fmu is neither in"):
        resource_folder("nowhere")


def test_a_length_that_values_make_negative_is_told(caplog: pytest.LogCaptureFixture) -> None:
    as_mechanism("pendulum", {"l": -1.0})
    assert caplog.messages == ["warning: parameters.l: -1 m is negative; a length is not, but a place may be"]
