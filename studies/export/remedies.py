"""What helps a table that its drive would play badly: other tables, each played before it is named.

Rounded positions are divided by the step squared: a shorter step makes that worse, and a longer one
makes the interpolation worse. Which of the two it is, and which step is right, no rule says. So
other steps, numbers of points, interpolations and encoders are tried, and the first table that
passes is named.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from studies.common.exit_codes import StudyError
from studies.drive.course import Course
from studies.drive.schema import Drive
from studies.drive.setpoints import SetPoints
from studies.export.asked import Asked
from studies.export.command import CURVES
from studies.export.round_trip import Breach, RoundTrip, itself
from studies.truss.limits.caps import CAPPED

STEPS = (1.0, 2.0, 5.0)  # times a power of ten [s]
SHORTER, LONGER = 10.0, 1000.0  # than the step of the table: how far others are tried
POINTS = tuple(round(2 ** (k / 2)) for k in range(7, 24))  # 11 to 2896
MOST = 20_000  # points of a table that is tried: each takes a moment
EXACT = 2**30  # counts a turn that round nothing off
COUNTS = 2**24  # the finest encoder that is tried, a turn
OTHERS = 4  # spacings that are tried with each encoder and each interpolation
SMOOTH = ("spline", "hermite", "quintic")  # interpolations without jumps of the speed
HALF = 0.5  # of what is exceeded: what makes more of it is its cause
ROUNDING, INTERPOLATION = "rounding", "interpolation"
LITTLE = 0.25  # of a cap: what a table may leave before another encoder is tried
LESS = 0.9  # of what is exceeded: a table that leaves more is no remedy
MORE_TIME = (1.5, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0)  # times that of a stop
SLOWER = (0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2)  # times the speed of the way on
TWICE = 2.0  # what a table exceeds: so much less a cap has to be, for it changes with the motion
LEAST_SHARE = 0.3  # of a cap that is still worth another run

PASSES = "remedy, played and found to pass"

Flags = Mapping[str, str]  # of the command, by their names in its options
Keys = Mapping[str, Any]  # of the drive
Play = Callable[[Flags, Keys], RoundTrip]


@dataclass(frozen=True)
class OtherTable:
    """A table that might do.

    Attributes
    ----------
    flags : what a user types.
    keys : what a user writes into the drive.
    more : what else there is to say.
    """

    flags: Flags = field(default_factory=dict)
    keys: Keys = field(default_factory=dict)
    more: str = ""

    @property
    def words(self) -> str:
        """What a user has to do; TOML writes these values as JSON does."""
        keys = [f"{key} = {json.dumps(value)} in the drive" for key, value in self.keys.items()]
        flags = [f"--{name.replace('_', '-')} {value}" for name, value in self.flags.items()]
        return " and ".join([*keys, *flags]) + self.more

    def along(self, spacings: Sequence[OtherTable]) -> Iterator[OtherTable]:
        """The same with the points as they are, and with some other spacings."""
        yield self
        for one in spacings[:: max(1, len(spacings) // OTHERS)]:
            yield OtherTable({**self.flags, **one.flags}, {**self.keys, **one.keys}, self.more)


def worst(record: RoundTrip) -> float:
    """The largest relative excess of a limit or cap; what is broken by a slack rope is infinite."""
    broken = [breach.excess for breach in record.breaches]
    return max([*broken, *(one.excess for one in record.beyond if one.excess > 0.0)], default=0.0)


def advice_on(
    asked: Asked,
    drive: Drive,
    record: RoundTrip,
    tell: Callable[[str], None],
    *,
    sampled: bool = True,
) -> str:
    """Why a table breaks limits or caps, and another one that was played and does not.

    Parameters
    ----------
    asked : what the table is of.
    record : of the table as it is.
    tell : where the search stands.
    sampled : whether a drive takes points of it; of a curve alone there are none.
    """

    def play(flags: Flags, keys: Keys) -> RoundTrip:
        changed, other = asked.changed(flags), dataclasses.replace(drive, **keys)
        return changed.tried(other) if sampled else _itself(changed, other)

    course = asked.course(drive)
    points, origin = asked.points(course, drive), INTERPOLATION
    if points.count is not None:
        exact = asked.tried(dataclasses.replace(drive, counts=EXACT), digits=False)
        origin = INTERPOLATION if _mostly(exact, record) else ROUNDING
    if _mostly(_itself(asked, drive), record):
        parts = {"stop_at": "stop", "resume_at": "way on", "resume_from": "way on"}
        origin = next(
            (name for key, name in parts.items() if getattr(asked.options, key)), "motion"
        )

    spacings = _spacings(asked, course, points, fewer=origin == ROUNDING)
    groups: list[Iterable[OtherTable]] = [_plans(course, asked)]  # of a whole motion none
    if origin == ROUNDING:
        groups = [spacings, _encoders(drive, spacings), *groups]
    elif origin == INTERPOLATION:
        smoother = _interpolations(asked, drive, spacings)
        # straight lines have no acceleration, however short they are
        groups = [*([] if _undefined(record) else [spacings]), smoother, *groups]
    room = origin in (ROUNDING, INTERPOLATION) and not asked.partial
    found = _best(play, record, groups, tell, room=room)
    return _cause(record, course, points, origin) + found


def _best(
    play: Play,
    record: RoundTrip,
    groups: Iterable[Iterable[OtherTable]],
    tell: Callable[[str], None],
    *,
    room: bool,
) -> str:
    """The first other table that breaks nothing.

    If there is none, the best one is named with what it leaves, and caps of the study with room
    for that. A further group is only tried if the ones before leave much.

    Parameters
    ----------
    play : makes and plays a table.
    record : of the table as it is.
    tell : where the search stands.
    room : whether another motion of the study would help.
    """
    best, words, tried = record, "", 0
    for group in groups:
        for table in group:
            tell(f"other tables that were played: {tried}")
            try:
                found = play(table.flags, table.keys)
            except StudyError:  # it does not fit the device
                continue
            tried += 1
            if worst(found) == 0.0:
                return f"\n  {PASSES}: {table.words}"
            if (bool(found.breaches), worst(found)) < (bool(best.breaches), LESS * worst(best)):
                best, words = found, table.words
        if words and not best.breaches and worst(best) <= LITTLE:
            break
    if not tried:
        return ""
    lower = _room(best) if room else ""
    if not words:
        return f"\n  none of {tried} other tables that were played is better{lower}"
    left = "; ".join([*(b.sentence for b in best.breaches), *(b.words for b in best.beyond)])
    kept = ", which keeps the limits of the drive" if record.breaches and not best.breaches else ""
    return (
        f"\n  best of {tried} other tables that were played: {words}{kept}; it leaves {left}{lower}"
    )


def _room(record: RoundTrip) -> str:
    """Caps for another run of the study, which leave room for what the table adds."""
    shares = {
        one: 1.0 - TWICE * (1.0 - 1.0 / (1.0 + one.excess))
        for one in record.beyond
        if one.excess > 0.0
    }
    if record.breaches or not all(
        one.key in CAPPED and one.quantity.kind != "least" and share > LEAST_SHARE
        for one, share in shares.items()
    ):
        return ""
    caps = [f"caps.{CAPPED[one.key]} = {_down(share * one.cap):g}" for one, share in shares.items()]
    return f"\n  more room has a motion of the study with {', '.join(caps)}"


def _down(value: float) -> float:
    """The value with three digits, rounded down."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.floor(value / step) * step:.3g}")


def _itself(asked: Asked, drive: Drive) -> RoundTrip:
    """The record of what is asked for without a table."""
    return itself(asked.course(drive), drive, asked.source.truss, asked.source.result)


def _undefined(record: RoundTrip) -> bool:
    """Whether a limit is of a quantity that has no value between the points."""
    return any(isinstance(one, Breach) and math.isnan(one.value) for one in record.breaches)


def _mostly(part: RoundTrip, record: RoundTrip) -> bool:
    """Whether a table exceeds at least half of what another one does."""
    return worst(part) > HALF * worst(record) or math.isinf(worst(part))


def _cause(record: RoundTrip, course: Course, points: SetPoints, origin: str) -> str:
    """Why a table exceeds limits or caps, in a sentence.

    Parameters
    ----------
    origin : "rounding", "interpolation", or else what itself exceeds them, such as a stop.
    """
    step, unit, (_, peak, _) = points.shortest, course.unit, course.peaks
    if origin == ROUNDING:
        count = points.count or 0.0
        return (
            f"\n  cause: positions are rounded to counts of {count:.2g} {unit}; that divided by "
            f"the square of the step of {step:.3g} s is {count / step**2:.2g} {unit}/s^2, and the "
            f"motion has at most {peak:.2g} {unit}/s^2"
        )
    if origin == INTERPOLATION:
        loop = ", and the position loop, which overshoots" if _behind_a_loop(record) else ""
        return (
            "\n  cause: not the rounding, but the interpolation between points up to "
            f"{points.longest:.3g} s apart{loop}"
        )
    return f"\n  cause: the {origin} itself, not its table"


def _behind_a_loop(record: RoundTrip) -> bool:
    """Whether the playback goes on after its table, until a loop has settled."""
    return bool(record.playback.time[-1] > record.playback.end)


def _spacings(asked: Asked, course: Course, points: SetPoints, *, fewer: bool) -> list[OtherTable]:
    """Other steps and numbers of points; what is closest to the table as it is comes first.

    Parameters
    ----------
    points : of the table as it is.
    fewer : whether more points would only make it worse.
    """
    size = points.times.size
    curve = asked.options.to in CURVES  # the drive samples it with its period
    found = _steps(course, points)
    if not curve and not (asked.form is not None and asked.form.layout.even):
        found += _numbers(course, points)
    if fewer:
        found = [one for one in found if one[1] < size]
    found.sort(key=lambda one: abs(math.log(one[1] / size)))
    if curve:
        return [OtherTable(keys={"period": float(flags["step"])}) for flags, _ in found]
    return [OtherTable(flags) for flags, _ in found]


def _interpolations(
    asked: Asked, drive: Drive, spacings: Sequence[OtherTable]
) -> Iterator[OtherTable]:
    """Smoother interpolations in place of holds or straight lines, if format and drive choose."""
    layout = None if asked.form is None else asked.form.layout
    if drive.interpolation in SMOOTH or (layout is not None and layout.interpolation is not None):
        return
    for kind in SMOOTH:
        if layout is None or not layout.lacks(kind):
            yield from OtherTable(keys={"interpolation": kind}).along(spacings)


def _encoders(drive: Drive, spacings: Sequence[OtherTable]) -> Iterator[OtherTable]:
    """More counts a turn, with the points as they are and with some of the other spacings."""
    counts = drive.counts
    while counts is not None and counts <= COUNTS // 4:
        counts *= 4
        yield from OtherTable(keys={"counts": counts}).along(spacings)


def _plans(course: Course, asked: Asked) -> Iterator[OtherTable]:
    """More time for a stop, and for the way on a lower speed, which makes it last longer."""
    within, options = asked.positive("stop_within"), asked.options
    if options.stop_at is not None and within is not None:
        for times in MORE_TIME:
            yield OtherTable({"stop_within": f"{times * within:.4g}"})
    lasting = asked.positive("resume_within")
    if lasting is not None:
        for share in SLOWER:
            yield OtherTable({"resume_within": f"{lasting / share:.4g}"})
    elif options.resume_at is not None or options.resume_from is not None:
        for share in SLOWER:
            speed = float(f"{share * course.peaks[0]:.3g}")
            yield OtherTable(keys={"speed": speed}, more=", which makes it last longer")


def _steps(course: Course, points: SetPoints) -> list[tuple[dict[str, str], int]]:
    mean = course.duration / (points.times.size - 1)
    found = []
    for power in range(-4, 4):
        for step in (first * 10.0**power for first in STEPS):
            number = round(course.duration / step) + 1
            if mean / SHORTER <= step <= mean * LONGER and 9 <= number <= MOST:
                found.append(({"step": f"{step:.3g}"}, number))
    return found


def _numbers(course: Course, points: SetPoints) -> list[tuple[dict[str, str], int]]:
    return [
        ({"points": str(number)}, number)
        for number in POINTS
        if number > len(course.switches) and number <= SHORTER * points.times.size
    ]
