"""A reformulation of one's own: a change of variable, and what is told of its answer."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest

from ocp import (
    Constant,
    Control,
    Ipopt,
    Phase,
    Problem,
    Restated,
    Settings,
    SolveFailed,
    State,
    StatementError,
    Trajectory,
    certify,
    family,
    load,
    prepare,
    save,
    solve,
)

# From 1 to e in 1 s at the rate u x, with the least integral of u^2: u = 1, so that x = exp(t)
x, u = State("x", "kg", lower=0.1), Control("u", "1/s", lower=-5, upper=5)
goal = Constant("goal", "kg", value=np.e)
grow = Phase("grow", {x: u * x}, {x: 1}, {x: goal}, end=1.0)
effort = grow.integral(u**2)
growth = Problem("growth", grow, minimise=ca.exp(effort), bounds=[grow.at_end(u) <= 4])

z = State("log x", "1")


@dataclass(frozen=True)
class Logarithm:
    """The logarithm of x, whose rate is u, and of the objective."""

    backwards: bool = True

    def apply(self, problem):
        """The growth on a straight line."""
        if x not in problem.phases[0].states:
            return None
        line = Phase("grow", {z: u}, {z: 0}, {z: ca.log(goal)}, end=1.0)
        solved = Problem("line", line, minimise=line.integral(u**2), bounds=[line.at_end(u) <= 4])
        back = {x: ca.exp(z)} if self.backwards else {}
        return Restated(solved, back=back, forth={z: ca.log(x)})


OWN = Settings(reformulations=(*Settings().reformulations, Logarithm()))
TIMES = np.linspace(0.0, 1.0, 11)


@pytest.fixture(scope="module")
def found():
    return solve(growth, settings=OWN)


def test_the_answer_is_told_in_terms_of_the_statement(found):
    assert found.problem is growth
    assert found.form.problem.name == "line"
    assert found.objective == pytest.approx(np.e, rel=1e-7)
    assert found.value(effort) == pytest.approx(1.0, rel=1e-7)
    for replayed in (False, True):
        values = found.sample(x, TIMES, replayed=replayed)
        assert values == pytest.approx(np.exp(TIMES), rel=1e-7)
    assert set(found.table()) == {"time", "x", "u"}
    with pytest.raises(StatementError, match="'log x' is no symbol"):
        found.sample(z, TIMES)


def test_the_statement_is_replayed_and_certified(found):
    assert found.replay.phases[0].state_names == ("x",)
    assert found.verification.replayed_objective == pytest.approx(np.e, rel=1e-6)
    assert found.verification.objective == found.objective
    assert certify(found).passed


def test_a_way_back_that_is_wrong_does_not_pass():
    class Wrong(Logarithm):
        def apply(self, problem):
            made = super().apply(problem)
            return made and Restated(made.problem, back={x: ca.exp(1.01 * z)})

    settings = Settings(reformulations=(Wrong(),))
    with pytest.raises(SolveFailed, match="the replay misses the end state"):
        solve(growth, settings=settings)


def test_sensitivities_are_those_that_the_statement_has(found):
    slopes = found.sensitivities()
    # the effort is log(goal)^2
    assert slopes["goal"] == pytest.approx(2.0 / np.e, rel=1e-6)
    assert not any("log x" in name for name in slopes)


def test_it_starts_again_from_its_answer_from_a_motion_and_from_a_file(found, tmp_path):
    assert solve(growth, settings=OWN, guess=found).iterations <= 2
    motion = solve(growth, settings=OWN, guess=found.trajectory)
    assert motion.objective == pytest.approx(np.e, rel=1e-7)
    save(found, tmp_path / "growth.ocp")
    read = load(tmp_path / "growth.ocp")
    assert read.sample("x", TIMES) == pytest.approx(np.exp(TIMES), rel=1e-7)
    assert solve(read.problem, settings=OWN, guess=read).iterations <= 2
    # without the reformulation it is another program
    other = solve(read.problem, guess=read)
    assert other.form.problem is read.problem
    assert other.objective == pytest.approx(np.e, rel=1e-6)


def test_other_verbs_solve_it_too(found):
    prepared = prepare(growth, settings=OWN, guess=found)
    again = prepared.solve(constants={goal: 2.0}, guess=found)
    assert again.objective == pytest.approx(np.exp(np.log(2.0) ** 2), rel=1e-7)
    (_, last) = family(growth, goal, [np.e, 2.0], settings=OWN).solutions()
    assert last.sample(x, [1.0])[0] == pytest.approx(2.0, rel=1e-7)


def test_errors_hold_motions_of_the_statement():
    with pytest.raises(SolveFailed) as failed:
        solve(
            growth, settings=Settings(reformulations=[Logarithm()], solver=Ipopt(max_iterations=0))
        )
    assert isinstance(failed.value.iterate, Trajectory)
    assert failed.value.iterate.phases[0].states == ("x",)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ([Logarithm(backwards=False)], "gives no way back to 'x'; give it by the new symbols"),
        (["epigraph"], "give objects with a method apply"),
        (None, "give objects with a method apply"),
        ([Logarithm], "give objects with a method apply"),
    ],
)
def test_what_is_no_reformulation_is_refused(given, words):
    with pytest.raises(StatementError, match=words):
        solve(growth, settings=Settings(reformulations=given))


def test_a_reformulation_without_a_hash_is_told_how_to_get_one():
    @dataclass
    class Plain:
        def apply(self, problem):
            return None

    with pytest.raises(StatementError, match=r"write @dataclass\(frozen=True\)"):
        Settings(reformulations=[Plain()])
