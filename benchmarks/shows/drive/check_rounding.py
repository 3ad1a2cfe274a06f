"""The show "check-rounding": rounded exports of motions that keep their caps, and some that do not.

Two of three cases draw a truss, a law and how its rows are rounded: as a spreadsheet or a logger
leaves them, with even or uneven times. The caps are the law's own peaks. None may be called broken.
A file whose times repeat once rounded is refused, and checked after the remedy that this names.
Every third case keeps all digits, and one cap is 1 % below the peak: that cap has to be broken.
Rows tell means of a jerk over three steps and no more: through 430 to 690 rows of a Bezier law,
whose jerk falls from its peak at the start, another one has a peak 2.2 to 3.5 % lower. So rows that
are asked about a cap on the jerk are close enough for that mean to fall by less than 1 %.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.shows.show import Question, Row
from studies.common.console import Table
from studies.truss.quantities import QUANTITIES

if TYPE_CHECKING:
    from models.laws import Law
    from studies.truss.motions.deployment import Deployment

LINE = "check of rounded rows: no cap is called broken for nothing, and 1 % in full digits is"
LIMIT = 300.0  # [s]; one takes a few seconds

# of time and angle: as repr, as a spreadsheet saves them, in us and nrad, as loggers do
ROUNDINGS = (
    ("%.17g", "%.17g"),
    ("%.10g", "%.14g"),
    ("%.10g", "%.10g"),
    ("%.6f", "%.9f"),
    ("%.3f", "%.6f"),
    ("%.6f", "%.5f"),
    ("%.9g", "%.7g"),
    ("%.5g", "%.5g"),
)
EXACT = ROUNDINGS[0]
LAWS = ("jerk-limited", "Bezier", "Step5", "constant-acceleration")
DURATIONS = (5.0, 300.0)  # [s], log-uniform
JERKS = (60.0, 1000.0)  # times 1/T^3, log-uniform
ROWS = (150, 1000)
ROWS_OF_JERK = (2000, 4000)  # over 1.5 of the steps a Bezier law's jerk falls by at most 0.75 %
CLOSEST = 1e-3  # of the time between even rows: extra ones are no closer to these
CAPS = {
    "speed": "peak-speed",
    "acceleration": "peak-acceleration",
    "jerk": "peak-jerk",
    "rope_speed": "peak-rope-speed",
    "rope_acceleration": "peak-rope-acceleration",
    "rope_jerk": "peak-rope-jerk",
    "force": "peak-force",
    "power": "peak-power",
    "reaction": "peak-reaction",
}
# proven by differences of the angles alone; of a force these prove nothing
PROVEN = ("speed", "acceleration", "jerk", "rope_speed", "rope_acceleration")
EXCESS = 0.01
ROOM = 1e-6  # of a cap, that the numbers of a study may be off by


def question(seed: int, index: int) -> Question:
    """Draw a truss, a law and how its rows are written; every third one exceeds a cap."""
    rng = np.random.default_rng([seed, index])
    exceeds = index % 3 == 2
    law = str(rng.choice(LAWS[:3] if exceeds else LAWS))
    drawn: dict[str, Any] = {
        "law": law,
        "duration": float(f"{np.exp(rng.uniform(*np.log(DURATIONS))):.4g}"),
        "jerk": float(f"{np.exp(rng.uniform(*np.log(JERKS))):.4g}"),
        "friction": float(f"{rng.uniform(0.0, 0.03):.2g}"),
        "modules": int(rng.integers(6, 31)),
        "rows": int(np.exp(rng.uniform(*np.log(ROWS)))),
        "extra": int(rng.integers(0, 12)),
        # lengths hardly tell the angle beside the stowed one, and 1 % of its rates are lost there
        "column": "rope_length" if rng.random() < 0.2 and not exceeds else "angle",
        "rounding": list(EXACT if exceeds else ROUNDINGS[1 + int(rng.integers(7))]),
        "exceeded": str(rng.choice(PROVEN)) if exceeds else "",
        "draw": int(rng.integers(2**31)),
    }
    if drawn["exceeded"] == "jerk":
        drawn["rows"] = int(np.exp(rng.uniform(*np.log(ROWS_OF_JERK))))
    return drawn


def answer(question: Question, folder: Path) -> Row:
    """Check the file, and say which caps were called broken."""
    from studies.check.reading.profile import read_profile
    from studies.check.reading.rest import moving_part
    from studies.check.truss import check_truss
    from studies.common.exit_codes import StudyError
    from studies.truss.config import TrussStudy
    from studies.truss.limits.caps import Caps

    deployment = _motion(question)
    path = folder / "rounded.csv"
    text = _text(question, deployment)
    path.write_text(text, "utf-8")
    exceeded = question["exceeded"]
    caps = {
        cap: deployment.values[key] * (1.0 + ROOM) / (1.0 + EXCESS if cap == exceeded else 1.0)
        for cap, key in CAPS.items()
        if np.isfinite(deployment.values[key]) and _has_peak(question, cap)
    }
    study = TrussStudy(
        minimise="energy",
        duration=question["duration"],
        truss=deployment.truss,
        caps=Caps(**caps),
    )
    refused = ""
    try:
        profile = read_profile(path)
    except StudyError as error:  # times that repeat once rounded
        refused = str(error).replace(str(path), "FILE")
        path.write_text(_one_row_an_instant(text), "utf-8")
        profile = read_profile(path)

    measured = moving_part(profile, asked=study.duration)
    study = dataclasses.replace(study, duration=measured.duration)
    result = check_truss(measured, study, optimum=False)
    path.unlink()  # made again from the question
    titles = {QUANTITIES[key].title: cap for cap, key in CAPS.items()}
    failed = [check.name for check in result.checks if not check.passed]
    lows = {
        cap: result.details["peaks"][key]["low"] / deployment.values[key] - 1.0
        for cap, key in CAPS.items()
        if cap in caps
    }
    return {
        "refused": refused,
        "broken": [titles[name] for name in failed if name in titles],
        "misses": [name for name in failed if name not in titles],
        "highest_low": max(lows.values()),
        "smoothed": result.details["noise"]["matters"],
    }


def _one_row_an_instant(text: str) -> str:
    """The same file with the first of the rows that have the same time: the remedy named."""
    rows = {line.split(",")[0]: line for line in reversed(text.splitlines())}
    return "\n".join(reversed(rows.values())) + "\n"


def _has_peak(question: Question, cap: str) -> bool:
    """Whether the law has such a peak: where the acceleration jumps, the jerk has none."""
    return question["law"] != "constant-acceleration" or "jerk" not in cap


def _motion(question: Question) -> Deployment:
    from models.truss import TrussParameters
    from studies.truss.motions.deployment import Deployment

    truss = TrussParameters(
        pulley_friction=question["friction"],
        modules=question["modules"],
    )
    return Deployment("law", _law(question, truss), truss)


def _law(question: Question, truss: Any) -> Law:
    from models.laws import JerkLimited, constant_acceleration
    from studies.truss.config import DEPLOYED
    from studies.truss.motions.laws import paper_laws

    T, start = question["duration"], truss.stowed_angle
    if question["law"] == "jerk-limited":
        return JerkLimited(T, start, DEPLOYED, question["jerk"] / T**3)
    if question["law"] == "constant-acceleration":
        most = 4 * (DEPLOYED - start) / T**2
        return constant_acceleration((0.0, T / 2, T), (most, -most), start)
    return next(one.law for one in paper_laws(truss, T) if one.name == question["law"])


def _text(question: Question, deployment: Deployment) -> str:
    """The file: even rows, and a few between them, as at the switches of an optimum."""
    from studies.truss.motions.deployment import COLUMNS, columns_at

    T, rng = question["duration"], np.random.default_rng(question["draw"])
    even = np.linspace(0.0, T, question["rows"])
    extra = np.asarray(rng.uniform(0.0, T, question["extra"]))
    step = T / (question["rows"] - 1)
    extra = extra[np.abs(np.subtract.outer(extra, even)).min(axis=1) > CLOSEST * step]
    time = np.unique(np.concatenate([even, extra]))
    name = question["column"]
    of_time, of_value = question["rounding"]
    rows = zip(time, columns_at(deployment, time)[name], strict=True)
    head = f"time [s],{name} [{COLUMNS[name][0]}]"
    return "\n".join([head, *(f"{of_time % t},{of_value % x}" for t, x in rows)]) + "\n"


def tables(rows: Sequence[Row]) -> list[Table]:
    """The cases that are not as they should be, and how many are."""
    answered = [row for row in rows if not row["failure"]]
    rounded = [row for row in answered if not row["exceeded"]]
    exceeding = [row for row in answered if row["exceeded"]]
    wrong = [row for row in rounded if row["broken"] or row["misses"]]
    missed = [row for row in exceeding if row["exceeded"] not in row["broken"]]
    false = [row for row in exceeding if set(row["broken"]) - {row["exceeded"]} or row["misses"]]

    head = ("case", "law", "column", "rows", "rounding", "exceeded", "called broken")
    cells = [
        (
            str(row["index"]),
            row["law"],
            row["column"],
            str(row["rows"]),
            " ".join(row["rounding"]),
            row["exceeded"] or "-",
            ", ".join((*row["broken"], *row["misses"])) or "-",
        )
        for row in (*wrong, *missed, *false)
    ]
    lines = [
        ("answered", f"{len(answered)} of {len(rows)}"),
        (
            "refused at first, as rounded times repeat",
            str(sum(bool(row["refused"]) for row in answered)),
        ),
        (
            "rounded, a cap called broken that is kept",
            f"{sum(bool(row['broken']) for row in rounded)} of {len(rounded)}",
        ),
        (
            "rounded, another check failed",
            f"{sum(bool(row['misses']) for row in rounded)} of {len(rounded)}",
        ),
        (
            "in full digits, the exceeded cap called broken",
            f"{len(exceeding) - len(missed)} of {len(exceeding)}",
        ),
        ("in full digits, another check failed", f"{len(false)} of {len(exceeding)}"),
    ]
    made = [Table("in total", ("", "cases"), lines)]
    return [Table("not as they should be", head, cells), *made] if cells else made
