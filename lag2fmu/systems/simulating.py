"""``simulate`` for a mechanism, an FMU, or a system of FMUs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from lag2fmu.errors import LoadError
from lag2fmu.fmu.exported import Model
from lag2fmu.progress import telling
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.systems.assembling import Part, network_of
from lag2fmu.systems.coupling import Coupling
from lag2fmu.systems.fmu_process import Apart
from lag2fmu.systems.running import simulate_system
from lag2fmu.systems.source import is_system
from lag2fmu.verify import entry_points
from lag2fmu.verify.inputs import Inputs
from lag2fmu.verify.run import Kind, Run


@telling("simulating")
def simulate(  # noqa: PLR0913 (the fields of Run)
    model: Model | Mapping[str, Part],
    *,
    connect: Iterable[str] = (),
    join: Iterable[str] = (),
    stop_time: float | None = None,
    step: float | None = None,
    tolerance: float | None = None,
    values: Mapping[str, float] | None = None,
    inputs: Inputs | None = None,
    hold: bool = False,
    outputs: Sequence[str] | None = None,
    beside: Sequence[str] = (),
    kind: Kind = "co-simulation",
    solver: str | None = None,
    sample_time: float | None = None,
    progress: Callable[[float], None] | None = None,
    apart: Apart = False,
    coupling: Coupling = "jacobi",
) -> Trajectory:
    """Run ``model`` as an FMU by fmpy and return its ``outputs`` every ``step`` (s) until ``stop_time`` (s).

    ``model`` may be a system: the path of an .ssp or .ssd, or {name: component} with the ``connect`` and ``join`` of
    ``lag2fmu.ssp``. Its variables are called COMPONENT.VARIABLE. A component is an FMU, a mechanism, or a Python
    function, "FILE.py:NAME@SAMPLE_TIME" or a Controller of ``lag2fmu.systems.controller``. What is returned is then a
    SystemRun, whose ``coupling`` tells steps, errors and the energy that the coupling made in each bond.
    With ``apart`` each FMU of it has a process of its own; a number is the longest time (s) that a call may take there,
    after which the process is ended. An executor of concurrent.futures gives each a worker, as the clusters that
    ``sweep`` takes. ``coupling`` tells how components make a step: side by side
    ('jacobi'), one after the other along their connections ('gauss-seidel'), or again until no input misses what it
    hears ('iterated').

    The trajectory has m times and k columns in SI units, (m, k); behind the outputs stand those variables of ``beside``
    that the FMU has. ``values`` are start values and parameters in SI units; ``kind`` is 'co-simulation' or
    'model-exchange' (fmpy's CVode). ``inputs`` are signals over time: a Trajectory, the path of a CSV file, a mapping
    of arrays, a structured array or a DataFrame with a column ``time``, or a function of time that gives a mapping.
    They are linear between their times, or with ``hold`` constant during a communication step. With ``sample_time``
    (s) they are a function of t (s) and y, {output: value}, that closes a loop: it is asked at multiples of this time,
    for {input: value}, which hold until the next one. The derivatives of a
    motion that is given by position alone come from a spline. A model that is no FMU yet is exported to a temporary
    folder first, with this ``solver`` or one that suits its start; an FMU that was run before is reset instead of
    loaded. On Linux, FMUs that lag2fmu did not make run in a process of their own, which takes milliseconds. Raises
    Lag2FmuError if the model cannot be loaded, exported or run, and SimulationError if it crashes there. What is
    doubtful in the run, as friction beyond its limit, is told by a warning of the logger "lag2fmu", which goes to
    standard error.
    """
    if isinstance(model, Mapping) or is_system(model):
        if solver is not None:
            raise LoadError("a system has no solver; export its mechanisms, each with a solver of its own")
        if sample_time is not None:
            raise LoadError("a system has no sample_time; its controllers are components of their own")
        run = Run(stop_time, step, tolerance, values, None, hold, outputs, beside, kind, progress)
        with network_of(model if isinstance(model, Mapping) else Path(str(model)), connect, join) as network:
            return simulate_system(network, run, inputs, apart=apart, coupling=coupling)
    if [*connect, *join] or coupling != "jacobi":
        raise LoadError("there is one model and nothing to connect or couple; give {name: component}")
    return entry_points.simulate(
        model, stop_time=stop_time, step=step, tolerance=tolerance, values=values, inputs=inputs, hold=hold,
        outputs=outputs, beside=beside, kind=kind, solver=solver, sample_time=sample_time, progress=progress,
    )  # fmt: skip
