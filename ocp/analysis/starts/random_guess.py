"""Random starts of a problem, as trajectories."""

from __future__ import annotations

import numpy as np

from ocp.mesh.initial_guess import initial_guess
from ocp.mesh.mesh import Mesh, uniform
from ocp.mesh.trajectory import Trajectory
from ocp.mesh.wavy_guess import wavy_guess
from ocp.problem.parameters import parameters_of
from ocp.problem.problem import Problem
from ocp.scaling.automatic import scales_of
from ocp.settings import Settings, first_intervals
from ocp.transcription.packing import decision_vector, trajectory_of
from ocp.transcription.transcribe import transcribe


def random_trajectory(
    problem: Problem, settings: Settings, random: np.random.Generator
) -> Trajectory:
    """A random start of a problem, on a uniform mesh: waves around its stated guess."""
    parameters = parameters_of(problem)
    stated = initial_guess(problem, parameters)
    scales = scales_of(problem, stated, parameters)
    guess = wavy_guess(problem, parameters, stated, scales.signals, scales.unknowns, random)

    # as a trajectory it can be sent to another process
    intervals = first_intervals(settings, problem)
    mesh = Mesh(tuple(uniform(count, settings.scheme.degree) for count in intervals))
    program = transcribe(problem, mesh, settings.scheme, settings.controls, scales)
    x = decision_vector(program, guess, program.limits(parameters), parameters.vector)
    return trajectory_of(program, np.nan_to_num(x), parameters)
