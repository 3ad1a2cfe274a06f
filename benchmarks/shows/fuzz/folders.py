"""The show "damaged-folders": results folders with damage are answered in a sentence.

The folders are made once, by coarse studies. Each case copies one, damages one of its files, and
gives it to one of the commands that read it, in this process, whose memory is measured.
"""

from __future__ import annotations

import contextlib
import io
import resource
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shows.fuzz import damage
from benchmarks.shows.fuzz.said import faults_of
from benchmarks.shows.show import Columns, Question, Row, listed
from benchmarks.shows.truss_random import run_command
from studies.cli import main
from studies.common.console import Table

LINE = "damaged results folders: each is answered in a sentence, within 500 MB"
LIMIT = 200.0  # [s]
MOST_MEMORY = 500.0  # [MB]

SWEEP = """coarse = true
[base]
minimise = "energy"
solver = { intervals = 8, starts = ["straight"], seconds = 60 }
[parameters]
duration = [4.0, 5.0]
"""
COARSE = ("--intervals", "8", "--starts", "straight", "--seconds", "60", "--no-figures")
TRUSS = ("truss", "--objective", "peak-acceleration", "--duration", "5", *COARSE)
# the folders by name, each with the words that make it in place of DIR
MADE: Mapping[str, Sequence[str]] = {
    "truss": (*TRUSS, "--results", "DIR"),
    "sweep": ("sweep", "SWEEP", "--workers", "1", "--no-figures", "--results", "DIR"),
    "check": ("check", "PROFILE", "--no-optimum", "--no-figures", "--results", "DIR"),
}

# what reads a folder: all of them, and those of one kind
REPORTS: Sequence[Sequence[str]] = (
    ("report", "DIR", "--to", "OUT"),
    ("report", "DIR", "--to", "OUT", "--no-page", "--figures", "svg"),
    ("report", "DIR", "--to", "OUT", "--partial"),
    ("report", "DIR", "WHOLE", "--to", "OUT"),
    ("export", "DIR", "--to", "csv"),
    ("export", "DIR", "--to", "pvt"),
)
READ_BY: Mapping[str, Sequence[Sequence[str]]] = {
    "truss": (*REPORTS, ("export", "DIR", "--to", "c99"), ("export", "DIR", "--to", "json")),
    "sweep": REPORTS,
    "check": REPORTS,
}
# what goes on with a folder, and the files that it reads
GOES_ON: Mapping[str, Sequence[str]] = {
    "truss": ("truss", "--resume", "DIR", "--no-figures"),
    "sweep": ("sweep", "SWEEP", "--workers", "1", "--no-figures", "--results", "DIR"),
}
READ_FILES = ("result.json", "arrays.npz")
RESUMED_FILES = ("result.json", "input.toml", "starts/*", "cases/*/*", "provenance.json")
RESUMED = 0.25  # share of the cases


def question(seed: int, index: int) -> Question:
    """Draw a folder, what damages it, and what reads it."""
    rng = np.random.default_rng([seed, index])
    resumed = bool(rng.random() < RESUMED)
    kind = str(rng.choice([*GOES_ON] if resumed else [*MADE]))
    readers = READ_BY[kind]
    words = GOES_ON[kind] if resumed else readers[int(rng.integers(len(readers)))]
    files = RESUMED_FILES if resumed else READ_FILES
    drawn = int(rng.integers(2**31))  # of the damage
    return {
        "kind": kind,
        "words": list(words),
        "file": str(rng.choice(list(files))),
        "drawn": drawn,
    }


def answer(question: Question, folder: Path) -> Row:
    """Damage a copy, and read it."""
    made = _made(folder.parent)
    kind = question["kind"]
    copy = folder / kind
    shutil.copytree(made / kind, copy, dirs_exist_ok=True)
    what = _damage(copy, question["file"], np.random.default_rng(question["drawn"]))

    places = {
        "DIR": copy,
        "OUT": folder / "out",
        "WHOLE": made / kind,
        "SWEEP": made / "sweep.toml",
    }
    words = [str(places.get(word, word)) for word in question["words"]]
    before = _peak_memory()
    out, said = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(said):
        code = main(words)
    memory = _peak_memory()
    shutil.rmtree(copy)
    faults = faults_of(code, said.getvalue())
    if memory > MOST_MEMORY:
        faults.append(f"{memory:.0f} MB, {before:.0f} before")
    return {
        "damage": what,
        "code": code,
        "said": said.getvalue()[-600:],
        "memory": memory,
        "faults": faults,
    }


def _made(cases: Path) -> Path:
    """The folders before any damage, made if need be."""
    place = cases.parent / "made"
    place.mkdir(exist_ok=True)
    (place / "sweep.toml").write_text(SWEEP)
    for kind, words in MADE.items():
        if (place / kind).exists():
            continue
        draft = place / f"{kind}.draft"
        shutil.rmtree(draft, ignore_errors=True)
        known = {
            "DIR": draft,
            "SWEEP": place / "sweep.toml",
            "PROFILE": place / "truss" / "profile.csv",
        }
        command = [str(known.get(word, word)) for word in words]
        code, said = run_command(command, place / f"{kind}.txt")
        if code:
            raise RuntimeError(f"{kind} was not made: {said[-300:]}")
        draft.rename(place / kind)
    return place


def _damage(folder: Path, pattern: str, rng: np.random.Generator) -> str:
    """Damage one file of a pattern, or take it away; what was done, in words."""
    files = sorted(path for path in folder.glob(pattern) if path.is_file())
    if not files:  # a folder of another kind has none
        files = [folder / "result.json"]
    path = files[int(rng.integers(len(files)))]
    name = path.relative_to(folder)
    if rng.random() < 0.05:
        path.unlink()
        if rng.random() < 0.5:
            path.mkdir()
            return f"{name} is a folder"
        return f"{name} is missing"

    kinds = {
        ".npz": damage.OF_ARRAYS,
        ".ocp": damage.OF_SOLUTIONS,
        ".json": damage.OF_JSON,
        ".jsonl": damage.OF_JSON,
    }
    ways = kinds.get(path.suffix, damage.OF_TEXT)
    way = ways[int(rng.integers(len(ways)))]
    path.write_bytes(way(path.read_bytes(), rng))
    return f"{name} {way.__name__}"


def _peak_memory() -> float:
    """Of this process until now [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def tables(rows: Sequence[Row]) -> list[Table]:
    """Return each case in a row, and how many ended how."""
    columns: Columns = {
        "case": "index",
        "damage": lambda row: f"{row['kind']}: {row.get('damage', row['file'])}",
        "read by": lambda row: " ".join(row["words"]),
        "code": "code",
        "MB": lambda row: f"{row['memory']:.0f}",
        "faults": lambda row: row["failure"] or "; ".join(row["faults"]),
    }
    total: dict[str, Any] = {
        "folders": len(rows),
        "without a fault": sum(not (row["failure"] or row["faults"]) for row in rows),
        "refused in a sentence": sum(row.get("code", 0) != 0 for row in rows),
        "largest peak memory [MB]": f"{max(row.get('memory', 0.0) for row in rows):.0f}",
    }
    totals = Table("In total", ("", ""), [(name, str(value)) for name, value in total.items()])
    return [listed("Damaged folders", rows, columns), totals]
