"""Texts that are wrong by their sheer size: nested too deeply, too long, or too many of one thing."""

from __future__ import annotations

from collections.abc import Iterator

PENDULUM = """[mechanism]
name = "pendulum"
[parameters]
m = { value = 1.0, unit = "kg" }
l = { value = 1.0, unit = "m" }
g = { value = 9.81, unit = "m/s2" }
[coordinates]
theta = { unit = "rad", start = 0.5 }
[gravity]
acceleration = "g"
[bodies.bob]
mass = "m"
position = ["l*sin(theta)", "-l*cos(theta)"]
"""
MASS = 'm = { value = 1.0, unit = "kg" }'


def excessive() -> dict[str, str]:
    """{name: text}; the first line of a text says as a comment what the error should be, a regular expression."""
    texts = {**dict(_potentials()), **dict(_masses()), **dict(_definitions())}
    texts["deep_key"] = _text(r"line 15: a key of more than 32 parts", PENDULUM + ".".join("a" * 20_001) + " = 1\n")
    return texts


def _text(expected: str, text: str) -> str:
    return f"# expect: {expected}\n{text}"


def _potentials() -> Iterator[tuple[str, str]]:
    """A potential energy of a pendulum that is too much for the parser."""
    roots = "theta*" + "sqrt(1 - " * 55 + "1/3" + ")" * 55
    largest = ",".join(f"{i}*theta + {i * i}" for i in range(400))
    for name, expected, value in (
        ("deep_array", r"(no valid TOML: .*nest|energy\.potential: expected an expression)", "[" * 5000 + "]" * 5000),
        ("deep_functions", "parentheses nested deeper than 60", f'"{"sin(" * 5000}theta{")" * 5000}"'),
        ("deep_parentheses", "parentheses nested deeper than 60", f'"{"(" * 5000}theta{")" * 5000}"'),
        ("deep_powers", "powers nested deeper than 60", f'"{"**".join(["theta"] * 5001)}"'),
        ("deep_roots", "a number with roots and functions nested too deeply", f'"{roots}"'),
        ("deep_signs", "more than 60 signs", f'"{"-" * 5000}theta"'),
        ("huge_comparison", "max of 400 arguments", f'"max({largest})"'),
        ("long_expression", "the expression has 102005 characters", f'"{"*".join(["theta"] * 17_001)}"'),
    ):
        place = "" if name == "deep_array" else r"energy\.potential: "
        yield name, _text(place + expected, f"{PENDULUM}[energy]\npotential = {value}\n")


def _masses() -> Iterator[tuple[str, str]]:
    """A mass of a pendulum whose unit or value is too long."""
    long_unit, digits = ".".join("m" * 10_001), "9" * 20_000
    too_long = "has too many digits"
    for name, expected, mass in (
        ("long_unit", r"parameters\.m\.unit: unit 'm\.m\.m.*has 20001 characters", f'1.0, unit = "{long_unit}"'),
        (
            "number_huge_hexadecimal",
            rf"parameters\.m\.value: the number 0xff.* {too_long}",
            f'0x{"f" * 20_000}, unit = "kg"',
        ),
        (
            "number_huge_integer",
            rf"no valid TOML: .*digits|parameters\.m\.value: the number .* {too_long}",
            f'{digits}, unit = "kg"',
        ),
    ):
        yield name, _text(expected, PENDULUM.replace(MASS, f"m = {{ value = {mass} }}"))


def _definitions() -> Iterator[tuple[str, str]]:
    """Definitions that go in a long circle, or that would be written out to more terms than there are atoms."""
    circle = [f'd{i} = "d{(i - 1) % 1200}"' for i in range(1200)]
    web = ['d0 = "nothing"', 'd1 = "d0"', *(f'd{i} = "d{i - 1}*d{i - 2}"' for i in range(2, 300))]
    for name, expected, lines in (
        ("long_definition_circle", r"definitions\.d\d+: is defined by itself", circle),
        ("long_definition_web", r"definitions\.d0: undefined symbol 'nothing'", web),
    ):
        yield name, _text(expected, PENDULUM + "[definitions]\n" + "\n".join(lines) + "\n")
