"""Audits of problems whose optima are known: one, several, and one that fails from everywhere."""

import multiprocessing

import numpy as np
import pytest

from ocp import (
    Between,
    Control,
    Infeasible,
    Interrupted,
    Phase,
    Problem,
    Settings,
    State,
    StatementError,
    Unknown,
    audit,
    solve,
)

FEW = Settings(intervals=5)


def valley():
    """Two valleys of k at -1 and 1, the left one deeper by 0.4, beside least effort of 12."""
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    k = Unknown("k", lower=-2, upper=2, guess=0.9)
    phase = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0})
    cost = phase.integral(u**2) + (k**2 - 1) ** 2 + 0.2 * k
    return Problem("valley", [phase], minimise=cost), x, k


def roots():
    """Stationary points of (k^2 - 1)^2 + 0.2 k that are minima."""
    found = np.roots([4, 0, -4, 0.2]).real
    return sorted(k for k in found if 12 * k**2 - 4 > 0)


@pytest.mark.parametrize("processes", [1, 2])
def test_both_valleys_are_found(processes):
    problem, x, k = valley()
    found = audit(problem, starts=5, seed=1, processes=processes, settings=FEW)
    left, right = roots()
    assert len(found.optima) == 2
    values = [o.solution.value(k) for o in found.optima]
    np.testing.assert_allclose(values, [left, right], atol=1e-6)  # the solver's tolerance
    for optimum, value in zip(found.optima, (left, right), strict=True):
        exact = 12 + (value**2 - 1) ** 2 + 0.2 * value
        assert optimum.objective == pytest.approx(exact, rel=1e-8)
    assert "stated guess" in found.optima[1].starts
    agreed = len(found.optima[0].starts)
    assert (
        found.verdict == f"local: best of 5 starts ({agreed} agree, {5 - agreed} ended elsewhere)"
    )
    assert found.best.verdict == found.verdict
    # what comes back from another process speaks of the caller's symbols
    assert found.best.problem is problem
    assert found.best.sample(x, 0.5) == pytest.approx(0.5, rel=1e-6)
    assert set(found.best.sensitivities()) == set(solve(problem, settings=FEW).sensitivities())
    assert f"{found.optima[1].objective:.10g} from" in str(found)


def test_starts_are_repeated_by_their_seed():
    problem, _, k = valley()
    one, two = (audit(problem, starts=3, seed=4, processes=1, settings=FEW) for _ in range(2))
    assert [o.starts for o in one.optima] == [o.starts for o in two.optima]
    assert one.best.value(k) == two.best.value(k)


def test_guesses_of_ones_own_come_after_the_stated_one():
    problem, _, _ = valley()
    found = audit(problem, starts=1, processes=1, settings=FEW)
    assert found.verdict == "local: best of 1 starts (1 agree)"
    again = audit(problem, starts=2, guesses=[found.best], processes=1, settings=FEW)
    assert again.optima[0].starts == ("stated guess", "guess 1")
    assert again.optima[0].distance == 0.0


def test_a_bound_that_is_met_is_global():
    problem, _, _ = valley()
    exact = 12 + (roots()[0] ** 2 - 1) ** 2 + 0.2 * roots()[0]
    found = audit(problem, starts=4, seed=1, processes=1, settings=FEW, bound=exact)
    assert found.verdict.startswith("global: bound met")


def test_when_all_fail_the_stated_guess_tells_why():
    x, u = State("x", "m"), Control("u", "m/s", upper=1)
    phase = Phase("far", {x: u}, {x: 0}, {x: 2}, end=Between(0.5, 1))
    problem = Problem("far", [phase], minimise=phase.end_time)
    with pytest.raises(Infeasible, match=r"'far'; worst: dynamics of 'x'"):
        audit(problem, starts=2, processes=2, settings=FEW)
    with pytest.raises(StatementError, match="0 starts"):
        audit(problem, starts=0)


@pytest.mark.parametrize("processes", [1, 2])
def test_a_stopped_audit_hands_back_the_best_until_then(processes):
    problem, _, _ = valley()

    def stop(line):
        raise KeyboardInterrupt

    others = set(multiprocessing.active_children())
    with pytest.raises(Interrupted, match="'valley' was stopped after 1 solved starts") as caught:
        audit(problem, starts=3, processes=processes, settings=FEW, progress=stop)
    assert caught.value.verified.verification.passed
    assert not set(multiprocessing.active_children()) - others
