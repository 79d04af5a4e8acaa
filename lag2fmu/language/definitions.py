"""Definitions written out without exponential growth: a long definition stays a call that knows its meaning.

If each of k definitions uses the one before twice, writing all of them out takes 2**k operations. A definition that is
long or deep therefore becomes a call of ``Defined``. SymPy differentiates the call by the chain rule: its derivative is
a call of another function, whose meaning is short again.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from graphlib import TopologicalSorter
from itertools import count
from typing import ClassVar

import sympy as sp
from sympy.printing.latex import LatexPrinter
from sympy.printing.str import StrPrinter

from lag2fmu.language.vocabulary import Own, symbol, value_of

LONG = 400
"""A definition with more symbols, numbers and operations than this becomes a call."""
DEEP = 40
"""A definition with a deeper tree than this becomes a call, because SymPy walks trees by recursion."""

_NUMBERS = count()


class Defined(Own):
    """A definition, or its partial derivative ``by`` some symbols, as a function of the ``parameters`` in its ``body``.

    The body may have calls of other definitions in it.
    """

    is_number = False
    definition: ClassVar[str] = ""
    by: ClassVar[tuple[sp.Symbol, ...]] = ()
    parameters: ClassVar[tuple[sp.Symbol, ...]] = ()
    body: ClassVar[sp.Expr] = sp.S.Zero
    _partial: ClassVar[dict[int, sp.Expr]] = {}

    @property
    def meaning(self) -> sp.Expr:
        """The expression that the call stands for; it may contain calls of other definitions."""
        if self.args == self.parameters:
            return self.body
        return self.body.xreplace(dict(zip(self.parameters, self.args, strict=True)))

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """The partial derivative by the argument ``argindex``, from 1 on."""
        k = argindex - 1
        if k not in self._partial:  # from the innermost definition on, so that the recursion stays shallow
            for call in calls([self.body]):
                for inner, argument in enumerate(call.args):
                    if self.parameters[k] in argument.free_symbols:
                        call.func.partial(inner)
        return self.func.partial(k).xreplace(dict(zip(self.parameters, self.args, strict=True)))

    @classmethod
    def partial(cls, k: int) -> sp.Expr:
        """The derivative of the body by the parameter ``k`` (from 0 on): a call, or an expression as short as one."""
        if k not in cls._partial:
            derivative = cls.body.diff(cls.parameters[k])
            simple = not derivative.args or isinstance(derivative, Defined)
            cls._partial[k] = derivative if simple else define(cls.definition, derivative, (*cls.by, cls.parameters[k]))
        return cls._partial[k]

    def value(self, values: Mapping[str, float], known: dict[int, float]) -> float:
        """The value of the call at ``values`` {symbol: SI value}; each definition is evaluated once."""
        steps, (last,) = _steps_of(self)
        given = dict(values)
        for name, meaning in steps:
            given[name.name] = value_of(meaning, given)
        return value_of(last, given)

    def _sympystr(self, printer: StrPrinter) -> str:
        """The name of the definition, or its derivative as a fraction."""
        below = " ".join(f"d{printer._print(x)}" for x in self.by)
        power = str(len(self.by)) if len(self.by) > 1 else ""
        name = f"(d{power}{self.definition}/{f'({below})' if power else below})" if self.by else self.definition
        return name + ("" if self.args == self.parameters else f"({printer.stringify(self.args, ', ')})")

    def _tex(self, printer: LatexPrinter) -> str:
        name = printer._print(sp.Symbol(self.definition))
        if self.by:
            power = f"^{{{len(self.by)}}}" if len(self.by) > 1 else ""
            below = r" \, ".join(rf"\partial {printer._print(x)}" for x in self.by)
            name = rf"\frac{{\partial{power} {name}}}{{{below}}}"
        if self.args == self.parameters:
            return str(name)
        return rf"{name}\left({', '.join(printer._print(x) for x in self.args)}\right)"


@lru_cache(maxsize=1 << 14)
def define(name: str, body: sp.Expr, by: tuple[sp.Symbol, ...] = ()) -> Defined:
    """The call that stands for ``body``, the meaning of the definition ``name`` or of its derivative ``by`` symbols."""
    parameters = tuple(sorted(body.free_symbols, key=lambda s: s.name))
    members = {"definition": name, "by": by, "parameters": parameters, "body": body, "_partial": {}}
    # SymPy prints and sorts functions by their names, so no other function may have this name
    made = type(f"definition {next(_NUMBERS)}", (Defined,), {**members, "nargs": (len(parameters),)})
    call: Defined = made(*parameters)
    return call


def written_out(definitions: Mapping[str, sp.Expr]) -> dict[sp.Symbol, sp.Expr]:
    """Definition -> its expression without other definitions, those that are long or deep being calls.

    Raises CycleError where ``definitions`` use each other in a circle.
    """
    uses = {name: sorted({s.name for s in e.free_symbols} & definitions.keys()) for name, e in definitions.items()}
    done: dict[sp.Symbol, sp.Expr] = {}
    extent: dict[sp.Expr, tuple[int, int]] = {}
    for name in TopologicalSorter(uses).static_order():
        expression, own = definitions[name], symbol(name)
        length, depth = extent[own] = _extent(expression, extent)
        whole = expression.xreplace(done)
        done[own] = define(name, whole) if length > LONG or depth > DEEP else whole
    return done


def _extent(expression: sp.Expr, known: Mapping[sp.Expr, tuple[int, int]]) -> tuple[int, int]:
    """(length, depth) of ``expression``; ``known`` has those of its symbols."""
    if not expression.args:
        return known.get(expression, (1, 1))
    below = [_extent(a, known) for a in expression.args]
    return 1 + sum(length for length, _ in below), 1 + max(depth for _, depth in below)


def calls(expressions: Iterable[sp.Expr]) -> list[Defined]:
    """All calls of definitions in ``expressions`` and in their meanings; each comes after those it uses."""
    waiting, done = _own_calls(expressions)[::-1], dict[Defined, None]()
    opened: set[Defined] = set()
    while waiting:
        call = waiting[-1]
        if call in done or call in opened:
            done.setdefault(waiting.pop())
        else:
            opened.add(call)
            waiting += [inner for inner in _own_calls([call.meaning])[::-1] if inner not in done]
    return list(done)


def _own_calls(expressions: Iterable[sp.Expr]) -> list[Defined]:
    """The calls in ``expressions``, which share much: each part of them is looked at once."""
    waiting, seen, found = list(expressions)[::-1], set[sp.Basic](), list[Defined]()
    while waiting:
        e = waiting.pop()
        if e in seen:
            continue
        seen.add(e)
        if isinstance(e, Defined):
            found.append(e)
        waiting.extend(e.args[::-1])
    return found


@lru_cache(maxsize=1 << 8)
def _steps_of(call: Defined) -> tuple[list[tuple[sp.Symbol, sp.Expr]], list[sp.Expr]]:
    """``separated`` of one ``call``, kept, for a call is evaluated at many values."""
    return separated([call])


def separated(
    expressions: Sequence[sp.Expr], prefix: str = "definition "
) -> tuple[list[tuple[sp.Symbol, sp.Expr]], list[sp.Expr]]:
    """Replaces each call of a definition in ``expressions`` by a symbol; returns ([(symbol, meaning)], expressions).

    A symbol is called ``prefix`` and a number. Each meaning uses only symbols that come before it in the list.
    """
    named: dict[sp.Expr, sp.Expr] = {}
    steps: list[tuple[sp.Symbol, sp.Expr]] = []
    for number, call in enumerate(calls(expressions)):
        name = sp.Symbol(f"{prefix}{number}", real=True)
        steps.append((name, call.meaning.xreplace(named)))
        named[call] = name
    return steps, [expression.xreplace(named) for expression in expressions]
