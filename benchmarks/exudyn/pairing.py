"""Simulation time against Exudyn at equal error of the time steps.

Both codes move the pendulums of the paper's Table 1 on the same mesh. The error of a run is its
largest distance, over the samples and the links' ends, from the same code's converged run on that
mesh. Each code runs the cheapest of its settings whose error is below the limit; the two are then
timed in turns.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from statistics import median
from time import perf_counter, process_time

import numpy as np

from benchmarks.exudyn import peer
from benchmarks.exudyn.peer import Run, Setting
from models.ancf.assembly import assemble
from models.ancf.chain import Chain
from models.ancf.integrate import StepControl, simulate
from models.ancf.joints import Free
from models.ancf.state import posed
from models.arm.parameters import double_pendulum, single_pendulum
from models.arrays import Array
from studies.common.console import Table
from studies.common.exit_codes import ExitCode, StudyError

LIMIT = 1e-5  # [m], error of the time steps
ROUNDS = 5
SAMPLE = 0.01  # [s]
OUR_TOLERANCES = (1e-5, 9e-6, 8e-6, 6e-6, 4e-6, 2e-6, 1e-6, 6e-7, 4e-7, 3e-7, 2e-7, 1e-7)
OUR_STAGES = (5, 7)
OUR_REFERENCE = (7, 1e-10)
FIRST_STEPS = {"generalised alpha": 50, "trapezoidal": 50, "Verlet": 180}  # a sample, of Exudyn
TRIES = 5  # of the step, a setting
REFERENCE_STEPS = 500  # a sample: 2e-5 s
REFERENCE = Setting("generalised alpha", 1e-7)  # at 1e-8 its Newton iteration stops short
SCHEMES = tuple(
    Setting(scheme, tolerance)
    for scheme in ("generalised alpha", "trapezoidal")
    for tolerance in (1e-5, 1e-6, 1e-7)
)
EXPLICIT = Setting("Verlet")
Progress = Callable[[str], None]


@dataclass(frozen=True)
class PairedCase:
    """A pendulum.

    Attributes
    ----------
    name : str
    chain : Chain
    duration : float
        [s].
    explicit : bool
        Whether Exudyn's explicit scheme is timed too.
    """

    name: str
    chain: Chain
    duration: float
    explicit: bool = False


@dataclass(frozen=True)
class Timed:
    """A code at a setting that meets the limit.

    Attributes
    ----------
    code, setting : str
    again : function
        Runs it.
    error : float
        Of the time steps [m].
    runs : tuple of Run
        The trial; then those that are timed.
    """

    code: str
    setting: str
    again: Callable[[], Run]
    error: float
    runs: tuple[Run, ...]

    def median(self, quantity: str) -> float:
        """Of `seconds`, `processor` or `setup` of the runs [s]."""
        return median(getattr(run, quantity) for run in self.runs)


@dataclass(frozen=True)
class Pairing:
    """Both codes on one pendulum.

    Attributes
    ----------
    case : str
        Name of the pendulum.
    ours : Timed
    theirs : tuple of Timed
        Exudyn's implicit solver, then its explicit one where that was timed.
    apart : float
        Distance of the two codes' converged motions [m].
    """

    case: str
    ours: Timed
    theirs: tuple[Timed, ...]
    apart: float

    def over(self, theirs: Timed) -> float:
        """Our solver time over theirs."""
        return self.ours.median("seconds") / theirs.median("seconds")

    @property
    def ratio(self) -> float:
        """Our solver time over the shortest of Exudyn's."""
        return max(map(self.over, self.theirs))


def cases(elements: int = 8) -> tuple[PairedCase, ...]:
    """The two pendulums; Exudyn's explicit solvers take no hinge, so only the single one."""
    return (
        PairedCase("single", single_pendulum(elements), 1.3, explicit=True),
        PairedCase("double", double_pendulum(elements), 5.0),
    )


def compare(case: PairedCase, say: Progress, rounds: int = ROUNDS) -> Pairing:
    """Choose each code's setting, then time the two in turns.

    Raises
    ------
    StudyError
        If Exudyn is not installed, or no setting of a code meets the limit.
    """
    peer.load()

    say(f"{case.name} pendulum: converged runs")
    ours = our_run(case, *OUR_REFERENCE).ends
    theirs = their_run(case, REFERENCE_STEPS, REFERENCE).ends

    chosen = [
        _cheapest("antenna-ocp", _our_choices(case, ours, say)),
        _cheapest("Exudyn", _their_choices(case, SCHEMES, theirs, say)),
    ]
    if case.explicit:
        chosen.append(_cheapest("Exudyn", _their_choices(case, (EXPLICIT,), theirs, say)))

    # In turns, so that a machine that is busy for a while slows down both alike.
    say(f"{case.name} pendulum: {rounds} rounds")
    turns = [[choice.again() for choice in chosen] for _ in range(rounds)]
    timed = [
        replace(c, runs=runs) for c, runs in zip(chosen, zip(*turns, strict=True), strict=True)
    ]
    return Pairing(case.name, timed[0], tuple(timed[1:]), distance(ours, theirs))


def our_run(case: PairedCase, stages: int, tolerance: float) -> Run:
    """Our simulator, its evaluation of energies and of the samples included in the time."""
    joints = [Free() for _ in case.chain.links]
    samples = np.linspace(0.0, case.duration, round(case.duration / SAMPLE) + 1)

    assemble.cache_clear()  # set-up is timed as if it were the first
    begin = perf_counter()
    assemble(case.chain)
    state = posed(case.chain)
    control = StepControl(tolerance, stages=stages)
    setup = perf_counter() - begin

    start, processor = perf_counter(), process_time()
    run = simulate(case.chain, joints, state, samples, settings=control)
    processor, seconds = process_time() - processor, perf_counter() - start

    ends = np.array([run.position(k) for k in range(len(joints))])
    return Run(ends, run.statistics.steps, seconds, processor, setup)


def their_run(case: PairedCase, steps: int, setting: Setting) -> Run:
    """Exudyn with a number of steps a sample."""
    return peer.run(case.chain, case.duration, SAMPLE, SAMPLE / steps, setting)


def distance(one: Array, other: Array) -> float:
    """Largest distance [m] of two sets of paths (L, 2, m); infinite where one is not finite."""
    gap = np.hypot(*np.moveaxis(one - other, 1, 0)).max()
    return float(gap) if np.isfinite(gap) else np.inf


def _our_choices(case: PairedCase, reference: Array, say: Progress) -> Iterable[Timed]:
    """Of each number of stages the loosest tolerance that meets the limit."""
    for stages in OUR_STAGES:
        for tolerance in OUR_TOLERANCES:
            run = our_run(case, stages, tolerance)
            error = distance(run.ends, reference)
            name = f"Radau IIA, {stages} stages, tolerance {tolerance:.0e} m"
            say(f"{name}: error {error:.1e} m, {run.seconds:.3f} s")
            if error <= LIMIT:
                again = partial(our_run, case, stages, tolerance)
                yield Timed("antenna-ocp", name, again, error, (run,))
                break


def _their_choices(
    case: PairedCase, settings: tuple[Setting, ...], reference: Array, say: Progress
) -> Iterable[Timed]:
    """Of each setting the largest step, about, that meets the limit."""
    for setting in settings:
        steps = FIRST_STEPS[setting.scheme]
        for _ in range(TRIES):
            name = f"{setting.name}, step {SAMPLE / steps:.3g} s"
            try:
                run = their_run(case, steps, setting)
            except StudyError as stop:  # its Newton iteration may fail at a loose tolerance
                say(str(stop))
                break
            error = distance(run.ends, reference)
            say(f"Exudyn {name}: error {error:.1e} m, {run.seconds:.3f} s")
            if error <= LIMIT:
                again = partial(their_run, case, steps, setting)
                yield Timed("Exudyn", name, again, error, (run,))
                break
            steps = _more_steps(steps, error)


def _more_steps(steps: int, error: float) -> int:
    """Steps a sample at which a method of second order may meet the limit."""
    grow = np.sqrt(error / LIMIT) if np.isfinite(error) else 1.05
    return int(np.ceil(steps * max(1.02, min(2.0, 1.02 * grow))))


def _cheapest(code: str, choices: Iterable[Timed]) -> Timed:
    cheapest = min(choices, key=lambda choice: choice.median("processor"), default=None)
    if cheapest is None:
        raise StudyError(
            f"{code}: no setting that was tried has a step error below {LIMIT:g} m",
            ExitCode.NOT_VERIFIED,
        )
    return cheapest


def table(pairings: list[Pairing]) -> Table:
    """Return what is printed."""
    head = (
        "pendulum",
        "code",
        "setting",
        "steps",
        "step error [m]",
        "solver [s]",
        "processor [s]",
        "set-up [s]",
        "ratio",
    )

    # ours first, then each of Exudyn's solvers with its ratio
    rows = [
        (
            pairing.case,
            timed.code,
            timed.setting,
            str(timed.runs[0].steps),
            f"{timed.error:.1e}",
            *(f"{timed.median(quantity):.3f}" for quantity in ("seconds", "processor", "setup")),
            "" if timed is pairing.ours else f"{pairing.over(timed):.2f}",
        )
        for pairing in pairings
        for timed in (pairing.ours, *pairing.theirs)
    ]

    # the two codes' meshes converge to slightly different motions, as their curvatures differ
    apart = ", ".join(f"{pairing.case} {pairing.apart:.1e} m" for pairing in pairings)
    notes = (
        f"solver: wall clock without set-up, median of {ROUNDS} runs in turns; ours includes the "
        "evaluation of energies; neither compiles",
        f"step error: from the same code's converged run on the same mesh, limit {LIMIT:g} m",
        f"the converged meshes of the two codes differ by: {apart}",
        "each setting is the cheapest tried that meets the limit; ratio: our solver time over it",
        "Verlet: Exudyn marks it as under development; it takes no constraint, so that a mass of "
        f"{peer.ROOT_MASS:.0e} kg holds the root",
    )
    return Table("Simulation time, 8 elements a link", head, rows, notes)
