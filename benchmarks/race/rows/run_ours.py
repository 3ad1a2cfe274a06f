"""Our row: the plain statement and default settings.

Where a size k is asked for, the objective's tolerance is 10^-k and those of dynamics and path are
a hundred times less.
"""

import casadi as ca
import numpy as np
import problems
import row

from ocp import Accuracy, Bound, Control, Phase, Problem, Settings, State, Unverified, solve

IMPORTED = row.now()


def statement(name):
    """State the problem as a user would; return it and its control."""
    duration, cap = problems.DURATION[name], problems.JERK_CAP[name]
    angle = State("angle", "rad")
    speed = State("speed", "rad/s", lower=0 if name == "B" else -ca.inf)
    acceleration = State("acceleration", "rad/s^2")
    jerk = Control("jerk", "rad/s^3", lower=-cap, upper=cap)

    force = problems.rope_force(ca, ca.if_else, angle.symbol, speed.symbol, acceleration.symbol)
    above_zero = [Bound("rope force", force, "N", lower=0)] if name == "B" else []
    phase = Phase(
        "deployment",
        dynamics={angle: speed, speed: acceleration, acceleration: jerk},
        initial={angle: problems.START, speed: 0, acceleration: 0},
        final={angle: problems.END, speed: 0, acceleration: 0},
        end=duration,
        bounds=above_zero,
    )

    peak = phase.peak(acceleration, absolute=True) if name == "A" else phase.peak(force)
    return Problem(name, phase, minimise=peak), jerk


def settings(size):
    """Default ones, or those of the given size."""
    if not size:
        return Settings()
    fine = 0.01 * 10.0**-size
    return Settings(accuracy=Accuracy(objective=10.0**-size, dynamics=fine, path=fine))


def main():
    """Solve and answer; an answer that the engine does not vouch for is held against it below."""
    name, size = row.asked()
    problem, jerk = statement(name)
    try:
        solution, note = solve(problem, settings=settings(size)), ""
    except Unverified as error:
        solution, note = error.iterate, "its own verification failed"

    # Within an interval the jerk is a polynomial: its values at Chebyshev points tell it.
    degree = Settings().refinement.highest_degree
    nodes = (1 - np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))) / 2
    edges = np.asarray(solution.breakpoints)
    times = edges[:-1, None] + np.diff(edges)[:, None] * nodes

    iterations = sum(r.iterations for r in solution.mesh_iterations)
    rounds = f"{len(solution.mesh_iterations)} rounds, {iterations} iterations"
    row.answer(
        IMPORTED,
        edges,
        nodes,
        solution.sample(jerk, times),
        verification=solution.verification.seconds,
        note=f"{rounds}; {note}" if note else rounds,
    )


if __name__ == "__main__":
    main()
