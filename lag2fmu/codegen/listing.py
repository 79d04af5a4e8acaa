"""Program -> C99: long functions that are called rarely, as numbers instead of statements.

A compiler reads numbers at once, and takes 0.1 ms for each statement. Calls take 3 to 7 times as long as those of
statements, 1 to 2 ns for each operation, and give the same bits. See templates/engine/base/listing.h. Equal operations
stand side by side, because a processor that cannot tell which one comes next takes 5 times as long.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache

from lag2fmu.codegen.c import c_function, c_number, c_prototype
from lag2fmu.dynamics.functions import Array, Function, Program
from lag2fmu.graph.graph import Graph
from lag2fmu.graph.nodes import Node
from lag2fmu.graph.operations import CODE, CONSTANT

LONGEST = 4000
"""The most statements of a rarely called function; a longer one becomes a listing. A compiler takes .4 s for 4000."""
RUN = "listing_run("
"""What stands in a definition with a listing."""
_SIGNED = {
    "add": "+",
    "subtract": "-",
    "multiply": "*",
    "divide": "/",
    "negate": "~",
    "sqrt": "r",
    "sin": "s",
    "cos": "c",
}
SIGNS = {CODE[name]: f"'{sign}'" for name, sign in _SIGNED.items()}
"""{operation: its sign}; functions with other operations have statements."""
_MOST = 0xFFFF
"""The largest number in a listing."""
_PLACES = 4000
"""The most values that a listing works on: they take 32 kB of the stack, half of what any call may have of it."""

_Run = tuple[str, list[str]]
"""The sign of equal operations, and 'place of the result, places of two operands' for each of them."""


def c_definition(program: Program, function: Function, *, patient: bool = False) -> str:
    """The C definition of ``function``: statements, or a listing if it is long and called rarely.

    ``patient``: callers have time for the listing of any long function.
    """
    if not (patient or function.rare):
        return c_function(program, function)
    scheduled, listing = _listed(program.graph, function)
    return listing or c_function(program, function, scheduled=scheduled)


def is_long(program: Program, function: Function) -> bool:
    """Whether a patient caller may have a listing of ``function``."""
    return len(_listed(program.graph, function)[0]) > LONGEST


@lru_cache(maxsize=16)
def _listed(graph: Graph, function: Function) -> tuple[list[Node], str | None]:
    """The schedule of ``function``, and if it is long its definition with a listing, which FMUs and pages have alike.

    There is none for operations that have no sign, and for too many values.
    """
    scheduled = graph.schedule((node for *_, node in function.results), function.given)
    return scheduled, _listing(graph, function, scheduled) if len(scheduled) > LONGEST else None


def _listing(graph: Graph, function: Function, scheduled: Sequence[Node]) -> str | None:
    code = graph.code
    constants = [node for node in scheduled if code[node] == CONSTANT]
    order = [node for node in scheduled if code[node] != CONSTANT]
    if not SIGNS.keys() >= {code[node] for node in order}:
        return None
    inputs = [*(node for argument in function.arguments for node in argument.entries), *constants]
    order = _grouped(graph, order)
    places, size = _places(graph, function, inputs, order)
    if size > _PLACES:
        return None
    runs = _runs(graph, order, places)
    values = [c_number(float(graph.value(node))) for node in constants]
    return _text(function, values, runs, places, size)


def _grouped(graph: Graph, order: Sequence[Node]) -> list[Node]:
    """The nodes in another ``order`` in which operands come first: as many equal operations side by side as can be."""
    code, operands = graph.code, graph.operands
    users: dict[Node, list[Node]] = {node: [] for node in order}
    missing: dict[Node, int] = {}
    ready: dict[int, list[Node]] = {}
    for node in order:
        known = [users[operand] for operand in operands[node] if operand in users]
        for others in known:
            others.append(node)
        missing[node] = len(known)
        if not known:
            ready.setdefault(code[node], []).append(node)
    found: list[Node] = []
    while ready:
        group = max(ready.values(), key=len)
        kind = code[group[0]]
        for node in group:  # which grows
            for user in users[node]:
                missing[user] -= 1
                if not missing[user]:
                    ready.setdefault(code[user], []).append(user)
        found += ready.pop(kind)
    return found


def _places(
    graph: Graph, function: Function, inputs: Sequence[Node], order: Sequence[Node]
) -> tuple[dict[Node, int], int]:
    """Where the values of ``inputs`` and of the nodes in ``order`` stand, {node: place}, and how many places there are.

    A value that no other node needs gives its place to the next one. Those of results stay.
    """
    places = {node: place for place, node in enumerate(inputs)}
    first = size = len(inputs)
    last = {operand: node for node in order for operand in graph.operands[node]}
    last |= dict.fromkeys((node for *_, node in function.results), Node(-1))
    free: list[int] = []
    for node in order:
        operands = dict.fromkeys(graph.operands[node])
        free += [places[operand] for operand in operands if last[operand] == node and places[operand] >= first]
        if not free:
            free.append(size)
            size += 1
        places[node] = free.pop()
    return places, size


def _runs(graph: Graph, order: Sequence[Node], places: Mapping[Node, int]) -> list[_Run]:
    """The runs of equal operations on the listing; an operation with one operand has it twice."""
    runs: list[_Run] = []
    for node in order:
        sign, operands = SIGNS[graph.code[node]], graph.operands[node]
        if not runs or runs[-1][0] != sign or len(runs[-1][1]) == _MOST:
            runs.append((sign, []))
        runs[-1][1].append(f"{places[node]}, {places[operands[0]]}, {places[operands[-1]]}")
    return runs


def _text(
    function: Function, constants: Sequence[str], runs: Sequence[_Run], places: Mapping[Node, int], size: int
) -> str:
    """The definition, and before it what it reads: its constants, its listing, and where its results stand."""
    name, lines, begin = function.name, [f"double s[{size}]"], 0
    for argument in function.arguments:
        lines.append(_taken(argument, begin))
        begin += len(argument.entries)
    listing = [line for sign, rows in runs for line in (f"{sign}, {len(rows)},", *_lines(rows, 5))]
    tables = {f"unsigned short {name}_listing": listing}
    if constants:
        tables[f"double {name}_constants"] = [*_lines(constants, 4)]
        lines.append(f"memcpy(s + {begin}, {name}_constants, {len(constants)} * sizeof(double))")
    lines.append(f"{RUN}{name}_listing, {len(runs)}, s)")
    for array in function.arrays:
        found = [f"{index}, {places[node]}" for other, index, node in function.results if other == array]
        if found:
            tables[f"int {name}_{array}"] = [*_lines(found, 8)]
        lines.append(f"listing_read({name}_{array}, {len(found)}, s, {array})" if found else f"(void){array}")
    body = "".join(f"    {line};\n" for line in lines)
    head = f"/* {function.doc} */\n{c_prototype(function)}\n{{\n{body}}}\n"
    return "\n".join([*(_table(array, text) for array, text in tables.items()), head])


def _taken(argument: Array, begin: int) -> str:
    """The statement that puts an ``argument`` into s, from the place ``begin`` on."""
    if argument.scalar:
        return f"s[{begin}] = {argument.name}"
    count = len(argument.entries)
    return f"memcpy(s + {begin}, {argument.name}, {count} * sizeof(double))" if count else f"(void){argument.name}"


def _lines(items: Sequence[str], many: int) -> Iterator[str]:
    """So ``many`` of the ``items`` on each line."""
    for i in range(0, len(items), many):
        yield f"{', '.join(items[i : i + many])},"


def _table(array: str, lines: Iterable[str]) -> str:
    """The definition of a constant ``array``."""
    text = "".join(f"    {line}\n" for line in lines)
    return f"static const {array}[] = {{\n{text}}};\n"
