"""What a search of the truss's motion found, and how sure that is, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from models.truss import static_peak
from ocp import Solution
from studies.truss.config import TrussStudy
from studies.truss.deployment import Deployment
from studies.truss.problem import Statement

SAME_BASIN = 1e-4  # relative: optima closer than this are one basin, solved to different meshes
FAST = 1e-3  # relative: a force peak this far below the static one is due to momentum


@dataclass(frozen=True, eq=False)
class Attempt:
    """One start and what came of it: a solution with its statement, or why there is none.

    An unverified solution has both.
    """

    start: str
    value: float | None
    seconds: float
    statement: Statement | None = None
    solution: Solution | None = None
    failure: str | None = None


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


@dataclass(frozen=True, eq=False)
class Outcome:
    """The best motion found.

    Attributes
    ----------
    deployment : the optimal law on its truss.
    solution : of the last stage.
    attempts : all starts, those that failed among them.
    basins : optima found, best first.
    bounds : lower bounds by quantity.
    verdict : what the result is, in words.
    remarks : sentences that belong beside it.
    interrupted : whether the user stopped the search.
    """

    deployment: Deployment
    solution: Solution
    attempts: tuple[Attempt, ...]
    basins: tuple[Basin, ...]
    bounds: Mapping[str, float]
    verdict: str
    remarks: tuple[str, ...]
    interrupted: bool


def basins(study: TrussStudy, solved: Sequence[Attempt]) -> tuple[Basin, ...]:
    """The distinct optima that the starts found, best first."""
    found: list[Basin] = []
    for attempt in sorted(solved, key=lambda attempt: attempt.value or 0.0):
        value = attempt.value or 0.0
        if found and abs(value - found[-1].value) <= SAME_BASIN * abs(found[-1].value):
            found[-1] = replace(found[-1], starts=(*found[-1].starts, attempt.start))
        else:
            found.append(Basin(value, (attempt.start,), _kind(study, value)))
    return tuple(found)


def global_verdict(study: TrussStudy, value: float, bound: float | None, basin: Basin) -> str:
    """The verdict on a value that meets its bound."""
    assert bound is not None
    gap = f"gap {abs(value / bound - 1):.1e}"
    return f"global: the bound {bound:.6g} is met ({gap}){_in_words(study, basin)}"


def local_verdict(
    study: TrussStudy, value: float, bound: float | None, found: Sequence[Basin], tried: int,
    interrupted: bool,
) -> str:  # fmt: skip
    """The verdict on the best of several starts."""
    kind = f"local: best of {tried} start{'s' * (tried > 1)}"
    if interrupted:
        kind += f" of {len(study.solver.starts)}, then interrupted"
    listed = "; ".join(
        f"{basin.value:.6g}{_in_words(study, basin)} from {', '.join(basin.starts)}"
        for basin in found
    )
    gap = f"; its bound leaves room for {100 * (1 - bound / value):.3g} % less" if bound else ""
    return f"{kind}; {len(found)} basin{'s' * (len(found) > 1)} found: {listed}{gap}"


def _kind(study: TrussStudy, value: float) -> str:
    """Which basin of the force problem has this value."""
    if study.minimise[0].keys() != {"peak-force"}:
        return ""
    ratio = value / static_peak(study.truss).force
    if ratio < 1 - FAST:
        return "fast"
    return "slow" if ratio < 1 + FAST else "inertial"


def _in_words(study: TrussStudy, basin: Basin) -> str:
    """Which basin of the force problem this is."""
    if not basin.kind:
        return ""
    ridge = f"the static {static_peak(study.truss).force:.6g} N"
    words = {
        "fast": f"momentum carries it over {ridge}",
        "slow": ridge,
        "inertial": f"above {ridge}",
    }
    return f" ({basin.kind}: {words[basin.kind]})"
