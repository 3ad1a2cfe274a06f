"""What each stage does in a given time: its best motion, and how much of its caps that uses."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from models.ancf.joints.angles import joint_angles
from models.laws import Law
from models.ring_on_arm import ArmMotion
from models.truss import least_peak_reaction
from models.turn import least_torque_bound, turn_response
from ocp import (
    AdaptiveMesh,
    Interrupted,
    OcpError,
    Problem,
    Settings,
    Solution,
    peak,
    solve,
)
from ocp.arrays import Array
from ocp.solution.storage import packed, unpacked
from studies.arm.config import ArmStudy
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.optimal.objectives import StatedMotion, problem
from studies.arm.optimal.refinement import aimed_at_rest, refine
from studies.arm.optimal.rounds import MISS
from studies.arm.optimal.solve import solve_again, solve_stage
from studies.arm.optimal.study_solver import StudySolver
from studies.arm.replay.full_model import LockedMotion
from studies.arm.replay.loads import loads
from studies.arm.stage import ROOT, Stage, TorqueCaps
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.mission.config import MissionStudy
from studies.truss.config import TrussStudy
from studies.truss.expressions import Instant
from studies.truss.limits.caps import Caps
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import law_of
from studies.truss.motions.starts import StartingMotion, from_neighbour, starting_motion
from studies.truss.problem import ROUGHLY_WITH_ARM, settings_of, state
from studies.truss.quantities import OBJECTIVES, QUANTITIES
from studies.truss.search.smoothness import first_price
from studies.turn.motion import best_turn
from studies.turn.problem import rows_of

OBJECTIVE = "peak-torque"  # of an arm
ARMS = {"big arm": "big", "small arm": "small"}
TURN, RING = "turn", "ring"
STAGES = ("big arm", TURN, "small arm", RING)
SAMPLES = 1001  # of a stage's histories
# relative change of an arm's duration, up to which its mesh and smoothness serve, and where a finer
# mesh was tried, on which the full model did not rest
NEAR, NEARLY_SAME = 0.05, 0.01
# Of a ring on its arm, whose part of the caps is compared with other stages' to 2e-3: with a
# smoothness that is heavier than a study's own it takes half of the time.
HEAVIER = 100.0
ALLOWED = 0.3  # part of the cap on the residual energy that a motion of least torque may leave


@dataclass(frozen=True)
class Use:
    """A quantity of a stage beside its cap.

    Attributes
    ----------
    counts : whether time is shared out by it: what an arm leaves counts where it was refined, and
        is chance where it was not.
    limit : whether it is a limit that the motion was planned under: how much of it is used then
        says nothing.
    """

    title: str
    unit: str
    value: float
    cap: float
    counts: bool = True
    limit: bool = False

    @property
    def share(self) -> float:
        """Part of the cap that is used."""
        return self.value / self.cap


@dataclass(frozen=True, eq=False)
class ArmStart:
    """A motion of an arm's stage from which those of nearly the same duration begin.

    Attributes
    ----------
    duration : of the motion [s].
    refined_in : duration [s] in which mesh and smoothness were chosen.
    finest : whether on the finest mesh tried; a finer one may do better in another duration.
    weight : of the smoothness.
    solution : as files hold it, without its problem.
    """

    duration: float
    refined_in: float
    weight: float
    solution: bytes
    finest: bool = True

    def near(self, duration: float) -> bool:
        """Whether mesh and smoothness are as good for another duration [s]."""
        return abs(duration / self.refined_in - 1.0) <= (NEAR if self.finest else NEARLY_SAME)


@dataclass(frozen=True, eq=False)
class StageMotion:
    """The best motion of a stage in a time.

    Attributes
    ----------
    name : of the stage.
    duration : [s].
    uses : of its caps.
    passed : whether its own checks passed.
    history : time [s], angle [rad], torque [N m] or rope force [N], and of the ring its reaction;
        moment and momentum at the root [N m, N m s] and the satellite's turn [rad].
    deployment : of the ring; None of an arm.
    start : of an arm that was refined; None of others.
    """

    name: str
    duration: float
    uses: tuple[Use, ...]
    passed: bool
    history: Mapping[str, Array]
    deployment: Deployment | None = None
    start: ArmStart | None = None

    @property
    def utilisation(self) -> float:
        """Largest part of a cap that is used."""
        return self.governing.share

    @property
    def governing(self) -> Use:
        """What is used most."""
        return max((use for use in self.uses if not use.limit), key=lambda use: use.share)

    @property
    def shared_by(self) -> float:
        """Largest part of a cap by which time is shared out."""
        return max(use.share for use in self.uses if use.counts and not use.limit)


def move(study: MissionStudy, name: str, duration: float, console: Console) -> StageMotion:
    """The best motion of a stage in a time.

    Raises
    ------
    StudyError
        If there is none.
    """
    if name == RING:
        return move_ring(study, duration, None, console)
    if name == TURN:
        return _turn(study, duration, console)
    return _arm(study, name, duration, console)


def rigid_duration(study: MissionStudy, name: str) -> float:
    """A time of the right size for a stage to use its caps [s]: that of rigid bodies."""
    if name == RING:
        return math.sqrt(least_peak_reaction(study.truss, 1.0) / study.reaction)
    if name == TURN:
        asked = study.turn(1.0)
        return math.sqrt(least_torque_bound(asked.parameters, asked.angle, 1.0) / asked.torque)
    stage = _slew(study, name)
    return stage.least_duration(_torque_cap(study, name))


def _slew(study: MissionStudy, name: str, duration: float | None = None) -> Stage:
    """The stage of an arm, in a time or its own [s]."""
    return ArmStudy(
        stage=ARMS[name],
        duration=duration,
        arm=study.arm,
        satellite_inertia=study.satellite_inertia,
    ).slew


def _of_the_wheels(study: MissionStudy, history: Mapping[str, Array]) -> tuple[Use, ...]:
    """What a held satellite takes of the caps of its wheels."""
    caps = (
        ("moment", "peak moment about the root", "N m", study.wheel_torque),
        ("momentum", "peak angular momentum at the root", "N m s", study.wheel_momentum),
    )
    return tuple(
        Use(title, unit, float(np.abs(history[name]).max()), cap)
        for name, title, unit, cap in caps
        if cap is not None
    )


def _torque_cap(study: MissionStudy, name: str) -> float:
    return study.big_torque if ARMS[name] == "big" else study.small_torque


def move_from(
    study: MissionStudy, name: str, duration: float, start: ArmStart, console: Console
) -> StageMotion:
    """The same for an arm, from its motion of nearly the same duration.

    Mesh and smoothness are those of that motion. Where the full model does not come to rest so, the
    stage is moved and refined as if nothing were known.

    Raises
    ------
    StudyError
        If there is none.
    """
    known = _stated(study, name, start.duration)
    solution = unpacked(start.solution, known=known.problem)
    assert isinstance(solution, Solution)
    before = OptimalMotion("optimum", known, solution, start.weight)
    aim = np.zeros(2 * known.stage.model.size)
    residual, solver = ALLOWED * study.residual_energy, StudySolver(live=console.live)

    try:
        motion = solve_again(
            before,
            weight=start.weight,
            aim=aim,
            stated=_stated(study, name, duration),
            solver=solver,
        )
        found, _ = aimed_at_rest(motion, aim, residual=residual, solver=solver)
    except StudyError:
        return _arm(study, name, duration, console)

    if not found.still or found.replay.miss > MISS:
        return _arm(study, name, duration, console)
    return _arm_motion(
        study,
        name,
        found.motion,
        found.replay,
        passed=True,
        refined_in=start.refined_in,
        finest=start.finest,
    )


def _stated(study: MissionStudy, name: str, duration: float) -> StatedMotion:
    """The problem of an arm's stage in a time."""
    slew = _slew(study, name, duration)
    return problem(slew.under("torque"), TorqueCaps(), OBJECTIVE, shared=_caps(study, slew, name))


def _caps(study: MissionStudy, slew: Stage, name: str) -> TorqueCaps:
    """Caps whose largest part is least: of a driven root the moment is the torque itself."""
    cap, wheels = _torque_cap(study, name), study.wheel_torque
    if slew.moving[0] == ROOT and wheels is not None:
        cap, wheels = min(cap, wheels), None
    return TorqueCaps((cap, cap), root_moment=wheels, momentum=study.wheel_momentum)


def _arm(study: MissionStudy, name: str, duration: float, console: Console) -> StageMotion:
    """Least largest part of its caps from rest to rest, replayed and locked on the full model."""
    slew, solver = _slew(study, name, duration), StudySolver(live=console.live)
    motion = solve_stage(
        slew.under("torque"),
        objective=OBJECTIVE,
        shared=_caps(study, slew, name),
        intervals=study.intervals or None,
        solver=solver,
    )
    if not study.refine:
        return _arm_motion(study, name, motion, motion.replay(), passed=True)
    # a refinement is as rough as its residual allows, so that little of the cap is allowed
    residual = ALLOWED * study.residual_energy
    refined = refine(motion, residual=residual, solver=solver)
    passed = refined.still and refined.settled
    finest = refined.motion.intervals == max(entry.intervals for entry in refined.rounds)
    return _arm_motion(
        study,
        name,
        refined.motion,
        refined.replay,
        passed=passed,
        refined_in=duration if passed else None,
        finest=finest,
    )


def _arm_motion(
    study: MissionStudy,
    name: str,
    motion: OptimalMotion,
    replayed: LockedMotion,
    *,
    passed: bool,
    refined_in: float | None = None,
    finest: bool = True,
) -> StageMotion:
    """What a motion of an arm uses, and where others begin if it was refined."""
    joint, duration = motion.stage.moving[0], motion.stage.duration
    history = _arm_history(motion, replayed, joint)
    uses = (
        Use("peak torque", "N m", float(motion.peak_torque[joint]), _torque_cap(study, name)),
        Use("residual energy", "J", replayed.residual_energy, study.residual_energy, study.refine),
        *_of_the_wheels(study, history),
    )
    start = None
    if refined_in is not None:
        solution = packed(motion.solution, known=motion.stated.problem)
        start = ArmStart(duration, refined_in, motion.weight, solution, finest)
    return StageMotion(name, duration, uses, passed, history, start=start)


def _arm_history(motion: OptimalMotion, replayed: LockedMotion, joint: int) -> dict[str, Array]:
    """Angle of the joint on the full model, its torque, and what satellite and root do.

    All at even times until the lock.
    """
    run, history = replayed.run.before, loads(replayed)
    until, turning = history.until, replayed.satellite
    times = np.linspace(0.0, motion.stage.duration, SAMPLES)
    angles = np.unwrap(joint_angles(run.chain, run.q)[joint])
    # the folded elbow may be read as half a turn to the other side
    angles += 2 * math.pi * round((motion.stage.start[joint] - angles[0]) / (2 * math.pi))
    return {
        "time": times,
        "angle": np.interp(times, run.times, angles),
        "drive": motion.torques[joint](times),
        "moment": np.interp(times, history.times[:until], history.moment[:until]),
        "momentum": np.interp(times, history.times[:until], history.angular_momentum[:until]),
        "turn": 0 * times if turning is None else np.interp(times, run.times, turning.turn),
    }


def _turn(study: MissionStudy, duration: float, console: Console) -> StageMotion:
    """Least of the parts of the caps on torque and momentum; antenna and drive come to rest."""
    asked = study.turn(duration)
    best = best_turn(asked, console)
    moved = turn_response(asked.parameters, *rows_of(best.drive(), SAMPLES))
    J, H = asked.parameters.inertia, asked.satellite_inertia
    history = {
        "time": moved.time,
        "angle": moved.antenna_angle,
        "drive": moved.torque,
        "moment": moved.torque,
        "momentum": J * moved.antenna_rate,
        "turn": 0 * moved.time if H is None else -J / H * moved.antenna_angle,
    }

    pushed = float(np.abs(moved.drive_acceleration).max())
    uses = (
        Use("peak torque", "N m", float(np.abs(moved.torque).max()), study.turn_torque),
        # planned at rest, by a drive that switches between its limits
        Use("residual energy", "J", moved.energy[-1], study.residual_energy, limit=True),
        Use("peak drive acceleration", "rad/s^2", pushed, study.turn_acceleration, limit=True),
        *_of_the_wheels(study, history),
    )
    return StageMotion(TURN, duration, uses, best.solution.verification.passed, history)


def move_ring(
    study: MissionStudy, duration: float, before: Law | None, console: Console
) -> StageMotion:
    """Least of the largest part of the caps on forces and wheels; the arm is left at rest.

    Parameters
    ----------
    before : motion of the ring in another duration to start from; None for the Bezier law.

    Raises
    ------
    StudyError
        If there is none.
    """
    truss = _ring_study(study, duration)
    start = starting_motion("bezier", truss) if before is None else from_neighbour(before, truss)
    # a mission has no budget of time, so that its answer is the same on a slower machine
    settings = dataclasses.replace(settings_of(truss, True, ROUGHLY_WITH_ARM), seconds=None)
    return _ring_motion(study, truss, start, settings, console)


def move_ring_alone(study: MissionStudy, duration: float, console: Console) -> StageMotion:
    """The same of a ring whose fixed bar is held, which leaves in the arm what it leaves.

    Nothing is known there of what the root passes on.
    """
    truss = dataclasses.replace(_ring_study(study, duration), arm=None, caps=Caps(jerk=study.jerk))
    settings = Settings(intervals=20, refinement=AdaptiveMesh(move_breakpoints=False))
    return _ring_motion(study, truss, starting_motion("bezier", truss), settings, console)


def _ring_study(study: MissionStudy, duration: float) -> TrussStudy:
    """The ring's stage as a study of the truss."""
    return TrussStudy(
        minimise="peak-force",
        duration=duration,
        caps=Caps(jerk=study.jerk, residual_energy=study.residual_energy),
        truss=study.truss,
        arm=study.carrier,
    )


def _ring_motion(
    study: MissionStudy,
    truss: TrussStudy,
    start: StartingMotion,
    settings: Settings,
    console: Console,
) -> StageMotion:
    caps = {"peak-force": study.rope_force, "peak-reaction": study.reaction}
    wheels = {"peak-root-moment": study.wheel_torque, "peak-root-momentum": study.wheel_momentum}
    taken = {key: cap for key, cap in wheels.items() if cap is not None and truss.arm is not None}
    weights = dict.fromkeys(OBJECTIVES, 1.0)
    heavier = 1.0 if truss.arm is None else HEAVIER
    price = heavier * first_price(truss, 0, weights, with_forces=True) / study.rope_force
    statement = state(truss, start, weights, with_forces=True, price=price)

    pieces: list[tuple[Any, Any]] = []
    for phase, net in zip(statement.phases, statement.nets, strict=True):
        at, shared = Instant(truss, statement.signals, net), (caps | taken).items()
        pieces += [(phase, QUANTITIES[key].expression(at)[0] / cap) for key, cap in shared]
    objective = peak(*pieces, name="utilisation", absolute=True)
    if statement.price is not None:
        objective = objective + statement.price.symbol * statement.roughness
    stated = Problem("ring", statement.phases, minimise=objective, links=statement.links)

    try:
        solution: Solution = solve(stated, settings=settings, progress=console.live, partial=False)
    except Interrupted as stop:
        raise KeyboardInterrupt from stop
    except OcpError as error:
        raise StudyError(
            f"no motion of the ring in {start.duration:.4g} s was found: {error}",
            ExitCode.NOT_SOLVED,
        ) from error
    law = law_of(truss, statement, solution)
    deployment = Deployment("optimal", law, study.truss, carrier=truss.ring_on_arm)
    uses = [
        Use(QUANTITIES[key].title, QUANTITIES[key].unit, deployment.values[key], cap)
        for key, cap in caps.items()
    ]
    if deployment.arm is not None:
        left = deployment.arm.residual_energy
        uses.append(Use("residual energy", "J", left, study.residual_energy, limit=True))
    passed = solution.verification.passed
    history = ring_history(deployment)
    if deployment.arm is not None:
        uses += _of_the_wheels(study, history)
    return StageMotion(RING, law.duration, tuple(uses), passed, history, deployment)


def ring_history(deployment: Deployment) -> dict[str, Array]:
    """Angle, rope force and reaction of a law of the ring at even times."""
    times = np.linspace(0.0, deployment.law.duration, SAMPLES)
    motion, truss = deployment.at(times)
    return {
        "time": times,
        "angle": motion.angle,
        "drive": truss.rope_force,
        "reaction": truss.reaction_force,
        **({} if (arm := deployment.arm) is None else _at_the_root(arm, times)),
    }


def _at_the_root(arm: ArmMotion, times: Array) -> dict[str, Array]:
    return {
        "moment": arm.root_moment(times),
        "momentum": arm.angular_momentum(times),
        "turn": arm.satellite_turn(times),
    }
