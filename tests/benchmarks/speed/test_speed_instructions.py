"""Instructions by library, read from a profile; the counting itself needs Valgrind."""

import io
import shutil
from pathlib import Path

import pytest

from benchmarks.parts import Setup
from benchmarks.speed import instructions
from studies.common.console import Console

# f of one library calls g of another: 7 + 5 instructions of its own, 30 of g that were called
PROFILE = """\
# callgrind format
positions: line
events: Ir

ob=(1) /lib/libipopt.so.3
fl=(1) ???
fn=(1) f
0 7
cob=(2) /lib/libcoinmumps.so.3
cfi=(2) ???
cfn=(2) g
calls=2 4
* 30
+3 5

ob=(2)
fl=(2)
fn=(2)
4 28
- 2

ob=(3) /site-packages/numpy.libs/libscipy_openblas64_.so
fn=(3) h
0 11
"""


def test_costs_of_calls_are_the_callee_s() -> None:
    counts = instructions.by_owner(instructions.by_library(PROFILE.splitlines(keepends=True)))
    assert (counts["IPOPT"], counts["MUMPS"]) == (12, 28 + 2)
    # NumPy's own linear algebra is none of MUMPS's
    assert counts[instructions.REST] == 11
    assert sum(counts.values()) == 53


def test_a_machine_without_valgrind_is_told(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(instructions, "TOOL", "no-such-tool")
    said = io.StringIO()
    setup = Setup(Console(io.StringIO(), said), 1, 60.0, peers=False, environments=tmp_path)
    (record,) = instructions.measure(setup)
    assert "no-such-tool" in said.getvalue()
    (table,) = instructions.tables(record)
    assert not table.rows


@pytest.mark.slow
@pytest.mark.skipif(shutil.which(instructions.TOOL) is None, reason="needs Valgrind")
def test_a_process_is_counted_alike_twice(tmp_path: Path) -> None:
    first, again = (instructions.counted(("-c", "import casadi"), tmp_path, 300.0) for _ in "ab")
    assert first["CasADi"] > 0
    assert first["CasADi"] == pytest.approx(again["CasADi"], rel=1e-3)
