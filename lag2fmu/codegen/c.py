"""Program -> C99: straight-line functions, one statement for each operation, temporaries in depth-first order.

Numbers are printed as the shortest decimals that read back exactly. The user's names occur in comments only, so that
a coordinate may be called ``int``. Long functions are cut into parts, because the time of C compilers grows faster than
the length of a function. The parts pass values on in an array. None of their arrays overlaps another one.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from fractions import Fraction
from math import ceil
from textwrap import fill
from typing import TYPE_CHECKING, NamedTuple

from lag2fmu.dynamics.functions import Function, Program
from lag2fmu.dynamics.tables import LOOKUPS
from lag2fmu.graph.nodes import Node
from lag2fmu.graph.operations import CONSTANT, COSINE, OPERATIONS, SINE

if TYPE_CHECKING:
    from lag2fmu.graph.interpolants import Interpolant

MAX_STATEMENTS = 1500
"""The most statements in one C function; longer ones are cut."""
PART = 750
"""The most statements in a part of a function that is cut; half as many compile 10 % faster and run 4 % slower."""
_APART = """#if !defined(APART) && defined(__GNUC__)
#define APART __attribute__((noinline)) /* compilers would join the parts to one function again */
#elif !defined(APART)
#define APART
#endif
"""
MANY_ZEROS = 2000
"""The most zeros of an array that are set one by one; one with more is cleared by a loop."""


class Dialect(NamedTuple):
    """How values are written in C.

    - ``type``: the C type of a value.
    - ``constant``: the format string of a constant.
    - ``patterns``: {operation: format string}; other operations are written as OPERATIONS has them.
    """

    type: str
    constant: str
    patterns: Mapping[str, str]


SCALAR = Dialect("double", "{}", {})
"""The dialect of FMUs: numbers of type double."""

INTERVALS = Dialect(
    "Interval",
    "interval_of({})",
    {
        **{row.name: f"interval_{row.name}({', '.join(f'{{{i}}}' for i in range(row.arity))})" for row in OPERATIONS},
        **{"passed": "{0}", "lookup": "interval_lookup", "lookup_2": "interval_lookup_2"},
    },
)
"""The dialect of bounds: intervals.h has an operation for each operation of the graph."""


def c_number(value: float) -> str:
    """``value`` as a C constant of type double: the shortest decimal that reads back to the same bits."""
    text = repr(float(value))
    text = text if any(mark in text for mark in ".en") else f"{text}.0"
    return f"({text})" if text.startswith("-") else text


def c_combination(weights: Sequence[Fraction], vectors: str = "k", begin: str = " " * 21) -> str:
    """Entry i of sum_j weights[j] vectors[j] as C, one term on each line, without the terms of weight 0."""
    terms = [f"{c_number(float(w))} * {vectors}[{j}][i]" for j, w in enumerate(weights) if w]
    return f" +\n{begin}".join(terms) or "0.0"


def c_string(text: str) -> str:
    """``text`` as a C string literal of ASCII characters; others become octal escapes of their UTF-8 bytes."""
    plain = {ord('"'): '\\"', ord("\\"): "\\\\", ord("?"): "\\?"}
    return '"' + "".join(plain.get(b, chr(b) if 32 <= b < 127 else f"\\{b:03o}") for b in text.encode()) + '"'


def c_table(table: Interpolant, number: int) -> str:
    """The definition of the constant TABLE_``number``, see lookup.h."""
    names = [f"KNOTS_{number}_{axis}" for axis in range(table.arity)]
    lines = [_array(name, knots.tolist()) for name, knots in zip(names, table.knots, strict=True)]
    lines.append(_array(f"COEFFICIENTS_{number}", table.coefficients.ravel().tolist()))
    sizes = ", ".join(str(len(knots)) for knots in table.knots)
    fields = f"{table.degree}, OUTSIDE_{table.outside.upper()}, {{{sizes}}}, {{{', '.join(names)}}}"
    lines.append(f"static const Table TABLE_{number} = {{{fields}, COEFFICIENTS_{number}}};")
    return "\n".join(lines)


def _array(name: str, values: Sequence[float]) -> str:
    text = fill(", ".join(map(c_number, values)), 116, initial_indent="    ", subsequent_indent="    ")
    return f"static const double {name}[] = {{\n{text}\n}};"


def c_prototype(function: Function, dialect: Dialect = SCALAR) -> str:
    """The head of ``function`` without a semicolon: arguments are const arrays or numbers, results arrays."""
    return f"void {function.name}({_parameters(function, dialect.type)})"


def c_function(
    program: Program, function: Function, dialect: Dialect = SCALAR, scheduled: Sequence[Node] | None = None
) -> str:
    """The C definition of ``function``, cut into several parts if it is long.

    ``scheduled`` are the nodes of ``Program.schedule`` for the ``function``, if they are known.
    """
    return _FunctionPrinter(program, function, dialect, scheduled).text()


def _parameters(function: Function, kind: str, pointer: str = "") -> str:
    """The parameters of ``function``; arrays are written as ``pointer`` if it is given."""
    before, behind = (pointer, "") if pointer else ("", "[]")
    inputs = [f"{kind} {a.name}" if a.scalar else f"const {kind} {before}{a.name}{behind}" for a in function.arguments]
    return ", ".join([*inputs, *(f"{kind} {before}{array}{behind}" for array in function.arrays)])


class _FunctionPrinter:
    """Prints one function; statements are numbered t0, t1, ... in the order of the schedule.

    ``names`` {node: text} says how a node is written after its statement: as a variable, or in later parts of the
    function as an entry of the array s.
    """

    def __init__(
        self, program: Program, function: Function, dialect: Dialect, scheduled: Sequence[Node] | None
    ) -> None:
        self.graph, self.function, self.kind = program.graph, function, dialect.type
        self.constant = dialect.constant
        self.patterns = tuple(dialect.patterns.get(row.name, row.c) for row in OPERATIONS)
        code = self.graph.code
        scheduled = program.schedule(function) if scheduled is None else scheduled
        order = [node for node in scheduled if code[node] != CONSTANT]
        order, self.parts = self._cut(order)
        self.kept = self._kept() if len(self.parts) > 1 else {}
        self.names = {node: f"t{number}" for number, node in enumerate(order)}
        self.stores: dict[Node, list[str]] = {}
        self.cleared = self._cleared()
        self.results = self._written()
        for array, index, node in self.results:
            if node in self.names:
                self.stores.setdefault(node, []).append(f"{array}[{index}]")
        self.names |= _places(function)
        constants = {*scheduled, *(node for *_, node in self.results)}
        self.names |= {n: self._number(float(self.graph.value(n))) for n in constants if code[n] == CONSTANT}

    def _cut(self, order: list[Node]) -> tuple[list[Node], list[list[Node]]]:
        """The ``order`` of the statements, and its parts of equal lengths.

        In a function that is cut, the sine and the cosine of an angle stand side by side: compilers compute both in
        one call, but not across parts.
        """
        if len(order) <= MAX_STATEMENTS:
            return order, [order]
        code, operands = self.graph.code, self.graph.operands
        circular: dict[Node, list[Node]] = {}
        for node in order:
            if code[node] in (SINE, COSINE):
                circular.setdefault(operands[node][0], []).append(node)
        groups = (circular.pop(operands[n][0], []) if code[n] in (SINE, COSINE) else [n] for n in order)
        order = [node for group in groups for node in group]
        length = ceil(len(order) / ceil(len(order) / PART))
        return order, [order[i : i + length] for i in range(0, len(order), length)]

    def _number(self, value: float) -> str:
        return self.constant.format(c_number(value))

    def _cleared(self) -> dict[str, int]:
        """{name: length} of the arrays that a loop clears because they have many zeros."""
        zeros = Counter(array for array, _, node in self.function.results if node == self.graph.zero)
        many = {array for array, count in zeros.items() if count > MANY_ZEROS}
        return {array: 1 + max(i for a, i, _ in self.function.results if a == array) for array in sorted(many)}

    def _written(self) -> list[tuple[str, int, Node]]:
        """(array, index, node) of the results that have a statement of their own."""
        zero = self.graph.zero
        return [result for result in self.function.results if result[0] not in self.cleared or result[2] != zero]

    def _kept(self) -> dict[Node, int]:
        """The values that a later part needs: {node: index in the array s}."""
        part_of = {node: number for number, part in enumerate(self.parts) for node in part}
        kept: dict[Node, int] = {}
        for node, part in part_of.items():
            for operand in self.graph.operands[node]:
                if part_of.get(operand, part) != part:
                    kept.setdefault(operand, len(kept))
        return kept

    def text(self) -> str:
        parameters = _parameters(self.function, self.kind)
        head = f"/* {self.function.doc} */\nvoid {self.function.name}({parameters})\n"
        if len(self.parts) == 1:
            return f"{head}{{\n{self._body(0)}}}\n"
        names = [a.name for a in self.function.arguments] + list(self.function.arrays)
        own = f"{_parameters(self.function, self.kind, '*restrict ')}, {self.kind} *restrict s"
        parts, calls = [_APART], [f"    {self.kind} s[{max(1, len(self.kept))}];"]
        for number in range(len(self.parts)):
            name = f"{self.function.name}_{number + 1}"
            parts.append(f"static APART void {name}({own})\n{{\n{self._body(number)}}}\n")
            calls.append(f"    {name}({', '.join([*names, 's'])});")
        return "\n".join([*parts, head + "{\n" + "\n".join(calls) + "\n}\n"])

    def _body(self, number: int) -> str:
        """The statements of a part, after casts that silence the warning of an unused parameter."""
        lines = self._loops() if number == 0 else []
        lines += self._statements(number)
        if number == len(self.parts) - 1:
            lines += self._assignments()
        used = self._used(number)
        names = [*(a.name for a in self.function.arguments), *self.function.arrays, *(["s"] if self.kept else [])]
        lines = [*(f"    (void){name};" for name in names if name not in used), *lines]
        return "".join(f"{line}\n" for line in lines)

    def _statements(self, number: int) -> list[str]:
        """The statements of a part that compute; a result is stored right after the statement that computes it."""
        names, lines = self.names, []
        for node in self.parts[number]:
            expression = self._expression(node)
            lines.append(f"    const {self.kind} {names[node]} = {expression};")
            if node in self.kept:
                lines.append(f"    s[{self.kept[node]}] = {names[node]};")
            if node in self.stores:
                lines += [f"    {place} = {names[node]};" for place in self.stores[node]]
        names |= {node: f"s[{self.kept[node]}]" for node in self.parts[number] if node in self.kept}
        return lines

    def _loops(self) -> list[str]:
        return [
            f"    for (int i = 0; i < {n}; i++) {{ {array}[i] = {self._number(0.0)}; }}"
            for array, n in self.cleared.items()
        ]

    def _expression(self, node: Node) -> str:
        code, operands = self.graph.code[node], self.graph.operands[node]
        if code not in LOOKUPS:
            return self.patterns[code].format(*[self.names[operand] for operand in operands])
        table, *orders = (str(int(self.graph.value(x))) for x in operands[: 1 + LOOKUPS[code]])
        arguments = [self.names[x] for x in operands[1 + LOOKUPS[code] :]]
        return f"{self.patterns[code] or OPERATIONS[code].name}(&TABLE_{table}, {', '.join([*orders, *arguments])})"

    def _assignments(self) -> list[str]:
        """The results that are constants or arguments."""
        return [f"    {array}[{index}] = {self.names[node]};" for array, index, node in self._given()]

    def _given(self) -> list[tuple[str, int, Node]]:
        stored = self.stores
        return [result for result in self.results if result[2] not in stored]

    def _used(self, number: int) -> set[str]:
        """The parameters that a part reads or writes."""
        part, kept = set(self.parts[number]), self.kept
        read = {operand for node in part for operand in self.graph.operands[node]}
        used = {array for array, _, node in self.results if node in part}
        used |= {*self.cleared} if number == 0 else set()
        if number == len(self.parts) - 1:
            used |= {array for array, *_ in self._given()}
            read |= {node for *_, node in self._given()}
        used |= {a.name for a in self.function.arguments if not read.isdisjoint(a.entries)}
        return used if kept.keys().isdisjoint(read | part) else used | {"s"}


def _places(function: Function) -> Mapping[Node, str]:
    """How each variable is written in the body: {node: 'x[1]'}."""
    return {
        node: argument.name if argument.scalar else f"{argument.name}[{index}]"
        for argument in function.arguments
        for index, node in enumerate(argument.entries)
    }
