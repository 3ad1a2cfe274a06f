"""Every kind of measurement still finds what it measures, and every start what it loads."""

import pytest

from benchmarks.speed.parts import imports
from benchmarks.speed.process.child import KINDS

SMALLEST = {
    "growth": "10",
    "modules": "6",
    "elements": "1",
    "benchmark": "bryson_denham",
    "states": "3",
    "phases": "2",
}


@pytest.mark.parametrize(
    "kind",
    [pytest.param(k, marks=[pytest.mark.slow] * (k == "modules")) for k in SMALLEST],
)
def test_a_kind_measures(kind: str) -> None:
    answer = KINDS[kind](SMALLEST[kind])
    assert answer["imports"] > 10  # [MiB]
    assert answer.get("status", "Solve_Succeeded") == "Solve_Succeeded"
    assert answer.get("passed", True)


@pytest.mark.slow  # a stage of the arm has one mesh, of 150 intervals
def test_a_stage_of_the_arm_is_measured() -> None:
    assert {*SMALLEST, "arm"} == set(KINDS)
    assert KINDS["arm"]("86")["whole"] > 0


@pytest.mark.slow
def test_every_start_starts() -> None:
    for words in imports.STARTS.values():
        imports._run(words)
    with pytest.raises(imports.StudyError, match="failed: ModuleNotFoundError"):
        imports._run(("-c", "import no_such_module"))
