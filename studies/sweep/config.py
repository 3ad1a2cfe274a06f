"""What the user asks of a sweep: a study, the keys that vary, and how their values are chosen."""

from __future__ import annotations

import dataclasses
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from studies.common.configuration import (
    as_stated,
    boolean,
    check,
    check_keys,
    choice,
    describes,
    finite,
    from_mapping,
    key,
    optional_key,
    read_toml,
    table,
    whole,
)
from studies.common.exit_codes import StudyError, quoted
from studies.sweep.subjects import subject as swept_study
from studies.sweep.subjects import with_files

SAMPLINGS = ("grid", "list", "one-at-a-time", "latin-hypercube", "sobol", "sobol-indices")
RANDOM = (
    "latin-hypercube",
    "sobol",
    "sobol-indices",
)  # they draw points between ends
SCALES = ("linear", "log")
MOST_CASES = 1_000_000


@dataclass(frozen=True)
class Axis:
    """A key that varies.

    Attributes
    ----------
    key : with dots, such as "truss.pulley_friction".
    values : that it takes, in order; empty where it is drawn between two ends.
    low, high : these ends; nan where there are values.
    scale : of what lies between them, "linear" or "log".
    """

    key: str
    values: tuple[Any, ...] = ()
    low: float = float("nan")
    high: float = float("nan")
    scale: str = "linear"

    def stated(self) -> Any:
        """What TOML states of it."""
        if self.values:
            return list(self.values)
        return {"low": self.low, "high": self.high, "scale": self.scale}

    def place(self) -> tuple[str, ...]:
        """The names of the tables above the key, and its own."""
        return tuple(self.key.split("."))


def _axes(name: str, value: Any) -> tuple[Axis, ...]:
    """A table of keys; those of a table inside it are written with dots or as a table."""
    if isinstance(value, tuple):
        return value
    axes = tuple(_axes_in(name, table(name, value), ""))
    if not axes:
        raise StudyError(
            f"{name} is empty, so there is nothing to sweep; give a key and its values, as "
            '"truss.pulley_friction" = [0.0, 0.01]'
        )
    return axes


def _axes_in(name: str, content: Mapping[str, Any], above: str) -> Iterator[Axis]:
    for word, value in content.items():
        full = f"{above}{word}"
        if "" in full.split("."):
            raise StudyError(
                f"{name} has the key {quoted(full)}, a part of which is empty; name it"
            )
        if isinstance(value, Mapping) and not {"low", "high"} & value.keys():
            yield from _axes_in(name, value, f"{full}.")
        elif isinstance(value, Mapping):
            yield _between(f"{name}.{full}", full, value)
        elif not isinstance(value, list | tuple):
            raise StudyError(
                f"{name}.{full} is {quoted(value)}; give a list of values, or low and high: "
                "{ low = 1.0, high = 2.0, count = 5 }"
            )
        elif not value:
            raise StudyError(f"{name}.{full} is an empty list; give at least one value")
        else:
            yield Axis(full, tuple(value))


def _between(name: str, word: str, raw: Mapping[str, Any]) -> Axis:
    """Values between two ends: `count` of them, or all where they are drawn."""
    check_keys(raw, ("low", "high", "count", "scale"), f"{name}.")
    for end in ("low", "high"):
        if end not in raw:
            raise StudyError(f"{name} has no {end}; give low and high")
    low, high = finite(f"{name}.low", raw["low"]), finite(f"{name}.high", raw["high"])
    scale = choice(SCALES)(f"{name}.scale", raw.get("scale", "linear"))
    if low >= high:
        raise StudyError(f"{name} runs from {low:g} to {high:g}; give the lower end first")
    if scale == "log" and low <= 0.0:
        raise StudyError(f"{name}.low is {low:g}; a logarithmic scale needs positive ends")
    if "count" not in raw:
        return Axis(word, (), low, high, scale)

    count = whole(2, MOST_CASES)(f"{name}.count", raw["count"])
    shares = [number / (count - 1) for number in range(count)]
    if scale == "log":
        values = [low ** (1 - share) * high**share for share in shares]
    else:
        values = [low + (high - low) * share for share in shares]
    # the ends as given, without rounding
    return Axis(word, (low, *values[1:-1], high))


@describes({"type": "string"})
def _subject(name: str, value: Any) -> str:
    """The words of a command whose study can be swept."""
    return swept_study(value)[0].name


@describes({"type": "array", "items": {"type": "string"}})
def _words(name: str, value: Any) -> tuple[str, ...]:
    if isinstance(value, str) or not isinstance(value, list | tuple):
        raise StudyError(f'{name} is {quoted(value)}; give a list of quantities, as ["peak-force"]')
    return tuple(str(word) for word in value)


def _repeated(values: Sequence[Any]) -> list[Any]:
    """Values that are there twice; in one pass, as there may be a million."""
    seen: set[Any] = set()
    again = []
    for value in values:
        # a list or a table cannot be in a set, but its text can
        mark = value if isinstance(value, Hashable) else repr(value)
        if mark in seen:
            again.append(value)
        seen.add(mark)
    return again


@dataclass(frozen=True, kw_only=True)
class SweepStudy:
    """A sweep.

    Attributes
    ----------
    subject : what is swept, a command without its program.
    base : the study of that command, of which keys vary.
    parameters : the keys that vary.
    sampling, samples, seed : how their values are chosen.
    coarse : whether to use coarse meshes.
    warm : whether a case of a grid also starts from its neighbour's motion.
    show : quantities in the figures; the objectives if none is given.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """

    subject: str = key(_subject, "", "command of the study, such as arm solve", default="truss")
    base: Mapping[str, Any] = key(table, "", "the study whose keys vary; or give its file as study")
    parameters: Any = key(
        _axes,
        "",
        "keys that vary: each a list of values, or a table of low, high, count and scale",
    )
    sampling: str = key(
        choice(SAMPLINGS),
        "",
        f"how values are chosen: {', '.join(SAMPLINGS)}",
        default="grid",
    )
    samples: int | None = optional_key(
        whole(1, MOST_CASES),
        "",
        "cases to draw; sobol-indices draws (keys + 2) times as many",
    )
    seed: int = key(whole(0), "", "of the random values", default=0)
    coarse: bool = key(boolean, "", "whether to use coarse meshes", default=False)
    warm: bool = key(
        boolean,
        "",
        "whether a case of a grid also starts from its neighbour's motion (truss)",
        default=False,
    )
    show: tuple[str, ...] = key(
        _words, "", "quantities in the figures; the objectives by default", default=()
    )

    def __post_init__(self) -> None:
        check(self)
        drawn = self.sampling in RANDOM
        if drawn and self.samples is None:
            raise StudyError(
                f"sampling is {self.sampling!r}, but samples is missing; give a number"
            )
        if not drawn and self.samples is not None:
            raise StudyError(
                f"samples is {self.samples}, but a sampling of the kind {self.sampling!r} follows "
                f"from its values; remove samples, or choose one of {', '.join(RANDOM)}"
            )
        for axis in self.parameters:
            self._check_axis(axis, drawn)

        counts = {axis.key: len(axis.values) for axis in self.parameters}
        if self.sampling == "list" and len(set(counts.values())) > 1:
            lengths = ", ".join(f"{name} has {count}" for name, count in counts.items())
            raise StudyError(
                f"the lists of the sampling 'list' must have one length, but {lengths}"
            )
        if self.warm and (self.sampling != "grid" or not swept_study(self.subject)[1].warm):
            raise StudyError(
                f"warm is true, but only a grid of the truss has neighbours to start from, not a "
                f"sampling {self.sampling!r} of {self.subject!r}; remove warm"
            )

    def _check_axis(self, axis: Axis, drawn: bool) -> None:
        """Refuse an axis that does not fit the sampling."""
        name = f"parameters.{axis.key}"
        if drawn and axis.values:
            raise StudyError(
                f"{name} is a list, but {self.sampling} draws values between two ends; give "
                "{ low = ..., high = ... } without count"
            )
        if not drawn and not axis.values:
            raise StudyError(f"{name} has no count; give one, or a list of values")
        repeated = _repeated(axis.values)
        if self.sampling != "list" and repeated:
            raise StudyError(f"{name} contains {quoted(repeated[0])} twice; give each value once")

    @property
    def mode(self) -> str:
        """Coarse or full."""
        return "coarse" if self.coarse else "full"

    @property
    def question(self) -> str:
        """The question, in one line."""
        keys = ", ".join(axis.key for axis in self.parameters)
        return f"Sweep of {self.subject} over {keys} ({self.sampling}, {self.mode} meshes)"


def study_from(raw: Mapping[str, Any], folder: Path = Path()) -> SweepStudy:
    """The sweep that a nested dictionary states.

    Parameters
    ----------
    raw : mapping
        As TOML gives it.
    folder : path
        Where files that it names are.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    content = dict(raw)
    known = [field.name for field in dataclasses.fields(SweepStudy)]
    check_keys(content, ["study", *known])
    if "study" in content and "base" in content:
        raise StudyError("both study and [base] are given; give only one of them")
    study, _ = swept_study(content.get("subject", "truss"))
    if "study" in content:
        path = folder / str(content.pop("study"))
        content["base"] = with_files(study, read_toml(path), path.parent)
    else:
        content["base"] = with_files(study, content.get("base", {}), folder)
    if "parameters" not in content:
        raise StudyError(
            'no key varies; give a table [parameters], as "truss.pulley_friction" = [0.0, 0.01]'
        )
    return from_mapping(SweepStudy, content)


def as_dictionary(study: SweepStudy) -> dict[str, Any]:
    """The nested dictionary from which `study_from` makes the same sweep again."""
    return as_stated(study) | {
        "show": list(study.show),
        "parameters": {axis.key: axis.stated() for axis in study.parameters},
        "base": dict(study.base),
    }
