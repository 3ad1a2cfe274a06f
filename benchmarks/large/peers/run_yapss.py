"""yapss on a large problem: Radau collocation of degree 3 on a uniform mesh, from the same guess.

`python run_yapss.py PROBLEM INTERVALS FILE`. The statement is read as data: all its expressions are
CasADi's, as yapss's own are. Algebraic signals are controls whose equations are path constraints.
"""

import json
import sys
import time
from pathlib import Path

import casadi as ca
import numpy as np
from yapss import Problem
from yapss.math.wrapper import SXW

from benchmarks.large.problems import PROBLEMS
from benchmarks.race.peers.yapss_options import complete
from ocp import TIME, Between
from ocp.mesh.initial_guess import initial_guess
from ocp.problem.functionals import Integral, PhaseTime
from ocp.problem.parameters import parameters_of

POINTS = 3  # in an interval
GUESSED = np.linspace(0.0, 1.0, 201)


def put_in(expressions, symbols, values):
    """Expressions with yapss's values in place of symbols."""
    raw = [getattr(value, "_value", value) for value in values]
    found = ca.substitute([ca.SX(e) for e in expressions], [s.symbol for s in symbols], raw)
    return [SXW(e) for e in found]


def statement(stated, intervals):
    """A problem in yapss's terms."""
    phases, rows = stated.phases, stated.boundary_constraints
    ocp = Problem(
        name=stated.name,
        nx=[len(p.states) for p in phases],
        nu=[len(inputs_of(stated, p)) for p in phases],
        nh=[len(p.bounds) for p in phases],
        nq=[len(stated.integrals[p.name]) for p in phases],
        nd=len(rows),
    )
    set_functions(ocp, stated)
    ocp.bounds.discrete.lower[:] = [b.lower for b in rows]
    ocp.bounds.discrete.upper[:] = [b.upper for b in rows]
    guesses = initial_guess(stated, parameters_of(stated)).phases
    for i, phase in enumerate(phases):
        inputs = inputs_of(stated, phase)
        set_bounds(ocp.bounds.phase[i], phase, inputs)
        set_guess(ocp.guess.phase[i], phase, inputs, guesses[phase.name])

    ocp.spectral_method = "lgr"
    complete(ocp, intervals, POINTS)
    return ocp


def inputs_of(stated, phase):
    """All signals but the states."""
    return stated.signals[phase.name][len(phase.states) :]


def set_functions(ocp, stated):
    """Dynamics, path constraints, integrals, objective and what holds at the ends."""

    def continuous(arg):
        for own, phase in zip(arg.phase, stated.phases, strict=True):
            symbols = (*stated.signals[phase.name], TIME)
            values = [v.item() for v in (*own.state, *own.control, own.time)]
            own.dynamics[:] = put_in(phase.dynamics.values(), symbols, values)
            own.path[:] = put_in([b.expression for b in phase.bounds], symbols, values)
            integrals = [i.expression for i in stated.integrals[phase.name]]
            own.integrand[:] = put_in(integrals, symbols, values)

    numbers = {p.name: i for i, p in enumerate(stated.phases)}

    def functional(arg, symbol):
        own, phase = arg.phase[numbers[symbol.phase]], stated.phase(symbol.phase)
        if isinstance(symbol, Integral):
            return own.integral[stated.integrals[phase.name].index(symbol)]
        at_start = symbol.end == "start"
        if isinstance(symbol, PhaseTime):
            return own.initial_time if at_start else own.final_time
        states = own.initial_state if at_start else own.final_state
        return put_in([symbol.expression], phase.states, states)[0]

    def at_ends(arg, expressions):
        values = [functional(arg, symbol) for symbol in stated.functionals]
        return put_in(expressions, stated.functionals, values)

    def objective(arg):
        (arg.objective,) = at_ends(arg, [stated.objective])

    def discrete(arg):
        arg.discrete[:] = at_ends(arg, [b.expression for b in stated.boundary_constraints])

    ocp.functions.objective, ocp.functions.continuous = objective, continuous
    if stated.boundary_constraints:
        ocp.functions.discrete = discrete


def set_bounds(bounds, phase, inputs):
    """Limits of a phase."""
    for end, own in ((phase.start, bounds.initial_time), (phase.end, bounds.final_time)):
        free = isinstance(end, Between)
        own.lower, own.upper = (end.lower, end.upper) if free else (end, end)
    for own, limits in (
        (bounds.state, phase.states),
        (bounds.control, inputs),
        (bounds.path, phase.bounds),
    ):
        own.lower[:] = [limit.lower for limit in limits]
        own.upper[:] = [limit.upper for limit in limits]
    ends = ((bounds.initial_state, phase.initial), (bounds.final_state, phase.final))
    for own, values in ends:
        own.lower[:] = [values.get(s, s.lower) for s in phase.states]
        own.upper[:] = [values.get(s, s.upper) for s in phase.states]


def set_guess(own, phase, inputs, guess):
    """The guess that the statement gives, densely sampled."""
    values = guess.at_fractions(GUESSED)
    own.time = guess.start + (guess.end - guess.start) * GUESSED
    own.state = np.array([values[s.name] for s in phase.states])
    own.control = np.array([values[s.name] for s in inputs])


def main(name, intervals, file):
    """Solve a problem, and write the objective, seconds and signals of all phases."""
    stated, begin = PROBLEMS[name].make(), time.process_time()
    found = statement(stated, int(intervals)).solve()
    record = {
        "seconds": time.process_time() - begin,
        "objective": stated.sense * found.objective,
        "failure": "" if found.nlp_info.ipopt_status == 0 else found.nlp_info.ipopt_status_message,
        "phases": [
            {"time": p.time.tolist(), "state": p.state.tolist(), "control": p.control.tolist()}
            for p in found.phase
        ],
    }
    Path(file).write_text(json.dumps(record), "utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
