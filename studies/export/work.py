"""What `antenna-ocp export` does: it loads a motion, tabulates it, plays it, and writes it."""

from __future__ import annotations

import argparse
import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from ocp.arrays import Array
from studies.common import columns as text
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.folder import PROGRAM, plain, version
from studies.common.result import Result, reading
from studies.drive.course import DRUM, Course, polynomial_course
from studies.drive.schema import Drive, drive_from, read_drive
from studies.drive.setpoints import sampled, uniform_times
from studies.export import binary, c99, polynomials
from studies.export.asked import Asked
from studies.export.beyond_caps import FIRST_LINE, beyond_in_words, certain
from studies.export.command import COLUMNS, CURVES
from studies.export.formats import TABLES
from studies.export.polynomials import Segments
from studies.export.remedies import PASSES, advice_on
from studies.export.round_trip import RoundTrip, itself, round_trip
from studies.export.set_point_columns import SET_POINT, with_set_points
from studies.export.source import Source, source_of, with_law, with_motion, with_rests
from studies.export.templates import TableTemplate, template_of

ROUNDS = 5  # of optimising again inside lower limits
MORE_TENSION = 1.2  # times what is missing: the ringing changes with the motion
RECORD = ".record.json"  # behind the name of the file that it belongs to
MANY = 50_000  # points, of which about so many a second are written and played


def export(options: argparse.Namespace, console: Console) -> ExitCode:
    """Write the motion that flags ask for.

    Raises
    ------
    StudyError
        If the result has none, or a table of it breaks limits of its drive.
    """
    with reading(options.results):
        return _export(options, console)


def _export(options: argparse.Namespace, console: Console) -> ExitCode:
    _refuse_contradictions(options)
    result = Result.load(options.results)
    if not result.arrays:
        raise StudyError(f"the result in {options.results} has no arrays to export")
    result = with_motion(result, options.motion)
    if _as_stored(options):
        return _hand_over(_columns_of(result, None, options), None, options, console)

    drive, stated = _drive(result, options)
    asked = Asked(source_of(result), options, _form(options))
    content: str | bytes
    record: RoundTrip | None
    if asked.form is not None:
        asked, content, record = _table(asked, drive, console)
    elif options.to in CURVES:
        content, record = _curve(asked, drive, stated, console)
    else:
        content, record = _columns(asked, drive, stated, console)
    if record is not None and (exceeded := certain(record.beyond)):
        # a motion keeps its caps, and what was made of it here need not: that comes first
        advice = _advice(asked, drive, record, console, stated=stated)
        said = "\n  and ".join(one.words for one in exceeded)
        console.complain(f"{FIRST_LINE}: {said}\n  it is written all the same{advice}")
    return _hand_over(content, record, options, console)


def _refuse_contradictions(options: argparse.Namespace) -> None:
    parts = ("stop_at", "resume_at", "resume_from")
    stated = [f"--{name.replace('_', '-')}" for name in parts if getattr(options, name) is not None]
    if len(stated) > 1:
        raise StudyError(f"{' and '.join(stated)} are profiles of their own; export one of them")
    if options.resume_within is not None and not {"--resume-at", "--resume-from"} & set(stated):
        raise StudyError("--resume-within belongs to --resume-at or --resume-from; state one")
    if options.stop_within is not None and options.stop_at is None and options.resume_at is None:
        raise StudyError("--stop-within belongs to --stop-at or --resume-at; state one of them")
    if stated:
        if options.within_limits:
            raise StudyError("--within-limits is for a whole motion; stop or resume without it")
        if options.to in COLUMNS:
            raise StudyError(
                "a stop is a motion of the rope or joint alone; export it as pvt or another table"
            )
    if options.within_limits and options.to in (*COLUMNS, *CURVES):
        raise StudyError("--within-limits needs a table of a drive, such as --to pvt")


def _as_stored(options: argparse.Namespace) -> bool:
    """Whether the stored rows are asked for, as they are."""
    plain = options.to in COLUMNS
    return plain and options.step is None and options.points is None and options.drive is None


def _form(options: argparse.Namespace) -> TableTemplate | None:
    """The table that is asked for; None of columns and curves."""
    if options.template is not None:
        return template_of(options.template)
    return TABLES.get(options.to)


def _drive(result: Result, options: argparse.Namespace) -> tuple[Drive, bool]:
    """The drive, and whether the user states one."""
    if options.drive is not None:
        return read_drive(options.drive), True
    stored = result.configuration.get("drive")
    if isinstance(stored, Mapping):  # of an arm it is the word torque or angle
        return drive_from(stored), True
    return Drive(), False


def _table(asked: Asked, drive: Drive, console: Console) -> tuple[Asked, str, RoundTrip]:
    """The table of a drive, read back and played; optimised again where that is asked for."""
    course = asked.course(drive)
    content, record = _written(asked, course, drive, console)
    if not record.breaches:
        return asked, content, record
    if asked.partial:
        return asked, *_planned_again(asked, drive, record, console)

    rope = asked.source.truss is not None and course.signal != "angle"
    if not (asked.options.within_limits and rope):
        advice = _advice(asked, drive, record, console)
        if rope and PASSES not in advice and _leaves_room(asked, course, drive):
            advice += "\n  or try --within-limits, which looks for another motion inside the limits"
        elif not rope and asked.options.within_limits:
            advice += "\n  --within-limits is for the rope of a truss only"
        raise _refusal(record, advice)

    try:
        return _optimised_again(asked, course, drive, record, console)
    except StudyError as error:
        if error.exit_code != ExitCode.NOT_SOLVED:
            raise
        advice = _advice(asked, drive, record, console)
        raise StudyError(f"{error}{advice}", error.exit_code) from error


def _leaves_room(asked: Asked, course: Course, drive: Drive) -> bool:
    """Whether limits are left for another motion, less what a table adds."""
    from studies.export.within_limits import lowered  # the engine loads with it

    try:
        lowered(course, asked.points(course, drive), drive, asked.kind(drive))
    except StudyError:
        return False
    return True


def _optimised_again(
    asked: Asked, course: Course, drive: Drive, record: RoundTrip, console: Console
) -> tuple[Asked, str, RoundTrip]:
    """The table of another motion, which leaves room in the limits for what a table adds."""
    from studies.export.within_limits import law_within, lowered, nearer

    inside, tension = drive, 0.0
    for _ in range(ROUNDS):  # what a table adds depends on its motion
        limits = lowered(course, asked.points(course, drive), inside, asked.kind(drive))
        console.progress(f"broken: {record.breaches[0].sentence}; optimising again")
        tension += MORE_TENSION * record.push
        law = law_within(asked.source.result, drive, limits, tension)
        asked = dataclasses.replace(asked, source=with_law(asked.source, law))

        course = asked.course(drive)
        content, record = _written(asked, course, drive, console)
        if not record.breaches:
            return asked, content, record
        inside = nearer(inside, record.breaches)
    advice = _advice(asked, drive, record, console)
    raise _refusal(
        record, f", even after the motion was optimised inside the lowered limits{advice}"
    )


def _planned_again(
    asked: Asked, drive: Drive, record: RoundTrip, console: Console
) -> tuple[str, RoundTrip]:
    """The table of a stop, or of what follows it, planned inside lower limits."""
    inside, again = asked.planned_inside(drive, record)
    if not again.breaches:
        return _written(asked, asked.course(inside), drive, console)
    tried = "" if inside is drive else ", also with lower limits of the plan"
    raise _refusal(again, tried + _advice(asked, drive, again, console))


def _advice(
    asked: Asked, drive: Drive, record: RoundTrip, console: Console, *, stated: bool = True
) -> str:
    """Why a table breaks limits or caps, and another one that was played and does not."""
    if asked.options.to == "c99" and asked.options.real == "float":
        return ""  # what these numbers add is not played with other values
    console.progress("playing other tables, to find one that keeps limits and caps")
    # what samples a curve is known if a drive is stated
    sampled = stated or asked.options.to not in CURVES
    return advice_on(asked, drive, record, console.live, sampled=sampled)


def _written(asked: Asked, course: Course, drive: Drive, console: Console) -> tuple[str, RoundTrip]:
    about, points = _about(asked.source, course, asked.options), asked.points(course, drive)
    _told(console, "writing, reading back and playing", len(points.times))
    content, again = asked.written(points, drive, about)
    record = asked.played(again, course, drive)
    if beyond := beyond_in_words(record.beyond):
        content, _ = asked.written(points, drive, beyond | about)
    return content, record


def _refusal(record: RoundTrip, remedy: str) -> StudyError:
    first, *others = (breach.sentence for breach in record.breaches)
    more = "".join(f"\n  and {sentence}" for sentence in others)
    return StudyError(f"the export is refused: {first}{more}{remedy}", ExitCode.NOT_VERIFIED)


def _curve(asked: Asked, drive: Drive, stated: bool, console: Console) -> tuple[str, RoundTrip]:
    """Polynomial segments, played from their own values at the drive's period."""
    source, options, course = asked.source, asked.options, asked.course(drive)
    whole = not (asked.partial or drive.start_dwell or drive.end_dwell)
    error = asked.positive("error")
    if error is None:  # of a drum it is that of its rope
        error = polynomials.ERROR / (drive.radius if course.signal == DRUM else 1.0)
    if options.signal == "angle" and source.law is not None and whole:
        segments = polynomials.exact_segments(source.law)
    else:
        segments = polynomials.fitted_segments(course, error)

    rounded = options.to == "c99" and options.real == "float"
    if rounded:
        segments = _in_float(segments, course, asked.positive("error"))
    about = _about(source, course, options) | {"error": f"{segments.error:.3g} {segments.unit}"}

    def written(beyond: Mapping[str, str]) -> str:
        if options.to == "segments":
            return polynomials.write_segments(segments, {**beyond, **about})
        return c99.write_source(segments, {**beyond, **about}, options.real)

    content = written({})
    if options.to == "segments":
        segments = polynomials.read_segments(content)
    if rounded:
        again = c99.float_course(segments, course)
    else:
        curve = segments.curve()
        again = polynomial_course(course.signal, course.unit, curve, course.switches)
    # a curve has no points, and only a drive that is stated says how it is sampled
    truss, result = source.truss, source.result
    if stated:
        points = sampled(again, uniform_times(again, drive.period), drive.count(again.unit))
        record = round_trip(course, points, drive, None, truss, result, asked.partial)
    else:
        record = itself(course, drive, truss, result)
    if record.breaches:
        raise _refusal(record, _advice(asked, drive, record, console, stated=stated))
    miss = {f"largest miss of the curve [{segments.unit}]": segments.error}
    record = dataclasses.replace(record, values={**miss, **record.values})
    return written(beyond_in_words(record.beyond)), record


def _in_float(segments: Segments, course: Course, stated: float | None) -> Segments:
    """The same segments with the error that arithmetic of 24 bits makes of them."""
    error = c99.float_error(segments, course)
    if stated is not None and error > stated:
        raise StudyError(
            f"--error is {stated:g} {course.unit}, but numbers of the type float miss the motion "
            f"by {error:.3g} {course.unit}; take --real double, or allow that error"
        )
    return dataclasses.replace(segments, error=error)


def _columns(
    asked: Asked, drive: Drive, stated: bool, console: Console
) -> tuple[str | bytes, RoundTrip | None]:
    """The whole profile at the times that are asked for.

    Where a drive is stated its set-points are further columns, and these are played.
    """
    source, options, course = asked.source, asked.options, asked.course(drive)
    times = asked.row_times(course, drive)
    _told(console, "evaluating", len(times))
    columns = with_rests(source, drive).rows(times)
    if not stated:
        _told(console, "writing", len(times))
        return _columns_of(source.result, columns, options), None

    _told(console, "playing", len(times))
    points = asked.points(course, drive)
    record = asked.played(points, course, drive)
    if record.breaches:
        raise _refusal(record, _advice(asked, drive, record, console))
    result, columns = with_set_points(source, columns, course, points, drive)
    about = {"column that is played": SET_POINT.format(signal=course.signal)}
    record = dataclasses.replace(record, values={**about, **record.values})
    _told(console, "writing", len(times))
    return _columns_of(result, columns, options, beyond_in_words(record.beyond)), record


def _told(console: Console, what: str, count: int) -> None:
    """Say what is done with many points, which takes seconds."""
    if count > MANY:
        console.progress(f"{what} {count} points")


def _columns_of(
    result: Result,
    columns: Mapping[str, Array] | None,
    options: argparse.Namespace,
    first: Mapping[str, str] = MappingProxyType({}),
) -> str | bytes:
    """The columns in their format; the stored ones unless others are given.

    Parameters
    ----------
    first : what the file says before all else.
    """
    if columns is None:
        columns = text.stored_columns(result)
    if options.to == "csv":
        dialect = text.Dialect(options.separator, options.decimal, not options.no_header)
        return text.write_csv(result, columns, dialect, first)
    if options.to == "json":
        return text.write_json(result, columns, first)
    write = binary.write_mat if options.to == "mat" else binary.write_parquet
    return write(result, columns, first)


def _about(source: Source, course: Course, options: argparse.Namespace) -> dict[str, str]:
    """What a table says of itself."""
    times = ("stop_at", "resume_at", "resume_within")
    part = {name: getattr(options, name) for name in times}
    return {
        "program": f"{PROGRAM} {version(PROGRAM)}",
        "question": source.result.question,
        "signal": f"{course.signal} [{course.unit}]",
        "position": _meaning(source, course),
        "unit": course.unit,
        "duration_s": f"{course.duration:.15g}",
        **{name: f"{value} s" for name, value in part.items() if value is not None},
        **({"resume_from": options.resume_from} if options.resume_from is not None else {}),
        **({"note": course.note} if course.note else {}),
    }


def _meaning(source: Source, course: Course) -> str:
    """What the positions of a table are; a signal of another mechanism may have any name."""
    if source.truss is None:
        return f"{'angle' if course.unit == 'rad' else 'way'} since the start"
    since = "since the stowed truss was at rest, positive"
    if course.signal == "rope":
        less = "" if course.stretch is None else ", less the stretch of the rope"
        return (
            f"rope wound in {since}; the column rope_length of a CSV export falls by as much{less}"
        )
    if course.signal == DRUM:
        return f"turn of the drum {since} if rope is wound in"
    return "angle"


def _hand_over(
    content: str | bytes, record: RoundTrip | None, options: argparse.Namespace, console: Console
) -> ExitCode:
    """Print the text, or write it with its record beside it."""
    if options.output is None:
        if isinstance(content, bytes):
            raise StudyError(f"--to {options.to} is no text; name a file with --output")
        console.say(content.rstrip("\n"))
        return ExitCode.OK

    _write_new(options.output, content)
    if record is not None:
        beside = options.output.with_name(options.output.name + RECORD)
        text = json.dumps(plain(dict(record.values)), indent=2, ensure_ascii=False)
        _write_new(beside, text + "\n")
        console.say("\n".join(record.lines()))
    return ExitCode.OK


def _write_new(path: Path, content: str | bytes) -> None:
    """Never over a file that is there: it may be the only copy."""
    data = content.encode("utf-8") if isinstance(content, str) else content
    try:
        with path.open("xb") as file:
            file.write(data)
    except OSError as error:
        raise StudyError(
            f"the file {path} cannot be written ({error.strerror}); name another one",
            ExitCode.NO_RESULTS_FOLDER,
        ) from error
