"""Three objectives: who dominates whom, the next slice, what a surface becomes; slowly, a truss."""

import dataclasses
import itertools
import math
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from models.laws import least_peak_acceleration
from ocp import Constant, FixedMesh, prepare
from ocp.analysis.front.both_ways import Walked
from ocp.analysis.front.continuation import FrontPoint, Ranges
from ocp.analysis.front.envelope import front_of
from studies.cli import main
from studies.common.console import silent
from studies.common.exit_codes import StudyError
from studies.common.result import Result, Verdict
from studies.export.source import with_motion
from studies.pareto import draw, pareto_from
from studies.pareto.columns import FrontAxis
from studies.pareto.surface.columns import surface_series
from studies.pareto.surface.shape import Box, SurfacePoint, apart, dominated, knee_of, surface_of
from studies.pareto.surface.slices import SliceFront
from studies.pareto.surface.truss import TrussSurface
from studies.pareto.surface.walk import OutOfTimeError, Stack, SurfaceWalk
from studies.pareto.surface.words import (
    SurfaceAxes,
    dominated_in_words,
    surface_in_words,
    surface_verdict,
)
from studies.report.page import page, shown
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import law_of_result, study_of

THREE = ["time", "peak-acceleration", "peak-force"]
AXES = SurfaceAxes(
    FrontAxis("time", "duration", "s"),
    FrontAxis("peak-acceleration", "peak angular acceleration", "rad/s^2"),
    FrontAxis("peak-force", "peak rope force", "N"),
)


def stated(objectives=THREE, **more):
    pareto = {"objectives": objectives, **more.pop("pareto", {})}
    return {"pareto": pareto, "duration": [5.5, 9.0], "caps": {"jerk": 2.5}, **more}


def on_surface(z, x, motion=None):
    """y = 1/(z x), which falls with both limits."""
    y = 1 / (z * x)
    point = FrontPoint(x, x, y, -y / x, "up", False, 1.0, motion)
    return SurfacePoint(z, z, -y / z, point)


def surface(places=(0.5, 0.7, 1.0, 2.5), levels=(1.0, 2.0, 4.0)):
    points = [on_surface(z, x) for z in levels for x in places]
    worse = dataclasses.replace(points[5], z=1.5 * points[5].z)
    return surface_of([*points, worse], 0.5)


# few values, so that points are often equal in one objective or in all
values = st.integers(0, 4).map(float)


@given(arrays(float, st.tuples(st.integers(1, 12), st.just(3)), elements=values))
def test_what_is_kept_is_undominated_and_beats_what_is_not(places):
    beaten = dominated(places)
    kept, rest = places[~beaten], places[beaten]
    assert kept.size
    for a, b in itertools.permutations(kept, 2):
        assert not (a <= b).all()
    for lost in rest:
        assert (kept <= lost).all(axis=1).any()


def test_the_knee_is_farthest_below_the_plane_of_the_corners():
    # an eighth of a sphere about (1, 1, 1), whose middle is nearest to the best of all
    angles = np.linspace(0.0, math.pi / 2, 19)
    places = [
        (1 - math.sin(b), 1 - math.cos(b) * math.cos(a), 1 - math.cos(b) * math.sin(a))
        for a in angles
        for b in angles
    ]
    points = [
        SurfacePoint(z, z, 0.0, FrontPoint(x, x, y, 0.0, "up", False, 0.0, None))
        for z, x, y in places
    ]
    knee = points[knee_of(points, Box.around(places))]
    # the points are 5 degrees apart
    assert knee.place == pytest.approx([1 - 1 / math.sqrt(3)] * 3, abs=0.05)
    # on a single slice there is none
    flat = [on_surface(1.0, x) for x in (1.0, 2.0, 3.0)]
    assert knee_of(flat, Box.around([p.place for p in flat])) is None


def test_gaps_are_those_of_neighbours_on_one_slice():
    found = surface()
    assert len(found.points) == 12
    assert [point.z for point in found.dominated] == [3.0]
    assert {gap[1:] for gap in found.gaps} == {(1.0, 2.5)}
    assert found.limits == (1.0, 2.0, 4.0)
    # what is worst in one is a corner; the knee is none of them
    assert found.points[found.knee].place not in [found.points[k].place for k in (0, -1)]


def front_at(z, places=(0.5, 1.0, 2.5)):
    points = [on_surface(z, x).point for x in places]
    return front_of(points, Ranges((0.5, 2.5), (0.1, 2.0)), 9.0)


def test_slices_are_as_far_apart_as_their_curves():
    ranges = Ranges((0.0, 1.0), (0.0, 1.0))

    def level(height):
        points = [
            FrontPoint(x, x, height - 1e-6 * x, 0.0, "up", False, 0.0, None)
            for x in (0.0, 0.5, 1.0)
        ]
        return front_of(points, ranges, 9.0)

    assert apart(level(0.2), level(0.5), ranges) == pytest.approx(0.3, abs=1e-5)
    assert apart(level(0.2), level(0.2), ranges) == 0.0


def fake_slice(z):
    points = [on_surface(z, x) for x in (0.5, 1.0, 2.5)]
    walked = Walked(front_at(z), (), stopped=False)
    return SimpleNamespace(
        limit=z, points=lambda: points, walked=walked, subject=SimpleNamespace(origin=None)
    )


def walk_of(study):
    return SurfaceWalk(TrussSurface(study, silent()), silent())


def test_the_next_slice_halves_the_widest_gap():
    walk = walk_of(pareto_from(stated()))
    walk.slices = [fake_slice(z) for z in (1.0, 2.0, 3.0)]
    walk.tried = [3.0, 1.0, 2.0]
    # from 1 to 2 the curve falls to a half, from 2 to 3 by a third
    assert walk._between() == pytest.approx(1.5)


@pytest.mark.parametrize(
    ("stop", "kind", "words"),
    [
        (KeyboardInterrupt, "unverified", "stopped with 3 points on 1 of 4 slices"),
        (OutOfTimeError, "local", "the seconds were over with 1 of 4 slices"),
    ],
)
def test_what_is_done_is_kept_where_the_work_ends(monkeypatch, stop, kind, words):
    study = pareto_from(stated(pareto={"slices": [6, 7, 8, 9]}))
    walk = walk_of(study)
    done = iter([fake_slice(9.0)])

    def one_slice(*arguments):
        try:
            return next(done)
        except StopIteration:
            raise stop from None

    monkeypatch.setattr(SliceFront, "walk", one_slice)
    stack = walk.run()
    assert [one.limit for one in stack.slices] == [9.0]
    verdict = surface_verdict(stack)
    assert (verdict.kind, words in verdict.sentence) == (kind, True)
    # and where there is nothing yet, that is said
    empty = walk_of(study)
    with pytest.raises(StudyError, match=r"stopped before a slice|no slice was found in"):
        empty.run()


def result():
    found = surface()
    bounds = np.array([0.9 * point.point.y for point in found.points])
    stack = Stack((1, 2, 3), found, 4, (), stopped=False, out_of_time=False)
    return Result(
        kind="pareto-truss",
        question="a surface: of three",
        configuration={},
        arrays=surface_series(found, bounds, AXES),
        verdict=Verdict("local", "local"),
        remarks=surface_in_words(stack, AXES),
        details={
            "axes": [vars(axis) for axis in (AXES.z, AXES.x, AXES.y)],
            "bound": "proven: none is below",
            "gaps": [list(gap) for gap in found.gaps],
            "knee": found.knee + 1,
        },
    )


def test_the_words_say_slices_knee_gaps_and_both_prices():
    words = " ".join(result().remarks)
    assert "12 verified points on 3 slices, from 1 to 4 s of duration; dropped" in words
    assert "Of 4 slices that were asked for 3 exist" in words
    assert "At 2 s: from peak angular acceleration 0.5 rad/s^2 with 1 N to 2.5" in words
    assert "The knee is at" in words
    assert "The slice at 4 s has a gap between 1 and 2.5 rad/s^2" in words
    # y/z of a tenth of a second, and 1 % of the limit
    assert "0.1 s more of duration saves 0.2 N, and 0.005 rad/s^2 (1 %) more" in words
    assert "saves 0.02 N, at these slopes" in words


@pytest.mark.parametrize(
    ("place", "broken", "words"),
    [
        ((2.0, 1.0, 1.0), (), "is dominated: with no more of the others the surface needs 0.5 N"),
        ((2.0, 1.0, 0.5 + 1e-9), (), "is indistinguishable from the surface"),
        ((2.0, 1.0, 0.4), ("jerk",), "is below the surface, by 25 %; it breaks the cap on jerk"),
        ((0.9, 1.0, 9.0), (), "lies where no point of the surface"),
    ],
)
def test_a_law_is_held_against_the_surface(place, broken, words):
    assert words in dominated_in_words(surface(), "Step5", place, AXES, broken)


def test_a_surface_is_stored_and_drawn_from_what_was_stored(tmp_path):
    result().save(tmp_path)
    stored = Result.load(tmp_path)
    assert stored.axis == "point"
    assert stored.arrays["price of time"].unit == "N/s"
    ((name, figure),) = draw(stored)
    assert name == "surface"

    top, of_x, of_z, bar = figure.axes
    curves = [line for line in top.get_lines() if np.isnan(line.get_ydata()).any()]
    # a curve for each slice, broken where its gap is, and each in a colour of its own
    assert [np.flatnonzero(np.isnan(c.get_ydata())).tolist() for c in curves] == [[3]] * 3
    assert len({c.get_color() for c in curves}) == 3
    assert bar.get_ylabel() == "duration at most [s]"
    assert [tick.get_text() for tick in bar.get_yticklabels()] == ["1", "2", "4"]
    assert (of_x.get_ylabel(), of_z.get_ylabel()) == ("[N/(rad/s²)]", "[N/s]")
    plt.close(figure)


def test_a_report_has_a_curve_for_each_slice_and_both_prices():
    front, of_x, of_z = shown(result()).charts
    assert [curve.law for curve in front.curves] == [f"duration {z} s" for z in (1, 2, 4)]
    assert (front.title, front.axes[0].key) == ("peak rope force", "peak-acceleration")
    assert front.curves[1].values.tolist() == [1 / (2.0 * x) for x in (0.5, 0.7, 1.0, 2.5)]
    assert [chart.unit for chart in (of_x, of_z)] == ["N/(rad/s^2)", "N/s"]
    assert "duration 2 s" in page(result())


@pytest.mark.parametrize(
    ("objectives", "in_order"),
    [
        (["peak-force", "time", "peak-acceleration"], ("time", "peak-acceleration", "peak-force")),
        (["time", "energy", "peak-jerk"], ("peak-jerk", "time", "energy")),
        (["peak-reaction", "energy", "peak-power"], ("peak-power", "peak-reaction", "energy")),
    ],
)
def test_two_of_three_are_limited(objectives, in_order):
    study = pareto_from(stated(objectives))
    assert study.pareto.in_order == in_order
    assert study.truss.minimise == ({in_order[-1]: 1.0},)
    # a search of 300 s would not do for all slices
    assert study.truss.solver.seconds == 1200.0


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        (stated(["time", "peak-force", "time"]), "names time twice"),
        (stated(["time"] * 3), "names time three times"),
        (stated([*THREE, "energy"]), "give two or three out of"),
        (stated(["time", "peak-force", "peak-forse"]), "did you mean peak-force"),
        (stated(duration=6.0), "needs bounds"),
        (stated(pareto={"slices": [7, 6]}), "each above the one before"),
        (stated(pareto={"slices": [6]}), "at least two limits"),
        (stated(pareto={"slices": 1}), "at least 2"),
        (stated(pareto={"slices": [5, 6]}), "the study allows from 5.5 to 9 s; leave that slice"),
        (stated(THREE[:2], pareto={"slices": 3}), "is for three objectives"),
        (
            stated(["peak-jerk", "peak-power", "energy"], pareto={"slices": [1, 3]}),
            "the study allows at most 2.5 rad/s",
        ),
        (
            stated(["peak-jerk", "time", "energy"], pareto={"range": [5, 6]}),
            "leave one of them out",
        ),
    ],
)
def test_what_cannot_be_asked_of_three_is_refused(raw, words):
    with pytest.raises(StudyError, match=words):
        pareto_from(raw)


@pytest.mark.parametrize(
    ("words", "code", "sentence"),
    [
        # as `truss` says it: the mean speed is a limit that no motion attains without jumps
        (
            "peak-rope-speed,peak-power,energy --duration 6",
            3,
            "no motion is best: the least peak rope speed is",
        ),
        ("peak-jerk,peak-power,energy --duration 6", 2, "slices of the jerk need its highest"),
        (
            "peak-acceleration,peak-power,energy --duration 6 --slices 0.01,0.3",
            3,
            "no motion deploys in 6 s under the caps on acceleration 0.01",
        ),
    ],
)
def test_the_command_refuses_what_has_no_surface(words, code, sentence, capsys, tmp_path):
    folder = tmp_path / "none"
    words = ["pareto", "truss", "--objectives", *words.split(), "--results", str(folder)]
    assert main(words) == code
    assert sentence in capsys.readouterr().err
    assert not folder.exists()


@pytest.mark.slow
def test_a_coarse_surface_of_the_truss(tmp_path):
    folder = tmp_path / "surface"
    words = "--duration 5.5..9 --jerk-cap 2.5 --slices 6,8 --coarse --objectives"
    flags = [*words.split(), ",".join(THREE), "--results", str(folder)]
    assert main(["pareto", "truss", *flags]) == 0
    found = Result.load(folder)
    assert found.passed
    values = {name: series.values for name, series in found.arrays.items()}
    places = np.column_stack([values[name] for name in THREE])
    assert not dominated(places).any()
    assert set(values["slice"]) == {6.0, 8.0}
    # what is the least of a sketch is not the least that there is
    assert any("begin 2 % above the least peak angular acc" in line for line in found.remarks)
    assert "least force drawn" in (folder / "table.txt").read_text()
    assert (values["peak-force"] >= values["bound"] * (1 - 1e-6)).all()

    study = pareto_from(found.configuration)
    for level in (6.0, 8.0):
        here = values["slice"] == level
        # a sketch begins 2 % above the least acceleration, a closed form under the cap on the jerk
        least = least_peak_acceleration(study.truss.stroke, level, jerk=2.5)
        assert values["peak-acceleration"][here].min() == pytest.approx(1.02 * least, rel=1e-3)
        # the static peak is 20.0751 N, which is where the force ends; momentum saves a little
        assert 20.05 < values["peak-force"][here].min() < 20.15
    # `antenna-ocp truss --objective peak-force --duration 6 --jerk-cap 2.5` finds the first point
    # with --acceleration-cap 0.17324354; a front may leak 5e-4
    assert values["peak-force"][0] == pytest.approx(27.6626, rel=5e-4)

    # the motion of a point has all three values, and goes out as any motion does
    third = with_motion(found, "point 3")
    moved = Deployment("", law_of_result(third), study_of(third).truss).values
    for name in THREE:
        assert moved[name] == pytest.approx(values[name][2], rel=1e-6)
    assert (folder / "surface.png").is_file()
    assert len((folder / "profile.csv").read_text().splitlines()) > values["slice"].size
    assert main(["report", str(folder)]) == 0


@pytest.mark.slow
def test_both_prices_are_those_of_differences():
    study = pareto_from(stated(pareto={"coarse": True}))
    constant = Constant("limit of the slice", "s", 7.0)
    subject = SliceFront(study, 7.0, constant, silent(), math.inf)
    found = subject.near(0.15, subject._right(()), "down")
    solution, limit = found.motion.solution, found.motion.program.limit
    settings = dataclasses.replace(
        subject.settings, refinement=FixedMesh(), verify=False, iterations=None
    )
    prepared = prepare(found.motion.program.problem, settings=settings, guess=solution)

    def least(**moved):
        constants = {limit: moved.get("x", 0.15), constant: moved.get("z", 7.0)}
        return prepared.solve(constants=constants, guess=solution).objective

    # small steps each way, on the mesh of the point, where the same limits press
    step = 2e-4
    of_z = (least(z=(1 + step) * 7.0) - least(z=(1 - step) * 7.0)) / (2 * step * 7.0)
    of_x = (least(x=(1 + step) * 0.15) - least(x=(1 - step) * 0.15)) / (2 * step * 0.15)
    assert subject.on_surface(found).slope == pytest.approx(of_z, rel=0.01)
    assert found.slope == pytest.approx(of_x, rel=0.01)
    assert of_z < -0.1
    assert of_x < -1.0
