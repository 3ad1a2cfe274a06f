"""The show "export-remedies": every remedy that a message of `export` names, followed literally.

Every case draws a truss, a motion of it in closed form, caps that the motion keeps, a drive and a
format; a third of the cases are a stop or the way on from it. The command writes the table. If its
message names flags, keys of the drive or caps of the study, a script does just that and calls the
command again. What counts is whether it helped.
"""

from __future__ import annotations

import contextlib
import io
import json
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shows.show import Question, Row
from models.laws import JerkLimited
from models.truss import TrussParameters
from studies.cli import main
from studies.common.comparison_table import TableRow
from studies.common.console import Table
from studies.common.exit_codes import ExitCode
from studies.common.result import Result, Verdict
from studies.export.formats import CURVES, TABLES
from studies.truss.config import DEPLOYED, as_dictionary, study_from
from studies.truss.motions.deployment import Deployment
from studies.truss.study import series_of

LINE = "random exports: does each remedy that a message names help?"
LIMIT = 600.0  # [s]; a case takes up to half a minute, and optimising again about as long

DURATIONS = (5.0, 300.0)  # T [s], log-uniform
MULTIPLES = (60.0, 300.0)  # of 1/T^3: caps on the jerk, log-uniform; 47 is the least that deploys
FRICTION = (0.0, 0.03)  # mu [-]
MODULES = (8, 30)
SPREAD = 0.2  # of the bars, relative: longer ones leave the cross-bars room
BITS = (10, 20)  # of the encoder, a turn of the drum
PERIODS = (0.002, 0.2)  # [s], log-uniform
BANDWIDTHS = (1.0, 50.0)  # [Hz], log-uniform
NO_LOOP = 0.2  # share of the drives that follow exactly
CAPPED = {"power": "peak-power", "reaction": "peak-reaction", "force": "peak-force"}
LIMITED = {"acceleration": "peak-rope-acceleration", "speed": "peak-rope-speed"}
ROOM = (1.02, 1.5)  # times the motion's own value, of a cap or limit

EXCESS = re.compile(r"([\d.e+]+) (% above|% short|times) (?:its limit|(?:of )?the cap)")
PASSES = re.compile(r"remedy, played and found to pass: (.*)")
# a message is parted at spaces, so that what it leaves may stand in further lines
BEST = re.compile(
    r"best of \d+ other tables that were played: (?P<words>.*?)(?P<kept>, which keeps.*?)?"
    r";\s+it leaves (?P<left>.*?)(?=\n  (?:or:|more room|--within)|$)",
    re.DOTALL,
)
CAPS = re.compile(r"more room has a motion of the study with ((?:caps\.\w+ = [\d.e+-]+[,\s]*)+)")
LONGER = re.compile(r"allow more time, as --stop-within ([\d.e+-]+),")
AGAIN = "or try --within-limits"
PLAIN = re.compile(r"Traceback|unforeseen|phase '")  # no user should see these


def question(seed: int, index: int) -> Question:
    """Draw a truss, a motion, caps, a drive and a table."""
    rng = np.random.default_rng([seed, index])
    size, longer = rng.uniform(0.5, 2.0), rng.uniform(1.0, 1.0 + SPREAD)
    lengths = {
        "bar_length": float(f"{size * longer * TrussParameters().bar_length:.4g}"),
        "half_cross_bar": float(f"{size * TrussParameters().half_cross_bar:.4g}"),
    }
    drive: dict[str, Any] = {
        "drum_radius": 0.02,
        "counts": 2 ** int(rng.integers(*BITS)),
        "period": _drawn(rng, PERIODS),
        "interpolation": str(rng.choice(["linear", "spline"])),
    }
    if rng.random() > NO_LOOP:
        drive["bandwidth"] = _drawn(rng, BANDWIDTHS)
    return {
        "truss": {
            **lengths,
            "modules": int(rng.integers(*MODULES)),
            "pulley_friction": float(f"{rng.uniform(*FRICTION):.2g}"),
        },
        "duration": _drawn(rng, DURATIONS),
        "multiple": _drawn(rng, MULTIPLES),
        "caps": {name: _drawn(rng, ROOM) for name in CAPPED if rng.random() < 0.3},
        "limits": {name: _drawn(rng, ROOM) for name in LIMITED if rng.random() < 0.3},
        "tension": rng.random() < 0.3,
        "drive": drive,
        "format": str(rng.choice([*TABLES, *CURVES])),
        "part": str(rng.choice(["whole", "whole", "whole", "whole", "stop", "resume"])),
        "at": round(float(rng.uniform(0.2, 0.8)), 2),  # of the duration
        "within": round(float(rng.uniform(0.02, 0.3)), 3),
    }


def _drawn(rng: np.random.Generator, ends: tuple[float, float]) -> float:
    """Log-uniform, with three digits."""
    low, high = np.log(ends)
    return float(f"{math.exp(rng.uniform(low, high)):.3g}")


def answer(question: Question, folder: Path) -> Row:
    """Export, follow what the message names, export again."""
    result, drive = _study(question)
    if result.value("least-tension") <= 0.0:  # no study leaves such a motion
        return {"said": "slack"}
    result_folder = folder / "study"
    _saved(result, result_folder)
    flags = _flags(question)
    code, text = _exported(result_folder, drive, flags, folder / "first")

    row: dict[str, Any] = {"code": code, "text": text, "plain": not PLAIN.search(text)}
    if code == ExitCode.OK and "BEYOND" not in text:
        return {**row, "said": "clean"}
    row["said"] = "beyond" if code == ExitCode.OK else "refused"
    if code == ExitCode.INFEASIBLE and (longer := LONGER.search(text)):
        # such a stop exists, whether or not its table keeps all limits
        more = {**flags, "stop-within": longer[1]}
        code, again = _exported(result_folder, drive, more, folder / "second")
        kept = code in (ExitCode.OK, ExitCode.NOT_VERIFIED)
        return {**row, "said": "no stop", "named": "time", "helped": kept, "after": again}
    if code not in (ExitCode.OK, ExitCode.NOT_VERIFIED):
        return {**row, "said": "other"}

    passes, best = PASSES.search(text), BEST.search(text)
    if found := passes or best:
        more, changed = _followed(found[1], drive)
        code, again = _exported(result_folder, changed, {**flags, **more}, folder / "second")
        clean = code == ExitCode.OK and "BEYOND" not in again
        row |= {"named": "passes" if passes else "best", "after": again, "after_code": code}
        row["helped"] = clean if best is None else _as_promised(best, code, again)
        drive, flags = changed, {**flags, **more}
    if caps := CAPS.search(text):
        said = row.get("after", text)
        row |= _with_caps(question, said, caps[1], drive, flags, folder)
    if AGAIN in text:
        code, again = _exported(
            result_folder,
            _drive(question, result),
            {**_flags(question), "within-limits": ""},
            folder / "within",
        )
        row |= {"again": code == ExitCode.OK, "again_says": again}
        row["plain"] = row["plain"] and not PLAIN.search(again)
    return row


def _as_promised(best: re.Match[str], code: int, again: str) -> bool:
    """Whether a table that is named as the best one leaves what the message says, and no more."""
    left, said = (" ".join(words.split()) for words in (best["left"], again))
    pieces = left.split("; ")
    if code != ExitCode.OK:  # a refusal is about the limits of the drive alone
        pieces = [piece for piece in pieces if piece.startswith("the ")]
    return all(piece in said for piece in pieces) and _worst(again) <= _worst(left)


def _study(question: Question, jerk: float | None = None) -> tuple[Result, dict[str, Any]]:
    """The stored result of a motion in closed form, and its drive."""
    duration = question["duration"]
    cap = question["multiple"] / duration**3
    stated = {
        "minimise": "peak-acceleration",
        "duration": duration,
        "caps": {"jerk": cap},
        "truss": question["truss"],
    }
    bare = study_from(stated)
    law = JerkLimited(duration, bare.truss.stowed_angle, DEPLOYED, jerk=cap)
    values = Deployment("optimal", law.profile, bare.truss).values
    caps = {name: factor * values[CAPPED[name]] for name, factor in question["caps"].items()}
    if question["tension"] and values["least-tension"] > 0.0:
        caps["least_tension"] = 0.5 * values["least-tension"]

    study = study_from({**stated, "caps": {"jerk": cap, **caps}})
    lower = JerkLimited(duration, bare.truss.stowed_angle, DEPLOYED, jerk=jerk or cap)
    own = Deployment("optimal", lower.profile, bare.truss)
    result = Result(
        kind="truss",
        question=study.question,
        configuration=as_dictionary(study),
        arrays=series_of(own),
        table=(
            TableRow(
                "peak-acceleration",
                "peak angular acceleration",
                "rad/s^2",
                {"optimal": lower.peak_acceleration},
                minimised=True,
            ),
            TableRow(
                "least-tension", "least tension", "N", {"optimal": own.values["least-tension"]}
            ),
        ),
        verdict=Verdict("measured", "in closed form"),
    )
    return result, _drive(question, result)


def _drive(question: Question, result: Result) -> dict[str, Any]:
    """The drive with limits that the motion keeps."""
    speed, rate = (
        float(np.abs(result.arrays[name].values).max())
        for name in ("rope_speed", "rope_acceleration")
    )
    own = {"speed": speed, "acceleration": rate}
    limits = {name: factor * own[name] for name, factor in question["limits"].items()}
    return {**question["drive"], **limits}


def _flags(question: Question) -> dict[str, str]:
    at = f"{question['at'] * question['duration']:.4g}"
    within = f"{question['within'] * question['duration']:.4g}"
    part = {"whole": {}, "stop": {"stop-at": at}, "resume": {"resume-at": at}}[question["part"]]
    return {"to": question["format"], **part, **({"stop-within": within} if part else {})}


def _saved(result: Result, folder: Path) -> None:
    folder.mkdir()
    result.save(folder)


def _exported(
    results: Path, drive: Mapping[str, Any], flags: Mapping[str, str], output: Path
) -> tuple[int, str]:
    """The exit code of the command, and what it said on standard error."""
    file = output.with_suffix(".toml")
    lines = [f"{key} = {value!r}" for key, value in drive.items()]
    file.write_text("\n".join(lines) + "\n", "utf-8")
    words = ["export", str(results), "--drive", str(file), "--output", str(output)]
    for name, value in flags.items():
        words += [f"--{name}", *([value] if value else [])]
    said = io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        code = main(words)
    return int(code), said.getvalue()


def _followed(words: str, drive: Mapping[str, Any]) -> tuple[dict[str, str], dict[str, Any]]:
    """Flags and drive as a message has them: "--points 64", "counts = 4096 in the drive"."""
    flags = dict(re.findall(r"--([a-z-]+) ([\d.e+-]+)", words))
    keys = re.findall(r"(\w+) = (\S+) in the drive", words)
    return flags, {**drive, **{key: json.loads(text) for key, text in keys}}


def _worst(text: str) -> float:
    """The largest excess that a message names; infinite for a slack rope."""
    if "slack" in text:
        return math.inf
    said = text.split("cause:")[0]
    found = [
        float(value) - 1 if word == "times" else float(value) / 100
        for value, word in EXCESS.findall(said)
    ]
    return max(found, default=0.0)


def _with_caps(
    question: Question,
    text: str,
    words: str,
    drive: Mapping[str, Any],
    flags: Mapping[str, str],
    folder: Path,
) -> Row:
    """The same table of the motion under a lower cap on its jerk, judged by the caps as stated.

    Parameters
    ----------
    text : what was said of the motion as it is.
    words : the caps that were named.
    """
    caps = dict(re.findall(r"caps\.(\w+) = ([\d.e+-]+)", words))
    least = 32 * (DEPLOYED - TrussParameters(**question["truss"]).stowed_angle)
    if set(caps) != {"jerk"} or float(caps["jerk"]) * question["duration"] ** 3 < 1.001 * least:
        return {"lower": "not followed: it needs a solve"}
    lower, _ = _study(question, float(caps["jerk"]))
    place = folder / "lower"
    _saved(lower, place)
    code, again = _exported(place, drive, flags, folder / "third")
    helped = code == ExitCode.OK and "BEYOND" not in again
    less = _worst(again) < _worst(text) and code == ExitCode.OK
    return {"lower": "helped" if helped else "less" if less else "no help", "lower_says": again}


def tables(rows: Sequence[Row]) -> list[Table]:
    """Return each case in a row, and the counts."""
    head = ("case", "format", "part", "said", "named", "helped", "lower caps", "again", "plain")
    cells = [
        (
            str(row["index"]),
            row["format"],
            row["part"],
            row["failure"][:40] or row["said"],
            row.get("named", "-"),
            _word(row.get("helped")),
            row.get("lower", "-"),
            _word(row.get("again")),
            _word(row.get("plain")),
        )
        for row in rows
    ]
    named = [row for row in rows if "named" in row]
    caps = [row["lower"] for row in rows if row.get("lower") in ("helped", "less", "no help")]
    again = [row["again"] for row in rows if "again" in row]
    counts = [
        ("remedies named and followed", str(len(named))),
        ("of these helped", str(sum(row["helped"] for row in named))),
        ("caps named and followed", str(len(caps))),
        ("of these kept all caps", str(caps.count("helped"))),
        ("of these left less", str(caps.count("less"))),
        ("optimised again inside the limits", str(len(again))),
        ("of these helped", str(sum(again))),
        ("messages with internal names", str(sum(not row.get("plain", True) for row in rows))),
    ]
    return [
        Table("Exports and the remedies that their messages name", head, cells),
        Table("In all", ("what", "cases"), counts),
    ]


def _word(value: bool | None) -> str:
    return "-" if value is None else "yes" if value else "NO"
