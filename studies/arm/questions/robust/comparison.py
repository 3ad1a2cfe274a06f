"""Robust motions beside the nominal one, over a spread of arms, on B21 and on the full model.

One robust motion may take a tenth more peak torque than the nominal one, the other no more.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from models.ancf.integrate import StepControl
from studies.arm.optimal.solve import Solved
from studies.arm.questions.robust.copies import RATE
from studies.arm.questions.robust.problem import Mesh, mesh_of, solve_nominal, solve_robust
from studies.arm.replay.ensemble import residuals
from studies.arm.replay.full import Drive, Motion, replay
from studies.arm.replay.spread import SPREADS, WIDTH, Spread, varied
from studies.arm.stage import Stage
from studies.common.console import Table, number

Array = NDArray[np.float64]
Say = Callable[[str], None]
SHARES = (1.1, 1.0)  # peak torques of the robust motions over the nominal's; the first is judged
LIMIT = 0.2  # of the nominal's worst sqrt(E_res)
FULL = 3  # points a side on the full model
_REPLAY = StepControl(1e-8, stages=7)
_MASSES = (0.9, 1.1)


@dataclass(frozen=True, eq=False)
class Outcome:
    """A motion over the spread.

    Attributes
    ----------
    solved : Solved
    peak : largest torque [N m].
    reduced, full : (n, n), (k, k)
        sqrt(E_res) [sqrt(J)] on B21 and on the full model; the first axis is the first factor's.
    """

    solved: Solved
    peak: float
    reduced: Array
    full: Array

    @property
    def at_nominal(self) -> float:
        """sqrt(E_res) of the nominal arm on the full model, in the middle of the grid."""
        middle = len(self.full) // 2
        return float(self.full[middle, middle])

    def ratios(self, other: Outcome) -> tuple[float, float]:
        """Worst sqrt(E_res) over that of another motion, on B21 and on the full model."""
        return (
            float(self.reduced.max() / other.reduced.max()),
            float(self.full.max() / other.full.max()),
        )


@dataclass(frozen=True, eq=False)
class Comparison:
    """Nominal and robust motions under one drive; `robust` in the order of `shares`."""

    stage: Stage
    spread: Spread
    nominal: Outcome
    robust: tuple[Outcome, ...]
    shares: tuple[float, ...]

    @property
    def outcomes(self) -> tuple[Outcome, ...]:
        """All motions, the nominal one first."""
        return (self.nominal, *self.robust)

    @property
    def holds(self) -> bool:
        """Whether the first robust motion's ratios are within the limit, and all caps are kept."""
        joint = self.stage.moving[0]
        steepest = RATE * self.stage.torque_units[joint] / self.stage.duration
        rates = [x.solved.peak_rate[joint] <= steepest * (1 + 1e-9) for x in self.outcomes]
        within = [done.peak <= share * self.nominal.peak
                  for done, share in zip(self.robust, self.shares, strict=True)]  # fmt: skip
        return bool(max(self.robust[0].ratios(self.nominal)) <= LIMIT and all((*within, *rates)))


def compare(
    stage: Stage,
    drive: Drive,
    points: int,
    say: Say,
    live: Say,
    *,
    mesh: Mesh | None = None,
    shares: tuple[float, ...] = SHARES,
) -> Comparison:
    """Solve all motions and replay them over the spread.

    Parameters
    ----------
    stage : Stage
    drive : Drive
    points : int
        A side of the grid on B21.
    mesh : (intervals, degree), optional
    shares : peak torques of the robust motions over the nominal's.
    """
    spread, mesh = SPREADS[drive], mesh or mesh_of(stage)
    joint = stage.moving[0]
    nominal = solve_nominal(stage, mesh, live)
    motions = [nominal]
    say(f"{nominal.name} motion: peak torque {nominal.peak_torque[joint]:.5g} N m")
    for share in shares:
        motions.append(solve_robust(nominal, spread, share, mesh, live))
        say(f"{motions[-1].name} motion: {motions[-1].peak_torque[joint]:.5g} N m")
    found = [outcome(motion, drive, points, say, live) for motion in motions]
    return Comparison(stage, spread, found[0], tuple(found[1:]), shares)


def outcome(motion: Solved, drive: Drive, points: int, say: Say, live: Say) -> Outcome:
    """A motion over the spread."""
    joint, spread = motion.stage.moving[0], SPREADS[drive]
    given = motion.motion(drive)
    live(f"{motion.name}: {points} x {points} arms on B21")
    reduced = np.sqrt(residuals(given, spread.grid(points))).reshape(points, points)
    say(f"{motion.name}: worst sqrt(E_res) {reduced.max():.3e} on B21, {points} x {points} arms")
    full: list[float] = []
    for factors in spread.grid(FULL):
        live(f"{motion.name}: arm {len(full) + 1} of {FULL**2} on the full model")
        left = replay(of_arm(given, factors), settings=_REPLAY).residual_energy
        full.append(float(np.sqrt(left)))
    say(f"{motion.name}: worst sqrt(E_res) {max(full):.3e} on the full model, {len(full)} arms")
    return Outcome(
        motion, float(motion.peak_torque[joint]), reduced, np.array(full).reshape(FULL, FULL)
    )


def of_arm(motion: Motion, factors: tuple[float, float, float]) -> Motion:
    """The same drive on another arm."""
    other = dataclasses.replace(motion.stage, arm=varied(motion.stage.arm, factors))
    return dataclasses.replace(motion, stage=other)


def mass_misses(motion: Solved, live: Say) -> dict[float, float]:
    """Angle miss [rad] at the lock under torque drive with another tip mass, by factor."""
    given, found = motion.motion("torque"), {}
    for mass in _MASSES:
        live(f"{motion.name}: angle miss with {mass:g} of the tip mass")
        found[mass] = replay(of_arm(given, (1.0, 1.0, mass)), settings=_REPLAY).miss
    return found


def table(found: Comparison, misses: dict[float, float]) -> Table:
    """What `antenna-ocp robust` prints."""
    size, (first, second) = len(found.nominal.reduced), found.spread.axes
    missed = ", ".join(f"x {mass:g}: {miss:.2g} rad" for mass, miss in misses.items())
    judged = found.robust[0].solved.name
    notes = (
        f"worst sqrt(E_res) [sqrt(J)] over +-{WIDTH:.0%} of {first} and of {second}: {size} x "
        f"{size} arms on B21,",
        f"{FULL} x {FULL} on the full ANCF model; limit of the ratios of '{judged}' {LIMIT:g}",
        "nominal: least peak torque, elastic rest; robust: least worst residual of "
        f"{1 + len(found.spread.design)} arms, none",
        f"of them but the nominal one on the grid; torque rate at most {RATE:g} J D/T^3 in all",
        f"angle miss of '{judged}' with a wrong tip mass under torque drive: {missed}",
        "the torque alone decides the momentum, the inertia what angle that becomes: no law that "
        "does not see the arm removes it",
    )
    title = f"{found.stage.name} arm, {found.stage.duration:g} s, {found.spread.drive} drive"
    head = ("motion", "peak [N m]", "/ nominal", "worst, B21", "ratio", "worst, full", "ratio",
            "nominal arm, full")  # fmt: skip
    return Table(title, head, [_row(done, found.nominal) for done in found.outcomes], notes)


def _row(done: Outcome, nominal: Outcome) -> list[str]:
    ratios = ("", "") if done is nominal else [number(x, 3) for x in done.ratios(nominal)]
    return [
        done.solved.name, number(done.peak), number(done.peak / nominal.peak),
        number(float(done.reduced.max()), 3), ratios[0],
        number(float(done.full.max()), 3), ratios[1], number(done.at_nominal, 2),
    ]  # fmt: skip
