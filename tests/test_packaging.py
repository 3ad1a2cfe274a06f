"""What a user installs: where its folders are hidden, and the wheel away from the repository."""

import os
import subprocess
import sys
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
COMMAND = ("-c", "import sys, antenna_ocp; sys.exit(antenna_ocp.main())", "paper")


def run(*words, folder, python=sys.executable, path=None):
    """A finished Python process in `folder`."""
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    environment.pop("PYTHONPATH", None)
    if path:
        environment["PYTHONPATH"] = os.pathsep.join(map(str, path))
    return subprocess.run(
        (python, *words), cwd=folder, env=environment, capture_output=True, text=True, timeout=600
    )


def packages_of_ones_own(folder, *names):
    """A folder with packages of the user's that are called as some of ours."""
    for name in names:
        (folder / name).mkdir()
        (folder / name / "__init__.py").write_text('"""The user\'s own."""\n')
    return folder


@pytest.mark.parametrize("name", ["models", "studies", "ocp"])
def test_a_folder_that_hides_ours_is_told_by_the_command(name, tmp_path):
    hiding = packages_of_ones_own(tmp_path, name)
    done = run(*COMMAND, folder=tmp_path, path=[hiding, ROOT])
    assert (done.returncode, done.stdout) == (2, "")
    (sentence,) = done.stderr.splitlines()
    assert f"{hiding / name} hides the package '{name}' of antenna-ocp; rename it" in sentence


def test_a_module_that_hides_ours_is_told_too(tmp_path):
    (tmp_path / "models.py").write_text("")
    done = run(*COMMAND, folder=tmp_path, path=[tmp_path, ROOT])
    assert done.returncode == 2
    assert f"{tmp_path / 'models.py'} hides the package 'models'" in done.stderr


def test_a_folder_that_hides_ours_is_told_where_the_command_runs_as_a_module(tmp_path):
    # python -m puts the working directory first on the path
    packages_of_ones_own(tmp_path, "models")
    done = run("-m", "antenna_ocp", "paper", folder=tmp_path, path=[ROOT])
    assert (done.returncode, done.stdout) == (2, "")
    assert "hides the package 'models'" in done.stderr


def test_a_script_that_imports_a_study_is_told(tmp_path):
    packages_of_ones_own(tmp_path, "models")
    script = tmp_path / "script.py"
    script.write_text("from studies.truss.study import run\n")
    done = run(str(script), folder=tmp_path, path=[ROOT])
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith(f"ImportError: {tmp_path / 'models'} hides")


def test_a_folder_without_init_hides_nothing(tmp_path):
    (tmp_path / "models").mkdir()
    done = run(
        "-c",
        "import antenna_ocp as a; print([a.hiding_sentence()])",
        folder=tmp_path,
        path=[tmp_path, ROOT],
    )
    assert (done.stdout, done.stderr) == ("['']\n", "")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel of a copy of the tracked sources, so that the tree stays as it is."""
    folder = tmp_path_factory.mktemp("wheel")
    sources = folder / "sources"
    names = ("pyproject.toml", "README.md", "LICENSE", "antenna_ocp.py")
    packages = ("ocp", "models", "studies", "benchmarks", "tests")
    sources.mkdir()
    for name in (*names, *packages):
        (sources / name).symlink_to(ROOT / name)
    done = run(
        *("-m", "pip", "wheel", "--no-deps", "--no-build-isolation", "-w", folder, sources),
        folder=folder,
    )
    assert done.returncode == 0, done.stderr
    (built,) = folder.glob("*.whl")
    return built


@pytest.mark.slow
def test_the_wheel_holds_what_is_read_and_nothing_else(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    sources = {
        path.relative_to(ROOT).as_posix()
        for package in ("ocp", "models", "studies")
        for path in (ROOT / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    metadata = {name for name in names if ".dist-info/" in name}
    assert names - metadata == sources | {"antenna_ocp.py"}


@pytest.mark.slow
def test_the_wheel_works_in_an_empty_environment_away_from_the_repository(wheel, tmp_path):
    environment, away = tmp_path / "environment", tmp_path / "away"
    away.mkdir()
    venv.create(environment, with_pip=True)
    scripts = environment / ("Scripts" if os.name == "nt" else "bin")
    python = scripts / "python"
    pins = ROOT / "constraints.txt"
    done = run("-m", "pip", "install", "-q", "-c", pins, wheel, folder=away, python=python)
    if "No matching distribution" in done.stderr or "Could not find a version" in done.stderr:
        pytest.skip("no package index can be reached")
    assert done.returncode == 0, done.stderr

    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    antenna_ocp = str(scripts / "antenna-ocp")
    done = run(antenna_ocp, "--version", folder=away, python=python)
    assert done.stdout == f"antenna-ocp {version}\n"

    # the main study on a coarse mesh: the study's file is one of the wheel's own
    where = run("-c", "import studies; print(studies.__path__[0])", folder=away, python=python)
    installed = Path(where.stdout.strip())
    assert environment in installed.parents
    study = installed / "truss" / "main.toml"
    done = run(
        *(antenna_ocp, "truss", study, "--intervals", "12", "--results", "results"),
        folder=away,
        python=python,
    )
    assert done.returncode == 0, done.stderr
    assert "global: the bound 0.000341755 is met" in done.stdout

    done = run(antenna_ocp, "report", "results", "--figures", "png", folder=away, python=python)
    assert done.returncode == 0, done.stderr
    assert "global: the bound 0.000341755 is met" in done.stdout
    assert "uPlot" in (away / "results" / "report.html").read_text()
    assert (away / "results" / "figures" / "overview.png").stat().st_size > 10_000

    script = "import studies.common.result as r; print(r.Result.load('results').verdict)"
    done = run("-W", "error", "-c", script, folder=away, python=python)
    assert "global" in done.stdout, done.stderr
