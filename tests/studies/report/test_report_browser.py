"""Reports in a real browser. Skipped by name where the machine has no Chromium."""

import dataclasses

import numpy as np
import pytest

from models.truss import ring_positions
from studies.common.result import Result, Series
from studies.report.page import page
from studies.truss import study_from
from tests.studies.report.chromium import browser_tab, find_chromium

CHROMIUM = find_chromium()
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium on this machine"),
]
FRAME = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"


@pytest.fixture(scope="module")
def tab():
    with browser_tab(CHROMIUM) as tab:
        tab.size(1280, 900)
        yield tab


@pytest.fixture(scope="module")
def address(result, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "report.html"
    path.write_text(page(result))
    return path.as_uri()


def test_the_page_works_without_a_complaint_or_a_request(tab, address, result):
    tab.open(address)
    assert tab.run("report.charts.all().size") == tab.run("report.data.charts.length") == 16
    points = tab.run(
        "[...report.charts.live.values()].filter(one => !one.chart.path).map(one => "
        "one.plot.data.slice(1).map(column => column.filter(v => v !== null).length))"
    )
    assert min(min(counts) for counts in points) > 1000

    tab.run(f"report.seek(70, 'test'); {FRAME}")
    truss = study_from(result.configuration).truss
    angle = float(np.interp(70.0, result.arrays["time"].values, result.arrays["angle"].values))
    positions = np.array(tab.run("report.motion.positions(70)")).reshape(-1, 3)
    nodes = ring_positions(truss, angle).reshape(-1, 3)
    assert np.abs(positions[: len(nodes)] - nodes).max() < 1e-5  # m; the angle is interpolated

    assert tab.complaints == []
    assert tab.requests == [address]


def test_the_slider_moves_the_antenna_and_all_cursors(tab, address):
    tab.open(address)
    tab.run("report.charts.all().size")
    look = "document.querySelector('#stage canvas').toDataURL()"
    before = tab.run(look)
    tab.run(
        "const slider = document.querySelector('#stage input[type=range]'); slider.value = '0.5';"
        f"slider.dispatchEvent(new Event('input')); {FRAME}"
    )
    assert tab.run(look) != before
    assert tab.run("document.querySelector('.readout').textContent").startswith("t = 70 s")
    # what is off the screen follows a moment later
    tab.run("new Promise(done => setTimeout(done, 600))")
    shown = tab.run(
        "[...report.charts.live.values()].filter(one => !one.chart.path)"
        ".map(one => one.plot.posToVal(one.plot.cursor.left, 'x'))"
    )
    assert shown == pytest.approx([70.0] * len(shown), abs=0.5)  # a pixel

    # against the angle the same instant is at the same angle
    tab.run(
        "const axis = document.getElementById('axis'); axis.value = 'angle';"
        "axis.dispatchEvent(new Event('change')); report.seek(70, 'test');"
        "new Promise(done => setTimeout(done, 600))"
    )
    place = tab.run(
        "(one => one.plot.posToVal(one.plot.cursor.left, 'x'))"
        "(report.charts.live.get('truss-motor_force'))"
    )
    assert place == pytest.approx(47.2, abs=0.3)  # deg, half of the way
    assert tab.complaints == []


def test_nothing_plays_by_itself_and_play_ends_at_the_end(tab, address):
    tab.media(prefers_reduced_motion="reduce")
    tab.open(address)
    tab.run("new Promise(done => setTimeout(done, 300))")
    assert tab.run("report.state.time") == 0
    tab.run(
        "report.seek(139.9, 'test'); report.motion.play(); new Promise(d => setTimeout(d, 2500))"
    )
    assert tab.run("report.state.time") == pytest.approx(140.0)
    assert tab.run("document.querySelector('#stage button').textContent") == "Play"
    tab.media()


def test_laws_and_caps_are_switched_off(tab, address):
    tab.open(address)
    tab.run("report.charts.all().size")
    tab.run("document.querySelectorAll('#chart-controls input').forEach(box => box.click())")
    shown = tab.run(
        "report.charts.live.get('truss-angular_jerk').plot.series.slice(1).map(s => s.show)"
    )
    assert not any(shown)
    assert tab.complaints == []


def test_tables_become_csv(tab, address):
    tab.open(address)
    csv = tab.run("report.tables.csv(document.getElementById('quantities'))")
    assert csv.splitlines()[0] == "quantity,unit,optimal,Bezier,Step5,cap,bound"
    assert tab.run("document.querySelectorAll('.table .buttons button').length") >= 10


@pytest.mark.parametrize("width", [1280, 390])
def test_nothing_is_wider_than_the_window(tab, address, width):
    tab.size(width, 900, mobile=width < 500)
    tab.open(address)
    tab.run("report.charts.all().size")
    assert tab.run("document.documentElement.scrollWidth") <= width
    tab.size(1280, 900)


def test_without_scripts_verdict_numbers_and_figures_are_there(tab, address, result):
    tab.call("Emulation.setScriptExecutionDisabled", value=True)
    try:
        tab.open(address)
        root = tab.call("DOM.getDocument", depth=-1)["root"]["nodeId"]

        def outer(selector):
            node = tab.call("DOM.querySelector", nodeId=root, selector=selector)["nodeId"]
            return tab.call("DOM.getOuterHTML", nodeId=node)["outerHTML"], node

        assert "Proven optimum" in outer("#summary")[0]
        assert "0.000341755" in outer("#quantities")[0]
        for selector in ("figure.chart .still svg", ".snapshot svg"):
            box = tab.call("DOM.getBoxModel", nodeId=outer(selector)[1])["model"]
            assert box["width"] > 100
    finally:
        tab.call("Emulation.setScriptExecutionDisabled", value=False)


def test_a_hostile_name_does_nothing(tab, result, tmp_path):
    evil = "</script><script>document.title = 'broken'</script><img src=x onerror=alert(1)>"
    path = tmp_path / "evil.html"
    path.write_text(page(dataclasses.replace(result, question=evil, remarks=(evil,)), evil))
    tab.open(path.as_uri())
    assert tab.run("document.title") == evil
    assert tab.run("document.images.length") == 0
    assert tab.complaints == []


def test_a_constant_is_a_straight_line(tab, tmp_path):
    t = np.linspace(0.0, 1.0, 50)
    arrays = {
        "time": Series("s", "time", t),
        "noise": Series("N", "time", 5.0 + 1e-15 * np.sin(99 * t)),
    }
    path = tmp_path / "constant.html"
    path.write_text(page(Result("other", "constant", {}, arrays=arrays)))
    tab.open(path.as_uri())
    low, high = tab.run(
        "report.charts.all(); new Promise(done => setTimeout(() => done((s => [s.min, s.max])"
        "(report.charts.live.get('time-noise').plot.scales.y)), 200))"
    )
    assert high - low > 0.4
    assert tab.complaints == []
