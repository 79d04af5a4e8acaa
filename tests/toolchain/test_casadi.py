"""CasADi (DaeBuilder) as an importer of model exchange: its values, Jacobians, adjoints and CVODES against our own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from stepping import Stepping

from lag2fmu.fmu import Fmu
from lag2fmu.formats.loading import load
from lag2fmu.reference import Equations, integrate

casadi = pytest.importorskip("casadi", reason="CasADi is not installed: pip install -e '.[importers]'")

Floats = NDArray[np.float64]

pytestmark = [pytest.mark.toolchain, pytest.mark.fmu]

VERSIONS = ["2.0", "3.0"]
MODELS = ["cart_pole", "double_pendulum", "elastic_pendulum", "motion_driven_pendulum", "vertically_driven_pendulum"]


class Imported:
    """The FMU as CasADi sees it: names of states, inputs, parameters, and the function of (t, x, u, p)."""

    def __init__(self, fmu: Fmu) -> None:
        self.dae: Any = casadi.DaeBuilder(fmu.mechanism.name, str(fmu.path))
        self.x, self.u, self.p, self.y = (list(getattr(self.dae, kind)()) for kind in "xupy")
        self.function = self.dae.create("f", ["t", "x", "u", "p"], ["ode", "y"])
        self.starts = np.array(self.dae.start(self.x)), np.array(self.dae.start(self.p))


def points(imported: Imported, count: int = 5) -> list[tuple[float, Floats, Floats, Floats]]:
    """(t, x, u, p) off the start, where all functions are defined."""
    generator = np.random.default_rng(8)
    x, p = imported.starts
    return [
        (
            generator.uniform(0, 3),
            x + generator.uniform(-0.3, 0.3, len(x)),
            generator.uniform(-1, 1, len(imported.u)),
            p * generator.uniform(0.9, 1.1, len(p)),
        )
        for _ in range(count)
    ]


def dense(matrix: Any) -> Floats:
    return np.array(casadi.DM(matrix).full())


@pytest.mark.parametrize("fmi", VERSIONS)
@pytest.mark.parametrize("model", MODELS)
def test_variables_have_their_roles(model: str, fmi: str, exported) -> None:
    imported, mechanism = Imported(exported(model, fmi=fmi)), load(model)
    states = [c.name for c in mechanism.coordinates]
    assert imported.x == [*states, *(f"{name}_dot" for name in states)]
    assert imported.p == [p.name for p in mechanism.parameters if p.expression is None]
    assert imported.starts[1].tolist() == [p.value for p in mechanism.parameters if p.expression is None]
    assert set(imported.u) >= {f"Q_{name}" for name in states}
    assert imported.y == [*imported.x, *(output.name for output in mechanism.outputs)]


@pytest.mark.parametrize("fmi", VERSIONS)
@pytest.mark.parametrize("model", MODELS)
def test_values_are_those_of_fmpy_and_of_the_direct_equations(model: str, fmi: str, exported) -> None:
    fmu = exported(model)
    imported, n = Imported(exported(model, fmi=fmi)), len(fmu.mechanism.coordinates)
    for t, x, u, p in points(imported):
        ode, y = (dense(value)[:, 0] for value in imported.function(t, x, u, p))
        with Stepping(fmu.path, "ModelExchange") as host:
            host.start(dict(zip(imported.p, p, strict=True)))
            host.unit.setTime(t)
            host.set(dict(zip(imported.x + imported.u, [*x, *u], strict=True)))
            assert host.get([f"der_{name}" for name in imported.x]) == ode.tolist()
            assert host.get(imported.y) == y.tolist()
        equations = Equations(fmu.mechanism, dict(zip(imported.p, p.tolist(), strict=True)))
        inputs = dict(zip(imported.u, u.tolist(), strict=True))
        assert ode[n:] == pytest.approx(equations.accelerations(t, x[:n], x[n:], inputs), rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("fmi", VERSIONS)
@pytest.mark.parametrize("model", MODELS)
def test_jacobians_are_the_limits_of_differences(model: str, fmi: str, exported) -> None:
    """CasADi asks for them by directional derivatives, with the sparsity of modelDescription.xml."""
    imported = Imported(exported(model, fmi=fmi))
    names = [f"jac:{output}:{known}" for output in ("ode", "y") for known in ("x", "u", "p")]
    jacobian = imported.function.factory("J", ["t", "x", "u", "p"], names)
    h = 1e-3
    for point in points(imported, 2):
        found = [dense(block) for block in jacobian(*point)]
        for number, block in enumerate(found):
            output, known = divmod(number, 3)
            for column in range(block.shape[1]):
                moved = {}
                for k in (-2, -1, 1, 2):
                    shifted = [np.array(part, dtype=float) for part in point]
                    shifted[known + 1][column] += k * h
                    moved[k] = dense(imported.function(*shifted)[output])[:, 0]
                expected = (8 * (moved[1] - moved[-1]) - (moved[2] - moved[-2])) / (12 * h)
                assert block[:, column] == pytest.approx(expected, rel=1e-7, abs=1e-7), (names[number], column)


@pytest.mark.parametrize("fmi", VERSIONS)
@pytest.mark.parametrize("model", MODELS)
def test_cvodes_integrates_to_the_direct_integration(model: str, fmi: str, exported) -> None:
    imported = Imported(exported(model, fmi=fmi))
    x0, p = imported.starts
    t, x = casadi.MX.sym("t"), casadi.MX.sym("x", len(x0))
    ode = imported.function(t, x, np.zeros(len(imported.u)), p)[0]
    times = np.linspace(0.0, 3.0, 31)
    settings = {"abstol": 1e-11, "reltol": 1e-11}
    run = casadi.integrator("run", "cvodes", {"t": t, "x": x, "ode": ode}, 0.0, list(times[1:]), settings)
    found = dense(run(x0=x0)["xf"]).T
    expected = integrate(load(model), times).trajectory.columns(imported.x)[1:]
    assert np.abs(found - expected).max() < 1e-7
    assert np.ptp(expected, axis=0).max() > 0.1, "it moves"


@pytest.mark.parametrize("model", [*MODELS, "four_bar_linkage"])
def test_adjoints_are_transposed_jacobians(model: str, exported) -> None:
    """CasADi asks for them by fmi3GetAdjointDerivative; for the Jacobian by fmi3GetDirectionalDerivative."""
    imported = Imported(exported(model, fmi="3.0"))
    known, found = ["t", "x", "u", "p"], ["ode", "y"]
    adjoint = imported.function.factory("A", [*known, *(f"adj:{y}" for y in found)], [f"adj:{x}" for x in known[1:]])
    blocks = [f"jac:{y}:{x}" for y in found for x in known[1:]]
    jacobian = imported.function.factory("J", known, blocks)
    generator = np.random.default_rng(3)
    t, (x, p) = 0.5, imported.starts
    point = t, x, generator.uniform(-1, 1, len(imported.u)), p
    weights = [generator.uniform(-1, 1, imported.function.size1_out(k)) for k in range(2)]
    products = [dense(part)[:, 0] for part in adjoint(*point, *weights)]
    parts = [dense(block) for block in jacobian(*point)]
    for k, product in enumerate(products):
        expected = weights[0] @ parts[k] + weights[1] @ parts[3 + k]
        scale = max(1.0, np.abs(expected).max())
        assert np.abs(product - expected).max() < 1e-13 * scale
