"""Every format is as its golden file says, and comes back as it was written."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from studies.common.exit_codes import StudyError
from studies.common.result import Result
from studies.drive import Drive
from studies.drive.course import Course
from studies.drive.setpoints import SetPoints
from studies.export import c99, polynomials
from studies.export.formats import TABLES, Spacing, tabulated
from studies.export.round_trip import round_trip
from studies.export.source import source_of

NUMBER = re.compile(r"(?<![\w.])-?\d+\.\d+(?:[eE][-+]?\d+)?")
GOLDEN = Path(__file__).parent / "golden"
# of each format a row of its table, as its manual describes it; N:name is a number
ROWS = {
    "pvt": "^N:time,N:position,N:velocity$",
    "newport-xps": "^N:duration, N:displacement, N:velocity$",
    "galil": "^PVA=N:displacement,N:velocity,(?!0$)N:duration$",
    "codesys-x": r"(?:\[|, )N:position(?=, \d|\], fE)",
    "codesys-xy": r"\[N:time, N:position\]",
    "codesys-xyva": r"\(dX := N:time, dY := N:position, dV := N:velocity, dA := N:acceleration\)",
    "beckhoff": r"^ +N:time, N:position(?=,$|\];$)",
    "sew": r"^N:time\tN:position$",
    "sew-spline": r"^N:time\tN:position$",
    "ethercat": "^N:position$",
}
ABOUT = {"program": "golden", "unit": "m", "duration_s": "4"}
DRIVE = Drive(drum_radius=0.02, counts=65536, period=0.25, interpolation="spline", bandwidth=5.0)


def course_of(result: Result, signal: str = "rope") -> Course:
    return source_of(result).course(signal)


def table_of(result: Result, name: str, drive: Drive = DRIVE) -> SetPoints:
    return tabulated(course_of(result), TABLES[name], drive, Spacing())


def golden(name: str, content: str) -> None:
    """Compare with the file of a format; a missing one is written, and fails."""
    path = GOLDEN / f"{name}.txt"
    if not path.exists():
        path.write_text(content, "utf-8")
        pytest.fail(f"{path.name} was not there; look at what was written, and commit it")
    assert numbers_apart(content) == numbers_apart(path.read_text("utf-8"))


def numbers_apart(text: str) -> str:
    """The text with its numbers to 9 digits: the last bits of sin and cos differ by machine."""

    def rounded(match: re.Match[str]) -> str:
        value = float(match[0])
        # what is left of a zero by rounding differs altogether
        return f"{value:.9g}" if abs(value) > 1e-12 else "0"

    return NUMBER.sub(rounded, text)


@pytest.mark.parametrize("name", TABLES)
def test_a_table_is_as_its_golden_file(short: Result, name: str) -> None:
    points = table_of(short, name, Drive(drum_radius=0.02, counts=65536, period=0.25, buffer=17))
    golden(name, TABLES[name].write(points, ABOUT, 2)[0])


def test_curves_are_as_their_golden_files(short: Result) -> None:
    source = source_of(short)
    assert source.law is not None
    exact = polynomials.exact_segments(source.law)
    golden("segments", polynomials.write_segments(exact, ABOUT))
    golden("c99-double", c99.write_source(exact, ABOUT, "double"))
    golden("c99-float", c99.write_source(exact, ABOUT, "float"))


@pytest.mark.parametrize("name", TABLES)
def test_a_table_comes_back(short: Result, name: str) -> None:
    form, points = TABLES[name], table_of(short, name)
    text, again = form.write(points, ABOUT, 1)

    # fifteen digits of numbers up to 7 m and 4 s, added up over sixteen steps
    np.testing.assert_allclose(again.times, points.times, rtol=0, atol=1e-13)
    np.testing.assert_allclose(again.positions, points.positions, rtol=0, atol=1e-13)
    if form.layout.interpolation == "hermite":
        np.testing.assert_allclose(again.velocities, points.velocities, rtol=0, atol=1e-13)
    if points.count is not None:
        assert np.array_equal(
            np.rint(again.positions / points.count), np.rint(points.positions / points.count)
        )

    # and anybody who knows the format finds the same numbers in the text
    row = re.sub(r"N:(\w+)", r"(?P<\1>-?\\d+(?:\\.\\d*)?(?:[eE][-+]?\\d+)?)", ROWS[name])
    rows = [match.groupdict() for match in re.finditer(row, text, re.MULTILINE)]
    known = {
        "time": again.times,
        "duration": np.diff(again.times),
        "position": again.positions,
        "displacement": np.diff(again.positions),
        "velocity": again.velocities,
        "acceleration": again.accelerations,
    }
    unit = points.count if form.layout.in_counts else 1.0
    assert unit is not None
    for column in form.layout.columns:
        found = np.array([float(one[column]) for one in rows])
        factor = {"time": 1.0, "duration": form.layout.sample or 1.0}.get(column, unit)
        first = known[column].size - found.size  # with durations the first point is not written
        assert first in (0, 1)
        np.testing.assert_allclose(factor * found, known[column][first:], rtol=0, atol=1e-13)


@pytest.mark.parametrize("bandwidth", [None, 5.0, pytest.param(50.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", TABLES)
def test_peaks_stay_within_the_stated_bound(
    slow: Result, name: str, bandwidth: float | None
) -> None:
    drive = Drive(
        drum_radius=0.02, counts=65536, period=0.2, interpolation="spline", bandwidth=bandwidth
    )
    course, form = course_of(slow), TABLES[name]
    points = table_of(slow, name, drive)
    _, again = form.write(points, ABOUT, 1)
    truss = source_of(slow).truss
    record = round_trip(course, again, drive, form.layout.interpolation, truss, slow)

    found, most = record.playback.peak(2)[0], record.playback.most
    assert most is not None
    assert found <= most * (1 + 1e-12)  # the bound is proven, so rounding alone may exceed it
    # and it says something: at most twice the course's peak, beside what its own parts add
    assert found > 0.9 * course.peaks[1]
    assert record.truss is not None
    # half a count of rope is 0.6 micrometres, and 3.3 m of rope turn the angle by one rad there
    assert abs(record.truss.angle[-1] - np.pi / 2) < 3e-7


def test_a_table_in_counts_loses_none(slow: Result) -> None:
    points = table_of(slow, "galil")
    form = TABLES["galil"]
    moves = np.diff(form.write(points, ABOUT, 1)[1].counts)
    count = DRIVE.count("m") or 0.0
    assert moves.sum() == round(course_of(slow).travel / count)
    assert moves.size <= 255


def test_knots_lie_on_the_switches(slow: Result) -> None:
    course = course_of(slow)
    for name in ("pvt", "newport-xps", "codesys-xy", "codesys-xyva", "beckhoff", "sew-spline"):
        times = table_of(slow, name).times
        assert all(np.abs(times - t).min() < 1e-12 for t in course.switches), name
    # of a controller's samples: within half of one
    times = table_of(slow, "galil").times
    assert all(np.abs(times - t).min() <= 0.5 / 1024 + 1e-12 for t in course.switches)


def test_only_a_stated_limit_refuses_a_motion_of_many_switches(slow: Result) -> None:
    # 225 pieces in what are 200 periods of the drive
    course = course_of(slow)
    edges = course.duration * np.linspace(0.0, 1.0, 226) ** 2
    many = dataclasses.replace(course, switches=tuple(edges.tolist()))
    drive = Drive(period=course.duration / 200, interpolation="spline")
    points = tabulated(many, TABLES["codesys-xyva"], drive, Spacing())
    assert all(np.abs(points.times - edge).min() < 1e-12 for edge in edges)
    assert points.longest <= drive.period * (1 + 1e-9)
    with pytest.raises(StudyError, match=r"switches 224 times, but .* only 199 segments"):
        tabulated(many, TABLES["codesys-xyva"], drive, Spacing(points=200))


def test_each_velocity_ends_at_rest(slow: Result) -> None:
    for name in ("pvt", "newport-xps", "galil"):
        assert table_of(slow, name).velocities[-1] == 0.0


def test_a_device_that_cannot_hold_the_motion_says_what_would_do(slow: Result) -> None:
    course = course_of(slow)
    with pytest.raises(StudyError, match=r"1401 points, but the device holds 64; a step of 2\.222"):
        tabulated(course, TABLES["sew-spline"], Drive(), Spacing(step=0.1))
    with pytest.raises(StudyError, match=r"switches 4 times, but .* only 3 segments"):
        tabulated(course, TABLES["galil"], Drive(drum_radius=0.02, counts=65536), Spacing(points=3))
    short_steps = Drive(drum_radius=0.02, counts=65536, longest_segment=0.5)
    with pytest.raises(StudyError, match=r"longest_segment is 0\.5 s; use a buffer of 285"):
        tabulated(course, TABLES["galil"], short_steps, Spacing())
    with pytest.raises(StudyError, match=r"4\.2 counts; give at least 48 counts for each turn"):
        tabulated(course, TABLES["galil"], Drive(drum_radius=0.5, counts=2), Spacing())
    with pytest.raises(StudyError, match=r"give drive\.counts"):
        _ = tabulated(course, TABLES["ethercat"], Drive(), Spacing()).counts


def test_segments_of_the_rope_keep_their_error(slow: Result) -> None:
    course = course_of(slow)
    segments = polynomials.fitted_segments(course, 1e-9)
    time = np.linspace(0.0, 140.0, 100_001)
    miss = np.abs(segments.curve()(time) - course.derivatives(time)[0]).max()
    assert miss <= 1e-9
    assert segments.edges.size < 100


def test_segments_of_the_angle_are_the_law(slow: Result) -> None:
    law = source_of(slow).law
    assert law is not None
    segments = polynomials.exact_segments(law)
    again = polynomials.read_segments(polynomials.write_segments(segments, ABOUT))
    time = np.linspace(0.0, 140.0, 10_001)
    # JSON keeps all digits; Horner's form is evaluated in another order
    assert np.abs(again.curve()(time) - law.motion(time).angle).max() < 1e-14
