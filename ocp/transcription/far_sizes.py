"""Sizes that limits or statements gave, and that a motion stays far below.

Limits of plus and minus 1e6, written for none, say nothing of how large a signal is.
"""

from __future__ import annotations

from collections.abc import Set

from ocp.mesh.initial_guess import InitialGuess
from ocp.transcription.scaling import BOUNDS, NOTHING_KNOWN, ROOMY, STATED, Scales
from ocp.transcription.variations import FRACTIONS, largest_finite


def far_below_limits(scales: Scales, motion: InitialGuess) -> Set[str]:
    """Signals that stay far below a size that their limits gave; they may also be zero."""
    return _far_below(scales, motion, BOUNDS)


def far_below_stated(scales: Scales, motion: InitialGuess) -> Set[str]:
    """Signals that stay far below a size that was stated; they may also be zero."""
    return _far_below(scales, motion, STATED)


def _far_below(scales: Scales, motion: InitialGuess, reason: str) -> Set[str]:
    """Signals of a motion that stay far below sizes for which there is such a reason."""
    return {
        name
        for name, size in scales.signals.items()
        if scales.reasons.get(("signal", name)) == reason
        and all(
            ROOMY * largest_finite(phase.at_fractions(FRACTIONS).get(name, 0.0)) < size
            for phase in motion.phases.values()
        )
    }


def roomy(scales: Scales, of_motion: Scales, factor: float = ROOMY) -> list[str]:
    """Signals whose limits gave sizes that are many times those of a motion, as 1e6 may be."""
    return _many_times(scales, of_motion, BOUNDS, factor)


def stated_roomy(scales: Scales, of_motion: Scales) -> list[str]:
    """Signals whose stated sizes are many times those of a motion."""
    return _many_times(scales, of_motion, STATED, ROOMY)


def _many_times(scales: Scales, of_motion: Scales, reason: str, factor: float) -> list[str]:
    """Signals whose sizes, for which there is such a reason, are many times those of a motion."""
    return [
        name
        for name, size in scales.signals.items()
        if scales.reasons.get(("signal", name)) == reason
        and size > factor * of_motion.signals[name]
    ]


def of_the_motion(scales: Scales, signal: str) -> bool:
    """Whether the size of a signal is that of a motion, and does not stand for nothing known."""
    return scales.reasons.get(("signal", signal)) != NOTHING_KNOWN
