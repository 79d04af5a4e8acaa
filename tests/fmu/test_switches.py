"""Kinks of forces are switches that turn at located events: exact pulses and steps, at every communication step."""

from __future__ import annotations

import math

import numpy as np
import pytest
from stepping import Stepping
from sympy import Abs, Heaviside, Max, Min, Rational, cos, pi, sign, sin

from lag2fmu import simulate
from lag2fmu.codegen import SMOOTH_METHODS
from lag2fmu.dynamics import derive, lower
from lag2fmu.errors import ExportError, SimulationError
from lag2fmu.fmu.exporting import export
from lag2fmu.language.expressions import TIME, parse
from lag2fmu.language.vocabulary import Choice, Smooth
from lag2fmu.mechanism import Energy, Experiment, Mechanism, coordinate, parameter, signal

pytestmark = pytest.mark.fmu

G, HEIGHT, OVER = 9.81, 1.0, 1e-6
PULSES = ((5.0, 5.1), (5.2, 5.203), (5.2035, 7.0), (9.0, 9.0001))
BARRIER = 0.05
DIP = (0.001, 0.0012)


def course() -> Mechanism:
    """Pulses in time on x; a barrier that y passes; z that rises above a height by OVER, and pushes w while it is.

    s pushes d in a short DIP of a margin that begins at 0.
    """
    x, y = coordinate("x"), coordinate("y", velocity=3.0)
    z, w = coordinate("z", velocity=math.sqrt(2 * G * (HEIGHT + OVER))), coordinate("w")
    s, d = coordinate("s", velocity=1.0), coordinate("d")
    within = parse(f"if(y - 1 > 0 and y - {1 + BARRIER} < 0, 1, 0)")
    return Mechanism(
        "course",
        coordinates=[x, y, z, w, s, d],
        energy=Energy(kinetic=sum(q.dot**2 for q in (x, y, z, w, s, d)) / 2, potential=G * z),
        forces={
            x: sum(Heaviside(TIME - a) - Heaviside(TIME - b) for a, b in PULSES),
            y: -2 * within.subs(dict.fromkeys(within.free_symbols, y)),
            w: Heaviside(z - HEIGHT),
            d: Heaviside(-s * (s - DIP[0]) * (s - DIP[1])),
        },
        experiment=Experiment(stop_time=10.0, step=0.01),
    )


COURSE = course()


@pytest.mark.parametrize("step", [10.0, 0.2, 0.02, 0.002])
def test_no_pulse_barrier_or_graze_is_missed(exported, step: float) -> None:
    """About 1.5 s for the export, 0.1 s a run. Each closed form holds to rounding of the times of events."""
    last = simulate(exported(COURSE).path, step=step).values[-1]
    run = simulate(exported(COURSE).path, step=step)
    assert run["x_dot"][-1] == pytest.approx(sum(b - a for a, b in PULSES), abs=1e-12)
    assert run["y_dot"][-1] == pytest.approx(math.sqrt(9.0 - 4 * BARRIER), abs=1e-12)
    assert run["w_dot"][-1] == pytest.approx(2 * math.sqrt(2 * OVER / G), rel=1e-9)
    assert run["d_dot"][-1] == pytest.approx(DIP[1] - DIP[0], abs=1e-12)
    assert last.tolist() == run.values[-1].tolist()


def test_model_exchange_meets_them_too(exported) -> None:
    run = simulate(exported(COURSE).path, step=0.02, tolerance=1e-9, kind="model-exchange")
    assert run["x_dot"][-1] == pytest.approx(sum(b - a for a, b in PULSES), abs=1e-9)
    assert run["y_dot"][-1] == pytest.approx(math.sqrt(9.0 - 4 * BARRIER), abs=1e-7)


def vee(speed: float = 0.0) -> Mechanism:
    """Potential |x|: parabolas, joined where the force turns."""
    x = coordinate("x", start=1.0, velocity=speed)
    energy = Energy(kinetic=x.dot**2 / 2, potential=Abs(x))
    return Mechanism("vee", coordinates=[x], energy=energy, experiment=Experiment(stop_time=20.0, step=0.04))


VEE = vee()


def vee_at(t: float) -> float:
    quarter = math.sqrt(2)
    phase = t % (4 * quarter)
    if phase <= quarter:
        return 1 - phase**2 / 2
    return -1 + (phase - 2 * quarter) ** 2 / 2 if phase <= 3 * quarter else 1 - (phase - 4 * quarter) ** 2 / 2


@pytest.mark.parametrize("solver", SMOOTH_METHODS)
def test_every_solver_turns_the_force_where_it_turns(exported, solver: str) -> None:
    """About 1 s a solver, nearly all of it for the export."""
    for step in (0.4, 0.04, 0.004):
        run = simulate(exported(VEE, solver=solver).path, step=step)
        assert max(abs(x - vee_at(t)) for t, x in zip(run.time, run["x"], strict=True)) < 1e-9


def test_model_exchange_by_cvode(exported) -> None:
    run = simulate(exported(VEE).path, step=0.04, tolerance=1e-9, kind="model-exchange")
    assert max(abs(x - vee_at(t)) for t, x in zip(run.time, run["x"], strict=True)) < 1e-6


def test_a_run_rolled_back_over_a_switch_repeats_bit_for_bit(exported) -> None:
    """Roll-back from before and from within the solver step that ends with the event, and from behind it."""
    for step in (0.1, 0.0313):
        with Stepping(exported(VEE).path) as vee:
            vee.start(stop_time=20.0)
            for _ in range(40):
                assert vee.repeats(3, step)


def test_events_at_communication_points(exported) -> None:
    """The force turns at sqrt(2): the point is there, one rounding before and one behind; the motion is the same."""
    for points in ([math.sqrt(2)], [math.nextafter(math.sqrt(2), 0)], [math.nextafter(math.sqrt(2), 2)], []):
        with Stepping(exported(VEE).path) as vee:
            vee.start(stop_time=20.0)
            for point in (*points, 2.0, 5.0):
                states = vee.step(point - vee.time)
            assert states[0] == pytest.approx(vee_at(5.0), abs=1e-13)


def braked() -> Mechanism:
    """A mass under 1 N that a force holds back in proportion to its speed, up to 0.9 N, which takes 1e-6 m/s."""
    x = coordinate("x", velocity=-1.0)
    back = Max(-Rational(9, 10), Min(Rational(9, 10), 10**6 * x.dot))
    return Mechanism("braked", coordinates=[x], energy=Energy(kinetic=x.dot**2 / 2), forces={x: 1 - back})


def test_a_band_below_the_tolerance_takes_no_longer_than_it_does(exported) -> None:
    """From -1 m/s with 1.9 m/s2 to the band, ln(19)/1e6 s through it, then on with 0.1 m/s2."""
    through = (1 - 0.9e-6) / 1.9 + math.log(19) / 1e6
    run = simulate(exported(BRAKED, solver="radau5").path, stop_time=2.0, step=0.5, tolerance=1e-6)
    assert run["x_dot"][-1] == pytest.approx(0.9e-6 + 0.1 * (2.0 - through), abs=5e-6)


def relay() -> Mechanism:
    """A relay that pushes x toward where x + x_dot is 0; a force on z that turns ever faster until 1 s."""
    x, z, c = coordinate("x", start=1.0), coordinate("z"), parameter("c", 1.0)
    forces = {x: -sign(x + x.dot), z: sign(sin(c / (1 - TIME)))}
    energy = Energy(kinetic=(x.dot**2 + z.dot**2) / 2)
    return Mechanism("relay", coordinates=[x, z], parameters=[c], energy=energy, forces=forces)


def modulated() -> Mechanism:
    """A force of pulses that are modulated in their width: 1 N while a sine is above a level."""
    x, frequency, level = coordinate("x"), parameter("frequency", 50.0), parameter("level", 0.0)
    pulses = {x: Heaviside(sin(2 * pi * frequency * TIME) - level)}
    energy = Energy(kinetic=x.dot**2 / 2)
    return Mechanism("modulated", coordinates=[x], parameters=[frequency, level], energy=energy, forces=pulses)


MODULATED = modulated()


@pytest.mark.parametrize(
    ("kind", "frequency"), [*(("co-simulation", f) for f in (50.0, 333.3, 1000.0)), ("model-exchange", 50.0)]
)
@pytest.mark.parametrize("level", [0.0, 0.95])
def test_no_pulse_of_thousands_is_missed(exported, kind, frequency: float, level: float) -> None:
    """The motion between pulses is a parabola, whose steps could be as long as the run.

    In model exchange the FMU says when the next pulse begins.
    """
    values = {"frequency": frequency, "level": level}
    run = simulate(exported(MODULATED).path, stop_time=10.0, step=10.0, values=values, kind=kind)
    assert run["x_dot"][-1] == pytest.approx(10 * (0.5 - math.asin(level) / math.pi), abs=1e-10)


BRAKED = braked()
RELAY = relay()


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
@pytest.mark.parametrize(("start", "time"), [(1.0, math.sqrt(3) - 1), (0.0, 0.0)])
def test_a_motion_that_is_pushed_back_from_both_sides_ends_with_a_sentence(exported, kind, start, time) -> None:
    """From x = 1 it gets there at sqrt(3) - 1; at x = 0 it begins there."""
    with pytest.raises(SimulationError, match=r"pushed back to where x \+ x_dot is 0 from both sides") as error:
        simulate(exported(RELAY).path, stop_time=0.95, step=0.05, kind=kind, values={"x": start})
    found = str(error.value).split("at time ")[1].split()[0]
    assert float(found) == pytest.approx(time, abs=1e-12 if kind == "co-simulation" else 2e-6)


def test_a_switch_that_turns_ever_faster_is_followed_as_far_as_it_can_be_told(exported) -> None:
    """The integral of sign(sin(u))/u^2 from 1 to u; roots are 1e-10 s apart where the run ends, after 5600 of them."""
    fmu = exported(RELAY).path
    run = simulate(fmu, stop_time=0.9999, step=0.3, values={"x": 100.0})
    turns = 1 / np.concatenate([[1.0], np.pi * np.arange(1, 3184), [1e4]])
    assert run["z_dot"][-1] == pytest.approx(((-1.0) ** np.arange(3184)) @ -np.diff(turns), abs=1e-11)
    with pytest.raises(SimulationError, match=r"at time 0\.999999\d+ sin\(c/\(1 - t\)\) .*turns ever faster"):
        simulate(fmu, stop_time=2.0, step=0.1, values={"x": 100.0, "c": 0.01})


def test_derivatives_are_those_of_the_present_mode(exported) -> None:
    x = coordinate("x", start=1.0)
    k = parameter("k", 2.0)
    energy = Energy(kinetic=x.dot**2 / 2, potential=k * Max(0, x) ** 2 / 2)
    mechanism = Mechanism("one_sided", coordinates=[x], parameters=[k], energy=energy)
    with Stepping(exported(mechanism).path, "ModelExchange") as fmu:
        fmu.start()
        for value, slope, by_k in ((0.5, -2.0, -0.5), (-0.5, 0.0, 0.0), (0.25, -2.0, -0.25)):
            fmu.set({"x": value})
            _event(fmu)
            assert fmu.derivative(["x_ddot"], {"x": 1.0}) == [slope]
            assert fmu.derivative(["x_ddot"], {"k": 1.0}) == [by_k]
            assert fmu.get(["x_ddot"]) == [slope * value]


def bumper() -> Mechanism:
    """A pendulum that meets a spring, drag that turns with the velocity, and a gate that an input opens."""
    a, b = coordinate("a", start=1.0), coordinate("b", start=0.2)
    gate = signal("gate", start=0.0)
    return Mechanism(
        "bumper",
        coordinates=[a, b],
        inputs=[gate],
        energy=Energy(
            kinetic=a.dot**2 / 2 + b.dot**2 / 2 + cos(a - b) * a.dot * b.dot / 4,
            potential=-9.81 * cos(a) - 4 * cos(b) + 200 * Max(0, a - 0.3) ** 2 / 2,
        ),
        forces={a: -0.1 * sign(a.dot) * a.dot**2, b: -0.2 * Abs(b.dot) * b.dot + Heaviside(gate - sin(a))},
        experiment=Experiment(stop_time=5.0, step=0.01),
    )


BUMPER = bumper()


@pytest.mark.parametrize("solver", ["dopri5", "radau5"])
def test_the_result_does_not_depend_on_the_communication_step(exported, solver: str) -> None:
    ends = [simulate(exported(BUMPER, solver=solver).path, step=5.0 / n, tolerance=1e-10) for n in (50, 500, 5000)]
    for end in ends[1:]:
        assert np.abs(end.values[-1] - ends[0].values[-1]).max() < 3e-8


def test_a_switch_follows_an_input_at_once(exported) -> None:
    """Before the step, so that values that are read at the communication point belong to the new input."""
    with Stepping(exported(BUMPER).path) as fmu:
        fmu.start()
        before = fmu.get(["b_ddot"])[0]
        fmu.set({"gate": 1.0})
        assert fmu.get(["b_ddot"])[0] > before + 0.9
        assert fmu.repeats(5, 0.01)


@pytest.mark.parametrize("solver", ["dopri5", "radau5"])
def test_a_branch_without_a_value_beyond_its_end(exported, solver: str) -> None:
    """Hertz's contact as a choice: (-x)**(3/2) is not real while the ball is above the ground. Energy is kept."""
    x = coordinate("x", start=0.1)
    mechanism = Mechanism(
        "hertz_by_choice",
        coordinates=[x],
        energy=Energy(kinetic=x.dot**2 / 2, potential=G * x),
        forces={x: Choice(-x, 1e4 * (-x) ** Rational(3, 2), 0)},
        experiment=Experiment(stop_time=3.0, step=0.01),
    )
    run = simulate(exported(mechanism, solver=solver).path, step=0.01, tolerance=1e-9)
    stored = 1e4 / 2.5 * np.maximum(-run["x"], 0.0) ** 2.5
    assert run["x"].min() < -0.005
    assert np.abs(run["x_dot"] ** 2 / 2 + G * run["x"] + stored - 0.1 * G).max() < 1e-6


@pytest.mark.parametrize("start", [-0.5, 0.0, 0.4])
def test_a_branch_that_is_not_taken_needs_no_values(exported, start: float) -> None:
    """Logarithms, quotients, powers of what is negative or 0, exponentials that overflow: V and a force, by hand."""
    x, n = coordinate("x"), parameter("n", -1.5)
    potential = parse("if(abs(x) > 0.000001, sin(x)/x, 1) + if(x > 0, x**2*log(x), 0)")
    force = parse("if(x > 0, x**3*x**n, 0) + if(x > 0, exp(-1/x)/x, 0) + if(x < 1, 0, exp(900/(x + 1)))")
    energy = Energy(x.dot**2 / 2, potential)
    mechanism = Mechanism("branches", coordinates=[x], parameters=[n], energy=energy, forces={x: force})

    def acceleration(x: float) -> float:
        slope = (math.cos(x) / x - math.sin(x) / x**2 if x else 0.0) + (2 * x * math.log(x) + x if x > 0 else 0.0)
        return (x**1.5 + math.exp(-1 / x) / x if x > 0 else 0.0) - slope

    with Stepping(exported(mechanism).path, "ModelExchange") as fmu:
        fmu.start({"x": start})
        assert fmu.get(["x_ddot"])[0] == pytest.approx(acceleration(start), rel=1e-13)
        if start:
            expected = (acceleration(start + 1e-5) - acceleration(start - 1e-5)) / 2e-5
            assert fmu.derivative(["x_ddot"], {"x": 1.0})[0] == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("solver", ["dopri5", "radau5", "rk4"])
def test_the_end_of_a_logarithm_is_passed(exported, solver: str) -> None:
    """Trial steps go beyond the places where x log(x) and acos(1 - x) end; energy with the work of both by hand."""
    x = coordinate("x", start=-0.5, velocity=1.0)
    force = parse("if(x > 0, x*log(x), 0) - if(x <= 0, 0, acos(1 - x))")
    mechanism = Mechanism(
        "ends", coordinates=[x], energy=Energy(x.dot**2 / 2, 2 * x**2), forces={x: force},
        experiment=Experiment(stop_time=6.0, step=0.05),
    )  # fmt: skip
    run = simulate(exported(mechanism, solver=solver).path, tolerance=1e-9)
    place = np.maximum(run["x"], 1e-300)
    work = place**2 * (np.log(place) / 2 - 0.25) - np.sqrt(place * (2 - place)) - (place - 1) * np.arccos(1 - place)
    energy = run["x_dot"] ** 2 / 2 + 2 * run["x"] ** 2 - work
    assert (np.diff(np.sign(run["x"])) != 0).sum() >= 3
    assert np.abs(energy - energy[0]).max() < 1e-6


def test_friction_by_sign_is_named_with_its_remedy(exported) -> None:
    x = coordinate("x", velocity=1.0)
    mechanism = Mechanism("rubbed", coordinates=[x], energy=Energy(kinetic=x.dot**2 / 2), forces={x: -sign(x.dot)})
    with pytest.raises(SimulationError, match=r"at time 1.* x_dot is 0 from both sides.*\[frictions\]"):
        simulate(exported(mechanism).path, step=0.1)


def test_event_mode_turns_switches(exported) -> None:
    """Relations are frozen in continuous-time mode; no indicator is 0 after an event; times of events are told."""
    with Stepping(exported(COURSE).path, "ModelExchange") as fmu:
        count = fmu.description.numberOfEventIndicators
        assert count == 2 * len(PULSES) + 4
        fmu.start(stop_time=10.0)
        assert _event(fmu) == (True, PULSES[0][0])
        fmu.unit.setTime(5.05)
        assert fmu.get(["x_ddot"]) == [0.0]
        defined, following = _event(fmu)
        assert fmu.get(["x_ddot"]) == [1.0]
        assert (defined, following) == (True, pytest.approx(PULSES[0][1], abs=1e-15))


def _event(fmu: Stepping) -> tuple[bool, float]:
    """Go through event mode; whether there is a next event, and when."""
    fmu.unit.enterEventMode()
    _, _, _, _, defined, following = fmu.unit.newDiscreteStates()
    fmu.unit.enterContinuousTimeMode()
    return bool(defined), following


def test_what_is_smooth_or_moves_nothing_is_no_switch() -> None:
    x, p = coordinate("x", start=1.0), parameter("p", 1.0)
    energy = Energy(kinetic=x.dot**2 / 2, potential=Smooth(Abs(x)) * Abs(p) + Max(0, p) * x)
    program = lower(derive(Mechanism("plain", coordinates=[x], parameters=[p], energy=energy)))
    assert not program.hybrid
    assert all(f.name != "mechanism_switches" for f in program.functions)


def test_opposite_margins_share_a_switch() -> None:
    x = coordinate("x", start=1.0)
    potential = Abs(x - 1) + Max(0, 1 - x) ** 3 + Heaviside(1 - x) * (x - 1) ** 4
    program = lower(derive(Mechanism("shared", coordinates=[x], energy=Energy(x.dot**2 / 2, potential))))
    assert [event.name for event in program.event_functions] in (["x - 1"], ["1 - x"])


def test_the_python_backend_refuses(tmp_path) -> None:
    with pytest.raises(ExportError, match=r"does not locate events.* signs of x; use --backend c"):
        export(VEE, tmp_path / "vee.fmu", backend="python")
