"""Files that people have are read, or by the very command that their refusal prints."""

import shlex
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from studies.check.reading import raw_table
from studies.check.reading.profile import MeasuredProfile, read_profile
from studies.common.exit_codes import StudyError
from tests.studies.check.foreign_forms import FORMS, RAD, TIME, write_form

AT_ONCE = {
    "LabVIEW",
    "LabVIEW, decimal commas, a name of its own",
    "Tektronix, mathematical channel in degrees",
    "Keysight, labelled",
    "CANoe",
    "CANalyzer",
    "ADAMS table",
    "Simulink data inspector",
    "pandas, index without a name",
    "spreadsheet, row of units",
    "spreadsheet, header with commas above semicolons",
    "spreadsheet, times of day",
    "spreadsheet, quoted numbers",
    "Excel, texts with decimal commas",
    "Excel, index, titles and a row of units",
}


def by_its_command(refusal: str) -> MeasuredProfile:
    """The profile as the command below a refusal reads it."""
    sentence, command, *_ = refusal.splitlines()
    assert len(sentence) <= 200
    program, verb, path, *words = shlex.split(command)
    assert (program, verb) == ("antenna-ocp", "check")
    assert words[::2] == ["--column"] * (len(words) // 2)
    return read_profile(Path(path), words[1::2])


@pytest.mark.parametrize("name", FORMS)
def test_a_foreign_form_is_read_or_its_refusal_says_how(name: str, tmp_path: Path) -> None:
    path = write_form(name, tmp_path)
    try:
        profile, at_once = read_profile(path), True
    except StudyError as error:
        profile, at_once = by_its_command(str(error)), False
    assert at_once == (name in AT_ONCE)
    # seconds since 1970 in a double are known to 2.4e-7, nanoseconds alike
    assert profile.time == pytest.approx(TIME, abs=3e-7)
    assert profile.values["angle"] == pytest.approx(RAD, abs=6e-9)


def test_what_unpacks_to_more_than_memory_is_for_is_refused_in_little_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(raw_table, "MOST_UNPACKED", 4_000_000)
    path = tmp_path / "a.mat"
    savemat(path, {"time": TIME, "angle": np.zeros(5_000_000)}, do_compression=True)
    assert path.stat().st_size < 100_000
    tracemalloc.start()
    with pytest.raises(StudyError, match="unpacks to more than 4 MB; save the time"):
        read_profile(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 8_000_000
