"""The results folder, made and tried before any computation, and where a result comes from."""

import contextlib
import errno
import json
import platform
import re
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

from studies.common.exit_codes import ExitCode, StudyError
from studies.common.foreign_text import parsed_json

DEFAULT_PARENT = Path("results")
OUR_MARK = "provenance.json"
INPUT_FILE, RESULT_FILE = "input.toml", "result.json"
PROGRAM = "antenna-ocp"
# what a system says of a disk without naming a file
OF_THE_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EROFS, errno.EFBIG)


@dataclass(frozen=True)
class ResultsFolder:
    """A folder that exists, is writable and is ours.

    Attributes
    ----------
    path : the folder.
    replaced : where the folder that it replaces waits until this one is complete, or None.
    """

    path: Path
    replaced: Path | None = None

    def file(self, name: str) -> Path:
        """Return the path of the file `name` in this folder."""
        return self.path / name

    def write_json(self, name: str, content: Mapping[str, object]) -> Path:
        """Write `content` as JSON (numbers that are not finite become null) and return its path."""
        path = self.file(name)
        path.write_text(json.dumps(plain(content), indent=2, ensure_ascii=False) + "\n", "utf-8")
        return path

    @contextlib.contextmanager
    def written(
        self, again: str = "give the same command again with --overwrite"
    ) -> Iterator[None]:
        """Say of a disk that is full, or of a folder that is read-only, what it is.

        Parameters
        ----------
        again : str
            What to do when there is room.

        Raises
        ------
        StudyError
            In the place of an OSError of this folder.
        """
        try:
            yield
        except OSError as error:
            named = error.filename is not None
            ours = named and self.path.absolute() in Path(str(error.filename)).absolute().parents
            if not (ours or (not named and error.errno in OF_THE_DISK)):
                raise
            raise unwritable(self.path, error, again) from error

    def complete(self) -> None:
        """Remove the folder that this one replaces."""
        if self.replaced is not None:
            shutil.rmtree(self.replaced, ignore_errors=True)


def open_results(asked: Path | None, name: str, overwrite: bool = False) -> ResultsFolder:
    """Create the results folder and try to write in it.

    Parameters
    ----------
    asked : path or None
        The folder the user named; without one the first free of `results/name`,
        `results/name-2`, ... is taken.
    name : str
        Name of the study, for the default.
    overwrite : bool
        Whether an existing results folder may be replaced.

    Raises
    ------
    StudyError
        If the folder exists and may not be replaced, or cannot be created or written.
    """
    path = asked if asked is not None else _first_free(DEFAULT_PARENT, name)
    # tried now, since finding out after an hour of solving would be too late
    try:
        replaced = None
        if path.exists() and not (path.is_dir() and not any(path.iterdir())):
            replaced = _make_room(path, overwrite)
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
        folder = ResultsFolder(path, replaced)
        folder.write_json(OUR_MARK, provenance())
    except OSError as error:
        raise StudyError(
            f"the results folder {path} cannot be written ({error.strerror}); "
            "name another one with --results",
            ExitCode.NO_RESULTS_FOLDER,
        ) from error
    return folder


def unwritable(folder: Path, error: OSError, again: str) -> StudyError:
    """The sentence for a disk that is full or a folder that is read-only."""
    return StudyError(
        f"the results folder {folder} cannot be written ({error.strerror}); what was written until "
        f"then is kept: free some space or correct its permissions, and {again}",
        ExitCode.NO_RESULTS_FOLDER,
    )


def resumed_results(path: Path, kind: str) -> Path:
    """The folder of a run that was stopped.

    Parameters
    ----------
    kind : of study, such as "truss", that goes on there.

    Raises
    ------
    StudyError
        If there is none that could go on, or one of another kind.
    """
    if not (path / OUR_MARK).is_file() or not (path / INPUT_FILE).is_file():
        raise StudyError(
            f"{path} is no results folder with an {INPUT_FILE} from which a study could go on; "
            "give the folder of a study that was stopped"
        )
    found = _kind_of(path)
    if found not in ("", kind):
        raise StudyError(
            f"{path} has the results of another command (kind '{found}' instead of '{kind}'), "
            "which this one would replace; give the folder of a study of its own that was stopped"
        )
    return path


def _kind_of(path: Path) -> str:
    """The kind of study whose results a folder has; empty where that is not to be read."""
    try:
        record = parsed_json((path / RESULT_FILE).read_text("utf-8"))
    except (OSError, ValueError):
        return ""
    return str(record.get("kind", "")) if isinstance(record, dict) else ""


def _first_free(parent: Path, name: str) -> Path:
    candidates = (parent / (name if i == 1 else f"{name}-{i}") for i in range(1, 100_000))
    return next(path for path in candidates if not path.exists())


def _make_room(path: Path, overwrite: bool) -> Path:
    """Move an existing results folder aside if that was asked for and is safe."""
    if not overwrite:
        raise StudyError(
            f"the results folder {path} exists already; name a new one with --results "
            "or replace it with --overwrite",
            ExitCode.NO_RESULTS_FOLDER,
        )
    # somebody's own folder, named by mistake, is not ours to remove
    if not (path / OUR_MARK).is_file():
        raise StudyError(
            f"{path} is not a results folder of antenna-ocp (it has no {OUR_MARK}), so "
            "--overwrite leaves it alone; name another one with --results",
            ExitCode.NO_RESULTS_FOLDER,
        )

    aside = _first_free(path.parent, f"{path.name}.replaced")
    try:
        return path.rename(aside)
    except OSError as error:
        raise StudyError(
            f"the results folder {path} cannot be replaced ({error.strerror}); "
            "name another one with --results",
            ExitCode.NO_RESULTS_FOLDER,
        ) from error


def provenance() -> dict[str, object]:
    """Return the versions this result depends on, and when it was made."""
    return {
        "program": PROGRAM,
        "versions": {
            PROGRAM: version(PROGRAM),
            "python": platform.python_version(),
            **{name: version(name) for name in ("casadi", "numpy", "scipy", "matplotlib")},
        },
        "machine": platform.machine(),
        "made": datetime.now(UTC).isoformat(timespec="seconds"),
        "model_source": "Lu, Qi, Hu, Li, Zhang, IEEE Access 2019, DOI 10.1109/ACCESS.2019.2918614",
    }


def version(name: str) -> str:
    """The installed version of a distribution."""
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "run from its source tree"


def plain(value: object) -> object:
    """Return `value` as JSON can hold it: plain lists, and None for numbers that are not finite."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, float) and not re.fullmatch(r"-?\d.*", repr(value)):
        return None
    return value
