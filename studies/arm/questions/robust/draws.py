"""Arms that are drawn from the spread: how often motions leave them with too much."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ocp.arrays import Array
from studies.arm.config import RobustStudy
from studies.common.rates import Rate, rate
from studies.common.result import Series


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
    each = ", ".join(
        f"'{name}' has more residual energy in {one.words}" for name, one in found.items()
    )
    return (
        f"{study.draws} arms drawn uniformly from the range, on B21, {study.allowed_energy:g} J "
        f"allowed: {each}; in brackets: the confidence interval of the rate, at "
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
