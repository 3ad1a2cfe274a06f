"""The replay of an answer by the statement, and the same motion in terms of what was solved.

Where another problem was solved in place of the statement, the controls of the statement drive the
dynamics of the statement, and the limits that the program had are looked at as well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocp.mesh.trajectory import Evaluator, Trajectory
from ocp.optimality.iterate import Iterate
from ocp.problem.parameters import parameters_of
from ocp.reformulate.form import Form
from ocp.scaling.scales import error_sizes
from ocp.verification.simulation import MOST, SimulatedMotion, replayed, simulate


@dataclass(frozen=True, eq=False, repr=False)
class ReplayedAnswer:
    """A replayed motion.

    Attributes
    ----------
    form : Form
        The statement, and what was solved in its place.
    simulated : SimulatedMotion
        Of the statement.
    motion : Trajectory
        The same as a motion of the statement.
    solved : Trajectory
        The same as a motion of what was solved.
    stated_evaluator, evaluator : Evaluator
        Of the statement, and of what was solved.
    """

    form: Form
    simulated: SimulatedMotion
    motion: Trajectory
    solved: Trajectory
    stated_evaluator: Evaluator
    evaluator: Evaluator

    @classmethod
    def of(
        cls, form: Form, iterate: Iterate, evaluator: Evaluator, most: float = MOST
    ) -> ReplayedAnswer:
        """Replay an iterate of a form, whose evaluator is given; `most` as of `simulate`."""
        motion, sizes = form.stated(iterate.trajectory), dict(iterate.scales.signals)
        if form.is_statement:
            simulated = simulate(
                form.problem, motion, error_sizes(iterate.parameters, motion, sizes), most=most
            )
            again = replayed(motion, simulated)
            return cls(form, simulated, again, again, evaluator, evaluator)

        parameters = parameters_of(form.statement, motion.constants)
        stated = error_sizes(parameters, motion, {**_sizes(motion), **_same(form, sizes)})
        simulated = simulate(form.statement, motion, stated, most=most)
        again = replayed(motion, simulated)
        own = simulated
        if any(state in form.back for phase in form.statement.phases for state in phase.states):
            own = simulate(form.problem, iterate.trajectory, sizes, most=most)
        solved = replayed(iterate.trajectory, own)
        return cls(form, simulated, again, solved, Evaluator(form.statement), evaluator)


def _same(form: Form, sizes: dict[str, float]) -> dict[str, float]:
    """Sizes of the signals that the statement has as well."""
    gone = {symbol.name for symbol in form.back}
    return {name: size for name, size in sizes.items() if name not in gone}


def _sizes(motion: Trajectory) -> dict[str, float]:
    """The largest value of each state of a motion; 1 where it is zero all along."""
    found = dict[str, float]()
    for phase in motion.phases:
        largest = np.abs(np.concatenate(phase.state_polynomial.range())).max(axis=0)
        for name, value in zip(phase.states, largest, strict=True):
            found[name] = max(found.get(name, 0.0), float(value))
    return {name: size or 1.0 for name, size in found.items()}
