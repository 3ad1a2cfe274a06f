"""Programs: derivatives by kernels, rows by names of the statement, and solvers that are kept."""

import gc
import weakref

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ocp import (
    Algebraic,
    Between,
    Bound,
    Control,
    Gauss,
    HermiteSimpson,
    Ipopt,
    Lobatto,
    Mesh,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    Unknown,
    joined,
    peak,
    prepare,
)
from ocp.mesh.mesh import ExtraPoints, PhaseMesh, uniform
from ocp.nlp.failures import row_kinds
from ocp.nlp.kept import KeptSolver
from ocp.nlp.solver import Listener, NlpResult, StartingPoint
from ocp.problem.parameters import parameters_of
from ocp.transcription.kernels import Block, Kernel, Program
from ocp.transcription.transcribe import ProgramLimits, Transcription, transcribe
from tests.ocp.problems import race, scales_around_the_guess

ROUND_OFF = 1e-13  # the same sums in another order


def kernel(variables, numbers, rows):
    """A smooth nonlinear kernel with coupled variables."""
    w, d, c = ca.SX.sym("w", variables), ca.SX.sym("d", numbers), ca.SX.sym("c", 1)
    y = [w[0] + d[1] * w[-1], d[0] * ca.sum1(w)]
    mixed = (
        ca.sin(y[0] * y[1]) * c[0]
        + ca.sin(w[0] * w[-1])
        + ca.exp(0.3 * w[variables // 2]) * c[0]
        + d[0] * w[0] ** 3
    )
    row = [ca.cos(i + w[i % variables]) * w[(i + 1) % variables] + mixed for i in range(rows)]
    outputs = [d[0] * mixed**2 + y[0] ** 2, ca.vertcat(*row)]
    return Kernel(ca.Function("kernel", [w, d, c], outputs))


def block(columns, rows, seed=0):
    columns, rows = np.array(columns), np.array(rows)
    data = np.random.default_rng(seed).uniform(0.5, 1.5, (len(columns), 2))
    made = kernel(columns.shape[1], 2, rows.shape[1])
    return Block("b", made, columns, data, rows)


def directly(blocks, variables, rows):
    """The same program written out instance by instance."""
    x, p = ca.MX.sym("x", variables), ca.MX.sym("p", 1)
    f, g = ca.MX(0), [ca.MX(0)] * rows
    for b in blocks:
        for columns, data, ids in zip(b.columns, b.data, b.rows, strict=True):
            df, dg = b.kernel.function(x[columns.tolist()], ca.DM(data), p)
            f += df
            for i, row in enumerate(ids):
                g[row] += dg[i]
    return x, p, f, ca.vertcat(*g)


def by_casadi(x, p, f, g):
    """Objective, rows and their derivatives as CasADi finds them."""
    sigma, lam = ca.MX.sym("sigma"), ca.MX.sym("lam", g.numel())
    hessian = ca.triu(ca.hessian(sigma * f + ca.dot(lam, g), x)[0])
    found = [f, g, ca.gradient(f, x), ca.jacobian(g, x), hessian]
    return ca.Function("own", [x, p, sigma, lam], found)


def compare(blocks, variables, rows, seed=1):
    program = Program(tuple(blocks), variables, rows, 1)
    x, p, f, g = directly(blocks, variables, rows)
    own = by_casadi(x, p, f, g)
    random = np.random.default_rng(seed)
    at, dual = random.uniform(-1, 1, variables), random.uniform(-1, 1, rows)
    expected = [v.full() for v in own(at, 0.7, 1.3, dual)]
    found = [
        program.oracle(at, 0.7)[0],
        program.oracle(at, 0.7)[1],
        program.objective_gradient(at, 0.7)[1],
        program.constraint_jacobian(at, 0.7)[1],
        program.lagrangian_hessian(at, 0.7, 1.3, dual),
    ]
    names = ("f", "g", "gradient", "Jacobian", "Hessian")
    for what, ours, theirs in zip(names, found, expected, strict=True):
        np.testing.assert_allclose(
            np.array(ours), theirs, rtol=ROUND_OFF, atol=ROUND_OFF * 10, err_msg=what
        )


CHAIN = block([[0, 1, 5], [1, 2, 5], [2, 3, 5]], [[0, 1], [2, 3], [4, 5]])
OVERLAPS = {
    "none": ([block([[0, 1], [2, 3]], [[0], [1]])], 4, 2),
    "instances and blocks": ([CHAIN, block([[4, 0], [4, 5]], [[6], [7]], seed=3)], 6, 8),
    "a column twice": ([block([[0, 1, 0], [2, 2, 2], [1, 2, 0]], [[0], [1], [2]])], 3, 3),
    "rows": ([block([[0, 1], [1, 2], [2, 0]], [[0, 1], [0, 1], [1, 0]])], 3, 2),
    "unordered columns": ([block([[5, 2, 4], [3, 1, 0]], [[1], [0]])], 6, 2),
}


@pytest.mark.parametrize(("blocks", "variables", "rows"), OVERLAPS.values(), ids=OVERLAPS)
def test_columns_and_rows_that_instances_share(blocks, variables, rows):
    compare(blocks, variables, rows)


index = st.integers(0, 4)


@given(
    columns=st.lists(st.tuples(index, index, index), min_size=1, max_size=4),
    rows=st.lists(st.tuples(st.integers(0, 3), st.integers(0, 3)), min_size=4, max_size=4),
)
def test_any_overlap(columns, rows):
    compare([block(columns, rows[: len(columns)])], 5, 4)


def small_problem():
    """Two phases with everything that makes columns shared: free times, unknown, peak, link."""
    x, v, u = State("x"), State("v"), Control("u", lower=-3, upper=3)
    steps, mass = Control("steps", piecewise="constant"), Unknown("mass", lower=0.5, upper=2)
    ramp = Control("ramp", piecewise="linear")
    rates = {x: v * ca.cos(x), v: (u + steps * ramp) / mass - 0.1 * v**2}
    power = Bound("power", u * v, upper=5)
    first = Phase("first", rates, initial={x: 0, v: 1}, end=Between(0.5, 2), bounds=[power])
    second = Phase("second", rates, final={x: 1}, start=Between(0.5, 2), end=3)
    effort = first.integral(u**2 + steps**2 + ramp**2)
    link = Bound("link", second.at_start(x) - first.at_end(x), lower=0, upper=0)
    costs = effort + second.integral(u**2 * x) ** 2 + first.peak(v**2) + mass * first.end_time
    return Problem("small", [first, second], minimise=costs, links=[link])


@pytest.mark.parametrize("scheme", [Radau(), Gauss(), Lobatto(), HermiteSimpson()])
def test_a_transcribed_problem_has_the_derivatives_that_casadi_finds(scheme):
    problem = small_problem()
    meshes = (PhaseMesh(np.array([0, 0.3, 0.5, 1]), np.array([3, 4, 3]), (1,)), uniform(2, 3))
    scales = scales_around_the_guess(problem)
    program = transcribe(problem, Mesh(meshes), scheme, "automatic", scales).program
    x, p = ca.MX.sym("x", program.variables), ca.MX.sym("p", 0)
    f, g = program.oracle(x, p)
    own = by_casadi(x, p, f, g)
    random = np.random.default_rng(5)
    at, dual = random.uniform(0.2, 1, program.variables), random.uniform(-1, 1, program.rows)
    found = [
        program.objective_gradient(at, [])[1],
        program.constraint_jacobian(at, [])[1],
        program.lagrangian_hessian(at, [], 1.3, dual),
    ]
    for ours, theirs in zip(found, own(at, [], 1.3, dual)[2:], strict=True):
        # entries up to 1e3, added up in another order
        np.testing.assert_allclose(ours.full(), theirs.full(), rtol=1e-11, atol=1e-11)


def test_expressions_do_not_grow_with_the_number_of_intervals():
    problem = small_problem()
    scales = scales_around_the_guess(problem)

    def sizes(intervals):
        mesh = Mesh((uniform(intervals, 3), uniform(intervals, 3)))
        program = transcribe(problem, mesh, Radau(), "automatic", scales).program
        assert program.variables > 10 * intervals
        # nodes of the expression graph, a mapped function counted as one
        wholes = [b.kernel.function.n_nodes() for b in program.blocks]
        hessians = [b.derivatives.hessian.n_nodes() for b in program.blocks]
        functions = (
            program.oracle,
            program.objective_gradient,
            program.constraint_jacobian,
            program.lagrangian_hessian,
        )
        return wholes, hessians, [f.n_nodes() for f in functions]

    assert sizes(5) == sizes(200)


@pytest.mark.parametrize("scheme", [Radau(), Gauss()])
def test_kernels_of_another_mesh_give_the_same_program(scheme):
    problem = small_problem()
    scales = scales_around_the_guess(problem)
    points = np.array([0, 0.3, 0.5, 1])
    extra = ((ExtraPoints(0, np.array([0, 2]), np.array([0.3, 0.7])),), ())
    meshes = [
        Mesh((uniform(4, 3), uniform(3, 3))),
        Mesh((PhaseMesh(points, np.array([3, 4, 3]), (1,)), uniform(2, 4)), extra),
        Mesh((PhaseMesh(points, np.array([4, 3, 4]), (2,)), uniform(2, 3)), extra),
    ]
    known = None
    for mesh in meshes:
        known = transcribe(problem, mesh, scheme, "automatic", scales, known)
        fresh = transcribe(problem, mesh, scheme, "automatic", scales).program
        random = np.random.default_rng(5)
        at, dual = random.uniform(0.2, 1, fresh.variables), random.uniform(-1, 1, fresh.rows)
        arguments = [(at, []), (at, []), (at, []), (at, [], 1.3, dual)]
        names = ("oracle", "objective_gradient", "constraint_jacobian", "lagrangian_hessian")
        for attribute, values in zip(names, arguments, strict=True):
            ours, theirs = getattr(known.program, attribute), getattr(fresh, attribute)
            for a, b in zip(ours.call(list(values)), theirs.call(list(values)), strict=True):
                np.testing.assert_array_equal(a.full(), b.full())
    again = transcribe(problem, meshes[0], scheme, "automatic", scales, known)
    assert again.kernels is known.kernels


def test_kernels_of_other_scales_are_not_used():
    problem = small_problem()
    mesh = Mesh((uniform(2, 3), uniform(2, 3)))
    scales, others = (scales_around_the_guess(problem) for _ in range(2))
    first = transcribe(problem, mesh, Radau(), "automatic", scales)
    rescaled = transcribe(problem, mesh, Radau(), "automatic", others, first)
    assert rescaled.kernels is not first.kernels
    other_scheme = transcribe(problem, mesh, Gauss(), "automatic", scales, first)
    assert other_scheme.kernels is not first.kernels


def everything(scheme) -> Transcription:
    """Two phases with rows of all kinds: moving breakpoints, added points, a bounded integral."""
    x, v, z = State("x", "m", scale=2), State("v", "m/s"), Algebraic("z")
    u = Control("u", "m/s^2", lower=-1, upper=1)
    law = Bound("law", z - x, lower=0, upper=0)
    cap = Bound("cap", x + v, "m", upper=3)
    first = Phase("first", {x: v, v: u}, {x: 0, v: 0}, end=Between(1, 3), bounds=[law, cap])
    second = Phase("second", {x: v, v: u}, final={x: 1, v: 0}, start=Between(1, 3), end=4.0)
    effort = Bound("effort", first.integral(u**2, name="work"), "m^2/s^3", upper=2)
    problem = Problem(
        "everything",
        [first, second],
        minimise=peak((first, v), (second, -v), name="speed"),
        bounds=[effort],
        links=joined(first, second),
    )
    moving = PhaseMesh(np.array([0, 0.3, 0.5, 1.0]), np.array([3, 3, 4]), (1,))
    extra = ExtraPoints(1, np.array([1, 2]), np.array([0.25, 0.75]))
    mesh = Mesh((moving, uniform(2, 3)), ((extra,), ()))
    return transcribe(problem, mesh, scheme, "automatic", scales_around_the_guess(problem))


@pytest.mark.parametrize("scheme", [Radau(3), Gauss(3), HermiteSimpson()], ids=lambda s: s.name)
def test_every_row_belongs_to_one_kind(scheme) -> None:
    program = everything(scheme)
    rows = np.concatenate([kind.rows for kind in row_kinds(program)])
    np.testing.assert_array_equal(np.sort(rows), np.arange(program.program.rows))


def test_names_places_units_and_sizes() -> None:
    kinds = {(kind.phase, kind.what): kind for kind in row_kinds(everything(Radau(3)))}
    dynamics = kinds["first", "dynamics of 'x'"]
    assert (dynamics.unit, dynamics.size) == ("m", 2.0)
    points = Radau().at(3).points
    assert dynamics.fractions is not None
    expected = [*(0.3 * points), *(0.3 + 0.2 * points), *(0.5 + 0.5 * Radau().at(4).points)]
    np.testing.assert_allclose(np.sort(dynamics.fractions), expected, rtol=1e-14)

    # at the collocation points, at both added points, and at the start of the phase
    cap = kinds["first", "'cap'"]
    assert cap.fractions is not None
    np.testing.assert_allclose(np.sort(cap.fractions), np.sort([*expected, 0, 0.35, 0.875]))

    assert kinds["first", "integral 'work'"].rows.size == 3
    assert kinds["first", "duration"].unit == "s"
    assert kinds["first", "order of the breakpoints"].rows.size == 2
    assert kinds["", "'effort'"].unit == "m^2/s^3"
    assert ("", "'x from first to second'") in kinds
    assert ("second", "'speed'") in kinds


def test_ends_of_intervals_without_a_point_there_are_named() -> None:
    kinds = {(kind.phase, kind.what): kind for kind in row_kinds(everything(Gauss(3)))}
    joint = kinds["second", "continuity of 'v'"]
    assert joint.fractions is not None
    assert joint.fractions.tolist() == [0.5, 1.0]


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[KeptSolver]:
    """All objects made in a test."""
    found: list[KeptSolver] = []
    make = KeptSolver.of

    def noted(*arguments: object) -> KeptSolver:
        found.append(make(*arguments))
        return found[-1]

    monkeypatch.setattr(KeptSolver, "of", noted)
    return found


def prepared() -> Transcription:
    """The program of the least time between two points of rest."""
    return prepare(race(), settings=Settings(intervals=6)).transcription


def run(
    program: Transcription,
    solver: Ipopt | None = None,
    before: NlpResult | None = None,
    listener: Listener | None = None,
) -> NlpResult:
    parameters = parameters_of(program.problem)
    limits, start = program.limits(parameters), np.full(program.program.variables, 0.5)
    point = StartingPoint(start)
    if before is not None:
        point = StartingPoint(before.x, (before.bound_multipliers, before.row_multipliers))
    solver = solver or Ipopt()
    return solver.solve(program.program, point, limits, parameters.vector, listener)


def equal(a: NlpResult, b: NlpResult) -> bool:
    """To the last digit."""
    arrays = ("x", "rows", "bound_multipliers", "row_multipliers")
    same = all(np.array_equal(getattr(a, name), getattr(b, name)) for name in arrays)
    return same and (a.objective, a.iterations) == (b.objective, b.iterations)


def test_a_second_run_is_the_first_one_again(made: list[KeptSolver]) -> None:
    program = prepared()
    first, again = run(program), run(program)
    assert len(made) == 1
    assert equal(first, again)
    assert equal(first, run(prepared()))
    assert len(made) == 2


def test_warm_and_cold_runs_by_turns_do_not_disturb_each_other(made: list[KeptSolver]) -> None:
    program = prepared()
    cold = run(program)
    warm = run(program, before=cold)
    assert equal(cold, run(program))
    assert equal(warm, run(program, before=cold))
    assert equal(warm, run(program, before=cold))
    assert len(made) == 2


def test_other_options_are_another_object(made: list[KeptSolver]) -> None:
    program = prepared()
    run(program)
    short = run(program, Ipopt(max_iterations=2))
    assert short.outcome == "budget"
    assert run(program).outcome == "solved"
    assert len(made) == 2


def test_no_more_than_two_are_kept(made: list[KeptSolver]) -> None:
    program = prepared()
    for most in (100, 200, 300):
        run(program, Ipopt(max_iterations=most))
    assert len(made) == 3
    run(program, Ipopt(max_iterations=300))
    run(program, Ipopt(max_iterations=200))
    assert len(made) == 3
    run(program, Ipopt(max_iterations=100))
    assert len(made) == 4


def test_a_run_within_a_run_has_an_object_of_its_own(made: list[KeptSolver]) -> None:
    program, inner = prepared(), list[NlpResult]()

    def listener(number: int, *_: object) -> bool:
        if number == 2:
            inner.append(run(program))
        return False

    outer = run(program, listener=listener)
    assert len(made) == 2
    assert equal(outer, inner[0])
    assert equal(outer, run(program))
    assert len(made) == 2


def test_a_listener_that_fails_or_stops_leaves_the_object_as_it_was() -> None:
    program = prepared()
    first = run(program)

    def failing(*_: object) -> bool:
        raise RuntimeError("no more")

    with pytest.raises(RuntimeError, match="no more"):
        run(program, listener=failing)
    assert run(program, listener=lambda number, *_: number == 1).outcome == "interrupted"
    assert equal(first, run(program))


def test_the_object_goes_with_its_program(made: list[KeptSolver]) -> None:
    program = prepared()
    run(program)
    kept = weakref.ref(made.pop())
    assert kept() is not None
    del program
    gc.collect()
    assert kept() is None


def test_a_program_without_rows_is_watched_too() -> None:
    w, d, c = (ca.SX.sym(name, size) for name, size in zip("wdc", (1, 0, 0), strict=True))
    kernel = Kernel(ca.Function("kernel", [w, d, c], [(w - 3) ** 2, ca.SX(0, 1)]))
    nothing = np.empty((1, 0))
    block = Block("bowl", kernel, np.zeros((1, 1), np.int64), nothing, nothing.astype(np.int64))
    limits = ProgramLimits((np.zeros(1), np.full(1, 2.0)), (np.empty(0), np.empty(0)))
    found = Ipopt().solve(
        Program((block,), 1, 0, 0), StartingPoint(np.ones(1)), limits, np.empty(0)
    )
    assert found.outcome == "solved"
    assert found.x == pytest.approx([2.0])
