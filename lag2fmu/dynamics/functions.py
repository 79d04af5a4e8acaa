"""The record ``Program``: the functions of arrays that the code generators print."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate
from typing import TYPE_CHECKING, NamedTuple

from lag2fmu.errors import DerivationError
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.operations import SYMBOL

if TYPE_CHECKING:
    from lag2fmu.dynamics.row_tables import SparseRows


class Array(NamedTuple):
    """An argument: its ``name`` in the printed code, and its entries as nodes; ``scalar`` if it is no array there."""

    name: str
    entries: tuple[Node, ...]
    scalar: bool = False


@dataclass(frozen=True)
class Function:
    """array[index] = node for each (array, index, node) in ``results``; other entries of the arrays stay untouched.

    ``name`` and ``doc`` stand in the printed code. ``arrays`` are the names of the arrays that it fills, in order.
    ``rare``: runs call it so rarely that its time does not matter; it is the same function in a run that does not.
    """

    name: str
    doc: str
    arguments: tuple[Array, ...]
    arrays: tuple[str, ...]
    results: tuple[tuple[str, int, Node], ...]
    rare: bool = field(default=False, compare=False)

    @property
    def given(self) -> frozenset[Node]:
        """The nodes that are entries of arguments and need not be computed."""
        return frozenset(entry for argument in self.arguments for entry in argument.entries)

    def missing(self, graph: Graph) -> list[str]:
        """The names of the variables that the results need and no argument holds."""
        needed, given = graph.cone((node for *_, node in self.results), self.given), self.given
        return [str(graph.leaf[node]) for node in needed if graph.code[node] == SYMBOL and node not in given]

    def check(self, graph: Graph) -> Function:
        """Returns the function itself; raises DerivationError if a result needs a variable that no argument holds."""
        missing = self.missing(graph)
        if missing:
            raise DerivationError(
                f"{self.name} needs {', '.join(missing)}, which are none of its arguments; "
                "this is a fault of lag2fmu, please report it with the model"
            )
        return self


def filling(name: str, doc: str, arguments: tuple[Array, ...], **arrays: Iterable[Node]) -> Function:
    """A function that fills ``arrays`` with nodes."""
    results = tuple((array, index, node) for array, nodes in arrays.items() for index, node in enumerate(nodes))
    return Function(name, doc, arguments, tuple(arrays), results)


def nodes_of(graph: Graph, functions: Sequence[Function]) -> list[Node]:
    """All nodes that the results and the arguments of ``functions`` are made of; operands stand before their users."""
    entries = [node for f in functions for a in f.arguments for node in a.entries]
    return graph.cone([*entries, *(node for f in functions for *_, node in f.results)])


def with_nodes(functions: Sequence[Function], new: Mapping[Node, Node]) -> list[Function]:
    """``functions`` with nodes replaced in arguments and results by ``new`` {node: what stands for it}."""
    return [
        replace(
            f,
            arguments=tuple(a._replace(entries=tuple(new[node] for node in a.entries)) for a in f.arguments),
            results=tuple((array, index, new[node]) for array, index, node in f.results),
        )
        for f in functions
    ]


class TableArgument(NamedTuple):
    """An argument of a table that has no value outside ``least`` to ``greatest``, both in SI units.

    ``position`` is its place among the arguments of the table, counted from 1.
    """

    table: str
    position: int
    least: float
    greatest: float


class EventFunction(NamedTuple):
    """A function whose zeros are events: its ``name`` for messages, its ``nominal`` size in SI units.

    ``timed``: whether it depends on nothing but the time and parameters.
    """

    name: str
    nominal: float
    timed: bool = False


class Program(NamedTuple):
    """The functions of one mechanism on one graph, and the names of the entries of the FMU's vectors.

    - ``locals``: the names of the entries of ``mechanism_locals``.
    - ``dependent``: the names of the entries of ``mechanism_dependent``.
    - ``method``: how M qdd = forcing is solved, one of ACCELERATION_METHODS.
    - ``factor_size``: the length of the array that ``mechanism_factor`` hands to ``mechanism_solve``.
    - ``signals``: the length of u, the inputs with their rates.
    - ``outputs``: the names of the outputs beside q and qd; each of them has a second time derivative.
    - ``arguments``: those that ``mechanism_arguments`` evaluates.
    - ``masks``: the number of entries at the beginning of p that are numbers of the modes of contacts, dry frictions
      and latches, see ``modes.Modes``.
    - ``switches``: the number of entries of p behind these, which are +1 or -1 for each kink. The switches of the
      latches are the last ones.
    - ``places``: the places of the rows that modes switch, among all ``constraints``.
    - ``slips``: for each contact and stop, the number of rows that it slips along, (U,).
    - ``frictions``, ``latches``: the numbers of dry frictions and of latches.
    - ``loaded_friction``: whether a dry friction depends on what constraints, joints and contacts bear.
    - ``changing_friction``, ``changing_restitution``: whether a contact's coefficient of friction, or of restitution,
      changes with the state, inputs or time.
    - ``offsets``: the number of latches that hold positions.
    - ``event_functions``: those of the switches, and behind them those of contacts and dry frictions.
    - ``timed_bounds``: the margins and their rates of those switches that depend on nothing but the time and
      parameters, to be evaluated on intervals; None without such switches.
    - ``simultaneous``: how simultaneous impacts are resolved.
    - ``sparse_rows``: the rows for time stepping; None for other solvers.
    """

    graph: Graph
    functions: tuple[Function, ...]
    method: str
    factor_size: int
    inputs: tuple[str, ...]
    locals: tuple[str, ...]
    dependent: tuple[str, ...]
    outputs: frozenset[str] = frozenset()
    signals: int = 0
    arguments: tuple[TableArgument, ...] = ()
    constraints: int = 0
    places: tuple[int, ...] = ()
    slips: tuple[int, ...] = ()
    masks: int = 0
    switches: int = 0
    event_functions: tuple[EventFunction, ...] = ()
    timed_bounds: Function | None = None
    frictions: int = 0
    loaded_friction: bool = False
    changing_friction: bool = False
    changing_restitution: bool = False
    latches: int = 0
    offsets: int = 0
    simultaneous: bool = False
    sparse_rows: SparseRows | None = None

    @property
    def unilaterals(self) -> int:
        """The number of contacts and stops."""
        return len(self.slips)

    @property
    def slip_rows(self) -> tuple[int, ...]:
        """The first slip of each contact among the rows, and behind them the end of all slips."""
        return tuple(accumulate(self.slips, initial=len(self.slips)))

    @property
    def latch_switches(self) -> tuple[int, ...]:
        """The index of the switch that each latch obeys."""
        return tuple(range(self.switches - self.latches, self.switches))

    @property
    def permanent(self) -> tuple[int, ...]:
        """The places of the permanent constraints among all constraints, in order; ``places`` are those of the rows."""
        return tuple(k for k in range(self.constraints) if k not in self.places)

    @property
    def contact_events(self) -> int:
        """The number of event functions of contacts and dry frictions: two for a contact, one for a dry friction."""
        return len(self.event_functions) - self.switches

    @property
    def hybrid(self) -> bool:
        """Whether the equations of motion change at events."""
        return bool(self.event_functions)

    @property
    def resting(self) -> int:
        """The number of further states that events alone change, so that their rates are 0; they are the last ones."""
        rates = [node for f in self.functions if f.name == "mechanism_further" for *_, node in f.results]
        moving = [i for i, node in enumerate(rates, start=1) if node != self.graph.zero]
        return len(rates) - max(moving, default=0)

    @property
    def still(self) -> int:
        """The length of the array that ``mechanism_stepping`` hands to ``mechanism_forcing``."""
        return sum(len(f.arguments[-1].entries) for f in self.functions if f.name == "mechanism_forcing")

    @property
    def has_adjoints(self) -> bool:
        """Whether there are functions for adjoint derivatives, see ``adjoint.with_adjoints``."""
        return any(f.name == "mechanism_adjoint" for f in self.functions)

    def contains(self, variable: str) -> bool:
        """Whether the equations of motion or constraints contain the ``variable``; the time is 't'."""
        functions = {f"mechanism_{name}" for name in ("dynamics", "constrained", "switches", "rows", "further")}
        equations = [f for f in self.functions if f.name in functions]
        return variable in self.graph.symbols([node for f in equations for *_, node in f.results])

    def schedule(self, function: Function) -> list[Node]:
        """The nodes that ``function`` computes, and the constants among them, in depth-first order."""
        return self.graph.schedule((node for *_, node in function.results), function.given)

    def operations(self, name: str) -> int:
        """The number of arithmetic operations and function calls of the function ``name``."""
        function = next(f for f in self.functions if f.name == name)
        return self.graph.operations((node for *_, node in function.results), function.given)


def with_held_inputs(program: Program, wanted: Container[str]) -> Program:
    """``program`` with only those of its functions whose names are ``wanted``, and inputs held: u has no rates."""
    k = len(program.inputs)
    if program.signals == k:
        return program
    graph, functions = program.graph.copy(), list[Function]()
    for f in program.functions:
        if f.name in wanted:
            rates = [node for a in f.arguments if a.name == "u" for node in a.entries[k:]]
            nodes = graph.substitute([node for *_, node in f.results], dict.fromkeys(rates, graph.zero))
            arguments = tuple(a._replace(entries=a.entries[:k]) if a.name == "u" else a for a in f.arguments)
            results = tuple((array, i, node) for (array, i, _), node in zip(f.results, nodes, strict=True))
            functions.append(replace(f, arguments=arguments, results=results))
    return program._replace(graph=graph, signals=k, functions=tuple(functions))
