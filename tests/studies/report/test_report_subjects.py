"""Reports of every subject in a real browser: a force study, the arm, its sequence, a pendulum.

The results are coarse: a page shows them as it shows exact ones. Skipped by name where the machine
has no Chromium.
"""

import csv
import io
import tomllib
from functools import partial
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

import studies.flex
from models.ancf.integrate import StepControl
from studies.arm import ArmStudy, SequenceStudy
from studies.arm import run as run_arm
from studies.arm.optimal.refinement import Refined
from studies.arm.questions.sequence import profile, study
from studies.arm.replay import full_model
from studies.common.console import Console
from studies.report.page import page, shown
from studies.truss import run as run_truss
from studies.truss import study_from as truss_study_from
from tests.studies.report.chromium import browser_tab, find_chromium

CHROMIUM = find_chromium()
SUBJECTS = ("force", "arm", "sequence", "pendulum")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium on this machine"),
]
FRAME = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"


def force():
    return run_truss(
        truss_study_from(
            {
                "minimise": "peak-force",
                "duration": 5.0,
                "caps": {"jerk": "200/T^3"},
                "truss": {"pulley_friction": 0.01, "modules": 6},
                "solver": {"intervals": 12, "starts": ["bezier"]},
            }
        )
    )


def arm():
    return run_arm(ArmStudy(elements=4, modes=1))


def sequence():
    """In a tenth of the time, on a coarse mesh, with a coarse replay that sees much left."""
    coarse = StepControl(1e-5)
    replayed = partial(full_model.in_turn, elements=3, settings=coarse)

    def refined(motion, *, residual, **_):
        replays = replayed(motion.motions("torque"), motion.dwells)
        return Refined(motion, replays, (), residual)

    with (
        mock.patch.object(study, "SEQUENCE_INTERVALS", (40, 5, 50)),
        mock.patch.object(study, "refine", refined),
        mock.patch.object(study, "in_turn", lambda law, dwells, **_: replayed(law, dwells)),
        mock.patch.object(profile, "steps_for", return_value=coarse),
    ):
        question = SequenceStudy(total=19.8, dwell=1.0, sample_time=0.05, residual_energy=0.2)
        return study.find_sequence(question, Console())


def pendulum():
    path = Path(studies.flex.__file__).parent / "presets" / "single-pendulum.toml"
    case = tomllib.loads(path.read_text("utf-8"))
    return studies.flex.run(studies.flex.study_from(case | {"elements": 4, "frequencies": 1}))


@pytest.fixture(scope="module")
def results():
    return {solve.__name__: solve() for solve in (force, arm, sequence, pendulum)}


@pytest.fixture(scope="module")
def addresses(results, tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    for name, result in results.items():
        (folder / f"{name}.html").write_text(page(result))
    return {name: (folder / f"{name}.html").as_uri() for name in results}


@pytest.fixture(scope="module")
def tab():
    with browser_tab(CHROMIUM) as tab:
        tab.size(1280, 900)
        yield tab


@pytest.mark.parametrize("name", SUBJECTS)
def test_every_curve_has_its_points_and_nothing_leaves_the_page(tab, name, results, addresses):
    tab.open(addresses[name])
    charts = {chart.key: chart for chart in shown(results[name]).charts}
    assert tab.run("report.charts.all().size") == len(charts) > 0

    drawn = tab.run(
        "[...report.charts.live.values()].map(({chart, plot}) => [chart.key, chart.path"
        " ? plot.data.slice(1).map(([x, y]) => [x, y])"
        " : plot.data.slice(1).map(column => [plot.data[0], column])])"
    )
    for key, lines in drawn:
        chart = charts[key]
        assert len(lines) == len(chart.curves) + (0 if chart.path else len(chart.levels))
        for curve, (places, values) in zip(chart.curves, lines, strict=False):
            asked = curve.places[chart.axes[0].key]
            if not chart.path:  # all curves of a chart stand over the union of their places
                at = dict(zip(places, values, strict=True))
                values = [at[place] for place in asked]
            # where a time stands twice, the page keeps one of both values
            once = np.isin(asked, asked[1:][np.diff(asked) == 0], invert=True) | chart.path
            size = np.abs(curve.values).max() or 1.0
            off = np.abs(np.array(values, float) - curve.values)[once]
            assert off.size > 10
            assert off.max() < 1e-6 * size, (key, curve.law)  # 32-bit floats

    assert tab.complaints == []
    assert tab.requests == [addresses[name]]


@pytest.mark.parametrize("name", SUBJECTS)
def test_the_slider_moves_the_drawing_and_the_places_are_the_models(tab, name, results, addresses):
    tab.open(addresses[name])
    look = "document.querySelector('#stage canvas').toDataURL()"
    before = tab.run(look)
    tab.run(
        "const slider = document.querySelector('#stage input[type=range]'); slider.value = '0.5';"
        f"slider.dispatchEvent(new Event('input')); {FRAME}"
    )
    assert tab.run(look) != before

    picture = shown(results[name]).picture
    for time in np.linspace(0.0, picture.laws[0].times[-1], 10):
        places = np.array(tab.run(f"report.motion.positions({float(time)})"))
        ours = picture.points(picture.laws[0].at(time))
        assert np.abs(places.reshape(-1, 3)[: len(ours)] - ours).max() < 1e-6  # m
    assert tab.complaints == []


@pytest.mark.parametrize("name", SUBJECTS)
def test_the_numbers_on_the_page_are_those_of_the_result(tab, name, results, addresses):
    tab.open(addresses[name])
    text = tab.run("report.tables.csv(document.getElementById('quantities'))")
    head, *rows = csv.reader(io.StringIO(text))
    assert len(rows) == len(results[name].table) > 5
    for cells, row in zip(rows, results[name].table, strict=True):
        assert cells[:2] == [row.title, row.unit.replace("^2", "²").replace("^3", "³")]
        for law, value in row.values.items():
            shown_value = cells[head.index(law)].removesuffix(" !")
            if np.isfinite(value):  # six digits are printed
                assert float(shown_value) == pytest.approx(value, rel=5.1e-6, abs=1e-300), cells


@pytest.mark.parametrize("name", SUBJECTS)
def test_nothing_is_wider_than_a_phone(tab, name, addresses):
    tab.size(390, 900, mobile=True)
    try:
        tab.open(addresses[name])
        tab.run("report.charts.all().size")
        assert tab.run("document.documentElement.scrollWidth") <= 390
        assert tab.complaints == []
    finally:
        tab.size(1280, 900)
