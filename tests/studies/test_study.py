"""The studies as objects: each says all that the program asks, also one of another package."""

import json
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from studies import registry
from studies.cli import main
from studies.common.configuration import toml_text
from studies.common.exit_codes import ExitCode
from studies.common.study import Study, placed
from studies.completion import whole_parser
from studies.truss.config import as_dictionary, study_from

ROOT = Path(__file__).parents[2]
STUDIES = list(registry.studies())
PLACES = ("read", "state", "run", "check", "beside", "files", "outcome", "figures", "motions")


@pytest.mark.parametrize("study", STUDIES, ids=lambda study: study.name)
def test_all_that_a_study_names_is_there(study: Study) -> None:
    for name in PLACES:
        if place := getattr(study, name):
            assert callable(placed(place)), name
    assert all(issubclass(kind, object) for kind in study.tables().values())
    for kind in (study.kind, *study.also):
        assert registry.study_of(kind) is study
        mechanism = registry.mechanism_of(kind)
        assert mechanism is not None
        assert mechanism.title
        for place in (mechanism.parameters, mechanism.motion):
            assert place is None or callable(placed(place))
        if mechanism.page:
            assert callable(placed(f"{mechanism.page}:charts"))
            assert callable(placed(f"{mechanism.page}:scene"))


def unknown(stated: Mapping[str, object], schema: Mapping[str, object], where: str) -> list[str]:
    """Keys that a schema does not have."""
    known = schema.get("properties", {})
    assert isinstance(known, Mapping)
    found = []
    for name, value in stated.items():
        if name not in known:
            found.append(f"{where}{name}")
        elif isinstance(value, Mapping) and "properties" in known[name]:
            found += unknown(value, known[name], f"{where}{name}.")
    return found


def test_the_schema_of_the_truss_has_every_key_that_a_result_states(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["keys", "truss", "--schema"]) == ExitCode.OK
    schema = json.loads(capsys.readouterr().out)
    text = (ROOT / "studies" / "truss" / "main.toml").read_text("utf-8")
    raw = {
        **tomllib.loads(text),
        "drive": {"drum_radius": 0.02},
        "margin": {"preset": "aiaa-s-114"},
    }
    stated = tomllib.loads(toml_text(as_dictionary(study_from(raw))))
    assert unknown(stated, schema, "") == []
    assert unknown({"caps": {"jerc": 1.0}}, schema, "") == ["caps.jerc"]
    assert schema["required"] == ["minimise"]
    assert schema["properties"]["caps"]["additionalProperties"] is False
    assert schema["properties"]["truss"]["properties"]["link"]["description"].endswith("[m]")
    assert schema["properties"]["solver"]["properties"]["intervals"] == {
        "description": "initial number of mesh intervals, over the whole motion",
        "type": "integer",
        "minimum": 2,
        "default": 40,
    }


def test_keys_are_listed_with_units_defaults_and_flags(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["keys", "truss"]) == ExitCode.OK
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 100
    table = lines[lines.index("[caps]") :]
    assert re.match(r"speed +rad/s +none +maximum speed of the deployment angle", table[1])
    assert table[2].strip() == "(--speed-cap)"
    assert any(re.match(r"drum_radius +m +", line) for line in table)
    assert main(["keys", "trus"]) == ExitCode.BAD_INPUT
    assert "there is no study 'trus'; did you mean truss?" in capsys.readouterr().err


def test_every_sub_command_is_completed() -> None:
    words = whole_parser().format_help()
    for name in registry.names():
        assert name.split()[0] in words


def test_completion_says_what_it_needs(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "shtab", None)
    assert main(["completion", "bash"]) == ExitCode.BAD_INPUT
    assert "pip install 'antenna-ocp[completion]'" in capsys.readouterr().err


@pytest.mark.parametrize("shell", ["bash", "zsh"])
def test_completion_knows_sub_commands_and_flags(
    shell: str, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("shtab")
    assert main(["completion", shell]) == ExitCode.OK
    script = capsys.readouterr().out
    assert "least-duration" in script
    assert "--motor-torque-cap" in script
    assert "peak-rope-acceleration" in script  # a word of --objective


def package(folder: Path, code: str) -> dict[str, str]:
    """An environment in which a module `lift_study` is installed, with its entry point."""
    (folder / "lift_study.py").write_text(code, "utf-8")
    about = folder / "lift_study-0.1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: lift-study\nVersion: 0.1\n")
    (about / "entry_points.txt").write_text(f"[{registry.GROUP}]\nlift = lift_study:STUDY\n")
    return os.environ | {"PYTHONPATH": os.pathsep.join((str(ROOT), str(folder)))}


def command(
    words: str, folder: Path, environment: dict[str, str]
) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-m", "antenna_ocp", *words.split()]
    return subprocess.run(
        line, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


def of_the_page() -> str:
    """The module that the page on studies of one's own shows."""
    page = (ROOT / "docs" / "how-to" / "own-study.md").read_text("utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    return "\n\n".join(blocks[:6])


@pytest.mark.slow
def test_a_study_of_another_package_runs_reports_exports_sweeps_and_checks(tmp_path: Path) -> None:
    environment = package(tmp_path, of_the_page())
    (tmp_path / "sweep.toml").write_text('subject = "lift"\n[parameters]\nduration = [6.0, 8.0]\n')
    assert "a study of the package lift-study" in command("--help", tmp_path, environment).stdout
    for words in (
        "lift --height 20 --intervals 6 --results out",
        "keys lift --schema",
        "report out",
        "export out --to csv --output rows.csv",
        "sweep sweep.toml --workers 1 --coarse --results cases",
    ):
        done = command(words, tmp_path, environment)
        assert done.returncode == 0, (words, done.stderr)
    record = json.loads((tmp_path / "out" / "verification.json").read_text())
    # pulled evenly to 5 m/s and then free: m (g + v / (T - v / g))
    assert record["values"]["peak-force"] == pytest.approx(
        200 * (9.81 + 5 / (8 - 5 / 9.81)), rel=1e-6
    )
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "Friction and the inertia of the winch are left out." in page
    assert '"title":"lift"' in page.replace(" ", "")  # what moves
    assert (tmp_path / "out" / "motion.png").is_file()
    rows = (tmp_path / "rows.csv").read_text("utf-8").splitlines()
    assert any(line.startswith("time [s],height [m]") for line in rows)
    check_a_profile(tmp_path, environment)
    refused = command("lift --speed-cap 1", tmp_path, environment)
    assert refused.returncode == ExitCode.BAD_INPUT
    assert "--speed-cap is 1 m/s, which is too slow" in refused.stderr


def check_a_profile(folder: Path, environment: dict[str, str]) -> None:
    """A smooth rise by 10 m in 8 s, whose peak speed is 15/8 of the mean one."""
    rows = [
        (8000 * t, 1e3 * 10 * t**3 * (10 - 15 * t + 6 * t**2))
        for t in np.linspace(0, 1, 401).tolist()
    ]
    lines = ["time [ms],height [mm]", *(f"{time!r},{height!r}" for time, height in rows)]
    (folder / "rise.csv").write_text("\n".join(lines), "utf-8")
    for cap, code in (("2.4", ExitCode.OK), ("2.3", ExitCode.NOT_VERIFIED)):
        (folder / "lift.toml").write_text(f"speed_cap = {cap}\n")
        words = f"check rise.csv lift.toml --study lift --results check-{cap}"
        done = command(words, folder, environment)
        assert done.returncode == code, done.stderr
    record = json.loads((folder / "check-2.4" / "verification.json").read_text())
    assert record["values"]["peak-speed"] == pytest.approx(15 / 8 * 10 / 8, rel=1e-4)
    assert (folder / "check-2.4" / "motion.png").is_file()
    missing = command("check rise.csv --study lift --column height=level", folder, environment)
    assert missing.returncode == ExitCode.BAD_INPUT
    assert "has no column 'level'" in missing.stderr


def test_a_study_that_judges_no_profile_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "rise.csv", "--study", "truss"]) == ExitCode.BAD_INPUT
    said = capsys.readouterr().err
    assert "--study is 'truss', which is not a study that checks profiles" in said


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("STUDY = 3\n", "which is no Study"),
        ("import nothing_of_that_name\n", "cannot be loaded (No module named"),
    ],
)
def test_a_broken_study_of_another_package_is_said_in_one_sentence(
    code: str, words: str, tmp_path: Path
) -> None:
    environment = package(tmp_path, code)
    done = command("lift", tmp_path, environment)
    assert done.returncode == ExitCode.BAD_INPUT
    assert words in done.stderr
    assert len(done.stderr.splitlines()) == 1
    # and it stops no other command
    assert command("--help", tmp_path, environment).returncode == 0
    assert command("keys paper", tmp_path, environment).returncode == 0
