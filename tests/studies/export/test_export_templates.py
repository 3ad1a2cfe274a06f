"""A table of the user's own: what a template may do, and what is said of one that is wrong."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from studies.common.exit_codes import StudyError
from studies.common.result import Result
from studies.drive import Drive
from studies.drive.course import Course
from studies.drive.setpoints import SetPoints
from studies.export.formats import TABLES, Spacing, tabulated
from studies.export.source import source_of
from studies.export.templates import template_of
from tests.studies.export.command_line import complaint, export

Write = Callable[[str], Path]

DOCS = Path(__file__).parents[3] / "docs"
HEAD = '{# columns = ["time", "position"] #}\n'
ROW = "{% for point in points %}\n{{ point.time }} {{ point.position }}\n{% endfor %}\n"


def written(path: Path, course: Course, drive: Drive) -> tuple[str, SetPoints]:
    """The text of a template, and the points that are read back from it."""
    form = template_of(path)
    return form.write(tabulated(course, form, drive, Spacing()), {"unit": "m"}, 1)


@pytest.fixture
def template(tmp_path: Path) -> Write:
    def write(text: str) -> Path:
        path = tmp_path / "own.j2"
        path.write_bytes(text.encode("utf-8"))
        return path

    return write


def test_a_file_of_ones_own_is_written_and_played(
    folder: Path, template: Write, drive_file: Write, tmp_path: Path
) -> None:
    own = template(
        '{# columns = ["time", "position", "velocity"]\ninterpolation = "hermite" #}\n'
        '{{ header("; ") }}\n'
        "{% for point in points %}\n"
        'G1 X{{ "{:.3f}".format(1000 * point.position) }} F{{ 60000 * point.velocity }} '
        "T{{ point.time }}\n"
        "{% endfor %}\n"
    )
    file = tmp_path / "own.txt"
    words = ("--template", own, "--points", 17, "--output", file, "--drive", drive_file())
    assert export(folder, *words) == 0
    lines = file.read_text("utf-8").splitlines()
    assert sum(line.startswith("G1 X") for line in lines) == 17
    assert lines[0].startswith("; BEYOND CAPS OF THE STUDY = peak angular jerk")
    assert lines[1].startswith("; program = antenna-ocp")
    record = json.loads(Path(f"{file}.record.json").read_text("utf-8"))
    # of 6.60986660 m the file says 6609.867 mm
    assert record["miss of the last position [m]"] == pytest.approx(3.97e-7, abs=1e-9)


def test_the_template_of_the_documents_is_understood(short: Result, template: Write) -> None:
    page = (DOCS / "reference" / "export-formats.md").read_text("utf-8")
    (text,) = re.findall(r"```jinja\n(.*?)```", page, re.DOTALL)
    course = source_of(short).course("rope")
    table, again = written(template(text), course, Drive(period=0.25))
    assert table.splitlines()[-1] == "MOVE 6609.867 mm, 0 m/s AT 4"
    assert again.velocities[1:-1] == pytest.approx(course.derivatives(again.times[1:-1])[1])


@pytest.mark.parametrize(
    ("row", "scale"),
    [
        ('{{ "{:.2f}".format(point.position) }}', 0.01),
        ('{{ "{:.1f}".format(100 * point.position) }}', 0.001),
        ('{{ "{:.2f}".format(7 - point.position) | replace(".", ",") }}', 0.01),
        ("{{ (point.position - (points[-1].position | float)) | round(2) }}", 0.01),
        ('{{ "{:9.0f}".format(-point.position / 0.001) }}', 0.001),
        ("{{ point.position | real }}", 0.0),
    ],
)
def test_what_is_played_are_the_digits_in_whatever_unit(
    row: str, scale: float, short: Result, template: Write
) -> None:
    course = source_of(short).course("rope")
    own = template(HEAD + ROW.replace("{{ point.position }}", row))
    text, again = written(own, course, Drive(period=0.25))
    off = np.abs(again.positions - course.derivatives(again.times)[0])
    assert off.max() <= 0.5 * scale + 2e-14  # fifteen digits of up to 7 m
    assert off.max() >= 0.3 * scale  # of 17 numbers one is rounded by that much
    # and nothing but the row itself stands in the text
    assert set(text) <= set("0123456789.,- \n")


@pytest.mark.parametrize(
    ("along", "place", "first"),
    [
        ("time", "position", 0),
        *(("time", "displacement", first) for first in (0, 1)),
        *(("duration", "position", first) for first in (0, 1)),
        *(("duration", "displacement", first) for first in (0, 1)),
    ],
)
def test_any_columns_come_back(
    along: str, place: str, first: int, short: Result, template: Write
) -> None:
    head = f'{{# columns = ["{along}", "{place}", "velocity", "acceleration"] #}}\n'
    row = f"{{{{ point.{along} }}}} {{{{ point.{place} }}}} "
    rates = "{{ point.velocity }} {{ point.acceleration }}\n"
    rows = f"{{% for point in points[{first}:] %}}\n{row}{rates}{{% endfor %}}\n"
    course = source_of(short).course("rope")
    _, again = written(template(head + rows), course, Drive(period=0.25))
    exact = course.derivatives(again.times)
    assert again.times.size == 17
    # fifteen digits, added up over sixteen steps
    np.testing.assert_allclose(again.positions, exact[0], rtol=0, atol=1e-13)
    np.testing.assert_allclose(again.velocities, exact[1], rtol=0, atol=1e-12)


def test_equal_steps_are_those_that_the_table_says(short: Result, template: Write) -> None:
    head = '{# columns = ["position"] #}\n'
    rows = "{% for point in points %}\n{{ point.position }}\n{% endfor %}\n"
    ends = {"": 0.25, '{{ "{:.1f}".format(points[1].time) }}\n': 0.2}
    for end, step in ends.items():  # a step of 0.25 s, written as 0.2 s
        course = source_of(short).course("rope")
        _, again = written(template(head + rows + end), course, Drive(period=0.25))
        assert again.times == pytest.approx(step * np.arange(17), abs=1e-14)


def test_of_a_number_that_is_written_twice_the_worst_counts(short: Result, template: Write) -> None:
    last = 'ends at {{ "{:.0f}".format(points[-1].position) }} m\n'
    course = source_of(short).course("rope")
    _, again = written(template(HEAD + ROW + last), course, Drive(period=0.25))
    assert again.positions[-1] == 7.0


def test_lines_end_as_those_of_the_template(short: Result, template: Write) -> None:
    text, _ = written(
        template((HEAD + ROW).replace("\n", "\r\n")),
        source_of(short).course("rope"),
        Drive(period=0.25),
    )
    assert text.count("\r\n") == text.count("\n") == 17


@pytest.mark.parametrize("name", TABLES)
def test_a_format_of_the_program_is_a_template_like_any_other(
    name: str, folder: Path, template: Write, drive_file: Write, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("--drive", drive_file("interpolation = 'spline'\nperiod = 0.25"))
    assert export(folder, "--to", name, *words) == 0
    expected = capsys.readouterr().out
    assert export(folder, "--template", template(TABLES[name].source), *words) == 0
    assert capsys.readouterr().out == expected


@pytest.mark.parametrize(
    ("text", "answer"),
    [
        (ROW, "does not begin with its columns; write a comment such as {# columns ="),
        ("{# columns = time #}\n" + ROW, "is not valid TOML: Invalid value (at line 1, column 12)"),
        ("{# most = 5 #}\n" + ROW, "is refused: columns is not stated; give it"),
        ('{# columns = ["time"] #}\n' + ROW, "columns has no position; add position or displ"),
        ('{# columns = ["tme"] #}\n' + ROW, "columns is 'tme'; did you mean time?"),
        ('{# columns = ["position"]\nmost = 1 #}\n', "most is 1; give a whole number of at least"),
        ('{# column = ["position"] #}\n', "unknown key column; did you mean columns?"),
        (
            '{# columns = ["position"]\ninterpolation = "quintic" #}\n',
            "interpolation is 'quintic', which needs velocity and acceleration; add them",
        ),
        (HEAD + "{% fo point in points %}\n", "own.j2, line 2 is no text of Jinja2: Encountered"),
        (
            HEAD + "{{ point }}\n" + ROW,
            "own.j2, line 2 fails: UndefinedError, 'point' is undefined; known are",
        ),
        (
            HEAD + ROW.replace("position", "speed"),
            "line 3 fails: UndefinedError, 'dict object' has no attribute",
        ),
        (
            HEAD + "\n{{ 1 / 0 }}\n" + ROW,
            "own.j2, line 3 fails: ZeroDivisionError, division by zero",
        ),
        (
            HEAD + ROW.replace("point.position", "point.position - points[loop.index0].position"),
            "line 3 fails: TypeError, two numbers of points are joined; take displacement and",
        ),
        (
            HEAD + '{% include "/etc/passwd" %}\n',
            "own.j2, line 2 fails: TemplateNotFound, /etc/passwd",
        ),
        (
            HEAD + "{{ points.__class__ }}\n" + ROW,
            "line 2 fails: SecurityError, access to attribute '__class__'",
        ),
        (HEAD + ROW.replace("point.position", "point.position | abs"), "no position of point 1 of"),
        (HEAD + ROW.replace("in points", "in points[:-1]"), "no time of point 401 of 401; put"),
        (HEAD + ROW.replace("point.time", "0 * point.time"), "writes no time of point 1 of 401"),
        (
            HEAD + ROW.replace("{{ point.time }}", '{{ "{:.1f}".format(point.time) }}'),
            "writes no later time for point 2 than for point 1, 0 s; print more digits of it",
        ),
    ],
)
def test_a_wrong_template_is_answered_in_a_sentence(
    text: str, answer: str, short: Result, template: Write
) -> None:
    course = source_of(short).course("rope")
    with pytest.raises(StudyError) as refused:
        written(template(text), course, Drive(period=0.01))
    assert answer in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_file_that_is_no_template_is_answered_in_a_sentence(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert export(folder, "--template", tmp_path / "none.j2") == 2
    assert "none.j2 cannot be read (No such file or directory)" in complaint(capsys)
    (tmp_path / "latin.j2").write_bytes(b"{# \xe4 #}")
    assert export(folder, "--template", tmp_path / "latin.j2") == 2
    assert "latin.j2 is not text in UTF-8 (from byte 3)" in complaint(capsys)
    assert export(folder, "--to", "pvt", "--template", tmp_path / "none.j2") == 2
    assert "not allowed with" in complaint(capsys)
