"""Sobol indices: which share of a quantity's variance each key causes, by SALib.

The first-order index is the share that a key causes alone, the total index that in which it takes
part. Saltelli's points are drawn so that both follow from N (D + 2) cases of D keys.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ocp.arrays import Array
from studies.common.exit_codes import StudyError

CONFIDENCE = 0.95  # of the intervals, by bootstrap


def saltelli_points(keys: Sequence[str], samples: int, seed: int) -> Array:
    """Saltelli's points in the unit cube, shape (samples (keys + 2), keys).

    Raises
    ------
    StudyError
        If SALib is not installed, or the number of samples is no power of two.
    """
    if samples & (samples - 1):
        raise StudyError(
            f"samples is {samples}; Sobol indices need a power of two, such as "
            f"{1 << samples.bit_length()}"
        )
    try:
        from SALib.sample import sobol
    except ImportError as error:
        raise StudyError(
            "sampling 'sobol-indices' needs SALib, which is not installed; install it with: "
            "pip install 'antenna-ocp[scale]'"
        ) from error
    points: Array = sobol.sample(_problem(keys), samples, calc_second_order=False, seed=seed)
    return points


def sobol_indices(
    keys: Sequence[str], quantities: Mapping[str, Array], seed: int
) -> tuple[dict[str, dict[str, Any]], str]:
    """First-order and total indices of each quantity with their intervals, and what to say of them.

    Parameters
    ----------
    keys : sequence of str
        That vary.
    quantities : mapping of name to array
        Values of all cases in the order of `saltelli_points`; nan where a case has no solution.
    seed : int
        Of the bootstrap.

    Returns
    -------
    tuple
        By quantity: `first`, `first_interval`, `total`, `total_interval`, each by key; and a
        sentence, empty where all is well.
    """
    from SALib.analyze import sobol

    found, lacking = {}, 0
    for name, values in quantities.items():
        missing = int(np.count_nonzero(~np.isfinite(values)))
        if missing:  # a row less, and the others would not fit each other
            lacking = max(lacking, missing)
            continue
        if np.ptp(values) <= 1e-9 * np.abs(values).max():
            continue  # it does not vary, so that nothing causes a share
        told = sobol.analyze(
            _problem(keys), values, calc_second_order=False, conf_level=CONFIDENCE, seed=seed
        )
        found[name] = {
            part: dict(zip(keys, map(float, told[column]), strict=True))
            for part, column in (
                ("first", "S1"),
                ("first_interval", "S1_conf"),
                ("total", "ST"),
                ("total_interval", "ST_conf"),
            )
        }
    sentence = ""
    if lacking:
        sentence = (
            f"{lacking} cases have no solution, so that some quantities have no Sobol indices; "
            "narrow the ranges until each case has one."
        )
    return found, sentence


def _problem(keys: Sequence[str]) -> dict[str, Any]:
    """The unit cube, as SALib states it; the values of the keys are made of its points."""
    return {"num_vars": len(keys), "names": list(keys), "bounds": [[0.0, 1.0]] * len(keys)}
