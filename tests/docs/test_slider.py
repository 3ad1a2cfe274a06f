"""The study of a package of one's own in docs/examples/slider: every command works with it."""

import importlib
import json
import os
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from studies import registry
from studies.cli import main
from studies.common.exit_codes import ExitCode
from studies.common.result import Result

ROOT = Path(__file__).parents[2]
SLIDER = ROOT / "docs" / "examples" / "slider"


def forget() -> None:
    """What was found of installed packages, and the modules of the example."""
    registry.from_outside.cache_clear()
    registry.command.cache_clear()
    for name in [name for name in sys.modules if name.split(".")[0] == "slider"]:
        del sys.modules[name]


@pytest.fixture
def installed(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> Iterator[None]:
    """The example as pip would install it, on the path of this process and of those it starts."""
    project = tomllib.loads((SLIDER / "pyproject.toml").read_text("utf-8"))["project"]
    folder = tmp_path_factory.mktemp("installed")
    about = folder / f"{project['name']}-{project['version']}.dist-info"
    about.mkdir()
    head = f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    (about / "METADATA").write_text(head, "utf-8")
    lines = [f"{key} = {place}" for key, place in project["entry-points"][registry.GROUP].items()]
    (about / "entry_points.txt").write_text("\n".join([f"[{registry.GROUP}]", *lines]), "utf-8")
    for path in (SLIDER, folder):
        monkeypatch.syspath_prepend(str(path))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(map(str, (ROOT, SLIDER, folder))))
    forget()
    yield
    forget()


def test_the_slider_runs_and_is_reported_exported_checked_and_swept(
    installed: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["slider", "--intervals", "6"]) == ExitCode.OK
    result = Result.load(tmp_path / "results" / "slider-1.6s")
    assert result.verdict.kind == "global"
    assert (tmp_path / "results" / "slider-1.6s" / "motion.png").is_file()

    assert main(["report", "results/slider-1.6s"]) == ExitCode.OK
    page = (tmp_path / "results" / "slider-1.6s" / "report.html").read_text("utf-8")
    for words in ("static friction and a way back are left out", "pulley height", "polynomial"):
        assert words in page

    # the rope: from sqrt(3² + 1²) m to sqrt(1² + 1²) m, and nothing is said of a truss
    (tmp_path / "drive.toml").write_text("drum_radius = 0.02\ncounts = 65536\nperiod = 0.01\n")
    words = ["--to", "json", "--drive", "drive.toml", "--output", "rows.json"]
    assert main(["export", "results/slider-1.6s", *words]) == ExitCode.OK
    words = ["--to", "pvt", "--drive", "drive.toml", "--output", "rope.pvt"]
    assert main(["export", "results/slider-1.6s", *words]) == ExitCode.OK
    table = (tmp_path / "rope.pvt").read_text("utf-8")
    assert "signal = rope [m]" in table
    assert "position = way since the start\n" in table
    assert "wound in" not in (tmp_path / "rows.json").read_text("utf-8")
    last = float(table.splitlines()[-1].split(",")[1])
    assert last == pytest.approx(np.sqrt(2) - np.sqrt(10), abs=2e-6)  # a count of 1.9e-6 m

    # its own export is a profile, also of the law whose columns have a name before theirs
    assert main(["export", "results/slider-1.6s", "--to", "csv", "--output", "rows.csv"]) == 0
    words = ["check", "rows.csv", "--study", "slider", "--results", "checked"]
    assert main([*words, "--column", "position=polynomial/position:m"]) == ExitCode.OK
    checked = Result.load(tmp_path / "checked")
    # of a polynomial of fifth degree 15/8 of the mean speed; less by differences over 0.8 ms
    assert checked.value("peak-speed") == pytest.approx(15 / 8 * 2 / 1.6, rel=1e-5)
    assert checked.value("peak-force") == pytest.approx(
        result.value("peak-force", "polynomial"), rel=1e-4
    )
    (tmp_path / "far.toml").write_text("travel = 2.1\n", "utf-8")
    words = ["check", "rows.csv", "far.toml", "--study", "slider"]
    assert main(words) == ExitCode.NOT_VERIFIED

    swept = 'subject = "slider"\n[parameters]\nduration = [4.0]\n'
    (tmp_path / "sweep.toml").write_text(swept)
    words = ["--coarse", "--no-figures", "--results", "cases"]
    assert main(["sweep", "sweep.toml", *words]) == ExitCode.OK
    record = json.loads((tmp_path / "cases" / "result.json").read_text("utf-8"))
    assert "1 of 1 cases are solved and verified: 1 global" in record["verdict"]["sentence"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--duration 0.9", "spring and friction take 0.9506 s to stop the slider"),
        ("--pulley-height 3 --mass 5 --stiffness 60", "give less than 32.7, or a lower pulley"),
        ("--stiffness 0 --friction 0", "nothing stops the slider"),
        ("--travel 3", "--travel is 3 m, which leads below the pulley"),
    ],
)
def test_what_no_slider_can_do_is_refused_before_a_folder_is_made(
    words: str,
    said: str,
    installed: None,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    code = ExitCode.BAD_INPUT if "travel" in words else ExitCode.INFEASIBLE
    assert main(["slider", *words.split()]) == code
    assert said in capsys.readouterr().err
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize(
    "keys",
    [
        {},
        {"friction": 1.5, "pulley_height": 5.0},  # a newton of the rope moves more on the way
        {"friction": 0.0, "duration": 1.4},
        {"stiffness": 0.0, "duration": 3.0},
    ],
)
def test_the_phase_plane_agrees_with_an_integrator(keys: dict[str, float], installed: None) -> None:
    study = importlib.import_module("slider.study").SliderStudy(**keys)
    plane = importlib.import_module("slider.phase_plane")
    mechanics, travel = study.slider, study.travel
    peak = plane.least_peak(mechanics, travel, study.duration)

    # Coulomb's law and the parts of the force, in place of the leverage; the third state is work
    def pushed(_: float, state: np.ndarray, force: float) -> tuple[float, float, float]:
        s, v, _work = state
        angle = np.arctan2(study.pulley_height, study.pulley_distance - s)
        resisted = study.stiffness * s + study.friction * study.mass * 9.81
        along = force * (np.cos(angle) + study.friction * np.sin(angle))
        return v, (along - resisted) / study.mass, along * v

    def enough(_: float, state: np.ndarray, force: float) -> float:
        weight = study.mass * 9.81
        return state[2] - study.stiffness * travel**2 / 2 - study.friction * weight * travel

    def at_rest(_: float, state: np.ndarray, force: float) -> float:
        return state[1]

    enough.terminal = at_rest.terminal = True
    options = {"rtol": 1e-10, "atol": 1e-12}
    pulled = solve_ivp(pushed, (0, 9), np.zeros(3), args=(peak,), events=enough, **options)
    free = solve_ivp(pushed, (0, 9), pulled.y[:, -1], args=(0.0,), events=at_rest, **options)
    # by the tolerance of the integrator
    assert free.y[0, -1] == pytest.approx(travel, rel=1e-7)
    assert pulled.t[-1] + free.t[-1] == pytest.approx(study.duration, rel=1e-7)


def test_a_longer_time_needs_the_force_of_the_energy(installed: None) -> None:
    plane = importlib.import_module("slider.phase_plane")
    study = importlib.import_module("slider.study").SliderStudy(duration=60.0)
    # by hand: half of k d² and mu m g d, over the integral of the leverage
    given, _ = quad(lambda s: (3.2 - s) / np.hypot(3.0 - s, 1.0), 0.0, 2.0)
    least = (30 * 2**2 / 2 + 0.2 * 20 * 9.81 * 2) / given
    assert plane.least_peak(study.slider, 2.0, 60.0) == pytest.approx(least, rel=1e-12)
    assert plane.least_peak(study.slider, 2.0, 1.6) > 1.2 * least
