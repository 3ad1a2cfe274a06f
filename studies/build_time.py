"""`antenna-ocp build-time`: how long the truss's nonlinear program takes to build."""

from __future__ import annotations

import argparse
import statistics
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from studies.common.console import Console, Table
from studies.common.exit_codes import ExitCode

if TYPE_CHECKING:
    from studies.truss.config import TrussStudy

INTERVALS = 100
MODULES = (24, 1000)
REPEATS = 5
TARGET = 0.1  # [s], of one build


@dataclass(frozen=True)
class BuildTime:
    """Medians over `REPEATS` builds.

    Attributes
    ----------
    modules : of the truss.
    unknowns, rows : size of the nonlinear program.
    statement : processor time to state the problem, model expressions included [s].
    transcription : processor time from statement and mesh to functions with derivatives [s].
    """

    modules: int
    unknowns: int
    rows: int
    statement: float
    transcription: float

    @property
    def total(self) -> float:
        """Statement and transcription [s]."""
        return self.statement + self.transcription


def add_to(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the sub-command."""
    parser = subparsers.add_parser(
        "build-time",
        help="seconds to build the nonlinear program, for 24 and 1000 modules",
        description=f"States and transcribes the problem of least peak force, {INTERVALS} "
        f"intervals, and prints the median of {REPEATS} builds.",
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Measure and print."""
    found = [measure(modules) for modules in MODULES]
    console.say(
        Table(
            title=f"Least peak force with capped jerk, {INTERVALS} intervals",
            head=("modules", "unknowns", "rows", "statement [s]", "transcription [s]", "total [s]"),
            rows=[
                (str(f.modules), str(f.unknowns), str(f.rows),
                 *(f"{seconds:.4f}" for seconds in (f.statement, f.transcription, f.total)))
                for f in found
            ],
            notes=(f"seconds of processor time, median of {REPEATS} builds after a first one; "
                   f"the target is {TARGET:g} s in all.",),
        )
    )  # fmt: skip
    return ExitCode.OK


def measure(modules: int) -> BuildTime:
    """Build the program of the force problem repeatedly, after one build that loads everything."""
    from studies.truss.config import study_from

    study = study_from(
        {
            "minimise": "peak-force",
            "duration": 5.0,
            "caps": {"jerk": "200/T^3"},
            "truss": {"pulley_friction": 0.01, "modules": modules},
        }
    )
    _build(study)
    builds = [_build(study) for _ in range(REPEATS)]
    return BuildTime(
        modules,
        *builds[0][:2],
        statement=statistics.median(build[2] for build in builds),
        transcription=statistics.median(build[3] for build in builds),
    )


def _build(study: TrussStudy) -> tuple[int, int, float, float]:
    """Unknowns, rows, and the processor time of statement and transcription [s]."""
    from ocp.mesh.initial_guess import start_of
    from ocp.mesh.mesh import Mesh, uniform
    from ocp.settings import Settings
    from ocp.transcription.scaling import scales_of
    from ocp.transcription.transcribe import Method, transcribe
    from studies.truss.guesses import bezier_start
    from studies.truss.problem import state
    from studies.truss.quantities import OBJECTIVES

    settings = Settings()
    start = bezier_start(study)
    begin = time.process_time()
    statement = state(study, start, dict.fromkeys(OBJECTIVES, 1.0), with_forces=True)
    problem = statement.problem()
    stated = time.process_time()
    phases = len(problem.phases)
    mesh = Mesh(tuple(uniform(INTERVALS // phases, settings.degree) for _ in range(phases)))
    scales = scales_of(problem, start_of(problem, {}, None), {})
    built = transcribe(problem, mesh, Method(settings.scheme, settings.control_shape), scales)
    done = time.process_time()
    return built.columns.count, built.rows.count, stated - begin, done - stated
