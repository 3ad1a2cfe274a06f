"""Solve a motion on B21, and refuse what cannot be met before that."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from models.arm.reduced_simulation import reduced_modes
from models.laws.unit_turns import quintic
from models.numerics import gauss_legendre
from ocp import Interrupted, NumericalTrouble, OcpError, Settings, Solution, Trajectory
from ocp.arrays import Array
from studies.arm.laws.rigid import feed_forward
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.optimal.objectives import OBJECTIVES, StatedMotion, first_duration, problem
from studies.arm.optimal.phase import quasi_static
from studies.arm.optimal.solver import mesh_of, settings
from studies.arm.optimal.study_solver import StudySolver
from studies.arm.search_limits import (
    ATTEMPTS,
    INTERVALS,
)
from studies.arm.stage import ELBOW, ROOT, Stage, TorqueCaps
from studies.common.exit_codes import ExitCode, StudyError

BEND = 0.3  # [rad]; slopes of R (1 - psi^2/2, psi) are then right to a per mille
MOST_PERIODS = 2e5  # of the fastest mode; the paper's 112 s have 16,000
LEAST_ADVISED = 10.0  # [s]; no one deploys such an arm faster, so no hint says so
# Where both joints turn, these are found from a rigid arm's motion. From there a least peak is not
# found, and the smoothest torque either not or a far rougher one.
_FROM_A_RIGID_ARM = ("energy", "time")
_ATTEMPTS = tuple((finer, settings(barrier)) for finer, barrier in ATTEMPTS)
_INSTANTS = 51  # at which the bending of a quintic step is looked at
_RIGID_BOUND, _RIGID_RATE = 4.0, 32.0  # least peaks of torque and rate, in J D/T^2 and J D/T^3


def solve_stage(
    stage: Stage,
    *,
    caps: TorqueCaps | None = None,
    shared: TorqueCaps | None = None,
    objective: str = "smoothest",
    intervals: int | None = None,
    at_least: int = 0,
    name: str = "optimum",
    solver: StudySolver | None = None,
) -> OptimalMotion:
    """Solve one stage on one mesh; the stage solved lasts what the solver chose.

    No mesh of fewer than `at_least` intervals is tried: for a stage whose easier neighbour was
    found on such a mesh first. `shared` is that of `problem`.

    Raises
    ------
    StudyError
        If the solver finds no motion.
    """
    caps = caps or TorqueCaps()
    intervals = intervals or INTERVALS[ELBOW in stage.moving]
    guess: Trajectory | None = None
    if objective == "time":
        # least time starts from a motion that is possible and only shortens it
        stage = stage.lasting(first_duration(stage, caps))
        guess = solve_stage(stage, caps=caps, intervals=intervals, solver=solver).trajectory
    else:
        check_bending(stage)
        check_caps(stage, caps)

    if len(stage.moving) > 1 and objective not in _FROM_A_RIGID_ARM:
        # the others are found from the motion of least energy
        guess = solve_stage(
            stage, caps=caps, objective="energy", intervals=intervals, solver=solver
        ).trajectory

    stated = problem(stage, caps, objective, shared=shared)
    weight = OBJECTIVES[objective].smoothing
    return solved(name, stated, weight, None, (intervals,), guess, solver, at_least)


def solve_again(
    motion: OptimalMotion,
    *,
    weight: float,
    aim: Array,
    finer: float = 1.0,
    stated: StatedMotion | None = None,
    multipliers: bool = True,
    solver: StudySolver | None = None,
) -> OptimalMotion:
    """Solve the problem of a motion again, from it: lighter, aimed elsewhere or on a finer mesh.

    Parameters
    ----------
    motion : OptimalMotion
    weight : float
        Of the smoothness.
    aim : (m,)
        Where the stages end beside rest, see `aim`.
    finer : float
        Intervals over those of the motion.
    stated : StatedMotion, optional
        Another problem, such as that of a shorter stage; the motion's own by default.
    multipliers : bool
        Whether the motion's may start the solver, too, where problem, weight and mesh are its own.
    solver : StudySolver, optional
        Of the study; one that keeps nothing by default.

    Raises
    ------
    StudyError
        If the solver finds no motion.
    """
    # Multipliers help where only the aim is another: then a few iterations do. On a finer mesh, or
    # at another weight, most of them are wrong, and a start without any takes fewer iterations.
    alike = stated is None and weight == motion.weight and finer == 1.0
    start = motion.solution if multipliers and alike else motion.trajectory
    counts = [round(finer * count) for count in motion.counts]
    return solved(motion.name, stated or motion.stated, weight, aim, counts, start, solver)


def solved(
    name: str,
    stated: StatedMotion,
    weight: float,
    aim: Array | None,
    intervals: Sequence[int],
    guess: Solution | Trajectory | None = None,
    solver: StudySolver | None = None,
    at_least: int = 0,
    attempts: Sequence[tuple[float, Settings]] = _ATTEMPTS,
) -> OptimalMotion:
    """Solve what is stated on one mesh, or on a finer one where that fails.

    `attempts` are how many times as many intervals, with which settings.

    Raises
    ------
    StudyError
        If the solver finds no motion.
    """
    solver = solver or StudySolver()
    failure: OcpError | None = None
    for finer, how in attempts:
        counts = [round(finer * count) for count in intervals]
        if sum(counts) < at_least:
            continue
        try:
            solution = solver(
                stated.problem,
                settings=how,
                guess=guess,
                constants=stated.constants(weight, aim),
                mesh=mesh_of(stated, counts),
            )
        except Interrupted as error:
            raise KeyboardInterrupt from error
        except OcpError as error:
            failure = error
            continue
        return OptimalMotion(name, stated, solution, weight)

    names = " and ".join(f"'{arm.stage.name}'" for arm in stated.arms)
    stages = "stage" if len(stated.arms) == 1 else "stages"
    raise StudyError(
        f"no motion of the {stages} {names} was found: {in_words(failure)}", ExitCode.NOT_SOLVED
    )


def in_words(failure: OcpError | None) -> str:
    """Why the solver found none, with a remedy that the user of an arm has."""
    if isinstance(failure, NumericalTrouble):
        # the engine's own advice is for who states a problem
        return (
            "the solver stopped with a numerical error; give a longer duration, a more common "
            "stiffness or mass, or another objective"
        )
    return str(failure)


def check_bending(stage: Stage) -> None:
    """Refuse a motion that bends the links beyond what small rotations describe.

    Judged by the quintic step's inertia; links bend as 1/T^2.

    Raises
    ------
    StudyError
        With the duration that would do.
    """
    check_stiffness(stage)
    t = np.linspace(0.0, stage.duration, _INSTANTS)
    q, _ = quasi_static(stage, quintic(stage.duration), t)

    # a deflection over the length and a slope are both angles
    lengths = {"delta1": stage.arm.big.length, "delta2": stage.arm.small.length, "psi1": 1.0}
    coordinates = zip(stage.model.coordinates, q, strict=True)
    bent = max(float(np.abs(x).max()) / lengths[n] for n, x in coordinates if n in lengths)
    if bent > BEND:
        raise StudyError(
            f"in {stage.duration:g} s the stage '{stage.name}' would bend a link by about "
            f"{bent:.2g} rad, and the reduced model is valid up to {BEND:g} rad; give a duration "
            f"of {np.ceil(10 * stage.duration * (bent / BEND) ** 0.5) / 10:g} s, or a stiffer arm",
            ExitCode.INFEASIBLE,
        )


def check_stiffness(stage: Stage) -> None:
    """Refuse an arm so stiff that no mesh resolves its modes within the stage.

    Raises
    ------
    StudyError
        With what would do.
    """
    fastest = float(reduced_modes(stage.model, stage.model.at(*stage.start))[0][-1])
    if fastest * stage.duration > MOST_PERIODS:
        # less time is a remedy only where the time is too long, and not the arm too stiff
        longest = MOST_PERIODS / fastest
        less = f", or at most {longest:.3g} s" if longest > LEAST_ADVISED else ""
        raise StudyError(
            f"the fastest mode of the arm is at {fastest:.3g} Hz, {fastest * stage.duration:.3g} "
            f"periods in {stage.duration:g} s, but the mesh resolves up to {MOST_PERIODS:g}; give "
            f"a lower modulus or thinner tubes{less}"
        )


def check_caps(stage: Stage, caps: TorqueCaps) -> None:
    """Refuse caps under which even the rigid arm cannot arrive, and say the least.

    Raises
    ------
    StudyError
        With the duration, or the cap, that is too low.
    """
    if len(stage.moving) > 1:
        return  # no bound in closed form
    k = stage.moving[0]
    _check_wheels(stage, caps)
    cap, rate = caps.torque[k], caps.rate[k]

    # full torque one way and then the other is the fastest that a rigid arm can do
    if cap is not None and stage.duration <= stage.least_duration(cap):
        raise StudyError(
            f"the stage '{stage.name}' lasts {stage.duration:g} s, but under {cap:g} N m even a "
            f"rigid arm takes more than {stage.least_duration(cap):.4g} s; give a longer duration "
            f"or a cap above {_RIGID_BOUND * stage.torque_units[k]:.4g} N m",
            ExitCode.INFEASIBLE,
        )

    if stage.satellite_inertia is not None and k == ELBOW:
        return  # its inertia changes on the way, and the rate has no bound in closed form
    # torque up, down through zero and up again at the rate's cap
    least = _RIGID_RATE * stage.torque_units[k] / stage.duration
    if rate is not None and rate <= least:
        raise StudyError(
            f"the rate cap is {rate:g} N m/s, but even a rigid arm needs more than {least:.4g} "
            f"N m/s to turn in {stage.duration:g} s; raise the cap or the duration",
            ExitCode.INFEASIBLE,
        )


def _check_wheels(stage: Stage, caps: TorqueCaps) -> None:
    """Refuse caps on what a held satellite takes that even the rigid arm breaks.

    Raises
    ------
    StudyError
        With the least cap.
    """
    law, k, T = quintic(stage.duration), stage.moving[0], stage.duration
    # the momentum is the rate of an integral over the angles, which is the same for any law
    times, weights = gauss_legendre(_INSTANTS)
    handed = feed_forward(stage, law)
    momentum = abs(float(weights @ ((1 - times) * handed(T * times)[ROOT]))) * T
    if caps.momentum is not None and caps.momentum <= momentum:
        raise StudyError(
            f"wheel_momentum is {caps.momentum:g} N m s, but even a rigid arm transfers more than "
            f"{momentum:.4g} N m s in {T:g} s; raise the cap or the duration",
            ExitCode.INFEASIBLE,
        )
    if k == ROOT and caps.root_moment is not None:
        least = _RIGID_BOUND * float(stage.torque_units[ROOT])
        if caps.root_moment <= least:
            raise StudyError(
                f"wheel_torque is {caps.root_moment:g} N m, but even a rigid arm needs more than "
                f"{least:.4g} N m in {T:g} s; raise the cap or the duration",
                ExitCode.INFEASIBLE,
            )
