"""A certificate: what has been checked about a solution, with which numbers and tolerances.

`certify` does not believe the record of the solve: it replays the controls again, evaluates the
motion between the points and tests the first-order conditions from the multipliers.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.mesh.trajectory import Trajectory
from ocp.optimality.hamiltonian import HamiltonianReport, end_slopes, report
from ocp.optimality.multipliers import SolvedProgram, column_multipliers, path_rows
from ocp.problem.symbols import Between, time
from ocp.problem.terms import Functional
from ocp.refinement.switch_detection import control_samples, jumps
from ocp.settings import Settings
from ocp.solution.solution import Solution
from ocp.transcription.variables import PhaseLayout
from ocp.verification.simulation import Replay, replay, replayed
from ocp.verification.verify import verify

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tolerances:
    """What a certificate allows, all relative.

    Attributes
    ----------
    replay, excess, objective : of the replayed motion.
    feasible, stationary, complementary : of the scaled program, whose solver stops at a dual
        infeasibility of 1e-6 and a complementarity of 1e-8.
    within, strict : range of the Hamiltonian between two corners, and the worst interval mean of
        dH/du, in all intervals but those that hold a corner of the control or are next to one.
    corners : part of the duration that these may take.
    hamiltonian : mean drift over the whole phase, corners included, and the end values of free
        times.  Costates are of first order only in intervals that hold a jump of theirs, so this
        is far wider than what holds between corners.
    slope : of the interval means of dH/du, averaged over time, corners included.
    concave : negative curvature of the Hamiltonian by a free control.
    peak : sum and sign of a peak's multipliers.
    """

    replay: float = 1e-6
    excess: float = 1e-6
    objective: float = 1e-5
    feasible: float = 1e-8
    stationary: float = 1e-5
    complementary: float = 1e-6
    hamiltonian: float = 5e-3
    slope: float = 1e-3
    within: float = 1e-5
    strict: float = 1e-4
    corners: float = 0.5
    concave: float = 1e-6
    peak: float = 1e-5


@dataclass(frozen=True)
class Check:
    """One number, what it may be at most, and what it means."""

    name: str
    value: float
    tolerance: float
    sentence: str

    @property
    def passed(self) -> bool:
        """Whether the value is a number within its tolerance."""
        return bool(self.value <= self.tolerance)


@dataclass(frozen=True)
class Certificate:
    """All checks of one solution."""

    problem: str
    objective: float
    verdict: str
    checks: tuple[Check, ...]

    @property
    def passed(self) -> bool:
        """Whether every check passed."""
        return all(check.passed for check in self.checks)

    def as_json(self) -> str:
        """The certificate as JSON; numbers that are not finite become strings."""
        checks = [{**asdict(c), "passed": c.passed} for c in self.checks]
        for check in checks:
            check["value"] = _plain(float(check["value"]))
        return json.dumps(
            {"problem": self.problem, "objective": _plain(self.objective), "verdict": self.verdict,
             "passed": self.passed, "checks": checks}, indent=2, allow_nan=False)  # fmt: skip

    def __str__(self) -> str:
        lines = [f"{self.problem}: {self.objective:.10g}, {self.verdict}"]
        lines += [
            f"  {'pass' if c.passed else 'FAIL'}  {c.name}: {c.value:.1e} of {c.tolerance:.0e} "
            f"allowed; {c.sentence}"
            for c in self.checks
        ]
        return "\n".join([*lines, f"  {'certified' if self.passed else 'NOT certified'}"])


def _plain(value: float) -> float | str:
    return value if np.isfinite(value) else str(value)


def certify(solution: Solution, tolerances: Tolerances | None = None) -> Certificate:
    """Check a solution anew, see `Tolerances` for what is allowed.

    Raises
    ------
    StatementError
        When the solution does not carry its multipliers.
    """
    solved, allowed = solution.kept_program, tolerances or Tolerances()
    checks = [
        *_motion(solution, solved, allowed),
        *_program(solution, solved, allowed),
        *_optimality(solution, solved, allowed),
        *_peaks(solution, solved, allowed),
    ]
    return Certificate(solution.problem.name, solution.objective, solution.verdict, tuple(checks))


def _motion(solution: Solution, solved: SolvedProgram, allowed: Tolerances) -> Iterator[Check]:
    """The replayed motion against the statement."""
    made, own = solved.transcription, solution.trajectory
    done = replay(solution.problem, own, dict(solved.scales.signals))
    again = replayed(own, done)
    found = verify(Settings(), made, own, done, again, solution.evaluator, solution.objective)
    yield Check("replay", found.miss, allowed.replay, _replay_words(done))
    yield Check("path constraints", found.excess, allowed.excess,
                "the replayed motion exceeds a path constraint, bound or peak between the points "
                "by this part of its size")  # fmt: skip
    for name, stated, dense in found.peaks:
        yield Check(f"peak '{name}'", abs(dense - stated) / max(abs(stated), 1e-300),
                    allowed.excess,
                    f"its largest value on the replayed motion is {dense:.8g}, reported as "
                    f"{stated:.8g}")  # fmt: skip
    size = max(abs(solution.objective), 1e-3 * solved.scales.objective)
    yield Check("objective", abs(found.replayed_objective - solution.objective) / size,
                allowed.objective,
                "the replayed motion has an objective that differs by this part")  # fmt: skip
    others = [r for r in found.reasons if r.startswith("'")]
    yield Check("problem bounds", float(len(others)), 0.0,
                "; ".join(others) or "the replayed motion meets all bounds and links")  # fmt: skip


def _replay_words(done: Replay) -> str:
    begin = "the initial state"
    if done.restarts:
        begin += f" and {done.restarts} restarts (the motion amplifies too much for one run)"
    return (
        f"the controls, replayed by another integrator from {begin}, miss the end state by this "
        f"part of its size; errors of the states grow up to {done.amplification:.1e} times"
    )


def _program(solution: Solution, solved: SolvedProgram, allowed: Tolerances) -> Iterator[Check]:
    """First-order conditions of the nonlinear program."""
    made, constants = solved.transcription, dict(solution.trajectory.constants)
    values = ca.DM([constants[c.name] for c in solved.problem.constants] or ca.DM(0, 1))
    x, nu = solved.x, solved.row_multipliers
    gradient = np.array(made.program.objective_gradient(x, values)[1]).ravel()
    rows, jacobian = made.program.constraint_jacobian(x, values)
    g, mu = np.array(rows).ravel(), column_multipliers(solved, constants)
    residual = gradient + np.array(ca.mtimes(jacobian.T, ca.DM(nu))).ravel() + mu
    limits = np.hstack([made.rows.evaluate(constants), made.columns.evaluate(constants)])
    at, multipliers = np.concatenate([g, x]), np.concatenate([nu, mu])
    over = np.maximum(limits[0] - at, at - limits[1])
    yield Check("constraint residuals", float(over.max(initial=0.0)), allowed.feasible,
                "the largest violation of a row or bound of the program, scaled")  # fmt: skip
    yield Check("stationarity", float(np.abs(residual).max()), allowed.stationary,
                "the largest slope of the scaled Lagrangian")  # fmt: skip
    with np.errstate(invalid="ignore"):
        room = np.where(multipliers > 0, limits[1] - at, at - limits[0])
        product = np.where(multipliers == 0, 0.0, np.abs(multipliers) * np.abs(room))
    # a multiplier at a side without a limit: its own size counts
    product = np.where(np.isfinite(product), product, np.abs(multipliers))
    yield Check("complementarity", float(product.max(initial=0.0)), allowed.complementary,
                "the largest product of a multiplier and the distance to its limit")  # fmt: skip


def _optimality(solution: Solution, solved: SolvedProgram, allowed: Tolerances) -> Iterator[Check]:
    """The minimum principle, phase by phase."""
    adjoints = solution.kept_multipliers.costates
    mu = column_multipliers(solved, dict(solution.trajectory.constants))
    for i, layout in enumerate(solved.transcription.layouts):
        found = report(solved, solution.trajectory, adjoints[i], i)
        yield from _between_corners(found, allowed)
        if found.autonomous:
            yield Check(f"Hamiltonian of '{found.name}'", found.drift, allowed.hamiltonian,
                        f"time does not enter, so it is constant: {found.mean:.8g} with this "
                        "mean drift" + _held_jumps(solution, i))  # fmt: skip
        if found.slopes.size:
            yield Check(f"dH/du of '{found.name}'", found.slope,
                        allowed.slope, "the interval means, projected on the controls' "
                        "bounds, relative to their terms: mean over time")  # fmt: skip
        if layout.ends is not None:
            yield from _end_values(solution, solved, layout, found, mu, allowed)


def _held_jumps(solution: Solution, index: int) -> str:
    """Where the multipliers of a right answer may not be unique, in words."""
    own, mesh = solution.trajectory.phases[index], solution.mesh.phases[index]
    fractions = (own.breakpoints - own.start) / (own.end - own.start)
    held = np.delete(fractions, list(mesh.movable))
    at = {jump.at for j in range(len(own.controls))
          for jump in jumps(*control_samples(own, j), fractions)}  # fmt: skip
    on = [own.start + f * (own.end - own.start) for f in sorted(at)
          if np.abs(held - f).min() < 1e-9]  # fmt: skip
    if not on:
        return ""
    times = ", ".join(f"{t:.6g} s" for t in on)
    return (
        f"; a control jumps on a breakpoint that does not move ({times}), where the multipliers "
        "need not be unique: another number of intervals tells"
    )


def _between_corners(found: HamiltonianReport, allowed: Tolerances) -> Iterator[Check]:
    """What must hold strictly wherever the control has no corner."""
    count = int(found.corners.sum())
    left = f"{count} of {found.corners.size} intervals hold a corner or are next to one"
    yield Check(f"corners of '{found.name}'", found.share, allowed.corners,
                f"{left}; they take this part of the duration and are judged by means")  # fmt: skip
    if found.autonomous:
        yield Check(f"between corners of '{found.name}': Hamiltonian", found.within, allowed.within,
                    "its largest range over a run of intervals without corners")  # fmt: skip
    if found.slopes.size:
        yield Check(f"between corners of '{found.name}': dH/du", found.strict, allowed.strict,
                    "the worst interval mean of those without corners, projected on the controls' "
                    "bounds, relative to its terms")  # fmt: skip
        if np.isfinite(found.concave):
            yield Check(f"curvature of '{found.name}'", found.concave, allowed.concave,
                        "the Hamiltonian is nowhere concave in a control off its bounds, so that "
                        "the motion is no maximum of what is minimised")  # fmt: skip


def _end_values(
    solution: Solution, solved: SolvedProgram, layout: PhaseLayout, found: HamiltonianReport,
    mu: Array, allowed: Tolerances,
) -> Iterator[Check]:  # fmt: skip
    """Transversality: ``H = -dJ/dt`` at a free final time, ``dJ/dt`` at a free initial one."""
    assert layout.ends is not None
    for node, value, what, sign in (
        (0, layout.phase.start, "start", 1.0), (-1, layout.phase.end, "end", -1.0)
    ):  # fmt: skip
        if not isinstance(value, Between):
            continue
        column = layout.ends[node]
        slope = mu[column] * solved.scales.objective / solved.transcription.sizes[column]
        slope += _by_time(solution, solved, layout.phase.name, what)
        have = found.mean if found.autonomous else found.ends[node]
        yield Check(f"Hamiltonian at the {what} of '{found.name}'",
                    abs(have - sign * slope) / max(found.size, abs(slope)), allowed.hamiltonian,
                    f"the time is free, so it is {sign * slope:.8g}; found {have:.8g}")  # fmt: skip


def _by_time(solution: Solution, solved: SolvedProgram, phase: str, what: str) -> float:
    """Slope of objective and bounds by an end time, through the time and end values."""
    total, own = 0.0, solution.trajectory.phase(phase)
    last = len(own.breakpoints) - 2
    k, tau = (0, [0.0]) if what == "start" else (last, [1.0])
    for f in solved.problem.functionals:
        if f.pieces[0][0] != phase or f.kind not in (what, f"{what} time"):
            continue
        share = _slope(solution, solved, f)
        if f.kind == what:
            by_time = ca.densify(ca.jacobian(f.pieces[0][1], time.symbol))
            share *= float(solution.evaluator.values(
                solution.trajectory, phase, [by_time], k, tau)[0, 0])  # fmt: skip
        total += share
    return total


def _slope(solution: Solution, solved: SolvedProgram, f: Functional) -> float:
    """Slope of objective and bounds by a functional."""
    expression = end_slopes(solved, f, solution.kept_multipliers.terminal)
    return solution.evaluator.number(
        solution.trajectory, expression, _stated(solved, solution.trajectory)
    )


def _stated(solved: SolvedProgram, trajectory: Trajectory) -> dict[Functional, float]:
    return dict(zip(solved.transcription.peak_ids, trajectory.peaks, strict=True))


def _peaks(solution: Solution, solved: SolvedProgram, allowed: Tolerances) -> Iterator[Check]:
    """Multipliers of a peak's rows: not negative, and together the weight of the peak."""
    made, size = solved.transcription, solved.scales.objective
    mu = column_multipliers(solved, dict(solution.trajectory.constants))
    for f, column in made.peak_ids.items():
        masses = np.concatenate([
            solved.row_multipliers[p.rows] for p in path_rows(made)
            if made.constraints[p.phase][p.constraint].peak is f
        ]) * size / solved.scales.functionals[f]  # fmt: skip
        weight = _slope(solution, solved, f) + mu[column] * size / made.sizes[column]
        scale = max(abs(weight), np.abs(masses).max(), 1e-12)
        yield Check(f"multipliers of peak '{f.name}'",
                    max(abs(masses.sum() - weight), -masses.min()) / scale, allowed.peak,
                    f"none is negative, their sum is its weight of {weight:.8g}")  # fmt: skip
