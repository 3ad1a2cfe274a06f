"""Surfaces of the arm by slices, on a made-up arm that answers at once; slowly, the big arm."""

from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest

from ocp.analysis.front.continuation import NotFoundError
from studies.arm import draw
from studies.arm.config import question_from
from studies.arm.questions.fronts import study as study_module
from studies.arm.questions.fronts.laws import TimedLaw
from studies.arm.questions.fronts.point import ArmPoint
from studies.arm.questions.fronts.study import front
from studies.arm.questions.fronts.subject import ArmFront
from studies.arm.questions.fronts.surface import ArmSlice
from studies.arm.study import check
from studies.arm.trade_off import TradeOffStudy
from studies.cli import main
from studies.common.console import silent
from studies.common.exit_codes import StudyError
from studies.common.result import Result
from studies.export.source import with_motion
from studies.pareto.surface.shape import dominated
from studies.report.page import shown

LEFT = ["time", "residual-energy", "peak-torque"]
DEFLECTION = ["time", "peak-torque", "deflection"]


def made_up(self, limits, least, start=None, aim=None, *, coarser=False):
    """Least torque 240/T^2 - 2 sqrt(E); deflection falls with the torque over it, then is flat."""
    self._in_time()
    duration, energy = limits.get("time", 8.6), limits.get("residual-energy", 0.0)
    lowest = 240 / duration**2 - 2 * energy**0.5
    most = 1.2 * lowest
    torque = min(limits.get("peak-torque", most), most)
    if least == "peak-torque":
        torque = lowest
    if torque < lowest:
        raise NotFoundError("no torque is enough")
    scale = 1e-3 / duration**2
    deflection = scale * (1 + (most - torque) / lowest)
    values = {
        "time": duration,
        # what a replay finds is a little less, by a part of its own at each limit
        "residual-energy": energy * (1 - 1e-6 * torque),
        "peak-torque": torque,
        "deflection": deflection,
    }
    by = {"time": -480 / duration**3, "residual-energy": -1 / max(energy, 1e-9) ** 0.5}
    by["peak-torque"] = -scale / lowest
    motion = SimpleNamespace(weight=1e-6, smoothness_share=0.0)
    replay = SimpleNamespace(residual_energy=energy, miss=0.0)
    return ArmPoint(motion, replay, None, values, {name: by[name] for name in limits})


@pytest.fixture
def arm(monkeypatch):
    monkeypatch.setattr(ArmFront, "_solved", made_up)
    stage = SimpleNamespace(model=SimpleNamespace(size=1))
    monkeypatch.setattr(ArmFront, "_refined", lambda *given: SimpleNamespace(stage=stage))
    for name in ("motion_series", "motion_details"):
        monkeypatch.setattr(study_module, name, lambda points: {})

    def laws(stage, durations, console):
        return [
            TimedLaw(name, made_up(ArmFront(of(LEFT), silent()), {"time": T}, "").values)
            for T in durations
            for name in ("Step5", "Bezier")
        ]

    monkeypatch.setattr(study_module, "laws_in", laws)


def of(objectives, **more):
    return question_from(TradeOffStudy, {"objectives": objectives, **more})


def test_a_surface_has_slices_words_two_prices_and_a_figure(arm, tmp_path):
    result = front(of(LEFT, slices=[8, 10, 12], points=8), silent())
    assert result.passed
    values = {name: series.values for name, series in result.arrays.items()}
    assert set(values["slice"]) == {8.0, 10.0, 12.0}
    places = np.column_stack([values[name] for name in LEFT])
    assert not dominated(places).any()
    # the energies count by their logarithm, and lie from rest to what the longest slice allows
    assert values["residual-energy"].min() == pytest.approx(1e-6, rel=1e-4)
    words = " ".join(result.remarks)
    assert "on 3 slices, from 8 to 12 s of duration" in words
    assert "0.1 s more of duration saves" in words
    assert "(1 %) more of residual energy saves" in words
    assert "Up to 1e-06 J the arm counts as still" in words

    result.save(tmp_path)
    stored = Result.load(tmp_path)
    ((name, figure),) = draw(stored)
    assert name == "surface"
    assert figure.axes[-1].get_ylabel() == "duration at most [s]"
    assert figure.axes[0].get_xscale() == "log"
    plt.close(figure)
    assert [chart.unit for chart in shown(stored).charts] == ["N m", "N m/J", "N m/s"]


def test_without_limits_slices_go_where_curves_are_furthest_apart(arm):
    result = front(of(DEFLECTION, slices=4, points=6, stage="big", duration=10), silent())
    limits = result.details["slices"]
    assert (limits[0], limits[-1]) == (8.0, 15.0)
    # all of a slice is steeper in a short time, so that the next ones go there
    assert limits[1] - limits[0] < limits[-1] - limits[-2]
    # each begins 1 % above its least torque
    values = {name: series.values for name, series in result.arrays.items()}
    for limit in limits:
        torque = values["peak-torque"][values["slice"] == limit]
        assert torque.min() == pytest.approx(1.01 * 240 / limit**2)


def test_energies_are_sliced_where_torque_and_deflection_are_traded(arm):
    study = of(["residual-energy", "peak-torque", "deflection"], coarse=True)
    result = front(study, silent())
    limits = np.array(result.details["slices"])
    assert limits.size == 4
    assert limits[0] == 1e-6
    # a slice in the middle is so of the logarithm
    assert any(np.isclose(np.sqrt(limits[0] * limits[-1]), limit) for limit in limits)
    # what a replay finds less than the limit makes no point the best in something
    z = result.arrays["residual-energy"].values
    assert set(z) == set(limits)


def test_a_slice_with_nothing_to_trade_has_its_ends_and_says_so(arm, monkeypatch):
    def flat(self, limits, least, *given, **named):
        point = made_up(self, limits, least)
        values = {**point.values, "deflection": 1e-3 / point.values["time"] ** 2}
        return ArmPoint(point.motion, point.replay, None, values, point.slopes)

    monkeypatch.setattr(ArmFront, "_solved", flat)
    result = front(of(DEFLECTION, slices="8,10"), silent())
    assert result.passed
    words = " ".join(result.remarks)
    assert "On the slice at duration 8 s there is nothing to trade: peak deflection is" in words
    assert result.arrays["point"].values.size == 2  # the end with less torque of each


def test_the_seconds_end_a_surface_and_keep_its_slices(arm, monkeypatch):
    ends, asked = ArmSlice.ends, []

    def slow(self, *given):
        asked.append(self.level)
        if len(asked) > 1:
            self.until = 0.0
        return ends(self, *given)

    monkeypatch.setattr(ArmSlice, "ends", slow)
    result = front(of(LEFT, slices=[8, 10, 12]), silent())
    assert result.details["slices"] == [12.0]
    assert "Of 3 slices that were asked for 1 exist" in " ".join(result.remarks)


def test_a_slice_that_bends_the_links_too_far_is_refused():
    with pytest.raises(StudyError, match=r"in 0\.5 s the stage 'big' would bend a link"):
        check(of(LEFT, slices="0.5,9"))


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("time,peak-torque --slices 3", "slices is for three objectives"),
        ("time,residual-energy --coarse", "coarse is stated, but where residual-energy is set"),
        ("residual-energy,peak-torque --range 1e-8..1", "range begins at 1e-08 J"),
    ],
)
def test_the_command_refuses_in_one_sentence(words, sentence, capsys, tmp_path):
    folder = tmp_path / "none"
    assert main(["pareto", "arm", "--objectives", *words.split(), "--results", str(folder)]) == 2
    assert sentence in capsys.readouterr().err
    assert not folder.exists()


@pytest.mark.slow
def test_a_coarse_surface_of_the_big_arm(tmp_path):
    folder = tmp_path / "surface"
    words = "--slices 8.6,9 --points 3 --coarse --range 1e-5..1e-3 --objectives"
    assert main(["pareto", "arm", *words.split(), ",".join(LEFT), "--results", str(folder)]) == 0
    found = Result.load(folder)
    assert found.passed
    values = {name: series.values for name, series in found.arrays.items()}
    assert set(values["slice"]) == {8.6, 9.0}
    # a solve with the bound on the energy alone, on 150 intervals: 3.2515 N m
    here = np.flatnonzero(values["slice"] == 8.6)
    last = here[-1]
    assert values["residual-energy"][last] == pytest.approx(0.98e-3, rel=0.01)
    assert values["peak-torque"][last] == pytest.approx(3.2515, rel=5e-3)
    # torque goes as T^-2
    assert values["price of time"][last] == pytest.approx(2 * 3.25 / 8.6, rel=0.1)

    second = with_motion(found, "point 2")
    assert second.arrays["root_torque"].values.max() == pytest.approx(
        values["peak-torque"][1], rel=2e-3
    )
    assert (folder / "surface.png").is_file()
    assert main(["report", str(folder)]) == 0
