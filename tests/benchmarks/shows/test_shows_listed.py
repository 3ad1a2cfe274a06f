"""Tables of rows: a row without an answer has dashes, an answer lacks nothing."""

import pytest

from benchmarks.shows.show import Columns, listed

COLUMNS: Columns = {
    "case": "index",
    "value": lambda row: f"{row['value']:.1f}",
    "words": lambda row: row["failure"] or row["words"],
}


def test_a_row_without_an_answer_has_dashes_and_its_reason() -> None:
    rows = [
        {"index": 0, "value": 1.25, "words": "fine", "failure": ""},
        {"index": 1, "failure": "not done after 1 s"},
    ]
    table = listed("cases", rows, COLUMNS, ("a note",))
    assert list(table.head) == ["case", "value", "words"]
    assert table.rows == [["0", "1.2", "fine"], ["1", "-", "not done after 1 s"]]
    assert table.notes == ("a note",)


def test_an_answer_that_lacks_something_is_no_dash() -> None:
    with pytest.raises(KeyError):
        listed("cases", [{"index": 0, "words": "fine", "failure": ""}], COLUMNS)
