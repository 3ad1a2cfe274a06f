"""The show "engine-spoilt": right answers made wrong, each of which a certificate has to refuse.

Case `5 k + i` draws a variant of one of the fifteen benchmarks (`problems/families.toml`), solves
it, has the answer certified, and spoils it in way i of `WAYS`:

switch       a breakpoint on a switch is moved by 1 % of its phase, and all else is solved anew
mesh         the problem is solved once on a mesh of a few intervals
multiplier   a multiplier of a row or of a bound, or the costates of a phase, are negated; those
             of fixed unknowns follow from the others, so they stay
leak         the program is solved with limits that are 1e-4 of their size wider
held         a limit of a state, a path or a peak is backed off in a few intervals in which it acts,
             and all else is solved anew

What is spoilt so may still be as good as the right answer: a limit that never acts, a switch that
hardly matters. Such a case is harmless, and the next of the problems is drawn.
"""

from __future__ import annotations

import dataclasses
import warnings
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.shows.engine.engine_problem import problem_of
from benchmarks.shows.engine.variant import Variant, catalogue
from benchmarks.shows.show import Columns, Question, Row, listed
from ocp import FixedMesh, Settings, Solution, certify, solve
from ocp.errors import OcpError, StatementWarning
from ocp.estimates.promised_gain import unit_costs
from ocp.mesh.mesh import Mesh, PhaseMesh, uniform
from ocp.optimality.active_set import path_multiplier_sums
from ocp.optimality.iterate import iterate_of
from ocp.optimality.multipliers import multipliers
from ocp.refinement.mesh_solver import MeshSolver
from ocp.transcription.packing import trajectory_of
from ocp.transcription.transcribe import ProgramLimits
from studies.common.console import Table, number

LINE = "right answers made wrong in five ways: which check of the certificate refuses them"
LIMIT = 900.0  # [s]

WAYS = ("switch", "mesh", "multiplier", "leak", "held")
SHIFT = 0.01  # of a phase, by which a switch is moved
LEAK = 1e-4  # of a limit's size
HELD = (3, 2e-4)  # intervals with a back-off, and what they cost together, of the objective
FARTHEST = 0.1  # back-off, of a limit's size
COARSE = (2, 6)  # intervals of a mesh that is too coarse
WORSE = 3e-5  # relative change of the objective from which an answer is spoilt
LEAST_GAIN = 1e-6  # of the objective, by wider limits: with less, none of them acts
LARGE = 1e-2  # of the largest multiplier: smaller ones say little
SECONDS = 30.0  # of a right answer, by the clock
FIXED = Settings(refinement=FixedMesh(), verify=False, seconds=SECONDS)

MOTION = ("replay", "path constraints", "peak", "objective", "problem bounds")
MINIMUM = (
    "finer controls",
    "Hamiltonian",
    "dH/du",
    "between changes",
    "where path constraints act",
    "a second solve",
)
# beginnings of the names of the checks, one of which has to refuse what is spoilt in a way
EXPECTED: Mapping[str, tuple[str, ...]] = {
    "switch": MINIMUM,
    "mesh": (*MOTION, *MINIMUM),
    "multiplier": ("stationarity", "complementarity", *MINIMUM),
    "leak": ("constraint residuals", "path constraints", "problem bounds"),
    "held": ("finer controls", "a second solve"),
}


@dataclass(frozen=True, eq=False)
class Spoilt:
    """A spoilt answer, and what was done to it in words."""

    solution: Solution
    words: str


def question(seed: int, index: int) -> Question:
    """The way, and in which order the problems are tried."""
    names = list(catalogue())
    random = np.random.default_rng([seed, index])
    order = [str(name) for name in random.permutation(names)]
    return {"way": WAYS[index % len(WAYS)], "order": order, "drawn": [seed, index]}


def answer(question: Question, folder: Path) -> Row:
    """Spoil the first of the problems that can be, and have it certified."""
    del folder
    random, tried = np.random.default_rng(question["drawn"]), []
    for name in question["order"]:
        right = _right(name, random)
        if right is None:
            tried.append(f"{name}: no certified answer")
            continue
        spoilt = _SPOILERS[question["way"]](right, random)
        if spoilt is None:
            tried.append(f"{name}: harmless")
            continue

        failed = [check.name for check in certify(spoilt.solution).checks if check.failed]
        expected = [name for name in failed if name.startswith(EXPECTED[question["way"]])]
        return {
            "problem": name,
            "words": spoilt.words,
            "right": right.objective,
            "spoilt": spoilt.solution.objective,
            "refused": bool(failed),
            "by": expected,
            "also": [name for name in failed if name not in expected],
            "tried": tried,
        }
    return {"problem": "", "words": "", "refused": None, "by": [], "also": [], "tried": tried}


def _right(name: str, random: np.random.Generator) -> Solution | None:
    """A certified answer of a variant; None if there is none within the seconds."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", StatementWarning)
            problem = problem_of(Variant.drawn(name, random), True)
            solution = solve(problem, settings=Settings(seconds=SECONDS), partial=False)
    except OcpError:
        return None
    return solution if certify(solution).passed else None


def _switch(right: Solution, random: np.random.Generator) -> Spoilt | None:
    """A breakpoint that moved onto a switch, moved away from it again."""
    mesh, motion = right.mesh, right.trajectory
    places = [(i, k) for i, phase in enumerate(mesh.phases) for k in phase.movable]
    for place in random.permutation(len(places)):
        index, number_of = places[place]
        fractions = [phase.fractions for phase in motion.phases]
        moved = fractions[index][number_of] + SHIFT * (1.0 if random.random() < 0.5 else -1.0)
        if not 0.0 < moved < 1.0:
            continue
        phases = [
            moved_breakpoint(phase, points, number_of, moved)
            if i == index
            else PhaseMesh(points, phase.degrees)
            for i, (phase, points) in enumerate(zip(mesh.phases, fractions, strict=True))
        ]
        found = _solved_on(right, Mesh(tuple(phases)))
        if found is not None:
            name = motion.phases[index].name
            return Spoilt(found, f"a switch of '{name}' at {moved:.4g} of it instead of its place")
    return None


def moved_breakpoint(
    phase: PhaseMesh, points: np.ndarray, number_of: int, moved: float
) -> PhaseMesh:
    """A mesh without movable breakpoints, one of them moved; those that it passes are left out."""
    place = points[number_of]
    low, high = min(place, moved), max(place, moved)
    kept = np.array([point for point in points if not low <= point <= high])
    breakpoints = np.sort(np.append(kept, moved))
    middle = (breakpoints[:-1] + breakpoints[1:]) / 2
    parents = np.clip(np.searchsorted(points, middle) - 1, 0, phase.intervals - 1)
    return PhaseMesh(breakpoints, phase.degrees[parents])


def _mesh(right: Solution, random: np.random.Generator) -> Spoilt | None:
    """An answer on few intervals."""
    count = int(random.integers(COARSE[0], COARSE[1] + 1))
    mesh = Mesh(tuple(uniform(count, 3) for _ in right.mesh.phases))
    found = _solved_on(right, mesh)
    return None if found is None else Spoilt(found, f"{count} intervals in each phase")


def _solved_on(right: Solution, mesh: Mesh) -> Solution | None:
    """The answer on a mesh that stays; None if there is none, or if it is as good."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", StatementWarning)
            found = solve(right.problem, settings=FIXED, guess=right.trajectory, mesh=mesh)
    except OcpError:
        return None
    except RuntimeError as error:
        # a limit may be backed off beyond the one on the other side, or beyond an end value
        if "Ill-posed problem" not in str(error):
            raise
        return None
    return found if _differs(found, right) else None


def _differs(found: Solution, right: Solution) -> bool:
    return abs(found.objective - right.objective) > WORSE * right.kept_iterate.objective_size


def _multiplier(right: Solution, random: np.random.Generator) -> Spoilt | None:
    """A large multiplier with the wrong sign."""
    iterate = right.kept_iterate
    which = ("row_multipliers", "bound_multipliers", "costates")[random.integers(3)]
    if which == "costates":
        index = int(random.integers(len(right.kept_multipliers.costates)))
        return Spoilt(*_with_negated_costates(right, index))

    values = getattr(iterate, which).copy()
    sizes = np.abs(values)
    if which == "bound_multipliers":
        lower, upper = iterate.limits.columns
        sizes = np.where(lower < upper, sizes, 0.0)
    largest = max(np.abs(iterate.row_multipliers).max(initial=0.0), sizes.max(initial=0.0))
    large = np.flatnonzero(sizes > LARGE * largest)
    if large.size == 0:
        return None
    place = int(random.choice(large))
    values[place] = -values[place]
    spoilt = replace(right, iterate=replace(iterate, **{which: values}, built=None))
    return Spoilt(spoilt, f"number {place} of the {which.replace('_', ' ')}")


def _with_negated_costates(right: Solution, index: int) -> tuple[Solution, str]:
    multipliers = right.kept_multipliers
    own = multipliers.costates[index]
    pieces = tuple(
        dataclasses.replace(piece, coefficients=-piece.coefficients)
        for piece in own.polynomial.pieces
    )
    negated = replace(own, polynomial=replace(own.polynomial, pieces=pieces))
    costates = (*multipliers.costates[:index], negated, *multipliers.costates[index + 1 :])
    name = right.trajectory.phases[index].name
    return replace(right, multipliers=replace(multipliers, costates=costates)), f"of '{name}'"


def _leak(right: Solution, random: np.random.Generator) -> Spoilt | None:
    """The answer of the program with wider limits, shown as one of the problem itself."""
    del random
    iterate = right.kept_iterate
    program, parameters = iterate.transcription, iterate.parameters
    limits = ProgramLimits(wider(iterate.limits.columns), wider(iterate.limits.rows))
    meshes = MeshSolver.of(right.problem, FIXED, parameters)
    start = meshes.starting_point(program, iterate, limits)
    result = meshes.run(program, FIXED.solver, start, limits, 1)
    if result.outcome != "solved":
        return None

    motion = trajectory_of(program, result.x, parameters)
    leaking = iterate_of(program, result, motion)
    found = replace(
        right,
        iterate=leaking,
        trajectory=motion,
        objective=leaking.objective,
        multipliers=multipliers(leaking),
    )
    gained = abs(found.objective - right.objective) / iterate.objective_size
    return Spoilt(found, f"limits wider by {LEAK:g}") if gained > LEAST_GAIN else None


def _held(right: Solution, random: np.random.Generator) -> Spoilt | None:
    """An answer that keeps away from a limit where it would be on it."""
    iterate, mesh = right.kept_iterate, right.mesh
    count, cost = HELD
    for index in random.permutation(len(mesh.phases)):
        constraints = iterate.transcription.constraints[index]
        of_unit = unit_costs(constraints, path_multiplier_sums(iterate, index))
        acting = {
            number: price
            for number, price in of_unit.items()
            if price.max() > 0.0
            and not (constraints[number].of_controls or constraints[number].is_equation)
        }
        if not acting:
            continue
        number = int(random.choice(sorted(acting)))
        price = acting[number]
        dear = np.flatnonzero(price > LARGE * price.max())
        chosen = random.choice(dear, min(count, dear.size), replace=False)

        distance = np.zeros(price.size)
        scaled = cost * iterate.objective_size / iterate.scales.objective
        distance[chosen] = scaled / (chosen.size * price[chosen])
        distance = np.minimum(distance, FARTHEST * constraints[number].scale)
        back_off = [dict(of_phase) for of_phase in mesh.back_off]
        back_off[index][number] = back_off[index].get(number, 0.0) + distance
        points = [phase.fractions for phase in right.trajectory.phases]
        phases = tuple(PhaseMesh(p, m.degrees) for p, m in zip(points, mesh.phases, strict=True))
        found = _solved_on(right, Mesh(phases, mesh.extra, tuple(back_off)))
        if found is not None:
            what = f"path constraint {number} of '{right.trajectory.phases[index].name}'"
            return Spoilt(found, f"{what} backed off in {chosen.size} intervals")
    return None


def wider(limits: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Limits that are no equations, wider by a part of the larger of each pair."""
    lower, upper = limits
    finite = (np.where(np.isfinite(side), np.abs(side), 0.0) for side in limits)
    width = np.where(lower < upper, LEAK * np.maximum(*finite), 0.0)
    return lower - width, upper + width


_SPOILERS: Mapping[str, Callable[[Solution, np.random.Generator], Spoilt | None]] = {
    "switch": _switch,
    "mesh": _mesh,
    "multiplier": _multiplier,
    "leak": _leak,
    "held": _held,
}


def tables(rows: Sequence[Row]) -> list[Table]:
    """Each spoilt answer in a row, and how many of each kind were refused by what."""
    columns: Columns = {
        "case": "index",
        "way": "way",
        "problem": lambda row: row["problem"] or "-",
        "right": lambda row: number(row.get("right"), 9),
        "spoilt": lambda row: number(row.get("spoilt"), 9),
        "refused by": _refused_by,
        "what was done": "words",
    }
    return [listed("Answers that were spoilt", rows, columns), _counts(rows)]


def _refused_by(row: Row) -> str:
    if row["failure"]:
        return str(row["failure"])
    return ", ".join(row["by"][:2]) or ("ANOTHER" if row["refused"] else "NONE")


def _counts(rows: Sequence[Row]) -> Table:
    head = ("way", "spoilt", "refused by the check that should", "by another", "not refused")
    lines = []
    for way in WAYS:
        own = [row for row in rows if row["way"] == way and not row["failure"] and row["problem"]]
        kinds = Counter(
            "right" if row["by"] else "another" if row["refused"] else "none" for row in own
        )
        counts = (len(own), kinds["right"], kinds["another"], kinds["none"])
        lines.append((way, *map(str, counts)))
    return Table("Which were refused", head, lines)
