"""The show "factored-force": the least motor for its margins, and what governs it.

For the margins of AIAA S-114 and for others, at 5, 10 and 140 s, with three pulley frictions and a
jerk cap of 200/T^3, stand beside each other: the motion that needs the least motor for its margins,
the motion of least force, and the paper's two laws. At 140 s no law matters: what the truss takes
at rest governs them all.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.shows.show import Question, Row
from models.truss import TrussParameters
from studies.common.console import Table, number, silent
from studies.margin import MarginRequirements
from studies.truss.config import TrussStudy
from studies.truss.limits.caps import Caps
from studies.truss.motions.deployment import Deployment, travel_of
from studies.truss.motions.laws import paper_laws
from studies.truss.search.motion_search import Search

LINE = "the least motor for its margins beside the least force and the paper's laws: 18 cases"
LIMIT = 900.0  # [s]; a case takes one or two minutes

DURATIONS = (5.0, 10.0, 140.0)  # [s]
FRICTIONS = (0.0, 0.01, 0.03)
JERK_CUBED = 200.0  # the cap on the jerk [rad/s^3] times T^3
# cold: thick grease; hot: weak magnets and sticky pulleys; end: relaxed friction layers, old motor
CASES: dict[str, dict[str, Any]] = {
    "cold": {"joint_friction": 0.3, "slider_friction": 0.3},
    "hot": {"factors": {"pulley_friction": 1.2}, "derating": {"temperature": 0.9}},
    "end of life": {"factors": {"springs": 1.1, "net": 1.1}, "derating": {"ageing": 0.95}},
}
# the standard, and margins of a project that asks for less at rest but factors every load
ASKED: dict[str, dict[str, Any]] = {
    "aiaa-s-114": {"preset": "aiaa-s-114"},
    "factors": {
        "static": 0.25,
        "dynamic": 0.25,
        "factors": {
            **{"inertia": 1.1, "springs": 1.2, "net": 1.2},
            **{"joint_friction": 1.5, "slider_friction": 1.5, "pulley_friction": 1.5},
        },
    },
}
LEAST, FORCE = "least motor", "least force"
SAME = 1e-2  # relative: no uncertainty factor is known so well


def question(seed: int, index: int) -> Question:
    """Margins, duration and friction of a case; nothing is drawn, whatever the seed."""
    rest, place = divmod(index, len(FRICTIONS))
    policy, duration = divmod(rest, len(DURATIONS))
    return {
        "asked": tuple(ASKED)[policy % len(ASKED)],
        "duration": DURATIONS[duration],
        "friction": FRICTIONS[place],
    }


def answer(question: Question, folder: Path) -> Row:
    """What each motion needs of a motor, and its margins with the least motor of all."""
    margin = MarginRequirements(**ASKED[question["asked"]], cases=CASES)
    truss = TrussParameters(pulley_friction=question["friction"])
    found, laws = {}, []
    for name, aim in ((LEAST, "peak-factored-force"), (FORCE, "peak-force")):
        study = TrussStudy(
            minimise=aim,
            duration=question["duration"],
            truss=truss,
            caps=Caps(jerk=JERK_CUBED / question["duration"] ** 3),
            margin=margin,
        )
        search = Search(study, silent())
        search.check()
        best = search.run()
        law = best.deployment.law
        laws.append(Deployment(name, law, truss, margin=margin))
        found[f"verdict of the {name}"] = best.verdict.sentence
    laws += paper_laws(truss, question["duration"], margin=margin)

    least = laws[0].values["peak-factored-force"]
    return {**found, "laws": {law.name: _margins(law, margin, least) for law in laws}}


def _margins(law: Deployment, margin: MarginRequirements, available: float) -> dict[str, Any]:
    """What a law needs, and its margins with a motor of a given force."""
    from dataclasses import replace

    from studies.margin.travel import records

    stated = replace(margin, available=available)
    travel = travel_of(replace(law, margin=stated))
    assert travel is not None
    governing = {line["margin"]: line for line in records(travel) if line["governs"] == "yes"}
    return {
        "peak_force": law.values["peak-force"],
        "needed": law.values["peak-factored-force"],
        **governing,
    }


def tables(rows: Sequence[Row]) -> list[Table]:
    """Every motion in a line, then what the cases come to."""
    answered = [row for row in rows if not row["failure"]]
    cells = [
        (
            row["asked"],
            f"{row['duration']:g}",
            f"{row['friction']:g}",
            name,
            number(law["peak_force"], 6),
            number(law["needed"], 6),
            *_of(law["static"]),
            *_of(law["dynamic"]),
        )
        for row in answered
        for name, law in row["laws"].items()
    ]

    head = ("asked", "T [s]", "mu", "motion", "peak force [N]", "motor needed [N]")
    of_each = ("[%]", "at [deg]", "case", "most of it")
    columns = (
        *head,
        *(f"static {word}" for word in of_each),
        *(f"dynamic {word}" for word in of_each),
    )
    notes = [
        f"jerk cap {JERK_CUBED:g}/T^3; load cases {', '.join(CASES)}",
        "aiaa-s-114 asks for 100 % at rest and 25 % in motion; factors for 25 % of factored loads",
        "margins are those with the motor that the first motion of a case needs",
    ]
    outcome = [
        (
            row["asked"],
            f"{row['duration']:g}",
            f"{row['friction']:g}",
            _governed_by(row),
            "yes" if _no_law_matters(row) else "no",
            row[f"verdict of the {LEAST}"],
        )
        for row in answered
    ]
    of_outcome = ("asked", "T [s]", "mu", "margin", "no law matters", "verdict")
    return [
        Table("least motor for the margins", columns, cells, notes),
        Table("what governs", of_outcome, outcome),
    ]


def _of(line: dict[str, Any]) -> tuple[str, str, str, str]:
    what = f"{line['mostly']}, {100 * line['share']:.0f} %"
    return f"{100 * line['least']:.1f}", f"{line['angle_deg']:.1f}", line["case"], what


def _governed_by(row: Row) -> str:
    """The kind of margin that the least motor just meets."""
    law = row["laws"][LEAST]
    static, dynamic = (float(law[kind]["motor_N"]) for kind in ("static", "dynamic"))
    return "static" if static >= dynamic * (1 - SAME) else "dynamic"


def _no_law_matters(row: Row) -> bool:
    """Whether all motions need the same motor."""
    needs = [law["needed"] for law in row["laws"].values()]
    return bool(max(needs) <= min(needs) * (1 + SAME))
