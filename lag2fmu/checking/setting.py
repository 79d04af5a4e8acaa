"""Trials of setting values: they are kept, they have an effect, and what depends on them follows at once."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import compress, pairwise
from time import monotonic
from typing import Any

from lag2fmu.checking.away import move_inputs
from lag2fmu.checking.binding import RefusedError, bits
from lag2fmu.checking.description import Variable, number
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.session import Model, Session

_MOST_VARIABLES, _MOST_STEPS = 60, 400
"""Variables that are set, and about the most steps of a run of co-simulation that looks for an effect."""
_PATIENCE, _RUN = 6.0, 1.0
"""Times (s) for the trial, apart from the variable that it is at, and for a run."""
_FACTORS = (1.1, 0.5, 4.0, -1.0, 1e-3)
"""The values that are tried, relative to the one that a variable has; 1 less than this where that is 0."""
_SEEN = 1e-6
"""Relative to the greater one: two values that are farther apart differ."""

Table = Mapping[str, list[Any]]
"""{name of a variable: values of its elements}."""


def settings(model: Model) -> Iterator[Finding]:
    """Parameters, inputs and exact starts are set one by one, before and in Initialization Mode.

    Source: FMI 2.0.5 specification, sections 2.1.7 and 2.2.7; FMI 3.0.2 specification, sections 2.2.6 and 2.3.
    """
    with model.session() as session:
        before = session.enter().table()
    begun, runs = monotonic(), [_Run(model, moved=moved) for moved in (False, True)]
    for v in [v for v in model.description.variables if _settable(v)][:_MOST_VARIABLES]:
        if monotonic() > begun + _PATIENCE:
            return
        yield from _setting(model, v, before, runs)


def _settable(v: Variable) -> bool:
    exact = v.initial == "exact" and v.causality in ("output", "local") and v.variability != "constant"
    numeric = v.type not in ("String", "Binary", "Clock", "Enumeration")
    return v.readable and numeric and (v.causality in ("parameter", "input") or exact)


def _setting(model: Model, v: Variable, before: Table, runs: Sequence[_Run]) -> Iterator[Finding]:
    """What is wrong with setting one variable."""
    values = _other(v, before[v.name], _FACTORS[0])
    late, early = (_after(model, v, values, early=early) for early in (False, True))
    given = v.causality in ("parameter", "input")
    dropped = [
        word for word, table in (("in", late), ("before", early)) if table and bits(table[v.name]) != bits(values)
    ]
    if given and dropped:
        problem = f"what was set {dropped[0]} Initialization Mode is not what is read there"
        yield Finding("read-back", v.place, problem, "keep values as they are set")
        return
    if late is not None and early is not None:
        yield from _old_values(model, v, before, late, early)
    if late is not None:
        yield from _others_set(model, v, before, late)
    if given and not _has_effect(model, v, before, (late, early), runs):
        problem = "nothing changes with it, neither in Initialization Mode nor in a run"
        yield Finding("no-effect", v.place, problem, "use it, or leave it away", "warning")


def _has_effect(model: Model, v: Variable, before: Table, after: Iterable[Table | None], runs: Iterable[_Run]) -> bool:
    """Whether anything else changes with a variable that should have an effect; see ``_Run`` for what is not known."""
    seen = any(table is not None and _differ(_without(model, v, table), before) for table in after)
    return seen or not model.concerns(v) or any(run.changes_with(v, before[v.name]) for run in runs)


def _other(v: Variable, values: Sequence[Any], factor: float) -> list[Any]:
    """Other values of a variable, within its bounds where it has some."""
    found: list[Any]
    if v.type == "Boolean":
        return [not x if isinstance(x, bool) else int(not x) for x in values]
    if all(isinstance(x, int) for x in values):
        return [_bounded(v, x, x + (1 if factor > 1 else -1)) for x in values]
    found = [_bounded(v, x, x * factor if x else factor - 1.0) for x in values]
    return [struct.unpack("f", struct.pack("f", x))[0] for x in found] if v.type == "Float32" else found


def _bounded(v: Variable, now: Any, wanted: Any) -> Any:
    """The wanted value, or one halfway to the bound that it would break."""
    least, most = number(v.attribute("min")), number(v.attribute("max"))
    if not (wanted < least or wanted > most):  # bounds that are not given are no numbers
        return wanted
    middle = (now + (least if wanted < least else most)) / 2
    return int(middle) if isinstance(now, int) else float(middle)


def _after(model: Model, v: Variable, values: Sequence[Any], *, early: bool) -> Table | None:
    """What can be read in Initialization Mode after a variable is set, ``early``: before; None if it is not taken."""
    try:
        with model.session() as session:
            if not early:
                session.enter().table()  # whoever keeps values has computed them now
            if not session.set(v, values):
                return None
            return (session.enter() if early else session).table()
    except RefusedError:
        return None


def _without(model: Model, v: Variable, table: Table) -> Table:
    """What is no other name of a variable."""
    same = {u.name for u in model.readable if _same(u, v)}
    return {name: values for name, values in table.items() if name not in same}


def _differ(table: Table, other: Table) -> bool:
    return any(bits(values) != bits(other[name]) for name, values in table.items())


def _old_values(model: Model, v: Variable, before: Table, late: Table, early: Table) -> Iterator[Finding]:
    """Continuous variables that keep their values although a new instance with this setting has others."""
    continuous = {u.name: u for u in model.description.variables if u.is_continuous and u.causality != "input"}
    for name in continuous.keys() & _without(model, v, late).keys():
        pairs = zip(before[name], early[name], strict=True)
        moved = any(abs(a - b) > _SEEN * max(abs(a), abs(b)) for a, b in pairs)
        if moved and bits(late[name]) == bits(before[name]):
            problem = f"keeps its value when '{v.name}' is set in Initialization Mode"
            remedy = "compute values anew where anything they depend on has changed"
            yield Finding("stale", continuous[name].place, problem, remedy)


def _others_set(model: Model, v: Variable, before: Table, late: Table) -> Iterator[Finding]:
    """Parameters and inputs that change when another one is set."""
    for u in model.description.variables:
        given = u.causality in ("parameter", "input") and u.name in _without(model, v, late)
        if given and bits(late[u.name]) != bits(before[u.name]):
            problem = f"changes when '{v.name}' is set"
            yield Finding("set-other", u.place, problem, "change what was named alone")


class _Run:
    """Runs of a model from its start, compared with the one in which nothing is set.

    ``moved``: inputs have other values from the start on, without which much of a mechanism stays at rest.
    """

    def __init__(self, model: Model, *, moved: bool) -> None:
        self._model, self._moved, self._usual = model, moved, list[list[Any]]()
        self._whole = False

    def changes_with(self, v: Variable, values: Sequence[Any]) -> bool:
        """Whether a run differs if a variable is set to something else than ``values``, which it has.

        Also where this cannot be known: none of the values is taken, or the run does not come to its end in time.
        """
        if not self._usual:
            with suppress(RefusedError, RecursionError):
                self._usual = list(self._rows(None, ()))
        if not self._whole:
            return True
        others = [not _same(u, v) for u in self._model.readable for _ in range(u.size)]
        taken = False
        for factor in _FACTORS:
            rows = self._rows(v, _other(v, values, factor))
            try:
                for expected, row in zip(self._usual, rows, strict=False):
                    taken = True
                    if bits(list(compress(expected, others))) != bits(list(compress(row, others))):
                        return True
            except (RefusedError, RecursionError):
                return True
        return not taken

    def _rows(self, v: Variable | None, values: Sequence[Any]) -> Iterator[list[Any]]:
        """What can be read after the start and each step; nothing if the FMU does not take the values."""
        model, begun = self._model, monotonic()
        end = model.start_time + (1.0 - 1e-6) * model.duration
        part = max(round(model.duration / model.step / _MOST_STEPS), 1) * (
            10.0 if model.kind == "ModelExchange" else 1.0
        )
        with model.session() as session:
            if v is not None and not session.set(v, values):
                return
            session.start()
            if self._moved:
                move_inputs(session, but=v)
            yield session.values()
            while session.time < end:
                if monotonic() > begun + _RUN or not session.step(part):
                    return
                yield session.values()
        self._whole = True


def _same(v: Variable, other: Variable) -> bool:
    """Whether two variables are one with two names."""
    return (v.reference, v.type) == (other.reference, other.type)


def lengths(model: Model) -> Iterator[Finding]:
    """Co-simulation: steps are as long as they are asked to be, where they may vary.

    An FMU that takes a step of its own length has the same values after as many steps, whatever their length.
    Source: FMI 2.0.5 specification, section 4.3.1; FMI 3.0.2 specification, section 4.3.1
    (canHandleVariableCommunicationStepSize).
    """
    if model.kind != "CoSimulation" or not model.can("canHandleVariableCommunicationStepSize"):
        return
    whole, half = (_moving(model, part) for part in (1.0, 0.5))
    moves = len(whole) > 1 and all(a != b for a, b in pairwise(whole))
    if moves and whole == half:
        problem = f"{model.prefix}DoStep goes as far in half a step as in a whole one"
        remedy = "go to the end of the step that is asked for, or do not declare canHandleVariableCommunicationStepSize"
        yield Finding("step-size", model.kind, problem, remedy)


def _moving(model: Model, part: float) -> list[bytes]:
    """The bits of the continuous variables after each of some steps, ``part`` of the usual length."""
    names = [v for v in model.description.variables if v.is_continuous and v.readable]
    moving = [v for v in names if v.causality in ("output", "local")]
    found: list[bytes] = []
    with model.session() as session:
        session.start()
        while len(found) < 8 and session.step(part):
            found.append(bits(session.numbers(moving)))
    return found


def uneven_steps(model: Model) -> Iterator[Finding]:
    """The independent variable has the importer's time after steps of different lengths.

    Source: FMI 2.0.5 specification, section 2.2.7; FMI 3.0.2 specification, section 2.4.7 (causality 'independent').
    """
    times = [v for v in model.description.variables if v.causality == "independent" and v.type in model.floats]
    if not times:
        return
    varies = model.kind == "ModelExchange" or model.can("canHandleVariableCommunicationStepSize")
    with model.session() as session:
        session.start()
        ends = (_time(session, times[0], part) for part in ((1.0, 3.0, 2.0, 1.0) if varies else (1.0, 1.0, 1.0)))
        bound = 1e-9 * model.step
        wrong = [(a, b) for a, b in ends if not math.isclose(a, b, rel_tol=1e-9, abs_tol=bound)]
        if not wrong:
            return
        found, right = wrong[0]
        waits = any(math.isclose(*_time(session, times[0]), rel_tol=1e-9) for _ in range(_MOST_STEPS))
    problem = f"is {found:.17g} at t = {right:.17g} s"
    remedy = "give the time that was reached"  # an FMU that ``waits`` comes there by longer steps of its own
    yield Finding("time-value", times[0].place, problem, remedy, "warning" if waits else "error")


def _time(session: Session, time: Variable, part: float = 1.0) -> tuple[float, float]:
    """What the independent variable says after another step, and the time of the importer (s)."""
    session.step(part)
    (found,) = session.get(time)
    return found, session.time


def reading(model: Model) -> Iterator[Finding]:
    """A run whose values are read after each step ends where one does whose values are read at the end alone.

    Source: FMI 2.0.5 specification, section 2.1.7; FMI 3.0.2 specification, section 2.2.6 (getting values).
    """
    ends = []
    for reads in (True, False):
        with model.session() as session:
            session.start()
            for _ in range(10):
                if not session.step():
                    break
                if reads:
                    session.values()
            ends.append(_numbers(session))
    for (name, a), (_, b) in zip(*(end.items() for end in ends), strict=True):
        if not all(abs(x - y) <= _SEEN * max(1.0, abs(x), abs(y)) or math.isnan(x) for x, y in zip(a, b, strict=True)):
            problem = f"'{name}' is {b[0]:.9g} after a run, but {a[0]:.9g} if values are read on the way"
            yield Finding("read-disturbs", model.kind, problem, "reading values changes nothing that can be seen")
            return


def _numbers(session: Session) -> dict[str, list[float]]:
    """The floating point numbers of a session by name."""
    return {v.name: session.get(v) for v in session.model.description.variables if _is_float(session.model, v)}


def _is_float(model: Model, v: Variable) -> bool:
    return v.readable and v.type in model.floats
