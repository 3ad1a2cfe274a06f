"""Sizes that limits or statements gave, and that a motion stays far below.

Limits of plus and minus 1e6, written for none, say nothing of how large a signal or an unknown is.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence, Set

from ocp.mesh.initial_guess import InitialGuess
from ocp.scaling.scales import Scales
from ocp.scaling.symbol_sizes import BOUNDS, GUESSED_NUMBER
from ocp.scaling.variations import FRACTIONS, largest_finite

# Factor by which a size may be more than a signal has in a motion. Limits of plus and minus 1e4
# around motions of one were tried on 75 problems, and hid no optimum; those of 1e6 did.
ROOMY = 1e4

# Of the typical duration: ten times the least, which what shrinks ends near
SHRUNK = 1e-8

# where sizes come from that limits may have made too large
_OF_LIMITS = {BOUNDS, GUESSED_NUMBER}


def near_limits(limits: Sequence[float], typical: float) -> list[float]:
    """Absolute values of the finite limits of something that a motion with such a value may feel.

    A limit of plus and minus 1e6, written for none, says nothing of how large something is.
    """
    finite = [abs(limit) for limit in limits if math.isfinite(limit)]
    return [limit for limit in finite if limit <= ROOMY * typical]


def far_below_limits(scales: Scales, motion: InitialGuess) -> Set[str]:
    """Signals and unknowns far below a size that their limits gave; they may also be zero."""
    return _far_below(scales, motion, _OF_LIMITS)


def is_brief(scales: Scales, motion: InitialGuess) -> bool:
    """Whether a motion lasts far less than limits of its times gave for long, and yet some time.

    One that has shrunk to the least duration says nothing of how long anything takes.
    """
    longest = max(phase.end - phase.start for phase in motion.phases.values())
    return SHRUNK * scales.time < longest < scales.time / ROOMY


def roomy(scales: Scales, of_motion: Scales, factor: float = ROOMY) -> list[str]:
    """Signals and unknowns whose limits gave sizes many times those of a motion, as 1e6 may be."""
    return _many_times(scales, of_motion, _OF_LIMITS, factor)


def _far_below(scales: Scales, motion: InitialGuess, reasons: Set[str]) -> Set[str]:
    """Those of a motion that stay far below sizes for which there are such reasons."""
    phases = [phase.at_fractions(FRACTIONS) for phase in motion.phases.values()]

    def largest(name: str) -> float:
        if name in motion.unknowns:
            return largest_finite(motion.unknowns[name])
        return max(largest_finite(values.get(name, 0.0)) for values in phases)

    return {name for name, size in _given(scales, reasons) if ROOMY * largest(name) < size}


def _many_times(scales: Scales, of_motion: Scales, reasons: Set[str], factor: float) -> list[str]:
    """Those whose sizes, for which there are such reasons, are many times those of a motion."""
    sizes = of_motion.symbols
    return [name for name, size in _given(scales, reasons) if size > factor * sizes[name]]


def _given(scales: Scales, reasons: Set[str]) -> Iterator[tuple[str, float]]:
    """Names and sizes for which there are such reasons."""
    for name, size, why in scales.symbols_with_reasons:
        if why in reasons:
            yield name, size
