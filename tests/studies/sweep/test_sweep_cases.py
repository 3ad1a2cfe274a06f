"""Where the cases of a sweep lie, what they are called, and what is refused."""

import json
import subprocess
import sys
import time
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studies.cli import main
from studies.common.configuration import read_toml, toml_text
from studies.common.console import silent
from studies.common.exit_codes import ExitCode, StudyError
from studies.sweep.cases.lock import alone
from studies.sweep.cases.plan import plan
from studies.sweep.cases.samples import design
from studies.sweep.cases.store import CaseStore
from studies.sweep.config import as_dictionary, study_from
from studies.sweep.driver import Driver

BASE = {"minimise": "peak-acceleration", "duration": 140.0, "caps": {"jerk": "bezier"}}


def sweep(parameters: dict[str, Any], **keys: Any) -> Any:
    return study_from({"base": BASE, "parameters": parameters, **keys})


def test_a_grid_varies_the_last_key_fastest() -> None:
    study = sweep({"duration": [100.0, 120.0], "truss": {"modules": [6, 12, 24]}})
    assert design(study).points[:4] == [(100.0, 6), (100.0, 12), (100.0, 24), (120.0, 6)]


def test_parents_are_neighbours_towards_the_first_case_and_stay_when_a_grid_grows() -> None:
    axes = {"duration": [100.0, 120.0], "truss.modules": [6, 12, 24]}
    found = design(sweep(axes, warm=True))
    assert found.parents == [None, 0, 1, 0, 3, 4]
    small = plan(sweep(axes, warm=True))
    axes["duration"].append(130.0)
    grown = plan(sweep(axes, warm=True))
    assert [case.key for case in grown.cases[:6]] == [case.key for case in small.cases]


def test_a_list_goes_through_its_keys_together() -> None:
    study = sweep({"duration": [100.0, 120.0], "truss.modules": [6, 12]}, sampling="list")
    assert design(study).points == [(100.0, 6), (120.0, 12)]


def test_one_at_a_time_leaves_the_others_as_they_are_stated() -> None:
    study = sweep({"duration": [100.0], "truss.modules": [6, 12]}, sampling="one-at-a-time")
    points = design(study).points
    assert points == [(None, None), (100.0, None), (None, 6), (None, 12)]


@pytest.mark.parametrize("sampling", ["latin-hypercube", "sobol"])
def test_samples_fill_the_box_evenly_and_are_the_same_again(sampling: str) -> None:
    axes = {
        "duration": {"low": 100.0, "high": 200.0},
        "truss.pulley_friction": {"low": 1e-3, "high": 1e-1, "scale": "log"},
    }
    study = sweep(axes, sampling=sampling, samples=32, seed=5)
    points = np.array(design(study).points)
    assert points.shape == (32, 2)
    shares = np.column_stack([(points[:, 0] - 100.0) / 100.0, np.log10(points[:, 1] / 1e-3) / 2.0])
    # one point in each of 32 slices: as either method does of every key
    for column in shares.T:
        assert sorted(np.floor(32 * column).astype(int)) == list(range(32))
    assert np.array_equal(points, np.array(design(study).points))
    other = sweep(axes, sampling=sampling, samples=32, seed=6)
    assert not np.array_equal(points, np.array(design(other).points))


def test_a_case_is_named_by_what_it_asks_and_not_by_how_it_is_written() -> None:
    written = plan(sweep({"truss.net_angle_deg": [80.0, 85.0]}))
    base = {**BASE, "concession": 5e-5}  # the default, stated
    stated = plan(study_from({"base": base, "parameters": {"truss": {"net_angle_deg": [85, 80]}}}))
    assert [case.key for case in stated.cases][::-1] == [case.key for case in written.cases]
    coarse = plan(sweep({"truss.net_angle_deg": [80.0]}, coarse=True))
    assert coarse.cases[0].key != written.cases[0].key


def test_the_written_sweep_states_the_same_cases(tmp_path: Path) -> None:
    study = sweep({"duration": {"low": 100.0, "high": 200.0, "count": 7, "scale": "log"}})
    path = tmp_path / "input.toml"
    path.write_text(toml_text(as_dictionary(study)), "utf-8")
    again = study_from(read_toml(path))
    assert [c.key for c in plan(again).cases] == [c.key for c in plan(study).cases]


def test_any_key_of_a_study_can_vary_margins_and_drives_among_them() -> None:
    base = {**BASE, "margin": {"preset": "aiaa-s-114"}}
    study = study_from({"base": base, "parameters": {"margin.factors.joint_friction": [1.0, 1.5]}})
    found = plan(study)
    factors = [
        found.configuration(case)["margin"]["factors"]["joint_friction"] for case in found.cases
    ]
    assert factors == [1.0, 1.5]


def test_a_case_that_is_no_study_is_a_row_and_planned_as_such() -> None:
    found = plan(sweep({"duration": [100.0, -1.0]}))
    assert [bool(case.refusal) for case in found.cases] == [False, True]
    assert "duration is -1.0" in found.cases[1].refusal


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"parameters": {}}, "parameters is empty"),
        ({"parameters": {"duration": []}}, "parameters.duration is an empty list"),
        ({"parameters": {"duration": 5.0}}, "give a list of values, or low and high"),
        ({"parameters": {"duration": [5.0, 5.0]}}, "contains 5.0 twice"),
        ({"parameters": {"duration": {"low": 5.0}}}, "parameters.duration has no high"),
        ({"parameters": {"duration": {"low": 5.0, "high": 4.0}}}, "give the lower end first"),
        ({"parameters": {"duration": {"low": 4.0, "high": 5.0}}}, "has no count"),
        ({"sampling": "sobol"}, "samples is missing"),
        ({"samples": 5}, "remove samples"),
        ({"sampling": "sobol", "samples": 4}, "draws values between two ends"),
        ({"sampling": "lattice"}, "sampling is 'lattice'"),
        ({"subject": "arms"}, "did you mean arm"),
        ({"study": "main.toml"}, "both study and [base] are given"),
        ({"sampling": "list", "warm": True}, "only a grid of the truss has neighbours"),
        (
            {"sampling": "list", "parameters": {"duration": [1.0, 2.0], "smooth": [True]}},
            "must have one length, but duration has 2, smooth has 1",
        ),
        ({"bas": {}}, "unknown key bas; did you mean base?"),
        ({"parameters": {"": [1.0]}}, "has the key '', a part of which is empty"),
        ({"parameters": {"truss..link": [1.0]}}, "has the key 'truss..link', a part of which"),
        ({"parameters": {"minimise": [["energy"], ["energy"]]}}, "contains ['energy'] twice"),
    ],
)
def test_a_wrong_sweep_is_refused_in_one_sentence(changes: dict[str, Any], words: str) -> None:
    content = {"base": BASE, "parameters": {"duration": [5.0, 6.0]}, **changes}
    with pytest.raises(StudyError) as refused:
        study_from(content)
    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("truss.pully_friction", "did you mean truss.pulley_friction?"),
        ("duratoin", "unknown key duratoin; did you mean duration?"),
        ("duration.low", "there is a value 140.0 where 'low' needs a table"),
    ],
)
def test_a_key_that_no_study_has_is_refused_before_anything_runs(
    key: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = tmp_path / "sweep.toml", tmp_path / "out"
    path.write_text(toml_text({"base": BASE, "parameters": {key: [0.1, 0.2]}}), "utf-8")
    assert main(["sweep", str(path), "--results", str(out)]) == ExitCode.BAD_INPUT
    assert words in capsys.readouterr().err
    assert not out.exists()


def test_a_folder_of_somebody_else_is_left_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = tmp_path / "sweep.toml", tmp_path / "out"
    path.write_text(toml_text({"base": BASE, "parameters": {"duration": [1e2]}}), "utf-8")
    out.mkdir()
    (out / "input.toml").write_text("mine", "utf-8")
    (out / "cases").mkdir()  # others call a folder so, too
    assert main(["sweep", str(path), "--results", str(out)]) == ExitCode.NO_RESULTS_FOLDER
    said = capsys.readouterr().err
    assert "exists already and is no results folder of a sweep" in said
    assert "--overwrite" not in said  # which a sweep does not have
    assert {file.name for file in out.iterdir()} == {"input.toml", "cases"}
    assert (out / "input.toml").read_text("utf-8") == "mine"


def test_the_lock_of_a_folder_ends_with_its_process(tmp_path: Path) -> None:
    holds = (
        "import os, signal, subprocess, sys; from pathlib import Path\n"
        "from studies.sweep.cases.lock import alone\n"
        "with alone(Path(sys.argv[1])):\n"
        # the processes that it starts live on for a while
        "    subprocess.Popen(['sleep', '20'], stdout=subprocess.DEVNULL)\n"
        "    print('held', flush=True)\n"
        "    os.kill(os.getpid(), signal.SIGSTOP)\n"
    )
    command = [sys.executable, "-c", holds, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        # one that is stopped holds it still
        words = rf"another run uses .*\(process {holder.pid} on .*\); wait for it"
        with pytest.raises(StudyError, match=words), alone(tmp_path):
            pass
        holder.kill()
        holder.wait()
        with alone(tmp_path):
            pass


def test_a_grid_of_millions_is_refused_at_once() -> None:
    axes = {
        "duration": {"low": 100.0, "high": 200.0, "count": 1_000_000},
        "truss.pulley_friction": [0.0, 0.01],
    }
    begin = time.process_time()
    with pytest.raises(StudyError, match="the grid has 2000000 cases, more than 1000000"):
        plan(sweep(axes))
    assert time.process_time() - begin < 10.0  # one pass over a million values


class Answering:
    """A place where cases are solved at once; what each was told to start from is kept."""

    def __init__(self) -> None:
        self.asked: list[tuple[float, float, Any]] = []

    def slots(self) -> int:
        return 1

    def submit(self, task: Any, seconds: float | None) -> Future[dict[str, Any]]:
        asked = task["configuration"]
        point = asked["duration"], asked["truss"]["pulley_friction"]
        self.asked.append((*point, task["motion"]))
        answer: Future[dict[str, Any]] = Future()
        answer.set_result({"record": {"status": "solved"}, "motion": {"of": list(point)}})
        return answer

    def close(self) -> None:
        pass


def test_a_damaged_motion_is_computed_again_where_a_case_would_start_from_it(
    tmp_path: Path,
) -> None:
    planned = plan(
        sweep({"duration": [100.0, 120.0], "truss.pulley_friction": [0.0, 0.01]}, warm=True)
    )
    store, said = CaseStore(tmp_path, planned.version), silent()
    store.open()

    def solved() -> list[tuple[float, float, Any]]:
        place = Answering()
        Driver(planned, store, place, None, said).run()
        return place.asked

    assert [case[:2] for case in solved()] == [(100, 0.0), (100, 0.01), (120, 0.0), (120, 0.01)]
    _, second, third, last = (store.place / f"{case.key}.jsonl" for case in planned.cases)
    for damaged in (second, third):
        damaged.write_text(damaged.read_text("utf-8").replace('"of": [1', '"of": [2'), "utf-8")
    last.unlink()
    # nothing starts from the second one any more: its record alone is asked for
    assert solved() == [(120.0, 0.0, {"of": [100.0, 0.0]}), (120.0, 0.01, {"of": [120.0, 0.0]})]
    words = "case 3 is computed again: its motion, from which another case starts, is damaged"
    assert words in said.progress_to.getvalue()  # type: ignore[attr-defined]


def test_folders_of_other_versions_say_what_they_are(tmp_path: Path) -> None:
    store = CaseStore(tmp_path, plan(sweep({"duration": [100.0]})).version)
    store.open()
    about = json.loads((store.place / "version.json").read_text("utf-8"))
    for name, head in (("newer", json.dumps({**about, "schema": 9})), ("silent", "[")):
        place = tmp_path / "cases" / name
        place.mkdir()
        (place / "version.json").write_text(head, "utf-8")
        (place / "a.jsonl").write_text("", "utf-8")
    (newer, one), (silent_one, other) = store.others().items()
    assert newer.startswith("newer (format 9, version ")
    assert silent_one == "silent (of an unknown version)"
    assert (one, other) == (1, 1)
