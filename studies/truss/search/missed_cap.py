"""A cap that may be missed: soon told from the least found of what it is on, under the others.

Where a cap is missed by little, no start finds a motion, and each takes long to fail. The least of
what the cap is on is found fast.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable
from dataclasses import dataclass, replace

from ocp import Interrupted, OcpError, Trial, audit
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.rounding import down, up
from studies.margin.travel import KINDS
from studies.truss.config import TrussStudy
from studies.truss.limits.caps import CURVE, HARD, cap_on, without_cap
from studies.truss.motions.deployment import travel_of
from studies.truss.motions.starts import first_of_each_kind
from studies.truss.quantities import QUANTITIES, Quantity
from studies.truss.search.best_motion import BestMotion
from studies.truss.search.from_starts import Starts
from studies.truss.search.question import Question

# Iterations after which the first start under a cap of `HARD` counts as hard, and the least of what
# the cap is on is looked for before anything else: 3 to 5 s. Most motions take 100 to 220.
SOON = 800
_MORE_TIME = 3.0  # times the longest duration, up to which a motion under all caps is looked for
CLEARLY = 1e-3  # relative, by which the least that was found has to be above a cap


class CapsMissedError(StudyError):
    """The least found of what a cap is on, under the other caps, is more than that cap."""


@dataclass(frozen=True)
class HardCap:
    """The cap whose quantity is minimised where no motion is found.

    Attributes
    ----------
    key : of the quantity.
    value : the cap.
    """

    key: str
    value: float

    @property
    def quantity(self) -> Quantity:
        """What it is on."""
        return QUANTITIES[self.key]

    @property
    def enough(self) -> float:
        """The least that does not tell that the cap is missed."""
        return self.value * (1 + CLEARLY)

    def lifted(self, study: TrussStudy, seconds: float) -> TrussStudy:
        """The study of the least under the other caps, from one start of each kind."""
        starts = first_of_each_kind(study.solver.starts)
        return replace(
            without_cap(study, self.key),
            minimise=self.key,
            solver=replace(study.solver, starts=starts, seconds=seconds),
        )

    def check(self, study: TrussStudy, least: BestMotion) -> None:
        """Refuse a cap that is below the least found, by each start.

        Raises
        ------
        CapsMissedError
            With that least.
        """
        value, unit = least.deployment.values[self.key], self.quantity.unit
        if value <= self.enough or any(trial.error is not None for trial in least.trials):
            return
        count = len(least.trials)
        raise CapsMissedError(
            f"no motion was found: the minimum {self.quantity.title} found under the other caps "
            f"is {up(value)} {unit} (local: best of {count} start{'s' * (count > 1)}), above its "
            f"cap of {self.value:g} {unit}; raise this cap above the minimum found, or relax "
            f"another cap{self.margins_in_words(least)}{curve_in_words(study)}; this is no proof "
            "that there is none",
            ExitCode.NOT_SOLVED,
        )

    def needed(self, least: BestMotion) -> str:
        """What would have to be allowed, by the motion with the least of it."""
        value = least.deployment.values[self.key]
        title, unit = self.quantity.title, self.quantity.unit
        if value <= self.value:
            return f"a motion with a {title} of {value:.6g} {unit} meets the caps"
        return (
            f"the minimum {title} found under the other caps is {up(value)} {unit} (local): raise "
            f"its cap to this value, or relax another cap{self.margins_in_words(least)}"
        )

    def margins_in_words(self, least: BestMotion) -> str:
        """The margins to ask for, where these are what is missed; else nothing."""
        travel = travel_of(least.deployment) if self.key == "peak-stall-force" else None
        if travel is None:
            return ""
        margins = []
        for kind in KINDS:
            case, k = travel.worst(kind)
            margins.append(f"{down(100 * case.margins[kind][k], 3)} %")
        return (
            f"; the motion with this minimum keeps margins of {margins[0]} at rest and "
            f"{margins[1]} in motion"
        )


def hard_caps(study: TrussStudy) -> tuple[HardCap, ...]:
    """All caps in `HARD` that a study has."""
    caps = ((key, cap_on(study.caps, study.drive, key)) for key in HARD)
    return tuple(HardCap(key, cap) for key, cap in caps if cap is not None)


def hard_cap(study: TrussStudy) -> HardCap | None:
    """The first of them."""
    return next(iter(hard_caps(study)), None)


def together(
    study: TrussStudy, least: Callable[[TrussStudy, str], float | None], seconds: float
) -> CapsMissedError:
    """Several caps that no motion was found to keep: each with its least, alone and beside others.

    Parameters
    ----------
    least : callable
        The least value found for a quantity in a study that minimises it; None if none was found.
    seconds : float
        That each search may take [s].
    """
    caps = hard_caps(study)
    lines = ["cap: given value, minimum with this cap alone, minimum with all caps"]
    one_is_enough, raised = False, ""
    for cap in caps:
        alone = cap.lifted(study, seconds)
        for other in caps:
            alone = without_cap(alone, other.key)
        values = [least(case, cap.key) for case in (alone, cap.lifted(study, seconds))]
        words = ", ".join("none found" if value is None else up(value) for value in values)
        unit = cap.quantity.unit
        if values[0] is not None and values[0] > cap.enough:
            raised += f", the cap on the {cap.quantity.title} to more than {up(values[0])} {unit}"
        one_is_enough |= values[1] is not None
        lines.append(f"  {cap.quantity.title} [{unit}]: {cap.value:g}, {words}")

    low, high = study.duration
    patient = replace(study, minimise="time", duration=(low, _MORE_TIME * high))
    options = replace(study.solver, starts=first_of_each_kind(study.solver.starts), seconds=seconds)
    enough = least(replace(patient, solver=options), "time")
    remedy = f"relax at least two of these caps{raised}"
    if one_is_enough:
        remedy = "raise a cap above the last number of its line"
    if enough is not None and enough > high:
        remedy += f", or allow more than {high:g} s: a motion of {up(enough)} s keeps all of them"
    return CapsMissedError(
        "\n".join(
            [
                "no motion was found that keeps all of these caps (this is no proof that there is "
                "none)",
                *lines,
                f"{remedy}{curve_in_words(study)}",
            ]
        ),
        ExitCode.NOT_SOLVED,
    )


def curve_in_words(study: TrussStudy) -> str:
    """What to say of the torque-speed curve where another cap is the one to raise."""
    if cap_on(study.caps, study.drive, CURVE) is None:
        return ""
    return (
        "; the torque-speed curve applies as well: use a stronger motor, another gear ratio or a "
        "longer duration"
    )


def solved_soon(question: Question, starts: Starts) -> tuple[Trial | None, bool]:
    """The first start, where a cap may be missed and little effort tells; whether it was stopped.

    There is none where an earlier run has finished it, or where it tells nothing.

    Raises
    ------
    Interrupted
        The user stopped it.
    """
    (name, start), *_ = starts.items()
    if name in question.kept.names(question.kind) or hard_cap(question.study) is None:
        return None, False
    begin = clock.monotonic()

    def told(line: str) -> None:
        question.console.live(line.replace("start 1 of 1", f"start 1 of {len(starts)}", 1))

    try:
        found = audit(
            starts={name: start},
            settings=replace(question.settings, iterations=SOON),
            value=question.statements.value,
            seconds=question.some_left(),
            progress=told,
        )
    except Interrupted:
        raise
    except OcpError as error:
        return Trial(name, None, error, math.nan, clock.monotonic() - begin), False
    except StudyError:  # there is no such start, which says nothing of the caps
        return None, False
    (trial,) = found.trials
    finished = trial.error is None and trial.solved.iterations < SOON
    return trial if finished or found.interrupted else None, found.interrupted
