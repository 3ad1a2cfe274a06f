"""JSON and TOML of anybody's, and damaged results: one sentence, whatever is in them."""

import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

from studies.cli import main
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.finished import FinishedSteps
from studies.common.folder import open_results, resumed_results
from studies.common.foreign_text import DEEPEST, parsed_json, parsed_toml
from studies.common.result import ARRAYS_FILE, RESULT_FILE, Result, Series, reading
from tests.studies import damage

NESTED = ["[" * depth + "]" * depth for depth in (DEEPEST + 1, 900, 100_000)]
TABLES = "{" + '"a":{' * 900 + "}" * 901
LARGE = ["1" + "0" * digits for digits in (309, 400, 5000)]


@pytest.mark.parametrize("text", [*NESTED, TABLES, *LARGE, '{"a": [1, ' + LARGE[0] + "]}", "{"])
def test_json_beyond_the_limits_is_a_value_error(text: str) -> None:
    with pytest.raises(ValueError, match=r"nested deeper than|a whole number|Expecting"):
        parsed_json(text)


@pytest.mark.parametrize(
    "text", [*(f"a = {value}" for value in (*NESTED, *LARGE)), "a." * 900 + "a = 1", "a ="]
)
def test_toml_beyond_the_limits_is_a_value_error(text: str) -> None:
    with pytest.raises(ValueError, match=r"nested deeper than|a whole number|Invalid value"):
        parsed_toml(text)


def test_what_is_within_the_limits_is_read() -> None:
    deep = "[" * DEEPEST + "1" + "]" * DEEPEST
    assert str(parsed_json(deep)) == deep
    assert parsed_json("1" + "0" * 308) == 10**308
    assert parsed_toml("a = [1, 2]\n[b]\nc = 1.5") == {"a": [1, 2], "b": {"c": 1.5}}


def test_a_text_of_brackets_is_refused_before_it_fills_the_memory() -> None:
    with pytest.raises(ValueError, match="too many lists and tables"):
        parsed_json("[" + "{}," * 1_000_000 + "{}]")


@pytest.mark.parametrize(
    ("words", "suffix"),
    [
        (["truss", "{file}"], "toml"),
        (["flex", "{file}"], "toml"),
        (["robust", "truss", "{file}"], "toml"),
        (["sweep", "{file}"], "toml"),
        (["truss", "--objective", "energy", "--drive", "{file}"], "toml"),
        (["truss", "--objective", "energy", "--margin", "{file}"], "toml"),
        (["check", "{file}"], "json"),
    ],
)
@pytest.mark.parametrize("value", [NESTED[1], LARGE[1]])
def test_every_command_answers_such_a_file_in_a_sentence(
    words: list[str],
    suffix: str,
    value: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    file = tmp_path / f"file.{suffix}"
    toml = suffix == "toml"
    file.write_text(f"a = {value}\n" if toml else f'{{"time": [0, {value}], "angle": [1, 2]}}')
    assert main([word.format(file=file) for word in words]) == ExitCode.BAD_INPUT
    assert str(file) in capsys.readouterr().err


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A result with arrays."""
    made = open_results(tmp_path / "made", "truss")
    time = np.linspace(0.0, 1.0, 11)
    arrays = {"time": Series("s", "time", time), "force": Series("N", "time", time**2)}
    details = {"titles": {"a": ["b", "c"]}}
    Result("truss", "?", {"x": {"y": [1, 2.5]}}, arrays, details=details).save(made.path)
    return made.path


@pytest.mark.parametrize("way", damage.OF_ARRAYS)
@pytest.mark.parametrize("seed", range(6))
def test_damaged_arrays_are_read_or_refused_in_a_sentence(
    folder: Path, way: damage.Way, seed: int
) -> None:
    file = folder / ARRAYS_FILE
    file.write_bytes(way(file.read_bytes(), np.random.default_rng(seed)))
    try:
        Result.load(folder, partial=True)
    except StudyError as error:
        assert f"in {folder} is damaged or was changed (" in str(error)  # noqa: PT017


@pytest.mark.parametrize("way", damage.OF_JSON)
@pytest.mark.parametrize("seed", range(6))
def test_a_damaged_record_is_read_or_refused_in_a_sentence(
    folder: Path, way: damage.Way, seed: int
) -> None:
    file = folder / RESULT_FILE
    file.write_bytes(way(file.read_bytes(), np.random.default_rng(seed)))
    try:
        Result.load(folder)
        resumed_results(folder, "truss")
    except StudyError as error:
        assert len(str(error)) < 600  # noqa: PT017


def test_arrays_that_unpack_to_more_than_their_file_are_refused(folder: Path) -> None:
    np.savez_compressed(folder / ARRAYS_FILE, time=np.zeros(6_000_000), force=np.zeros(6))
    with pytest.raises(StudyError, match="unpacks to 48 MB, too much for its size"):
        Result.load(folder)


def test_what_reads_a_changed_result_ends_in_a_sentence(folder: Path) -> None:
    with pytest.raises(KeyError), reading(folder):  # as it was written: a defect of ours
        raise KeyError("titles")

    record = json.loads((folder / RESULT_FILE).read_text())
    del record["details"]["titles"]
    (folder / RESULT_FILE).write_text(json.dumps(record))
    with (
        pytest.raises(StudyError, match=r"was changed \(it has no 'titles'\); run the study again"),
        reading(folder),
    ):
        Result.load(folder).details["titles"]


@pytest.mark.parametrize(
    "record",
    [
        *(f'"objects": [], "root": {nested}' for nested in NESTED),
        '"root": [null, null]',
        '"objects": [], "root": [null, null, "x", 1]',
        '"objects": [], "root": 1',
        '"objects": [{"class": "os:system", "fields": {}}], "root": {"object": 0}',
        '"objects": [{"class": "studies.cli:main", "fields": {}}], "root": {"object": 0}',
        '"objects": [{"class": "studies.none:Use", "fields": {}}], "root": {"object": 0}',
        '"objects": [{"class": "studies.mission.stages:Use", "fields": {}}], "root": {"object": 0}',
    ],
)
def test_a_damaged_record_of_a_start_is_solved_again(tmp_path: Path, record: str) -> None:
    archive = {"solution.json": f'{{"format": "ocp solution", "version": 7, {record}}}'}
    with zipfile.ZipFile(tmp_path / "motion-bezier.step", "w") as file:
        for name, text in archive.items():
            file.writestr(name, text)
    assert FinishedSteps(tmp_path).read("motion", "bezier", None) is None


def test_a_solution_that_unpacks_to_more_than_its_file_is_refused() -> None:
    from ocp.errors import FileError
    from ocp.solution.storage import unpacked

    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("solution.json", " " * 50_000_000)
    with pytest.raises(FileError, match="too much for its size"):
        unpacked(stream.getvalue())
