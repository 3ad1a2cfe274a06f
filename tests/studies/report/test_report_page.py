"""The page of a result: its order, its numbers, its safety, and the geometry that it stores."""

import base64
import dataclasses
import hashlib
import json
import math
import re
import tomllib
from html.parser import HTMLParser

import numpy as np
import pytest

from models.truss import ring_positions, rope_length
from studies.common.charts import charts_of_arrays, value_range
from studies.common.comparison_table import TableRow
from studies.common.console import number
from studies.common.result import Criterion, Result, Series, Verdict
from studies.common.scene.chain_shapes import read_shapes
from studies.common.scene.moving_picture import hermite
from studies.report import assets, words
from studies.report.comparison import beside
from studies.report.html import sentence, superscripts
from studies.report.page import page, shown
from studies.truss import study_from

TYPES = {"f": "<f4", "d": "<f8", "i": "<u2"}
ORDER = [
    "In motion",
    "Curves",
    "Requirement",
    "Model",
    "Parameters",
    "Results",
    "Independent verification",
    "Limits",
    "Exact input",
    "Versions",
]


class Reader(HTMLParser):
    """What a browser would see: elements with their texts, tables with their cells."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.tables, self._open = [], {}, []
        self._row = self._table = None
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        one = {"tag": tag, "text": "", **dict(attributes)}
        self.elements.append(one)
        if tag == "table":
            self._table = self.tables.setdefault(one["id"], [])
        elif tag == "tr" and self._table is not None:
            self._table.append([])
        elif tag in ("td", "th") and self._table:
            self._table[-1].append(one)
        if tag not in ("meta", "link", "br", "img", "input"):
            self._open.append(one)

    def handle_endtag(self, tag):
        while self._open and self._open.pop()["tag"] != tag:
            pass

    def handle_data(self, data):
        data = data.replace("\u00a0", " ")  # a number keeps its unit on its line
        for one in self._open:
            one["text"] += data

    def all(self, tag):
        return [one for one in self.elements if one["tag"] == tag]


@pytest.fixture(scope="module")
def text(result):
    return page(result, "minimise = 'x' # 200/T^3\n")


@pytest.fixture(scope="module")
def seen(text):
    return Reader(text)


@pytest.fixture(scope="module")
def stored(seen):
    (block,) = [one for one in seen.all("script") if one.get("type") == "application/json"]
    return json.loads(block["text"])


def array(stored, place):
    kind, data = stored["arrays"][place].split(":")
    return np.frombuffer(base64.b64decode(data), TYPES[kind]).astype(float)


def test_the_page_answers_first_and_keeps_its_order(seen, result):
    assert [one["text"] for one in seen.all("h1")] == [result.question]
    headings = [one["text"] for one in seen.all("h2")]
    questions = ["Answer", "How reliable is it?", "What does it improve?", "What does it cost?"]
    assert headings == [*questions, *ORDER]
    (summary,) = [one for one in seen.all("div") if one.get("id") == "summary"]
    assert "20.2 % less than that of Bezier (0.000428384 rad/s²)" in summary["text"]
    assert "this motion meets it" in summary["text"]
    for cost in result.costs_elsewhere:
        assert sentence(cost.sentence).replace("\u00a0", " ")[1:] in summary["text"]


def test_the_numbers_are_those_of_the_result(seen, result):
    head, *rows = [[cell["text"] for cell in row] for row in seen.tables["quantities"]]
    assert head[2:5] == list(result.laws)
    assert len(rows) == len(result.table)
    for cells, row in zip(rows, result.table, strict=True):
        assert cells[0] == row.title
        assert cells[2:5] == [number(row.values[law], 6) for law in result.laws]
    checks = [[cell["text"] for cell in row] for row in seen.tables["checks"]][1:]
    assert [row[0] for row in checks] == [check.name for check in result.checks]


def test_every_table_has_a_caption_and_marked_headers(seen):
    assert len(seen.all("caption")) == len(seen.all("table"))
    for rows in seen.tables.values():
        assert all(cell.get("scope") == "col" for cell in rows[0])
        assert all(row[0].get("scope") == "row" for row in rows[1:])


def test_curves_are_those_of_the_result(stored, result):
    charts = {chart["key"]: chart for chart in stored["charts"]}
    own = charts["truss-motor_force"]["curves"][0]
    assert stored["laws"][own["law"]] == "optimal"
    force = result.arrays["motor_force"].values
    # single precision has seven digits
    assert array(stored, own["values"]) == pytest.approx(force, rel=1e-6)
    assert np.array_equal(array(stored, own["places"]["time"]), result.arrays["time"].values)
    (cap,) = [
        level["value"] for level in charts["truss-angular_jerk"]["levels"] if level["value"] > 0
    ]
    assert cap == result.configuration["caps"]["jerk"]
    # the jerk jumps: two values at nearly the same time
    jerk = charts["truss-angular_jerk"]["curves"][0]
    times, values = array(stored, jerk["places"]["time"]), array(stored, jerk["values"])
    assert (np.diff(times) > 0).all()
    assert np.abs(np.diff(values)[np.diff(times) < 1e-6]).max() > 4e-5


def test_the_stored_motion_is_that_of_the_model(stored, result):
    truss = study_from(result.configuration).truss
    scene = stored["scene"]
    shapes = array(stored, scene["shapes"]).reshape(4, -1, 3)
    angles = array(stored, scene["parameter"])
    weights, slopes = (array(stored, scene[key]).reshape(-1, 4) for key in ("weights", "slopes"))
    paths = [array(stored, path).astype(int) for path in scene["tension"]["paths"]]

    for law in scene["laws"]:
        times, values, rates = (array(stored, law[key]) for key in ("times", "values", "rates"))
        profile = result.arrays["angle"].values, result.arrays["time"].values
        for time in np.linspace(0.0, 140.0, 10):
            angle = float(hermite(times, values, rates, time))
            points = np.tensordot(hermite(angles, weights, slopes, angle), shapes, axes=1)
            if law["law"] == 0:
                expected = float(np.interp(time, profile[1], profile[0]))
                assert angle == pytest.approx(expected, abs=1e-6)  # linear between 2001 rows
            nodes = ring_positions(truss, angle).reshape(-1, 3)
            assert np.abs(points[: len(nodes)] - nodes).max() < 1e-6  # m
            for path in paths:
                length = np.linalg.norm(np.diff(points[path], axis=0), axis=1).sum()
                assert length == pytest.approx(float(rope_length(truss, angle)), abs=1e-6)


def test_the_stored_law_follows_the_law_itself(stored, result):
    from models.laws import Step5

    truss = study_from(result.configuration).truss
    (law,) = [one for one in stored["scene"]["laws"] if stored["laws"][one["law"]] == "Step5"]
    times, values, rates = (array(stored, law[key]) for key in ("times", "values", "rates"))
    exact = Step5(140.0, truss.stowed_angle, math.pi / 2)
    for time in np.linspace(0.1, 139.7, 10):
        miss = hermite(times, values, rates, time) - exact.motion(time).angle[0]
        assert abs(miss) < 1e-8  # rad: 1e-7 m at the far side of the ring


def test_nothing_leaves_the_page(text, seen):
    (policy,) = [
        one["content"]
        for one in seen.all("meta")
        if one.get("http-equiv") == "Content-Security-Policy"
    ]
    assert policy.startswith("default-src 'none'; ")
    (script,) = [one["text"] for one in seen.all("script") if "type" not in one]
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in policy
    for one in seen.elements:
        for name in ("src", "href", "action", "srcset"):
            assert one.get(name, "#").startswith("#"), one
        assert not [name for name in one if name.startswith("on")]
    assert "url(" not in assets.styles()
    assert "@import" not in assets.styles()
    assert len(text) < 4e6


@pytest.mark.slow
def test_words_of_others_are_only_words(result):
    evil = "<script>alert(1)</script>"
    name = f"x'\"&{evil}"
    table = tuple(
        dataclasses.replace(
            row, title=name, values={f"{law}{evil}": v for law, v in row.values.items()}
        )
        for row in result.table
    )
    bad = dataclasses.replace(
        result,
        question=name,
        table=table,
        remarks=(evil,),
        checks=(Criterion(name, evil, 1.0, 2.0, True),),
        verdict=Verdict("local", evil),
        provenance={evil: evil},
        details={"starts": [{evil: evil}]},
    )

    for text in (page(bad, f"{evil}</pre>"), beside([bad, bad], [evil, name])):
        seen = Reader(text)
        assert len(seen.all("script")) == 2
        assert "alert" not in "".join(
            one["text"] for one in seen.all("script") if "type" not in one
        )
        assert evil in seen.all("title")[0]["text"]
    assert seen.all("pre") == []


@pytest.mark.parametrize(
    ("text", "seen"),
    [
        ("1.39e-17 instead of 7.793e-11 J", "1.39_×_10⁻¹⁷ instead of 7.793_×_10⁻¹¹_J"),
        ("12.3757 N m s and 3 rad/s^2", "12.3757_N_m_s and 3_rad/s²"),
        ("20 % less; 3 sides, B21 e-3", "20_% less; 3 sides, B21 e-3"),
    ],
)
def test_a_sentence_writes_powers_and_keeps_units_together(text, seen):
    assert sentence(text).replace("\u00a0", "_") == seen
    assert "e-" in superscripts(text) or "e-" not in text  # a table is to be copied


def test_what_is_to_be_copied_is_left_as_it_is(seen):
    (shown,) = seen.all("pre")
    assert shown["text"] == "minimise = 'x' # 200/T^3\n"


def test_an_incomplete_result_shows_what_there_is():
    begun = Result.begun("truss", "least force", {"duration": 5.0}, {"program": "antenna-ocp"})
    seen = Reader(page(begun))
    (note,) = [one for one in seen.all("p") if one.get("class") == "missing"]
    assert "Missing: arrays, table, verdict, checks" in note["text"]
    assert [one["text"] for one in seen.all("h2")][2:] == ORDER[1:]
    # a folder without a record at all
    nothing = Result("", "", {}, missing=("result.json",))
    assert "A result that is incomplete" in page(nothing)


def test_any_result_has_curves(tmp_path):
    t = np.linspace(0.0, 1.0, 5)
    arrays = {
        "time": Series("s", "time", t),
        "height": Series("m", "time", t**2),
        "other/time": Series("s", "other/time", t),
        "other/height": Series("m", "other/time", 2 * t),
        "mode": Series("1", "mode", np.arange(3.0)),
        "frequency": Series("Hz", "mode", np.arange(3.0)),
    }
    some = Result("something", "a question", {"a": 1}, arrays=arrays)
    (chart,) = charts_of_arrays(some)
    assert (chart.title, chart.unit) == ("height", "m")
    assert "<svg" in page(some)


def test_constants_are_drawn_as_constants():
    assert value_range([1e-17, -3e-17]) == (-1.0, 1.0)
    low, high = value_range([5.0, 5.0 + 1e-15])
    assert (low, high) == pytest.approx((4.75, 5.25))
    assert value_range([0.0, 2.0]) == (0.0, 2.0)
    assert value_range([math.nan]) == (-1.0, 1.0)


def test_a_law_has_the_same_colour_in_every_report():
    t = np.linspace(0.0, 1.0, 5)
    laws = ("optimum", "Step5", "Bezier")
    arrays = {"time": Series("s", "time", t)}
    arrays |= {f"{law}/torque": Series("N m", "time", t) for law in laws}
    row = TableRow("q", "a quantity", "N", dict.fromkeys(laws, 1.0))
    assert shown(Result("other", "?", {}, arrays=arrays, table=(row,))).laws == (
        "optimum",
        "Bezier",
        "Step5",
    )


def test_two_results_stand_beside_each_other(result):
    seen = Reader(beside([result, dataclasses.replace(result, configuration={})], ["a", "b"]))
    rows = {row[0]["text"]: [cell["text"] for cell in row] for row in seen.tables["beside"]}
    assert rows["duration"][-1] == "the same"
    assert len(seen.tables["settings"]) > 10


def test_what_others_made_is_as_they_published_it():
    hashes = tomllib.loads(assets.read("vendored.toml"))["uplot"]["sha256"]
    assert set(hashes) == {"uplot.iife.min.js", "uplot.min.css", "uplot.LICENSE.txt"}
    for name, digest in hashes.items():
        assert hashlib.sha256((assets.FOLDER / name).read_bytes()).hexdigest() == digest
    assert "MIT License" in assets.read("uplot.LICENSE.txt")
    assert not re.search(r"</script|https?://(?!github\.com/leeoniya)", assets.scripts())


def test_a_result_without_shapes_has_none(result):
    assert read_shapes(result) is None


def test_checks_that_noise_leaves_open_are_named(result):
    open_still = Criterion("force", "N", 1.0, 1.1, True, "passed: force 1 N (cap 1.1)", False)
    sentences = words.rests_on(dataclasses.replace(result, checks=(*result.checks, open_still)))
    assert any("are not decided: passed: force 1 N (cap 1.1)" in sentence for sentence in sentences)
