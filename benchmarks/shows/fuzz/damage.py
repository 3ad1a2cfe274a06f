"""Ways in which any file is damaged, each drawn from a random generator."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Way = Callable[[bytes, np.random.Generator], bytes]


def truncated(data: bytes, rng: np.random.Generator) -> bytes:
    """The beginning."""
    return data[: int(rng.integers(0, max(len(data), 1)))]


def flipped(data: bytes, rng: np.random.Generator) -> bytes:
    """Some bytes are others."""
    changed = bytearray(data)
    for place in rng.integers(0, max(len(data), 1), size=int(rng.integers(1, 9))):
        if place < len(changed):
            changed[place] = int(rng.integers(0, 256))
    return bytes(changed)


def emptied(data: bytes, rng: np.random.Generator) -> bytes:
    """Nothing, or spaces."""
    return b" " * int(rng.integers(0, 3))


def no_utf8(data: bytes, rng: np.random.Generator) -> bytes:
    """Text with bytes that are none."""
    place = int(rng.integers(0, len(data) + 1))
    return data[:place] + b"\xff\xfe\x00" + data[place:]


OF_TEXT: tuple[Way, ...] = (truncated, flipped, emptied, no_utf8)
