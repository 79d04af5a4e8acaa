"""Program -> C99: straight-line functions, one statement an operation, temporaries in depth-first order.

Numbers are printed as the shortest decimals that read back exactly. The user's names stand in comments only, so that
a coordinate may be called ``int``. Long functions are cut into parts that hand values on in an array, for the time of
C compilers grows faster than the length of a function.
"""

from __future__ import annotations

from collections.abc import Mapping

from lag2fmu.dynamics import Function, Program
from lag2fmu.dynamics.operations import CONSTANT, OPERATIONS

MAX_STATEMENTS = 1500
"""Statements in one C function; compilers are near linear up to a few thousand."""


def c_number(value: float) -> str:
    """``value`` as a C constant of type double."""
    text = repr(float(value))
    text = text if any(mark in text for mark in ".en") else f"{text}.0"
    return f"({text})" if text.startswith("-") else text


def c_string(text: str) -> str:
    """``text`` as a C string literal of ASCII characters; others become octal escapes of their UTF-8 bytes."""
    plain = {ord('"'): '\\"', ord("\\"): "\\\\", ord("?"): "\\?"}
    return '"' + "".join(plain.get(b, chr(b) if 32 <= b < 127 else f"\\{b:03o}") for b in text.encode()) + '"'


def c_prototype(function: Function) -> str:
    """The head of ``function`` without a semicolon."""
    return f"void {function.name}({_parameters(function)})"


def c_function(program: Program, function: Function) -> str:
    """The definition of ``function``, of several parts if it is long."""
    return _Printer(program, function).text()


def _parameters(function: Function) -> str:
    inputs = [f"double {a.name}" if a.scalar else f"const double {a.name}[]" for a in function.arguments]
    return ", ".join([*inputs, *(f"double {array}[]" for array in function.arrays)])


class _Printer:
    """Prints one function; statements are numbered t0, t1, ... in the order of the schedule."""

    def __init__(self, program: Program, function: Function) -> None:
        self.graph, self.function = program.graph, function
        self.places = _places(function)
        scheduled = self.graph.schedule((node for *_, node in function.results), function.given)
        order = [node for node in scheduled if self.graph.code[node] != CONSTANT]
        self.parts = [order[i : i + MAX_STATEMENTS] for i in range(0, len(order), MAX_STATEMENTS)] or [[]]
        self.part_of = {node: number for number, part in enumerate(self.parts) for node in part}
        self.label = {node: f"t{number}" for number, node in enumerate(order)}
        self.kept = self._kept()

    def _kept(self) -> dict[int, int]:
        """The values that a later part needs: {node: index in the array s}."""
        kept: dict[int, int] = {}
        for node, part in self.part_of.items():
            for operand in self.graph.operands[node]:
                if self.part_of.get(operand, part) != part:
                    kept.setdefault(operand, len(kept))
        return kept

    def text(self) -> str:
        head = f"/* {self.function.doc} */\n{c_prototype(self.function)}\n"
        if len(self.parts) == 1:
            lines = self._statements(0) + self._assignments()
            return f"{head}{{\n{self._body(lines)}}}\n"
        names = [a.name for a in self.function.arguments] + list(self.function.arrays)
        parts, calls = [], [f"    double s[{max(1, len(self.kept))}];"]
        for number in range(len(self.parts)):
            last = self._assignments() if number == len(self.parts) - 1 else []
            parameters = f"{_parameters(self.function)}, double s[]"
            name = f"{self.function.name}_{number + 1}"
            body = self._body(self._statements(number) + last, also=["s"])
            parts.append(f"static void {name}({parameters})\n{{\n{body}}}\n")
            calls.append(f"    {name}({', '.join([*names, 's'])});")
        return "\n".join([*parts, head + "{\n" + "\n".join(calls) + "\n}\n"])

    def _statements(self, number: int) -> list[str]:
        """The statements of a part; results are stored as soon as they are there."""
        results: dict[int, list[str]] = {}
        for array, index, node in self.function.results:
            if node in self.part_of:
                results.setdefault(node, []).append(f"    {array}[{index}] = {self.label[node]};")
        lines = []
        for node in self.parts[number]:
            operands = (self._operand(o, number) for o in self.graph.operands[node])
            expression = OPERATIONS[self.graph.code[node]].c.format(*operands)
            lines.append(f"    const double {self.label[node]} = {expression};")
            if node in self.kept:
                lines.append(f"    s[{self.kept[node]}] = {self.label[node]};")
            lines += results.get(node, [])
        return lines

    def _assignments(self) -> list[str]:
        """The results that are constants or arguments."""
        return [
            f"    {array}[{index}] = {self._operand(node, 0)};"
            for array, index, node in self.function.results
            if node not in self.part_of
        ]

    def _operand(self, node: int, part: int) -> str:
        if node in self.places:
            return self.places[node]
        if self.graph.code[node] == CONSTANT:
            return c_number(float(self.graph.value(node)))
        return self.label[node] if self.part_of[node] == part else f"s[{self.kept[node]}]"

    def _body(self, lines: list[str], also: list[str] | None = None) -> str:
        """``lines``, after casts that silence the warning of an unused parameter."""
        body = "\n".join(lines)
        names = [*(a.name for a in self.function.arguments), *self.function.arrays, *(also or [])]
        scalars = {a.name for a in self.function.arguments if a.scalar}
        unused = [name for name in names if not _uses(body, name, name in scalars)]
        return "".join(f"    (void){name};\n" for name in unused) + (body + "\n" if body else "")


def _uses(body: str, name: str, scalar: bool) -> bool:
    """Whether an array or scalar parameter stands in ``body``; temporaries are called t0, t1, ..., never t."""
    if not scalar:
        return f" {name}[" in body or f"({name}[" in body or f"-{name}[" in body
    padded = body.replace("(", " ").replace(")", " ").replace(";", " ").replace("-", " ").replace(",", " ")
    return f" {name} " in padded


def _places(function: Function) -> Mapping[int, str]:
    """How each variable is written in the body: {node: 'x[1]'}."""
    return {
        node: argument.name if argument.scalar else f"{argument.name}[{index}]"
        for argument in function.arguments
        for index, node in enumerate(argument.entries)
    }
