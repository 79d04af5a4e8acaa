"""What the inputs of a system's FMUs are at one time: outputs go round until all inputs are what they hear.

Where outputs depend on inputs at once and these on outputs of other FMUs, values that agree are the solution of
equations, by Newton's method. Source: R. Kuebler, W. Schiehlen, Two methods of simulator coupling, Mathematical and
Computer Modelling of Dynamical Systems 6 (2000).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np

from lag2fmu.errors import SimulationError
from lag2fmu.systems.cables import Cable, ConnectedInputs, order_of
from lag2fmu.systems.connections import End
from lag2fmu.systems.member import Member
from lag2fmu.systems.wires import Affine, Wire
from lag2fmu.verify.run import Floats

_AGREE = 1e-12
"""Relative to the greatest input of an FMU: the rounding of some operations, up to which inputs agree with their
sources."""
_NEWTON = 20
"""The most steps of Newton's method. Linear loops take one or two, others some more."""


class Circuit:
    """The connected ``inputs`` of all ``members``, by component, and what they hear by the ``wires``."""

    def __init__(self, members: Mapping[str, Member], wires: Sequence[Wire], *, initial: bool = False) -> None:
        """Look up who hears whom; raises LoadError for wires between variables of different sizes.

        ``initial``: in initialization mode, where outputs may follow inputs that they do not follow later.
        """
        self.members = members
        pairs = [(wire, *pair) for wire in wires for pair in _elements(wire, members)]
        self.inputs: dict[str, ConnectedInputs] = {}
        for name, member in members.items():
            names = tuple(t for wire, _, t in pairs if wire.target.component == name)
            if names:
                channel = member.channel(names)
                self.inputs[name] = ConnectedInputs(
                    channel, names, channel.read(), np.zeros((2, len(names))), *np.zeros((2, len(names)))
                )
        self._cables = {
            target: [c for source in members for c in self._between(source, target, pairs, initial)]
            for target in self.inputs
        }
        self._outer = [
            (wire.source.connector, wire.target.component, self.inputs[wire.target.component].names.index(t), wire.map)
            for wire, _, t in pairs
            if not wire.source.component
        ]
        self._order, self._looping = self._ordered()
        self._continuous = {name for name, member in members.items() if not member.samples}

    def _between(self, source: str, target: str, pairs: Sequence[tuple[Wire, str, str]], initial: bool) -> list[Cable]:
        found = [(w, s, t) for w, s, t in pairs if (w.source.component, w.target.component) == (source, target)]
        if not found:
            return []
        places = [self.inputs[target].names.index(t) for _, _, t in found]
        member, inputs = self.members[source], self.inputs.get(source)
        outputs = member.channel([s for _, s, _ in found])
        maps = [wire.map for wire, _, _ in found]
        at_once = inputs is not None and (initial or member.depends(outputs, inputs.channel))
        smooth = np.array([getattr(s.variable, "variability", "") != "discrete" for s in outputs.scalars], dtype=float)
        return [Cable(member, outputs, target, places, maps, at_once, smooth * [isinstance(x, Affine) for x in maps])]

    def _ordered(self) -> tuple[list[str], bool]:
        """(the components with inputs, each behind those on whose inputs its own depend at once, whether some loop)."""
        left, found = dict(self._cables), list[str]()
        while left:
            free = [n for n, cables in left.items() if not any(c.at_once and c.source.name in left for c in cables)]
            if not free:
                return [*found, *left], True
            found += free
            left = {name: cables for name, cables in left.items() if name not in free}
        return found, False

    def hear(self, outer: Mapping[str, float]) -> None:
        """Set the inputs that hear inputs of the system to the values ``outer``; those without a value stay."""
        for name, target, place, map_ in self._outer:
            if name in outer:
                inputs = self.inputs[target]
                inputs.values[place] = map_(outer[name])
                inputs.channel.write(inputs.values)

    @property
    def order(self) -> int:
        """The order of the derivatives by which all connected inputs go on within steps; 0 if some are held."""
        orders = (min(order_of(c.source), self.members[c.target].takes_orders) for c in self._all_cables())
        return 0 if self.held() else min(orders, default=0)

    def held(self) -> list[str]:
        """The components with an input that is held within steps, since nothing tells how it goes on."""
        outer = {target for _, target, _, _ in self._outer}
        return [
            name
            for name, inputs in self.inputs.items()
            if name in outer
            or not (self.members[name].takes_orders and inputs.channel.are_floats)
            or any(not c.outputs.are_floats for c in self._cables[name])
        ]

    @property
    def sampled(self) -> bool:
        """Whether each connection begins or ends at what samples, so that all inputs are constant within steps."""
        return not self._outer and all(c.source.samples or self.members[c.target].samples for c in self._all_cables())

    def expected(self, h: float) -> list[Floats]:
        """What the inputs are taken to be after a step ``h`` (s)."""
        return [x.values + h * x.derivatives[0] + h**2 / 2 * x.derivatives[1] for x in self.inputs.values()]

    def missed(self, expected: Sequence[Floats]) -> float:
        """The greatest error of what was ``expected``, relative to what the input has been at most.

        What samples its inputs does not see them within steps.
        """
        greatest = 0.0
        for (name, inputs), values in zip(self.inputs.items(), expected, strict=True):
            if self.members[name].samples:
                continue
            sizes = np.maximum(inputs.sizes, np.abs(inputs.values))
            inputs.sizes = sizes
            errors = np.abs(values - inputs.values)[sizes > 0] / sizes[sizes > 0]
            greatest = max(greatest, float(errors.max(initial=0.0)))
        return greatest

    def saved(self) -> list[Floats]:
        """The present values of the inputs, for ``restore``."""
        return [inputs.values.copy() for inputs in self.inputs.values()]

    def restore(self, values: Sequence[Floats]) -> None:
        """The inputs are what they were when the ``values`` were ``saved``."""
        for inputs, before in zip(self.inputs.values(), values, strict=True):
            inputs.values[:] = before

    def settle(self, time: float, changed: Collection[str] | None = None) -> None:
        """Bring all inputs to what they hear at the ``time`` (s).

        ``changed``: the components whose outputs are new; by default all but those that sample. Components hear in the
        order in which they depend on each other, which is one round. Where they depend in a loop, as many rounds as
        there are components pass on what does not. What does not agree then is solved. Raises SimulationError that
        names an input for which there is no value.
        """
        new = self._continuous if changed is None else changed
        for _ in range(len(self.members) + 1):
            moved, differs = set[str](), set[str]()
            for name in self._order:
                before = self._hear(name, new, moved)
                if before is not None:
                    moved.add(name)
                    if self._looping and _differ(before, self.inputs[name].values):
                        differs.add(name)
            if not differs:
                return
            new = differs
        self._solve(time)

    def _hear(self, name: str, new: Collection[str], moved: Collection[str]) -> Floats | None:
        """Let a component hear those whose outputs are ``new``, or follow inputs that have ``moved``, at once.

        Its inputs before (m,), None if they stay.
        """
        inputs, before = self.inputs[name], None
        for cable in self._cables[name]:
            if cable.source.name in new or (cable.at_once and cable.source.name in moved):
                heard = cable.heard()
                if inputs.values[cable.places].tobytes() != heard.tobytes():
                    before = inputs.values.copy() if before is None else before
                    inputs.values[cable.places] = heard
        if before is not None:
            inputs.channel.write(inputs.values)
        return before

    def _all_cables(self) -> Iterator[Cable]:
        for cables in self._cables.values():
            yield from cables

    def _solve(self, time: float) -> None:
        """Newton's method for all inputs at once."""
        for _ in range(_NEWTON):
            missing = self._missing()
            if all(not _differ(i.values, i.values + m) for i, m in zip(self.inputs.values(), missing, strict=True)):
                return
            matrix = np.eye(sum(map(len, missing))) - self._gains()
            if not np.isfinite(matrix).all():
                break
            change = np.linalg.lstsq(matrix, np.concatenate(missing), rcond=None)[0]
            at = 0
            for inputs in self.inputs.values():
                inputs.values += change[at : at + len(inputs.values)]
                inputs.channel.write(inputs.values)
                at += len(inputs.values)
        worst = max(
            ((abs(x), End(name, i.names[k])) for (name, i), m in zip(self.inputs.items(), missing, strict=True)
             for k, x in enumerate(m)),
        )  # fmt: skip
        raise SimulationError(
            f"at t = {time:g} s no values of the inputs agree with the outputs that they hear: {worst[1]} misses by "
            f"{worst[0]:.3g}; outputs and inputs depend on each other at once, and that loop has no solution near"
        )

    def _missing(self) -> list[Floats]:
        """What each FMU's inputs would hear, less what they are."""
        heard = {name: inputs.values.copy() for name, inputs in self.inputs.items()}
        for cable in self._all_cables():
            heard[cable.target][cable.places] = cable.heard()
        return [heard[name] - inputs.values for name, inputs in self.inputs.items()]

    def _gains(self) -> Floats:
        """The derivatives (m, m) of what all inputs hear by all inputs."""
        starts = dict(zip(self.inputs, np.cumsum([0, *(len(i.values) for i in self.inputs.values())]), strict=False))
        size = sum(len(i.values) for i in self.inputs.values())
        found = np.zeros((size, size))
        for cable in self._all_cables():
            source = self.inputs.get(cable.source.name)
            if source is not None:
                rows = starts[cable.target] + np.array(cable.places)
                first = starts[cable.source.name]
                slopes = cable.source.slopes(cable.outputs, source.channel)
                found[rows, first : first + len(source.values)] = cable.factor[:, None] * slopes
        return found

    def passed(self, before: Sequence[Floats], h: float) -> None:
        """The inputs were ``before`` when a step of length ``h`` (s) began, and it is done."""
        for inputs, values in zip(self.inputs.values(), before, strict=True):
            inputs.slopes = (inputs.values - values) / h

    def drive(self) -> None:
        """Tell each FMU that takes them how its inputs go on: by the derivatives of the outputs that they hear.

        Where an FMU does not give them, they go on as they did in the last step. The derivative of an output that
        follows an input at once contains that of the input. So they go round twice.
        """
        for _ in range(2):
            for name, inputs in self.inputs.items():
                member = self.members[name]
                if not (member.takes_orders and inputs.channel.are_floats):
                    continue
                inputs.derivatives[:] = 0.0
                for cable in self._cables[name]:
                    if cable.source.gives_orders:
                        inputs.derivatives[:, cable.places] = cable.factor * cable.source.derivatives(cable.outputs)
                    else:
                        inputs.derivatives[0, cable.places] = cable.smooth * inputs.slopes[cable.places]
                inputs.derivatives[member.takes_orders :] = 0.0
                member.drive(inputs.channel, inputs.values.copy(), inputs.derivatives.copy())

    @property
    def sequence(self) -> list[str]:
        """All components, each behind those that it hears, as far as they do not hear it in turn."""
        heard = {n: {c.source.name for c in self._cables.get(n, ()) if c.source.name != n} for n in self.members}
        found = list[str]()
        while len(found) < len(heard):
            left = [name for name in heard if name not in found]
            found.append(next((n for n in left if heard[n].issubset(found)), left[0]))
        return found

    def ends(self, name: str, sources: Collection[str]) -> dict[int, float]:
        """{place among the inputs of the component ``name``: what it hears now} of those that hear the ``sources``.

        What does not change continuously is left out.
        """
        cables = [c for c in self._cables.get(name, ()) if c.source.name in sources]
        heard = [entry for c in cables for entry in zip(c.places, c.heard(), c.smooth, strict=True)]
        return {place: value for place, value, smooth in heard if smooth}

    def lead(self, name: str, ends: Mapping[int, float], h: float, part: float = 1.0, *, hold: bool = False) -> None:
        """The inputs of the component ``name`` reach the ``ends`` {place: value} in the next step, of length ``h`` (s).

        They set out as they are driven to, if an FMU tells their derivatives. With ``hold``, and where a component
        takes no derivatives, they are held within it: at what they are, and this ``part`` of what they are to change.
        """
        inputs, places = self.inputs[name], list(ends)
        changes = np.array(list(ends.values())) - inputs.values[places]
        if not hold and (orders := self.members[name].takes_orders) and inputs.channel.are_floats:
            told = [p for c in self._cables[name] if c.source.gives_orders for p in c.places]
            knows = np.isin(places, told) & (orders > 1)
            first = np.where(knows, inputs.derivatives[0, places], changes / h)
            inputs.derivatives[:, places] = first, 2 * (changes - h * first) / h**2  # if only one is taken, this is 0
            self.members[name].drive(inputs.channel, inputs.values.copy(), inputs.derivatives.copy())
        else:
            inputs.values[places] += part * changes
            inputs.channel.write(inputs.values)


def _elements(wire: Wire, members: Mapping[str, Member]) -> list[tuple[str, str]]:
    """(element of the source, element of the target) of the variables that the ``wire`` connects."""
    targets = members[wire.target.component].elements(wire.target.connector)
    if not wire.source.component:
        return [(wire.source.connector, t.name) for t in targets]
    sources = members[wire.source.component].elements(wire.source.connector)
    return [(s.name, t.name) for s, t in zip(sources, targets, strict=True)]


def _differ(a: Floats, b: Floats) -> bool:
    """Whether inputs of one FMU differ by more than rounding."""
    return bool((np.abs(b - a) > _AGREE * max(float(np.abs(a).max()), float(np.abs(b).max()))).any())
