"""What is exported of each kind of result."""

import numpy as np
import pytest

from studies.common.exit_codes import StudyError
from studies.common.result import Result, Series
from studies.drive import Drive
from studies.export.formats import TABLES, Spacing, tabulated
from studies.export.round_trip import round_trip
from studies.export.source import source_of, with_motion
from studies.export.work import _drive
from studies.truss.config import as_dictionary, study_from


def arm(drive: str) -> Result:
    """A stored motion of the elbow, a cosine from rest to rest in 5 s."""
    time = np.linspace(0.0, 5.0, 501)
    phase = np.pi * time / 5.0
    columns = {
        "time": ("s", time),
        "elbow_torque": ("N m", np.cos(phase)),
        "elbow_angle": ("rad", 1.0 - np.cos(phase)),
        "elbow_rate": ("rad/s", np.pi / 5.0 * np.sin(phase)),
    }
    return Result(
        kind="arm",
        question="?",
        configuration={"drive": drive},
        arrays={name: Series(unit, "time", values) for name, (unit, values) in columns.items()},
    )


@pytest.mark.parametrize(("drive", "predicted"), [("torque", True), ("angle", False)])
def test_an_arm_found_for_torques_has_a_predicted_angle(drive: str, predicted: bool) -> None:
    course = source_of(arm(drive)).course(None)
    assert (course.signal, course.unit) == ("elbow", "rad")
    assert ("predicted angle" in course.note) is predicted

    # 16 bits of the joint's own turn: it gets there to half a count
    joint = Drive(counts=65536, period=0.05, bandwidth=20.0)
    form = TABLES["pvt"]
    points = tabulated(course, form, joint, Spacing())
    text, again = form.write(points, {"unit": "rad", "note": course.note}, 1)
    assert ("predicted angle" in text) is predicted
    record = round_trip(course, again, joint, form.layout.interpolation)
    assert abs(record.values["miss of the last position [rad]"]) <= np.pi / 65536
    most = record.playback.most
    assert most is not None
    assert record.playback.peak(2)[0] <= most


def test_another_motion_of_a_result_takes_the_main_ones_place() -> None:
    main = arm("angle")
    named = {
        f"nominal/{name}": Series(series.unit, "nominal/time", 2.0 * series.values)
        for name, series in main.arrays.items()
    }
    result = Result(
        kind="robust",
        question="?",
        configuration={"drive": "angle"},
        arrays={**main.arrays, **named},
        details={"profiles": {"nominal": {"profile_of": "nominal"}}},
    )
    assert with_motion(result, None) is result
    chosen = with_motion(result, "nominal")
    assert chosen.axis == "time"
    assert chosen.details["profile_of"] == "nominal"
    assert source_of(chosen).course("elbow").duration == 10.0
    with pytest.raises(StudyError, match="--motion is 'Bezier'; this result has 'nominal'"):
        with_motion(result, "Bezier")


def test_a_result_without_a_motion_is_refused() -> None:
    time = Series("s", "time", np.linspace(0.0, 1.0, 9))
    with pytest.raises(StudyError, match="no motion that a drive could follow"):
        source_of(Result(kind="robust", question="?", configuration={}, arrays={"time": time}))
    spread = Series("1", "spread", np.linspace(0.0, 1.0, 9))
    with pytest.raises(StudyError, match="runs along spread and is no motion"):
        source_of(Result(kind="robust", question="?", configuration={}, arrays={"spread": spread}))


def test_the_drive_of_a_study_comes_with_its_result() -> None:
    import argparse

    study = study_from(
        {"minimise": "peak-acceleration", "drive": {"drum_radius": 0.02, "counts": 4096}}
    )
    stored = Result(kind="truss", question="?", configuration=as_dictionary(study))
    drive, stated = _drive(stored, argparse.Namespace(drive=None))
    assert stated
    assert drive == study.drive
