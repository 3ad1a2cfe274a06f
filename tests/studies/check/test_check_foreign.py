"""Files that people have are read, or by the very command that their refusal prints."""

import shlex
from pathlib import Path

import pytest

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
