"""The robust motion beside the nominal one, over a spread of arms, on B21 and on the full model.

Either is the motion of least peak torque, for the nominal arm alone or for its copies too. At the
nominal's own peak there is no other motion; the robust one may take a tenth more.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from models.ancf.integrator import Settings
from studies.arm.lanes import residuals
from studies.arm.optimum import Solved
from studies.arm.replay import Drive, Motion, replay
from studies.arm.robust import MESH, RATE, solved
from studies.arm.spread import SPREADS, WIDTH, Spread, varied
from studies.arm.stage import Stage
from studies.console import Table, number

Array = NDArray[np.float64]
Say = Callable[[str], None]
MORE = 1.1  # peak torque of the robust motion over the nominal's
LIMIT = 0.2  # of the nominal's worst sqrt(E_res)
FULL = 3  # points a side on the full model
_REPLAY = Settings(1e-8, stages=7)
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
    at_nominal : sqrt(E_res) of the nominal arm on the full model.
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


@dataclass(frozen=True, eq=False)
class Comparison:
    """Nominal and robust motion under one drive."""

    stage: Stage
    spread: Spread
    nominal: Outcome
    robust: Outcome

    @property
    def ratios(self) -> tuple[float, float]:
        """Worst sqrt(E_res) of the robust motion over the nominal's, on B21 and on the full one."""
        ours, theirs = self.robust, self.nominal
        return (
            float(ours.reduced.max() / theirs.reduced.max()),
            float(ours.full.max() / theirs.full.max()),
        )

    @property
    def holds(self) -> bool:
        """Whether both ratios are within the limit, and peak and rate within their caps."""
        within = self.robust.peak <= MORE * self.nominal.peak
        joint = self.stage.moving[0]
        cap = RATE * self.stage.torque_units[joint] / self.stage.duration
        rates = [x.solved.peak_rate[joint] <= cap * (1 + 1e-9) for x in (self.nominal, self.robust)]
        return bool(max(self.ratios) <= LIMIT and within and all(rates))


def compare(
    stage: Stage,
    drive: Drive,
    points: int,
    say: Say,
    live: Say,
    mesh: tuple[int, int] = MESH,
) -> Comparison:
    """Solve both motions and replay them over the spread.

    Parameters
    ----------
    stage : Stage
    drive : Drive
    points : int
        A side of the grid on B21.
    mesh : (intervals, degree)
    """
    spread = SPREADS[drive]
    found = []
    for name in ("nominal", "robust"):
        copied = name == "robust"
        motion = solved(stage, spread, copied=copied, mesh=mesh, name=name, progress=live)
        say(f"{name} motion: peak torque {motion.peak_torque[stage.moving[0]]:.5g} N m")
        found.append(outcome(motion, drive, points, say))
    return Comparison(stage, spread, *found)


def outcome(motion: Solved, drive: Drive, points: int, say: Say) -> Outcome:
    """A motion over the spread."""
    joint, spread = motion.stage.moving[0], SPREADS[drive]
    given = motion.motion(drive)
    reduced = np.sqrt(residuals(given, spread.grid(points))).reshape(points, points)
    say(f"{motion.name}: worst sqrt(E_res) {reduced.max():.3e} on B21, {points} x {points} arms")
    full = np.array([
        np.sqrt(replay(of_arm(given, f), settings=_REPLAY).residual_energy)
        for f in spread.grid(FULL)
    ]).reshape(FULL, FULL)  # fmt: skip
    say(f"{motion.name}: worst sqrt(E_res) {full.max():.3e} on the full model, {full.size} arms")
    return Outcome(motion, float(motion.peak_torque[joint]), reduced, full)


def of_arm(motion: Motion, factors: tuple[float, float, float]) -> Motion:
    """The same drive on another arm."""
    other = dataclasses.replace(motion.stage, arm=varied(motion.stage.arm, factors))
    return dataclasses.replace(motion, stage=other)


def mass_misses(motion: Solved) -> dict[float, float]:
    """Angle miss [rad] at the lock under torque drive with another tip mass, by factor."""
    given = motion.motion("torque")
    return {
        mass: replay(of_arm(given, (1.0, 1.0, mass)), settings=_REPLAY).miss for mass in _MASSES
    }


def table(found: Comparison, misses: dict[float, float]) -> Table:
    """What `antenna-ocp arm-robust` prints."""
    nominal, robust = found.nominal, found.robust
    size, (first, second) = len(nominal.reduced), found.spread.axes
    missed = ", ".join(f"x {mass:g}: {miss:.2g} rad" for mass, miss in misses.items())
    notes = (
        f"worst sqrt(E_res) [sqrt(J)] over +-{WIDTH:.0%} of {first} and of {second}:",
        f"{size} x {size} arms on B21, {FULL} x {FULL} on the full ANCF model; limit of the ratio "
        f"{LIMIT:g}",
        f"torque rate at most {RATE:g} J D/T^3; at equal peak there is only the nominal motion, "
        "ratio 1",
        f"angle miss of the {robust.solved.name} motion with a wrong tip mass under torque drive: "
        f"{missed}",
        "the torque alone decides the momentum, the inertia what angle that becomes: no law that "
        "does not see the arm removes it",
    )
    title = f"{found.stage.name} arm, {found.stage.duration:g} s, {found.spread.drive} drive"
    head = ("motion", "peak [N m]", "/ nominal", "worst, B21", "ratio", "worst, full", "ratio",
            "nominal arm")  # fmt: skip
    rows = [_row(nominal, nominal.peak, None), _row(robust, nominal.peak, found.ratios)]
    return Table(title, head, rows, notes)


def _row(done: Outcome, peak: float, ratios: tuple[float, float] | None) -> list[str]:
    first, second = ("", "") if ratios is None else (number(ratio, 3) for ratio in ratios)
    return [
        done.solved.name, number(done.peak), number(done.peak / peak),
        number(float(done.reduced.max()), 3), first,
        number(float(done.full.max()), 3), second, number(done.at_nominal, 2),
    ]  # fmt: skip


def figure(found: Comparison) -> Figure:
    """Worst residual along each factor, whatever the other one is, of both motions."""
    drawn = Figure(figsize=(10, 4), layout="constrained")
    panels = drawn.subplots(1, 2, sharey=True)
    for axis, (panel, name) in enumerate(zip(panels, found.spread.axes, strict=True)):
        for done, colour in ((found.nominal, "#d1495b"), (found.robust, "#0b5fa5")):
            for values, style in ((done.reduced, "-"), (done.full, "o")):
                side = np.linspace(1 - WIDTH, 1 + WIDTH, len(values))
                model = "B21" if style == "-" else "full model"
                label = f"{done.solved.name}, {model}"
                panel.semilogy(side, values.max(axis=1 - axis), style, color=colour, label=label)
        panel.set_xlabel(f"factor on {name}")
        panel.grid(alpha=0.3)
    panels[0].set_ylabel("worst sqrt(E_res) [sqrt(J)]")
    panels[0].legend()
    drawn.suptitle(f"{found.stage.name} arm, {found.spread.drive} drive")
    return drawn
