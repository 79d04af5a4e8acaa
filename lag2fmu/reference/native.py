"""The terms of the equations at single states, compiled: the expressions of the independent path as C, for integration.

``native.c`` does at one state what ``equations`` does with NumPy for a batch. The C functions of the mechanism are
written here, from the same expressions. The compiler is zig, a dependency of lag2fmu; without it NumPy does everything.
"""

from __future__ import annotations

import ctypes
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from platform import machine
from typing import Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from lag2fmu.building.build_cache import kept
from lag2fmu.building.process import of_processor_alone, run, zig, zig_version
from lag2fmu.errors import BuildError
from lag2fmu.language.rebuilding import replaced
from lag2fmu.language.vocabulary import NAME_OF, TIME, Choice
from lag2fmu.reference.composition import Composition
from lag2fmu.reference.constraints import constraint_expressions
from lag2fmu.reference.functions import NumericPrinter, number, shared
from lag2fmu.reference.spatial import Spatial

Function = Any
"""A function of a library, as ctypes has it."""

_SMALL_POWER = 8
"""The greatest whole power that is written as products."""
_SOURCE = "native.c"


class _CPrinter(NumericPrinter):
    """Prints C that calls the functions of native.c; every number is a double."""

    def _print_Function(self, expr: sp.Expr) -> str:
        name = NAME_OF[expr.func]
        arguments = [self._print(x) for x in (expr.args[:1] if isinstance(expr, sp.Heaviside) else expr.args)]
        if name not in {"min", "max"}:
            return f"z_{name}({', '.join(arguments)})"
        nested: str = arguments[0]
        for argument in arguments[1:]:
            nested = f"z_{name}({nested}, {argument})"
        return nested

    _print_Abs = _print_Heaviside = _print_Min = _print_Max = _print_LatticeOp = _print_Function

    def _print_Choice(self, expr: Choice) -> str:
        margin, a, b = (self._print(x) for x in expr.args)
        return f"z_choice({margin}, {a}, {b})"

    def _print_Pow(self, expr: sp.Expr, rational: bool = False) -> str:
        base, exponent = self._print(expr.base), expr.exp
        if exponent.is_Integer and abs(int(exponent)) <= _SMALL_POWER:
            return f"z_inverse({base})" if exponent == -1 else f"z_integer_power({base}, {int(exponent)})"
        if abs(exponent) == sp.S.Half:
            return f"z_sqrt({base})" if exponent > 0 else f"z_inverse(z_sqrt({base}))"
        return f"z_power({base}, {self._print(exponent)})"

    def _print_Integer(self, expr: sp.Expr) -> str:
        return number(expr)

    def _print_Rational(self, expr: sp.Expr) -> str:
        return number(expr)

    def _print_Float(self, expr: sp.Expr) -> str:
        return repr(float(expr))

    def _print_Pi(self, expr: sp.Expr) -> str:
        return repr(float(np.pi))

    _print_Zero = _print_One = _print_NegativeOne = _print_Integer
    _print_Half = _print_Rational


class _Tape:
    """Lines of C, each of which computes a value that is used later; equal lines stand once."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._known: dict[str, _Traced] = {}

    def value(self, text: str) -> _Traced:
        """The value of ``text``, an expression of earlier ones."""
        if text not in self._known:
            name = f"s{len(self._known)}"
            self.lines.append(f"const Z {name} = {text};")
            self._known[text] = _Traced(self, name)
        return self._known[text]

    def values(self, texts: Sequence[str]) -> NDArray[Any]:
        """The values of ``texts``, an array of objects (k,)."""
        return np.array([self.value(text) for text in texts], dtype=object)

    def root(self, x: Any) -> _Traced:
        """The square root of ``x``."""
        return self.value(f"z_sqrt({_named(x)})")


class _Traced:
    """A number that writes its operations on the tape; operations with zeros and ones of matrices write nothing."""

    def __init__(self, tape: _Tape, name: str) -> None:
        self.tape, self.name = tape, name

    def __add__(self, other: Any) -> Any:
        return self._with(other, "{0} + {1}", zero=self)

    def __radd__(self, other: Any) -> Any:
        return self._with(other, "{1} + {0}", zero=self)

    def __sub__(self, other: Any) -> Any:
        return self._with(other, "{0} - {1}", zero=self)

    def __rsub__(self, other: Any) -> Any:
        return self._with(other, "{1} - {0}", zero=None)

    def __mul__(self, other: Any) -> Any:
        return self if _is(other, 1) else self._with(other, "{0} * {1}", zero=0)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Any:
        return self._with(other, "{0} * z_inverse({1})", zero=None)

    def _with(self, other: Any, formula: str, zero: Any) -> Any:
        """``formula`` of both numbers; ``zero``, if it is given, where ``other`` is 0. Arrays go entry by entry."""
        if isinstance(other, np.ndarray):
            return NotImplemented
        if zero is not None and _is(other, 0):
            return zero
        return self.tape.value(formula.format(self.name, _named(other)))

    def __neg__(self) -> _Traced:
        return self.tape.value(f"-{self.name}")

    def __pow__(self, exponent: int) -> _Traced:
        return self.tape.value(f"z_integer_power({self.name}, {exponent})")


def _is(value: object, number: int) -> bool:
    return isinstance(value, (int, float)) and value == number


def _named(value: object) -> str:
    return value.name if isinstance(value, _Traced) else repr(float(value))  # type: ignore[arg-type]


@lru_cache(maxsize=16)
def native_terms(composition: Composition) -> Function | None:
    """The function ``terms`` of native.c for a ``composition``, compiled and kept; values are in SI units.

    None without a compiler, and for a mechanism with tables, which SciPy evaluates.
    """
    if find_spec("ziglang") is None or composition.mechanism.tables:
        return None
    here = f"{machine()}-linux-gnu.2.17"
    target = ["-target", here, *of_processor_alone(here)] if sys.platform == "linux" else []
    # complex products ignore infinities, because care for them makes clang ten times as slow
    flags = [*target, "-std=c99", "-O1", "-fcx-limited-range", "-ffp-contract=off", "-fno-math-errno", "-g0"]
    flags += ["-fPIC", "-shared"]
    texts = {"mechanism.h": _header(composition), _SOURCE: Path(__file__).with_name(_SOURCE).read_text("utf-8")}
    try:
        library = kept((zig_version(), flags, sorted(texts.items())), lambda: _library(flags, texts))
        with tempfile.TemporaryDirectory(prefix="lag2fmu-", ignore_cleanup_errors=True) as folder:
            Path(folder, "terms").write_bytes(library)
            function = ctypes.CDLL(str(Path(folder, "terms"))).terms
    except (OSError, BuildError):
        return None
    function.argtypes, function.restype = [ctypes.c_void_p] * 4, None
    return function


def _library(flags: Sequence[str], texts: Mapping[str, str]) -> bytes:
    """The shared library of the C files ``texts`` {name: text}. Raises BuildError, OSError."""
    command = [zig(), "cc", *flags, "-o", "terms", _SOURCE, "-lm"]
    with tempfile.TemporaryDirectory(prefix="lag2fmu-", ignore_cleanup_errors=True) as folder:
        for name, text in texts.items():
            Path(folder, name).write_text(text, "utf-8")
        run(command, Path(folder))
        return Path(folder, "terms").read_bytes()


def _header(c: Composition) -> str:
    """What native.c includes: sizes, and the functions of a mechanism."""
    s, m = c.symbols, len(c.mechanism.constraints)
    spatial = Spatial(c, ())
    rates = [sp.Dummy("rate", real=True) for _ in range(spatial.rated)]
    efforts = spatial.efforts(rates)
    sizes = {"N": len(s.q), "MOTIONS": len(s.motion), "OTHERS": len(s.plain) + len(s.external) + len(s.further), "M": m}
    sizes |= {"RATES": len(rates), "EFFORTS": len(efforts)}
    constants = {p: sp.Symbol(f"p[{i}]", real=True) for i, p in enumerate(s.parameters)}
    configuration = (TIME, *s.q, *s.qd, *s.motion, *s.motion_dot)
    everything = (TIME, *s.q, *s.qd, *s.inputs)
    return "\n".join(
        [
            *(f"#define {name} {size}" for name, size in sizes.items()),
            _meetings(c, spatial),
            _energies(c, spatial, _renamed(configuration) | constants),
            *_loads(spatial, efforts, _renamed(configuration) | constants, _renamed((*everything, *rates)) | constants),
            _function("forces", "double", c.forces, _renamed(everything) | constants),
            _function("constraints", "double", constraint_expressions(c), _renamed(everything) | constants),
            "",
        ]
    )


def _meetings(c: Composition, spatial: Spatial) -> str:
    """The C table MEETS (n, n): whether the velocities of two coordinates stand in one term of K.

    Where they do not, the entry of the mass matrix is 0, as in a row of masses.
    """
    velocities, n = c.symbols.qd, len(c.symbols.qd)
    moved = {v: i for i, v in enumerate(velocities)}
    meets = np.full((n, n), not spatial.empty)
    for term in _terms(c.velocity_part()[0], set(velocities)):
        found = [moved[v] for v in term.free_symbols & moved.keys()]
        meets[np.ix_(found, found)] = True
    rows = ", ".join("{" + ", ".join(str(int(x)) for x in row) + "}" for row in meets)
    return f"static const char MEETS[N][N] = {{{rows}}};"


def _terms(expression: sp.Expr, velocities: set[sp.Symbol]) -> Iterator[sp.Expr]:
    """The terms that an ``expression`` is the sum of, up to factors without ``velocities``."""
    if expression.is_Add:
        for term in expression.args:
            yield from _terms(term, velocities)
        return
    moving = [x for x in sp.Mul.make_args(expression) if x.free_symbols & velocities]
    if len(moving) == 1 and moving[0] is not expression:
        yield from _terms(moving[0], velocities)
    else:
        yield expression


def _renamed(arguments: Sequence[sp.Symbol]) -> dict[sp.Symbol, sp.Symbol]:
    return {old: sp.Symbol(f"a[{i}]", real=True) for i, old in enumerate(arguments)}


def _energies(c: Composition, spatial: Spatial, names: dict[sp.Symbol, sp.Symbol]) -> str:
    """The C function of K, U, R, see ``EnergyFunctions.velocity_part``; parts on frames are composed line by line."""
    own = (*c.velocity_part(), c.dissipation)
    lines, written, tape = *_written([*own, *spatial.expressions], names), _Tape()
    sums = written[: len(own)]
    if not spatial.empty:
        framed = spatial.terms(tape.values(written[len(own) :]), tape.root, 0)
        sums = [f"{text} + {_named(x)}" for text, x in zip(sums, framed, strict=True)]
    return _body("energies", "Z", [*lines, *tape.lines], sums)


def _loads(
    spatial: Spatial,
    efforts: Sequence[sp.Expr],
    configuration: dict[sp.Symbol, sp.Symbol],
    everything: dict[sp.Symbol, sp.Symbol],
) -> Iterator[str]:
    """The C functions rates, efforts and power of the loads and dampers on frames.

    ``configuration`` and ``everything`` {symbol: its name in C} are the arguments of the functions.
    """
    if not efforts:
        yield from (
            _body(name, kind, [], []) for name, kind in (("rates", "double"), ("efforts", "double"), ("power", "Z"))
        )
        return
    lines, values = _written(spatial.expressions, configuration)
    tape = _Tape()
    rates = spatial.rates(tape.values(values), tape.root)
    yield _body("rates", "double", [*lines, *tape.lines], [_named(x) for x in rates])
    yield _function("efforts", "double", efforts, everything)
    tape = _Tape()
    given = tape.values([f"a[ROWS + {i}]" for i in range(len(efforts))])
    power = spatial.power(tape.values(values), [*given], tape.root)
    yield _body("power", "Z", [*lines, *tape.lines], [_named(power)])


def _function(name: str, kind: str, expressions: Sequence[sp.Expr], names: dict[sp.Symbol, sp.Symbol]) -> str:
    return _body(name, kind, *_written(expressions, names))


def _written(expressions: Sequence[sp.Expr], names: dict[sp.Symbol, sp.Symbol]) -> tuple[list[str], list[str]]:
    """Lines of common subexpressions, and the texts of ``expressions``, in C."""
    printer = _CPrinter({"order": "none"})
    common, left = shared([replaced(x, names) for x in expressions])
    return [f"const Z {name} = {printer.doprint(x)};" for name, x in common], [printer.doprint(x) for x in left]


def _body(name: str, kind: str, lines: Sequence[str], results: Sequence[str]) -> str:
    wrapped = "creal({})" if kind == "double" else "{}"
    assigned = [f"out[{i}] = {wrapped.format(text)};" for i, text in enumerate(results)]
    inner = "\n    ".join(["(void)a; (void)p; (void)out;", *lines, *assigned])
    return f"static void {name}(const Z a[], const double p[], {kind} out[]) {{\n    {inner}\n}}"
