"""A problem's nonlinear program, built and solved on one fixed mesh.

The parts that time the building alone look below the engine's verb `solve`. All that they import
of its inside is imported here.
"""

from __future__ import annotations

import dataclasses
from time import process_time
from typing import Any

from benchmarks.race.rows.problems import END, START
from benchmarks.race.rows.row import memory
from models.truss import DYNAMIC_SET, rope_force
from ocp import Bound, Control, Phase, Problem, Settings, State
from ocp.mesh.initial_guess import initial_guess
from ocp.mesh.mesh import Mesh, uniform
from ocp.nlp.solver import StartingPoint
from ocp.problem.parameters import parameters_of
from ocp.scaling.automatic import scales_of
from ocp.transcription.packing import decision_vector
from ocp.transcription.transcribe import transcribe

FUNCTIONS = ("oracle", "objective_gradient", "constraint_jacobian", "lagrangian_hessian")


def force_problem(modules: int = 24, friction: float = 0.01, duration: float = 5.0) -> Problem:
    """Return problem B of the race, by default, with our model; jerk at most 200/T^3.

    Parameters
    ----------
    modules : int
        Of the truss.
    friction : float
        Of the pulleys [-].
    duration : float
        [s].
    """
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


def build(problem: Problem, intervals: int) -> Any:
    """Transcribe a problem on a uniform mesh of default degree, shared evenly by its phases."""
    settings = Settings()
    phases = len(problem.phases)
    degree, parameters = settings.scheme.degree, parameters_of(problem)
    mesh = Mesh(tuple(uniform(intervals // phases, degree) for _ in range(phases)))
    scales = scales_of(problem, initial_guess(problem, parameters), parameters)
    return transcribe(problem, mesh, settings.scheme, settings.controls, scales)


def solve_on_mesh(problem: Problem, intervals: int) -> dict[str, Any]:
    """Return size of what IPOPT gets, processor seconds of set-up and solve, and the outcome.

    Set-up is everything from the statement to the functions that IPOPT calls.
    """
    settings = Settings(intervals=intervals)
    begin, imported = process_time(), memory()

    transcription = build(problem, intervals)
    program, parameters = transcription.program, parameters_of(problem)
    guess = initial_guess(problem, parameters)
    limits = transcription.limits(parameters)
    start = StartingPoint(decision_vector(transcription, guess, limits, parameters.vector))

    # Functions are made when first asked for, and kept: ask now, or the solve would pay for them.
    for function in FUNCTIONS:
        getattr(program, function)
    ready = process_time()

    result = settings.solver.solve(program, start, limits, parameters.vector)
    return {
        "intervals": intervals,
        "unknowns": program.variables,
        "rows": program.rows,
        "set_up": ready - begin,
        "solve": process_time() - ready,
        "iterations": result.iterations,
        "status": result.status,
        "objective": result.objective * transcription.scales.objective,
        "imports": imported,
    }
