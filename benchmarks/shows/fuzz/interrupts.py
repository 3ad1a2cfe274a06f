"""The show "interrupts": each sub-command, stopped by Ctrl-C at several moments, answers soon.

A case starts one command in a process group of its own, as a terminal does, and sends SIGINT to the
group when its processes have used so many seconds of processor time. The seconds until the end are
wall time and processor time. The smaller one is held against the limit: a loaded machine stretches
wall time, and processes that work side by side add up their processor time. It is read from Linux's
/proc.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks.processes import THREADS
from benchmarks.records import ROOT
from benchmarks.shows.fuzz.commands import made_folder
from benchmarks.shows.fuzz.said import MARK, faults_of
from benchmarks.shows.show import Columns, Question, Row, listed
from studies.common.console import Table
from studies.common.exit_codes import ExitCode
from studies.registry import COMMANDS

LINE = "each sub-command stopped by Ctrl-C at several moments, with the seconds until it has ended"
LIMIT = 900.0  # [s]
SOON = 2.0  # [s] from Ctrl-C to the end
MOMENTS = (1.0, 3.0, 6.0, 12.0, 20.0)  # [s] of processor time
LOOK = 0.01  # [s] between two looks at the processes
KILLED = 10.0  # [s] of processor time after which a command that does not answer is killed

STUDY = """duration = 140
[caps]
jerk = "bezier"
[truss]
pulley_friction = 0.01
[robust]
draws = 10000
[robust.scenarios.rough]
pulley_friction = 0.015
joint_friction = 0.15
[robust.scatter.pulley_friction]
low = 0.005
high = 0.015
"""
SWEEP = """base.minimise = "energy"
parameters.duration = [4.0, 5.0, 6.0, 7.0]
"""
FRONT = ("--objectives", "time,peak-acceleration", "--duration", "4..6")
# the ordinary form of each; capital words stand for files
WORDS: Mapping[str, Sequence[str]] = {
    "truss": ("--objective", "peak-force", "--duration", "60"),
    "codesign": ("--objective", "peak-force", "--duration", "140", "--jerk-cap", "bezier"),
    "robust truss": ("STUDY",),
    "pareto truss": (*FRONT, "--rope-acceleration-cap", "2"),
    "flex": ("--preset", "double-pendulum"),
    "check": ("PROFILE",),
    "sweep": ("SWEEP",),
    "keys": ("truss",),
    "completion": ("bash",),
    "report": ("RESULTS", "--to", "OUT"),
    "export": ("RESULTS", "--to", "pvt", "--output", "NEW"),
}
TO_FOLDER = set(COMMANDS) - {"report", "export", "keys", "completion"}


def question(seed: int, index: int) -> Question:
    """The command and the moment of a case; the seed changes nothing."""
    names = list(COMMANDS)
    name = names[index % len(names)]
    return {"name": name, "at": MOMENTS[index // len(names) % len(MOMENTS)]}


def answer(question: Question, folder: Path) -> Row:
    """Start the command, stop it, and look at how it ends."""
    made = made_folder(folder.parent)
    files = {"STUDY": folder / "study.toml", "SWEEP": folder / "sweep.toml"}
    files["STUDY"].write_text(STUDY)
    files["SWEEP"].write_text(SWEEP)
    places = {**files, "RESULTS": made, "PROFILE": made / "profile.csv"}
    name = question["name"]
    words = [*name.split(), *(str(places.get(word, word)) for word in WORDS.get(name, ()))]
    if name in TO_FOLDER:
        words += ["--results", "kept"]
    with (folder / "said.txt").open("w+", encoding="utf-8") as said:
        row = ended_at(words, question["at"], folder, said.fileno())
        said.seek(0)
        text = said.read()

    faults = faults_of(row["code"], text)
    if (late := min(row["processor"], row["wall"])) > SOON:
        faults.append(f"{late:.1f} s until it ended")
    if row["stopped"] and row["code"] not in (ExitCode.INTERRUPTED, ExitCode.OK):
        faults.append(f"exit code {row['code']}")
    messages = [line.removeprefix(MARK) for line in text.splitlines() if line.startswith(MARK)]
    written = sorted(path.name for path in (folder / "kept").glob("*"))
    return {**row, "said": messages[-1:], "kept": written, "faults": faults}


def ended_at(
    words: Sequence[str], at: float, folder: Path, said: int, number: int = signal.SIGINT
) -> Row:
    """The exit code of a command that gets a signal at a moment, and the times until its end [s].

    Parameters
    ----------
    at : of processor time [s].
    folder : in which it works.
    said : number of the open file for what it says.
    number : of the signal. Ctrl-C is for its whole group, as of a terminal; another one for itself.
    """
    # what a shell runs in its background ignores Ctrl-C, and so would all that it starts
    signal.signal(signal.SIGINT, signal.default_int_handler)
    process = subprocess.Popen(
        [sys.executable, "-m", "antenna_ocp", *words],
        cwd=folder,
        env={**os.environ, **dict.fromkeys(THREADS, "1"), "PYTHONPATH": str(ROOT)},
        stdin=subprocess.DEVNULL,
        stdout=said,
        stderr=said,
        process_group=0,
    )
    used = 0.0
    while process.poll() is None and used < at:
        used = max(used, processor_of(process.pid))
        time.sleep(LOOK)
    stopped, begun, wall = process.returncode is None, used, time.monotonic()
    if stopped:
        (os.killpg if number == signal.SIGINT else os.kill)(process.pid, number)
    while process.poll() is None:
        used = max(used, processor_of(process.pid))
        if used - begun > KILLED:
            os.killpg(process.pid, signal.SIGKILL)
        time.sleep(LOOK)
    wall = time.monotonic() - wall if stopped else 0.0
    times = {"wall": wall, "processor": used - begun, "in all": used}
    return {"code": process.returncode, "stopped": stopped, **times}


def processor_of(process: int) -> float:
    """Processor time of a process and of those that it has started [s]; 0 if it has ended."""
    place = Path(f"/proc/{process}")
    try:
        fields = (place / "stat").read_text().rpartition(")")[2].split()
        # a child is listed under the thread that has started it
        listed = [task.read_text() for task in place.glob("task/*/children")]
    except OSError:
        return 0.0
    own = sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")
    return own + sum(processor_of(int(child)) for child in " ".join(listed).split())


def tables(rows: Sequence[Row]) -> list[Table]:
    """Return each case in a row, and the longest times."""
    columns: Columns = {
        "command": "name",
        "at [s]": lambda row: f"{row['at']:g}",
        "code": "code",
        "wall [s]": lambda row: f"{row['wall']:.1f}" if row["stopped"] else "-",
        "processor [s]": lambda row: f"{row['processor']:.1f}" if row["stopped"] else "-",
        "kept": lambda row: f"{len(row['kept'])} files",
        "said": lambda row: (row["said"] or ["-"])[0],
        "faults": lambda row: row["failure"] or "; ".join(row["faults"]),
    }
    sent = [row for row in rows if row.get("stopped")]
    total = {
        "stopped": len(sent),
        "ended before": len(rows) - len(sent),
        "with a fault": sum(bool(row["failure"] or row["faults"]) for row in rows),
        "longest until the end [s of processor time]": f"{_most(sent, 'processor'):.1f}",
        "longest until the end [s of wall time]": f"{_most(sent, 'wall'):.1f}",
    }
    totals = Table("In total", ("", ""), [(name, str(value)) for name, value in total.items()])
    return [listed("Stopped by Ctrl-C", rows, columns), totals]


def _most(rows: Sequence[Row], name: str) -> float:
    return max((row[name] for row in rows), default=0.0)
