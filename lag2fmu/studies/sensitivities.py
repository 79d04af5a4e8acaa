"""Derivatives through time: those of states and outputs along a motion by starts, parameters and inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.units import Unit
from lag2fmu.progress import telling
from lag2fmu.reference.trajectory import Floats
from lag2fmu.studies.library import Study, StudyLibrary, compiled
from lag2fmu.studies.requests import (
    check_over,
    continuous_outputs,
    references_of,
    scale_of,
    signals_of,
    times_of,
)
from lag2fmu.verify.inputs import Inputs
from lag2fmu.verify.plan import check_tolerance

TOLERANCE = 1e-8
"""The relative tolerance of the runs, if none is given."""


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """A motion and its derivatives, in SI units.

    ``time`` (m,) in s; ``outputs`` (k) and ``over`` (d) are names; ``values`` (m, k); ``derivatives`` (m, k, d), where
    [i, j, l] is d outputs[j] at time[i] / d over[l]. ``units`` are those of both kinds of names.
    """

    time: Floats
    outputs: tuple[str, ...]
    over: tuple[str, ...]
    values: Floats
    derivatives: Floats
    units: Mapping[str, Unit | None] = field(repr=False)

    def __getitem__(self, names: str | tuple[str, str]) -> Floats:
        """The values (m,) of an output, or the derivatives (m,) of (output, varied), in SI units.

        Raises LoadError for an unknown name.
        """
        if isinstance(names, str):
            return self.values[:, _place(names, self.outputs, "output")]
        output, varied = names
        return self.derivatives[:, _place(output, self.outputs, "output"), _place(varied, self.over, "direction")]

    def unit(self, output: str, varied: str) -> Unit | None:
        """The SI unit of the derivative of ``output`` by ``varied``, None where one of the two has no unit."""
        above, below = self.units.get(output), self.units.get(varied)
        return None if above is None or below is None else above / below


def _place(name: str, names: tuple[str, ...], what: str) -> int:
    if name not in names:
        raise LoadError(f"there is no {what} '{name}' among the derivatives; {suggestion(name, names)}")
    return names.index(name)


@telling("differentiating runs")
def sensitivities(  # noqa: PLR0913 (those of simulate)
    model: object,
    *,
    over: Sequence[str],
    outputs: Sequence[str] | None = None,
    times: Sequence[float] | Floats | None = None,
    stop_time: float | None = None,
    step: float | None = None,
    tolerance: float = TOLERANCE,
    values: Mapping[str, float] | None = None,
    inputs: Inputs | None = None,
    hold: bool = False,
    solver: str | None = None,
) -> Sensitivities:
    """The motion of ``model``, and the derivatives of ``outputs`` at ``times`` (m,), in s, by the names ``over``.

    ``over`` are names of starts, parameters and inputs. A derivative by a start is that by its value at time 0;
    dependent starts follow by the constraints. A derivative by an input is that by a constant added to it from time 0
    on. ``times``, or ``stop_time`` and ``step``, as well as ``values``, ``inputs`` and ``hold`` are those of
    ``simulate``, in SI units. The variational equations are integrated with the motion by ``solver``, one of
    ``studies.library.SOLVERS``, by default "dop853"; of those with error control both are under the relative
    ``tolerance``, others take steps of ``solver_step`` among the ``values``. At impacts, stops, switches and changes of
    friction they jump as the motion demands.

    Raises LoadError for bad arguments, and SimulationError where the run fails or has no derivative. There is none
    where an event function touches zero without crossing it, and where several contacts act at one instant that would
    act at different ones with other values.
    Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 1993, section I.14.
    """
    library = compiled(model, solver=solver)
    found = directed_run(library, over, continuous_outputs(library, outputs), values=values or {},
                         times=times_of(library, times, stop_time, step), tolerance=check_tolerance(tolerance),
                         inputs=inputs, hold=hold)  # fmt: skip
    if found.reason:
        raise SimulationError(f"'{library.name}': the run with derivatives failed: {found.reason}")
    return found.result


@dataclass(frozen=True)
class Directed:
    """The results of ``directed_run``, and the reason why it ended early; "" if it did not."""

    result: Sensitivities
    reason: str


def directed_run(  # noqa: PLR0913 (what makes a run)
    library: StudyLibrary,
    over: Sequence[str],
    outputs: Sequence[str],
    *,
    values: Mapping[str, float],
    times: Floats,
    tolerance: float,
    start: float = 0.0,
    inputs: Inputs | None = None,
    hold: bool = False,
    study: Study | None = None,
) -> Directed:
    """One run of a ``library`` for derivatives, in the memory of ``study`` if it is given; see ``sensitivities``.

    ``times`` (m,) in s ascend from ``start`` (s); ``values`` are in SI units. Raises LoadError as ``sensitivities``.
    """
    check_over(library, over)
    seeds = [(library.settable(name), scale_of(library, name, values)) for name in over]
    found, slopes, reason = (study or Study(library, len(over))).run(
        references_of(library, values),
        times,
        library.readable(outputs),
        tolerance=tolerance,
        start=start,
        signals=signals_of(library, inputs, times, hold=hold),
        seeds=seeds,
    )
    units = {name: library.variables[name].unit for name in (*outputs, *over)}
    return Directed(Sensitivities(times, tuple(outputs), tuple(over), found, slopes, units), reason)
