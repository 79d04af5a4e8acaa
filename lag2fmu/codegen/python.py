"""Program -> Python text for readers: the mechanism's names, nested expressions, few temporaries.

A value that is used once is written where it is used. A value that is used again, or that would make a line too long,
gets a name. Python evaluates every expression in the order of the graph, so it rounds alike.
"""

from __future__ import annotations

import builtins
import keyword
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction

from lag2fmu.dynamics.functions import Function, Program
from lag2fmu.dynamics.tables import LOOKUPS
from lag2fmu.graph.nodes import Node
from lag2fmu.graph.operations import ADD, CONSTANT, DIVIDE, MULTIPLY, NEGATE, OPERATIONS, SUBTRACT

WIDTH = 96
"""The longest expression, in characters."""
ARGUMENTS = {"t": "t", "x": "states", "u": "inputs", "p": "parameters", "qdd": "accelerations"}
"""The names in Python of the arrays of a Function."""
RESULTS = {"M": "mass_matrix", "f": "forcing", "c": "dependent", "y": "local_variables", "dz": "rates"}
ORDINARY = {"sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "tanh", "atan2"}
"""The functions that are taken from the module math. The others it would refuse for some arguments, so that the
runtime defines them."""
BUILT_IN = {"abs", "min", "max"}

_SUM, _PRODUCT, _ATOM = 0, 1, 2
"""How tightly a text binds: one that binds less than its place asks for gets brackets."""
_RESERVED = {
    *keyword.kwlist,
    *dir(builtins),
    *(row.name for row in OPERATIONS),
    *ARGUMENTS.values(),
    *RESULTS.values(),
}
_Text = tuple[str, int]
"""An expression and how tightly it binds."""


def python_number(value: Fraction | float) -> str:
    """``value`` as Python text: the shortest decimal, or a fraction if its decimals do not end."""
    if isinstance(value, Fraction):
        decimal = Fraction(repr(float(value)))
        if decimal != value and float(value) == value.numerator / value.denominator and value.denominator < 1000:
            return f"{value.numerator} / {value.denominator}"
    number = float(value)
    return str(int(number)) if number.is_integer() and abs(number) < 1e15 else repr(number)


def python_text(text: str) -> str:
    """``text`` with escapes, so that it can stand in a docstring."""
    return text.replace("\\", "\\\\").replace('"""', "'''")


def python_names(names: Iterable[str]) -> dict[str, str]:
    """A Python name for each of ``names``: the name itself, or one with underscores if it is taken."""
    found: dict[str, str] = {}
    for name in names:
        new = name
        while new in _RESERVED or new in found.values() or _is_temporary(new):
            new += "_"
        found[name] = new
    return found


def used_functions(program: Program, functions: Iterable[Function]) -> set[str]:
    """The names of the mathematical functions that ``functions`` call, as OPERATIONS has them."""
    graph, arithmetic = program.graph, {ADD, SUBTRACT, MULTIPLY, DIVIDE, NEGATE}
    nodes = {n for f in functions for n in graph.schedule((node for *_, node in f.results), f.given)}
    codes = {graph.code[node] for node in nodes if graph.operands[node]}
    return {OPERATIONS[code].name for code in codes - arithmetic - LOOKUPS.keys()}


def python_body(program: Program, function: Function, n: int, labels: Mapping[str, Sequence[str]]) -> str:
    """The statements of ``function`` of a mechanism of ``n`` coordinates, indented by four spaces.

    ``labels`` {array: names} are the comments beside the results; M becomes a list of rows.
    """
    return "\n".join(f"    {line}" if line else "" for line in _PythonPrinter(program, function, labels).lines(n))


class _PythonPrinter:
    """Prints the body of one function."""

    def __init__(self, program: Program, function: Function, labels: Mapping[str, Sequence[str]]) -> None:
        self.graph, self.function, self.labels = program.graph, function, labels
        self.order = self.graph.schedule((node for *_, node in function.results), function.given)
        entries = [node for argument in function.arguments for node in argument.entries]
        names = python_names(str(self.graph.leaf[node]) for node in entries)
        self.text: dict[Node, _Text] = {node: (names[str(self.graph.leaf[node])], _ATOM) for node in entries}
        self.taken = set(names.values())
        self.quantities = {n: labels[a][i] for a, i, n in reversed(function.results) if a in "cy"}
        self.uses = Counter(operand for node in self.order for operand in self.graph.operands[node])
        self.uses.update(node for *_, node in function.results)

    def lines(self, n: int) -> Iterator[str]:
        """The lines of the body: arguments are unpacked, then temporaries and results are computed."""
        for argument in self.function.arguments:
            if argument.entries and not argument.scalar:
                yield from self._unpacking(argument.entries, ARGUMENTS[argument.name])
        statements = list(self._temporaries())
        yield from ["", *statements] if statements else []
        for array in self.function.arrays:
            entries = {index: node for name, index, node in self.function.results if name == array}
            yield ""
            yield from self._result(array, entries, n)
        yield f"return {', '.join(RESULTS[array] for array in self.function.arrays)}"

    def _unpacking(self, entries: Sequence[Node], source: str) -> Iterator[str]:
        names = [self.text[entry][0] for entry in entries]
        line = f"{', '.join(names)}{',' if len(names) == 1 else ''} = {source}"
        if len(line) <= WIDTH:
            yield line
            return
        yield "("
        for start in range(0, len(names), 6):
            yield f"    {', '.join(names[start : start + 6])},"
        yield f") = {source}"

    def _temporaries(self) -> Iterator[str]:
        """An assignment for each value that gets a name; also fills ``text``."""
        for node in self.order:
            if self.graph.code[node] == CONSTANT:
                text = python_number(self.graph.value(node))
                self.text[node] = (text, _PRODUCT if "/" in text else _SUM if text.startswith("-") else _ATOM)
                continue
            text, strength = self._expression(node)
            if self.uses[node] > 1 or len(text) > WIDTH:
                name = self._name(node)
                yield f"{name} = {text}"
                text, strength = name, _ATOM
            self.text[node] = (text, strength)

    def _name(self, node: Node) -> str:
        """The name that says what the quantity is, sin_theta for sin(theta); else v1, v2, ..."""
        operands = [self.text[operand][0] for operand in self.graph.operands[node]]
        name = f"v{1 + sum(map(_is_temporary, self.taken))}"
        if node in self.quantities:
            name = next(iter(python_names([self.quantities[node]]).values()))
        elif len(operands) == 1 and self.graph.code[node] != NEGATE and operands[0].isidentifier():
            name = f"{OPERATIONS[self.graph.code[node]].name}_{operands[0]}"
        while name in self.taken:
            name += "_"
        self.taken.add(name)
        return name

    def _expression(self, node: Node) -> _Text:
        code, operands = self.graph.code[node], self.graph.operands[node]
        if code in LOOKUPS:
            return self._lookup(operands, LOOKUPS[code]), _ATOM
        a = operands[0]
        if code == NEGATE:
            return f"-{self._operand(a, _ATOM)}", _SUM
        if code in (ADD, SUBTRACT):
            sign = "+" if code == ADD else "-"
            return f"{self._operand(a, _SUM)} {sign} {self._operand(operands[1], _PRODUCT)}", _SUM
        if code == MULTIPLY and a == operands[1] and self.text[a][0].isidentifier():
            return f"{self.text[a][0]}**2", _ATOM
        if code in (MULTIPLY, DIVIDE):
            sign = "*" if code == MULTIPLY else "/"
            return f"{self._operand(a, _PRODUCT)} {sign} {self._operand(operands[1], _ATOM)}", _PRODUCT
        return f"{OPERATIONS[code].name}({', '.join(self.text[o][0] for o in operands)})", _ATOM

    def _lookup(self, operands: Sequence[Node], arity: int) -> str:
        table, *orders = (int(self.graph.value(x)) for x in operands[: 1 + arity])
        arguments = [self.text[x][0] for x in operands[1 + arity :]]
        return f"lookup(TABLE_{table}, {tuple(orders)}, {', '.join(arguments)})"

    def _operand(self, node: Node, least: int) -> str:
        text, strength = self.text[node]
        return text if strength >= least else f"({text})"

    def _result(self, array: str, entries: Mapping[int, Node], n: int) -> Iterator[str]:
        """A list with one entry on each line, of M one row of the lower triangle, and a comment that names it."""
        if not entries:
            yield f"{RESULTS[array]}: list[float] = []"
            return
        yield f"{RESULTS[array]} = ["
        for row, label in enumerate(self.labels[array]):
            if array == "M":
                shown = [self.text[entries[n * row + column]][0] for column in range(row + 1)]
                yield from _wrapped(shown, label)
            else:
                yield f"    {self.text[entries[row]][0]},  # {label}"
        yield "]"


def _wrapped(entries: Sequence[str], label: str) -> Iterator[str]:
    """A row of a matrix, on several lines if it is long."""
    if len(", ".join(entries)) <= WIDTH:
        yield f"    [{', '.join(entries)}],  # {label}"
        return
    yield f"    [  # {label}"
    for entry in entries:
        yield f"        {entry},"
    yield "    ],"


def _is_temporary(name: str) -> bool:
    return name[:1] == "v" and name[1:].isdigit()
