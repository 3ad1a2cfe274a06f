"""Robust motions beside the nominal one, over a spread of arms, on B21 and on the full model.

One robust motion may take a tenth more peak torque than the nominal one, the other no more.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from studies.arm.config import RobustStudy, as_dictionary
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.optimal.study_solver import StudySolver
from studies.arm.questions.robust.draws import draw_series, rates_in_words, rates_of
from studies.arm.questions.robust.problem import (
    SIZE,
    STILL,
    found_robust,
    robust_parts,
    solve_nominal,
    sought_motions,
)
from studies.arm.questions.robust.spread import SPREADS, WIDTH, Spread
from studies.arm.questions.robust.trials import (
    FULL,
    MASSES,
    ResidualMap,
    TriedArms,
    allowed,
    map_of,
    mass_parts,
    parts_of,
)
from studies.arm.replay.full_model import Drive
from studies.arm.report.profile import exported_motions, profile_check, profiles_series
from studies.arm.report.quantities import Metric, table_rows
from studies.arm.stage import JOINT_NAMES, Stage
from studies.common.comparison_table import costs_elsewhere
from studies.common.console import Console
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.common.folder import provenance
from studies.common.processes.side_by_side import Part, side_by_side
from studies.common.result import Criterion, Result, Series, Verdict, at_most

SHARES = (1.1, 1.0)  # peak torques of the robust motions over the nominal's; the first is judged
LIMIT = 0.2  # of the nominal's worst sqrt(E_res)
_TORQUE_SAMPLES = 2001


@dataclass(frozen=True, eq=False)
class Comparison:
    """Nominal and robust motions under one drive.

    Attributes
    ----------
    stage : Stage
    spread : Spread
    nominal : ResidualMap
    robust : in the order of `shares`.
    shares : peak torques over the nominal's.
    misses : angle miss [rad] of the first robust motion with another tip mass, by its factor.
    """

    stage: Stage
    spread: Spread
    nominal: ResidualMap
    robust: tuple[ResidualMap, ...]
    shares: tuple[float, ...]
    misses: Mapping[float, float]

    @property
    def maps(self) -> tuple[ResidualMap, ...]:
        """Of all motions, the nominal one first."""
        return (self.nominal, *self.robust)

    @property
    def holds(self) -> bool:
        """Whether the first robust motion's ratios are within the limit, and all caps are kept."""
        within = [
            robust.peak <= share * self.nominal.peak
            for robust, share in zip(self.robust, self.shares, strict=True)
        ]
        ratios = self.robust[0].ratios(self.nominal)
        return bool(max(ratios) <= self.limit and all(within))

    @property
    def limit(self) -> float:
        """Largest ratio of the first robust motion: `LIMIT`, or what makes its arms still."""
        worst = max(float(self.nominal.reduced.max()), float(self.nominal.full.max()))
        return max(LIMIT, STILL * SIZE / worst)


def compare(
    stage: Stage,
    drive: Drive,
    points: int,
    console: Console,
    *,
    draws: tuple[int, int] = (0, 1),
    intervals: int | None = None,
    shares: tuple[float, ...] = SHARES,
    kept: FinishedSteps = NOTHING_KEPT,
) -> Comparison:
    """Solve all motions and replay them over the spread.

    Parameters
    ----------
    stage : Stage
    drive : Drive
    points : int
        A side of the grid on B21.
    console : Console
        Where lines of progress go.
    draws : how many arms are drawn for the nominal and the first robust motion, and their seed.
    intervals : of the robust motions' mesh, optional.
    shares : peak torques of the robust motions over the nominal's.
    kept : where finished steps go to, and where those of an earlier run are read.
    """
    say, live = console.progress, console.live
    solver = StudySolver(say, live, kept.within("nominal"))
    spread, nominal = SPREADS[drive], solve_nominal(stage, drive, solver)
    joint = stage.moving[0]
    say(f"{nominal.name} motion: peak torque {nominal.peak_torque[joint]:.5g} N m")
    arms = TriedArms(spread, points)
    judged = dataclasses.replace(arms, drawn=spread.drawn(*draws))

    # each motion is replayed as soon as it is found, the nominal one while the others are sought
    sought, robust = sought_motions(nominal, spread, shares, live), dict[int, OptimalMotion]()
    tried = [judged, *itertools.repeat(arms, len(sought) - 1)]

    def replays(k: int, answer: Any) -> list[Part]:
        if k >= len(sought):
            return []
        robust[k] = found_robust(sought[k], answer)
        say(f"{sought[k].name} motion: {robust[k].peak_torque[joint]:.5g} N m")
        masses = mass_parts(robust[k], kept) if k == 0 else []
        return [*parts_of(robust[k], tried[k], kept), *masses]

    parts = [*robust_parts(sought, intervals, kept), *parts_of(nominal, judged, kept)]
    answers = side_by_side(parts, console, further=replays)
    for _ in sought:
        next(answers)
    of_nominal = map_of(nominal, judged, answers, say)
    of_robust = [map_of(robust[0], judged, answers, say)]
    misses = {mass: next(answers) for mass in MASSES}
    of_robust += [map_of(robust[k], tried[k], answers, say) for k in range(1, len(sought))]
    return Comparison(stage, spread, of_nominal, tuple(of_robust), shares, misses)


def find_robust(study: RobustStudy, console: Console, kept: FinishedSteps) -> Result:
    """Motions that leave a spread of arms most still, beside the nominal one.

    Raises
    ------
    StudyError
        If a motion is not found.
    """
    comparison = compare(
        study.slew,
        study.drive,
        study.points,
        console,
        draws=(study.draws, study.seed),
        kept=kept,
    )

    # the motion that is judged comes first, what it is compared with after it
    first, *others = comparison.robust
    ordered = (first, comparison.nominal, *others)
    profiles = {m.motion.name: m.profile for m in ordered}
    left = {m.motion.name: m.drawn for m in ordered[:2]} if study.draws else {}
    rows = table_rows({m.motion.name: _quantities(m, comparison) for m in ordered})
    return Result(
        kind="robust",
        question=study.question,
        configuration=as_dictionary(study),
        arrays=profiles_series(profiles) | _series(comparison) | draw_series(left),
        table=rows,
        verdict=Verdict(
            "local",
            "local: one optimum of the nominal arm and its copies from the nominal motion, "
            "replayed over the whole range; no other optimum was searched for",
        ),
        checks=(
            *_criteria(comparison),
            *(
                profile_check(p, allowed(p.exact.residual_energy), f"'{name}'")
                for name, p in profiles.items()
            ),
        ),
        costs_elsewhere=costs_elsewhere(rows),
        remarks=(*_remarks(comparison), *rates_in_words(left, study)),
        details={
            "stage": {
                "duration": comparison.stage.duration,
                "joint": JOINT_NAMES[comparison.stage.moving[0]],
            },
            "axes": comparison.spread.axes,
            "width": WIDTH,
            "design": comparison.spread.design,
            "points": {"B21": len(comparison.nominal.reduced), "full model": FULL},
            "motions": [_torque_law(m) for m in comparison.maps],
            "angle_miss_of_tip_mass_rad": comparison.misses,
            "rates": {name: dataclasses.asdict(one) for name, one in rates_of(left, study).items()},
            "profile_of": first.motion.name,
            **exported_motions(profiles),
        },
        provenance=provenance(),
    )


def _quantities(motion_map: ResidualMap, comparison: Comparison) -> list[Metric]:
    joint, nominal = comparison.stage.moving[0], comparison.nominal
    on_B21, on_full = motion_map.ratios(nominal)
    worst, worst_full = float(motion_map.reduced.max()), float(motion_map.full.max())
    share = motion_map.peak / nominal.peak
    root = "sqrt(J)"

    return [
        Metric("peak_torque", "peak torque", "N m", motion_map.peak),
        Metric("peak_ratio", "peak torque relative to the nominal", "1", share, "neither"),
        Metric("peak_rate", "peak torque rate", "N m/s", float(motion_map.motion.peak_rate[joint])),
        Metric("worst_B21", "worst sqrt(E_res) on B21", root, worst),
        Metric("ratio_B21", "the same relative to the nominal", "1", on_B21),
        Metric("worst_full", "worst sqrt(E_res), full model", root, worst_full),
        Metric("ratio_full", "the same relative to the nominal", "1", on_full),
        Metric(
            "nominal_arm", "sqrt(E_res) of the nominal arm, full model", root, motion_map.at_nominal
        ),
    ]


def _criteria(comparison: Comparison) -> tuple[Criterion, ...]:
    """The worst residual of the judged motion, and the caps of all."""
    judged = comparison.robust[0]
    ratio = max(judged.ratios(comparison.nominal))
    checks = [at_most(f"worst residual of '{judged.motion.name}'", "1", ratio, comparison.limit)]

    for motion_map, share in zip(comparison.robust, comparison.shares, strict=True):
        name = f"peak torque of '{motion_map.motion.name}'"
        checks.append(at_most(name, "N m", motion_map.peak, share * comparison.nominal.peak))
    return tuple(checks)


def _remarks(comparison: Comparison) -> tuple[str, ...]:
    size, (first, second) = len(comparison.nominal.reduced), comparison.spread.axes
    missed = ", ".join(f"x {mass:g}: {miss:.2g} rad" for mass, miss in comparison.misses.items())
    judged = comparison.robust[0].motion.name
    worse = [
        f"'{robust.motion.name}' has more residual energy than the nominal motion, which is better "
        "for this range"
        for robust in comparison.robust
        if max(robust.ratios(comparison.nominal)) > 1.0
    ]

    still = (
        [
            f"an arm counts as at rest with {(STILL * SIZE) ** 2:.2g} J or less: this is the limit "
            f"for '{judged}', {comparison.limit:.3g} of the worst sqrt(E_res) of the nominal motion"
        ]
        if comparison.limit > LIMIT
        else []
    )

    return (
        *worse,
        *still,
        f"worst over +-{WIDTH:.0%} of {first} and of {second}: {size} x {size} arms on B21, "
        f"{FULL} x {FULL} on the full ANCF model",
        "nominal: minimum peak torque, as in arm solve; robust: minimum worst residual of "
        f"{1 + len(comparison.spread.design)} arms, of which only the nominal one is on the grid",
        f"angle miss of '{judged}' with a wrong tip mass under torque drive: {missed}; the torque "
        "determines the momentum, and the inertia determines the resulting angle, so an open-loop "
        "law cannot remove this miss",
    )


def _torque_law(motion_map: ResidualMap) -> dict[str, object]:
    """The exact torque of a motion."""
    law = motion_map.motion.torques[motion_map.motion.stage.moving[0]]
    return {
        "name": motion_map.motion.name,
        "torque_breakpoints_s": law.x,
        "torque_coefficients": law.c,
        "root_E_res_B21": motion_map.reduced,
        "root_E_res_full": motion_map.full,
    }


def _series(comparison: Comparison) -> dict[str, Series]:
    """Torques along the time, and the residual maps along the arms of their grid."""
    times = np.linspace(0.0, comparison.stage.duration, _TORQUE_SAMPLES)
    arrays = {"figure/time": Series("s", "figure/time", times, "since the release")}
    for motion_map in comparison.maps:
        law = motion_map.motion.torques[comparison.stage.moving[0]]
        name = f"{motion_map.motion.name}: torque"
        arrays[name] = Series("N m", "figure/time", law(times), "of the joint that turns")

    for model, values in (
        ("B21", comparison.nominal.reduced),
        ("full model", comparison.nominal.full),
    ):
        axis = f"{model}: arm"
        numbers = np.arange(float(values.size))
        arrays[axis] = Series("1", axis, numbers, "rows of the grid, one after the other")
    for motion_map in comparison.maps:
        for model, values in (("B21", motion_map.reduced), ("full model", motion_map.full)):
            name = f"{motion_map.motion.name}: residual, {model}"
            root = values.ravel()
            arrays[name] = Series("sqrt(J)", f"{model}: arm", root, "sqrt(E_res) after the lock")
    return arrays
