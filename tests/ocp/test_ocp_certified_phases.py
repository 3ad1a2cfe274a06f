"""Right answers that a certificate has to pass: phases and peaks of nothing."""

import casadi as ca
import pytest

from ocp import (
    Between,
    Control,
    Phase,
    Problem,
    State,
    Unverified,
    certify,
    joined,
    peak,
    solve,
)

x, v = State("x", "m"), State("v", "m/s")
q, w = State("q", "m"), State("w", "m/s")
u = Control("u", "m/s^2", lower=-9, upper=9)


def phase(name, rate=u, **options):
    return Phase(name, {x: v, v: rate}, **options)


def test_a_phase_of_no_length_is_certified():
    """All effort where a force gives more: 12 m^2/s^3 for a metre in a second from rest to rest."""
    meeting = Between(0, 5)
    strong = phase("strong", initial={x: 0, v: 0}, end=meeting)
    weak = phase("weak", rate=u / 2, final={x: 1, v: 0}, start=meeting, end=1.0)
    cost = strong.integral(u**2) + weak.integral(u**2)
    found = solve(Problem("two", [strong, weak], minimise=cost, links=joined(strong, weak)))
    assert found.objective == pytest.approx(12, rel=1e-8)
    assert found.value(weak.duration) == pytest.approx(0, abs=1e-6)
    assert certify(found).passed


def test_a_phase_that_does_not_matter_is_certified():
    """The peak is decided in a: 2 m/s^2 for a metre in a second from rest; b has three for the way
    to and fro.
    """
    a = phase("a", initial={x: 0, v: 0}, final={x: 1}, end=1.0)
    b = phase("b", final={x: 1}, start=1.0, end=4.0)
    found = solve(
        Problem("one", [a, b], minimise=peak((a, u), (b, u), absolute=True), links=joined(a, b))
    )
    assert found.objective == pytest.approx(2, rel=1e-8)
    assert certify(found).passed


def test_a_peak_of_zero_is_certified():
    stay = phase("stay", initial={x: 0, v: 0}, final={x: 0}, end=1.0)
    found = solve(Problem("stay", stay, minimise=1 + stay.peak(x, absolute=True)))
    assert found.objective == pytest.approx(1, rel=1e-8)
    assert certify(found).passed


@pytest.mark.parametrize(
    "cost",
    [
        lambda p: p.at_end(w**2 / 2 + 2 * q**2),
        lambda p: (p.at_end(x) - 1) ** 2 + p.at_end(v) ** 2 + p.at_end(q) ** 2,
        lambda p: p.integral(ca.fmax(0, v - 0.5) ** 2),
        lambda p: p.integral(ca.fmax(0, v - 0.5)),
    ],
    ids=["residual vibration", "missed end", "excess of speed", "kinked excess"],
)
def test_an_optimum_of_zero_is_certified(cost):
    """Many motions have it. Their costates are zero, and what a solver leaves of them says nothing.

    No switch of such a motion is at a wrong time either.
    """
    push = Control("push", "m/s^2", lower=-1, upper=1)
    rates = {x: v, v: push, q: w, w: -4 * q - push}
    move = Phase("move", rates, dict.fromkeys((x, v, q, w), 0), {x: 1, v: 0}, end=6.0)
    found = solve(Problem("quiet", move, minimise=cost(move)))
    assert found.objective == pytest.approx(0, abs=1e-9)
    assert "switch" not in str(found.verdict)
    assert certify(found).passed


def test_a_peak_of_which_less_is_not_better_is_named():
    move = phase("move", initial={x: 0, v: 0}, final={x: 1, v: 0}, end=1.0)
    cost = (move.peak(v, name="top") - 2) ** 2 + 1e-3 * move.integral(u**2)
    with pytest.raises(Unverified, match=r"the peak 'top' counts as 2, and the motion has 1\.5"):
        solve(Problem("fast", move, minimise=cost))
