"""OpenSCvx: successive convex programs; constraints between nodes by integrals of violation."""

import types

import numpy as np
import openscvx as ox
import problems
import row

IMPORTED = row.now()
SIZE = {"A": 40, "B": 20}  # nodes: those that come closest

# tolerances of the convex programs, as its authors' examples have them
SOLVER = {"solver_args": {"abstol": 1e-6, "reltol": 1e-9}}
# first weights of the trust region, the objective and the defects: those that come closest
ALGORITHM = {"lam_prox": 0.1, "lam_cost": 0.1, "lam_vc": 10.0}

ALGEBRA = types.SimpleNamespace(sin=ox.Sin, cos=ox.Cos, exp=ox.Exp, sqrt=ox.Sqrt)


def signal(kind, name, lowest, highest, **options):
    """A scalar state or control within bounds."""
    made = kind(name, shape=(1,), **options)
    made.min, made.max = np.array([lowest]), np.array([highest])
    return made


def statement(problem, n):
    """The problem in OpenSCvx's terms; the peak is a state that does not change."""
    angle = signal(ox.State, "angle", 0.0, 2.0)
    angle.initial, angle.final = np.array([problems.START]), np.array([problems.END])
    speed = signal(ox.State, "speed", 0.0 if problem == "B" else -10.0, 10.0)
    acc = signal(ox.State, "acc", -100.0, 100.0)
    for state in (speed, acc):
        state.initial, state.final = np.array([0.0]), np.array([0.0])
    peak = signal(ox.State, "peak", 0.0, 10.0)
    peak.initial, peak.final = [ox.Free(2.0)], [ox.Minimize(2.0)]

    # Held from node to node: linear ones of version 0.5.2 go N/(N - 1) of the way to the next.
    jerk = signal(ox.Control, "jerk", -1.0, 1.0, parameterization="ZOH")
    jerk.guess = np.zeros((n, 1))
    angle.guess = np.linspace(problems.START, problems.END, n).reshape(-1, 1)
    for state, value in ((speed, 0.0), (acc, 0.0), (peak, 2.0)):
        state.guess = np.full((n, 1), value)

    if problem == "A":
        peaked = acc[0] / problems.UNIT_ACCELERATION
        kept = [ox.ctcs(peaked <= peak[0]), ox.ctcs(-1.0 * peak[0] <= peaked)]
    else:
        peaked = problems.unit_force(ALGEBRA, chosen, angle[0], speed[0], acc[0])
        kept = [ox.ctcs(peaked <= peak[0]), ox.ctcs(0.0 <= peaked), ox.ctcs(0.0 <= speed[0])]

    return ox.Problem(
        dynamics={
            "angle": speed[0],
            "speed": acc[0],
            "acc": problems.UNIT_JERK[problem] * jerk[0],
            "peak": 0.0 * peak[0],
        },
        states=[angle, speed, acc, peak],
        controls=[jerk],
        time=ox.Time(initial=0.0, final=1.0, min=0.0, max=1.0),
        constraints=kept,
        N=n,
        float_dtype="float64",
        algorithm=ALGORITHM,
        solver=SOLVER,
    )


def chosen(condition, this, other):
    """The value of one of two expressions."""
    return ox.Cond(condition, this, other)


def solve(problem, size):
    """Return edges, places in an interval, the jerk there, and a note."""
    n = size or SIZE[problem]
    p = statement(problem, n)
    p.initialize()
    result = p.solve()

    # The tool chooses the times of its nodes, which end at one to within its tolerance.
    times, jerk = result.nodes["time"][:, 0], result.nodes["jerk"][:, 0]
    times = (times - times[0]) / (times[-1] - times[0])
    edges, jerks = problems.in_si_units(problem, times, jerk[:-1, np.newaxis])
    return edges, [0.5], jerks, f"converged: {result.converged}"


if __name__ == "__main__":
    *control, words = solve(*row.asked())
    row.answer(IMPORTED, *control, note=words)
