"""What can be swept: the studies of other commands, each behind the same few functions.

A case of a sweep is what the command of its subject would solve, given the case's TOML.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.common.configuration import key_lines, table
from studies.common.console import silent
from studies.common.exit_codes import StudyError, quoted

if TYPE_CHECKING:
    from studies.common.result import Result


@dataclass(frozen=True)
class SweptCommand:
    """A command whose study can be swept.

    Attributes
    ----------
    package : of its study, with `config` and `study`.
    configuration : name of the class of its study.
    coarse : what coarse meshes state on top of the study, key by key.
    seconds : that a case may take, on full and on coarse meshes [s]: rough guesses, for a plan
        where no case has run yet.
    warm : whether a study can start from the motion of another one.
    entries : classes of the entries of its lists of tables, by the names of these; a joint may
        name a file.
    """

    package: str
    configuration: str
    coarse: Mapping[tuple[str, ...], Any]
    seconds: tuple[float, float]
    warm: bool = False
    entries: Mapping[str, str] = field(default_factory=dict)

    def with_files(self, raw: Mapping[str, Any], folder: Path) -> dict[str, Any]:
        """The study with the contents of the files that it names.

        Raises
        ------
        StudyError
            If one cannot be read.
        """
        joints = raw.get("joint", ()) if "joint" in self.entries else ()
        if not any(isinstance(joint, Mapping) and "csv" in joint for joint in joints):
            return dict(table("base", raw))
        from studies.flex.drives import with_tables

        return self._stated(with_tables(self._study(raw), folder))

    def resolved(self, raw: Mapping[str, Any]) -> dict[str, Any]:
        """All keys of a study, those that take their defaults among them.

        Raises
        ------
        StudyError
            Naming the key, its value and the remedy.
        """
        return self._stated(self._study(raw))

    def run(self, configuration: Mapping[str, Any], neighbour: Result | None = None) -> Result:
        """Solve a study.

        Parameters
        ----------
        configuration : mapping
            As `resolved` gives it.
        neighbour : Result, optional
            Of a like study, whose motion is one more to start from.

        Raises
        ------
        StudyError
            If it cannot be met or is not solved.
        """
        study = self._study(configuration)
        run = import_module(f"{self.package}.study").run
        how = {} if neighbour is None else {"neighbour": neighbour}
        found: Result = run(study, silent(), **how)
        return found

    def units(self, keys: Iterable[str]) -> dict[str, str]:
        """Units of some of its keys, where they have one; the entries of a list share theirs."""
        from studies.common.parameters import field_texts, parameter_lines

        config = import_module(f"{self.package}.config")
        known = {line.key: line.unit for line in key_lines(getattr(config, self.configuration))}
        for name, kind in self.entries.items():
            known |= {line.key: line.unit for line in key_lines(getattr(config, kind), f"{name}.")}
        if self.package == "studies.truss":
            from models.truss import TrussParameters

            names = dict.fromkeys(field_texts(TrussParameters), 0.0)
            lines = parameter_lines("truss", {"truss": names})
            known |= {f"truss.{line.name.replace(' ', '_')}": line.unit for line in lines}

        units = {}
        for key in keys:
            unit = known.get(".".join(part for part in key.split(".") if not part.isdigit()), "")
            if unit not in ("", "-"):
                units[key] = unit
        return units

    def _study(self, raw: Mapping[str, Any]) -> Any:
        config = import_module(f"{self.package}.config")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what the model warns of stops nothing
            if self.package == "studies.arm":
                return config.question_from(getattr(config, self.configuration), raw)
            return config.study_from(raw)

    def _stated(self, study: Any) -> dict[str, Any]:
        stated: dict[str, Any] = import_module(f"{self.package}.config").as_dictionary(study)
        return stated


_COARSE_TRUSS: Mapping[tuple[str, ...], Any] = {
    ("solver", "intervals"): 12,
    ("solver", "starts"): ["bezier"],
}

_OF_A_CHAIN = {"link": "LinkCase", "joint": "JointCase"}

SUBJECTS: Mapping[str, SweptCommand] = {
    "truss": SweptCommand("studies.truss", "TrussStudy", _COARSE_TRUSS, (6.0, 1.5), warm=True),
    "arm solve": SweptCommand("studies.arm", "ArmStudy", {("elements",): 4}, (20.0, 8.0)),
    "arm sequence": SweptCommand("studies.arm", "SequenceStudy", {}, (60.0, 60.0)),
    "flex": SweptCommand(
        "studies.flex", "FlexStudy", {("elements",): 2}, (10.0, 3.0), entries=_OF_A_CHAIN
    ),
}


def put_value(raw: Any, place: tuple[str, ...], value: Any, name: str) -> Any:
    """A copy of nested tables and lists with one value changed.

    Parameters
    ----------
    place : tuple of str
        Keys from the outside in; a number is a place in a list, from 0.
    name : str
        Of the whole, for the sentence.

    Raises
    ------
    StudyError
        If the study has something else than a table or list where one has to be.
    """
    if not place:
        return value
    first, rest = place[0], place[1:]
    if isinstance(raw, list | tuple):
        if not (first.isdigit() and int(first) < len(raw)):
            raise StudyError(
                f"{name}: there is no entry {quoted(first)} in a list of {len(raw)}; number its "
                "entries from 0"
            )
        number = int(first)
        return [*raw[:number], put_value(raw[number], rest, value, name), *raw[number + 1 :]]
    if not isinstance(raw, Mapping):
        raise StudyError(
            f"{name}: there is a value {quoted(raw)} where {quoted(first)} needs a table"
        )
    return {**raw, first: put_value(raw.get(first, {}) if rest else None, rest, value, name)}
