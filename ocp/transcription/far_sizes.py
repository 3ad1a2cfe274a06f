"""Sizes that limits or statements gave, and that a motion stays far below.

Limits of plus and minus 1e6, written for none, say nothing of how large a signal or an unknown is.
"""

from __future__ import annotations

from collections.abc import Iterator, Set

from ocp.mesh.initial_guess import InitialGuess
from ocp.transcription.scaling import (
    BOUNDS,
    GUESSED_NUMBER,
    NOTHING_KNOWN,
    ROOMY,
    STATED,
    Scales,
)
from ocp.transcription.variations import FRACTIONS, largest_finite

# where sizes come from that limits may have made too large
_OF_LIMITS = {BOUNDS, GUESSED_NUMBER}


def far_below_limits(scales: Scales, motion: InitialGuess) -> Set[str]:
    """Signals and unknowns far below a size that their limits gave; they may also be zero."""
    return _far_below(scales, motion, _OF_LIMITS)


def far_below_stated(scales: Scales, motion: InitialGuess) -> Set[str]:
    """Signals and unknowns far below a size that was stated; they may also be zero."""
    return _far_below(scales, motion, {STATED})


def _far_below(scales: Scales, motion: InitialGuess, reasons: Set[str]) -> Set[str]:
    """Those of a motion that stay far below sizes for which there are such reasons."""
    phases = [phase.at_fractions(FRACTIONS) for phase in motion.phases.values()]

    def largest(name: str) -> float:
        if name in motion.unknowns:
            return largest_finite(motion.unknowns[name])
        return max(largest_finite(values.get(name, 0.0)) for values in phases)

    given = ((name, size) for name, size, why in _sizes(scales) if why in reasons)
    return {name for name, size in given if ROOMY * largest(name) < size}


def roomy(scales: Scales, of_motion: Scales, factor: float = ROOMY) -> list[str]:
    """Signals and unknowns whose limits gave sizes many times those of a motion, as 1e6 may be."""
    return _many_times(scales, of_motion, _OF_LIMITS, factor)


def stated_roomy(scales: Scales, of_motion: Scales) -> list[str]:
    """Signals and unknowns whose stated sizes are many times those of a motion."""
    return _many_times(scales, of_motion, {STATED}, ROOMY)


def _many_times(scales: Scales, of_motion: Scales, reasons: Set[str], factor: float) -> list[str]:
    """Those whose sizes, for which there are such reasons, are many times those of a motion."""
    sizes = {**of_motion.signals, **of_motion.unknowns}
    return [
        name for name, size, why in _sizes(scales) if why in reasons and size > factor * sizes[name]
    ]


def of_the_motion(scales: Scales, name: str) -> bool:
    """Whether a size is that of a motion, and does not stand for nothing known."""
    return all(why != NOTHING_KNOWN for own, _, why in _sizes(scales) if own == name)


def _sizes(scales: Scales) -> Iterator[tuple[str, float, str]]:
    """Names of signals and unknowns, their sizes, and the reasons of these."""
    for kind, sizes in (("signal", scales.signals), ("unknown", scales.unknowns)):
        for name, size in sizes.items():
            yield name, size, scales.reasons.get((kind, name), "")
