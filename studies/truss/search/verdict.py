"""How sure an answer is, in words: against its bound, and against the other starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from models.truss import static_peak
from ocp import Audit, Optimum, Solution, Trial
from studies.common.console import number
from studies.common.result import Verdict
from studies.truss.config import TrussStudy
from studies.truss.motions.starts import KINDS, NEIGHBOUR
from studies.truss.quantities import OBJECTIVES

if TYPE_CHECKING:  # SciPy loads with it, and only where it is needed
    from studies.truss.motions.phase_plane import LeastForce

BOUND_MET = 1e-4  # relative distance to a global bound that counts as meeting it
AT_LIMIT = 1e-6  # relative distance to a limit within which the engine resolves no difference
FAST = 1e-3  # relative: a force peak this far below the static one is due to momentum


@dataclass(frozen=True)
class Basin:
    """Starts that ended in the same optimum.

    Attributes
    ----------
    kind : of the force problem: "fast" (momentum carries the motion over the ridge of the static
        force), "slow" (on that ridge) or "inertial" (above it); else empty.
    """

    value: float
    starts: tuple[str, ...]
    kind: str = ""


def basins(study: TrussStudy, optima: Sequence[Optimum]) -> tuple[Basin, ...]:
    """The distinct optima that the starts found, best first."""
    return tuple(
        Basin(optimum.value, optimum.starts, _kind(study, optimum.value)) for optimum in optima
    )


def unattained_verdict(peak_force: float, least: LeastForce | None) -> Verdict | None:
    """The verdict on a motion at a force that no motion attains; None if it is not there.

    Parameters
    ----------
    peak_force : float
        Of the motion [N].
    least : LeastForce or None
        The phase-plane bound.
    """
    if least is None or least.attained or peak_force > least.force * (1 + AT_LIMIT):
        return None
    gap = peak_force / least.force - 1
    return Verdict(
        "unattained",
        f"no minimum exists: {least.sentence}; this motion is above the limit by {gap:.1e} "
        "(relative)",
    )


def global_verdict(study: TrussStudy, value: float, bound: float, basin: Basin) -> Verdict:
    """The verdict on a value that meets its bound."""
    words = f"global: the bound {bound:.6g} is met (gap {abs(value / bound - 1):.1e})"
    return Verdict("global", f"{words}{_in_words(study, basin)}")


def local_verdict(
    study: TrussStudy,
    audit: Audit,
    value: float,
    bound: float | None,
    found: Sequence[Basin],
    late: bool,
) -> Verdict:
    """The verdict on the best of several starts; `late` says that the seconds were used up."""
    solved = sum(trial.error is None for trial in audit.trials)
    failed, left_out = len(audit.trials) - solved, len(study.solver.starts) - len(audit.trials)
    kind = f"local: best of {solved} start{'s' * (solved > 1)}"
    if failed:
        kind += f" ({failed} more failed)"
    if audit.interrupted:
        kind += ", then interrupted"
    elif late and left_out > 0:
        kind += f", {left_out} not tried because the {study.solver.seconds:g} s were over"

    listed = "; ".join(
        f"{basin.value:.6g}{_in_words(study, basin)} from {', '.join(basin.starts)}"
        for basin in found
    )
    gap = (
        f"; proven lower bound {bound:.6g}, {100 * (1 - bound / value):.3g} % below it"
        if bound
        else ""
    )
    words = (
        f"{kind}; {len(found)} local optim{'a' if len(found) > 1 else 'um'} found: {listed}{gap}"
    )
    return Verdict("local", words)


def cut_short_in_words(solution: Solution) -> str | None:
    """How accurate a motion is whose refinement the budget ended; None for every other ending."""
    if solution.ending != "budget":
        return None
    return (
        "A better motion may exist: the budget ended the refinement, at an accuracy of "
        f"{solution.accuracy:.1e}. Increase solver.seconds (--seconds)."
    )


def _kind(study: TrussStudy, value: float) -> str:
    """Which basin of the force problem has this value."""
    if study.minimise[0].keys() != {"peak-force"}:
        return ""
    ratio = value / static_peak(study.truss, study.opening).force
    if ratio < 1 - FAST:
        return "fast"
    return "slow" if ratio < 1 + FAST else "inertial"


def _in_words(study: TrussStudy, basin: Basin) -> str:
    """Which basin of the force problem this is."""
    if not basin.kind:
        return ""
    ridge = f"the static {static_peak(study.truss, study.opening).force:.6g} N"
    words = {
        "fast": f"momentum carries it over {ridge}",
        "slow": ridge,
        "inertial": f"above {ridge}",
    }
    return f" ({basin.kind}: {words[basin.kind]})"


def of_trial(trial: Trial, study: TrussStudy) -> str:
    """One line of progress for a start that is done."""
    if trial.solution is None:
        return f"failed, {trial.error}"
    if trial.error is not None:
        return f"unverified, {'; '.join(trial.solution.verification.reasons) or trial.error}"

    first = list(study.minimise[0])
    name, unit = (first[0], OBJECTIVES[first[0]].unit) if len(first) == 1 else ("weighted sum", "1")
    return (
        f"{name} {number(trial.value, 7)} {unit}, {trial.solution.iterations} iterations, "
        f"{trial.seconds:.1f} s"
    )


def starts_agree(names: Sequence[str], trials: Sequence[Trial], same: float) -> bool:
    """Whether two starts have found the best optimum, and at least one of each kind has found any.

    Parameters
    ----------
    names : all starts of the search.
    trials : those that are done.
    same : relative distance of two values within which they are one optimum.
    """
    found = {trial.name: trial.value for trial in trials if trial.error is None}
    kinds = {KINDS.get(name) for name in found}
    # a neighbour's motion has stood against starts of each kind in its own study
    all_kinds = NEIGHBOUR in found or kinds == {KINDS.get(name) for name in names}
    if len(found) < 2 or not all_kinds:
        return False
    best, second, *_ = sorted(found.values())
    return second - best <= same * abs(second)
