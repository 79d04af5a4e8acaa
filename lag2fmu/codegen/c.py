"""Program -> C99: straight-line functions, one statement an operation, temporaries in depth-first order.

Numbers are printed as the shortest decimals that read back exactly. The user's names stand in comments only, so that
a coordinate may be called ``int``.
"""

from __future__ import annotations

from collections.abc import Mapping

from lag2fmu.dynamics import Function, Program
from lag2fmu.dynamics.operations import CONSTANT, OPERATIONS, SYMBOL


def c_number(value: float) -> str:
    """``value`` as a C constant of type double."""
    text = repr(float(value))
    text = text if any(mark in text for mark in ".en") else f"{text}.0"
    return f"({text})" if text.startswith("-") else text


def c_string(text: str) -> str:
    """``text`` as a C string literal of ASCII characters; others become octal escapes of their UTF-8 bytes."""
    plain = {ord('"'): '\\"', ord("\\"): "\\\\", ord("?"): "\\?"}
    return '"' + "".join(plain.get(b, chr(b) if 32 <= b < 127 else f"\\{b:03o}") for b in text.encode()) + '"'


def c_function(program: Program, function: Function) -> str:
    """The definition of ``function``."""
    graph, places = program.graph, _places(program, function)
    order = [
        n for n in graph.schedule(node for *_, node in function.results) if graph.code[n] not in (CONSTANT, SYMBOL)
    ]
    label = {node: f"t{number}" for number, node in enumerate(order)}

    def operand(node: int) -> str:
        if graph.code[node] == CONSTANT:
            return c_number(float(graph.value(node)))
        return label[node] if node in label else places[node]

    lines = []
    for node in order:
        expression = OPERATIONS[graph.code[node]].c.format(*(operand(o) for o in graph.operands(node)))
        lines.append(f"    const double {label[node]} = {expression};")
    lines += [f"    {array}[{index}] = {operand(node)};" for array, index, node in function.results]
    used = {places[node].split("[")[0] for node in graph.cone(node for *_, node in function.results) if node in places}
    unused = [a.name for a in function.arguments if a.name not in used] + [
        a for a in function.arrays if not _writes(function, a)
    ]
    lines = [f"    (void){name};" for name in unused] + lines
    return f"/* {function.doc} */\n{c_prototype(function)}\n{{\n" + "\n".join(lines) + "\n}\n"


def c_prototype(function: Function) -> str:
    """The head of ``function`` without a semicolon."""
    inputs = [f"double {a.name}" if a.scalar else f"const double {a.name}[]" for a in function.arguments]
    return f"void {function.name}({', '.join([*inputs, *(f'double {array}[]' for array in function.arrays)])})"


def _places(program: Program, function: Function) -> Mapping[int, str]:
    """How each variable is written in the body: {node: 'x[1]'}."""
    return {
        node: argument.name if argument.scalar else f"{argument.name}[{index}]"
        for argument in function.arguments
        for index, node in enumerate(argument.entries)
    }


def _writes(function: Function, array: str) -> bool:
    return any(name == array for name, *_ in function.results)
