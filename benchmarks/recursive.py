"""The equations of the cases written by hand, for scalars of any kind: what the derivation has to find by itself.

``energies`` T and V by recursion; ``inverse_and_mass``: composite rigid bodies and recursive Newton-Euler, M and the
bias h; ``articulated``: the articulated-body algorithm, qdd. Rods are treated in world axes, arms in link axes.
Source: R. Featherstone, Rigid Body Dynamics Algorithms, chapters 5 to 7.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from benchmarks.cases import Case, Scalar, Segment

Function = Callable[[Scalar], Scalar]
Vector = Sequence[Scalar]
Matrix = Sequence[Vector]
_XYZ = range(3)


@dataclass(frozen=True)
class Given:
    """The knowns of a case: q, qd and Q, (n,) each, the parameters by name, and the functions sin and cos."""

    q: Vector
    qd: Vector
    Q: Vector
    p: Mapping[str, Scalar]
    sin: Function
    cos: Function


def energies(case: Case, k: Given) -> tuple[Scalar, Scalar]:
    """T and V"""
    return _planar_energies(case, k) if case.planar else _spatial_energies(case, k)


def inverse_and_mass(case: Case, k: Given) -> tuple[list[list[Scalar]], list[Scalar]]:
    """M (n, n), symmetric, and h (n,) of M qdd + h = Q"""
    return _planar_mass(case, k) if case.planar else _spatial_mass(case, k)


def articulated(case: Case, k: Given) -> list[Scalar]:
    """qdd, (n,)"""
    return _planar_articulated(case, k) if case.planar else _spatial_articulated(case, k)


# ------------------------------------------------------------------------------------------------------------- rods


@dataclass(frozen=True)
class _Turned:
    """A rod at its angle: rate omega, vector (rx, ry) from start to end, and (hx, hy) to the mass centre."""

    omega: Scalar
    r: tuple[Scalar, Scalar]
    h: tuple[Scalar, Scalar]


def _turned(case: Case, k: Given) -> list[_Turned]:
    phi, omega, turned = [], [], []
    for i, rod in enumerate(case.rods(k.p)):
        angle, rate = k.q[case.offset + i], k.qd[case.offset + i]
        if rod.parent >= 0 and not case.absolute:
            angle, rate = phi[rod.parent] + angle, omega[rod.parent] + rate
        phi.append(angle)
        omega.append(rate)
        r = (rod.length * k.sin(angle), -(rod.length * k.cos(angle)))
        turned.append(_Turned(rate, r, (rod.center * r[0], rod.center * r[1])))
    return turned


def _planar_energies(case: Case, k: Given) -> tuple[Scalar, Scalar]:
    rods, turned = case.rods(k.p), _turned(case, k)
    base = {"fixed": (0, 0), "cart": (k.qd[0], 0), "free": tuple(k.qd[:2])}[case.base]
    height = k.q[1] if case.base == "free" else 0
    twice_T = k.p["mc"] * k.qd[0] * k.qd[0] if case.base == "cart" else 0
    V: Scalar = 0
    start, end = [], []
    for rod, t in zip(rods, turned, strict=True):
        vx, vy, y = (*base, height) if rod.parent < 0 else (end if rod.at_end else start)[rod.parent]
        start.append((vx, vy, y))
        end.append((vx - t.omega * t.r[1], vy + t.omega * t.r[0], y + t.r[1]))
        cx, cy = vx - t.omega * t.h[1], vy + t.omega * t.h[0]
        twice_T = twice_T + rod.mass * (cx * cx + cy * cy) + rod.inertia * t.omega * t.omega
        V = V + rod.mass * k.p["g"] * (y + t.h[1])
    bent = [b - a for a, b in zip([0, *k.q], k.q, strict=False)] if "k" in k.p else []
    return twice_T / 2, V + sum(k.p["k"] * angle * angle / 2 for angle in bent)


def _planar_mass(case: Case, k: Given) -> tuple[list[list[Scalar]], list[Scalar]]:
    """Composite mass, first moment s and moment of inertia J about each joint, in world axes."""
    rods, turned, o, n = case.rods(k.p), _turned(case, k), case.offset, case.n
    zero: Scalar = 0
    count = len(rods)
    M: list[list[Scalar]] = [[zero] * n for _ in range(n)]
    h: list[Scalar] = [zero] * n
    start, end = [], []  # accelerations of the ends for qdd = 0, gravity as an upward acceleration of the base
    for rod, t in zip(rods, turned, strict=True):
        ax, ay = (zero, k.p["g"]) if rod.parent < 0 else (end if rod.at_end else start)[rod.parent]
        square = t.omega * t.omega
        start.append((ax, ay))
        end.append((ax - square * t.r[0], ay - square * t.r[1]))
    force = [(zero, zero)] * count
    torque, mass, moment, J = [zero] * count, [zero] * count, [(zero, zero)] * count, [zero] * count
    carried = _carried(case)
    for i in reversed(range(count)):
        rod, t = rods[i], turned[i]
        (rx, ry), (hx, hy) = t.r, t.h
        square = t.omega * t.omega
        fx, fy = rod.mass * (start[i][0] - square * hx), rod.mass * (start[i][1] - square * hy)
        mx, my = rod.mass * hx, rod.mass * hy
        couple, total = hx * fy - hy * fx, rod.mass
        inertia = rod.inertia + rod.mass * (hx * hx + hy * hy)
        for c in carried[i]:
            (gx, gy), m, (sx, sy), at_end = force[c], mass[c], moment[c], rods[c].at_end
            fx, fy, total = fx + gx, fy + gy, total + m
            if case.absolute:
                couple = couple + (rx * gy - ry * gx)
                inertia, mx, my = inertia + m * (rx * rx + ry * ry), mx + m * rx, my + m * ry
                continue
            couple, inertia = couple + torque[c], inertia + J[c]
            mx, my = mx + sx, my + sy
            if at_end:
                couple = couple + (rx * gy - ry * gx)
                inertia = inertia + (2 * (rx * sx + ry * sy) + m * (rx * rx + ry * ry))
                mx, my = mx + m * rx, my + m * ry
        force[i], torque[i], mass[i], moment[i], J[i] = (fx, fy), couple, total, (mx, my), inertia
        h[o + i], M[o + i][o + i] = couple, inertia
        _planar_column(case, M, i, turned, moment[i], inertia)
    if case.base != "fixed":
        _planar_base(case, k, M, h, [i for i in range(count) if rods[i].parent < 0], force, mass)
    return M, h


def _carried(case: Case) -> list[list[int]]:
    """The rods on each rod."""
    return [[c for c, row in enumerate(case.tree) if row[0] == i] for i in range(len(case.tree))]


def _planar_column(
    case: Case, M: list[list[Scalar]], i: int, turned: Sequence[_Turned], s: tuple[Scalar, Scalar], J: Scalar
) -> None:
    """The entries of M that couple rod i with those below it and with the base."""
    o, entry, j = case.offset, J, i
    while case.tree[j][0] >= 0:
        at_end, j = case.tree[j][1], case.tree[j][0]
        dot = turned[j].r[0] * s[0] + turned[j].r[1] * s[1] if at_end else 0
        entry = dot if case.absolute else entry + dot
        M[o + i][o + j] = M[o + j][o + i] = entry
    for axis, value in zip(range(o), (-s[1], s[0]), strict=False):
        M[axis][o + i] = M[o + i][axis] = value


def _planar_base(
    case: Case,
    k: Given,
    M: list[list[Scalar]],
    h: list[Scalar],
    roots: Sequence[int],
    force: Sequence[tuple[Scalar, Scalar]],
    mass: Sequence[Scalar],
) -> None:
    (root,) = roots
    own = k.p["mc"] if case.base == "cart" else 0
    for axis in range(case.offset):
        h[axis], M[axis][axis] = force[root][axis], own + mass[root]


def _planar_articulated(case: Case, k: Given) -> list[Scalar]:
    """Each subtree answers its joint's acceleration a with a force A a + f: a joint passes on no unknown moment."""
    rods, turned, o = case.rods(k.p), _turned(case, k), case.offset
    carried = _carried(case)
    parts: list[tuple[Scalar, ...]] = [()] * len(rods)  # Axx, Axy, Ayy, fx, fy of each subtree
    answers: list[tuple[Scalar, ...]] = [()] * len(rods)  # Ux, Uy, un, 1/U0
    for i in reversed(range(len(rods))):
        rod, t = rods[i], turned[i]
        (rx, ry), (hx, hy), square = t.r, t.h, t.omega * t.omega
        cx, cy, gx, gy = square * rx, square * ry, square * hx, square * hy
        A = [(parts[c], rods[c].at_end) for c in carried[i]]
        Axx, Axy, Ayy, fx, fy = (_sum([part[e] for part, at_end in A if at_end]) for e in range(5))
        Bxx, Bxy, Byy, bx, by = (_sum([part[e] for part, at_end in A if not at_end]) for e in range(5))
        ux, uy = Axy * rx - Axx * ry, Ayy * rx - Axy * ry
        fx, fy = fx - (Axx * cx + Axy * cy), fy - (Axy * cx + Ayy * cy)
        wx, wy = -(rod.mass * gx), -(rod.mass * gy)
        U0 = rod.inertia + rod.mass * (hx * hx + hy * hy) + (uy * rx - ux * ry)
        Ux, Uy = ux - rod.mass * hy, uy + rod.mass * hx
        P0 = (fy * rx - fx * ry) + (wy * hx - wx * hy)
        torque = k.Q[o + i]
        if not case.absolute:
            torque = torque - _sum([k.Q[o + c] for c in carried[i]])
        inverse, un = 1 / U0, torque - P0
        sx, sy = Ux * inverse, Uy * inverse
        answers[i] = (Ux, Uy, un, inverse)
        parts[i] = (
            Axx + Bxx + rod.mass - Ux * sx,
            Axy + Bxy - Ux * sy,
            Ayy + Byy + rod.mass - Uy * sy,
            fx + bx + wx + sx * un,
            fy + by + wy + sy * un,
        )
    base, start = _base_acceleration(case, k, parts[0])
    qdd, alpha, starts, ends = [*base], [], [], []
    for i, rod in enumerate(rods):
        t, (Ux, Uy, un, inverse) = turned[i], answers[i]
        ax, ay = start if rod.parent < 0 else (ends if rod.at_end else starts)[rod.parent]
        rate = inverse * (un - Ux * ax - Uy * ay)
        qdd.append(rate if case.absolute or rod.parent < 0 else rate - alpha[rod.parent])
        square = t.omega * t.omega
        alpha.append(rate)
        starts.append((ax, ay))
        ends.append((ax - rate * t.r[1] - square * t.r[0], ay + rate * t.r[0] - square * t.r[1]))
    return qdd


def _sum(terms: Sequence[Scalar]) -> Scalar:
    total: Scalar = terms[0] if terms else 0
    for term in terms[1:]:
        total = total + term
    return total


def _base_acceleration(case: Case, k: Given, part: Sequence[Scalar]) -> tuple[list[Scalar], tuple[Scalar, Scalar]]:
    """qdd of the base, and the acceleration of the first joint against free fall."""
    Axx, Axy, Ayy, fx, fy = part
    g = k.p["g"]
    if case.base == "fixed":
        return [], (0, g)
    if case.base == "cart":
        x = (k.Q[0] - Axy * g - fx) / (k.p["mc"] + Axx)
        return [x], (x, g)
    bx, by, inverse = k.Q[0] - fx, k.Q[1] - fy, 1 / (Axx * Ayy - Axy * Axy)
    x, y = inverse * (Ayy * bx - Axy * by), inverse * (Axx * by - Axy * bx)
    return [x, y - g], (x, y)


# ------------------------------------------------------------------------------------------------------------- arms


def _cross(a: Vector, b: Vector) -> list[Scalar]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a: Vector, b: Vector) -> Scalar:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _plus(a: Vector, b: Vector) -> list[Scalar]:
    return [x + y for x, y in zip(a, b, strict=True)]


def _times(factor: Scalar, a: Vector) -> list[Scalar]:
    return [factor * x for x in a]


def _apply(matrix: Matrix, a: Vector) -> list[Scalar]:
    return [_dot(row, a) for row in matrix]


def _transposed(matrix: Matrix) -> list[list[Scalar]]:
    return [list(row) for row in zip(*matrix, strict=True)]


def _product(a: Matrix, b: Matrix) -> list[list[Scalar]]:
    return [[_dot(row, column) for column in _transposed(b)] for row in a]


def _added(a: Matrix, b: Matrix) -> list[list[Scalar]]:
    return [_plus(x, y) for x, y in zip(a, b, strict=True)]


def _symmetric(entry: Callable[[int, int], Scalar]) -> list[list[Scalar]]:
    upper = {(r, c): entry(r, c) for r in _XYZ for c in range(r, 3)}
    return [[upper[min(r, c), max(r, c)] for c in _XYZ] for r in _XYZ]


def _tilde(a: Vector) -> list[list[Scalar]]:
    """The matrix of a x"""
    return [[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]]


def _unit(axis: int, length: Scalar = 1) -> list[Scalar]:
    return [length if i == axis else 0 for i in _XYZ]


@dataclass(frozen=True)
class _Joint:
    """A segment with its sine and cosine: ``down`` R^T a to the link's axes, ``up`` R a to those of the one before."""

    link: Segment
    s: Scalar
    c: Scalar

    def _turn(self, s: Scalar, a: Vector) -> list[Scalar]:
        i, j = (self.link.axis + 1) % 3, (self.link.axis + 2) % 3
        turned = list(a)
        turned[i], turned[j] = self.c * a[i] - s * a[j], s * a[i] + self.c * a[j]
        return turned

    def down(self, a: Vector) -> list[Scalar]:
        return self._turn(-self.s, a)

    def up(self, a: Vector) -> list[Scalar]:
        return self._turn(self.s, a)

    def up_symmetric(self, I: Matrix) -> list[list[Scalar]]:  # noqa: E741
        """R I R^T for a symmetric I, by the double angle"""
        x, s, c = self.link.axis, self.s, self.c
        a, b = (x + 1) % 3, (x + 2) % 3
        J: list[list[Scalar]] = [[0] * 3 for _ in _XYZ]
        difference = I[a][a] - I[b][b]
        t = c * c * difference - 2 * (s * c * I[a][b])
        J[x][x], J[a][a], J[b][b] = I[x][x], I[b][b] + t, I[a][a] - t
        J[a][b] = J[b][a] = s * c * difference + (c * c - s * s) * I[a][b]
        J[x][a] = J[a][x] = c * I[x][a] - s * I[x][b]
        J[x][b] = J[b][x] = s * I[x][a] + c * I[x][b]
        return J

    def up_matrix(self, H: Matrix) -> list[list[Scalar]]:
        """R H R^T"""
        half = [self.up(row) for row in H]
        return _transposed([self.up(row) for row in _transposed(half)])


def _joints(case: Case, k: Given) -> list[_Joint]:
    return [_Joint(link, k.sin(q), k.cos(q)) for link, q in zip(case.segments(k.p), k.q, strict=True)]


def _spatial_energies(case: Case, k: Given) -> tuple[Scalar, Scalar]:
    v, omega, up = [0, 0, 0], [0, 0, 0], [0, 0, 1]
    z, twice_T, V = 0, 0, 0
    for joint, rate in zip(_joints(case, k), k.qd, strict=True):
        link = joint.link
        v = joint.down(_plus(v, _cross(omega, link.place)))
        omega = _plus(joint.down(omega), _unit(link.axis, rate))
        z = z + _dot(up, link.place)
        up = joint.down(up)
        center = _plus(v, _cross(omega, link.center))
        twice_T = twice_T + link.mass * _dot(center, center) + _dot(omega, _apply(link.inertia, omega))
        V = V + link.mass * k.p["g"] * (z + _dot(up, link.center))
    return twice_T / 2, V


def _about_joint(link: Segment, first: Vector) -> list[list[Scalar]]:
    """The inertia tensor about the joint; ``first`` is the first moment m c."""
    square = _dot(link.center, first)
    return _symmetric(lambda r, c: link.inertia[r][c] - first[r] * link.center[c] + (square if r == c else 0))


def _spatial_mass(case: Case, k: Given) -> tuple[list[list[Scalar]], list[Scalar]]:
    joints, n = _joints(case, k), case.n
    omega, alpha, a = [0, 0, 0], [0, 0, 0], [0, 0, k.p["g"]]
    acting = []
    for joint, rate in zip(joints, k.qd, strict=True):
        link = joint.link
        a = joint.down(_plus(a, _plus(_cross(alpha, link.place), _cross(omega, _cross(omega, link.place)))))
        spin = _unit(link.axis, rate)
        carried = joint.down(omega)
        alpha = _plus(joint.down(alpha), _cross(carried, spin))
        omega = _plus(carried, spin)
        center = _plus(a, _plus(_cross(alpha, link.center), _cross(omega, _cross(omega, link.center))))
        force = _times(link.mass, center)
        torque = _plus(_apply(link.inertia, alpha), _cross(omega, _apply(link.inertia, omega)))
        acting.append((force, _plus(torque, _cross(link.center, force))))
    f, t, mass, s = [0, 0, 0], [0, 0, 0], 0, [0, 0, 0]
    I: list[list[Scalar]] = [[0] * 3 for _ in _XYZ]  # noqa: E741
    M: list[list[Scalar]] = [[0] * n for _ in range(n)]
    h: list[Scalar] = [0] * n
    for i in reversed(range(n)):
        joint, link = joints[i], joints[i].link
        f, t = _plus(f, acting[i][0]), _plus(t, acting[i][1])
        h[i] = t[link.axis]
        first = _times(link.mass, link.center)
        I = _added(I, _about_joint(link, first))  # noqa: E741
        s, mass = _plus(s, first), mass + link.mass
        _spatial_column(M, joints, i, [I[r][link.axis] for r in _XYZ], _cross(_unit(link.axis), s))
        f = joint.up(f)
        t = _plus(joint.up(t), _cross(link.place, f))
        s, I = joint.up(s), joint.up_symmetric(I)  # noqa: E741
        mean = _plus(s, [mass * x / 2 for x in link.place])
        twice = 2 * _dot(mean, link.place)
        I = _shifted(I, mean, link.place, twice)  # noqa: E741
        s = _plus(s, _times(mass, link.place))
    return M, h


def _shifted(I: Matrix, mean: Vector, d: Vector, twice: Scalar) -> list[list[Scalar]]:  # noqa: E741
    return _symmetric(lambda r, c: I[r][c] + (twice if r == c else 0) - (mean[r] * d[c] + mean[c] * d[r]))


def _spatial_column(M: list[list[Scalar]], joints: Sequence[_Joint], i: int, torque: Vector, force: Vector) -> None:
    """Column i of M: the force and torque of a unit acceleration of joint i, passed on to the joints before it."""
    M[i][i] = torque[joints[i].link.axis]
    for j in reversed(range(i)):
        outer = joints[j + 1]
        force = outer.up(force)
        torque = _plus(outer.up(torque), _cross(outer.link.place, force))
        M[i][j] = M[j][i] = torque[joints[j].link.axis]


@dataclass(frozen=True)
class _Velocity:
    """What the velocities of one link contribute: accelerations (angular, linear) and torque and force of its bias."""

    angular: Vector
    linear: Vector
    torque: Vector
    force: Vector


def _velocity_terms(joints: Sequence[_Joint], k: Given) -> list[_Velocity]:
    omega: Vector = [0, 0, 0]
    terms = []
    for joint, rate in zip(joints, k.qd, strict=True):
        link = joint.link
        linear = joint.down(_cross(omega, _cross(omega, link.place)))
        carried, spin = joint.down(omega), _unit(link.axis, rate)
        angular = _cross(carried, spin)
        omega = _plus(carried, spin)
        first = _times(link.mass, link.center)
        torque = _cross(omega, _apply(_about_joint(link, first), omega))
        terms.append(_Velocity(angular, linear, torque, _cross(omega, _cross(omega, first))))
    return terms


def _spatial_articulated(case: Case, k: Given) -> list[Scalar]:
    """Blocks: torque = I alpha + H a + t, force = H^T alpha + M a + f, at the joint in the link's axes."""
    joints = _joints(case, k)
    velocity = _velocity_terms(joints, k)
    answers: list[tuple[Vector, Vector, Scalar, Scalar]] = []
    outer = None
    for i in reversed(range(case.n)):
        joint, link, x = joints[i], joints[i].link, joints[i].link.axis
        first = _times(link.mass, link.center)
        I, H = _about_joint(link, first), _tilde(first)  # noqa: E741
        M: Matrix = [_unit(r, link.mass) for r in _XYZ]
        t, f = velocity[i].torque, velocity[i].force
        if outer is not None:
            I, H, M = _added(I, outer[0]), _added(H, outer[1]), _added(M, outer[2])  # noqa: E741
            t, f = _plus(t, outer[3]), _plus(f, outer[4])
        Ut, Uf = [I[r][x] for r in _XYZ], list(H[x])
        inverse, rest = 1 / Ut[x], k.Q[i] - t[x]
        answers.append((Ut, Uf, inverse, rest))
        if i:
            outer = _passed(joint, velocity[i], (I, H, M, t, f), (Ut, Uf, inverse, rest), k.Q[i])
    return _outward(joints, velocity, answers[::-1], k.p["g"])


def _passed(
    joint: _Joint,
    velocity: _Velocity,
    body: tuple[Matrix, Matrix, Matrix, Vector, Vector],
    answer: tuple[Vector, Vector, Scalar, Scalar],
    Q: Scalar,
) -> tuple[Matrix, Matrix, Matrix, Vector, Vector]:
    """The blocks without the joint's own motion, in the axes of the link before and at its joint."""
    I, H, M, t, f = body  # noqa: E741
    Ut, Uf, inverse, rest = answer
    x, d = joint.link.axis, joint.link.place
    Gt, Gf = _times(inverse, Ut), _times(inverse, Uf)
    free_I = _symmetric(lambda r, c: 0 if x in (r, c) else I[r][c] - Ut[r] * Gt[c])
    free_H = [[0 if r == x else H[r][c] - Ut[r] * Gf[c] for c in _XYZ] for r in _XYZ]
    free_M = _symmetric(lambda r, c: M[r][c] - Uf[r] * Gf[c])
    ca, cl = velocity.angular, velocity.linear
    t = [Q if r == x else t[r] + _dot(free_I[r], ca) + _dot(free_H[r], cl) + Gt[r] * rest for r in _XYZ]
    by_turning = [_sum([free_H[c][r] * ca[c] for c in _XYZ if c != x]) for r in _XYZ]
    f = [f[r] + by_turning[r] + _dot(free_M[r], cl) + Gf[r] * rest for r in _XYZ]
    up_I, up_M, up_H = joint.up_symmetric(free_I), joint.up_symmetric(free_M), joint.up_matrix(free_H)
    t, f = joint.up(t), joint.up(f)
    D = _tilde(d)
    DM, HD = _product(D, up_M), _product(up_H, D)
    DMD = _product(DM, D)
    shifted = _symmetric(lambda r, c: up_I[r][c] - HD[r][c] - HD[c][r] - DMD[r][c])
    return shifted, _added(up_H, DM), up_M, _plus(t, _cross(d, f)), f


def _outward(
    joints: Sequence[_Joint],
    velocity: Sequence[_Velocity],
    answers: Sequence[tuple[Vector, Vector, Scalar, Scalar]],
    g: Scalar,
) -> list[Scalar]:
    alpha, a = [0, 0, 0], [0, 0, g]
    qdd = []
    for joint, terms, (Ut, Uf, inverse, rest) in zip(joints, velocity, answers, strict=True):
        a = _plus(joint.down(_plus(a, _cross(alpha, joint.link.place))), terms.linear)
        alpha = _plus(joint.down(alpha), terms.angular)
        own = inverse * (rest - _dot(Ut, alpha) - _dot(Uf, a))
        alpha = _plus(alpha, _unit(joint.link.axis, own))
        qdd.append(own)
    return qdd
