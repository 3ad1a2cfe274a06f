"""What one run of the solver finds on a mesh, without refinement and without a replay."""

from ocp import Ipopt, Settings
from ocp.mesh.initial_guess import initial_guess
from ocp.nlp.solver import StartingPoint
from ocp.optimality.iterate import iterate_of
from ocp.problem.parameters import parameters_of
from ocp.scaling.automatic import scales_of
from ocp.transcription.packing import decision_vector, trajectory_of
from ocp.transcription.transcribe import transcribe


def iterate_on(mesh, problem, scheme=None, solver=None):
    """The iterate of one run that has to succeed."""
    parameters = parameters_of(problem)
    guess = initial_guess(problem, parameters)
    scales = scales_of(problem, guess, parameters)
    made = transcribe(problem, mesh, scheme or Settings().scheme, "automatic", scales)
    limits = made.limits(parameters)
    start = StartingPoint(decision_vector(made, guess, limits, parameters.vector))
    result = (solver or Ipopt()).solve(made.program, start, limits, parameters.vector)
    assert result.outcome == "solved"
    return iterate_of(made, result, trajectory_of(made, result.x, parameters))
