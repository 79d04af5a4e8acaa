"""Numbers, strings and functions as C; what a compiler reads back is what was meant."""

from __future__ import annotations

import ctypes
import math
import struct
from pathlib import Path

import pytest
from compiling import compiled

from lag2fmu.codegen.c import c_function, c_number, c_prototype, c_string
from lag2fmu.dynamics import Array, Function, Program, derive, lower
from lag2fmu.formats.loading import load
from lag2fmu.graph.graph import Graph

NUMBERS = [0.0, -0.0, 1.0, -1.0, 0.1, 1 / 3, -2 / 3, 1e16, 1e22, 123456789012345680.0, 9.81, 5e-324, -5e-324]
NUMBERS += [2.2250738585072014e-308, 1.7976931348623157e308, math.pi, math.nextafter(1.0, 2.0), 1e-7, 1e100]
TEXTS = [
    "",
    "plain",
    'quote "',
    "back\\slash",
    "\\",
    "??/ ??= trigraphs",
    "line\nbreak",
    "\x01" + "1",
    "tab\t",
    "%s %n",
]
TEXTS += ["\u00e4\u00f6\u00fc", "\u03b8\u0308", "\U0001f600", "*/ /* // ", "\x7f", "9" * 200]


@pytest.mark.parametrize("value", NUMBERS)
def test_a_number_is_the_shortest_that_reads_back(value: float) -> None:
    text = c_number(value)
    digits = text.strip("()")
    assert struct.pack("d", float(digits)) == struct.pack("d", value)
    assert any(mark in digits for mark in ".e"), "a constant of type double, not int"
    assert len(digits) <= 24


@pytest.mark.parametrize("value", [-1.0, -0.5, -0.0, -1e-300])
def test_a_negative_number_stands_in_parentheses(value: float) -> None:
    """``a - -1.0`` is right, ``a --1.0`` would not be: the printer must not depend on the blank."""
    assert c_number(value).startswith("(-")
    assert c_number(value).endswith(")")


def test_a_whole_number_is_a_double() -> None:
    assert c_number(2) == c_number(2.0) == "2.0"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("plain", '"plain"'),
        ('"', '"\\""'),
        ("\\", '"\\\\"'),
        ("?", '"\\?"'),
        ("\n", '"\\012"'),
        ("\u00e4", '"\\303\\244"'),
    ],
)
def test_strings_are_escaped(text: str, expected: str) -> None:
    assert c_string(text) == expected


def test_an_escape_does_not_swallow_a_digit() -> None:
    """An octal escape has at most three digits, so that \\001 followed by 1 are two characters."""
    assert c_string("\x011") == '"\\0011"'


@pytest.mark.fmu
def test_a_compiler_reads_the_same_numbers_and_strings(tmp_path: Path) -> None:
    numbers, texts = ", ".join(map(c_number, NUMBERS)), ", ".join(map(c_string, TEXTS))
    source = (
        f"extern const double NUMBERS[{len(NUMBERS)}];\n"
        f"const double NUMBERS[{len(NUMBERS)}] = {{{numbers}}};\n"
        f"extern const char *const TEXTS[{len(TEXTS)}];\n"
        f"const char *const TEXTS[{len(TEXTS)}] = {{{texts}}};\n"
    )
    library = compiled(tmp_path, {"constants.c": source})
    found = (ctypes.c_double * len(NUMBERS)).in_dll(library, "NUMBERS")
    assert struct.pack(f"{len(NUMBERS)}d", *found) == struct.pack(f"{len(NUMBERS)}d", *NUMBERS)
    strings = (ctypes.c_char_p * len(TEXTS)).in_dll(library, "TEXTS")
    assert [text.decode() for text in strings] == TEXTS


def program_of(graph: Graph, function: Function) -> Program:
    return lower(derive(load("pendulum")))._replace(graph=graph, functions=(function,))


def test_a_function_is_one_statement_an_operation() -> None:
    g = Graph()
    a, b = g.symbol("a"), g.symbol("b")
    square = g.multiply(a, a)
    value = g.add(square, g.apply("sin", b))
    function = Function(
        "f", "Says what it does.", (Array("t", (b,), True), Array("x", (a,))), ("y",), (("y", 0, value),)
    )
    assert c_prototype(function) == "void f(double t, const double x[], double y[])"
    assert c_function(program_of(g, function), function) == (
        "/* Says what it does. */\n"
        "void f(double t, const double x[], double y[])\n"
        "{\n"
        "    const double t0 = x[0] * x[0];\n"
        "    const double t1 = sin(t);\n"
        "    const double t2 = t0 + t1;\n"
        "    y[0] = t2;\n"
        "}\n"
    )


def test_unused_arguments_are_marked() -> None:
    g = Graph()
    a, b = g.symbol("a"), g.symbol("b")
    function = Function("f", "", (Array("t", (b,), True), Array("x", (a,))), ("y", "z"), (("y", 0, g.constant(-2)),))
    text = c_function(program_of(g, function), function)
    assert {"    (void)t;", "    (void)x;", "    (void)z;", "    y[0] = (-2.0);"} <= set(text.splitlines())
    assert "(void)y" not in text


def test_a_shared_subexpression_is_computed_once() -> None:
    g = Graph()
    a = g.symbol("a")
    sine = g.apply("sin", a)
    function = Function("f", "", (Array("x", (a,)),), ("y",), (("y", 0, g.multiply(sine, sine)), ("y", 1, sine)))
    assert c_function(program_of(g, function), function).count("sin(") == 1


def test_many_zeros_are_written_by_a_loop(tmp_path: Path) -> None:
    g = Graph()
    a = g.symbol("a")
    entries = [g.zero] * 3001
    entries[7], entries[3000] = a, g.one
    function = Function("f", "Zeros.", (Array("x", (a,)),), ("y",), tuple(("y", i, e) for i, e in enumerate(entries)))
    text = c_function(program_of(g, function), function)
    assert text.count("\n") < 10
    library = compiled(tmp_path, {"f.c": f"{c_prototype(function)};\n{text}"})
    y = (ctypes.c_double * 3001)(*[math.nan] * 3001)
    library.f((ctypes.c_double * 1)(2.5), y)
    assert [y[7], y[3000], sum(map(abs, y))] == [2.5, 1.0, 3.5]


def test_no_array_is_called_like_what_long_functions_hand_on() -> None:
    program = lower(derive(load("woodpecker")), variational=True)
    arrays = {array for f in program.functions for array in (*f.arrays, *(a.name for a in f.arguments))}
    assert "s" not in arrays
