"""The show "check-noise": the paper's laws with noise, and what `antenna-ocp check` makes of them.

Every case draws a law, a noise and a sample time, writes the noisy angles as CSV, and checks that
file as the command does. What counts is whether each peak of the law without noise lies between
the bounds that are stated, and how wide these are.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.shows.show import Question, Row
from models.truss import TrussParameters
from studies.common.console import Table, number
from studies.truss.quantities import QUANTITIES

LINE = "the paper's laws with noise: peaks recovered by check within the bounds it states"
LIMIT = 300.0  # [s]; a case takes a few seconds

LAWS = ("Bezier", "Step5")
DURATION = 140.0  # [s], the paper's
NOISE = (1e-5, 1e-3)  # [rad], log-uniform
SAMPLE_TIME = (0.02, 0.5)  # [s], log-uniform
LITTLE, MUCH = 1e-4, 1e-3  # [rad]: noise up to which a bound may be so wide
WIDE = {LITTLE: 0.05, MUCH: 0.20}
# the jerk is told apart: as a third derivative it cannot be known as well
JUDGED = tuple(
    key
    for key, quantity in QUANTITIES.items()
    if quantity.kind == "peak" and not key.endswith("jerk") and not quantity.needs
)


def question(seed: int, index: int) -> Question:
    """Draw a law, a noise [rad] and a sample time [s]; the laws take turns."""
    rng = np.random.default_rng([seed, index])
    noise, step = (float(np.exp(rng.uniform(*np.log(ends)))) for ends in (NOISE, SAMPLE_TIME))
    return {
        "law": LAWS[index % len(LAWS)],
        "noise": noise,
        "rows": round(DURATION / step) + 1,
        "draw": int(rng.integers(2**31)),
    }


def answer(question: Question, folder: Path) -> Row:
    """Write the noisy law, check it, and set its peaks beside the law's own."""
    from studies.check.reading.profile import read_profile
    from studies.check.truss import check_truss
    from studies.truss.config import TrussStudy
    from studies.truss.motions.laws import paper_laws

    study = TrussStudy(
        minimise="peak-acceleration", duration=DURATION, truss=TrussParameters(pulley_friction=0.01)
    )
    laws = {law.name: law for law in paper_laws(study.truss, DURATION)}
    law = laws[question["law"]]

    time = np.linspace(0.0, DURATION, question["rows"])
    rng = np.random.default_rng(question["draw"])
    angle = law.law.motion(time).angle + question["noise"] * rng.standard_normal(time.size)
    path = folder / "noisy.csv"
    np.savetxt(path, np.column_stack([time, angle]), "%.17g", ",", header="time [s],angle [rad]")

    result = check_truss(read_profile(path), study, optimum=False)
    path.unlink()  # made again from the question
    return {
        "passed": result.passed,
        "estimated_noise": result.details["noise"]["deviation"],
        "peaks": {
            key: {**peak, "truth": law.values[key]}
            for key, peak in result.details["peaks"].items()
            if key in (*JUDGED, "peak-jerk")
        },
    }


def tables(rows: Sequence[Row]) -> list[Table]:
    """One line a case, and how many of them held."""
    answered = [row for row in rows if not row["failure"]]
    cells = [
        (
            str(row["index"]),
            row["law"],
            number(row["noise"], 3),
            number(DURATION / (row["rows"] - 1), 3),
            number(row["estimated_noise"], 3),
            number(100 * _bound(row, "peak-acceleration"), 3),
            number(100 * _error(row, "peak-acceleration"), 3),
            number(100 * _bound(row, "peak-jerk"), 3),
            "yes" if _held(row, JUDGED) else "NO",
            "yes" if _narrow(row) else "NO",
        )
        for row in answered
    ]
    about = ("case", "law", "noise [rad]", "every [s]", "estimated [rad]")
    found = ("acceleration +- [%]", "its error [%]", "jerk +- [%]", "within", "narrow")
    return [Table("each case", (*about, *found), cells), _total(rows, answered)]


def _total(rows: Sequence[Row], answered: Sequence[Row]) -> Table:
    def share(name: str, held: int) -> tuple[str, str]:
        return name, f"{held} of {len(rows)}"

    lines = [share("answered", len(answered))]
    for key in (*JUDGED, "peak-jerk"):
        title = QUANTITIES[key].title
        lines.append(share(f"{title} within its bounds", sum(_held(r, (key,)) for r in answered)))
    lines += [
        share("all of these but the jerk within", sum(_held(row, JUDGED) for row in answered)),
        share("all bounds but the jerk's narrow", sum(map(_narrow, answered))),
        share("every check passed", sum(row["passed"] for row in answered)),
    ]
    notes = [
        f"narrow: at most {100 * wide:g} % up to {noise:g} rad" for noise, wide in WIDE.items()
    ]
    return Table("in total", ("", "cases"), lines, notes)


def _held(row: Row, keys: Sequence[str]) -> bool:
    """Whether the true peaks lie between their bounds."""
    peaks = row["peaks"]
    return all(peaks[key]["low"] <= peaks[key]["truth"] <= peaks[key]["high"] for key in keys)


def _bound(row: Row, key: str) -> float:
    """The larger distance of a bound from the value, relative."""
    peak = row["peaks"][key]
    return float(max(peak["high"] - peak["value"], peak["value"] - peak["low"]) / peak["value"])


def _error(row: Row, key: str) -> float:
    peak = row["peaks"][key]
    return float(abs(peak["value"] / peak["truth"] - 1))


def _narrow(row: Row) -> bool:
    allowed = next((wide for noise, wide in WIDE.items() if row["noise"] <= noise), math.inf)
    return all(_bound(row, key) <= allowed for key in JUDGED)
