"""yapss: pseudospectral, automatic derivatives; parameter and path as in its soaring example."""

import numpy as np
import problems
import row
import yapss.math as ym
import yapss_options
from yapss import Problem

IMPORTED = row.now()
SIZE = {"A": 130, "B": 100}  # intervals
METHOD = {"A": ("lg", 2), "B": ("lgr", 3)}  # and points in an interval: those that come closest


def statement(problem, n):
    """The problem in yapss's terms; its parameter is the peak."""
    ocp = Problem(name=problem, nx=[3], nu=[1], nh=[2], ns=1)

    def objective(arg):
        arg.objective = arg.parameter[0]

    def continuous(arg):
        angle, speed, acc = arg.phase[0].state
        (jerk,) = arg.phase[0].control
        peak = arg.parameter[0]
        arg.phase[0].dynamics[:] = speed, acc, problems.UNIT_JERK[problem] * jerk
        if problem == "A":
            relative = acc / problems.UNIT_ACCELERATION
            arg.phase[0].path[:] = peak - relative, peak + relative
        else:
            force = problems.unit_force(ym, ym.where, angle, speed, acc)
            arg.phase[0].path[:] = peak - force, force

    ocp.functions.objective, ocp.functions.continuous = objective, continuous

    bounds = ocp.bounds.phase[0]
    bounds.initial_time.lower = bounds.initial_time.upper = 0
    bounds.final_time.lower = bounds.final_time.upper = 1
    bounds.initial_state.lower[:] = bounds.initial_state.upper[:] = problems.START, 0, 0
    bounds.final_state.lower[:] = bounds.final_state.upper[:] = problems.END, 0, 0
    bounds.control.lower[:], bounds.control.upper[:] = -1, 1
    bounds.path.lower[:] = 0
    if problem == "B":
        bounds.state.lower[1] = 0

    guess = ocp.guess.phase[0]
    guess.time = [0.0, 1.0]
    guess.state = [[problems.START, problems.END], [0.0, 0.0], [0.0, 0.0]]
    guess.control = [[0.0, 0.0]]
    ocp.guess.parameter = [2.0]

    ocp.spectral_method, points = METHOD[problem]
    yapss_options.complete(ocp, n, points)
    return ocp


def solve(problem, size):
    """Return edges, places in an interval, the jerk there, and a note."""
    n = size or SIZE[problem]
    points = METHOD[problem][1]
    solution = statement(problem, n).solve()
    times, jerk = solution.phase[0].time_c, solution.phase[0].control[0]
    edges, jerks = problems.in_si_units(problem, np.linspace(0, 1, n + 1), jerk.reshape(n, points))
    return edges, times[:points] * n, jerks, solution.nlp_info.ipopt_status_message


if __name__ == "__main__":
    *control, words = solve(*row.asked())
    row.answer(IMPORTED, *control, note=words)
