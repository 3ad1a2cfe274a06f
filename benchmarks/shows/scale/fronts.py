"""What the shows of fronts share: their cases, what is kept, and cold starts beside a front."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shows.show import Question
from studies.common.console import silent
from studies.common.drawing import save
from studies.common.folder import ResultsFolder
from studies.common.result import Result
from studies.pareto.figures import draw


def study_of(cases: Sequence[Mapping[str, Any]], index: int) -> Question:
    """The study of a case; nothing is drawn, whatever the seed."""
    return {"study": cases[index % len(cases)]}


def keep(result: Result, folder: Path) -> None:
    """Write a front and its figures into the folder of its case."""
    result.save(folder)
    save(draw(result), ResultsFolder(folder), silent())


def found_cold(find: Callable[[], float], failure: type[Exception]) -> tuple[float, float]:
    """What a cold start finds, and its seconds of the processor [s].

    Parameters
    ----------
    find : gives the value; it solves in this process, since others are not timed.
    failure : what it raises where there is none; the value is then nan.
    """
    begin = time.process_time()
    try:
        value = find()
    except failure:
        value = math.nan
    return value, time.process_time() - begin


def times_faster(seconds: Sequence[float], count: int, walked: float) -> float:
    """How many times longer than a front as many cold starts as its points would take.

    Parameters
    ----------
    seconds : of some cold starts [s].
    count : points of the front.
    walked : all seconds of the front [s].
    """
    return float(np.mean(seconds) * count / walked)
