"""Tables that are generated from the code: parameters, keys of studies, flags, exit codes."""

import argparse
import dataclasses
import functools
import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.errors import ExtensionError

from models.arm.parameters import ArmParameters
from models.truss import JointMasses, TrussParameters
from studies import registry
from studies.arm.command import ARM
from studies.arm.config import ArmDescription, SequenceStudy, StageStudy
from studies.cli import PROGRAM, build_parser
from studies.codesign import DesignSpace
from studies.common.exit_codes import ExitCode
from studies.common.keys import UNIT, field_texts, key_lines
from studies.drive import Drive
from studies.flex.config import FlexStudy, JointCase, LinkCase, MaterialCase, SweepCase
from studies.flex.expressions import FUNCTIONS, NAMES
from studies.margin import MarginRequirements
from studies.mission import MissionStudy
from studies.paper import PaperStudy
from studies.paper.cases import Cases
from studies.paper.entries import Entry, PaperVerdict
from studies.paper.listing import HEAD as ROW_HEAD
from studies.paper.listing import assumption_rows, cells, difference_rows
from studies.paper.study import entries_of
from studies.pareto.config import TradeOff
from studies.robust import Uncertainty
from studies.sweep import SweepStudy
from studies.truss import TrussStudy
from studies.truss.limits.tolerances import PLAUSIBLE, VERIFICATION
from studies.turn import TurnStudy


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines) + "\n"


def parameter_table(kind: type) -> str:
    """Name, meaning, unit and default of each field of a dataclass, from code and docstring."""
    meanings = field_texts(kind)
    rows = []
    for field in dataclasses.fields(kind):
        if field.name not in meanings:
            raise ExtensionError(f"the docstring of {kind.__name__} says nothing of {field.name}")
        text = meanings[field.name]
        units = UNIT.findall(text)
        meaning = UNIT.sub("", text, count=1).strip(" .,")
        rows.append((f"`{field.name}`", meaning, units[0] if units else "-", _default(field)))
    return table(("parameter", "meaning", "unit", "default"), rows)


def _default(field: Any) -> str:
    """The default as a reader would type it; angles in degrees too."""
    if field.default_factory is not dataclasses.MISSING:
        return f"`{type(field.default_factory()).__name__}()`"
    value = field.default
    if value is dataclasses.MISSING:
        return "must be given"
    if isinstance(value, float) and field.name.endswith("angle"):
        return f"{value:.6g} ({math.degrees(value):g} deg)"
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return f"{value:.6g}"
    if isinstance(value, str):
        return f'`"{value}"`'
    return _link(value) if dataclasses.is_dataclass(value) else f"`{value}`"


def _link(value: Any) -> str:
    """A link of the arm by its length and mass."""
    return f"length {value.length:g} m, {value.linear_density:.4g} kg/m"


def exit_code_table() -> str:
    """All exit codes of the command."""
    return table(("code", "meaning"), ((str(code.value), code.meaning) for code in ExitCode))


def key_table(kind: type) -> str:
    """All keys of a study's TOML file."""
    rows = [
        (f"`{line.key}`", line.meaning, line.unit or "-", f"`{line.default}`")
        for line in key_lines(kind)
    ]
    return table(("key", "meaning", "unit", "default"), rows)


def arm_keys() -> str:
    """The keys of all questions to the arm, each where it is first known."""
    shared = {line.key for line in key_lines(StageStudy)}
    parts = ["### The arm, `[arm]`", key_table(ArmDescription)]
    parts += ["### The stage: all but the sequence", _rows_of(StageStudy, {"arm"})]
    for study in registry.studies():
        if study.mechanism is not ARM:
            continue
        kind = study.tables()[""]
        taken = {"arm"} if kind is SequenceStudy else shared
        known = _rows_of(kind, taken) or "The stage and the arm are all that it takes.\n"
        parts += [f"### `{PROGRAM} {study.name}`", known]
    return "\n\n".join(parts)


def _rows_of(kind: type, taken: set[str]) -> str:
    """The keys of a configuration that are in none of the tables before."""
    rows = [
        (f"`{line.key}`", _markdown(line.meaning), line.unit or "-", f"`{line.default}`")
        for line in key_lines(kind)
        if line.key not in taken and line.key.split(".")[0] not in taken
    ]
    return table(("key", "meaning", "unit", "default"), rows) if rows else ""


def commands() -> str:
    """Every sub-command with its arguments."""
    parts = []
    for name in registry.COMMANDS:
        command = registry.command(name)
        rows = [
            _argument(action) for action in build_parser(name)._actions if action.dest != "help"
        ]
        parts.append(
            f"### `{PROGRAM} {name}`\n\n{_markdown(command.description)}\n\n"
            + table(("argument", "meaning"), rows)
        )
    return "\n".join(parts)


def _argument(action: argparse.Action) -> tuple[str, str]:
    """How an argument is written, and what it means."""
    takes = action.metavar or (
        "{" + ",".join(map(str, action.choices)) + "}" if action.choices else ""
    )
    if not takes and action.nargs != 0 and action.option_strings:
        takes = action.dest.upper()
    written = ", ".join(action.option_strings) or action.dest
    written = f"{written} {takes}" if action.option_strings else str(takes or action.dest)
    return f"`{written.strip()}`", _markdown((action.help or "").replace("%%", "%"))


def _markdown(text: str) -> str:
    """Plain text in Markdown: what looks like a mark is none, and flags are code."""
    escaped = re.sub(r"([|*_<>^\[\]$])", r"\\\1", text)
    return re.sub(r"(?<!`)(--[a-z-]+)", r"`\1`", escaped)


def flex_keys() -> str:
    """The keys of a case of flexible links, table by table."""
    parts = [_rows_of(FlexStudy, {"link", "joint", "material", "sweep"})]
    for title, kind in (
        ("A link, `[[link]]`", LinkCase),
        ("A joint, `[[joint]]`", JointCase),
        ("A material, `[material.NAME]`", MaterialCase),
        ("A sweep, `[sweep]`", SweepCase),
    ):
        parts += [f"### {title}", key_table(kind)]
    return "\n\n".join(parts)


def law_words() -> str:
    """What an expression may use."""
    functions = ", ".join(f"`{name}`" for name in FUNCTIONS)
    return f"Names: {', '.join(f'`{name}`' for name in NAMES)}. Functions: {functions}.\n"


@functools.lru_cache(maxsize=1)
def _paper_entries() -> list[Entry]:
    """Every row of the comparison with the paper, which takes half a minute."""
    return entries_of(Cases(PaperStudy()))


def paper_differences(verdict: PaperVerdict) -> str:
    """The rows of a verdict, with what it rests on."""
    head = ("place", "what", "printed", "ours", "why")
    return table(head, map(_cells, difference_rows(_paper_entries(), verdict)))


def paper_assumptions() -> str:
    """What the paper leaves open, and what this project takes."""
    head = ("place", "what", "ours", "why")
    return table(head, map(_cells, assumption_rows(_paper_entries())))


def paper_rows() -> str:
    """Every row of the comparison."""
    return table(ROW_HEAD, (_cells(cells(entry)) for entry in _paper_entries()))


def _cells(texts: Iterable[str]) -> tuple[str, ...]:
    return tuple(map(_markdown, texts))


def truss_limits() -> str:
    """What passes a check of the truss, and why."""
    rows = [
        (what, f"{limit.value:g} {limit.unit}", _markdown(limit.reason))
        for what, limit in VERIFICATION.items()
    ]
    return table(("what is checked", "at most", "why"), rows)


def truss_ranges() -> str:
    """What numbers a study of the truss takes, and why."""
    rows = [
        (f"`{key}`", f"{r.low:g} to {r.high:g} {r.unit}".strip(), _markdown(r.reason))
        for key, r in PLAUSIBLE.items()
    ]
    return table(("key", "from, to", "why"), rows)


GENERATED = {
    "truss_parameters": lambda: parameter_table(TrussParameters),
    "joint_masses": lambda: parameter_table(JointMasses),
    "arm_parameters": lambda: parameter_table(ArmParameters),
    "truss_keys": lambda: key_table(TrussStudy),
    "pareto_keys": lambda: key_table(TradeOff),
    "arm_keys": arm_keys,
    "mission_keys": lambda: _rows_of(MissionStudy, {"arm", "truss"}),
    "turn_keys": lambda: _rows_of(TurnStudy, {"arm", "truss"}),
    "robust_keys": lambda: key_table(Uncertainty),
    "design_keys": lambda: key_table(DesignSpace),
    "flex_keys": flex_keys,
    "sweep_keys": lambda: key_table(SweepStudy),
    "law_words": law_words,
    "paper_keys": lambda: key_table(PaperStudy),
    "paper_errata": lambda: paper_differences(PaperVerdict.MISPRINT),
    "paper_not_shared": lambda: paper_differences(PaperVerdict.NOT_SHARED),
    "paper_assumptions": paper_assumptions,
    "paper_rows": paper_rows,
    "truss_limits": truss_limits,
    "truss_ranges": truss_ranges,
    "drive_keys": lambda: key_table(Drive),
    "margin_keys": lambda: key_table(MarginRequirements),
    "commands": commands,
    "exit_codes": exit_code_table,
}


def _build(app: Sphinx) -> None:
    folder = Path(app.srcdir) / "generated" / "tables"
    folder.mkdir(parents=True, exist_ok=True)
    for name, make in GENERATED.items():
        (folder / f"{name}.md").write_text(make(), "utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the tables before Sphinx reads the pages that include them."""
    app.connect("builder-inited", _build)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
