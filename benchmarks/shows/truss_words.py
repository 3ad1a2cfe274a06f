"""The show "truss-words": force problems, whose words must be those of the phase plane.

Ten problems without a cap on jerk, some of them with light caps. The phase plane knows the least
force without such caps, and whether a motion attains it. So it knows what the command has to say.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from benchmarks.shows.show import Question, Row
from benchmarks.shows.truss_random import read_output, run_command
from studies.cli import parse
from studies.common.console import Console, Table, number
from studies.common.exit_codes import ExitCode
from studies.truss.command import read_study
from studies.truss.limits.bounds import keeps_the_caps
from studies.truss.motions.phase_plane import PhasePlane
from studies.truss.search.verdict import AT_LIMIT, BOUND_MET

LINE = "ten force problems of the truss: what the command says beside the phase plane"
LIMIT = 900.0  # [s]

# Without caps at durations that are attained and that are not, then with caps that cannot act, caps
# that act on the phase plane's motion only, and caps that act.
PROBLEMS: tuple[tuple[str, ...], ...] = (
    ("--duration", "3"),
    ("--duration", "4", "--friction", "0.01"),
    ("--duration", "6"),
    ("--duration", "20", "--friction", "0.01"),
    ("--duration", "6", "--speed-cap", "100"),
    ("--duration", "6", "--acceleration-cap", "1e5"),
    ("--duration", "3", "--speed-cap", "100", "--acceleration-cap", "1e5"),
    ("--duration", "6", "--acceleration-cap", "200"),
    ("--duration", "4", "--friction", "0.01", "--speed-cap", "3"),
    ("--duration", "6", "--force-cap", "30"),
)


def question(seed: int, index: int) -> Question:
    """Return a problem; there are ten, and the seed changes nothing."""
    flags = PROBLEMS[index % len(PROBLEMS)]
    return {"command": ["truss", "--objective", "peak-force", *flags]}


def answer(question: Question, folder: Path) -> Row:
    """Run the command, and ask the phase plane."""
    command = list(question["command"])
    study = read_study(parse(command)[0], Console())
    least = PhasePlane(study.truss).least_force(study.duration[1])
    cannot_act = keeps_the_caps(study, least.motion)

    words = [*command, "--no-figures", "--results", str(folder / "study")]
    code, printed = run_command(words, folder / "printed.txt")
    said = read_output(printed)
    row = {
        "code": code,
        "value": said["value"],
        "words": said["verdict"] or said["complaint"],
        "bound": least.force,
        "attained": least.attained,
        "cannot_act": cannot_act,
    }
    return {**row, "agrees": agrees(row)}


def agrees(row: Row) -> bool:
    """Whether code and words are those of the phase plane."""
    code, value, words, bound = row["code"], row["value"], row["words"], row["bound"]
    none_is_best = code == ExitCode.INFEASIBLE and words.startswith("no motion is best")
    if row["cannot_act"] and not row["attained"]:
        return bool(none_is_best)
    if value is None or value < bound * (1 - BOUND_MET):
        return False
    if row["cannot_act"] or (row["attained"] and value <= bound * (1 + BOUND_MET)):
        return bool(code == ExitCode.OK and words.startswith("global"))
    if value <= bound * (1 + AT_LIMIT):
        return bool(none_is_best)
    return code == ExitCode.OK  # the caps cost something: nothing is known of the optimum


def tables(rows: Sequence[Row]) -> list[Table]:
    """Return each problem in a row."""
    head = ("problem", "code", "value [N]", "phase plane [N]", "attained", "agrees", "words")
    cells = [
        (" ".join(row["command"][3:]), "-", "-", "-", "-", "no", row["failure"])
        if row["failure"]
        else (
            " ".join(row["command"][3:]),
            str(row["code"]),
            number(row["value"], 7),
            number(row["bound"], 7),
            "yes" if row["attained"] else "no",
            "yes" if row["agrees"] else "NO",
            row["words"][:70],
        )
        for row in rows
    ]
    return [Table("What is said of force problems", head, cells)]
