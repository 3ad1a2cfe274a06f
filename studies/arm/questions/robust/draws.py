"""Arms that are drawn from the spread: what motions leave them with, and how often it is too much.

They move on B21, all abreast: the integration is mapped over them.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence

import numpy as np

from ocp.arrays import Array
from studies.arm.config import RobustStudy
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.questions.robust.spread import Spread
from studies.arm.replay.full_model import Motion
from studies.arm.replay.reduced_model import Factors, residuals
from studies.common.console import Console
from studies.common.processes.side_by_side import Part, side_by_side
from studies.common.rates import Rate, rate
from studies.common.result import Series


def energies_of_draws(
    motions: Sequence[OptimalMotion], spread: Spread, study: RobustStudy, console: Console
) -> dict[str, Array]:
    """E_res [J] of each arm that is drawn, (draws,), by name of the motion; empty without draws."""
    if study.draws == 0:
        return {}
    factors = spread.drawn(study.draws, study.seed)
    parts = [Part(_left, (motion.motion(study.drive), factors)) for motion in motions]
    names = [motion.name for motion in motions]
    return dict(zip(names, side_by_side(parts, console), strict=True))


def _left(given: Motion, factors: Sequence[Factors], console: Console) -> Array:
    """What one motion leaves the arms with [J]."""
    begin = time.process_time()
    energies = residuals(given, factors, live=console.live)
    seconds = time.process_time() - begin
    console.progress(f"{given.name}: {len(factors)} arms drawn, {seconds:.1f} s of processor")
    return energies


def rates_of(left: Mapping[str, Array], study: RobustStudy) -> dict[str, Rate]:
    """How many of the drawn arms are left with more than is allowed, by motion."""
    return {
        name: rate(int((energies > study.allowed_energy).sum()), energies.size, study.confidence)
        for name, energies in left.items()
    }


def rates_in_words(left: Mapping[str, Array], study: RobustStudy) -> tuple[str, ...]:
    """The same as a remark."""
    found = rates_of(left, study)
    if not found:
        return ("no arms were drawn",)
    each = ", ".join(f"'{name}' leaves more in {one.words}" for name, one in found.items())
    return (
        f"{study.draws} arms drawn evenly from the spread, on B21, {study.allowed_energy:g} J "
        f"allowed: {each}; in brackets: where the true rate lies, with a confidence of "
        f"{100 * study.confidence:g} %",
    )


def draw_series(left: Mapping[str, Array]) -> dict[str, Series]:
    """The energies that the drawn arms are left with, from the least to the most."""
    arrays = {
        f"{name}: draws": Series("J", "draws", np.sort(energies), "E_res, in order")
        for name, energies in left.items()
    }
    for energies in left.values():
        shares = np.arange(1.0, energies.size + 1) / energies.size
        arrays["draws"] = Series("1", "draws", shares, "share of the arms that were drawn")
    return arrays
