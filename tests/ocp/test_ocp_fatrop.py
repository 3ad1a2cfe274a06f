"""Programs in stages, and fatrop beside IPOPT."""

import casadi as ca
import numpy as np
import pytest

from ocp import (
    Between,
    Bound,
    Control,
    IpoptOptions,
    Mesh,
    Phase,
    Problem,
    Settings,
    State,
    StatementError,
    Unknown,
    peak,
    solve,
)  # fmt: skip
from ocp.fatrop import MOST_STAGES
from ocp.mesh.initial_guess import start_of
from ocp.mesh.mesh import Extra, PhaseMesh, uniform
from ocp.stages import in_stages
from ocp.transcription.scaling import scales_of
from ocp.transcription.transcribe import Method, transcribe

WITH_FATROP = pytest.mark.skipif(not ca.has_nlpsol("fatrop"), reason="this CasADi has no fatrop")


def two_phases():
    """A problem whose phases share a time, a parameter and a peak."""
    x, v, u = State("x"), State("v"), Control("u", lower=-3, upper=3)
    mass, change = Unknown("mass", lower=0.5, upper=2), Between(0.5, 2)
    rates = {x: v * ca.cos(x), v: u / mass - 0.1 * v**2}
    first = Phase(
        "first", rates, initial={x: 0, v: 1}, end=change, bounds=[Bound("power", u * v, upper=5)]
    )
    second = Phase("second", rates, final={x: 1}, start=change, end=3)
    link = Bound("link", second.at_start(x) - first.at_end(x), lower=0, upper=0)
    effort = first.integral(u**2) + second.integral(u**2 * x) ** 2
    return Problem(
        "two phases", [first, second], links=[link],
        minimise=effort + peak((first, v**2), (second, v**2)) + mass * first.end_time,
    )  # fmt: skip


def transcribed(name):
    problem = two_phases()
    meshes = (PhaseMesh(np.array([0, 0.3, 0.5, 1]), np.array([3, 4, 3]), (1,)), uniform(2, 3))
    extra = ((Extra(0, np.array([0, 2]), np.array([0.3, 1.0])),), ())
    scales = scales_of(problem, start_of(problem, {}), {})
    return transcribe(problem, Mesh(meshes, extra), Method(name), scales)


@pytest.mark.parametrize("name", ["radau", "gauss", "lobatto"])
def test_stages_hold_the_same_functions(name):
    made = transcribed(name)
    stages, program = in_stages(made.blocks, made.layouts, made.program), made.program
    at = np.random.default_rng(3).uniform(0.2, 1.0, program.variables)
    f, g = (np.array(v).ravel() for v in stages.program.oracle(at[stages.variables], []))
    expected = [np.array(v).ravel() for v in program.oracle(at, [])]
    np.testing.assert_allclose(f, expected[0], rtol=1e-13)
    np.testing.assert_allclose(g[stages.rows], expected[1], rtol=1e-13, atol=1e-12)
    links = np.setdiff1d(np.arange(stages.program.rows), stages.rows)
    np.testing.assert_array_equal(g[links], 0.0)
    assert links.size == stages.linked.sum() == stages.states.sum()
    np.testing.assert_array_equal(stages.plain(at[stages.variables]), at)


@pytest.mark.parametrize("name", ["radau", "gauss", "lobatto"])
def test_no_row_reaches_beyond_its_stage(name):
    made = transcribed(name)
    stages = in_stages(made.blocks, made.layouts, made.program)
    rows, columns = stages.program.constraint_jacobian.sparsity_out(1).get_triplet()
    following = np.append(stages.states[1:], 0)
    row_stage = np.repeat(np.arange(following.size), following + stages.paths)[rows]
    offsets = np.concatenate([[0], np.cumsum(stages.states + stages.controls)])
    column_stage = np.searchsorted(offsets, columns, side="right") - 1
    own = np.isin(rows, stages.rows)
    np.testing.assert_array_equal(column_stage[own], row_stage[own])
    ahead = column_stage[~own] - row_stage[~own]
    assert set(ahead.tolist()) == {0, 1}


def ride():
    x, v, a = State("x"), State("v", upper=1.8), State("a")
    jerk = Control("jerk", lower=-80, upper=80)
    phase = Phase(
        "ride", {x: v, v: a, a: jerk}, initial={x: 0, v: 0, a: 0}, final={x: 1, v: 0, a: 0},
        end=1.0,
    )  # fmt: skip
    return Problem("ride", phase, minimise=peak((phase, a), absolute=True))


def solved(solver, intervals=8):
    return solve(ride(), settings=Settings(refine=False, intervals=intervals, solver=solver))


@WITH_FATROP
def test_fatrop_finds_what_ipopt_finds():
    fast, usual = solved("fatrop"), solved("ipopt")
    assert [r.solver for r in fast.record] == ["fatrop"]
    assert [r.solver for r in usual.record] == ["ipopt"]
    # both stop at a complementarity of 1e-8 or less
    assert fast.objective == pytest.approx(usual.objective, rel=1e-7)
    masses = [sum(p.masses.sum() * p.sign for p in s.multipliers.paths if p.is_peak)
              for s in (fast, usual)]  # fmt: skip
    assert masses[0] == pytest.approx(masses[1], abs=1e-6)
    total = sum(p.masses.sum() for p in fast.multipliers.paths if p.is_peak)
    assert total == pytest.approx(1.0, abs=1e-6)


@WITH_FATROP
def test_ipopt_takes_over_where_fatrop_fails(monkeypatch):
    monkeypatch.setattr("ocp.fatrop._MOST_ITERATIONS", 2)
    assert [r.solver for r in solved("fatrop").record] == ["ipopt"]


def test_ipopt_takes_over_where_fatrop_is_missing(monkeypatch, caplog):
    monkeypatch.setattr(ca, "has_nlpsol", lambda name: False)
    assert [r.solver for r in solved("fatrop").record] == ["ipopt"]
    assert "has no fatrop" in caplog.text


def test_many_intervals_go_to_ipopt(monkeypatch):
    monkeypatch.setattr("ocp.fatrop.MOST_STAGES", 7)
    assert MOST_STAGES > 7
    assert [r.solver for r in solved("fatrop").record] == ["ipopt"]


def test_an_unknown_solver_is_refused():
    with pytest.raises(StatementError, match="'snopt'; choose ipopt or fatrop"):
        Settings(solver="snopt")


@pytest.mark.parametrize(
    ("option", "value", "answer"),
    [
        ("linear_solver", "ma28", "the linear solver is 'ma28'; choose one of mumps, spral"),
        ("barrier", "fast", "the barrier is 'fast'; choose one of monotone, adaptive"),
        ("line_search", "wolfe", "the line search is 'wolfe'; choose one of filter, cg-penalty"),
    ],
)
def test_an_unknown_choice_is_refused(option: str, value: str, answer: str):
    with pytest.raises(StatementError, match=answer):
        IpoptOptions(**{option: value})


def test_the_other_line_search_finds_the_same_optimum():
    settings = Settings(refine=False, intervals=8, ipopt=IpoptOptions(line_search="cg-penalty"))
    found = solve(ride(), settings=settings)
    assert found.objective == pytest.approx(solved("ipopt").objective, rel=1e-8)


def test_a_missing_linear_solver_is_named(monkeypatch):
    # as IPOPT answers where the library of a linear solver cannot be loaded
    real = ca.nlpsol

    class Missing:
        def __init__(self, *arguments):
            self.solver = real(*arguments)

        def __call__(self, **arguments):
            return self.solver(**arguments)

        def stats(self):
            return {**self.solver.stats(), "return_status": "Invalid_Option"}

    monkeypatch.setattr(ca, "nlpsol", Missing)
    with pytest.raises(StatementError, match="linear solver 'mumps' here; install it"):
        solved("ipopt")
