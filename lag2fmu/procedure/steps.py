"""The twelve steps of the textbook procedure for deriving equations of motion, filled in for a mechanism.

The steps are those of the lecture slides "Lagrangian Dynamics" (PROCEDURE for planar mechanical systems). The formulas
of the steps come from the independent path as long as there are no frames, so that they are a second opinion; the
equations of motion are those of the FMU, of its page and of notebooks. Formulas of large mechanisms are counted instead
of written out.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import sympy as sp

from lag2fmu.description import names
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.formulas import Expressions, energies, expressions
from lag2fmu.dynamics.lagrange import derive, with_derived
from lag2fmu.language.letters import without_dots
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.procedure.drawn import drawn
from lag2fmu.procedure.hybrid import Hybrid, Law
from lag2fmu.procedure.length import (
    MAX_DEFINITIONS,
    MAX_ON_PAPER,
    long_definitions,
    operations,
    rounded,
    tidy,
    why_not_differentiated,
)
from lag2fmu.procedure.notation import LATEX, TEXT, Notation
from lag2fmu.procedure.words import axes, coordinate_words, freedom, port_sentences, pose, vector
from lag2fmu.reference.composition import Composition, between_kinks

MOST_WRITTEN = 50_000
"""Equations with more operations than this are not written at all."""
MAX_WRITTEN = (5_000, 500)
"""The most operations of equations that are written without ``full``: as text, and as LaTeX."""
MAX_ENERGIES = 500
"""The most operations of energies of frames that are written without ``full``."""
LONGEST = 600
"""The most characters of a formula without ``full``."""


Formula = tuple[str, sp.Expr]
"""A left side, in the notation of the text or of LaTeX, and the expression it equals."""


def procedure(mechanism: Mechanism, style: str = "text", *, full: bool = False, width: int = 100) -> str:
    """The twelve steps for ``mechanism`` in the ``style`` 'text', 'unicode' or 'latex'.

    'unicode' draws formulas in two dimensions where they fit into ``width`` columns. Long formulas of text are
    shortened unless they are asked for in ``full``. Raises DerivationError where the equations cannot be derived.
    """
    notation = drawn(width) if style == "unicode" else {"text": TEXT, "latex": LATEX}[style]
    equations = derive(mechanism)
    mechanism = with_derived(mechanism, equations)
    steps = _Steps(mechanism, Composition(mechanism), notation, equations, full)
    lines: list[str] = []
    for number, (title, content) in enumerate(steps.all(), start=1):
        lines += [notation.heading(number, title), *content]
    return "\n".join(lines) + "\n"


@dataclass(frozen=True)
class _Steps:
    mechanism: Mechanism
    composition: Composition
    notation: Notation
    equations: EquationsOfMotion
    full: bool

    def all(self) -> Iterator[tuple[str, Sequence[str]]]:
        """(title, lines) of each step."""
        m = self.mechanism
        rigid = [b.name for b in m.bodies if b.inertia is not None]
        particles = [b.name for b in m.bodies if b.inertia is None]
        yield (
            "Particles and rigid bodies",
            [
                self._say(
                    f"n_p = {len(particles)} particles{_listed(particles)}, n_r = {len(rigid)} bodies{_listed(rigid)}"
                ),
                *(self._say(f"{word}: {text}") for word, text in m.imprint.items()),
                *(self._say(f"{p.prefix}... are names of the part {p.of.title}") for p in m.description.parts),
            ],
        )
        yield "Degrees of freedom", [self._say(freedom(m))]
        yield (
            "Generalized coordinates",
            [
                self._say(f"{self.notation.name(q.name)}: {coordinate_words(q, new, m.stops)}")
                for q, new in zip(m.coordinates, self.equations.mechanism.coordinates, strict=True)
            ],
        )
        yield "Coordinate system", [self._say(axes(m))]
        if m.frames:
            yield from self._on_frames()
            return
        yield "Transformation equations", [*self._placed(), *self._constraints(), *self._laws(self._hybrid.contacts())]
        yield "Velocities", self._formulas(self._velocities())
        yield "Kinetic energy", self._formulas([("T", tidy(self.composition.kinetic))])
        yield "Potential energy", self._formulas([("V", tidy(self.composition.potential))])
        whole = sp.S.Zero if self._lagrangian is None else self._lagrangian
        yield "Lagrangian L = T - V", self._formulas([("L", whole)])
        yield (
            "Non-potential forces",
            [*self._formulas(self._forces()), *self._laws(self._hybrid.forces()), *self._ports()],
        )
        yield "Derivatives of L", self._derivatives()
        yield "Equations of motion", self._motion()

    def _on_frames(self) -> Iterator[tuple[str, Sequence[str]]]:
        """The steps of a spatial mechanism: its frames as they are given, without the positions composed of them."""
        m = self.mechanism
        frames = [f"frame {f.name} on {f.parent}: {pose(f)}" for f in m.frames]
        places = [
            f"{part.name} at {vector(m.location(part.name)[1])} in {m.location(part.name)[0]}" for part in m.places
        ]
        placed = [self._say(line) for line in (*frames, *places)]
        yield "Transformation equations", [*placed, *self._constraints(), *self._laws(self._hybrid.contacts())]
        yield (
            "Velocities",
            [self._say("from frame to frame: v = R^T (v_P + omega_P x d + d_dot), omega = R^T omega_P + rates")],
        )
        general = {"T": "1/2 sum (m v.v + omega.I.omega)", "V": f"- sum m a.r{' + springs' if m.springs else ''}"}
        for title, letter in (("Kinetic energy", "T"), ("Potential energy", "V")):
            formulas = [(letter, self._energies[letter])] if letter in self._energies else []
            yield title, [self._say(f"{letter} = {general[letter]}"), *(self._formulas(formulas) if formulas else [])]
        whole = [("L", self._lagrangian)] if self._lagrangian is not None else []
        told = self._say("T and V are too long to be written out; L is their difference")
        yield "Lagrangian L = T - V", self._formulas(whole) if whole else [told]
        yield "Non-potential forces", [self._say(self._acting()), *self._laws(self._hybrid.forces()), *self._ports()]
        yield "Derivatives of L", self._derivatives()
        yield "Equations of motion", self._motion()

    def _acting(self) -> str:
        """A sentence on the loads and where they act, and on the coordinates that generalized forces act on."""
        loads = [f"{load.name} at {load.point or load.body}" for load in self.mechanism.loads]
        return ", ".join([*loads, *(f"on {f.coordinate}" for f in self.mechanism.forces)]) or "none"

    def _placed(self) -> list[str]:
        """The positions of the bodies, after the long definitions that they use by name."""
        c, positions = self.composition, list(self._positions())
        constraints = (c.written(item.expression) for item in self.mechanism.constraints)
        found = long_definitions([*(x for _, x in positions), c.kinetic, c.potential, *c.forces, *constraints])
        shown = [(self.notation.name(name), x) for name, x in found[-MAX_DEFINITIONS:]]
        left_out = len(found) - len(shown)
        sentence = self._say(f"{left_out} definitions come before these and are not shown")
        return [sentence] * (left_out > 0) + self._formulas([*shown, *positions])

    # ------------------------------------------------------------------------------------------------- the steps

    def _motion(self) -> list[str]:
        """The equations of motion as on the FMU's page; for large mechanisms a sentence that says where they are."""
        if self._written is not None:
            further = [(_rate(left), right) for left, right in self._written.further]
            equations = (*self._written.motion, *further, *self._written.drives)
            return self._formulas([(self.notation.expression(left), right) for left, right in equations])
        form = "M(q, t) qdd = forcing" + " + G^T multiplier" * bool(self.mechanism.constraints)
        form += " + forces of contacts, stops, dry friction and latches" * self.mechanism.hybrid
        remedy = "" if self.full else " ('show --full' writes up to " + f"{MOST_WRITTEN} operations)"
        where = "the C code in sources/ of the FMU computes them, with shared parts named"
        return [
            self._say(f"{len(self.mechanism.coordinates)} equations {form}"),
            self._say(f"they are too long to be written out: {where}{remedy}"),
        ]

    @cached_property
    def _written(self) -> Expressions | None:
        most = MOST_WRITTEN if self.full else MAX_WRITTEN[self.notation is LATEX]
        return expressions(self.equations, most)

    @cached_property
    def _lagrangian(self) -> sp.Expr | None:
        """T - V, None where the energies of frames are too long to be written out."""
        if not self.mechanism.frames:
            return tidy(self.composition.kinetic) - tidy(self.composition.potential)
        return self._energies["T"] - self._energies["V"] if len(self._energies) == len("TV") else None

    @cached_property
    def _energies(self) -> dict[str, sp.Expr]:
        """T and V of a mechanism with frames, as far as they are short."""
        return energies(self.equations, MOST_WRITTEN if self.full else MAX_ENERGIES)

    def _constraints(self) -> list[str]:
        """The constraints as equations, each with its kind."""
        lines = []
        for constraint in self.mechanism.constraints:
            follows = f" ({constraint.coordinate} has no mass and follows)" if constraint.massless else ""
            lines.append(self._say(f"{constraint.kind} constraint {constraint.name}{follows}:"))
            written = self.notation.expression(self.composition.written(constraint.expression))
            lines.append(self.notation.formula(written, "0"))
        return lines

    @cached_property
    def _hybrid(self) -> Hybrid:
        return Hybrid(self.equations.mechanism)

    def _laws(self, laws: Iterable[Law]) -> list[str]:
        """Sentences, each with its formulas."""
        write, lines = self.notation, []
        for law in laws:
            lines.append(self._say(law.sentence))
            for left, right in law.formulas:
                lines += self._formulas(
                    [(write.name(left) if isinstance(left, str) else write.expression(left), right)]
                )
        return lines

    def _ports(self) -> list[str]:
        return [self._say(sentence) for sentence in port_sentences(self.mechanism)]

    def _positions(self) -> Iterator[Formula]:
        for body in self.mechanism.bodies:
            for axis, position in zip("xyz", body.position or (), strict=False):
                yield self.notation.name(f"{axis}_{body.name}"), self.composition.written(position)
            if body.angle is not None:
                yield self.notation.name(f"phi_{body.name}"), self.composition.written(body.angle)

    def _velocities(self) -> Iterator[Formula]:
        for body in self.mechanism.bodies:
            for axis, position in zip("xyz", body.position or (), strict=False):
                rate = self.composition.rate(self.composition.written(position))
                yield self.notation.name(names.velocity(f"{axis}_{body.name}")), rate
            if body.angle is not None:
                rate = self.composition.rate(self.composition.written(body.angle))
                yield self.notation.name(names.velocity(f"phi_{body.name}")), rate

    def _forces(self) -> Iterator[Formula]:
        """Q of each coordinate with the forces of Rayleigh's function: the right sides of the equations."""
        c = self.composition
        for q, velocity, force in zip(c.symbols.q, c.symbols.qd, c.forces, strict=True):
            yield self.notation.name(f"Q^np_{q.name}"), force - self._drag(velocity)

    def _drag(self, velocity: sp.Expr) -> sp.Expr:
        """The derivative of Rayleigh's function by ``velocity``, with the rates of dampers as they are written."""
        return sp.factor_terms(self.composition.dissipation.diff(velocity))

    def _derivatives(self) -> list[str]:
        """The terms of Lagrange's equations, coordinate by coordinate, or why they are not written out."""
        L = self._lagrangian
        why_not = "is too long" if L is None else why_not_differentiated(L)
        if L is None or why_not:
            return [self._say(f"L {why_not}: its derivatives are not written out")]
        return self._formulas(list(self._slopes(L)))

    def _slopes(self, L: sp.Expr) -> Iterator[Formula]:
        s, write = self.composition.symbols, self.notation
        for q, qd in zip(s.q, s.qd, strict=True):
            momentum = L.diff(qd)
            yield write.partial("L", write.name(qd.name)), tidy(momentum)
            yield write.total(write.partial("L", write.name(qd.name))), tidy(self.composition.rate(momentum))
            yield write.partial("L", write.name(q.name)), tidy(between_kinks(L.diff(q)))

    def _formulas(self, formulas: Iterator[Formula] | Sequence[Formula]) -> list[str]:
        lines = []
        for left, right in formulas:
            count = operations(right)
            if count > MAX_ON_PAPER:
                text = f"{left} has {rounded(count)} operations when it is written out, and is not shown"
                lines.append(self._say(text))
            else:
                lines.append(self._shortened(self.notation.formula(left, self.notation.expression(right))))
        return lines or [self._say("none")]

    def _shortened(self, line: str) -> str:
        if self.full or self.notation is LATEX or max(map(len, line.splitlines())) <= LONGEST:
            return line
        return f"{line[:LONGEST]} ... ({len(line) - LONGEST} more characters; --full writes them)"

    def _say(self, sentence: str) -> str:
        return self.notation.remark(sentence)


def _rate(derivative: sp.Symbol) -> sp.Symbol:
    """The rate of a further state, or y_ddot of a filtered motion y, for the derivative that the FMU shows."""
    state, dots = without_dots(derivative.name.removeprefix(names.derivative("")))
    return symbol(names.acceleration(state) if dots else names.velocity(state))


def _listed(items: Sequence[str]) -> str:
    return f" ({', '.join(items)})" if items else ""
