"""What is run and compared for each problem of `benchmarks.published`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks import closed_forms
from benchmarks.published_values import ANDREWS, BICYCLE, GONZALEZ, LINKAGE_ANGLE, MANOEUVRES, MASARATI
from benchmarks.stranger import DEFAULT, Asked, Run, linearized, model_of, poles, run
from lag2fmu.formats.loading import load
from lag2fmu.reference import integrate
from lag2fmu.reference.trajectory import Trajectory

G = 9.81
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Number:
    """One result: what it is, what lag2fmu says and what was published, as text; the error and its bar, in SI or 1."""

    what: str
    ours: str
    published: str
    error: float
    bar: float | None = None
    remark: str = ""

    @property
    def met(self) -> bool:
        """Whether the error is below the bar; a number without a bar is met."""
        return self.bar is None or self.error <= self.bar


@dataclass(frozen=True)
class Result:
    """The numbers of a problem, and the CPU time (s) of its run; ``trajectory``: what results.txt is written of."""

    numbers: list[Number]
    seconds: float | None = None
    trajectory: Trajectory | None = None


def drift(ran: Run) -> float:
    """The greatest change of the mechanical energy, in J."""
    energy = ran.trajectory["total_energy"]
    return float(np.abs(energy - energy[0]).max())


def farthest(ours: Floats, exact: Floats) -> float:
    """The greatest difference."""
    return float(np.abs(ours - exact).max())


def independent(name: str, ran: Run, *columns: str, count: int = 11) -> Number:
    """The difference from the independent path over ``count`` times of the run."""
    every = (len(ran.trajectory) - 1) // (count - 1)
    times = ran.trajectory.time[::every]
    exact = integrate(load(model_of(name)), times).trajectory
    error = max(farthest(ran.trajectory[column][::every], exact[column]) for column in columns)
    last = columns[-1]
    at = f"{last}({times[-1]:g} s) = "
    return Number(
        f"{', '.join(columns)}, by the independent path",
        f"{at}{ran.trajectory[last][-1]:.9g}",
        f"{exact[last][-1]:.9g}",
        error,
    )


def planar_simple_pendulum(asked: Asked = DEFAULT) -> Result:
    """From the level, 10 s; the library wants 5e-5 J."""
    ran = run("planar_simple_pendulum", 10.0, 0.01, outputs=("total_energy",), asked=asked)
    phi = closed_forms.pendulum(ran.trajectory.time, -np.pi / 2, 0.0, np.sqrt(G)) - np.pi / 2
    x, y = np.cos(phi), np.sin(phi)
    error = max(farthest(ran.trajectory["x"], x), farthest(ran.trajectory["y"], y))
    return Result(
        [
            Number("energy, greatest change (J)", f"{drift(ran):.1e}", "0", drift(ran), 5e-5),
            Number("x(10 s) by elliptic functions (m)", f"{ran.trajectory['x'][-1]:.9f}", f"{x[-1]:.9f}", error),
        ],
        ran.seconds,
        ran.trajectory,
    )


def windows(n: int, stop: float, asked: Asked) -> Result:
    """A row of n windows, which moves as a pendulum; the error of B0, and the energy."""
    ran = run("n_four_bar", stop, 0.01, structure={"n": n}, outputs=("total_energy",), asked=asked)
    inertia, moment = (n + 1) / 3 + n, ((n + 1) / 2 + n) * G
    phi = closed_forms.pendulum(ran.trajectory.time, np.pi, -1.0, np.sqrt(moment / inertia)) - np.pi / 2
    x, y = np.cos(phi), np.sin(phi)
    error = max(farthest(ran.trajectory["x_B0"], x), farthest(ran.trajectory["y_B0"], y))
    what = f"x of B0 at {stop:g} s by elliptic functions (m)"
    return Result(
        [
            Number(what, f"{ran.trajectory['x_B0'][-1]:.6f}", f"{x[-1]:.6f}", error, 1e-3 if n > 2 else None),
            Number("energy, greatest change (J)", f"{drift(ran):.1e}", "0", drift(ran), 0.1 if n == 2 else None),
        ],
        ran.seconds,
        ran.trajectory,
    )


def double_four_bar(asked: Asked = DEFAULT) -> Result:
    """Two windows, 10 s; the library wants 0.1 J."""
    return windows(2, 10.0, asked)


def n_four_bar(asked: Asked = DEFAULT) -> Result:
    """40 windows, 20 s; the library wants 1e-3 m."""
    return windows(40, 20.0, asked)


def andrews_squeezer(asked: Asked = DEFAULT) -> Result:
    """0.03 s as in the Test Set, 0.05 s as in the library."""
    short = run("andrews_squeezer", 0.03, 0.0003, asked=asked)
    errors = {n: abs(short.trajectory[n][-1] / value - 1) for n, value in ANDREWS.items()}
    worst = max(errors, key=lambda n: errors[n])
    digits = Number(
        f"14 angles and velocities at 0.03 s, the worst: {worst}",
        f"{short.trajectory[worst][-1]:.10g}",
        f"{ANDREWS[worst]:.10g}",
        errors[worst],
        remark="relative",
    )
    ran = run("andrews_squeezer", 0.05, 0.0005, outputs=("total_energy",), asked=asked)
    gained = ran.trajectory["total_energy"] - 0.033 * ran.trajectory["beta"]
    change = farthest(gained, gained[0])
    return Result(
        [digits, Number("energy less the motor's work (J)", f"{change:.1e}", "0", change)], ran.seconds, ran.trajectory
    )


def bricard(asked: Asked = DEFAULT) -> Result:
    """10 s; the library wants 1e-3 J."""
    ran = run("bricard", 10.0, 0.01, outputs=("total_energy",), asked=asked)
    return Result(
        [
            Number("energy, greatest change (J)", f"{drift(ran):.1e}", "0", drift(ran), 1e-3),
            independent("bricard", ran, "P3_y", "P3_z", "P3_x"),
        ],
        ran.seconds,
        ran.trajectory,
    )


def flyball_governor(asked: Asked = DEFAULT) -> Result:
    """10 s; couplers that are springs of 8e5 N/m with dampers of 4e4 N.s/m."""
    ran = run("flyball_governor", 10.0, 0.01, asked=asked)
    return Result([independent("flyball_governor", ran, "phi", "a", "s")], ran.seconds, ran.trajectory)


def uncontrolled_bicycle(asked: Asked = DEFAULT) -> Result:
    """Three manoeuvres of 20 s, of which the library wants an energy within 1e-3 %; eigenvalues of four speeds."""
    numbers, seconds = [], None
    for label, speed, roll in MANOEUVRES:
        values = {"theta_R_dot": -speed / 0.3, "phi_dot": roll}
        ran = run("whipple_bicycle", 20.0, 0.01, values=values, outputs=("total_energy",), asked=asked)
        share = 100 * drift(ran) / ran.trajectory["total_energy"][0]
        what = f"{label}: {speed:g} m/s, {roll:g} rad/s of roll: change of energy (%)"
        numbers.append(Number(what, f"{share:.1e}", "0", share, 1e-3))
        seconds = ran.seconds if label == "M2" else seconds
    for speed, published in BICYCLE:
        found = poles("whipple_bicycle", values={"theta_R_dot": -speed / 0.3, "phi_dot": 0.0})
        errors = [float(np.abs(found - value).min()) for value in published]
        worst = published[int(np.argmax(errors))]
        ours = found[int(np.abs(found - worst).argmin())]
        numbers.append(
            Number(f"eigenvalues at {speed:g} m/s, the worst (1/s)", shown(ours), shown(worst), max(errors), 1e-10)
        )
    return Result(numbers, seconds)


def shown(value: complex) -> str:
    """A complex number with the digits of the source; the imaginary part where there is one."""
    return f"{value.real:.14f}" + (f"{value.imag:+.14f}i" if abs(value.imag) > 1e-12 else "")


def spatial_slider_crank(asked: Asked = DEFAULT) -> Result:
    """5 s; the submitted solutions differ from each other."""
    ran = run("spatial_slider_crank", 5.0, 0.01, outputs=("total_energy",), asked=asked)
    numbers = [independent("spatial_slider_crank", ran, "theta", "s")]
    for who, values in (("Gonzalez", GONZALEZ), ("Masarati", MASARATI)):
        at = {t: float(ran.trajectory["s"][round(100 * t)]) for t in values}
        error = max(abs(at[t] - value) for t, value in values.items())
        last = max(values)
        numbers.append(Number(f"slider of {who} at {last:g} s (m)", f"{at[last]:.9f}", f"{values[last]:.9f}", error))
    numbers.append(Number("energy, greatest change (J)", f"{drift(ran):.1e}", "0", drift(ran)))
    return Result(numbers, ran.seconds, ran.trajectory)


def four_bar_with_spring(_: Asked = DEFAULT) -> Result:
    """The equilibrium, and the eigenvalues there."""
    small = linearized("four_bar_with_spring", at="equilibrium")
    phi = float(np.array(small["state_values"])[0])
    found = np.linalg.eigvals(np.array(small["A"]))
    exact = closed_forms.four_bar_poles(phi)
    error = max(float(np.abs(found - value).min()) for value in exact)
    left = f"the published angle leaves {abs(closed_forms.four_bar_slope(LINKAGE_ANGLE)):.1e} N.m, ours "
    left += f"{abs(closed_forms.four_bar_slope(phi)):.0e}"
    return Result(
        [
            Number(
                "angle of the equilibrium (rad)",
                f"{phi:.12f}",
                f"{LINKAGE_ANGLE:.11f}",
                abs(phi - LINKAGE_ANGLE),
                5e-11,
                left,
            ),
            Number("eigenvalues by the energy of one angle (1/s)", shown(found[0]), shown(exact[0]), error, 1e-11),
        ]
    )


def light_cart_pole(asked: Asked = DEFAULT) -> Result:
    """10 s; the proposal wants an error of 1e-6. At the first passage, 1 us long, the pole turns with 4429 rad/s."""
    ran = run("light_cart_pole", 10.0, 0.01, outputs=("total_energy",), asked=asked)
    x, theta = closed_forms.light_cart_pole(ran.trajectory.time)
    error = float(np.sqrt(((ran.trajectory["x"] - x) ** 2 + (ran.trajectory["theta"] - theta) ** 2).mean()))
    passage = closed_forms.quarter_of_light_cart_pole()
    fine = run("light_cart_pole", passage, passage / 10, asked=Asked(asked.solver, 1e-12))
    peak, exact = abs(float(fine.trajectory["theta_dot"][-1])), float(np.sqrt(2 * G * (1 + 1e-6) / 1e-6))
    return Result(
        [
            Number("error e of x and theta by quadrature", f"{error:.1e}", "0", error, 1e-6),
            Number(
                "angular velocity at the first passage (rad/s)",
                f"{peak:.1f}",
                f"{exact:.1f}",
                abs(peak / exact - 1),
                1e-6,
                "relative; tolerance 1e-12",
            ),
        ],
        ran.seconds,
        ran.trajectory,
    )


PROBLEMS: dict[str, tuple[str, Callable[..., Result]]] = {
    "planar_simple_pendulum": ("Planar simple pendulum", planar_simple_pendulum),
    "double_four_bar": ("Double four-bar mechanism", double_four_bar),
    "n_four_bar": ("N-four-bar mechanism, N = 40", n_four_bar),
    "andrews_squeezer": ("Andrews' squeezing mechanism", andrews_squeezer),
    "bricard": ("Bricard's mechanism", bricard),
    "flyball_governor": ("Stiff flyball governor", flyball_governor),
    "uncontrolled_bicycle": ("Uncontrolled bicycle", uncontrolled_bicycle),
    "spatial_slider_crank": ("Spatial slider-crank", spatial_slider_crank),
    "four_bar_with_spring": ("Four-bar linkage with a diagonal spring", four_bar_with_spring),
    "light_cart_pole": ("Cart-pole with a light cart", light_cart_pole),
}
"""Name -> title, and what runs it."""
