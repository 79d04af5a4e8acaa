"""The analysis of a mechanism as sections of sentences and formulas, for the command line and the FMU's documentation.

An analysis that does not apply says so in a sentence; the other analyses are made nevertheless.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache

import numpy as np

from lag2fmu.analysis import coupling
from lag2fmu.analysis.canonical import cyclic_coordinates, hamiltonian_form, pushed_by_constraints, routhian_form
from lag2fmu.analysis.conserved import conserved, while_smooth, why_energy_changes
from lag2fmu.analysis.equilibria import Equilibrium, equilibria
from lag2fmu.analysis.evaluation import attempted, driven_by_time
from lag2fmu.analysis.floquet import floquet
from lag2fmu.analysis.linearization import about_start, linearize, linearizer
from lag2fmu.analysis.modes import NaturalMode, normal_modes
from lag2fmu.analysis.sections import Line, Section
from lag2fmu.analysis.state_space import Linearization
from lag2fmu.deadline import LIMIT, OutOfTimeError, check_time, within
from lag2fmu.description import names
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.lagrange import derive
from lag2fmu.errors import DerivationError
from lag2fmu.graph.batches import Floats
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.record import Mechanism

ROUNDING = 1e-9
"""Relative to others of their kind: numbers that are smaller are shown as 0."""
_MODES, _MATRIX, _INPUTS = 12, 8, 6
"""The most modes that are listed, states whose matrices are printed, and inputs that are named."""


def analysis_report(mechanism: Mechanism, style: str = "text", *, coupled: bool = False, limit: float = LIMIT) -> str:
    """The analysis of ``mechanism`` as plain text or as LaTeX (``style`` 'text' or 'latex').

    With ``coupled`` it tells which communication steps go with other FMUs. Where the CPU time of ``limit`` (s) is over,
    the sections that are left say so. Raises DerivationError where there are no equations.
    """
    sections = analysis_sections(derive(mechanism), coupled=coupled, limit=limit)
    if style == "latex":
        return "".join(f"\\paragraph{{{s.title}}}\n" + "".join(f"{x.latex}\n" for x in s.lines) for s in sections)
    return "".join(f"\n{s.title}\n" + "".join(f"      {x}\n" for x in s.lines) for s in sections)


@np.errstate(all="ignore")  # values that are not finite are left out below
def analysis_sections(
    equations: EquationsOfMotion, closed_forms: bool = True, *, coupled: bool = True, limit: float = LIMIT
) -> tuple[Section, ...]:
    """Conserved quantities, equilibria with their modes, and with ``closed_forms`` H, the Routhian, A, B, C, D.

    With ``coupled`` there are the communication steps that go with other FMUs. All may take ``limit`` (s) of CPU time.
    """
    found = attempted(lambda: equilibria(equations, limit=limit / 3), ())
    first = cache(lambda: linearizer(equations).at_rest(found[0].q, found[0].further))
    sections: list[tuple[str, Callable[[], Iterator[Line]]]] = [
        ("Conserved quantities", lambda: _conserved(equations)),
        ("Equilibria", lambda: _equilibria(equations, found)),
        ("Small motions about the equilibrium", lambda: _small_motions(equations, found, first)),
    ]
    if coupled:
        sections.append(
            ("Coupling to other FMUs", lambda: map(Line, coupling.sentences(_with_drives(equations, found))))
        )
    if closed_forms:
        sections += [
            ("Linearization dz/dt = A z + B u, y = C z + D u", lambda: _matrices(equations, found, first)),
            ("Hamiltonian", lambda: _hamiltonian(equations)),
            ("Routhian", lambda: _routhian(equations)),
        ]
    with within(limit * 2 / 3):
        told = [Section(title, tuple(_guarded(content))) for title, content in sections]
    return tuple(section for section in told if section.lines)


def _guarded(content: Callable[[], Iterator[Line]]) -> Iterator[Line]:
    """The lines of ``content``, or a sentence with the error that it raises."""
    try:
        check_time()
        yield from content()
    except OutOfTimeError:
        yield Line("The time was over; give a longer --limit.")
    except DerivationError as error:
        sentence = str(error).split("': ", 1)[-1]
        yield Line(sentence[0].upper() + sentence[1:] + ".")
    except Exception as error:  # algorithms raise errors of many kinds at numbers that they were not made for
        yield Line(f"This could not be found: {type(error).__name__}, {error}")


def _conserved(equations: EquationsOfMotion) -> Iterator[Line]:
    found = conserved(equations)
    inputs = [u.name for u in equations.mechanism.plain_inputs]
    if inputs:
        listed = ", ".join([*inputs[:_INPUTS], *["..."][: len(inputs) > _INPUTS]])
        yield Line(f"While {'the inputs are' if len(inputs) > 1 else 'the input is'} zero, {listed}:")
    for item in found:
        yield Line(f"{item.name}: {item.meaning}.")
        yield Line(f"{item.name} = {item.formula}") if item.expression is None else Line(item.name, item.expression)
    if not any(item.name == "generalized_energy" for item in found):
        yield Line(f"The generalized energy h changes: {why_energy_changes(equations)}.")
    if equations.mechanism.hybrid:
        yield Line(f"Momenta may be conserved {while_smooth(equations.mechanism)}; this is not looked for.")
    elif not any(item.name != "generalized_energy" for item in found):
        yield Line("No momentum is conserved.")


def with_inputs(equations: EquationsOfMotion) -> str:
    """A phrase with the values of the user's inputs at the operating points; "" without inputs."""
    inputs = equations.mechanism.plain_inputs
    values = [f"{u.name} = {_quantity(u.start, u.unit)}" for u in inputs[:_INPUTS]]
    more = ["..."] if len(inputs) > _INPUTS else []
    return f" with the inputs at their start values, {', '.join([*values, *more])}" if inputs else ""


def _equilibria(equations: EquationsOfMotion, found: Sequence[Equilibrium]) -> Iterator[Line]:
    if with_inputs(equations):
        yield Line(f"Rest{with_inputs(equations)}:")
    if equations.mechanism.hybrid:
        yield Line(
            "Without the forces of contacts, stops, dry friction and latches, which this analysis leaves out; nothing "
            "rests beyond a contact or stop:"
        )
    if not found:
        yield Line("None was found, neither from the start nor from places around it.")
    driven = driven_by_time(equations)
    for item in found:
        yield Line(f"{_place(equations, item)}{'' if driven else _stability(equations, item)}.")


def _stability(equations: EquationsOfMotion, item: Equilibrium) -> str:
    """The end of a sentence that says whether small motions are stable; "" where that is not known."""
    about = attempted(lambda: linearizer(equations).at_rest(item.q, item.further), None)
    if about is None:
        return ""
    if not about.states:
        return ": rigid, nothing can move there"
    modes = attempted(lambda: normal_modes(about), None)
    if modes is None:
        return ""
    largest = max(abs(mode.eigenvalue) for mode in modes) if modes else 0.0
    growing = any(mode.eigenvalue.real > 1e-9 * largest for mode in modes)
    return ": unstable" if growing else ": small motions do not grow"


def _place(equations: EquationsOfMotion, item: Equilibrium) -> str:
    m = equations.mechanism
    parts = [(c.name, c.nominal, c.unit) for c in m.coordinates]
    parts += [(z.name, z.nominal, z.unit if isinstance(z.unit, Unit) else None) for z in m.states]
    return ", ".join(
        f"{name} = {_quantity(x, unit, nominal)}" for x, (name, nominal, unit) in zip(item.place, parts, strict=True)
    )


def _quantity(x: float, unit: Unit | None, size: float = 0.0) -> str:
    """``x`` (SI) in its declared unit; 0 if it is rounding relative to ``size`` (SI)."""
    if unit is None:
        return _number(x, size)
    rounding = abs(x) <= ROUNDING * size
    return f"{_number(unit.from_si(0.0 if rounding else x))} {unit.name}".rstrip()


def _with_drives(equations: EquationsOfMotion, found: Sequence[Equilibrium]) -> Linearization:
    """The linearization about the equilibrium or the start, with the forces that carry motions as outputs."""
    outputs = [names.drive(motion.name) for motion in equations.mechanism.motions]
    if not found:
        return linearize(equations, outputs=outputs)
    return linearizer(equations).telling(outputs).at_rest(found[0].q, found[0].further)


def _small_motions(
    equations: EquationsOfMotion, found: Sequence[Equilibrium], first: Callable[[], Linearization]
) -> Iterator[Line]:
    if not found:
        yield Line("There is no equilibrium to look at.")
        return
    yield Line(f"About {_place(equations, found[0])}{with_inputs(equations)}:")
    if driven_by_time(equations):
        yield from _exponents(equations, found[0])
        return
    about = first()
    if not about.states:
        yield Line("Nothing can move there: it is rigid.")
        return
    modes = normal_modes(about)
    still = sum(mode.eigenvalue == 0 for mode in modes)
    if still > 1:
        yield Line(f"{still} modes without a restoring force")
        modes = tuple(mode for mode in modes if mode.eigenvalue != 0)
    for number, mode in enumerate(modes[:_MODES], start=1):
        yield Line(f"mode {number}: {_rate(mode)}; {_shape(equations, mode)}")
    if len(modes) > _MODES:
        yield Line(f"and {len(modes) - _MODES} faster ones")


def _exponents(equations: EquationsOfMotion, item: Equilibrium) -> Iterator[Line]:
    yield Line("The equations change with time, so that there are no normal modes.")
    result = floquet(equations, item.q, further=item.further)
    size = float(np.abs(result.exponents).max())
    listed = ", ".join(_complex(complex(x), size) for x in result.exponents)
    behaviour = "do not grow" if result.stable else "grow"
    yield Line(f"Floquet exponents for the period {_number(result.period)} s: {listed} 1/s; small motions {behaviour}.")


def _rate(mode: NaturalMode) -> str:
    """Frequency and decay in words."""
    real, omega = mode.eigenvalue.real, mode.frequency
    size = abs(mode.eigenvalue)
    if size == 0:
        return "no restoring force"
    if omega <= 1e-9 * size:
        return f"{'grows' if real > 0 else 'decays'} by e in {_number(1 / abs(real))} s"
    text = f"{_number(omega)} rad/s, {_number(omega / (2 * np.pi))} Hz"
    if abs(real) <= 1e-9 * size:
        return text
    return f"{text}, {'growing' if real > 0 else 'damping ratio'} {_number(abs(real) / size)}"


def _shape(equations: EquationsOfMotion, mode: NaturalMode) -> str:
    """The coordinates that take part in a mode, with their shares."""
    entries = []
    for c, x in zip(equations.mechanism.coordinates, mode.shape, strict=True):
        if abs(x) >= 5e-4:
            in_phase = abs(x.imag) <= 1e-4 * abs(x)
            value = f"{x.real:.4g}" if in_phase else f"{abs(x):.4g} at {np.degrees(np.angle(x)):.3g} deg"
            entries.append(f"{c.name} {value}")
    return ", ".join(entries)


def _matrices(
    equations: EquationsOfMotion, found: Sequence[Equilibrium], first: Callable[[], Linearization]
) -> Iterator[Line]:
    """A, B, C, D about the first equilibrium, at the start without one."""
    about = first() if found else about_start(equations)
    if found:
        time = ", at the time 0" if driven_by_time(equations) else ""
        yield Line(f"About {_place(equations, found[0])}{time}{with_inputs(equations)}:")
    else:
        yield Line(f"About the start, there being no equilibrium{with_inputs(equations)}:")
    vectors = {"z": about.states, "u": about.inputs, "y": about.outputs}
    yield Line(", ".join(f"{name} = ({', '.join(entries)})" for name, entries in vectors.items()) + ", in SI units")
    if len(about.states) > _MATRIX:
        yield Line(f"A has {len(about.states)} rows and is not printed; lag2fmu.analysis.linearize returns it.")
        return
    for name, matrix in zip("ABCD", (about.A, about.B, about.C, about.D), strict=True):
        if matrix.size:
            yield Line(f"{name} = [{'; '.join(_row(row, matrix) for row in matrix)}]")


def _row(row: Floats, matrix: Floats) -> str:
    size = float(np.abs(matrix).max())
    return ", ".join(_number(x, size) for x in row)


def _hamiltonian(equations: EquationsOfMotion) -> Iterator[Line]:
    form = hamiltonian_form(equations)
    if form is None:
        yield Line("Written out, it is too long, or the mass matrix is singular; it can be evaluated.")
        return
    yield Line("H", form)
    if len(equations.constraints):
        yield Line("The constraints' forces G^T multiplier come to dp/dt = -dH/dq.")


def _routhian(equations: EquationsOfMotion) -> Iterator[Line]:
    cyclic = cyclic_coordinates(equations)
    pushed = pushed_by_constraints(equations)
    if set(cyclic) & pushed:
        listed = ", ".join(name for name in cyclic if name in pushed)
        yield Line(f"L does not contain {listed}, but constraints act there: the momenta change, and R is of no use.")
        return
    if not cyclic:
        yield Line("There is no cyclic coordinate.")
        return
    form = routhian_form(equations)
    if form is None:
        yield Line(f"Written out for the cyclic {', '.join(cyclic)}, it is too long.")
        return
    yield Line(f"With {', '.join(map(names.momentum, cyclic))} in the place of the velocities:")
    yield Line("R", form[1])


def _number(x: float, size: float = 0.0) -> str:
    """``x`` with six digits; 0 if it is rounding relative to ``size``."""
    return "0" if abs(x) <= ROUNDING * size else f"{x:.6g}"


def _complex(x: complex, size: float) -> str:
    real, imaginary = _number(x.real, size), _number(x.imag, size)
    if imaginary == "0":
        return real
    sign = "-" if imaginary.startswith("-") else "+"
    if real == "0":
        return f"{sign if sign == '-' else ''}{imaginary.lstrip('-')}i"
    return f"{real} {sign} {imaginary.lstrip('-')}i"
