"""What there is to export of a stored result: its rows at any times, and the courses in it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from models.laws import BetweenRests, Law
from models.truss import TrussParameters
from ocp.arrays import Array
from studies import registry
from studies.common.exit_codes import StudyError, quoted
from studies.common.result import Result
from studies.common.study import placed
from studies.drive.course import DRUM, Course, joint_course, rope_course
from studies.drive.schema import Drive


@dataclass(frozen=True, eq=False)
class Source:
    """A stored motion.

    Attributes
    ----------
    result : it is from.
    rows : maps times (m,) to the result's columns at them.
    law, truss : angle over time and the truss that it opens; None of an arm.
    courses : makes a course of a signal, for each signal that there is.
    """

    result: Result
    rows: Callable[[Array], Mapping[str, Array]]
    law: Law | None
    truss: TrussParameters | None
    courses: Mapping[str, Callable[[], Course]]

    def course(self, signal: str | None) -> Course:
        """The course of a signal; by default of the first.

        Raises
        ------
        StudyError
            If there is none of that name.
        """
        name = signal or next(iter(self.courses))
        if name not in self.courses:
            known = [*self.courses, *([] if self.truss is None else [DRUM])]
            raise StudyError(f"--signal is {quoted(name)}; this result has {', '.join(known)}")
        return self.courses[name]()


def source_of(result: Result) -> Source:
    """The motion of a result.

    Raises
    ------
    StudyError
        If it has none.
    """
    if not result.arrays:
        raise StudyError("the result has no arrays to export; run its study again")
    if result.axis != "time":
        raise StudyError(
            f"a result of the kind '{result.kind}' runs along {result.axis} and is no motion; "
            "only its stored rows can be exported, with --to csv or json and nothing else; of a "
            "front, state a motion: --motion 'point 3'"
        )
    mechanism = registry.mechanism_of(result.kind)
    if mechanism is not None and mechanism.motion is not None:
        source: Source = placed(mechanism.motion)(result)
        return source
    return _of_signals(result, {} if mechanism is None else mechanism.signals)


def with_motion(result: Result, name: str | None) -> Result:
    """The same result with another of its motions as the main one; none is named for the main.

    Results of the arm may hold several motions, sampled for a drive: `details["profiles"]` says
    what each is, and its series have its name before their own. A front holds one for each of its
    points.

    Raises
    ------
    StudyError
        If there is none of that name.
    """
    if name is None:
        return result
    study = registry.study_of(result.kind)
    if study is not None and study.motions is not None:
        motion: Result = placed(study.motions)(result, name)
        return motion
    motions = result.details.get("profiles", {})
    if name not in motions:
        known = ", ".join(repr(one) for one in motions) or "its main motion only"
        raise StudyError(f"--motion is {quoted(name)}; this result has {known}")

    head = f"{name}/"
    arrays = {
        key.removeprefix(head): dataclasses.replace(series, axis="time")
        for key, series in result.arrays.items()
        if series.axis == f"{head}time"
    }
    return dataclasses.replace(result, arrays=arrays, details={**result.details, **motions[name]})


def of_a_truss(result: Result) -> Source:
    """The motion of a result of the truss."""
    from studies.truss.motions.laws import stored_law, study_of

    law = stored_law({name: series.values for name, series in result.arrays.items()})
    return _of_law(result, law, study_of(result).truss)


def with_law(source: Source, law: Law) -> Source:
    """The same truss with another motion."""
    assert source.truss is not None  # of an arm there is no other motion
    return _of_law(source.result, law, source.truss)


def with_rests(source: Source, drive: Drive) -> Source:
    """The same motion between the rests of a drive."""
    before, after = drive.start_dwell, drive.end_dwell
    if before == 0.0 and after == 0.0:
        return source
    if source.law is not None:
        return with_law(source, BetweenRests(source.law, before, after))

    last = float(source.result.arrays["time"].values[-1])

    def rows(time: Array) -> dict[str, Array]:
        found = dict(source.rows(np.clip(time - before, 0.0, last)))
        return {**found, "time": time}

    return dataclasses.replace(source, rows=rows)


def _of_law(result: Result, law: Law, truss: TrussParameters) -> Source:
    from studies.truss.motions.deployment import Deployment, columns_at
    from studies.truss.motions.laws import study_of

    deployment = Deployment("export", law, truss, carrier=study_of(result).ring_on_arm)

    def angle_course() -> Course:
        def derivatives(time: Array) -> Array:
            motion = law.motion(time)
            return np.stack([motion.angle, motion.speed, motion.acceleration, motion.jerk])

        switches = rope_course(law, truss).switches
        return Course("angle", "rad", law.duration, switches, derivatives)

    def rows(time: Array) -> dict[str, Array]:
        # a result of an earlier version may lack a column
        found = columns_at(deployment, time)
        return {name: values for name, values in found.items() if name in result.arrays}

    return Source(
        result=result,
        rows=rows,
        law=law,
        truss=truss,
        courses={
            "rope": lambda: rope_course(law, truss),
            "angle": angle_course,
        },
    )


def _of_signals(result: Result, stated: Mapping[str, tuple[str, str]]) -> Source:
    """The motion of stated signals; without any, of the joints whose angle and rate there are."""
    series = {name: item for name, item in result.arrays.items() if item.axis == "time"}
    time = series["time"].values
    joints = [name.removesuffix("_angle") for name in series if name.endswith("_angle")]
    by_name = stated or {joint: (f"{joint}_angle", f"{joint}_rate") for joint in joints}
    signals = {name: pair for name, pair in by_name.items() if set(pair) <= series.keys()}
    if not signals:
        raise StudyError(
            f"a result of the kind '{result.kind}' holds no motion that a drive could follow; take "
            "--to csv, json or mat without --step, --points and --drive for what is stored, or "
            "export the result of antenna-ocp arm solve"
        )

    def course(signal: str) -> Callable[[], Course]:
        place, rate = (series[name] for name in signals[signal])
        predicted = f"{signal}_torque" in series and _by_torque(result)
        return lambda: joint_course(
            signal, time, place.values, rate.values, predicted, unit=place.unit
        )

    def rows(at: Array) -> dict[str, Array]:
        return {name: np.interp(at, time, item.values) for name, item in series.items()}

    return Source(result, rows, None, None, {signal: course(signal) for signal in signals})


def _by_torque(result: Result) -> bool:
    return result.configuration.get("drive", "torque") == "torque"
