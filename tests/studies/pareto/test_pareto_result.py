"""What a front becomes: series, sentences, a picture; and, slowly, a front of the truss."""

import dataclasses

import numpy as np
import pytest

from ocp import FrontPoint
from ocp.analysis.front.continuation import Ranges
from ocp.analysis.front.envelope import front_of
from studies.cli import main
from studies.common.exit_codes import StudyError
from studies.common.result import Result, Verdict
from studies.export.source import with_motion
from studies.fronts.columns import FrontAxis, front_details, front_series, law_series
from studies.fronts.figures import draw
from studies.fronts.result import PROVEN
from studies.fronts.words import dominated_law, front_in_words, open_end_in_words, price_at
from studies.report.page import shown
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import law_of_result, study_of

X, Y = FrontAxis("time", "duration", "s"), FrontAxis("peak-force", "peak rope force", "N")


def front():
    """y = 1/x, without the points between 2 and 4, and a dominated point."""
    places = [0.5, 0.6, 0.8, 1.0, 1.4, 2.0, 4.0, 4.5]
    points = [FrontPoint(x, x, 1 / x, -1 / x**2, "up", False, 1.0, None) for x in places]
    worse = FrontPoint(1.2, 1.2, 1.5, -1.0, "down", True, 1.0, None)
    return front_of([*points, worse], Ranges((0.5, 4.5), (0.2, 2.0)), 0.3)


def result():
    found = front()
    laws = {"Bezier": [(1.0, 3.0), (2.0, 2.5)], "Step5": [(1.0, 3.5)]}
    bounds = np.array([0.9 * point.y for point in found.points])
    return Result(
        kind="pareto-truss",
        question="a front",
        configuration={},
        arrays={**front_series(found, bounds, X, Y), **law_series(laws, X, Y)},
        bounds={"time": 0.4},
        verdict=Verdict("local", "local"),
        remarks=front_in_words(found, X, Y),
        details={**front_details(found, X, Y), "bound": PROVEN},
    )


def test_the_words_say_ends_knee_gap_and_prices():
    words = " ".join(front_in_words(front(), X, Y))
    assert "8 verified points, from 0.5 s with 2 N to 4.5 s with 0.222222 N" in words
    assert "dominated points removed: 1" in words
    assert "a gap between 2 and 4 s" in words
    assert "Its knee point is at" in words
    assert "At 0.5 s: 1 s more duration reduces the peak rope force by 4 N" in words
    # other limits have the price of a hundredth of them
    across = FrontAxis("peak-acceleration", "acceleration", "rad/s^2")
    point = FrontPoint(0.2, 0.2, 20.0, -5.0, "up", False, 0.0, None)
    assert (
        "0.002 rad/s^2 (1 %) more acceleration reduces the peak rope force by 0.01 N"
        in price_at(point, across, Y)
    )


def test_an_open_end_is_said_and_drawn_with_its_number():
    words = open_end_in_words("the least is 0.2 N, a limit that no motion attains", 0.2, 0.222)
    assert words == (
        "An end of the front is open: the least is 0.2 N, a limit that no motion attains; the "
        "nearest point is 11 % above it, and a wider range may come closer."
    )
    found = result()
    details = {**found.details, "open_ends": {"peak-force": 0.2}}
    [(_, figure)] = draw(dataclasses.replace(found, details=details))
    labels = figure.axes[0].get_legend_handles_labels()[1]
    assert "open end at 0.2: no motion reaches it" in labels
    # a limit below the picture is in the legend alone
    [(_, figure)] = draw(
        dataclasses.replace(found, details={**details, "open_ends": {Y.key: -1.0}})
    )
    labels = figure.axes[0].get_legend_handles_labels()[1]
    assert "open end at -1: no motion reaches it (below)" in labels


@pytest.mark.parametrize(
    ("place", "broken", "words"),
    [
        ((1.1, 2.0), (), "is dominated: with no more duration the front needs 1 N, 50 % less."),
        ((1.0, 1.0 + 1e-9), (), "is indistinguishable from the front"),
        ((1.0, 0.9), ("jerk",), "is below the front, by 11 %; it breaks the cap on jerk"),
        ((0.4, 9.0), (), "is left of the front"),
    ],
)
def test_a_law_is_held_against_the_front(place, broken, words):
    assert words in dominated_law(front(), "Step5", place, (X, Y), broken)


def test_a_result_is_stored_and_drawn_from_what_was_stored(tmp_path):
    result().save(tmp_path)
    stored = Result.load(tmp_path)
    assert stored.axis == "time"
    assert stored.arrays["price"].unit == "N/s"
    (name, figure), *others = draw(stored)
    assert (name, others) == ("front", [])

    top, bottom = figure.axes
    curve = next(line for line in top.get_lines() if np.isnan(line.get_ydata()).any())
    # the curve is broken where the gap is, and nowhere else
    breaks = np.flatnonzero(np.isnan(curve.get_ydata()))
    assert breaks.tolist() == [6]
    assert curve.get_xdata()[5] == 2.0
    assert bottom.get_xlabel() == "duration [s]"
    labels = top.get_legend_handles_labels()[1]
    assert {"Bezier", "Step5", "knee", "dominated"} <= set(labels)


def test_a_report_has_the_front_with_its_laws_and_the_price():
    front, price = shown(result()).charts
    assert [curve.law for curve in front.curves] == ["front", "Bezier", "Step5"]
    assert front.curves[0].values.size == 8
    assert (price.unit, price.axes[0].key) == ("N/s", "time")


@pytest.mark.slow
def test_a_coarse_front_of_the_truss(tmp_path):
    folder = tmp_path / "front"
    words = "--objectives time,peak-force --duration 5..9 --jerk-cap 2.5 --coarse"
    assert main(["pareto", "truss", *words.split(), "--results", str(folder)]) == 0
    found = Result.load(folder)
    assert found.passed
    x, y = found.arrays["time"].values, found.arrays["peak-force"].values
    assert x.size >= 6
    assert (np.diff(x) > 0).all()
    assert (np.diff(y) < 0).all()
    assert (y >= found.arrays["bound"].values * (1 - 1e-6)).all()
    assert 20.05 < y.min() < 20.3  # the static peak is 20.0751 N, and momentum saves a little

    # what a second saves lies between the prices at both ends of a step; a value is good to 5e-4,
    # 0.01 N, so that steps with less of a fall say nothing
    price = found.arrays["price"].values
    falls = -np.diff(y) / np.diff(x)
    told = -np.diff(y) > 0.01
    assert told.sum() >= 3
    assert (falls <= 1.2 * price[:-1])[told].all()
    assert (falls >= 0.8 * price[1:])[told].all()
    assert any("is dominated" in remark for remark in found.remarks)
    assert (folder / "front.png").is_file()
    assert (folder / "profile.csv").is_file()

    # the motion of a point has both its values, and goes out as any motion does
    third = with_motion(found, "point 3")
    moved = Deployment("", law_of_result(third), study_of(third).truss).values
    # an exact law again; peaks between rows are refined to rounding
    assert moved["time"] == pytest.approx(x[2], rel=1e-9)
    assert moved["peak-force"] == pytest.approx(y[2], rel=1e-6)
    file = tmp_path / "third.csv"
    flags = ["--motion", "point 3", "--to", "csv", "--step", "0.1", "--output", str(file)]
    assert main(["export", str(folder), *flags]) == 0
    assert float(file.read_text().splitlines()[-1].split(",")[0]) == pytest.approx(x[2])
    with pytest.raises(StudyError, match=f"'point 1' to 'point {x.size}'"):
        with_motion(found, "point 0")


def test_a_front_stored_without_motions_says_so():
    with pytest.raises(StudyError, match="stored without its motions"):
        with_motion(result(), "point 1")
