"""Mechanisms of random structure with contacts, stops, dry friction and latches: what ``validate`` says of them.

Run with `python -m benchmarks.random_structures [FIRST] [COUNT]`. Each seed is a mechanism of its own, and the same
seed is always the same one. A mechanism whose start cannot be, because a gap is negative, is left out. The bars: no
failure, no error, and few that are not judged. Whoever changes the laws of contact or the judge sees here what the
bundled models do not show.
"""

from __future__ import annotations

import argparse
import random
import time
from collections.abc import Callable, Iterable

from rich.console import Console
from rich.table import Table

from lag2fmu.errors import Lag2FmuError, MechanismError, TextError
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Mechanism
from lag2fmu.verify.validate import validate

STOP = 1.5
"""s"""


class Writer:
    """Writes a mechanism as text: tables of parts, coordinates and generalized forces; ``chance`` draws values."""

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        self.coordinates: list[str] = []
        self.forces: list[str] = []
        self.parts: list[str] = []

    def likely(self, share: float) -> bool:
        """True in this ``share`` of all cases."""
        return self.chance.random() < share

    def number(self, low: float, high: float) -> float:
        """A number between ``low`` and ``high``, with four digits behind the point."""
        return round(self.chance.uniform(low, high), 4)

    def coordinate(self, name: str, start: float, speed: float) -> None:
        """Add a coordinate, which in half of all cases starts with a velocity of up to ``speed``."""
        velocity = self.number(-speed, speed) if self.likely(0.5) else 0.0
        self.coordinates.append(f"{name} = {{ start = {start:.4f}, velocity = {velocity} }}")

    def part(self, table: str, **keys: object) -> None:
        """Add a part of a ``table``; text stays text, and a list of texts a list."""
        lines = (f'{key} = "{value}"' if isinstance(value, str) else f"{key} = {value}" for key, value in keys.items())
        self.parts.append("\n".join([f"[{table}.{table[0]}{len(self.parts)}]", *lines]))

    def push(self, coordinate: str, size: float) -> None:
        """Perhaps add a force that swings, jumps or grows."""
        a, w = self.number(0.3 * size, 1.5 * size), self.number(2, 15)
        kinds = (f"{a}*sin({w}*t)", f"if(t < {self.number(0.2, 1)}, {a}, {-a})", f"{a}*t")
        if self.likely(0.5):
            self.forces.append(f'{coordinate} = "{self.chance.choice(kinds)}"')

    def rub(self, slip: str, size: float, share: float) -> None:
        """Perhaps add a dry friction, which may stick better than it slides."""
        force = self.number(0.2 * size, size)
        if self.likely(share):
            self.part("frictions", on=slip, force=force, static=round(force * self.chance.choice([1, 1.3]), 4))

    def returned(self) -> float:
        """A coefficient of restitution."""
        return self.chance.choice([0, 0, 0.2, 0.5, 0.8, 1])

    def coefficient(self) -> float:
        """A coefficient of friction."""
        return self.chance.choice([0, 0.1, 0.3, 0.6, 1.0])

    def text(self, name: str) -> str:
        """The whole mechanism."""
        head = [f'[mechanism]\nname = "{name}"', "[coordinates]", *self.coordinates]
        forces = ["[forces]", *self.forces] if self.forces else []
        return "\n".join([*head, *forces, *self.parts])


def sliders(w: Writer) -> None:
    """Masses in a row with springs, play, frictions on the ground, on belts and on each other, and a latch."""
    place = 0.0
    count = w.chance.randint(1, 4)
    for i in range(count):
        place += w.number(0.3, 0.8)
        w.coordinate(f"x{i}", place, 2)
        w.part("bodies", mass=w.number(0.3, 3), position=[f"x{i}", "0"])
        w.push(f"x{i}", 10)
        w.rub(w.chance.choice([f"x{i}_dot", f"x{i}_dot - {w.number(0.2, 1)}*cos({w.number(3, 12)}*t)"]), 6, 0.6)
        if w.likely(0.5):
            w.part("springs", stiffness=w.chance.choice([20, 200, 2000]), elongation=f"x{i} - {place:.4f}")
    for i in range(count - 1):
        apart, play = f"x{i + 1} - x{i}", w.number(0.1, 0.3)
        if w.likely(0.7):
            w.part("contacts", gap=f"{apart} - {play}", restitution=w.returned())
        else:
            w.part("stops", of=apart, lower=play, upper=w.number(0.8, 1.2), restitution=w.returned())
        w.rub(f"x{i + 1}_dot - x{i}_dot", 5, 0.4)
    if count > 1 and w.likely(0.4):
        now = w.chance.choice([f"{w.number(0.3, 1)} - t", f"t - {w.number(0.3, 1)}"])
        w.parts.append(f'[constraints.nonholonomic]\nlatch = {{ expression = "x1_dot - x0_dot", while = "{now}" }}')


def discs(w: Writer) -> None:
    """Discs, perhaps with their mass centre beside their middle, on a floor that may move, and against each other."""
    w.parts.append("[gravity]\nacceleration = 9.81")
    radii = [w.number(0.1, 0.4) for _ in range(w.chance.randint(1, 3))]
    for i, r in enumerate(radii):
        for name, start, speed in (
            ("x", 2.2 * sum(radii[:i]) + i + r, 3),
            ("y", r + w.chance.choice([0, 0.5]), 0),
            ("a", 0, 8),
        ):
            w.coordinate(f"{name}{i}", start, speed)
        m, off = w.number(0.3, 3), w.chance.choice([0, 0, 0.3 * r])
        middle = [f"x{i} + {off:.4f}*cos(a{i})", f"y{i} + {off:.4f}*sin(a{i})"]
        w.part("bodies", mass=m, inertia=round(m * r * r / 2, 5), position=middle, angle=f"a{i}")
        floor = w.chance.choice(["0", f"{w.number(0.02, 0.1)}*sin({w.number(3, 9)}*t)"])
        slip, friction, e = f"x{i}_dot + {r}*a{i}_dot", w.coefficient(), w.returned()
        w.part("contacts", gap=f"y{i} - {r} - {floor}", slip=slip, friction=friction, restitution=e)
    for j in range(1, len(radii)):
        i = j - 1
        ends = f"sqrt((x{j} - x{i})**2 + (y{j} - y{i})**2)"
        turned = f"{radii[i]}*a{i}_dot + {radii[j]}*a{j}_dot"
        slip = f"((y{j}_dot - y{i}_dot)*(x{j} - x{i}) - (x{j}_dot - x{i}_dot)*(y{j} - y{i}))/{ends} - {turned}"
        gap = f"{ends} - {radii[i] + radii[j]:.4f}"
        w.part("contacts", gap=gap, slip=slip, friction=w.coefficient(), restitution=w.returned())


def pendulum(w: Writer) -> None:
    """A pendulum on a cart: friction in rail and joint, stops, and a floor that its end may strike or slide on."""
    w.parts.append("[gravity]\nacceleration = 9.81")
    length = w.number(0.3, 0.8)
    w.coordinate("x", 0, 1)
    w.coordinate("p", w.number(-1.5, 1.5), 4)
    w.part("bodies", mass=w.number(0.5, 3), position=["x", "0"])
    middle = [f"x + {length}/2*sin(p)", f"-{length}/2*cos(p)"]
    w.part("bodies", mass=w.number(0.2, 2), inertia=0.02, position=middle, angle="p")
    w.rub("x_dot", 8, 0.6)
    w.rub("p_dot", 2, 0.6)
    w.push("x", 12)
    if w.likely(0.5):
        w.part("stops", of="x", lower=-0.3, upper=0.4, restitution=w.returned())
    if w.likely(0.3):
        w.part("springs", stiffness=w.number(1, 30), elongation="p")
    slip, friction, e = f"x_dot + {length}*cos(p)*p_dot", w.coefficient(), w.returned()
    w.part("contacts", gap=f"{w.number(0.1, 0.9)} - {length}*cos(p)", slip=slip, friction=friction, restitution=e)


def shafts(w: Writer) -> None:
    """Shafts with brakes, clutches that are pressed later, gears with friction, play and springs between them."""
    count = w.chance.randint(2, 4)
    for i in range(count):
        w.coordinate(f"p{i}", 0, 10)
        w.part("bodies", mass=1, inertia=w.number(0.05, 1), position=["0", "0"], angle=f"p{i}")
        w.push(f"p{i}", 5)
        w.rub(f"p{i}_dot", 4, 0.4)
    for i in range(count - 1):
        kind, slip = w.chance.randrange(4), f"p{i}_dot - p{i + 1}_dot"
        if kind == 0:
            w.part("frictions", on=slip, force=f"if(t > {w.number(0.1, 0.6)}, {w.number(1, 8)}, 0)")
        elif kind == 1:
            w.rub(f"p{i}_dot + {w.number(-2, 2)}*p{i + 1}_dot", 6, 1.0)
        elif kind == 2:
            w.part("stops", of=f"p{i} - p{i + 1}", lower=-w.number(0.01, 0.5), upper=0.2, restitution=w.returned())
        else:
            w.part("springs", stiffness=w.chance.choice([10, 300]), elongation=f"p{i} - p{i + 1}")


KINDS: tuple[Callable[[Writer], None], ...] = (sliders, discs, pendulum, shafts)


def mechanism_of(seed: int) -> Mechanism:
    """The mechanism of this ``seed``. Raises TextError for one that cannot be, as where a gap is negative."""
    writer, kind = Writer(seed), KINDS[seed % len(KINDS)]
    kind(writer)
    return read(writer.text(f"{kind.__name__}_{seed}"), f"{kind.__name__}_{seed}.toml")


def measure(seeds: Iterable[int]) -> Table:
    """A table of what is said of the mechanisms of the ``seeds`` that do not pass, and of how many do."""
    table = Table("mechanism", "said", "CPU s", "what")
    counts: dict[str, int] = {}
    for seed in seeds:
        begun = time.process_time()
        said: str
        try:
            mechanism = mechanism_of(seed)
            report = validate(mechanism, stop_time=STOP)
            said = report.outcome
            what = "; ".join(f"{c.name}: {c.detail}" for c in report.checks if not c.passed)
        except (MechanismError, TextError):
            said, what = "no start", ""
        except Lag2FmuError as error:
            said, what = "error", str(error)
        counts[said] = counts.get(said, 0) + 1
        if said not in ("ok", "no start"):
            table.add_row(
                f"{KINDS[seed % len(KINDS)].__name__} {seed}", said, f"{time.process_time() - begun:.1f}", what
            )
    table.caption = ", ".join(f"{said}: {count}" for said, count in sorted(counts.items()))
    return table


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("first", nargs="?", type=int, default=0)
    parser.add_argument("count", nargs="?", type=int, default=40)
    given = parser.parse_args()
    Console().print(measure(range(given.first, given.first + given.count)))


if __name__ == "__main__":
    main()
