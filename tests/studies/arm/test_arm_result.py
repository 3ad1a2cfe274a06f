"""Studies of the arm as configurations and results: round trips, flags, figures."""

import math

import numpy as np
import pytest

from models.ancf.integrate import StepControl
from models.ancf.joints import Torque
from studies import registry
from studies.arm import ArmDescription, ArmStudy, SequenceStudy, draw, run, study_from
from studies.arm.command import ARM
from studies.arm.config import (
    BaselinesStudy,
    LeastDurationStudy,
    RobustStudy,
    as_dictionary,
)
from studies.arm.questions.one_motion import with_duration
from studies.arm.replay.full_model import Motion, replay
from studies.arm.report.quantities import Metric, table_rows
from studies.arm.report.traces import Trace, read_snapshots, snapshot_series, snapshots_of
from studies.arm.stage import big_arm
from studies.arm.trade_off import TradeOffStudy
from studies.cli import build_parser
from studies.common.comparison_table import costs_elsewhere
from studies.common.configuration import from_mapping
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.keys import key_lines
from studies.common.result import Result, Series
from studies.common.scene.chain_shapes import read_shapes, shape_series
from studies.common.writers import outcome_text

STUDIES = [
    ArmStudy(stage="small", elbow_end_deg=30, arm=ArmDescription(tip_mass=10), torque_cap=5.0),
    BaselinesStudy(drive="angle", latch=1e-3),
    LeastDurationStudy(stage="small", duration=9),
    TradeOffStudy(stage="small"),
    RobustStudy(points=5, arm=ArmDescription(damping_ratio=0.01)),
    SequenceStudy(least="time", torque_cap=0.1, dwell=3),
]


@pytest.fixture(scope="module")
def replayed():
    """A wave of torque on the big arm: two elements a link and coarse steps are enough here."""
    stage = big_arm(2.0)
    law = Torque(lambda t: 30.0 * np.sin(np.pi * np.asarray(t)) ** 3)
    after = 2.0 + np.linspace(0.0, 0.2, 21)
    motion = Motion("optimum", "torque", stage, {0: law})
    return replay(motion, elements=2, settings=StepControl(1e-6), after=after, modes=1)


def result(**parts):
    return Result("arm", "a question", {"stage": "big"}, **parts)


@pytest.mark.parametrize("study", STUDIES, ids=lambda study: type(study).__name__)
def test_a_study_is_made_again_from_what_its_result_keeps(study):
    again = from_mapping(type(study), as_dictionary(study))
    assert as_dictionary(again) == as_dictionary(study)
    assert again.question == study.question
    if not isinstance(study, SequenceStudy):
        assert again.slew == study.slew


def test_every_key_of_every_study_has_a_flag_of_its_own():
    asked = [study for study in registry.studies() if study.mechanism is ARM]
    assert {study.tables()[""] for study in asked} == {type(study) for study in STUDIES}
    for study in asked:
        given = {action.dest for action in build_parser(study.name)._actions}
        assert {line.key for line in key_lines(study.tables()[""])} <= given


def test_a_table_of_the_least_time_begins_with_it():
    columns = {name: [Metric("work", "work", "J", 2.0)] for name in ("optimum", "Bezier")}
    first, second = table_rows(with_duration(columns, big_arm(7.5)))
    assert (first.title, first.unit, first.values) == (
        "duration",
        "s",
        {"optimum": 7.5, "Bezier": 7.5},
    )
    assert second.key == "work"


def test_python_and_toml_state_the_same_study():
    study = ArmStudy(stage="small", arm=ArmDescription(tip_mass=10))
    assert study == study_from({"stage": "small", "arm": {"tip_mass": 10}})
    with pytest.raises(StudyError, match=r"even a rigid arm takes more than 8\.97"):
        run(ArmStudy(torque_cap=3.0))
    with pytest.raises(StudyError) as caught:
        run(ArmStudy(arm=ArmDescription(modulus=7e6)))
    assert caught.value.exit_code == ExitCode.INFEASIBLE


def test_a_trace_is_read_as_it_was_kept(replayed, tmp_path):
    trace, snapshots = Trace.of(replayed), snapshots_of(replayed)
    time = {"time": Series("s", "time", np.array([0.0, 2.0]))}
    kept = result(
        arrays=time | trace.series() | snapshot_series(snapshots),
        details={"snapshot_times": [snapshot.time for snapshot in snapshots]},
    )
    kept.save(tmp_path)
    loaded = Result.load(tmp_path)

    again = Trace.read(loaded, "optimum")
    assert again.lock == trace.lock == len(replayed.run.before.times)
    assert np.array_equal(again.times, trace.times)
    assert np.array_equal(again.torque, trace.torque)
    assert np.array_equal(again.since_lock, trace.since_lock)
    for point in ("tip", "elbow"):
        assert np.array_equal(again.path[point], trace.path[point])
        assert np.array_equal(again.velocity[point], trace.velocity[point])
        assert np.array_equal(again.off_rest[point], trace.off_rest[point])

    for read, made in zip(read_snapshots(loaded), snapshots, strict=True):
        assert read.time == made.time
        assert np.array_equal(read.big, made.big)
        assert np.array_equal(read.small, made.small)


def test_the_shapes_of_a_motion_are_those_of_the_replay(replayed, tmp_path):
    runs, axis = replayed.run.runs, {"time": Series("s", "time", np.array([0.0, 2.0]))}
    kept = result(arrays=axis | shape_series(runs, instants=50))
    kept.save(tmp_path)
    shapes = read_shapes(Result.load(tmp_path))

    assert (np.diff(shapes.times) > 0).all()
    assert shapes.times[[0, -1]] == pytest.approx([0.0, 2.2])
    before = runs[0]
    for instant in np.flatnonzero(shapes.times <= 2.0):
        k = int(np.argmin(np.abs(before.times - shapes.times[instant])))
        for link, nodes in enumerate(shapes.nodes):
            for node in range(before.chain.nodes):
                assert np.array_equal(nodes[instant, node], before.position(link, node)[:, k])
    # the axis of each link is nearly straight here: what is exaggerated is small
    apart = max(
        np.abs(bent - even).max()
        for bent, even in zip(shapes.nodes, shapes.straight(), strict=True)
    )
    assert 1e-4 < apart < 0.3  # m
    assert shapes.straight()[0][:, 0] == pytest.approx(shapes.nodes[0][:, 0])


def test_a_run_with_a_clock_of_its_own_follows_the_one_before(replayed):
    first = replayed.run.before
    shapes = read_shapes(result(arrays=shape_series((first, first), instants=20)))
    assert (np.diff(shapes.times) > 0).all()
    assert shapes.times[-1] == pytest.approx(4.0)


def test_figures_are_drawn_from_what_a_result_holds(replayed):
    stage = replayed.motion.stage
    kept = result(
        arrays=Trace.of(replayed).series(),
        details={"stage": {"duration": 2.0, "start": stage.start, "end": stage.end}},
    )
    assert {name for name, _ in draw(kept)} == {"fig10_torque", "fig15_arm", "after_lock"}
    assert not list(draw(result(details=kept.details)))  # nothing was followed, nothing is drawn


def test_what_the_optimum_costs_is_seen_beside_the_better_law():
    rows = table_rows(
        {
            "optimum": [Metric("work", "work", "J", 3.0), Metric("rate", "rate", "N m/s", 6.0)],
            "Step5": [Metric("work", "work", "J", 2.5)],
            "Bezier": [Metric("work", "work", "J", 2.0)],
        },
        caps={"rate": 7.0},
    )
    assert [row.key for row in rows] == ["work", "rate"]
    assert rows[1].cap == 7.0
    (cost,) = costs_elsewhere(rows)
    assert cost.baseline == "Bezier"
    assert math.isclose(cost.ratio, 1.5)


def test_laws_that_are_not_compared_have_no_costs_to_speak_of():
    rows = table_rows({law: [Metric("ratio", "ratio", "1", 0.1, "neither")] for law in "ab"})
    assert "costs elsewhere" not in outcome_text(result(table=rows))
