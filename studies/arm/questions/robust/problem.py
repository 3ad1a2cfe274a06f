"""One motion for a spread of arms: copies with other stiffness and tip mass beside the nominal.

The nominal motion is that of least peak torque, as `antenna-ocp arm solve` finds it. The robust
one has, under a share of its peak torque, the least worst residual energy of that arm and its
copies after the lock; none of them needs to rest exactly. Torque and smoothness are stated as for
any other motion.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from models.arm.driven import DrivenArm
from ocp import Bound, Phase, Problem, Solution, Trajectory, Unknown
from ocp.solution.storage import packed, unpacked
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.optimal.objectives import SMOOTHING, StatedMotion
from studies.arm.optimal.phase import ArmPhase, Drives, smoothness, torque_signals
from studies.arm.optimal.refinement import refine
from studies.arm.optimal.solve import solve_stage, solved
from studies.arm.optimal.solver import robust_settings
from studies.arm.optimal.study_solver import Say, StudySolver
from studies.arm.questions.robust.copies import (
    ArmCopy,
    SampledMotion,
    angle_copy,
    other_torque_copy,
    replayed_motion,
    residual_energy,
    torque_copy,
)
from studies.arm.questions.robust.spread import Spread
from studies.arm.replay.full_model import Drive
from studies.arm.replay.reduced_model import NOMINAL, residuals, varied
from studies.arm.search_limits import CAP_CORRECTIONS, ROBUST_INTERVALS, ROBUST_MESHES
from studies.arm.stage import ELBOW, Stage, TorqueCaps
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.finished import FinishedSteps
from studies.common.processes.side_by_side import Part

SIZE = 1e-2  # typical sqrt(E_res) [sqrt(J)]
STILL = 0.05  # of it, below which a residual need not be less
_RIPPLE = 0.012  # share of the cap by which the torque ripples, per share of torque to spare
# of the nominal motion's worst sqrt(E_res), by which a replay may exceed what the solver believes:
# a quarter of what is asked of the robust motion
APART = 0.05
_OVERSHOOT = 1.2  # of an excess over the cap, by which the margin grows


def robust_statement(
    stage: Stage, start: SampledMotion, spread: Spread, cap: float
) -> StatedMotion:
    """The motion of least worst residual of an arm and its copies.

    Parameters
    ----------
    stage : Stage
    start : SampledMotion
        What the solver starts from.
    spread : Spread
        Its drive, and the copies.
    cap : float
        Largest torque [N m].
    """
    drives = torque_signals(stage, TorqueCaps((cap, cap)))
    arm = torque_copy(stage, drives, start)

    arms = [(stage, arm)]
    for number, (x, y) in enumerate(spread.design):
        other = dataclasses.replace(stage, arm=varied(stage.arm, spread.factors(x, y)))
        name = f" of copy {number}"
        if spread.drive == "torque":
            arms.append((other, other_torque_copy(other, drives, start, name)))
        else:
            arms.append((other, angle_copy(other, start, start.own[number], arm, name)))
    phase = _phase(stage, drives, start, [copy for _, copy in arms])

    # the worst residual as an unknown above all of them: a maximum is not smooth
    worst = Unknown("worst residual", "1e-2 sqrt(J)", STILL, guess=2.0, scale=1.0)
    bounds = arrival(stage, phase, arm)
    for number, (other, copy) in enumerate(arms):
        left = phase.at_end(residual_energy(other, copy) / SIZE**2)
        excess = left.symbol - worst.symbol**2
        bounds.append(Bound(f"residual of arm {number}", excess, upper=0.0, scale=1.0))

    # what an `OptimalMotion` reads: the drives; the copies' states do not matter to it
    driven = ArmPhase(phase, stage, q=(), v=(), drives=drives, acceleration=())
    goal = worst.symbol + SMOOTHING * smoothness(driven)
    name = f"{stage.name} arm, {spread.drive} drive"
    stated = Problem(name, [phase], bounds=bounds, minimise=goal)
    return StatedMotion(stated, (driven,), "worst residual")


def arrival(stage: Stage, phase: Phase, arm: ArmCopy) -> list[Bound]:
    """The joint of the nominal arm at its target and at rest."""
    angle = DrivenArm(stage.model).angle(arm.q)
    turn = ca.jtimes(angle, arm.q, arm.v)
    target = stage.end[stage.moving[0]]
    return [
        Bound("angle at the end", phase.at_end(angle).symbol, "rad", target, target, 1.0),
        Bound("rate at the end", phase.at_end(turn).symbol, "rad/s", 0, 0, 1.0 / stage.duration),
    ]


def _phase(stage: Stage, drives: Drives, start: SampledMotion, copies: Sequence[ArmCopy]) -> Phase:
    """From rest, of all copies under one drive."""
    joint = stage.moving[0]
    # only the drive has to rest at the end: what the copies do there is judged
    still = dict.fromkeys(drives.states, 0.0)
    dynamics: dict[Any, Any] = drives.dynamics
    initial: dict[Any, Any] = dict(still)
    guess: dict[Any, Any] = {
        drives.torque[joint]: (start.times, start.torque),
        drives.rate[joint]: (start.times, start.rate),
        drives.bend[joint]: 0.0,
    }

    for copy in copies:
        dynamics |= copy.dynamics
        initial |= copy.initial
        guess |= copy.guess

    return Phase(
        stage.name,
        dynamics=dynamics,
        initial=initial,
        final=still,
        start=0.0,
        end=stage.duration,
        guess=guess,
    )


def solve_nominal(stage: Stage, drive: Drive, solver: StudySolver | None = None) -> OptimalMotion:
    """The motion of least peak torque that leaves the nominal arm still.

    Raises
    ------
    StudyError
        If none is found, or the stage turns both joints.
    """
    if len(stage.moving) > 1:
        raise StudyError("a robust motion needs a stage that turns one joint; give big or small")
    found = solve_stage(stage.under(drive), objective="peak-torque", name="nominal", solver=solver)
    return refine(found, drive=drive, solver=solver).motion


def sought_motions(
    nominal: OptimalMotion, spread: Spread, shares: Sequence[float], live: Say
) -> list[SoughtMotion]:
    """The robust motions to be found, with shares of the nominal motion's peak torque."""
    stage, start = nominal.stage, replayed_motion(nominal, spread)
    peak = float(nominal.peak_torque[stage.moving[0]])
    worst = worst_of_its_arms(nominal, spread, live)
    return [SoughtMotion(stage, start, spread, share, peak, worst) for share in shares]


def robust_parts(
    sought: Sequence[SoughtMotion], intervals: int | None, kept: FinishedSteps
) -> list[Part]:
    """Parts that find the motions side by side; each raises a StudyError if it finds none."""
    return [
        kept.part(one.name, _solved_robust, one, intervals, kept.within(one.name)) for one in sought
    ]


def found_robust(sought: SoughtMotion, answer: tuple[float, bytes]) -> OptimalMotion:
    """A motion, from what came of its part."""
    cap, data = answer
    stated = robust_statement(sought.stage, sought.start, sought.spread, cap)
    solution = unpacked(data, known=stated.problem)
    assert isinstance(solution, Solution)
    return OptimalMotion(sought.name, stated, solution, SMOOTHING)


def worst_of_its_arms(motion: OptimalMotion, spread: Spread, live: Say) -> float:
    """Largest sqrt(E_res) [sqrt(J)] on B21 of the arms that a robust motion is made for."""
    arms = [NOMINAL, *(spread.factors(x, y) for x, y in spread.design)]
    return float(np.sqrt(residuals(motion.motion(spread.drive), arms, live=live).max()))


@dataclass(frozen=True, eq=False)
class SoughtMotion:
    """A robust motion to be found.

    Attributes
    ----------
    stage : Stage
    start : what the solver starts from.
    spread : Spread
    share : of the nominal motion's peak torque that it may take.
    peak : the nominal motion's peak torque [N m].
    worst : sqrt(E_res) that the nominal motion leaves in the arms of the robust one [sqrt(J)].
    """

    stage: Stage
    start: SampledMotion
    spread: Spread
    share: float
    peak: float
    worst: float

    @property
    def name(self) -> str:
        return f"robust, {self.share:g} x peak"


def _solved_robust(
    sought: SoughtMotion, intervals: int | None, kept: FinishedSteps, console: Console
) -> tuple[float, bytes]:
    """Solve `robust_statement` on meshes ever finer: the cap [N m] stated, and the solution.

    The solver uses what its mesh does not resolve: on too coarse a one it believes in arms at rest
    that still swing. So its own arms are replayed, and the mesh is halved until both agree. A finer
    mesh starts from the motion before, unless that leaves more than the nominal motion: it is then
    so far off that it says nothing of a finer mesh. The motion that leaves least is taken.
    """
    elbow = sought.stage.moving[0] == ELBOW
    count = intervals or ROBUST_INTERVALS[sought.spread.drive][elbow]
    margin = _RIPPLE * (sought.share - 1.0)
    least, found, guess = np.inf, None, None
    solver = StudySolver(console.progress, console.live, kept)

    for _ in range(ROBUST_MESHES):
        try:
            motion, margin = _under_cap(sought, count, margin, guess, solver)
        except StudyError as error:
            if found is None:
                raise
            console.progress(f"{sought.name}: the result of a coarser mesh is used: {error}")
            break
        left, believed = worst_of_its_arms(motion, sought.spread, console.live), motion.objective
        console.progress(
            f"{sought.name}: {count} intervals: worst sqrt(E_res) of its arms {left:.3g}, "
            f"{SIZE * believed:.3g} in the solver"
        )
        if left < least:
            least, found = left, (motion, _lowered(sought, margin))
        if left - SIZE * believed <= APART * sought.worst:
            break
        count, guess = 2 * count, motion.trajectory if left < sought.worst else None

    if found is None:
        raise StudyError(
            f"the residual energy of '{sought.name}' in the arms of the range cannot be computed, "
            "because their replay on B21 diverges; give a longer duration, or another arm",
            ExitCode.NOT_SOLVED,
        )
    motion, cap = found
    return cap, packed(motion.solution, known=motion.stated.problem)


def _under_cap(
    sought: SoughtMotion,
    intervals: int,
    margin: float,
    guess: Trajectory | None,
    solver: StudySolver,
) -> tuple[OptimalMotion, float]:
    """The motion on one mesh, and the part by which its cap was lowered.

    A share of the nominal motion's peak torque holds at the points of the mesh; it is lowered
    until it holds between them too. The more torque there is to spare, the more the torque ripples
    below it.
    """
    stage, cap = sought.stage, sought.share * sought.peak
    for _ in range(CAP_CORRECTIONS):
        used = margin
        stated = robust_statement(stage, sought.start, sought.spread, _lowered(sought, used))
        motion = solved(
            sought.name,
            stated,
            SMOOTHING,
            None,
            (intervals,),
            guess,
            solver,
            attempts=[(1.0, robust_settings())],
        )
        excess = float(motion.peak_torque[stage.moving[0]]) / cap - 1.0
        if excess <= 0.0:
            break
        margin, guess = used + _OVERSHOOT * excess, motion.trajectory
    return motion, used


def _lowered(sought: SoughtMotion, margin: float) -> float:
    """The cap of the points of the mesh [N m]."""
    return sought.share * sought.peak * (1.0 - margin)
