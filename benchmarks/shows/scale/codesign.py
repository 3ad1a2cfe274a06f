"""The show "codesign": designs around a co-design, and all over its range, find nothing better.

A case runs the command, then draws thousands of designs that meet every requirement. No motion of a
design has less force than the bound of its ridge, so that a bound above the co-design's force rules
the design out whatever its motion. The designs with the lowest bounds are given their own best
motion, as `antenna-ocp truss` finds it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shows.show import Question, Row
from benchmarks.shows.truss_random import run_command
from models.truss import with_symbols
from studies.codesign.config import CodesignStudy, study_from
from studies.codesign.requirements import requirements
from studies.codesign.search import designed
from studies.common.console import Table, number, silent
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.result import Result
from studies.truss.limits.bounds import lower_bounds
from studies.truss.search.motion_search import Search

LINE = "a co-design beside a sweep of the designs around it and of its whole range: 8 cases"
LIMIT = 900.0  # [s]; a case takes one to five minutes

# flags of the deployment, and the part of each parameter by which designs are drawn around it
SLOW = "--duration 140 --jerk-cap bezier"
SCENARIOS = (
    ("peak-force", f"{SLOW} --friction 0.01"),
    ("peak-force", f"{SLOW} --friction 0"),
    ("peak-force", "--duration 6 --jerk-cap 500/T^3 --friction 0.01"),
    ("peak-factored-force", f"{SLOW} --friction 0.01 --margin aiaa-s-114"),
)
RADII = (0.02, 0.3)

DRAWS = 40_000  # designs, of which those that meet the requirements are looked at
MOST = 400  # of them, the bound of which is computed
SOLVED = 3  # of them, with the lowest bounds, are given their own best motion
BETTER = 1e-4  # relative: less is within the tolerance of two solves


def question(seed: int, index: int) -> Question:
    """Scenario and radius of a case; the designs are drawn with the seed."""
    rest, radius = divmod(index, len(RADII))
    objective, flags = SCENARIOS[rest % len(SCENARIOS)]
    return {"objective": objective, "flags": flags, "radius": RADII[radius], "seed": seed}


def answer(question: Question, folder: Path) -> Row:
    """The co-design, and the least that other designs were found to need."""
    command = ["codesign", "--objective", question["objective"], *question["flags"].split()]
    command += ["--designs", "3", "--results", str(folder / "results")]
    code, _ = run_command([*command, "--overwrite", "--no-figures"], folder / "printed.txt")
    row: dict[str, Any] = {"code": code, "force": None}
    if code != ExitCode.OK:
        return row

    result, key = Result.load(folder / "results"), question["objective"]
    study = _with_its_bars(study_from(result.configuration), result)
    centre = {name: float(value) for name, value in result.details["design"].items()}
    designs = _neighbours(study, centre, question)
    bounds = [
        lower_bounds(designed(study.deployment, design), None).get(key, 0.0) for design in designs
    ]
    order = np.argsort(bounds)[:SOLVED]
    solved = [_own_optimum(study, designs[k], key) for k in order]
    return {
        **row,
        "force": result.value(key),
        "stated": result.value(key, "stated design"),
        "bounds_press": sum(price["of_the_design"] for price in result.details["prices"]),
        "designs": len(designs),
        "ruled_out": sum(bound >= result.value(key) * (1 - BETTER) for bound in bounds),
        "least_bound": min(bounds, default=None),
        "solved": [value for value in solved if value is not None],
    }


def _with_its_bars(study: CodesignStudy, result: Result) -> CodesignStudy:
    """The study with the cap on the bars that held when it was solved."""
    cap = next(row.cap for row in result.table if row.key == "peak-bar-force")
    deployment = study.deployment
    caps = dataclasses.replace(deployment.caps, bar_force=cap)
    return dataclasses.replace(study, deployment=dataclasses.replace(deployment, caps=caps))


def _neighbours(
    study: CodesignStudy, centre: dict[str, float], question: Question
) -> list[dict[str, float]]:
    """Designs of the range, within the radius of the centre, that meet every requirement."""
    generator = np.random.default_rng(question["seed"])
    limits = study.design.limits(study.deployment.truss)
    values = np.array([centre[name] for name in limits])
    ends = np.array(list(limits.values()))
    low = np.maximum(ends[:, 0], values * (1 - question["radius"]))
    high = np.minimum(ends[:, 1], values * (1 + question["radius"]))

    held = [one for one in requirements(study) if not one.at_rest]
    found: list[dict[str, float]] = []
    for row in generator.uniform(low, high, (DRAWS, values.size)):
        design = dict(zip(limits, row.tolist(), strict=True))
        truss = with_symbols(study.deployment.truss, **design)
        # the first one, on the link, says whether the others are defined
        if all(float(one.slack(truss)) >= 0.0 for one in held):
            found.append(design)
        if len(found) == MOST:
            break
    return found


def _own_optimum(study: CodesignStudy, design: dict[str, float], key: str) -> float | None:
    """The least force of a design in its own best motion; None where it has none."""
    try:
        best = Search(designed(study.deployment, design), silent()).run()
    except StudyError:
        return None
    return float(best.deployment.values[key])


def tables(rows: Sequence[Row]) -> list[Table]:
    """Each case in a line; no row may say BETTER."""
    answered = [row for row in rows if not row["failure"] and row["force"] is not None]
    cells = [
        (
            row["objective"],
            row["flags"],
            f"{100 * row['radius']:g} %",
            number(row["stated"], 6),
            number(row["force"], 6),
            str(row["bounds_press"]),
            f"{row['ruled_out']} of {row['designs']}",
            number(row["least_bound"], 6),
            ", ".join(number(value, 6) for value in row["solved"]) or "-",
            _verdict(row),
        )
        for row in answered
    ]
    head = (
        *("objective", "deployment", "around", "stated [N]", "co-design [N]", "bounds press"),
        *("ruled out", "least bound [N]", "lowest bounds solved [N]", "outcome"),
    )
    notes = [f"ruled out: the design's bound is no less than the co-design's force, to {BETTER:g}"]
    notes.append(f"{len(rows) - len(answered)} cases failed to answer")
    return [Table("co-designs beside other designs", head, cells, notes)]


def _verdict(row: Row) -> str:
    least = min(row["solved"], default=np.inf)
    return "BETTER" if least < row["force"] * (1 - BETTER) else "nothing better"
