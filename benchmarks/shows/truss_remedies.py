"""The show "truss-remedies": limits that no motion keeps, and the number that a refusal names.

Every case draws a truss and states one limit that is proven to be missed. The number in the refusal
is typed back as it is printed. It helps if that limit is not refused again. No motion is solved.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shows.show import Question, Row
from benchmarks.shows.truss_random import question as drawn
from studies.common.console import Table, silent
from studies.common.exit_codes import StudyError
from studies.truss.config import study_from
from studies.truss.limits.bounds import lower_bounds
from studies.truss.limits.feasibility import end_forces
from studies.truss.search.motion_search import Search

LINE = "limits that a refusal of the truss names, typed back as they are printed"
LIMIT = 120.0  # [s]

JERK = 200.0  # times 1/T^3 [rad/s^3]
NUMBER = r"([-+.\deE]*\d)"
# what is capped: the quantity whose proven bound it is set below, and how its refusal names it
LIMITS = {
    "least_tension": ("", rf"last one to {NUMBER} N; lower"),
    "force": ("", rf"(?:statics need|motion needs at least|other caps is) {NUMBER} N"),
    "power": ("peak-power", rf"least possible is {NUMBER} W"),
    "jerk": ("", rf"32 D/T\^3 = {NUMBER} "),
    "reaction": ("peak-reaction", rf"least possible is {NUMBER} N"),
    "rope_speed": ("peak-rope-speed", rf"least possible is {NUMBER} m/s"),
    "rope_acceleration": ("peak-rope-acceleration", rf"least possible is {NUMBER} m/s\^2"),
    "duration": ("", rf"(?:need|duration to|takes) at least {NUMBER} s"),
}
REFUSALS = 6  # in a row, as one proof after the other may name a number


def question(seed: int, index: int) -> Question:
    """Draw a truss and by how much a limit is missed; the limits take turns."""
    study = drawn(seed, index)
    rng = np.random.default_rng([seed, index, 1])
    names = ("duration", "friction", "modules", "lengths")
    chosen = {name: study[name] for name in names}
    return {**chosen, "limit": list(LIMITS)[index % len(LIMITS)], "share": rng.uniform(0.2, 0.95)}


def answer(question: Question, folder: Path) -> Row:
    """State the limit, and what each refusal names in its place."""
    raw = _missed(question)
    said: list[str] = []
    for _ in range(REFUSALS):
        try:
            Search(study_from(raw), silent()).check()
        except StudyError as refused:
            said.append(str(refused))
        else:
            return {"helped": len(said) > 0, "said": said}
        if not _followed(raw, said[-1], question["limit"]):
            break
    return {"helped": False, "said": said}


def _followed(raw: dict[str, Any], refusal: str, preferred: str) -> bool:
    """Type the number of a refusal back, that of the case's own limit first."""
    springs = re.search(rf"spring_free_length to {NUMBER} m", refusal)
    if springs is not None:
        raw["truss"]["spring_free_length"] = float(springs[1])
        return True
    for limit in (preferred, *LIMITS):
        found = re.search(LIMITS[limit][1], refusal)
        place = raw if limit == "duration" else raw["caps"]
        if found is not None and place.get(limit) != float(found[1]):
            place[limit] = float(found[1])
            return True
    return False


def _missed(question: Question) -> dict[str, Any]:
    """A study whose limit is missed by the share that was drawn."""
    limit, share, duration = question["limit"], question["share"], question["duration"]
    raw: dict[str, Any] = {
        "minimise": "peak-acceleration",
        "duration": duration,
        "truss": {
            "pulley_friction": question["friction"],
            "modules": question["modules"],
            **question["lengths"],
        },
        "caps": {"jerk": JERK / duration**3},
    }
    study = study_from(raw)
    ends = end_forces(study.truss)
    if limit == "duration":
        raw["duration"] = share * duration * (32.0 * study.stroke / JERK) ** (1 / 3)
    elif limit == "jerk":
        raw["caps"]["jerk"] = share * 32.0 * study.stroke / duration**3
    elif limit == "least_tension":
        raw["caps"][limit] = max(min(force * part for _, force, part in ends), 0.0) / share
    elif limit == "force":
        raw["caps"][limit] = share * max(force for _, force, _ in ends)
    else:
        raw["caps"][limit] = share * lower_bounds(study, None)[LIMITS[limit][0]]
    return raw


def tables(rows: Sequence[Row]) -> list[Table]:
    """Return each limit in a row, and how many numbers helped."""
    head = ("case", "limit", "refusals", "helped", "last refusal")
    cells = [
        (
            str(row["index"]),
            row["limit"],
            "-" if row["failure"] else str(len(row["said"])),
            "-" if row["failure"] else ("yes" if row["helped"] else "NO"),
            row["failure"] or "".join(row["said"][-1:])[:160],
        )
        for row in rows
    ]
    done = [row for row in rows if not row["failure"]]
    helped = f"helped: {sum(row['helped'] for row in done)} of {len(done)}"
    return [Table("Numbers of refusals, typed back", head, cells, (helped,))]
