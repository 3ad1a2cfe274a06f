"""Random cases: the first ones are fast tests, the others slow ones."""

import pytest


def seeds(fast: int, total: int) -> list:
    """Seeds from 0 on, of which those from `fast` on are marked as slow."""
    later = (pytest.param(seed, marks=pytest.mark.slow) for seed in range(fast, total))
    return [*range(fast), *later]
