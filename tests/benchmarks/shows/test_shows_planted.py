"""The show of planted problems: what it says of an answer."""

from pathlib import Path

import pytest

from benchmarks.shows.engine import planted


@pytest.mark.parametrize(
    ("name", "outcome"),
    [("origin at 1e7 m", "right"), ("wrong mode", "refused"), ("dead zone", "refused")],
)
def test_what_is_said_of_an_answer(name: str, outcome: str, tmp_path: Path) -> None:
    row = planted.answer({"name": name}, tmp_path)
    assert row["outcome"] == outcome
    right = row["value"] == pytest.approx(row["optimum"], rel=planted.RIGHT)
    assert right == (outcome == "right")


def test_each_problem_is_asked_once_and_counted() -> None:
    count = len(planted.PLANTED)
    asked = [planted.question(1, index)["name"] for index in range(count + 1)]
    assert asked[:count] == list(planted.PLANTED)
    assert asked[count] == asked[0]

    row = {"name": "gust", "optimum": 1.0, "value": 2.0, "outcome": "refused", "failure": ""}
    each, together = planted.tables([{**row, "by": ["a second solve"], "stated_by": "nobody"}])
    assert "a second solve" in str(each)
    assert dict(together.rows)["refused"] == "1"
