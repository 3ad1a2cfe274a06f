"""Warm starts of the benchmarks: what the multipliers of a solution save when a number changes.

Every problem is solved from its stated guess as usual.  Then one named number of it is raised by
5 % and the problem is solved twice on the mesh found, without refinement: cold, from the stated
guess, and warm, from the solution's primal and dual variables.  Both run under the same settings.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

from ocp import Interrupted, OcpError, Settings, Solution, prepare, solve
from studies.benchmarks.benchmark import Benchmark
from studies.common.console import Table, number

CHANGE = 1.05
LEAST = 10  # iterations of a cold solve below which there is nothing much to save
SAVED = 0.5
ALLOWED = 2  # iterations by which a warm start may exceed the cold one
AGREEMENT = 1e-6  # of two optima, relative


@dataclass(frozen=True)
class WarmStart:
    """Iterations of a changed benchmark; numbers are None where a solve failed.

    Attributes
    ----------
    varied, before, after : the number that changes and its two values.
    intervals : of the mesh, that of the problem as stated.
    cold, warm : iterations on that mesh from the stated guess and from the solution.
    difference : by how much the optimum of the warm start is worse, relative; negative where it is
        the better one.
    """

    name: str
    varied: str
    before: float
    after: float
    intervals: int | None = None
    cold: int | None = None
    warm: int | None = None
    difference: float | None = None
    failure: str = ""

    @property
    def counts(self) -> bool:
        """Whether the cold solve takes long enough to be counted, or fails."""
        return self.cold is None or self.cold >= LEAST

    @property
    def halved(self) -> bool:
        """Whether the warm start takes at most half the iterations; any beat a cold failure."""
        if self.warm is None:
            return False
        return self.cold is None or self.warm <= SAVED * self.cold

    @property
    def kept(self) -> bool:
        """Whether the warm start costs no more than allowed and finds no worse optimum."""
        if self.warm is None:
            return False
        if self.cold is None or self.difference is None:
            return True
        return self.warm <= self.cold + ALLOWED and self.difference <= AGREEMENT

    def as_record(self) -> dict[str, object]:
        """The numbers by name, for JSON."""
        return asdict(self)


def passed(found: Sequence[WarmStart]) -> bool:
    """Two thirds of those that count are halved, and none is worse than allowed."""
    counted = [w.halved for w in found if w.counts]
    return 3 * sum(counted) >= 2 * len(counted) and all(w.kept for w in found)


def warm_start(benchmark: Benchmark, progress: Callable[[str], None] | None = None) -> WarmStart:
    """Measure one benchmark; a failed solve is measured too, not raised.

    Raises
    ------
    Interrupted
        The user stopped a solve.
    """
    constant = benchmark.varied
    if constant is None:
        raise ValueError(f"benchmark '{benchmark.name}' names no constant to vary")
    changed = {constant: CHANGE * constant.value}
    start = WarmStart(benchmark.name, constant.name, constant.value, changed[constant])
    settings = Settings(verify=False)
    try:
        base = solve(benchmark.problem, settings=settings, progress=progress, partial=False)
    except Interrupted:
        raise
    except OcpError as error:
        return replace(start, failure=f"the problem as stated: {error}")
    made = prepare(benchmark.problem, settings=settings, guess=base)

    def attempt(guess: Solution | None) -> tuple[Solution | None, str]:
        try:
            return made.solve(constants=changed, guess=guess, progress=progress), ""
        except Interrupted:
            raise
        except OcpError as error:
            return None, f"{'warm' if guess else 'cold'}: {error}"

    (cold, why_cold), (warm, why_warm) = attempt(None), attempt(base)
    difference = None
    if cold is not None and warm is not None:
        lost = benchmark.problem.sense * (warm.objective - cold.objective)
        difference = lost / max(abs(cold.objective), 1e-12)
    return replace(
        start,
        intervals=made.mesh.intervals,
        difference=difference,
        cold=None if cold is None else cold.iterations,
        warm=None if warm is None else warm.iterations,
        failure="; ".join(why for why in (why_cold, why_warm) if why),
    )


def table(found: Sequence[WarmStart]) -> Table:
    """Iterations cold and warm, and what they have to meet."""
    counted = [w for w in found if w.counts]
    halved = sum(w.halved for w in counted)
    return Table(
        title="Warm starts: one number 5 % higher, on the mesh of the problem as stated",
        head=("problem", "number", "from", "to", "intervals", "cold", "warm", "optima", ""),
        rows=[_row(w) for w in found],
        notes=(
            "cold, warm: iterations from the stated guess, and from the solution's primal and dual "
            "variables, without refinement, same settings for all.",
            "optima: by how much the warm one is worse, relative; negative where it is better.",
            f"at most half the iterations on {halved} of the {len(counted)} whose cold solve takes "
            f"{LEAST} or more (or fails); wanted are two thirds, and on none more than {ALLOWED} "
            "above cold.",
        ),
    )


def _row(w: WarmStart) -> tuple[str, ...]:
    count = ["-" if n is None else str(n) for n in (w.intervals, w.cold, w.warm)]
    word = "half" if w.halved else "kept" if w.kept else "WORSE"
    optima = number(w.difference, 2)
    return (w.name, w.varied, number(w.before), number(w.after), *count, optima, word)
