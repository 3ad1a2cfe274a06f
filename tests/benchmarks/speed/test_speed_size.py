"""Every size still finds what it measures, and every start what it loads."""

import pytest

from benchmarks.speed import imports
from benchmarks.speed.size import KINDS, PHASES, STATES, solve_whole


@pytest.mark.parametrize(("part", "size"), [(STATES, 3), (PHASES, 2)], ids=lambda p: str(p)[:20])
def test_a_size_is_measured_and_printed(part, size) -> None:
    run = solve_whole(KINDS[part.kind](size))
    assert run["memory"] >= run["imports"] > 10  # [MiB]
    assert run["work"] >= run["iterations"]
    rows = [
        {"value": size, "runs": [run], "failure": ""},
        {"value": 9, "runs": [], "failure": "not done after 1 s"},
    ]
    (table,) = part.tables({"rows": rows})
    assert str(run["iterations"]) in table.rows[0]
    assert table.rows[1][-1] == "not done after 1 s"


@pytest.mark.slow
def test_every_start_starts() -> None:
    for words in imports.STARTS.values():
        imports.start(words)
    with pytest.raises(imports.StudyError, match="failed: ModuleNotFoundError"):
        imports.start(("-c", "import no_such_module"))
