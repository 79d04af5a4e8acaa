"""Published numbers of the problems of `benchmarks.published`, and what others took: facts, each with its source."""

from __future__ import annotations

ANDREWS = {
    "beta": 15.81077119629904,
    "Theta": -15.75637105984298,
    "gamma": 0.04082224013073101,
    "Phi": -0.5347301163226948,
    "delta": 0.5244099658805304,
    "Omega": 0.5347301163226948,
    "epsilon": 1.048080741042263,
    "beta_dot": 1139.920302151208,
    "Theta_dot": -1424.379294994111,
    "gamma_dot": 11.03291221937134,
    "Phi_dot": 19.29337464421385,
    "delta_dot": 0.5735699284790808,
    "Omega_dot": -19.29337464421385,
    "epsilon_dot": 0.3231791658026955,
}
"""rad and rad/s at 0.03 s: Test Set for Initial Value Problem Solvers, Andrews' squeezing mechanism (PSIDE, 1e-14)."""

BICYCLE: list[tuple[float, list[complex]]] = [
    (0.0, [-5.53094371765393, -3.13164324790656, 3.13164324790656, 5.53094371765393]),
    (4.0, [-12.15861426576447, -1.42944427361326, 0.41325331521125 - 3.07910818603206j]),
    (5.0, [-14.07838969279822, -0.77534188219585 - 4.46486771378823j, -0.32286642900409]),
    (10.0, [-24.62459635017404, -3.72016840437287 - 10.90681139476287j, 0.16105338653172]),
]
"""m/s -> 1/s, one of each conjugate pair: J. P. Meijaard and others, Proc. R. Soc. A 463, 2007, table 2."""

MANOEUVRES = [("M1", 4.0, 0.05), ("M2", 4.6, 0.5), ("M3", 8.0, 0.05)]
"""Name, speed (m/s) and rate of roll (rad/s) at the start: IFToMM's library, Uncontrolled bicycle."""

GONZALEZ = {0.1: 0.226785384, 0.2: 0.263034975, 0.5: 0.184952803, 1.0: 0.211754668, 2.0: 0.289063554, 5.0: 0.240761815}
"""s -> m, the slider in the solution that F. Gonzalez submitted; 9 digits are given."""

MASARATI = {0.1: 0.2267867, 0.2: 0.2630368, 0.5: 0.1849586, 1.0: 0.2124956}
"""s -> m, the slider in the solution that P. Masarati submitted (MBDyn); 7 digits are given."""

LINKAGE_ANGLE = 2.23433101898
"""rad, the equilibrium of the four-bar linkage, 12 digits: B. Minaker, EoM, input_ex_four_bar."""

ENTRIES = {
    "planar_simple_pendulum": "0.037 s (Exudyn), 0.637 s (OpenSim)",
    "double_four_bar": "0.455 s (OpenSim)",
    "andrews_squeezer": "0.384 s (OpenSim)",
    "bricard": "0.258 s (OpenSim)",
    "flyball_governor": "0.233 s (OpenSim)",
    "uncontrolled_bicycle": "0.596 s at 9.2e-4 %, 5.59 s at 6.4e-6 % (Exudyn, M2)",
    "four_bar_with_spring": "7.5 (EoM, no unit given)",
    "light_cart_pole": "0.265 s at 9.1e-12 (DOP853 of SciPy, closed form of the equations)",
}
"""What the authors of submitted solutions say of CPU time on their machines: OpenSim: L. Tagliapietra and others, MBS
benchmarks in OpenSim, i5-4570; Exudyn: J. Gerstmayr, examples of Exudyn, i7 and i9-7940X; EoM: B. Minaker, i7-2600;
DOP853: N. Parsons, light-cartpole-benchmark, Core Ultra 7."""
