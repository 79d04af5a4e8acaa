"""Equations stand alike in ``show``, on the FMU's page and in a notebook, with every force that acts."""

from __future__ import annotations

import re

import pytest
import sympy as sp

from lag2fmu import derive, load
from lag2fmu.description import names
from lag2fmu.dynamics.formulas import Expressions, expressions, formulas
from lag2fmu.fmu.documentation import _laws
from lag2fmu.formats.loading import bundled
from lag2fmu.formats.text import read
from lag2fmu.language.letters import latex, latex_name, unicode_name, without_dots
from lag2fmu.language.vocabulary import symbol
from lag2fmu.language.writer import to_read, to_text
from lag2fmu.mechanism.poses import poses_of
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.procedure.steps import procedure

HYBRID = sorted(
    name for name, path in bundled().items() if re.search(r"contacts|stops|frictions|while", path.read_text())
)

PRESS = """
[mechanism]
name = "press"
[parameters]
J = { value = 2, unit = "kg.m2" }
m = { value = 3, unit = "kg" }
r = { value = 0.1, unit = "m" }
[coordinates]
a = { unit = "rad", start = 0.4, velocity = 1 }
s = { unit = "m", guess = 0.1 }
[energy]
kinetic = "J*a_dot**2/2 + m*s_dot**2/2"
[constraints.holonomic]
rod = "s - r*cos(a)"
[frictions.guide]
on = "s_dot"
force = 5
[frictions.clutch]
on = "a_dot"
force = 7
[stops.punch]
of = "s"
upper = 0.2
"""


def rates(m: Mechanism) -> dict[str, sp.Expr]:
    """{force: the rate along which it acts} by what was written, without the graph of the equations."""
    poses = poses_of(m)
    found = {names.force(u.name): poses.rate(poses.resolved(u.gap)) for u in m.unilaterals}
    for u in m.unilaterals:
        found |= dict(zip(names.frictions(u.name, len(u.slips)), map(poses.resolved, u.slips), strict=True))
    found |= {names.force(f.name): poses.resolved(f.on) for f in m.frictions}
    for c in (*m.constraints, *m.latches):
        written = poses.resolved(c.expression)
        found[names.multiplier(c.name)] = poses.rate(written) if c.holonomic else written
    return found


def check_forces(m: Mechanism, found: Expressions) -> None:
    """The power of every force in the equations is the force times its own rate, at places of the graph's choice."""
    velocities = [symbol(names.velocity(q.name)) for q in m.coordinates]
    values = {symbol(name): 0.3 + 0.07 * k for k, name in enumerate(sorted(_names(m)))}
    for force, rate in rates(m).items():
        power = sum(right.diff(symbol(force)) * v for (_, right), v in zip(found.motion, velocities, strict=True))
        affine = rate - rate.xreplace(dict.fromkeys(velocities, sp.S.Zero))  # supports that move do work of their own
        assert sp.N((power - affine).xreplace(values)) == pytest.approx(0.0, abs=1e-12), force


def _names(m: Mechanism) -> set[str]:
    own = {q.name for q in m.coordinates} | {names.velocity(q.name) for q in m.coordinates}
    others = {p.name for p in m.parameters} | {u.name for u in m.inputs} | {z.name for z in m.states}
    return own | others | {x for u in m.motions for x in (names.velocity(u.name), names.acceleration(u.name))} | {"t"}


@pytest.mark.parametrize("model", [*HYBRID, "four_bar_linkage", "chaplygin_sleigh", "cylinder_in_cylinder"])
def test_no_force_is_missing(model: str) -> None:
    equations = derive(load(model))
    found = expressions(equations, 5000)
    if found is None:
        pytest.skip("the equations are too long to be written out")
    check_forces(equations.mechanism, found)


def test_show_page_and_notebook_say_the_same() -> None:
    equations = derive(read(PRESS, "press"))
    text, written = procedure(equations.mechanism), formulas(equations)
    assert written is not None
    assert "J*a_ddot = Q_a + clutch_force + multiplier_rod*r*sin(a)" in text
    assert "m*s_ddot = Q_s + guide_force + multiplier_rod - punch_upper_force" in text
    notebook = equations._repr_latex_() or ""
    for line in written.motion:
        assert line.latex in notebook
        assert line.latex in procedure(equations.mechanism, "latex")
    for word in ("clutch", "guide", "punch", "rod"):
        assert word in "".join(line.mathml for line in written.motion)
    sentences = [sentence for sentence, _ in _laws(equations)]
    assert [sentence.split(":")[0] for sentence in sentences] == [
        "stop punch_upper",
        "dry friction guide",
        "dry friction clutch",
    ]


@pytest.mark.parametrize(
    ("name", "paper", "drawn"),
    [
        ("theta1_dot", r"\dot{\theta}_{1}", "θ̇₁"),
        ("Q_theta", r"Q_{\theta}", "Q_theta"),
        ("Q_theta1", r"Q_{\theta_{1}}", "Q_theta1"),
        ("mr", r"\mathrm{mr}", "mr"),
        ("y_lower_ddot", r"\ddot{y}_{\mathrm{lower}}", "y\u0308_lower"),
        ("crossbar", r"\mathrm{crossbar}", "crossbar"),
        ("slip_dot", r"\dot{\mathrm{slip}}", "slip_dot"),
        ("lambda_max", r"\lambda_{\mathrm{max}}", "λ_max"),
        ("m_2", "m_{2}", "m₂"),
    ],
)
def test_words_are_words(name: str, paper: str, drawn: str) -> None:
    """A name of several letters is neither a product of letters nor a letter with an accent."""
    assert latex_name(*without_dots(name)) == paper
    assert unicode_name(*without_dots(name)) == drawn
    assert latex(symbol(name)) == paper


def test_coefficients_are_of_one_kind() -> None:
    """Decimals where one is; a half alone stays a half, and the text format writes the shortest."""
    x, y, z = map(symbol, "xyz")
    mixed = sp.Rational("0.3") * x + sp.Rational("0.2") * y + z / 3
    assert {*to_read(mixed).split(" + ")} == {"0.3*x", "0.2*y", "z/3"}
    assert {*to_text(mixed).split(" + ")} == {"0.3*x", "y/5", "z/3"}
    assert to_read(x**2 / 2) == "x**2/2"
    assert [to_read(sp.Rational(x)) for x in ("1/5", "0.3", "1/3", "4")] == ["0.2", "0.3", "1/3", "4"]


@pytest.mark.parametrize("model", ["heavy_top", "rolling_disc", "spherical_pendulum"])
def test_frames_in_space_have_steps_to_read(model: str) -> None:
    """L and its derivatives are written, and fulfil p = dL/dqd with the momenta of the graph."""
    text = procedure(load(model))
    for phrase in ("composed on the graph", "automatic differentiation", "derived on the graph"):
        assert phrase not in text
    steps = text.split("11. Derivatives of L")[1]
    assert all(f"dL/d({q.name}_dot) = " in steps for q in load(model).coordinates)
