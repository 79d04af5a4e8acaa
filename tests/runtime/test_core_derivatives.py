"""Derivatives of the compiled core: adjoints are transposed tangents in all phases; outputs while contacts slide."""

import ctypes
import re
import subprocess
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path

import fmpy
import numpy as np
import pytest
from chosen import models
from compiling import COMPILERS, STRICT, UNOPTIMISED
from fmpy.fmi2 import FMU2Model, FMU2Slave
from numpy.typing import NDArray

from lag2fmu.dynamics import derive, lower
from lag2fmu.dynamics.adjoint import with_adjoints
from lag2fmu.dynamics.lagrange import with_derived
from lag2fmu.fmu.advice import suited_solver
from lag2fmu.fmu.backends.native import describe, fmi_headers
from lag2fmu.fmu.translation_units import translation_units
from lag2fmu.fmu.variables import promotable
from lag2fmu.formats.loading import load
from lag2fmu.solvers.methods import METHODS

Floats = NDArray[np.float64]

SAMPLE = frozenset({"falling_rod", "slides_problem_5_small"})
"""Redundant rows, sliding in several modes; constraints, solved starts and what has no mass."""
PROBE = Path(__file__).with_name("derivatives_probe.c")
STEPS, POINTS, PRODUCTS = 30, 12, 20
EQUAL = 1e-13
STICKS = 2


class Probe:
    """A model, all variables being outputs, compiled with derivatives_probe.c in ``folder``."""

    def __init__(self, model: str, folder: Path) -> None:
        equations = derive(load(model))
        solver, _ = suited_solver(equations, tuple(METHODS))
        outputs = promotable(equations, ("all",))
        program = with_adjoints(lower(equations, outputs, METHODS[solver].variational))
        self.description, sources = describe(with_derived(load(model), equations), equations, program, solver)
        name = self.description.model_identifier
        library = folder / "binaries" / fmpy.platform / f"{name}{fmpy.sharedLibraryExtension}"
        library.parent.mkdir(parents=True)
        sources = {**sources, PROBE.name: PROBE.read_text("utf-8")}
        joined = translation_units(sources)
        for file, text in {**sources, **joined}.items():
            (folder / file).write_text(text, "utf-8")
        options = [*STRICT, *UNOPTIMISED["zig"], f"-I{fmi_headers()}", "-shared"]
        command = [*COMPILERS["zig"], *options, "-o", str(library), *joined, "-lm"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        self.folder, self.library = folder, ctypes.CDLL(str(library))
        found = re.search(r"#define N_CONTINUOUS (\d+)", sources["mechanism.h"])
        assert found is not None
        self.states = int(found[1])
        self.unknowns, self.knowns = (self._columns(f"probe_{kind}") for kind in ("unknowns", "knowns"))

    def _columns(self, function: str) -> dict[str, int]:
        """{name: index} of the variables that the library lists."""
        references = (ctypes.c_int * len(self.description.variables))()
        count = getattr(self.library, function)(references)
        name = {v.value_reference: v.name for v in reversed(self.description.variables)}
        return {name[reference]: i for i, reference in enumerate(references[:count])}

    def sizes(self, tangents: Floats) -> Floats:
        """What knowns change by: parameters by their value, a force by what gives its coordinate a unit acceleration.

        Inertias are the derivatives of momenta in ``tangents``.
        """
        sizes = np.ones(len(self.knowns))
        for v in self.description.variables:
            if v.causality == "parameter" and v.name in self.knowns:
                sizes[self.knowns[v.name]] = abs(v.start or 1.0)
        for q in self.description.mechanism.coordinates:
            if f"{q.name}_dot" in self.knowns:
                inertia = tangents[self.unknowns[f"p_{q.name}"], self.knowns[f"{q.name}_dot"]]
                sizes[self.knowns[f"Q_{q.name}"]] = abs(inertia) or 1.0
        return sizes

    def instance(self, kind: type, tolerance: float | None = None) -> FMU2Slave | FMU2Model:
        """An instance in initialization mode."""
        about = self.description
        unit = kind(
            guid=about.guid,
            unzipDirectory=str(self.folder),
            modelIdentifier=about.model_identifier,
            instanceName=about.model_identifier,
        )
        unit.instantiate()
        unit.setupExperiment(tolerance=tolerance, startTime=0.0)
        unit.enterInitializationMode()
        return unit

    def jacobian(self, way: str, component: int) -> Floats | None:
        """d(unknowns)/d(knowns) by 'tangents' or 'adjoints'; None where there is none."""
        found = np.full((len(self.unknowns), len(self.knowns)), np.nan)
        place = found.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
        return found if getattr(self.library, f"probe_{way}")(ctypes.c_void_p(component), place) else None

    def modes(self, component: int) -> tuple[int, ...]:
        """The modes of contacts and dry frictions."""
        modes = (ctypes.c_int * 1000)()
        return tuple(modes[: self.library.probe_element_modes(ctypes.c_void_p(component), modes)])


def difference(tangents: Floats, adjoints: Floats, sizes: Floats) -> float:
    """The greatest difference of products with random weights and seeds, relative to the sum of all derivatives.

    Seeds change knowns by their ``sizes``, so that those of any unit count alike.
    """
    random = np.random.default_rng(7)
    weights, seeds = (random.normal(size=(PRODUCTS, count)) for count in tangents.shape)
    products = [np.einsum("ki,ij,kj->k", weights, matrix, seeds * sizes) for matrix in (tangents, adjoints)]
    return float(np.abs(products[0] - products[1]).max() / (np.abs(tangents * sizes).sum() or 1.0))


def visit(probe: Probe) -> Iterator[tuple[str, int]]:
    """(phase, component) in all phases: start, along co-simulation with its events, at random states."""
    slave = probe.instance(FMU2Slave)
    yield "initialization", slave.component
    slave.exitInitializationMode()
    step = probe.description.mechanism.experiment.stop_time / STEPS
    for i in range(STEPS):
        slave.doStep(i * step, step)
        yield "step", slave.component
    slave.terminate()
    yield "terminated", slave.component
    slave.freeInstance()
    model = probe.instance(FMU2Model)
    model.exitInitializationMode()
    yield "event", model.component
    model.newDiscreteStates()
    model.enterContinuousTimeMode()
    random = np.random.default_rng(3)
    states = (ctypes.c_double * probe.states)()
    model.getContinuousStates(states, probe.states)
    start = np.array(states)
    for _ in range(POINTS):
        there = start + 0.3 * random.normal(size=start.shape)
        model.setContinuousStates((ctypes.c_double * probe.states)(*there), probe.states)
        yield "continuous", model.component
    model.freeInstance()


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Probe]:
    """A model -> its probe, compiled once."""
    known: dict[str, Probe] = {}

    def build(model: str) -> Probe:
        if model not in known:
            known[model] = Probe(model, tmp_path_factory.mktemp(model))
        return known[model]

    return build


@pytest.mark.parametrize("model", models(SAMPLE))
def test_adjoints_are_the_transposed_tangents(model: str, built: Callable[[str], Probe]) -> None:
    """All unknowns by all knowns: time, states, inputs, parameters."""
    probe = built(model)
    worst: dict[str, float] = defaultdict(float)
    modes = set()
    for phase, component in visit(probe):
        tangents, adjoints = (probe.jacobian(way, component) for way in ("tangents", "adjoints"))
        assert (tangents is None) == (adjoints is None), phase
        if tangents is not None and adjoints is not None and np.isfinite(tangents).all():
            modes.add(probe.modes(component))
            worst[phase] = max(worst[phase], difference(tangents, adjoints, probe.sizes(tangents)))
    assert max(worst.values()) <= EQUAL, worst
    assert {"initialization", "step", "event", "continuous"} <= worst.keys()
    assert len(modes) > 1 or model not in SAMPLE or not probe.description.mechanism.unilaterals


@pytest.mark.parametrize(
    ("model", "at"), [("falling_rod", 0.3), pytest.param("sliding_sphere", 0.1, marks=pytest.mark.all_models)]
)
def test_second_derivatives_of_outputs_while_a_contact_slides(
    model: str, at: float, built: Callable[[str], Probe]
) -> None:
    """Forces, accelerations, energies: against differences of order 6 along the motion."""
    probe, spacing = built(model), 2e-3
    slave = probe.instance(FMU2Slave, tolerance=1e-13)
    slave.exitInitializationMode()
    names = [v for v in probe.description.variables if v.causality == "output" and v.type == "Real"]
    references = [v.value_reference for v in names]
    time, values, found = 0.0, [], []
    for k in range(-3, 4):
        slave.doStep(time, at + k * spacing - time)
        time = at + k * spacing
        values.append(slave.getReal(references))
        found += [slave.getRealOutputDerivatives(references, [2] * len(references))] if k == 0 else []
    expected = np.array([2, -27, 270, -490, 270, -27, 2]) / 180 @ np.array(values) / spacing**2
    assert any(mode > STICKS for mode in probe.modes(slave.component))
    assert found[0] == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())
    slave.freeInstance()
