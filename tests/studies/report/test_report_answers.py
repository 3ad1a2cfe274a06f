"""The box "Answer" of a page answers the question of its command, and leads with what failed."""

import dataclasses

import pytest

from studies.common.comparison_table import TableRow
from studies.common.result import Criterion, Result, Verdict
from studies.report.words import answer, gains

FORCE = TableRow(
    "peak-force", "peak rope force", "N", {"optimal": 85.2, "Bezier": 85.3}, minimised=True
)
POWER = TableRow("peak-power", "peak motor power", "W", {"optimal": 8.0, "Bezier": 14.5}, cap=8.0)


def found(*rows: TableRow, kind: str = "truss", **more: object) -> Result:
    return Result(
        kind=kind,
        question="?",
        configuration={"duration": [10.0, 60.0]},
        table=rows,
        verdict=Verdict("local", "local: best of 1 start"),
        **more,  # type: ignore[arg-type]
    )


def check(name: str, passed: bool, decided: bool = True) -> Criterion:
    return Criterion(name, "N", 2.0, 1.0, passed, decided=decided)


@pytest.mark.parametrize(
    ("checks", "said"),
    [
        ((check("force", False), check("power", True)), "No: it violates 1 of 2 checks: force 2 N"),
        ((check("force", True, decided=False),), "Not decided, because of noise or rounding: "),
        ((check("force", True), check("power", True)), "Yes: it keeps all 2 checks."),
    ],
)
def test_a_check_is_answered_by_yes_or_no(checks: tuple[Criterion, ...], said: str) -> None:
    profile = dataclasses.replace(FORCE, values={"profile": 85.3, "Bezier": 85.2})
    assert answer(found(profile, kind="check", checks=checks))[0].startswith(said)


def test_failed_margins_lead() -> None:
    margins = tuple(check(f"margin {k}", False) for k in range(5))
    first = answer(found(FORCE, checks=(*margins, check("angle", True))))[0]
    assert first.startswith("The motion fails 5 of 6 checks: margin 0 2 N (limit 1); ")
    assert first.endswith("; and 2 more.")


def test_a_law_that_breaks_a_cap_is_no_law_to_compare_with() -> None:
    broken = dataclasses.replace(POWER, broken_by=("Bezier",))
    alone = found(FORCE, broken)
    said = " ".join(answer(alone))
    assert "85.3" not in said
    assert (
        "No other law of the table keeps the caps: Bezier has a peak motor power of 14.5 W" in said
    )
    assert gains(alone)[0] == "A motion within the caps: no other law of the table keeps them"

    others = [
        dataclasses.replace(row, values={**row.values, "Step5": value})
        for row, value in ((FORCE, 90.0), (broken, 7.0))
    ]
    (sentence,) = answer(found(*others))
    assert "5.33 % less than that of Step5 (90 N), the best of the other laws that keep" in sentence


def test_a_front_begins_with_its_ends_and_calls_its_own_limit_no_law_of_nature() -> None:
    values = {"knee": 12.0, "least time": 10.0, "least force": 60.0, "Bezier": 12.0}
    time = TableRow("time", "duration", "s", values, minimised=True, bound=10.0)
    forces = {"knee": 90.0, "least time": 99.0, "least force": 85.0, "Bezier": 95.0}
    force = dataclasses.replace(FORCE, values=forces)
    ends = ("least time", "least force")
    said = answer(found(time, force, kind="pareto-truss", also_found=ends))
    assert said[0] == (
        "The Pareto front has these ends: duration 10 s, peak rope force 99 N; "
        "duration 60 s, peak rope force 85 N."
    )
    assert "The duration is 12 s: the same as that of Bezier (12 s)" in said[2]
    assert not any("The proven lower bound is" in sentence for sentence in said)


def test_what_is_nothing_in_both_is_no_gain_and_nothing_beside_much_is_one() -> None:
    lost = TableRow(
        "lost", "energy lost", "J", {"optimal": 5.8e-19, "Step5": 7.8e-11}, better="less"
    )
    settled = TableRow("settled", "settling", "s", {"optimal": 0.0, "Step5": 41.0}, better="less")
    assert gains(found(lost, settled)) == ["Settling: 0 instead of 41 s of Step5"]
