"""Figures of the race draw rows with and without an answer."""

from benchmarks.race import plots


def test_bars_and_curves_draw_rows_with_and_without_an_answer() -> None:
    medians = {"start": 0.1, "solve": 0.2, "verification": None, "process": 0.3}
    check = {"peak_error": 1e-4, "excess": -1.0, "miss": 0.0}
    good = {"problem": "A", "title": "good", "right": True, "medians": medians, "check": check}
    nothing = dict.fromkeys(medians)
    bad = good | {"title": "bad", "right": False, "medians": nothing, "check": None}
    rows = [row | {"why not": "not installed"} for row in (good, bad)]
    titles = {"A": "A: T = 1 s, least peak"}
    (panel,) = plots.bars(rows, titles).axes
    assert [label.get_text() for label in panel.get_yticklabels()] == ["good", "bad"]
    (panel,) = plots.curves(rows, titles).axes
    assert plots.worst_error(check) == 1e-4
