"""The program without the inner states of chains against the plain one."""

import numpy as np
import pytest

from ocp import Constant, Control, IpoptOptions, Phase, Problem, Settings, State
from ocp.mesh.initial_guess import start_of
from ocp.mesh.mesh import Mesh, PhaseMesh, uniform
from ocp.nlp.ipopt import Duals, run
from ocp.problem.integrator_chains import links
from ocp.problem.symbols import Between
from ocp.refinement.loop import method_of
from ocp.transcription.courses import MOST_INTERVALS
from ocp.transcription.kernels import evaluated
from ocp.transcription.packing import decision_vector
from ocp.transcription.scaling import scales_of
from ocp.transcription.transcribe import transcribe

MESHES = {
    "fixed": PhaseMesh(np.linspace(0, 1, 9), np.array([4, 4, 5, 4, 6, 4, 4, 4])),
    "moving": PhaseMesh(np.linspace(0, 1, 9), np.full(8, 5), (3, 6)),
}
GAIN = Constant("gain", value=0.8)


def least_peak(shape="linear"):
    """Rest to rest in 2 s with the least acceleration; jerk and speed limited."""
    x, v, a = State("x", "m"), State("v", "m/s", upper=0.95), State("a", "m/s^2")
    j = Control("j", "m/s^3", lower=-20, upper=20, shape=shape)
    phase = Phase(
        "move", dynamics={x: v, v: a, a: j}, initial={x: 0, v: 0, a: 0},
        final={x: 1, v: 0, a: 0}, end=2.0,
    )  # fmt: skip
    return Problem("least peak", phase, minimise=phase.peak(a, absolute=True))


def drifting(end=2.5):
    """A chain with a named factor and an offset beside a state that is none."""
    x, v, e = State("x", "m"), State("v", "m/s", lower=-1, upper=0.7), State("e", "J")
    u = Control("u", "m/s^2", lower=-2, upper=2, shape="constant")
    phase = Phase(
        "move", dynamics={x: v, v: GAIN.symbol * u - 0.1, e: v**2 + 0.1 * e},
        initial={x: 0, v: 0, e: 0}, final={x: 1, v: 0, e: (0, 0.5)}, end=end,
        guess={x: (np.array([0.0, 1.0]), np.array([0.0, 1.0]))},
    )  # fmt: skip
    return Problem("drifting", phase, minimise=phase.at_end(e))


PROBLEMS = {"peak": least_peak, "steps": lambda: least_peak("constant"), "drift": drifting}


def transcribed(problem, phase_mesh):
    values = {c.name: float(c.value) for c in problem.constants}
    start = start_of(problem, values, None)
    made = transcribe(
        problem, Mesh((phase_mesh,)), method_of(Settings()), scales_of(problem, start, values)
    )
    return made, decision_vector(made, start, values), values


@pytest.fixture(scope="module", params=[(p, m) for p in PROBLEMS for m in MESHES], ids="-".join)
def solved(request):
    """Transcription, limits, constants, the condensed solution as found and expanded."""
    problem, mesh = request.param
    made, x0, values = transcribed(PROBLEMS[problem](), MESHES[mesh])
    limits = made.columns.evaluate(values), made.rows.evaluate(values)
    constants, small = np.array(list(values.values())), made.condensed
    found = run(
        small.program, x0[small.columns], *small.limits(*limits), constants, Settings().ipopt
    )
    assert found.outcome == "solved"
    return made, limits, constants, found, small.expanded(found, limits[0], constants)


def test_fewer_unknowns(solved):
    made = solved[0]
    assert made.condensed.program.variables < 0.75 * made.program.variables
    assert made.condensed.program.rows < 0.85 * made.program.rows


def test_the_plain_program_stays_there(solved):
    made, limits, constants, _, expanded = solved
    known = Duals(expanded.bound_multipliers, expanded.row_multipliers)
    again = run(made.program, expanded.x, *limits, constants, Settings().ipopt, multipliers=known)
    assert again.outcome == "solved"
    assert again.iterations <= 5
    assert again.objective == pytest.approx(expanded.objective, rel=1e-8)


def test_the_plain_equations_hold(solved):
    made, limits, constants, _, expanded = solved
    rows = evaluated(made.blocks, expanded.x, constants, made.rows.count)[1]
    assert rows == pytest.approx(expanded.rows, abs=1e-9)
    assert np.all(rows >= limits[1][0] - 1e-9)
    assert np.all(rows <= limits[1][1] + 1e-9)
    assert np.all(expanded.x >= limits[0][0] - 1e-9)
    assert np.all(expanded.x <= limits[0][1] + 1e-9)


def test_the_multipliers_are_those_of_the_plain_program(solved):
    made, limits, constants, _, expanded = solved
    gradient = made.program.objective_gradient(expanded.x, constants)[1].full().ravel()
    jacobian = made.program.constraint_jacobian(expanded.x, constants)[1].sparse()
    slope = gradient + jacobian.T @ expanded.row_multipliers + expanded.bound_multipliers
    free = limits[0][0] < limits[0][1]
    assert np.abs(slope[free]).max() < 1e-8
    assert np.abs(expanded.row_multipliers).max() > 0.1


def test_multipliers_there_and_back(solved):
    made, _, constants, found, expanded = solved
    known = Duals(expanded.bound_multipliers, expanded.row_multipliers)
    again = made.condensed.duals(known, expanded.x, constants)
    assert again.rows == pytest.approx(found.row_multipliers, abs=1e-9)
    assert again.columns == pytest.approx(found.bound_multipliers, abs=1e-12)


def test_a_failed_run_shows_in_the_rows_of_the_dynamics():
    made, x0, values = transcribed(least_peak(), MESHES["fixed"])
    small, limits = made.condensed, (made.columns.evaluate(values), made.rows.evaluate(values))
    short = run(
        small.program, x0[small.columns], *small.limits(*limits), np.zeros(0),
        IpoptOptions(max_iterations=0),
    )  # fmt: skip
    expanded = small.expanded(short, limits[0], np.zeros(0))
    rows = evaluated(made.blocks, expanded.x, np.zeros(0), made.rows.count)[1]
    assert expanded.rows == pytest.approx(rows, abs=1e-12)
    assert np.all(expanded.x <= limits[0][1])


def test_links_follow_drivers_and_leave_the_rest():
    problem = drifting()
    (phase,) = problem.phases
    (control,) = problem.signals_of(phase, Control)
    found = links(phase, ((control, 0),))
    assert [(s.name, k.driver.name, k.degree) for s, k in found.items()] == [
        ("v", "u", 1), ("x", "v", 2),
    ]  # fmt: skip


def test_without_chains_the_program_is_the_plain_one():
    x, u = State("x"), Control("u", lower=-1, upper=1)
    phase = Phase("p", dynamics={x: -x + u}, initial={x: 1}, final={x: 0}, end=3.0)
    problem = Problem("no chain", phase, minimise=phase.integral(u**2))
    made, *_ = transcribed(problem, MESHES["fixed"])
    assert made.condensed.program is made.program


@pytest.mark.parametrize(("more", "plain"), [(0, False), (1, True)])
def test_on_many_intervals_the_program_is_the_plain_one(more: int, plain: bool):
    made, *_ = transcribed(drifting(), uniform(MOST_INTERVALS + more, 4))
    assert (made.condensed.program is made.program) == plain


def test_in_free_time_the_program_is_the_plain_one():
    made, *_ = transcribed(drifting(Between(0.5, 5)), MESHES["fixed"])
    assert made.condensed.program is made.program
