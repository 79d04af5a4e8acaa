"""Published numbers of the Whipple bicycle with the parameters of models/whipple_bicycle."""

EIGENVALUES: list[tuple[float, list[complex]]] = [
    (0.0, [-5.53094371765393, -3.13164324790656, 3.13164324790656, 5.53094371765393]),
    (4.0, [-12.15861426576447, -1.42944427361326, 0.41325331521125 - 3.07910818603206j]),
    (5.0, [-14.07838969279822, -0.77534188219585 - 4.46486771378823j, -0.32286642900409]),
    (10.0, [-24.62459635017404, -3.72016840437287 - 10.90681139476287j, 0.16105338653172]),
]
"""Speed (m/s) -> eigenvalues (1/s) of the upright ride, one of each conjugate pair: Table 2 of J. P. Meijaard,
J. M. Papadopoulos, A. Ruina, A. L. Schwab, Proc. R. Soc. A 463, 2007."""
