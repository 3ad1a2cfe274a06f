"""The one result of every study: what was asked, what came out, and how sure that is.

A result is stored as `result.json` beside `arrays.npz`. Neither can hold code: the arrays are read
with `allow_pickle=False`, so that a folder from somebody else is safe to load. The record states a
digest of both files, which tells later whether they were changed.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import json
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, cast, get_args

import numpy as np

from ocp.arrays import Array
from studies.common.comparison_table import Cost, TableRow, behind
from studies.common.exit_codes import ExitCode, StudyError, quoted
from studies.common.folder import OUR_MARK, PROGRAM, RESULT_FILE, plain
from studies.common.foreign_text import parsed_json
from studies.common.stored_arrays import stored_arrays

SCHEMA = 1  # raised when a field changes its meaning or disappears
ARRAYS_FILE = "arrays.npz"
DIGEST = "sha256"  # in the provenance: of all the rest of the record, and of the arrays
PARTS = ("arrays", "table", "verdict", "checks")  # what a study adds while it runs

VerdictKind = Literal[
    "global", "local", "unattained", "unverified", "infeasible", "measured", "none"
]


@dataclass(frozen=True, eq=False)
class Series:
    """One array of a result.

    Attributes
    ----------
    unit : SI unit, "1" where it has none.
    axis : name of the series along which it runs; that of the series itself for an axis.
    values : shape (m,).
    meaning : what it is, in words.
    """

    unit: str
    axis: str
    values: Array
    meaning: str = ""

    def __post_init__(self) -> None:
        values = np.array(self.values, dtype=float)  # a copy: the caller may go on changing his
        if values.ndim != 1:
            raise ValueError(f"a series has one dimension, not the shape {values.shape}")
        values.setflags(write=False)
        object.__setattr__(self, "values", values)


@dataclass(frozen=True)
class Verdict:
    """How sure the result is: the kind for programs, the sentence for people."""

    kind: VerdictKind
    sentence: str

    def __post_init__(self) -> None:
        if self.kind not in get_args(VerdictKind):
            known = ", ".join(get_args(VerdictKind))
            raise ValueError(f"the verdict is {self.kind!r}; choose one of {known}")


def outcome(passed: bool, decided: bool = True) -> str:
    """How the sentence of a criterion begins; what failed is to catch the eye."""
    if not passed:
        return "FAILED"
    return "passed" if decided else "not decided"


@dataclass(frozen=True)
class Criterion:
    """Something that a result has to meet.

    Attributes
    ----------
    name, unit : what was checked.
    value, limit : found, and the most (of a tension: the least) that passes; nan where the check
        has no number.
    passed : whether it is met; what is not decided does not fail.
    sentence : in words; made from the others where it is not given.
    decided : whether all that the value may be, as by noise, passes or fails alike.
    """

    name: str
    unit: str
    value: float
    limit: float
    passed: bool
    sentence: str = ""
    decided: bool = True

    def __post_init__(self) -> None:
        if not self.sentence:
            numbers = f"{self.value:.9g}{behind(self.unit)} (limit {self.limit:.9g})"
            sentence = f"{outcome(self.passed, self.decided)}: {self.name} {numbers}"
            object.__setattr__(self, "sentence", sentence)


def at_most(name: str, unit: str, value: float, limit: float) -> Criterion:
    """The criterion that a value is no more than a limit."""
    return Criterion(name, unit, float(value), float(limit), bool(value <= limit))


@dataclass(frozen=True, eq=False)
class Result:
    """What a study found.

    Attributes
    ----------
    kind : of study, such as "truss".
    question : what was asked, in one sentence.
    configuration : the resolved study, as TOML can hold it; run again, it gives the same result.
    arrays : the series, by name; the first one is the main axis.
    table : the quantities of the result and of what it is compared with.
    bounds : what no motion can beat, by quantity.
    verdict : how sure the result is.
    checks : what it was held against.
    costs_elsewhere : what the optimum costs in quantities that it does not minimise.
    remarks : further sentences for the reader.
    also_found : columns of the table that the study found beside its first, such as the ends of a
        front: no laws to compare with.
    details : of the search: attempts, mesh iterations and the like, as JSON can hold it.
    provenance : program, versions, machine and time.
    interrupted : whether the user stopped the study, so that it shows the best until then.
    missing : parts that are not there, because the study did not end or a file is lost.
    schema : version of this format.
    """

    kind: str
    question: str
    configuration: Mapping[str, Any]
    arrays: Mapping[str, Series] = field(default_factory=dict)
    table: tuple[TableRow, ...] = ()
    bounds: Mapping[str, float] = field(default_factory=dict)
    verdict: Verdict = field(default_factory=lambda: Verdict("none", "the study has not ended"))
    checks: tuple[Criterion, ...] = ()
    costs_elsewhere: tuple[Cost, ...] = ()
    remarks: tuple[str, ...] = ()
    also_found: tuple[str, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)
    interrupted: bool = False
    missing: tuple[str, ...] = ()
    schema: int = SCHEMA

    def __post_init__(self) -> None:
        for name in ("configuration", "details", "provenance"):
            # as JSON will hold it, so that what is loaded equals what was saved
            object.__setattr__(self, name, plain(getattr(self, name)))

        for name, series in self.arrays.items():
            axis = self.arrays.get(series.axis)
            if axis is None:
                raise ValueError(f"the series {name} runs along {series.axis}, which is no series")
            if axis.values.size != series.values.size:
                raise ValueError(
                    f"the series {name} has {series.values.size} values, "
                    f"its axis {series.axis} {axis.values.size}"
                )

    @classmethod
    def begun(
        cls, kind: str, question: str, configuration: Mapping[str, Any], made_by: Mapping[str, Any]
    ) -> Result:
        """The result of a study that has only started, to be saved until there is more."""
        return cls(kind, question, configuration, provenance=made_by, missing=PARTS)

    def failed(self, sentence: str, infeasible: bool) -> Result:
        """The same, after its study ended without a motion: the verdict says why."""
        verdict = Verdict("infeasible" if infeasible else "none", sentence)
        missing = tuple(part for part in self.missing if part != "verdict")
        return dataclasses.replace(self, verdict=verdict, missing=missing)

    @property
    def laws(self) -> tuple[str, ...]:
        """Names of the laws in the table, the result's own first."""
        return tuple(dict.fromkeys(law for row in self.table for law in row.values))

    @property
    def compared_with(self) -> tuple[str, ...]:
        """Names of the laws that the result's own is compared with."""
        return tuple(law for law in self.laws[1:] if law not in self.also_found)

    @property
    def axis(self) -> str:
        """Name of the main axis; empty if there are no arrays."""
        return next(iter(self.arrays), "")

    @property
    def passed(self) -> bool:
        """Whether the result is complete and meets all that it was held against."""
        sure = self.verdict.kind in ("global", "local", "measured")
        return sure and not self.missing and all(check.passed for check in self.checks)

    def value(self, key: str, law: str | None = None) -> float:
        """A quantity of the table, of the result's own law unless another is named.

        Raises
        ------
        StudyError
            If the table has no such quantity or law.
        """
        rows = {row.key: row for row in self.table}
        if key not in rows:
            raise StudyError(f"the result has no quantity '{key}'; it has {', '.join(rows)}")
        values, law = rows[key].values, law or next(iter(self.laws), "")
        if law not in values:
            raise StudyError(
                f"the result has no {key} of a law '{law}'; its laws are {', '.join(values)}"
            )
        return values[law]

    def save(self, folder: Path) -> None:
        """Write `arrays.npz` and then `result.json` into an existing folder.

        Raises
        ------
        StudyError
            If there is no such folder, or it cannot be written.
        """
        columns = {name: series.values for name, series in self.arrays.items()}
        record = self.as_dictionary()
        try:
            # the arrays come first: a result.json without them would say too much
            np.savez_compressed(folder / ARRAYS_FILE, **cast(Any, columns))
            record["provenance"] |= {DIGEST: _digest(record, folder)}
            text = json.dumps(record, indent=2, ensure_ascii=False)
            (folder / RESULT_FILE).write_text(text + "\n", "utf-8")
        except OSError as error:
            raise StudyError(
                f"the result cannot be written into {folder} ({error.strerror}); "
                "make room there, or give a folder that exists and that you may write to",
                ExitCode.NO_RESULTS_FOLDER,
            ) from error

    def as_dictionary(self) -> dict[str, Any]:
        """All but the values of the arrays, as JSON can hold it."""
        described = {
            name: {"unit": series.unit, "axis": series.axis, "meaning": series.meaning}
            for name, series in self.arrays.items()
        }
        record = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        for name in ("table", "checks", "costs_elsewhere"):
            record[name] = [dataclasses.asdict(item) for item in record[name]]
        record["verdict"] = dataclasses.asdict(self.verdict)
        return {"program": PROGRAM, **cast(dict[str, Any], plain(record | {"arrays": described}))}

    @classmethod
    def load(cls, folder: str | Path, partial: bool = False) -> Result:
        """Read a result.

        Parameters
        ----------
        folder : path
            A results folder.
        partial : bool
            Whether an incomplete result will do; its `missing` lists what is not there.

        Raises
        ------
        StudyError
            If the folder is incomplete (unless `partial`), foreign, damaged or written by a
            version with another format.
        """
        folder = Path(folder)
        record = _read_record(folder, partial)
        try:
            record.get("provenance", {}).pop(DIGEST, None)
            arrays, lost = _read_arrays(folder, _exactly(dict)(record.pop("arrays", {})))
            missing = (*_words(record.pop("missing", [])), *lost)
            fields = _typed(cls, {name: record[name] for name in record if name != "program"})
            result = cls(**fields | {"arrays": arrays, "missing": missing})
        except (TypeError, ValueError, KeyError, AttributeError) as error:
            raise _damaged(folder, RESULT_FILE, error) from error

        if missing and not partial:
            raise StudyError(
                f"the result in {folder} is incomplete, {', '.join(missing)} missing "
                f"({result.verdict.sentence}); run the study again or load it with partial=True"
            )
        return result


@contextlib.contextmanager
def reading(*folders: Path) -> Iterator[None]:
    """Answer in one sentence if work on stored results ends in an error and one was changed.

    What reads a result relies on all that its study has written, as on the titles of a sweep.

    Raises
    ------
    StudyError
        In the place of such an error.
    """
    try:
        yield
    except (StudyError, OSError):
        raise
    except Exception as error:
        changed = next((folder for folder in folders if not _as_written(folder)), None)
        if changed is None:  # a defect of ours
            raise
        raise _damaged(changed, RESULT_FILE, error) from error


def _as_written(folder: Path) -> bool:
    """Whether the two files of a result are as `Result.save` wrote them."""
    try:
        record = parsed_json((folder / RESULT_FILE).read_text("utf-8"))
        return bool(record["provenance"].pop(DIGEST) == _digest(record, folder))
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return False


def _digest(record: Mapping[str, Any], folder: Path) -> str:
    """Hash of a record, and of the arrays in its folder."""
    text = json.dumps(record, sort_keys=True).encode()
    return hashlib.sha256(text + (folder / ARRAYS_FILE).read_bytes()).hexdigest()


def _read_record(folder: Path, partial: bool) -> dict[str, Any]:
    """The content of `result.json`, of this program and this version."""
    if not folder.is_dir():
        raise StudyError(f"there is no results folder {folder}; give the folder of a finished run")
    path = folder / RESULT_FILE
    if not path.is_file():
        return _without_record(folder, partial)

    try:
        record = parsed_json(path.read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise _damaged(folder, RESULT_FILE, error) from error
    if not isinstance(record, dict) or record.get("program") != PROGRAM:
        raise StudyError(f"{path} was not written by {PROGRAM}; give a results folder of {PROGRAM}")
    schema = record.get("schema")
    if schema != SCHEMA:
        newer = isinstance(schema, int) and schema > SCHEMA
        remedy = (
            f"a newer {PROGRAM} wrote it, so install that"
            if newer
            else "run the study again from its input.toml"
        )
        raise StudyError(
            f"{path} has the format {quoted(schema)}, this version reads {SCHEMA}; {remedy}"
        )
    return record


def _without_record(folder: Path, partial: bool) -> dict[str, Any]:
    """What is known of a folder without `result.json`."""
    if not (folder / OUR_MARK).is_file():
        raise StudyError(
            f"{folder} is no results folder of {PROGRAM} (it has neither {RESULT_FILE} nor "
            f"{OUR_MARK}); give the folder of a finished run"
        )
    if not partial:
        raise StudyError(
            f"the result in {folder} is incomplete, {RESULT_FILE} missing; "
            "run the study again or load it with partial=True"
        )
    return {"kind": "", "question": "", "configuration": {}, "missing": [RESULT_FILE, *PARTS]}


def _read_arrays(
    folder: Path, described: Mapping[str, Mapping[str, str]]
) -> tuple[dict[str, Series], tuple[str, ...]]:
    """The series that `result.json` describes, and what is missing of them."""
    if not described:
        return {}, ()
    path = folder / ARRAYS_FILE
    if not path.is_file():
        return {}, (ARRAYS_FILE,)

    try:
        columns = stored_arrays(path, described)
    except ValueError as error:
        raise _damaged(folder, ARRAYS_FILE, error) from error
    arrays = {
        name: Series(
            values=values,
            **{part: _exactly(str)(described[name][part]) for part in ("unit", "axis", "meaning")},
        )
        for name, values in columns.items()
    }

    # a series without its axis is of no use
    usable = {name: series for name, series in arrays.items() if series.axis in arrays}
    return usable, tuple(f"series {name}" for name in described if name not in usable)


def _number(value: Any) -> float:
    """A number; nan where JSON has null."""
    if value is None:
        return math.nan
    if not isinstance(value, int | float) or isinstance(value, bool):
        raise TypeError(f"{quoted(value)} is no number")
    return float(value)


_IN_WORDS = {dict: "table", list: "list", str: "text", int: "whole number", bool: "true or false"}


def _exactly(kind: type) -> Callable[[Any], Any]:
    def read(value: Any) -> Any:
        if not isinstance(value, kind):
            raise TypeError(f"{quoted(value)} is no {_IN_WORDS[kind]}")
        return value

    return read


def _words(values: Any) -> tuple[str, ...]:
    return tuple(_exactly(str)(value) for value in _exactly(list)(values))


def _numbers(values: Any) -> dict[str, float]:
    return {str(name): _number(value) for name, value in _exactly(dict)(values).items()}


def _all(kind: type[Any]) -> Callable[[Any], Any]:
    return lambda items: tuple(_built(kind, item) for item in _exactly(list)(items))


# annotation of a field: what reads it out of JSON
_READERS: dict[str, Callable[[Any], Any]] = {
    "str": _exactly(str),
    "bool": _exactly(bool),
    "int": _exactly(int),
    "float": _number,
    "float | None": lambda value: None if value is None else _number(value),
    "tuple[str, ...]": _words,
    "Mapping[str, float]": _numbers,
    "Mapping[str, Any]": _exactly(dict),
    "VerdictKind": _exactly(str),
    "Better": _exactly(str),
    "Verdict": lambda value: _built(Verdict, value),
    "tuple[TableRow, ...]": _all(TableRow),
    "tuple[Criterion, ...]": _all(Criterion),
    "tuple[Cost, ...]": _all(Cost),
}


def _built(kind: type[Any], record: Any) -> Any:
    """A dataclass of this module out of JSON."""
    return kind(**_typed(kind, record))


def _typed(kind: type[Any], record: Any) -> dict[str, Any]:
    """The fields of a dataclass out of JSON, each of the type that it says."""
    types = {field.name: str(field.type) for field in dataclasses.fields(kind)}
    return {name: _READERS[types[name]](value) for name, value in _exactly(dict)(record).items()}


def _damaged(folder: Path, file: str, error: Exception) -> StudyError:
    reason = str(error).splitlines()[0] if str(error) else type(error).__name__
    if isinstance(error, KeyError):
        reason = f"it has no {reason}"
    return StudyError(
        f"{file} in {folder} is damaged or was changed ({reason}); run the study again"
    )
