"""Examples that SymPy and PyDy publish, imported: accelerations as those of their own equations."""

from __future__ import annotations

import importlib

import numpy as np
import pytest
import sympy as sp
from of_kane import accelerations, rates_of_speeds, speeds_of_kane
from sympy.physics.mechanics import KanesMethod, find_dynamicsymbols

from lag2fmu import load

pytestmark = pytest.mark.toolchain

BICYCLE = {
    **{"mframe": 85.0, "mfork": 4.0, "mwf": 3.0, "mwr": 2.0, "WRrad": 0.3, "WFrad": 0.35, "htangle": np.pi / 10},
    **{"Iframe11": 9.2, "Iframe22": 11.0, "Iframe33": 2.8, "Iframe31": 2.4, "g": 9.81, "forklength": 0.84},
    **{"Ifork11": 0.0589, "Ifork22": 0.06, "Ifork33": 0.00708, "Ifork31": -0.00755, "framelength": 0.95},
    **{"Iwr11": 0.0603, "Iwr22": 0.12, "Iwf11": 0.1405, "Iwf22": 0.28, "forkoffset": 0.1},
    **{"framecg1": 0.4, "framecg3": -0.6, "forkcg1": 0.1, "forkcg3": -0.4},
}


class _FormedError(Exception):
    """Ends SymPy's test where the equations are formed."""


def bicycle(monkeypatch: pytest.MonkeyPatch) -> KanesMethod:
    """SymPy's bicycle of Meijaard et al., as its own test forms it."""
    found: list[KanesMethod] = []

    def formed(method: KanesMethod, *_: object, **__: object) -> None:
        found.append(method)
        raise _FormedError

    monkeypatch.setattr(KanesMethod, "linearize", formed)
    with pytest.raises(_FormedError):
        importlib.import_module("sympy.physics.mechanics.tests.test_kane3").test_bicycle()
    return found[0]


def test_the_bicycle(monkeypatch: pytest.MonkeyPatch) -> None:
    """Speeds of wheels whose angles do not matter, a redundant velocity constraint, a closed loop of pitch."""
    method = bicycle(monkeypatch)
    mechanism = load(method, BICYCLE)
    assert [c.kind for c in mechanism.constraints] == ["holonomic", "nonholonomic", "nonholonomic"]
    values = {sp.Symbol(name): number for name, number in BICYCLE.items()}
    *chosen, pitch = method.q
    values |= dict(zip(chosen, (0.3, 0.1, -0.2), strict=True))
    unknown = sp.Symbol("unknown")
    values[pitch] = float(sp.nsolve(method._f_h[0].xreplace(values).xreplace({pitch: unknown}), unknown, 0.1))
    dependent = list(method._udep)
    independent = [u for u in method.u if u not in dependent]
    values |= dict(zip(independent, (0.2, -3.0, 0.4), strict=True))
    ties = list((method._k_nh * method.u + method._f_nh).xreplace(values))
    values |= dict(zip(dependent, map(float, sp.linsolve(ties, *dependent).args[0]), strict=True))
    qd, expected = speeds_of_kane(method, values)
    spins = [values[u] for u in method.u if str(u.func) in {"u3", "u6"}]
    qdd = accelerations(mechanism, [*(values[q] for q in method.q), 0, 0], [*qd, *spins])
    assert rates_of_speeds(method, values, qdd, np.array([*qd, *spins])) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("links", [1, 3, 6])
def test_pydys_pendulum_on_a_cart(links: int) -> None:
    """n links with torques and a force, which become inputs."""
    models = pytest.importorskip("pydy.models", reason="PyDy is not installed; 'make test-all' does so")
    method = models.n_link_pendulum_on_cart(links, cart_force=True, joint_torques=True).eom_method
    names = sorted({str(s) for m in (method.mass_matrix_full, method.forcing_full) for s in m.free_symbols} - {"t"})
    constants = {name: 0.5 + 0.1 * i for i, name in enumerate(names)}
    q, u = np.random.default_rng(0).uniform(-1, 1, (2, links + 1))
    values = {sp.Symbol(name): number for name, number in constants.items()}
    values |= dict(zip((*method.q, *method.u), (*q, *u), strict=True))
    inputs = find_dynamicsymbols(method.forcing_full) - {*method.q, *method.u}
    values |= dict.fromkeys(inputs, 0.3)
    qd, expected = speeds_of_kane(method, values)
    qdd = accelerations(load(method, constants), q, qd, **{str(f.func): 0.3 for f in inputs})
    assert rates_of_speeds(method, values, qdd, qd) == pytest.approx(expected, rel=1e-12)
