"""Fingerprints: every node evaluated at one random point modulo a prime.

Two expressions with equal fingerprints are equal, but for a chance of about (nodes^2 * degree) / 2^240 (Schwartz and
Zippel). The prime p is safe: (p - 1)/2 is prime too. Therefore the powers of a number repeat only after (p - 1)/2 of
them, and all the powers of two that floating-point numbers are made of differ. Sines and cosines are points of the
unit circle, see ``circle``. The fingerprint of any other function is a random value that depends on the fingerprints
of its operands.
Source: J. T. Schwartz, J. ACM 27 (1980) 701-717; the same idea for program graphs: W. A. Martin, J. ACM 18 (1971) 549.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from hashlib import blake2b

PRIME = (1 << 240) - 26837
_SHORT = 119
"""Numerators and denominators of up to so many bits are used exactly: their quotients differ modulo PRIME."""


def random_mark(kind: str, key: str | Sequence[int]) -> int:
    """A value of at least 1 that depends on its arguments alone, whatever Python's hash seed is."""
    digest = blake2b(f"{kind} {key}".encode(), digest_size=32).digest()
    return int.from_bytes(digest, "big") % (PRIME - 1) + 1


def constant_mark(value: Fraction | float) -> int:
    """The fingerprint of a number: ``value`` modulo PRIME, or a random value if its fraction is long.

    Two long fractions might be equal modulo PRIME although they differ.
    """
    exact = Fraction(value) if math.isfinite(value) else None
    if exact is None or max(map(int.bit_length, exact.as_integer_ratio())) >= _SHORT:
        return random_mark("constant", repr(value))
    return exact.numerator * pow(exact.denominator, -1, PRIME) % PRIME


def inverse_mark(mark: int) -> int:
    """The fingerprint of 1 / x where x has the fingerprint ``mark``; arbitrary if ``mark`` is 0."""
    return pow(mark, -1, PRIME) if mark else random_mark("inverse", "of zero")
