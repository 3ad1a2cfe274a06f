"""pycollo: SymPy statement, Lobatto collocation; the peak is a parameter."""

import numpy as np
import problems
import pycollo
import row
import sympy

IMPORTED = row.now()
SIZE = {"A": 200, "B": 40}  # sections of the mesh
MESHES = 1  # its own refinement goes on for minutes and comes no closer


def where(condition, this, other):
    """The net is slack where the peak is; a branch in SymPy is more than pycollo differentiates."""
    return 0


def statement(problem, n):
    """The problem in pycollo's terms."""
    angle, speed, acc, jerk, peak = sympy.symbols("angle speed acc jerk peak")
    ocp = pycollo.OptimalControlProblem(name=problem)
    phase = ocp.new_phase(name=problem)
    phase.state_variables = [angle, speed, acc]
    phase.control_variables = jerk
    phase.state_equations = {angle: speed, speed: acc, acc: problems.UNIT_JERK[problem] * jerk}
    ocp.parameter_variables = [peak]
    ocp.objective_function = peak

    if problem == "A":
        phase.path_constraints = [
            peak - acc / problems.UNIT_ACCELERATION,
            peak + acc / problems.UNIT_ACCELERATION,
        ]
    else:
        force = problems.unit_force(sympy, where, angle, speed, acc)
        phase.path_constraints = [peak - force, force]

    slowest = 0 if problem == "B" else -10
    bounds = phase.bounds
    bounds.initial_time, bounds.final_time = 0.0, 1.0
    bounds.state_variables = {angle: [0.03, 2], speed: [slowest, 10], acc: [-50, 50]}
    bounds.control_variables = {jerk: [-1, 1]}
    bounds.path_constraints = [[0, 100], [0, 100]]
    bounds.initial_state_constraints = {angle: problems.START, speed: 0, acc: 0}
    bounds.final_state_constraints = {angle: problems.END, speed: 0, acc: 0}

    phase.guess.time = np.array([0.0, 1.0])
    phase.guess.state_variables = np.array([[problems.START, problems.END], [0, 0], [0, 0]])
    phase.guess.control_variables = np.array([[0, 0]])
    phase.mesh.number_mesh_sections = n
    ocp.bounds.parameter_variables = {peak: [0, 100]}
    ocp.guess.parameter_variables = np.array([2.0])

    ocp.settings.display_mesh_result_graph = False
    ocp.settings.display_mesh_result_info = False
    ocp.settings.console_out_progress = False
    ocp.settings.max_mesh_iterations = MESHES
    return ocp


def solve(problem, size):
    """Return edges, places in a section, the jerk there, and a note."""
    ocp = statement(problem, size or SIZE[problem])
    ocp.initialise()
    ocp.solve()

    # The jerk in a section is one of its polynomials: its values at Chebyshev points tell it.
    solution = ocp.solution
    tau, polynomials = solution.tau[0], solution.phase_polys[0].u[0]
    edges = tau[solution.it.mesh.mesh_index_boundaries[0]]
    edges = (edges - edges[0]) / (edges[-1] - edges[0])
    degree = max(p.degree() for p in polynomials)
    places = (1 - np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))) / 2
    jerk = [p(p.domain[0] + (p.domain[1] - p.domain[0]) * places) for p in polynomials]
    times, jerks = problems.in_si_units(problem, edges, np.array(jerk))
    return times, places, jerks, f"{ocp.num_mesh_iterations} mesh"


if __name__ == "__main__":
    *control, words = solve(*row.asked())
    row.answer(IMPORTED, *control, note=words)
