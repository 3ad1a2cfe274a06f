"""A guess by simulation where nothing steers a motion: a fit of numbers to measured values.

Without controls, and from states that are prescribed, a motion follows from the unknowns alone. Its
guess is then the motion at the guess of the unknowns. Stiff kinetics begin within microseconds and
end after hours: no line in time says anything of them, and no uniform mesh carries them. So the
motion is simulated by backward differences over decades of time, and the first mesh follows it.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.mesh.first_mesh import carries, following
from ocp.mesh.initial_guess import InitialGuess
from ocp.mesh.mesh import Mesh
from ocp.mesh.trajectory import PhaseTrajectory, SignalGroup, Trajectory
from ocp.numerics.piecewise_polynomial import Lagrange, Piece, PiecewisePolynomial
from ocp.numerics.schemes import Scheme
from ocp.numerics.stiff_integrator import backward_differences
from ocp.problem.parameters import Parameters
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import TIME

# decades of a phase that are looked at, and intervals of each
_DECADES, _EACH = 12, 10
# samples of the motion in each of them, through which a polynomial is laid
_SAMPLES = 8
# of the states' ranges: a guess needs no more
_TOLERANCE = 1e-8
# part of a state's range that it has gone when the motion begins
_BEGUN = 1e-3


def determined_motion(
    problem: Problem, parameters: Parameters, stated: InitialGuess, scheme: Scheme, mesh: Mesh
) -> tuple[Trajectory, Mesh] | None:
    """The motion at the guess of the unknowns, and a mesh that carries it.

    None where something steers the motion, where the mesh carries it anyhow, and where it cannot be
    simulated.

    Parameters
    ----------
    stated : InitialGuess
        For the unknowns, and for the sizes of the states.
    scheme : Scheme
        Of the solve.
    mesh : Mesh
        That would be the first one.
    """
    if len(problem.phases) > 1 or not _is_determined(problem, parameters):
        return None
    (phase,), (uniform,) = problem.phases, mesh.phases
    motion = _simulated(problem, phase, parameters, stated, scheme)
    if motion is None:
        return None

    names = [state.name for state in phase.states]
    fractions = _since_it_began(motion)
    if carries(uniform, motion, names, fractions):
        return None
    trajectory = Trajectory((motion,), dict(stated.unknowns), dict(parameters.values))
    return trajectory, Mesh((following(uniform, motion, names, fractions),))


def _is_determined(problem: Problem, parameters: Parameters) -> bool:
    """Whether the motion of every phase follows from the unknowns."""
    for phase in problem.phases:
        steered = problem.controls[phase.name] or problem.algebraics[phase.name]
        if steered or not phase.has_fixed_times:
            return False
        for state in phase.states:
            lower, upper = parameters.initial_values.get((phase.name, state.name), (0.0, 1.0))
            if lower != upper:
                return False
    return True


def _simulated(
    problem: Problem,
    phase: Phase,
    parameters: Parameters,
    stated: InitialGuess,
    scheme: Scheme,
) -> PhaseTrajectory | None:
    """The motion on intervals whose lengths grow geometrically; None where a step fails."""
    own = stated.phases[phase.name]
    fractions = np.append(0.0, np.geomspace(10.0**-_DECADES, 1.0, _DECADES * _EACH + 1))
    times = own.start + fractions * (own.end - own.start)
    first = np.array([parameters.initial_values[phase.name, s.name][0] for s in phase.states])
    guessed = own.at_fractions(np.linspace(0.0, 1.0, 5))
    sizes = np.array([np.abs(guessed[s.name]).max() or 1.0 for s in phase.states])

    count = times.size - 1
    states = backward_differences(
        _rate(problem, phase, parameters, stated),
        first,
        np.zeros((count, 0, 1)),
        (times[:-1], times[1:]),
        sizes,
        _SAMPLES,
        _TOLERANCE,
    )
    if states is None:
        return None
    basis = Lagrange(tuple(np.linspace(0.0, 1.0, _SAMPLES + 1).tolist()))
    polynomial = PiecewisePolynomial(times, (Piece(np.arange(count), basis, states),))
    group = SignalGroup("state", tuple(state.name for state in phase.states), polynomial)
    return PhaseTrajectory(phase.name, scheme, times, np.full(count, _SAMPLES), (group,))


def _rate(
    problem: Problem, phase: Phase, parameters: Parameters, stated: InitialGuess
) -> ca.Function:
    """``(x, u, t) -> f`` with the unknowns at their guess; u is empty."""
    numbers = [*problem.unknowns, *problem.constants]
    values = [stated.unknowns[u.name] for u in problem.unknowns]
    values += [parameters.values[c.name] for c in problem.constants]
    rates = ca.vertcat(*phase.dynamics.values())
    if numbers:
        rates = ca.substitute(rates, ca.vertcat(*(n.symbol for n in numbers)), ca.DM(values))
    x = ca.vertcat(*(state.symbol for state in phase.states))
    return ca.Function("dynamics", [x, ca.SX(0, 1), TIME.symbol], [rates])


def _since_it_began(motion: PhaseTrajectory) -> Array:
    """Fractions of the phase as dense as the motion's own points, from where it begins to move."""
    inner = np.arange(_SAMPLES) / _SAMPLES
    steps = np.diff(motion.fractions)[:, None] * inner
    fractions = np.append((motion.fractions[:-1, None] + steps).ravel(), 1.0)
    values = np.array(list(motion.at_fractions(fractions).values()))
    ranges = np.ptp(values, axis=1)
    moved = np.abs(values - values[:, :1]) > _BEGUN * ranges[:, None]
    begin = int(np.argmax(moved.any(axis=0)))
    return np.append(0.0, fractions[max(begin, 1) :])
