"""Functions of arrays on a graph: what the code generators print."""

from __future__ import annotations

from dataclasses import dataclass

from lag2fmu.errors import DerivationError
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.operations import SYMBOL


@dataclass(frozen=True)
class Array:
    """An argument: ``name`` in the printed code and its entries as nodes; ``scalar`` if it is a plain number."""

    name: str
    entries: tuple[Node, ...]
    scalar: bool = False


@dataclass(frozen=True)
class Function:
    """array[index] = node for each (array, index, node) in ``results``; other entries of the arrays stay untouched.

    ``name`` and ``doc`` stand in the printed code. ``arrays`` are the names of the arrays that it fills, in order.
    """

    name: str
    doc: str
    arguments: tuple[Array, ...]
    arrays: tuple[str, ...]
    results: tuple[tuple[str, int, Node], ...]

    @property
    def given(self) -> frozenset[Node]:
        """The nodes that are entries of arguments and need not be computed."""
        return frozenset(entry for argument in self.arguments for entry in argument.entries)

    def check(self, graph: Graph) -> Function:
        """The function itself. Raises DerivationError if a result depends on a variable that no argument holds."""
        needed, given = graph.cone((node for *_, node in self.results), self.given), self.given
        missing = [str(graph.leaf[node]) for node in needed if graph.code[node] == SYMBOL and node not in given]
        if missing:
            raise DerivationError(
                f"{self.name} needs {', '.join(missing)}, which are none of its arguments; "
                "this is a fault of lag2fmu, please report it with the model"
            )
        return self
