"""One measurement of our own code in a fresh process: `python -m studies.speed.child KIND X FILE`.

Seconds are of the wall clock where nothing else is said; memory is the peak of the process, and
`imports` what it was when everything was imported [MiB].
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np

from studies.speed.rows.row import memory

Answer = dict[str, Any]
PENDULUM = 1.3  # [s] of motion, as in the paper's Table 1


def growth(intervals: str) -> Answer:
    """Problem B on a fixed uniform mesh."""
    from ocp import Settings

    return _solved(force_problem(), Settings(intervals=int(intervals)))


def modules(number: str) -> Answer:
    """Problem B in 140 s with any number of modules, on a fixed uniform mesh of 100 intervals.

    Friction times modules is the same for all, and the pace such that the large rings, whose
    inertia grows with the cube of their number, can be stopped by a rope that only pulls.
    """
    from ocp import Settings

    n = int(number)
    problem = force_problem(n, friction=0.24 / n, duration=140.0)
    return _solved(problem, Settings(intervals=100))


def _solved(problem: Any, settings: Any) -> Answer:
    """Size of what IPOPT gets; processor seconds of set-up (statement to functions) and solve."""
    from ocp.mesh.initial_guess import start_of
    from ocp.mesh.mesh import Mesh, uniform
    from ocp.nlp.ipopt import run
    from ocp.transcription.packing import decision_vector
    from ocp.transcription.scaling import scales_of
    from ocp.transcription.transcribe import Method, transcribe

    begin, imported = process_time(), memory()
    mesh = Mesh((uniform(settings.intervals, settings.degree),))
    start = start_of(problem, {}, None)
    method = Method(settings.scheme, settings.control_shape)
    built = transcribe(problem, mesh, method, scales_of(problem, start, {}))
    small = built.condensed
    program, x = small.program, decision_vector(built, start, {})[small.columns]
    limits = small.limits(built.columns.evaluate({}), built.rows.evaluate({}))
    for made in ("oracle", "objective_gradient", "constraint_jacobian", "lagrangian_hessian"):
        getattr(program, made)  # kept once made
    set_up = process_time()
    result = run(program, x, *limits, np.zeros(0), settings.ipopt)
    return {
        "intervals": settings.intervals, "unknowns": program.variables, "rows": program.rows,
        "set_up": set_up - begin, "solve": process_time() - set_up,
        "iterations": result.iterations, "status": result.status,
        "objective": result.objective * built.scales.objective, "imports": imported,
    }  # fmt: skip


def force_problem(modules: int = 24, friction: float = 0.01, duration: float = 5.0) -> Any:
    """Problem B of the race, by default, with our model; jerk at most 200/T^3."""
    import dataclasses

    from models.truss import DYNAMIC_SET, rope_force
    from ocp import Bound, Control, Phase, Problem, State
    from studies.speed.rows.row import END, START

    truss = dataclasses.replace(DYNAMIC_SET, pulley_friction=friction, modules=modules)
    cap = 200.0 / duration**3
    angle, speed = State("angle", "rad"), State("speed", "rad/s", lower=0)
    acceleration = State("acceleration", "rad/s^2")
    jerk = Control("jerk", "rad/s^3", lower=-cap, upper=cap)
    force = rope_force(truss, angle.symbol, speed.symbol, acceleration.symbol)
    phase = Phase(
        "deployment",
        dynamics={angle: speed, speed: acceleration, acceleration: jerk},
        initial={angle: START, speed: 0, acceleration: 0},
        final={angle: END, speed: 0, acceleration: 0},
        end=duration,
        bounds=[Bound("rope force", force, "N", lower=0)],
    )
    return Problem("B", (phase,), minimise=phase.peak(force))


def elements(number: str) -> Answer:
    """The single pendulum with that many ANCF elements; the first run compiles nothing."""
    from models.ancf.integrate import StepControl, simulate
    from models.ancf.joints import Free
    from models.ancf.state import posed
    from models.arm.parameters import single_pendulum

    imported = memory()
    begin = perf_counter()
    chain = single_pendulum(int(number))
    run = simulate(
        chain, [Free()], posed(chain), np.linspace(0.0, PENDULUM, 131),
        settings=StepControl(tolerance=1e-7),
    )  # fmt: skip
    whole = perf_counter() - begin
    return {
        "elements": int(number), "unknowns": int(run.q.shape[0]), "whole": whole,
        "solve": run.statistics.seconds, "steps": run.statistics.steps,
        "drift": run.drift / float(run.kinetic.max()), "imports": imported,
    }  # fmt: skip


def arm(duration: str) -> Answer:
    """The big arm's stage of that duration [s]: least peak torque on the reduced model."""
    from studies.arm.config import study_from
    from studies.arm.optimum import solve_stage

    study, imported = study_from({"stage": "big", "duration": float(duration)}), memory()
    begin = perf_counter()
    solve_stage(study.stage, limits=study.limits)  # raises unless converged
    whole = perf_counter() - begin
    return {"whole": whole, "imports": imported}


def benchmark(name: str) -> Answer:
    """One of the problems with known optima, default settings."""
    from studies.benchmarks.catalogue import CATALOGUE
    from studies.benchmarks.measure import measure

    found, imported = measure(CATALOGUE[name]()), memory()
    record = found.as_record()
    kept = ("passed", "error", "seconds", "intervals", "rounds", "iterations", "verdict")
    return {key: record[key] for key in kept} | {"imports": imported}


KINDS: dict[str, Callable[[str], Answer]] = {
    "growth": growth, "modules": modules, "elements": elements, "arm": arm, "benchmark": benchmark,
}  # fmt: skip


def main() -> None:
    """Measure and write."""
    kind, value, path = sys.argv[1:]
    answer = KINDS[kind](value)
    Path(path).write_text(json.dumps({**answer, "memory": memory()}), "utf-8")


if __name__ == "__main__":
    main()
