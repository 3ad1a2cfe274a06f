"""Command lines and study files drawn at random, out of the flags and keys that there are.

A line begins as one that is cheap to carry out. Some get other numbers that somebody may mean. Of
the others one to three things are spoilt: values
at a boundary, of a wrong type or hostile, flags without value, twice, misspelt or cut short, files
that are missing, cut off or of another kind.
"""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.shows.fuzz import damage
from studies.cli import build_parser
from studies.common.keys import key_lines
from studies.common.study import Study
from studies.registry import COMMANDS, command

FAST = ("--intervals", "8", "--starts", "straight", "--seconds", "20")
TRUSS = ("--objective", "peak-acceleration", "--duration", "5", *FAST)
SMOOTH = (
    'minimise = "peak-force"\nduration = 5\nsolver.intervals = 8\nsolver.starts = ["straight"]\n'
)


@dataclass(frozen=True)
class Kind:
    """A sub-command: words that are cheap to carry out, and the study that its file states.

    Attributes
    ----------
    words : after its name; capital ones stand for files.
    text : a file that states a cheap study.
    study : classes of its keys, each as table=module:name with the name of its table if it has
        one; none if it reads no file.
    """

    words: Sequence[str] = ()
    text: str = ""
    study: tuple[str, ...] = ()


_CHEAP: Mapping[str, Kind] = {
    "truss": Kind(TRUSS, SMOOTH),
    "codesign": Kind(
        ("--objective", "peak-force", *TRUSS[2:], "--designs", "1"),
        SMOOTH,
    ),
    "robust truss": Kind(
        ("STUDY", "--draws", "20", "--coarse", "--seconds", "20"),
        SMOOTH + "robust.scenarios.rough.pulley_friction = 0.015\n",
    ),
    "pareto truss": Kind(
        ("--objectives", "time,peak-acceleration", "--duration", "4..6", "--points", "3", *FAST),
        'pareto.objectives = ["time", "energy"]\nduration = [4, 6]\npareto.points = 3\n',
    ),
    "check": Kind(("PROFILE", "--no-optimum"), 'minimise = "energy"\n'),
    "flex": Kind(
        ("--preset", "single-pendulum", "--duration", "0.1", "--elements", "1", "--no-sweep"),
        "duration = 0.1\ngravity = [0.0, -9.81]\nelements = 1\n[[link]]\nlength = 1.2\n"
        "area = 0.0018\nsecond_moment = 1.2e-8\nmodulus = 2e9\ndensity = 5540.0\n"
        "[[joint]]\nkind = 'free'\n",
    ),
    "arm solve": Kind((), 'stage = "big"\n'),
    "arm baselines": Kind((), 'stage = "big"\n'),
    "arm least-duration": Kind((), 'stage = "big"\n'),
    "arm sequence": Kind((), 'least = "peak-torque"\n'),
    "pareto arm": Kind(
        ("--coarse", "--points", "3"),
        "coarse = true\n",
    ),
    "robust arm": Kind((), 'stage = "big"\n'),
    "mission": Kind((), "refine = false\n"),
    "paper": Kind((), "elements = 1\n"),
    "sweep": Kind(
        ("SWEEP", "--plan", "--workers", "1"),
        'coarse = true\nbase.minimise = "energy"\nparameters.duration = [4.0, 5.0]\n',
    ),
    "keys": Kind(("truss", "--schema")),
    "completion": Kind(("bash",)),
    "report": Kind(("RESULTS", "--to", "OUT")),
    "export": Kind(("RESULTS", "--to", "pvt", "--output", "NEW")),
}


def _classes(name: str) -> tuple[str, ...]:
    """The classes of the keys of a sub-command's file."""
    found = command(name)
    keys = found.keys if isinstance(found, Study) else {}
    return tuple(f"{table}={place}" for table, place in keys.items())


# of another sub-command no words are known that are cheap
KINDS: Mapping[str, Kind] = {
    name: replace(_CHEAP.get(name, Kind()), study=_classes(name)) for name in COMMANDS
}

MEANT = 0.3  # share of lines in which nothing is spoilt on purpose
LIKELY = ("0.01", "0.1", "0.5", "1", "2", "3", "5", "10", "20", "60", "100", "1000")
NUMBERS = (
    *("0", "-1", "1", "2", "3", "0.5", "5", "1e-9", "1e-300", "1e9", "1e18", "1e308", "1e400"),
    *("nan", "inf", "-inf", "-0.0", "0x10", "1_0", "\u0661\u0662", "5,5", "5 s"),
    *("9" * 309, "9" * 5000),
)
WORDS = (
    *("", " ", "--", "-", "abc", "none", "true", "bezier", "energy", "200/T^3", "-1/T^3"),
    *("1e400/T^3", "1..2", "2..1", "1..", "..", "1..2..3", "a,b", ",", ",,", "a=b", "="),
    *("link=0.1", "link=", "x.y=1", "../x", "/dev/null", ".", "%s", "{0}", "\n", "a\nb", "\t"),
    *("\u2028", "\u00e9" * 9, "x" * 300),
    *("big", "small", "both", "torque", "angle", "time", "peak-force", "[1, 2]", "{}", "'a'", '"'),
)
FILES = ("MISSING", "FOLDER", "BINARY", "EMPTY", "STUDY", "DRIVE", "PROFILE", "RESULTS", "LARGE")
TOML = (
    *("0", "1", "-1", "0.5", "1e-300", "1e308", "1e400", "nan", "inf", "true", '""', '"abc"'),
    *('"none"', "[]", "[1]", "[1, 2]", "[2, 1]", "[[1], [2]]", '["a", "b"]', "{}", "{ a = 1 }"),
    *("1979-05-27", "07:32:00", "[nan, 1]", '[1, "a"]', "{ energy = -1 }", "'''a\nb'''"),
    *("9" * 400, "9" * 5000, "0x" + "f" * 300, "[" * 500 + "]" * 500, '"' + "x" * 5000 + '"'),
)


@dataclass
class Line:
    """A command line that is being drawn.

    Attributes
    ----------
    name : of the sub-command.
    words : behind it.
    files : texts of the files that capital words stand for.
    """

    name: str
    words: list[str]
    files: dict[str, bytes] = field(default_factory=dict)


def draw(rng: np.random.Generator, name: str) -> Line:
    """Draw a line of a sub-command."""
    kind = KINDS[name]
    files = {"SWEEP": KINDS["sweep"].text.encode(), "STUDY": kind.text.encode()}
    line = Line(name, list(kind.words), files)
    stated = bool(kind.study) and rng.random() < 0.4
    if stated:
        _state(rng, line, kind)
    if rng.random() < MEANT:
        _likely(rng, line)
        return line
    ways = (*[_other_value] * 8, _cut, _misspelt, _extra, _twice, _file)
    for _ in range(int(rng.integers(0, 2) if stated else rng.integers(1, 4))):
        ways[int(rng.integers(len(ways)))](rng, line)
    return line


def _flags(name: str) -> list[argparse.Action]:
    return [
        action for action in build_parser(name)._actions if action.option_strings[1:2] != ["--help"]
    ]


def _one(rng: np.random.Generator, values: Sequence[str]) -> str:
    return values[int(rng.integers(len(values)))]


def _value(rng: np.random.Generator) -> str:
    return _one(rng, (LIKELY, NUMBERS, WORDS)[rng.choice(3, p=(0.4, 0.35, 0.25))])


def _flag(rng: np.random.Generator, line: Line) -> argparse.Action:
    known = [action for action in _flags(line.name) if action.option_strings]
    known = known or build_parser(line.name)._actions[:1]  # a command may have --help alone
    return known[int(rng.integers(len(known)))]


def _without(line: Line, flag: str) -> None:
    """Take a flag and its value out of a line."""
    if flag in line.words:
        place = line.words.index(flag)
        del line.words[place : place + 2]


def _other_value(rng: np.random.Generator, line: Line) -> None:
    """A flag with another value, in one word or in two."""
    action = _flag(rng, line)
    flag, value = action.option_strings[-1], _value(rng)
    if action.nargs == 0:
        line.words.append(flag if rng.random() < 0.8 else f"{flag}={value}")
        return
    if action.choices and rng.random() < 0.7:
        value = _one(rng, list(action.choices))
    _without(line, flag)
    line.words += [f"{flag}={value}"] if rng.random() < 0.6 else [flag, value]


def _likely(rng: np.random.Generator, line: Line) -> None:
    """One or two flags with numbers that somebody may mean."""
    known = [action for action in _flags(line.name) if action.metavar in ("X", "N", "S", "T")]
    for _ in range(int(rng.integers(1, 3)) if known else 0):
        flag = known[int(rng.integers(len(known)))].option_strings[-1]
        _without(line, flag)
        line.words += [flag, _one(rng, LIKELY)]


def _cut(rng: np.random.Generator, line: Line) -> None:
    """A line that ends early, or with a flag that lacks its value."""
    if rng.random() < 0.5:
        line.words.append(_flag(rng, line).option_strings[-1])
    else:
        del line.words[int(rng.integers(0, len(line.words) + 1)) :]


def _misspelt(rng: np.random.Generator, line: Line) -> None:
    """A flag that there is not."""
    flag = _flag(rng, line).option_strings[-1]
    place = int(rng.integers(2, len(flag)))
    wrong = (flag[:place], flag[:place] + flag[place + 1 :], flag.upper(), "-" + flag, flag + "s")
    line.words.append(f"{_one(rng, wrong)}={_value(rng)}")


def _extra(rng: np.random.Generator, line: Line) -> None:
    """A word too many, somewhere."""
    line.words.insert(int(rng.integers(0, len(line.words) + 1)), _value(rng))


def _twice(rng: np.random.Generator, line: Line) -> None:
    """A flag that stands there twice."""
    flag = _flag(rng, line).option_strings[-1]
    line.words += [flag, _value(rng), flag, _value(rng)]


def _file(rng: np.random.Generator, line: Line) -> None:
    """Another file in the place of one, or as a further word."""
    places = [k for k, word in enumerate(line.words) if word.isupper() and word.isalpha()]
    other = _one(rng, FILES)
    taken = [f for a in _flags(line.name) for f in a.option_strings if a.metavar in ("FILE", "DIR")]
    if places and rng.random() < 0.6:
        line.words[places[int(rng.integers(len(places)))]] = other
    elif taken and rng.random() < 0.6:
        line.words += [_one(rng, taken), other]
    else:
        line.words.append(other)
    if other in ("STUDY", "DRIVE") and KINDS[line.name].study:
        line.files[other] = _text(rng, KINDS[line.name] if other == "STUDY" else DRIVE)


DRIVE = Kind((), "drum_radius = 0.05\n", study=("=studies.drive.schema:Drive",))


def _state(rng: np.random.Generator, line: Line, kind: Kind) -> None:
    """A study of its own file, with few flags on top."""
    line.files["SWEEP" if line.name == "sweep" else "STUDY"] = _text(rng, kind)
    if line.name == "flex":
        line.words = []
    if line.name != "sweep" and "STUDY" not in line.words:
        line.words.insert(1 if line.name == "check" else 0, "STUDY")


def _keys(study: str) -> list[str]:
    """All keys of a class of a configuration."""
    table, _, place = study.partition("=")
    module, name = place.split(":")
    kind = getattr(importlib.import_module(module), name)
    return [line.key for line in key_lines(kind, f"{table}." if table else "")]


def _text(rng: np.random.Generator, kind: Kind) -> bytes:
    """A file of a study with some keys spoilt, or the file itself."""
    keys = [key for study in kind.study for key in _keys(study)]
    lines = kind.text.splitlines()
    stated = {line.split(" =")[0] for line in lines}
    for _ in range(int(rng.integers(0, 3))):
        key = _one(rng, [key for key in keys if key not in stated] or ["x"])
        if rng.random() < 0.2:
            key = _one(rng, (key[:-1] or "y", key + ".x", "x", '"a b"', key.upper(), "a" * 300))
        lines.insert(0, f"{key} = {_one(rng, TOML)}")
        stated.add(key)
    if lines and rng.random() < 0.3:  # a value of the cheap study, too
        place = int(rng.integers(len(lines)))
        lines[place] = f"{lines[place].split(' =')[0]} = {_one(rng, TOML)}"
    data = ("\n".join(lines) + "\n").encode()
    if rng.random() < 0.2:
        data = damage.OF_TEXT[int(rng.integers(len(damage.OF_TEXT)))](data, rng)
    return data
