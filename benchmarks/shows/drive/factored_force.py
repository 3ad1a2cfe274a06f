"""The show "factored-force": the least motor for its margins, and what governs it.

For the margins of AIAA S-114 and for others, at 5, 10 and 140 s, with three pulley frictions and a
jerk cap of 200/T^3, stand beside each other: the motion that needs the least motor for its margins,
the motion of least force, and the paper's two laws.

At 140 s no law matters for the standard: what the truss takes at rest governs them all. The other
margins ask for the same at rest and in motion. So what governs is the static peak with the friction
of the speed at which it is passed, and that differs from law to law. It is shown by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchmarks.shows.show import Question, Row
from models.truss import TrussParameters
from studies.common.console import Table, number, silent
from studies.margin import MarginRequirements
from studies.margin.loads import IN_MOTION
from studies.margin.travel import records
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
SAME = 1e-3  # relative: what the truss takes at rest is the same to rounding, searches to 1e-4


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
    travel = travel_of(replace(law, margin=replace(margin, available=available)))
    assert travel is not None
    governing = {line["margin"]: line for line in records(travel) if line["governs"] == "yes"}

    # what motion adds to the force that holds the truss at the place that governs, by cause
    case, place = travel.worst("dynamic")
    share = (1 + margin.required[1]) / case.case.derating.whole
    moving = {name: share * float(case.parts[name][place]) for name in IN_MOTION}
    at_rest = (1 + margin.required[1]) * float(case.required["static"][place])
    return {
        "peak_force": law.values["peak-force"],
        "needed": law.values["peak-factored-force"],
        "moving": moving,
        "at_rest": at_rest / case.case.derating.whole,
        **governing,
    }


def tables(rows: Sequence[Row]) -> list[Table]:
    """Every motion in a line, then what the cases come to."""
    answered = [row for row in rows if not row["failure"]]
    return [_motions(answered), _outcomes(answered)]


def _motions(rows: Sequence[Row]) -> Table:
    """What each motion needs, with its margins, where and why they are least."""
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
        for row in rows
        for name, law in row["laws"].items()
    ]

    # the same four columns for both kinds of margin
    head = ("asked", "T [s]", "mu", "motion", "peak force [N]", "motor needed [N]")
    of_each = ("[%]", "at [deg]", "case", "most of it")
    columns = (*head, *(f"{kind} {word}" for kind in ("static", "dynamic") for word in of_each))
    notes = [
        f"jerk cap {JERK_CUBED:g}/T^3; load cases {', '.join(CASES)}",
        "aiaa-s-114 asks for 100 % at rest and 25 % in motion; factors for 25 % of factored loads",
        "margins are those with the motor that the first motion of a case needs",
    ]
    return Table("least motor for the margins", columns, cells, notes)


def _outcomes(rows: Sequence[Row]) -> Table:
    """Which margin governs, how much the laws differ, and why."""
    cells = [
        (
            row["asked"],
            f"{row['duration']:g}",
            f"{row['friction']:g}",
            _governed_by(row),
            f"{100 * _spread(row):.3f}",
            _worst_of(row),
            "yes" if _spread(row) <= SAME else "no",
            row[f"verdict of the {LEAST}"],
        )
        for row in rows
    ]

    columns = ("asked", "T [s]", "mu", "margin", "laws differ by [%]", "the most needed [N]")
    notes = ["what speed adds is before the pulleys, whose friction multiplies it"]
    return Table("what governs", (*columns, "no law matters", "verdict"), cells, notes)


def _worst_of(row: Row) -> str:
    """What the motion that needs most needs it for, in motion: at rest, and what speed adds."""
    name, law = max(row["laws"].items(), key=lambda entry: float(entry[1]["needed"]))
    if law["needed"] > law["dynamic"]["motor_N"] * (1 + SAME):
        return f"{name}: at rest"
    parts = [f"{part.replace('_', ' ')} {value:+.3g}" for part, value in law["moving"].items()]
    return f"{name}: at rest there {law['at_rest']:.5g}, {', '.join(parts)}"


def _of(line: dict[str, Any]) -> tuple[str, str, str, str]:
    what = f"{line['mostly']}, {100 * line['share']:.0f} %"
    return f"{100 * line['least']:.1f}", f"{line['angle_deg']:.1f}", line["case"], what


def _governed_by(row: Row) -> str:
    """The kind of margin that the least motor just meets."""
    law = row["laws"][LEAST]
    static, dynamic = (float(law[kind]["motor_N"]) for kind in ("static", "dynamic"))
    return "static" if static >= dynamic * (1 - SAME) else "dynamic"


def _spread(row: Row) -> float:
    """By how much the motor that the worst motion needs is larger than the least."""
    needs = [law["needed"] for law in row["laws"].values()]
    return float(max(needs) / min(needs)) - 1.0
