"""The command: bad input ends in one sentence and its exit code, before any solve."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from models.truss import DYNAMIC_SET
from studies.cli import main
from studies.common.exit_codes import ExitCode
from studies.registry import COMMANDS, summary
from studies.truss.motions.laws import paper_laws

FORCE = ("truss", "--objective", "peak-force")
TIMELESS = (*FORCE, "--jerk-cap", "200/T^3")
FAST = (*TIMELESS, "--duration", "5")


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("truss",), 2, "no objective"),
        (("truss", "--objective", "peak-forc"), 2, "did you mean peak-force?"),
        (("truss", "--objective", "time"), 2, "bounds on the duration"),
        ((*FAST, "--parameter", "link=0.05"), 2, "link 0.05 m is not longer than the crank"),
        ((*FAST, "--parameter", "lnk=0.05"), 2, "did you mean truss.link?"),
        ((*FAST, "--parameter", "link"), 2, "NAME=VALUE"),
        ((*TIMELESS, "--duration", "0"), 2, "duration is 0"),
        ((*TIMELESS, "--duration", "nan"), 2, "duration is nan"),
        ((*TIMELESS, "--duration", "inf"), 2, "duration is inf"),
        ((*TIMELESS, "--duration=-5"), 2, "duration is -5"),
        ((*FAST, "--friction", "a"), 2, "--friction is 'a'; give"),
        ((*FAST, "--parameter", "crank=nan"), 2, "crank"),
        ((*FAST, "--parameter", "crank=0.6"), 2, "crank"),
        ((*FAST, "--parameter", "bar_length=0.8"), 2, "bar_length"),
        ((*FAST, "--parameter", "net_angle_deg=91"), 2, "net_angle"),
        ((*FAST, "--parameter", "stowed_angle_deg=85"), 2, "stowed_angle"),
        ((*TIMELESS, "--duration", "soon"), 2, "duration is 'soon'"),
        ((*TIMELESS, "--duration", "9..5"), 2, "lower bound first"),
        ((*FAST, "--modules", "2"), 2, "at least 3"),
        ((*FAST, "--intervals", "1.5"), 2, "whole number"),
        ((*FAST, "--starts", "bezir"), 2, "did you mean bezier?"),
        (
            (*FORCE, "--duration", "5", "--jerk-cap", "31/T^3"),
            3,
            "raise the cap to at least 32 D/T^3",
        ),
        ((*FAST, "--speed-cap", "0.1"), 3, "they need at least"),
        ((*FAST, "--least-tension", "3"), 3, "tension of the last one is 2.52455 N"),
        ((*FAST, "--force-cap", "9"), 3, "each rope needs 9.40984 N"),
        ((*FORCE, "--jerk-cap", "none", "--duration", "3", "--force-cap", "21"), 3, "21.107 N"),
        ((*FORCE, "--jerk-cap", "none", "--duration", "20"), 3, "but not reach it"),
        ((FAST[0], "missing.toml", *FAST[1:]), 2, "missing.toml cannot be read"),
        (("check", "missing.csv"), 2, "missing.csv cannot be read"),
        (("check",), 2, "the following arguments are required: PROFILE"),
        ((*FAST, "--friktion", "0.1"), 2, "unknown flag --friktion; did you mean --friction?"),
        ((*FAST, "--objectiv=energy"), 2, "unknown flag --objectiv; did you mean --objective?"),
        ((*FAST, "a.toml", "b.toml"), 2, "'b.toml' is one argument too many"),
        (("trus",), 2, "unknown sub-command 'trus'; did you mean truss?"),
        (("--versoin",), 2, "unknown flag --versoin; did you mean --version?"),
        (FORCE[:2], 2, "--objective has no value; antenna-ocp truss --help explains"),
        ((*FAST, "--overwrite=3"), 2, "--overwrite takes no value, but '3' is given"),
        # the flag that was typed is named, and not the key that it states
        ((*FAST, "--power-cap=--"), 2, "--power-cap is '--', which is not a value"),
        ((*FORCE, "--starts", "1..2", "--margin=--"), 2, "--margin is '--', which is not a value"),
        ((*FAST, "--power-cap", "a"), 2, "antenna-ocp: --power-cap is 'a'; give"),
        ((*FAST, "--power-cap=a"), 2, "antenna-ocp: --power-cap is 'a'; give"),
        ((*FAST, "--pow", "a"), 2, "unknown flag --pow; did you mean --power-cap?"),
        (("arm", "solve", "--density", "0"), 2, "antenna-ocp: --density is 0; give"),
        (("mission", "--total", "0"), 2, "antenna-ocp: --total is 0; give"),
        # an angle is answered in degrees
        ((*FAST, "--parameter", "net_angle_deg=95"), 2, "truss.net_angle 95 deg (1.65806 rad) is"),
    ],
)
def test_bad_input_is_one_sentence(
    arguments: tuple[str, ...],
    code: int,
    words: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([*arguments, "--results", str(tmp_path / "out")]) == code
    last = capsys.readouterr().err.strip().splitlines()[-1]
    assert last.startswith("antenna-ocp: ")
    assert words in last


@pytest.mark.slow
def test_a_force_cap_below_the_least_found_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["truss", "--objective", "peak-acceleration", "--friction", "0.01"]
    arguments += ["--duration", "5", "--jerk-cap", "200/T^3"]
    arguments += ["--force-cap", "44.3", "--starts", "bezier", "--results", str(tmp_path / "out")]
    # the bound of the pull refuses up to 44 N, and nothing proves that there is none above
    assert main(arguments) == ExitCode.NOT_SOLVED
    last = " ".join(capsys.readouterr().err.replace("\n  ", " ").strip().splitlines()[-1].split())
    assert "found under the other caps is 44.53" in last, last
    assert "the minimum peak rope force" in last
    assert "local" in last
    assert (tmp_path / "out" / "failure.json").is_file()


def test_an_unknown_key_of_a_file_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.toml").write_text('minimise = "energy"\n[caps]\njerc = 1.0\n')
    (tmp_path / "b.toml").write_text('minimise = "energy"\nwhatever = 1\n')
    (tmp_path / "c.toml").write_text("minimise = ")
    (tmp_path / "d.toml").write_text('minimise = "energy"\ninitial_speed = 1\n')
    (tmp_path / "e.toml").write_text('minimise = "energy"\nmotors = 2\n')
    for name, words in (
        ("a.toml", "unknown key caps.jerc; did you mean caps.jerk?"),
        ("b.toml", "unknown key whatever; known are"),
        ("d.toml", "unknown key initial_speed; known are"),
        ("e.toml", "unknown key motors; known are"),
        ("c.toml", "is not valid TOML"),
    ):
        assert main(["truss", str(tmp_path / name)]) == ExitCode.BAD_INPUT
        assert words in capsys.readouterr().err


def test_unwritable_and_existing_folders_are_found_before_the_solve(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    assert main([*FAST, "--results", str(tmp_path / "file" / "out")]) == ExitCode.NO_RESULTS_FOLDER
    taken = tmp_path / "taken"
    taken.mkdir()
    (taken / "precious.txt").write_text("keep me")
    assert main([*FAST, "--results", str(taken)]) == ExitCode.NO_RESULTS_FOLDER
    assert main([*FAST, "--results", str(taken), "--overwrite"]) == ExitCode.NO_RESULTS_FOLDER
    assert (taken / "precious.txt").read_text() == "keep me"
    assert "not a results folder" in capsys.readouterr().err


def test_help_and_the_solve_load_no_plotting() -> None:
    script = (
        "import sys, studies.cli as c\n"
        "c.main(['--help'])\n"
        "loaded = {name for name in sys.modules if name.startswith('studies.truss')}\n"
        "assert loaded == {'studies.truss', 'studies.truss.command'}, loaded\n"
        "assert not {'casadi', 'jinja2', 'numpy', 'scipy', 'matplotlib'} & set(sys.modules)\n"
        "try: c.main(['truss', '--help'])\n"
        "except SystemExit: pass\n"
        "assert not {'casadi', 'jinja2', 'numpy', 'scipy', 'matplotlib'} & set(sys.modules)\n"
        "import studies.truss.study\n"
        "assert not {'jinja2', 'scipy', 'matplotlib'} & set(sys.modules)\n"
    )
    root = Path(__file__).parents[2]
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=root, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    for code in ExitCode:
        assert code.meaning in done.stdout


def write_bezier(path: Path, header: str, factor: float = 1.0) -> None:
    time = np.linspace(0, 140.0, 201)
    angle = paper_laws(DYNAMIC_SET, 140.0)[0].law.motion(time).angle * factor
    rows = [f"{t!r},{a!r}" for t, a in zip(time.tolist(), angle.tolist(), strict=True)]
    path.write_text("\n".join([header, *rows]))


def test_verify_accepts_the_bezier_law_and_names_a_broken_cap(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "mine.csv"
    write_bezier(path, "time [s], angle [rad]")
    assert main(["check", str(path), "--friction", "0.01"]) == ExitCode.OK
    capped = ["check", str(path), "--acceleration-cap", "4e-4"]
    assert main(capped) == ExitCode.NOT_VERIFIED
    assert "FAILED: peak angular acceleration" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("t,a\n0,1\n1,2", "has no column of an angle"),
        (
            "\n".join(["time,angle", *(f"{k},{0.1 + 0.05 * k}" for k in range(25)), "25,x"]),
            "has no finite number in 'angle' in row 26 below the header",
        ),
        ("time,angle\n0,0.0768\n1,1.57", "at least 20"),
        ("", "is empty"),
    ],
)
def test_bad_profiles_are_named(
    content: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "mine.csv"
    path.write_text(content)
    assert main(["check", str(path)]) == ExitCode.BAD_INPUT
    assert words in capsys.readouterr().err


def answer(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """The one line with which a command line is refused."""
    assert main(words) == ExitCode.BAD_INPUT
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("antenna-ocp: ")
    return line


def test_the_version_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == ExitCode.OK
    program, number = capsys.readouterr().out.split()
    assert program == "antenna-ocp"
    assert number[0].isdigit()


def test_help_lists_every_sub_command_and_exit_code(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == ExitCode.OK
    text = capsys.readouterr().out
    for name in COMMANDS:
        assert f"  {name} " in text
        assert summary(name) in text
    for code in ExitCode:
        assert code.meaning in text
    assert "a sub-command is missing" in answer([], capsys)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_sub_command_explains_itself(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main([*name.split(), "--help"])
    assert stop.value.code == 0
    assert f"usage: antenna-ocp {name}" in capsys.readouterr().out
