"""Explicit Runge-Kutta methods as Butcher tableaus: coefficients that can check themselves.

A method is one entry of TABLEAUS. Tests check each of them: its orders are derived from the coefficients by the
conditions of rooted trees, which takes 16 ms, a fiftieth of a small export.
"""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

from lag2fmu.solvers.order_conditions import dense_order_of, order_of, stability_interval

Row = tuple[Fraction, ...]


class Tableau(NamedTuple):
    """An explicit method of s ``stages``: ``a`` (s, s) strictly lower triangular, ``b`` (s,), ``c`` = row sums of a.

    - ``embedded`` (s,), ``embedded_order``: weights and order of the method for the error estimate; None for a fixed
      step.
    - ``second`` (s,), ``second_order``: weights of a second, lower estimate. The error is then
      E^2 / sqrt(E^2 + (E_second / 10)^2), where E and E_second are the differences from both methods.
    - ``extra`` (e, s + e): the rows of the further stages of dense output.
    - ``dense`` (r, s + e): continues Hermite's cubic to ``dense_order``, see ``dense_order_of``; 0 without dense
      output.
    - ``safety``: the next step, as a part of the step that would just meet the tolerance.
    - ``solver``: the name on the command line; ``source``: the publication of the coefficients.
    """

    solver: str
    title: str
    source: str
    order: int
    a: tuple[Row, ...]
    b: Row
    embedded: Row | None = None
    embedded_order: int = 0
    second: Row | None = None
    second_order: int = 0
    extra: tuple[Row, ...] = ()
    dense: tuple[Row, ...] = ()
    dense_order: int = 0
    safety: float = 0.9
    family: str = "runge_kutta"
    generated_files: tuple[str, ...] = ("tableau.c",)
    implicit: bool = False
    variational: bool = False

    def check(self) -> None:
        """Raise ValueError unless the coefficients have the shape and the orders that are claimed."""
        if any(entry for i, row in enumerate(self.all_rows) for entry in row[i:]):
            raise ValueError(f"tableau '{self.solver}': a is not strictly lower triangular")
        self._check("b", self.order, order_of(self.a, self.b, self.order + 1))
        if self.embedded is not None:
            self._check("embedded", self.embedded_order, order_of(self.a, self.embedded, self.embedded_order + 1))
        if self.second is not None:
            self._check("second", self.second_order, order_of(self.a, self.second, self.second_order + 1))
        if self.dense and not self.first_same_as_last:
            raise ValueError(f"tableau '{self.solver}': dense output needs a last stage at the end of the step")
        if self.dense:
            derived = dense_order_of(self.all_rows, self.b, self.dense, self.dense_order + 1)
            self._check("dense", self.dense_order, derived)

    def _check(self, label: str, claimed: int, derived: int) -> None:
        if derived != claimed:
            raise ValueError(f"tableau '{self.solver}': {label} has order {derived}, not {claimed}")

    @property
    def dense_rows(self) -> int:
        """The terms of dense output beyond Hermite's cubic."""
        return len(self.dense)

    @property
    def stages(self) -> int:
        """The number of stages."""
        return len(self.b)

    @property
    def all_stages(self) -> int:
        """The number of stages, including those of dense output."""
        return len(self.all_rows)

    @property
    def all_rows(self) -> tuple[Row, ...]:
        """The rows of ``a``, then the rows of the further stages of dense output: (s + e, s + e)."""
        padding = (Fraction(0),) * len(self.extra)
        return tuple(row + padding for row in self.a) + self.extra

    @property
    def c(self) -> Row:
        """The abscissae, (s,)."""
        return self.all_c[: self.stages]

    @property
    def all_c(self) -> Row:
        """The abscissae of all rows, (s + e,)."""
        return tuple(sum(row, Fraction(0)) for row in self.all_rows)

    @property
    def error_weights(self) -> Row | None:
        """b - embedded, (s,), the weights of the error estimate; None for a fixed step."""
        return _difference(self.b, self.embedded)

    @property
    def second_weights(self) -> Row | None:
        """b - second, (s,); None if there is no second estimate."""
        return _difference(self.b, self.second)

    @property
    def error_order(self) -> int:
        """The error estimate of a step of length h is proportional to h to this power plus one."""
        return self.embedded_order if self.second is None else 2 * self.embedded_order - self.second_order

    @property
    def first_same_as_last(self) -> bool:
        """Whether the last stage is the first stage of the next step."""
        return self.a[-1] == self.b and float(self.c[-1]) == 1.0

    @property
    def twin(self) -> int:
        """The index of the last stage that is at the same time as the stage before it, 0 if there is none."""
        times = [float(c) for c in self.c]
        return max((i for i in range(1, self.stages) if times[i] == times[i - 1]), default=0)

    @property
    def twin_weights(self) -> Row:
        """The row of ``a`` of the stage ``twin`` minus the row of the stage before it, (s,)."""
        return tuple(x - y for x, y in zip(self.a[self.twin], self.a[self.twin - 1], strict=True))

    @property
    def stability(self) -> float:
        """The largest h for which steps for dx/dt = -x do not grow.

        Source: Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd edition, section IV.2.
        """
        return stability_interval(self.a, self.b)


def _difference(b: Row, other: Row | None) -> Row | None:
    return None if other is None else tuple(x - y for x, y in zip(b, other, strict=True))


# ----------------------------------------------------------------------------------------------------------- the data


def _row(text: str) -> Row:
    return tuple(Fraction(entry) for entry in text.split())


def _rows(stages: int, text: str) -> tuple[Row, ...]:
    """Rows of fractions with semicolons between them, padded with zeros to ``stages``."""
    return tuple(row + (Fraction(0),) * (stages - len(row)) for row in map(_row, text.split(";")))


TABLEAUS: dict[str, Tableau] = {
    tableau.solver: tableau
    for tableau in (
        Tableau(
            solver="dopri5",
            title="Dormand-Prince 5(4), adaptive",
            source="J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19-26, table 2; dense output: "
            "E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition, section II.6",
            order=5,
            embedded_order=4,
            dense_order=4,
            a=_rows(
                7,
                """;
                1/5;
                3/40        9/40;
                44/45      -56/15       32/9;
                19372/6561 -25360/2187  64448/6561 -212/729;
                9017/3168  -355/33      46732/5247  49/176  -5103/18656;
                35/384      0           500/1113    125/192 -2187/6784   11/84
            """,
            ),
            b=_row("35/384 0 500/1113 125/192 -2187/6784 11/84 0"),
            embedded=_row("5179/57600 0 7571/16695 393/640 -92097/339200 187/2100 1/40"),
            dense=_rows(
                7,
                """
                -12715105075/11282082432 0 87487479700/32700410799 -10690763975/1880347072 701980252875/199316789632
                -1453857185/822651844 69997945/29380423
            """,
            ),
        ),
        Tableau(
            solver="dop853",
            title="Dormand-Prince 8(5,3), adaptive",
            source="E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition, "
            "sections II.5 (table 5.4) and II.6; digits of the authors' code dop853.f",
            order=8,
            embedded_order=5,
            second_order=3,
            dense_order=7,
            safety=0.8,  # with 0.9 so many steps are rejected that the same accuracy takes 5 to 15 % more
            a=_rows(
                13,
                """;
                0.0526001519587677318785587544488;
                0.0197250569845378994544595329183 0.0591751709536136983633785987549;
                0.0295875854768068491816892993775 0 0.0887627564304205475450678981324;
                0.241365134159266685502369798665 0 -0.884549479328286085344864962717 0.924834003261792003115737966543;
                0.037037037037037037037037037037 0 0 0.170828608729473871279604482173 0.125467687566822425016691814123;
                0.037109375 0 0 0.170252211019544039314978060272 0.0602165389804559606850219397283 -0.017578125;
                0.0370920001185047927108779319836 0 0 0.170383925712239993810214054705
                0.107262030446373284651809199168 -0.0153194377486244017527936158236 0.00827378916381402288758473766002;
                0.624110958716075717114429577812 0 0 -3.36089262944694129406857109825
                -0.868219346841726006818189891453 27.5920996994467083049415600797 20.1540675504778934086186788979
                -43.4898841810699588477366255144;
                0.477662536438264365890433908527 0 0 -2.48811461997166764192642586468
                -0.590290826836842996371446475743 21.2300514481811942347288949897 15.2792336328824235832596922938
                -33.2882109689848629194453265587 -0.0203312017085086261358222928593;
                -0.93714243008598732571704021658 0 0 5.18637242884406370830023853209 1.09143734899672957818500254654
                -8.14978701074692612513997267357 -18.5200656599969598641566180701 22.7394870993505042818970056734
                2.49360555267965238987089396762 -3.0467644718982195003823669022;
                2.27331014751653820792359768449 0 0 -10.5344954667372501984066689879 -2.00087205822486249909675718444
                -17.9589318631187989172765950534 27.9488845294199600508499808837 -2.85899827713502369474065508674
                -8.87285693353062954433549289258 12.3605671757943030647266201528 0.643392746015763530355970484046;
                0.0542937341165687622380535766363 0 0 0 0 4.45031289275240888144113950566
                1.89151789931450038304281599044 -5.8012039600105847814672114227 0.31116436695781989440891606237
                -0.152160949662516078556178806805 0.201365400804030348374776537501 0.0447106157277725905176885569043
            """,
            ),
            b=_row("""
                0.0542937341165687622380535766363 0 0 0 0 4.45031289275240888144113950566
                1.89151789931450038304281599044 -5.8012039600105847814672114227 0.31116436695781989440891606237
                -0.152160949662516078556178806805 0.201365400804030348374776537501 0.0447106157277725905176885569043 0
            """),
            embedded=_row("""
                0.0411736891223738815055525466763 0 0 0 0 5.67546933912861332216170925866
                2.38727684897175057456422398564 -7.4655811424655713184287418377 0.66149321570779357609756479137
                -0.486340068375533557585910690905 0.119442194318914635909069111371 0.0670659235916588857765328353543 0
            """),
            second=_row("""
                0.244094488188976377952755905512 0 0 0 0 0 0 0 0.733846688281611857341361741547 0 0
                0.0220588235294117647058823529412 0
            """),
            extra=_rows(
                16,
                """
                0.0561675022830479523392909219681 0 0 0 0 0 0.253500210216624811088794765333
                -0.246239037470802489917441475441 -0.124191423263816360469010140626 0.15329179827876569731206322685
                0.00820105229563468988491666602057 0.00756789766054569976138603589584 -0.008298;
                0.0318346481635021405060768473261 0 0 0 0 0.0283009096723667755288322961402
                0.0535419883074385676223797384372 -0.0549237485713909884646569340306 0 0
                -0.000108347328697249322858509316994 0.000382571090835658412954920192323
                -0.000340465008687404560802977114492 0.141312443674632500278074618366;
                -0.428896301583791923408573538692 0 0 0 0 -4.69762141536116384314449447206
                7.68342119606259904184240953878 4.06898981839711007970213554331 0.356727187455281109270669543021 0 0 0
                -0.00139902416515901462129418009734 2.9475147891527723389556272149 -9.15095847217987001081870187138
            """,
            ),
            dense=_rows(
                16,
                """
                -8.4289382761090128651353491142 0 0 0 0 0.5667149535193777696253178359 -3.0689499459498916912797304727
                2.384667656512069828772814968 2.1170345824450282767155149946 -0.8713915837779729920678990749
                2.240437430260788275854177165 0.6315787787694688181557024929 -0.0889903364513333108206981174
                18.148505520854727256656404962 -9.1946323924783554000451984436 -4.4360363875948939664310572;
                10.427508642579134603413151009 0 0 0 0 242.28349177525818288430175319 165.20045171727028198505394887
                -374.54675472269020279518312152 -22.113666853125306036270938578 7.7334326684722638389603898808
                -30.674084731089398182061213626 -9.3321305264302278729567221706 15.697238121770843886131091075
                -31.139403219565177677282850411 -9.3529243588444783865713862664 35.81684148639408375246589854;
                19.985053242002433820987653617 0 0 0 0 -387.03730874935176555105901742 -189.17813819516756882830838328
                527.80815920542364900561016686 -11.573902539959630126141871134 6.8812326946963000169666922661
                -1.000605096691083840318386098 0.7777137798053443209286926574 -2.7782057523535084065932004339
                -60.196695231264120758267380846 84.320405506677161018159903784 11.99229113618278932803513003;
                -25.693933462703749003312586129 0 0 0 0 -154.18974869023643374053993627
                -231.52937917604549567536039109 357.6391179106141237828534991 93.405324183624310003907691704
                -37.458323136451633156875139351 104.09964950896230045147246184 29.840293426660503123344363579
                -43.533456590011143754432175058 96.3245539591882829483949506 -39.177261675615439165231486172
                -149.72683625798562581422125276
            """,
            ),
        ),
        Tableau(
            solver="rk4",
            title="classical Runge-Kutta method, fixed step",
            source="W. Kutta, Z. Math. Phys. 46 (1901) 435-453",
            order=4,
            a=_rows(4, "; 1/2; 0 1/2; 0 0 1"),
            b=_row("1/6 1/3 1/3 1/6"),
        ),
    )
}
"""The explicit solvers of co-simulation, by name."""
