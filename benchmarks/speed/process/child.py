"""One measurement of our own code: `python -m benchmarks.speed.process.child KIND VALUE FILE`.

Seconds are of the wall clock where nothing else is said. `memory` is the peak of the process, and
`imports` what it was when everything was imported [MiB].
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from benchmarks.race.rows.row import memory

Answer = dict[str, Any]
PENDULUM = 1.3  # [s] of motion, as in the paper's Table 1


def growth(intervals: str) -> Answer:
    """Problem B on a fixed uniform mesh."""
    from benchmarks.speed.process.program import force_problem, solve_on_mesh

    return solve_on_mesh(force_problem(), int(intervals))


def modules(number: str) -> Answer:
    """Problem B in 140 s with any number of modules, on a fixed uniform mesh of 100 intervals.

    Friction times modules is the same for all, and the pace such that the large rings, whose
    inertia grows with the cube of their number, can be stopped by a rope that only pulls.
    """
    from benchmarks.speed.process.program import force_problem, solve_on_mesh

    n = int(number)
    return solve_on_mesh(force_problem(n, friction=0.24 / n, duration=140.0), 100)


def elements(number: str) -> Answer:
    """The single pendulum with that many ANCF elements; the first run compiles nothing."""
    from models.ancf.integrate import StepControl, simulate
    from models.ancf.joints import Free
    from models.ancf.state import posed
    from models.arm.parameters import single_pendulum

    imported, begin = memory(), perf_counter()
    chain = single_pendulum(int(number))
    samples = np.linspace(0.0, PENDULUM, 131)
    run = simulate(chain, [Free()], posed(chain), samples, settings=StepControl(tolerance=1e-7))
    whole = perf_counter() - begin

    return {
        "elements": int(number),
        "unknowns": int(run.q.shape[0]),
        "whole": whole,
        "solve": run.statistics.seconds,
        "steps": run.statistics.steps,
        "drift": run.drift / float(run.kinetic.max()),
        "imports": imported,
    }


def arm(duration: str) -> Answer:
    """The big arm's stage of that duration [s]: least peak torque on the reduced model."""
    from studies.arm.config import study_from
    from studies.arm.optimal.solve import solve_stage

    study = study_from({"stage": "big", "duration": float(duration)})
    imported, begin = memory(), perf_counter()
    solve_stage(study.slew, caps=study.caps)  # raises unless converged
    return {"whole": perf_counter() - begin, "imports": imported}


def benchmark(name: str) -> Answer:
    """One of the problems with known optima, default settings."""
    from benchmarks.optima.measure import measure
    from benchmarks.optima.problems import CATALOGUE

    measured, imported = measure(CATALOGUE[name]()), memory()
    record = measured.as_record()
    kept = ("passed", "error", "seconds", "intervals", "rounds", "iterations", "verdict")
    return {key: record[key] for key in kept} | {"imports": imported}


def states(number: str) -> Answer:
    """A heated rod of that many states, default settings."""
    from benchmarks.speed.process.size_problems import heated_rod, solve_whole

    return solve_whole(heated_rod(int(number)))


def phases(number: str) -> Answer:
    """A run through gates in that many phases, default settings."""
    from benchmarks.speed.process.size_problems import slalom, solve_whole

    return solve_whole(slalom(int(number)))


KINDS: dict[str, Callable[[str], Answer]] = {
    "growth": growth,
    "modules": modules,
    "elements": elements,
    "arm": arm,
    "benchmark": benchmark,
    "states": states,
    "phases": phases,
}


def main() -> None:
    """Measure and write."""
    kind, value, path = sys.argv[1:]
    answer = KINDS[kind](value)
    Path(path).write_text(json.dumps({**answer, "memory": memory()}), "utf-8")


if __name__ == "__main__":
    main()
