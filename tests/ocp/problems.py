"""Problems of textbooks that many tests ask, and what is read of their answers."""

import dataclasses
import math

import casadi as ca
import numpy as np

from ocp import (
    Between,
    Constant,
    Control,
    FixedMesh,
    Phase,
    Problem,
    Settings,
    State,
    certify,
    joined,
    solve,
)
from ocp.mesh.initial_guess import initial_guess
from ocp.problem.parameters import parameters_of
from ocp.scaling.automatic import scales_of

STRONGEST = Constant("strongest", "m/s^2", 2.0)


def double_integrator(**options):
    """Position, speed, the control that accelerates, and the rates of the two states."""
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2", **options)
    return x, v, u, {x: v, v: u}


def rest_to_rest(far=1.0, end=1.0, bounds=(), **options):
    """Position, speed, control, and the phase in which a mass goes so far from rest to rest."""
    x, v, u, rates = double_integrator(**options)
    phase = Phase("move", rates, {x: 0, v: 0}, {x: far, v: 0}, end=end, bounds=bounds)
    return x, v, u, phase


def least_effort(far=1.0, end=1.0, **options):
    """u = 6 - 12 t with the costates -24 and -2 u; H = -36; J = 12 far^2 / end^3."""
    _, _, u, phase = rest_to_rest(far, end, **options)
    return Problem("least effort", phase, minimise=phase.integral(u**2))


def two_halves(**options):
    """Position, speed, control, and the same way in two phases of half a second."""
    x, v, u, rates = double_integrator(**options)
    first = Phase("first", rates, {x: 0, v: 0}, end=0.5)
    second = Phase("second", rates, final={x: 1, v: 0}, start=0.5, end=1.0)
    return x, v, u, (first, second), joined(first, second)


def bryson_denham(roof=1 / 9, speed=1.0, **options):
    """Least effort under a roof (Bryson, Denham and Dreyfus 1963): J = 4 / (9 roof) up to 1/6.

    With the roof of 1/9 it is held from 1/3 to 2/3. The costate of x is 18, 0 and -18, H = 0.
    """
    x, v, u = State("x", "m", upper=roof), State("v", "m/s"), Control("u", "m/s^2", **options)
    phase = Phase("hop", {x: v, v: u}, {x: 0, v: speed}, {x: 0, v: -1}, end=1.0)
    return Problem("Bryson-Denham", phase, minimise=phase.integral(u**2 / 2))


def dash(lower=-2.0, **options):
    """Least time over 300 m: 30 s with the switch at 20 s, and H = -1."""
    x, v, _, rates = double_integrator(lower=lower, upper=1, **options)
    phase = Phase("dash", rates, {x: 0, v: 0}, {x: 300, v: 0}, end=Between(1, 100))
    return Problem("least time", phase, minimise=phase.end_time)


def race(way=1.0):
    """Least time from rest to rest, with another cap on the drive than on the brake."""
    x, v, _, rates = double_integrator(lower=-1.0, upper=STRONGEST, piecewise="constant")
    phase = Phase("race", rates, {x: 0, v: 0}, {x: way, v: 0}, end=Between(0.1, 20, guess=2))
    return Problem("race", phase, minimise=phase.end_time)


def least_time(strongest: float) -> float:
    """Of the race: the areas of both halves of the speed's triangle make 1 m."""
    return math.sqrt(2.0 * (1.0 + 1.0 / strongest))


def solved_on(intervals, problem, **settings):
    """The solution on a uniform mesh that stays as it is."""
    chosen = Settings(intervals=intervals, refinement=FixedMesh(), **settings)
    return solve(problem, settings=chosen)


def certified(problem, optimum, within=1e-6, **options):
    """A solution with that objective, to a part of it, whose certificate passes."""
    found = solve(problem, **options)
    off = abs(found.objective - optimum)
    assert off <= within * abs(optimum), f"{found.objective!r} is not {optimum!r}"
    certificate = certify(found)
    assert certificate.passed, str(certificate)
    return found


def check_of(solution, start):
    """What a certificate of a solution says in the one check whose name starts so."""
    (check,) = [check for check in certify(solution).checks if check.name.startswith(start)]
    return check


def failed(solution):
    """The names of the checks that a solution fails; one that is open is neither."""
    return {check.name for check in certify(solution).checks if check.failed}


def with_costates(solution, factors):
    """The solution with costates that are multiplied by a factor, one or (N,) of the intervals."""
    kept = solution.multipliers
    (own,) = kept.costates
    factors = np.broadcast_to(factors, own.polynomial.intervals)
    pieces = tuple(
        dataclasses.replace(
            piece, coefficients=piece.coefficients * factors[piece.intervals, None, None]
        )
        for piece in own.polynomial.pieces
    )
    polynomial = dataclasses.replace(own.polynomial, pieces=pieces)
    spoilt = dataclasses.replace(own, polynomial=polynomial)
    return dataclasses.replace(solution, multipliers=dataclasses.replace(kept, costates=(spoilt,)))


def cubic_oscillator(end, effort=False):
    """From 1 to rest against the cube of the place, in the least time or with the least effort."""
    x, v, u = State("x"), State("v"), Control("u", lower=-1, upper=1)
    ends = {x: 1, v: 0}, {x: 0, v: 0}
    phase = Phase("swing", {x: v, v: u - x**3}, *ends, end=end, guess={u: 0})
    return Problem("swing", phase, minimise=phase.integral(u**2) if effort else phase.end_time)


def moved_by_jerk(far=1.0, end=1.0, **options):
    """Acceleration, jerk, and the phase in which these move a mass so far from rest to rest."""
    x, v, a = State("x", "m"), State("v", "m/s"), State("a", "m/s^2")
    jerk, rest = Control("jerk", "m/s^3", **options), {v: 0, a: 0}
    phase = Phase("move", {x: v, v: a, a: jerk}, {x: 0, **rest}, {x: far, **rest}, end=end)
    return a, jerk, phase


def scales_around_the_guess(problem):
    """The sizes of signals, rows and objective before the first solve."""
    parameters = parameters_of(problem)
    return scales_of(problem, initial_guess(problem, parameters), parameters)


def pendulum(angle=1.0, end=2.0):
    """The least torque that turns a hanging pendulum by an angle, to rest, within a time."""
    q, w, u = State("q", "rad"), State("w", "rad/s"), Control("u", "N m")
    rates = {q: w, w: u - 9.81 * ca.sin(q)}
    phase = Phase("swing", rates, {q: 0, w: 0}, {q: angle, w: 0}, end=end)
    return Problem("pendulum", phase, minimise=phase.integral(u**2))
