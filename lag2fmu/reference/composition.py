"""The energies and forces of a mechanism as expressions, composed from the record and nothing else.

T by Koenig's theorem, T = 1/2 m v^2 + 1/2 I w^2 (J. Koenig, 1751; H. Goldstein, Classical Mechanics, section 1.2), with
v = (dr/dq) qd + dr/dt + (dr/dy) y_dot for motion inputs y; generalized forces Q = F . dr/dq (Goldstein, section 1.4).
Only positions and angles are differentiated here. All expressions are in SI units. Parts on frames are left out,
because their composed expressions would grow without bounds; ``spatial`` adds these parts as numbers.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import sympy as sp

from lag2fmu.description.names import acceleration
from lag2fmu.description.outputs import TURNING, Output
from lag2fmu.description.parts import Damper, Load
from lag2fmu.description.places import Body
from lag2fmu.description.tables import Table
from lag2fmu.language.definitions import calls, written_out
from lag2fmu.language.rebuilding import replaced
from lag2fmu.language.vocabulary import NAME_OF, TIME, Choice, symbol
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.momenta import in_fixed_frame
from lag2fmu.reference.symbols import Symbols, symbols_of
from lag2fmu.reference.tables import with_data

Vector = tuple[sp.Expr, ...]


def composition_of(mechanism: Mechanism) -> Composition:
    """The composition of ``mechanism``; the compositions made last are kept for further calls."""
    return _composition(mechanism, mechanism.coordinates, mechanism.constraints)


@lru_cache(maxsize=16)
def _composition(mechanism: Mechanism, *_derived: object) -> Composition:
    """The composition of a mechanism with these starts and constraints.

    Starts and constraints are arguments of their own, because two mechanisms count as equal even if derivation has
    added different starts and constraints to them.
    """
    return Composition(mechanism)


@dataclass(frozen=True, eq=False)
class Composition:
    """T and V (J), Rayleigh's R (W), the non-potential forces Q (n,), the outputs by name as expressions; L = T - V.

    ``further``: the derivatives of the further states, and behind them those of filtered motions and their velocities.
    The parts on frames are left out. Where the user gives a whole Lagrangian, its part of second degree in qd counts as
    T and the rest as -V. V then also holds velocity-dependent potentials and terms of moving supports.
    """

    mechanism: Mechanism
    symbols: Symbols = field(init=False)
    kinetic: sp.Expr = field(init=False)
    potential: sp.Expr = field(init=False)
    dissipation: sp.Expr = field(init=False)
    forces: Vector = field(init=False)
    outputs: dict[str, sp.Expr] = field(init=False)
    further: Vector = field(init=False)
    _meaning: dict[sp.Symbol, sp.Expr] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Compose everything once."""
        self._set(symbols=self._symbols(), _meaning=_meaning(self.mechanism))
        kinetic, potential = self._given_energies()
        self._set(further=tuple(self.written(z.derivative) for z in self.mechanism.states))
        self._set(
            kinetic=sp.Add(kinetic, *self._koenig()),
            potential=sp.Add(potential, *self._gravity(), *self._springs()),
            dissipation=sp.Add(self.written(self.mechanism.energy.dissipation), *self._dampers()),
            forces=self._forces(),
            outputs={name: x for output in self.mechanism.outputs for name, x in self._output(output)},
        )

    def _symbols(self) -> Symbols:
        """Which symbols are coordinates, motions and inputs."""
        return symbols_of(self.mechanism)

    def _set(self, **values: object) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def written(self, expression: sp.Expr | int | float | None) -> sp.Expr:
        """``expression`` with definitions written out and with tables that know their data; None becomes 0.

        Long definitions become calls, see ``language.definitions``.
        """
        known = sp.S.Zero if expression is None else with_data(sp.sympify(expression), _tables(self.mechanism))
        return replaced(known, self._meaning)

    def rate(self, expression: sp.Expr) -> sp.Expr:
        """The total time derivative of a function of t, q, qd, further states and motion inputs, by the chain rule."""
        s = self.symbols
        qdd = (symbol(acceleration(q.name)) for q in s.q)
        moving = (*s.q, *s.qd, *s.motion, *s.motion_dot, *s.further)
        rates = (*s.qd, *qdd, *s.motion_dot, *s.motion_ddot, *self.further)
        pairs = ((TIME, sp.S.One), *zip(moving, rates, strict=False))  # the rates of filters stand behind
        used = expression.free_symbols
        return between_kinks(sp.Add(*(expression.diff(x) * x_dot for x, x_dot in pairs if x in used)))

    def velocity_part(self) -> tuple[sp.Expr, sp.Expr]:
        """(K, U) in J with L = K - U; all terms with velocities are in K, all others in U.

        Polarisation takes differences of K, which so lose no digits to a large potential.
        """
        qd = set(self.symbols.qd)
        moving: list[sp.Expr] = []
        resting: list[sp.Expr] = []
        for term in (*sp.Add.make_args(self.kinetic), *sp.Add.make_args(-self.potential)):
            (moving if qd & term.free_symbols else resting).append(term)
        return sp.Add(*moving), -sp.Add(*resting)

    @cached_property
    def jumps(self) -> tuple[tuple[str, str], ...]:
        """What in the forces jumps as the motion goes on, (call, margin) as texts; qdd jumps where the margin is 0."""
        moving = {*self.symbols.q, *self.symbols.qd}
        everything = (*self.forces, *(call.meaning for call in calls(self.forces)))
        jumping = {jump for expression in everything for jump in expression.atoms(sp.sign, sp.Heaviside, Choice)}
        found = (jump for jump in jumping if _jumps(jump, jump.args[0].free_symbols & moving))
        return tuple(sorted((_called(jump), str(jump.args[0])) for jump in found))

    def place(self, name: str) -> Vector:
        """The position (m) of a point or body, (2,) or (3,). Raises MechanismError for one on a frame."""
        return tuple(self.written(x) for x in self.mechanism.place(name))

    def on_frame(self, name: object) -> bool:
        """Whether ``name`` is a point or body that is placed on a frame; the world is a frame too."""
        return any(part.name == name and part.frame is not None for part in self.mechanism.places)

    def effort(self, load: Load) -> list[sp.Expr]:
        """The entries of the force (N) or torque (N.m) of ``load``; a load on a frame has 3."""
        vector = load.torque if load.force is None else load.force
        return [self.written(x) for x in vector or ()]  # type: ignore[union-attr]

    def _given_energies(self) -> tuple[sp.Expr, sp.Expr]:
        energy = self.mechanism.energy
        if energy.lagrangian is None:
            return self.written(energy.kinetic), self.written(energy.potential)
        whole, qd = self.written(energy.lagrangian), self.symbols.qd
        reverse = whole.xreplace({v: -v for v in qd})
        quadratic = (whole + reverse) / 2 - whole.xreplace(dict.fromkeys(qd, sp.S.Zero))
        return quadratic, quadratic - whole

    def _koenig(self) -> Iterable[sp.Expr]:
        for body in self._fixed_bodies():
            speeds = (self.rate(self.written(x)) for x in body.position or ())
            yield self.written(body.mass) * sp.Add(*(v**2 for v in speeds)) / 2
            if body.angle is not None:
                yield self.written(body.inertia) * self.rate(self.written(body.angle)) ** 2 / 2

    def _fixed_bodies(self) -> list[Body]:
        """The bodies whose position is given in the fixed frame."""
        return [body for body in self.mechanism.bodies if body.frame is None]

    def _output(self, output: Output) -> Iterable[tuple[str, sp.Expr]]:
        if output.expression is not None:
            yield output.name, self.written(output.expression)
        elif output.bodies is not None and not self.mechanism.frames:
            found = in_fixed_frame(output, self._fixed_bodies(), self.written, self.rate)
            yield from zip(output.names, found, strict=True)
        elif output.point is not None and not self.on_frame(output.point):
            if output.turning:
                position: Vector = (self.written(_angle(self.mechanism, str(output.point))),)
                times = tuple(TURNING).index(str(output.quantity))
            else:
                position = self.place(str(output.point))
                times = ("position", "velocity", "acceleration").index(str(output.quantity))
            for _ in range(times):
                position = tuple(map(self.rate, position))
            yield from zip(output.names, position, strict=True)

    def _gravity(self) -> Iterable[sp.Expr]:
        gravity = self.mechanism.gravity
        if gravity is None:
            return
        for body in filter(lambda body: body.placed, self._fixed_bodies()):
            place = self.place(body.name)
            direction = gravity.direction or (*[0] * (len(place) - 1), -1)
            height = _dot([self.written(x) for x in direction], place)
            yield -self.written(body.mass) * self.written(gravity.acceleration) * height

    def _springs(self) -> Iterable[sp.Expr]:
        for spring in self.mechanism.springs:
            stiffness, length = self.written(spring.stiffness), self.written(spring.length)
            if spring.between is None:
                square = self.written(spring.elongation) ** 2
            elif self._any_on_frame(spring.between):
                continue
            else:
                gap = self._gap(spring.between)
                # |gap| has no derivative at 0, so the energy of a spring without natural length is written without it
                square = _dot(gap, gap) if length == 0 else (sp.sqrt(_dot(gap, gap)) - length) ** 2
            yield stiffness * square / 2

    def _dampers(self) -> Iterable[sp.Expr]:
        for damper in self._fixed_dampers():
            yield self.written(damper.damping) * self._damper_rate(damper) ** 2 / 2

    def _fixed_dampers(self) -> Iterable[Damper]:
        """The dampers with no end on a frame."""
        return (d for d in self.mechanism.dampers if d.between is None or not self._any_on_frame(d.between))

    def _damper_rate(self, damper: Damper) -> sp.Expr:
        """The rate at which ``damper`` grows longer, in m/s, or as it is written."""
        if damper.between is None:
            return self.written(damper.rate)
        gap = self._gap(damper.between)
        return _dot(gap, [self.rate(x) for x in gap]) / sp.sqrt(_dot(gap, gap))

    def _any_on_frame(self, ends: Sequence[object]) -> bool:
        return any(self.on_frame(end) for end in ends)

    def _gap(self, ends: Sequence[object]) -> Vector:
        a, b = (self.place(str(end)) for end in ends)
        return tuple(x - y for x, y in zip(a, b, strict=True))

    def _forces(self) -> Vector:
        """Q without dissipation: generalized forces, loads and the external inputs Q_<coordinate>."""
        s = self.symbols
        total = dict(zip(s.q, s.external, strict=True))
        for force in self.mechanism.forces:
            if symbol(force.coordinate) in total:  # one on a prescribed motion acts on its drive alone
                total[symbol(force.coordinate)] += self.written(force.expression)
        for load in self.mechanism.loads:
            place = load.point if load.point is not None else load.body
            if not self.on_frame(place):
                places, values = self._load(load, str(place))
                for q in s.q:
                    total[q] += _dot(values, [x.diff(q) for x in places])
        for damper in self._fixed_dampers():
            if damper.force is not None:
                rate = self._damper_rate(damper)
                force = self.written(damper.force_at(rate))
                for q, qd in zip(s.q, s.qd, strict=True):
                    total[q] -= force * rate.diff(qd)
        return tuple(total.values())

    def _load(self, load: Load, place: str) -> tuple[Vector, Vector]:
        """What a load acts on, an angle (1,) or the entries of a position, and its torque or force."""
        if load.torque is not None:
            return (self.written(_angle(self.mechanism, str(load.body))),), (self.written(load.torque),)
        return self.place(place), tuple(self.written(x) for x in load.force or ())


def between_kinks(derivative: sp.Expr) -> sp.Expr:
    """``derivative`` where nothing jumps: there the derivative of what jumps is 0."""
    return derivative.replace(sp.DiracDelta, lambda *_: sp.S.Zero) if derivative.has(sp.DiracDelta) else derivative


def _meaning(mechanism: Mechanism) -> dict[sp.Symbol, sp.Expr]:
    """Definition -> its expression in which no definition is left (the record refuses cycles)."""
    tables = _tables(mechanism)
    return written_out({d.name: with_data(sp.sympify(d.expression), tables) for d in mechanism.definitions})


def _tables(mechanism: Mechanism) -> dict[str, Table]:
    return {table.name: table for table in mechanism.tables}


def _angle(mechanism: Mechanism, name: str) -> sp.Expr:
    return next(part.angle for part in (*mechanism.bodies, *mechanism.points) if part.name == name)


def _dot(a: Sequence[sp.Expr], b: Sequence[sp.Expr]) -> sp.Expr:
    return sp.Add(*(x * y for x, y in zip(a, b, strict=True)))


def _jumps(call: sp.Expr, moving: set[sp.Symbol]) -> bool:
    """Whether a ``call`` of sign, heaviside or if jumps with what is ``moving`` in its margin.

    An if does not where both of its values are equal at the margin's root, if that can be written.
    """
    if not isinstance(call, Choice) or not moving:
        return bool(moving)
    margin, a, b = call.args
    s = min(moving, key=str)
    slope = margin.diff(s)
    if slope.is_zero or s in slope.free_symbols:
        return True
    return bool(sp.expand((a - b).subs(s, -margin.subs(s, 0) / slope)) != 0)


def _called(jump: sp.Expr) -> str:
    """A ``jump`` as it is written."""
    return f"if({jump.args[0]} > 0, ...)" if isinstance(jump, Choice) else f"{NAME_OF[jump.func]}({jump.args[0]})"
