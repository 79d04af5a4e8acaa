"""Fingerprints: every node evaluated at one random point modulo a prime.

Two expressions with equal fingerprints are equal, but for a chance of about (nodes^2 * degree) / 2^240 (Schwartz and
Zippel). The prime p is safe, (p - 1)/2 being prime too, so that the powers of a number come round only after (p - 1)/2
of them: those of two, of which floating-point numbers are made, all differ. Sines and cosines are points of the unit
circle, see ``circle``. Other functions are random values of their operands' fingerprints.
Source: J. T. Schwartz, J. ACM 27 (1980) 701-717; the same idea for program graphs: W. A. Martin, J. ACM 18 (1971) 549.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from hashlib import blake2b

PRIME = (1 << 240) - 26837
_SHORT = 119
"""Bits of the numerators and denominators of numbers that count as they are: their quotients differ modulo PRIME."""


def random_mark(kind: str, key: str | Sequence[int]) -> int:
    """A value from 1 on that depends on nothing but its arguments, whatever the hash seed."""
    digest = blake2b(f"{kind} {key}".encode(), digest_size=32).digest()
    return int.from_bytes(digest, "big") % (PRIME - 1) + 1


def constant_mark(value: Fraction | float) -> int:
    """The value of a number; of a long one, which another number may be equal to modulo PRIME, a random value."""
    exact = Fraction(value) if math.isfinite(value) else None
    if exact is None or max(map(int.bit_length, exact.as_integer_ratio())) >= _SHORT:
        return random_mark("constant", repr(value))
    return exact.numerator * pow(exact.denominator, -1, PRIME) % PRIME


def inverse_mark(mark: int) -> int:
    """The value of 1 / a node of value ``mark``; any where that is 0."""
    return pow(mark, -1, PRIME) if mark else random_mark("inverse", "of zero")
