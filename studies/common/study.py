"""A study: what can be asked by a command, and all that this program does with the answer.

Each kind of study is one `Study`, named once in `studies.registry`, or by an entry point of another
package. The command line, `report`, `export`, `sweep`, the tables of the documents and `keys` ask
it. What takes long to load is stated by its place, and loaded when it is needed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from operator import attrgetter
from pathlib import Path
from typing import Any, Literal

from studies.common.exit_codes import StudyError

Place = str | Callable[..., Any]
"""A function or class, or the text "package.module:name" of where it is."""


def placed(place: Place) -> Any:
    """What stands at a place.

    Raises
    ------
    StudyError
        If nothing does.
    """
    if not isinstance(place, str):
        return place
    module, _, name = place.partition(":")
    try:
        return attrgetter(name)(import_module(module))
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module}.".startswith(f"{error.name}."):
            raise  # the module is there, and lacks another one
        raise StudyError(f"there is no module {module}, of '{place}'; correct the study") from error
    except AttributeError as error:
        raise StudyError(f"{module} has no '{name}', of '{place}'; correct the study") from error


@dataclass(frozen=True)
class Command:
    """A sub-command that is no study.

    Attributes
    ----------
    summary : its line in `antenna-ocp --help`.
    module : has its functions `add_arguments(parser)` and `run(options, console)`.
    description : further sentences for its own `--help`.
    loads : module that it needs and that takes long to load; loaded before Ctrl-C is listened to.
    """

    summary: str
    module: str
    description: str = ""
    loads: str = ""


@dataclass(frozen=True)
class Switch:
    """A flag without a value that states several keys at once.

    Attributes
    ----------
    meaning : for `--help`.
    states : values by key, as "solver.intervals".
    """

    meaning: str
    states: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Mechanism:
    """What moves: what results of several studies have in common.

    Attributes
    ----------
    title : of it, above a report.
    model : sentences on its model, for a report.
    limits : sentences on what its model leaves out.
    parameters : function from a configuration to lines of the parameters of the model.
    page : module with functions `charts(result)` and `scene(result)` for a report, the curves and
        what moves (None: nothing); without it the curves are those of all arrays.
    motion : function from a result to its motion, for an export; without it the motion is that of
        the joints whose angles and rates are among the arrays.
    signals : what a drive may follow, for an export: its place and its rate among the arrays, by
        its name, as {"carriage": ("position", "speed")}; for a mechanism without `motion`.
    """

    title: str
    model: tuple[str, ...] = ()
    limits: tuple[str, ...] = ()
    parameters: Place | None = None
    page: str = ""
    motion: Place | None = None
    signals: Mapping[str, tuple[str, str]] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Swept:
    """How a study takes part in a sweep.

    Attributes
    ----------
    coarse : what coarse meshes state on top of the study, by key.
    seconds : that a case may take, on full and on coarse meshes [s]: rough guesses, for a plan
        where no case has run yet.
    warm : whether its `run` takes `neighbour`, a result of a like study to start from.
    """

    coarse: Mapping[str, Any] = field(default_factory=dict)
    seconds: tuple[float, float] = (60.0, 60.0)
    warm: bool = False


@dataclass(frozen=True, kw_only=True)
class Study:
    """A kind of study.

    Attributes
    ----------
    name : its words on the command line.
    summary : its line in `antenna-ocp --help`; a study of another package has that package's name
        there instead.
    description : further sentences for its own `--help`.
    keys : class of the keys of its file, by the table that they stand in; those above all tables
        have no name, as in {"": "package.module:MyStudy"}.
    read : function from a nested mapping, as TOML gives it, to the stated study; by default the
        class of the keys above all tables reads it.
    state : function from a stated study to the mapping that states it again; by default its fields.
    run : function of a stated study and a console that gives a `Result`.
    check : function of a stated study and a console that raises `StudyError` where no motion can
        meet it, before a folder is made. What it returns, if anything, `run` takes as `checked`.
    kind : of its results; by default its name with "-" for a space.
    also : further kinds of results that its command gives, with their mechanisms.
    folder : name of its results folder; `{0.NAME}` is an attribute of the stated study, `{file}`
        the name of its file; by default its kind.
    without : keys above all tables that its file cannot have, nor a flag state.
    switches : further flags, by name.
    presets : folder with files that `--preset` names.
    beside : function from a stated study and the folder of its file to the study with the contents
        of files that it names.
    resumes : whether its `run` takes `kept`, the `FinishedSteps` of its folder, so that a run that
        was stopped can go on: see `studies.common.finished`.
    ends : whether nothing is left to go on with where its result passed, so that the finished steps
        are removed then.
    files : function from a result to texts of further files, by name.
    outcome : function from a result to the text that is printed; by default that of all studies.
    figures : function from a result to names and figures.
    drawn : whether its figures stand in its report, in place of curves.
    answers : what the columns of its table are: laws that are compared ("motion"), a profile that
        is checked ("profile"), parts of one motion ("parts"), or many cases ("cases").
    mechanism : what moves; a `Mechanism` or where it is.
    motions : function from a result and the name of one of its motions to a result of that motion.
    profile, judge : units of the columns of a profile, by name, and a function from a stated
        study, these columns and a console to a result, for `antenna-ocp check --study NAME`.
    sweep : how it can be swept; None if it cannot.
    command : module with `add_arguments(parser)` and `run(options, console)`, if its command is
        one of its own.
    """

    name: str
    summary: str
    description: str = ""
    keys: Mapping[str, Place]
    read: Place | None = None
    state: Place | None = None
    run: Place = ""
    check: Place | None = None
    kind: str = ""
    also: Mapping[str, str | Mechanism] = field(default_factory=dict)
    folder: str = ""
    without: tuple[str, ...] = ()
    switches: Mapping[str, Switch] = field(default_factory=dict)
    presets: Path | None = None
    beside: Place | None = None
    resumes: bool = False
    ends: bool = False
    files: Place | None = None
    outcome: Place | None = None
    figures: Place | None = None
    drawn: bool = False
    answers: Literal["motion", "profile", "parts", "cases"] = "motion"
    mechanism: str | Mechanism | None = None
    motions: Place | None = None
    profile: Mapping[str, str] = field(default_factory=dict)
    judge: Place | None = None
    sweep: Swept | None = None
    command: str = ""

    def __post_init__(self) -> None:
        if not self.kind:
            object.__setattr__(self, "kind", self.name.replace(" ", "-"))

    def tables(self) -> dict[str, type[Any]]:
        """The class of the keys of each table of its file."""
        return {name: placed(place) for name, place in self.keys.items()}

    def stated(self, raw: Mapping[str, Any]) -> Any:
        """The study that a nested mapping states.

        Raises
        ------
        StudyError
            Naming the key, its value and the remedy.
        """
        from studies.common.configuration import from_mapping

        if self.read is not None:
            return placed(self.read)(raw)
        return from_mapping(placed(self.keys[""]), raw)

    def configuration(self, stated: Any) -> dict[str, Any]:
        """The nested mapping that states a study again."""
        from studies.common.configuration import as_stated

        found: dict[str, Any] = placed(self.state or as_stated)(stated)
        return found
