"""The accelerations of a constrained mechanism from the parts that ``derive`` returns, by dense linear algebra."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.graph.graph import Node


def solve(equations: EquationsOfMotion, values: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """qdd (n,) and multipliers (m,) at ``values`` (by name, everything the graph asks for).

    The KKT system by least squares: accelerations are unique also where constraints are redundant, multipliers are not.
    """
    return solved(equations, np.array(equations.graph.evaluate(parts(equations), dict(values))))


def parts(equations: EquationsOfMotion) -> list[Node]:
    """The nodes (n n + n + m n + m,) of the mass matrix, the forcing, the Jacobian and accelerations of constraints."""
    c = equations.constraints
    nodes = [*(e for row in equations.mass_matrix for e in row), *equations.forcing]
    return [*nodes, *(e for row in c.jacobian for e in row), *c.accelerations]


def solved(equations: EquationsOfMotion, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same from the values of ``parts``."""
    n, m = len(equations.forcing), len(equations.constraints)
    mass, forcing, jacobian, gamma = np.split(numbers, np.cumsum([n * n, n, m * n]))
    G = jacobian.reshape(m, n)
    matrix = np.block([[mass.reshape(n, n), -G.T], [G, np.zeros((m, m))]])
    inertia = np.abs(np.diag(matrix))[:n]
    columns = np.concatenate([1 / np.sqrt(np.where(inertia > 0, inertia, 1.0)), np.ones(m)])  # kg beside kg.m2
    matrix = matrix * columns
    scale = 1 / np.maximum(np.abs(matrix).max(axis=1), 1e-300)
    found = np.linalg.lstsq(scale[:, None] * matrix, scale * np.concatenate([forcing, -gamma]), rcond=1e-12)[0]
    found = columns * found
    return found[:n], found[n:]
