"""Redundant drives: against a solver of another kind, and by the accelerations that their forces give."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

import lag2fmu
from lag2fmu.analysis.inverse import inverse
from lag2fmu.analysis.sharing import shared_forces
from lag2fmu.errors import DerivationError, LoadError

MODEL = "four_bar_linkage"


def run(count: int = 5) -> dict[str, np.ndarray]:
    """A turning crank, as its inverse mechanism starts for each angle; forces need not belong to the motion."""
    time, columns = 0.1 * np.arange(count), []
    for angle in np.linspace(0.3, 1.4, count):
        f = lag2fmu.function(inverse(MODEL, "a"), values={"a": float(angle)})
        columns.append([angle, *f.start["x"][:2]])
    return {"time": time, **dict(zip("abc", np.array(columns).T, strict=True)), "F_a": np.linspace(3.0, -4.0, count)}


def powers(given: dict[str, np.ndarray], i: int) -> np.ndarray:
    """The velocities of a, b, c by that of a, from the closure of the loop alone."""
    values = {p.name: p.value for p in lag2fmu.load(MODEL).parameters}
    a, b, c = (given[x][i] for x in "abc")
    l1, l2, l3 = (values[x] for x in ("l1", "l2", "l3"))
    left = np.array([[-l2 * np.sin(b), l3 * np.sin(c)], [l2 * np.cos(b), -l3 * np.cos(c)]])
    return np.array([1.0, *np.linalg.solve(left, [l1 * np.sin(a), -l1 * np.cos(a)])])


@pytest.mark.parametrize("limits", [{}, {"a": (-1.0, 1.0)}, {"a": (-0.5, 0.5), "c": (-2.5, 30.0)}])
def test_the_least_forces_within_limits(limits: dict) -> None:
    given = run()
    found = shared_forces(MODEL, given, drives=["a", "b", "c"], limits=limits)
    for i in range(len(given["time"])):
        Q, rate = np.array([found[f"Q_{x}"][i] for x in "abc"]), powers(given, i)
        assert Q @ rate == pytest.approx(given["F_a"][i], rel=1e-9)
        bounds = [limits.get(x, (None, None)) for x in "abc"]
        rule = {"type": "eq", "fun": lambda x, i=i, rate=rate: x @ rate - given["F_a"][i]}
        other = minimize(lambda x: x @ x, Q * 0, jac=lambda x: 2 * x, bounds=bounds, constraints=rule, tol=1e-14)
        assert pytest.approx(other.x, rel=1e-5, abs=1e-5) == Q


@pytest.mark.parametrize(
    ("drives", "limits", "error", "said"),
    [
        (["d"], {}, LoadError, "'d' is not a coordinate of"),
        (["a"], {"b": (0, 1)}, LoadError, "'b' is not one of the drives"),
        (["a"], {"a": (1, 0)}, LoadError, "limits of 'a', 1 to 0, leave no room"),
        (["a"], {"a": (-1, 1)}, DerivationError, "at time 0 s: a cannot do what the motion needs"),
        ([], {}, DerivationError, "cannot do what the motion needs"),
    ],
)
def test_what_cannot_be(drives: list, limits: dict, error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said):
        shared_forces(MODEL, run(2), drives=drives, limits=limits)
    with pytest.raises(LoadError, match="'b' is not a column"):
        shared_forces(MODEL, {"time": [0.0], "a": [1.0]}, drives=["a"])
