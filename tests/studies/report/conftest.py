"""One small study of the truss that all tests of the report look at."""

import pytest

from studies.truss import run, study_from

STUDY = {
    "minimise": "peak-acceleration",
    "duration": 140.0,
    "caps": {"jerk": "bezier"},
    "truss": {"pulley_friction": 0.01},
    "solver": {"intervals": 12, "starts": ["bezier"]},
}


@pytest.fixture(scope="session")
def result():
    """The main study on a coarse mesh: about a second."""
    return run(study_from(STUDY))


@pytest.fixture(scope="session")
def folder(result, tmp_path_factory):
    """Its results folder."""
    folder = tmp_path_factory.mktemp("results") / "main"
    folder.mkdir()
    result.save(folder)
    (folder / "input.toml").write_text("# the study as it was run\n")
    return folder
