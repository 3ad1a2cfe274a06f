"""Parts of a study in processes of their own."""

import importlib
import io
import os
import time

import pytest

from studies.common.console import Console, silent
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.processes.child import MOST_PROCESSES
from studies.common.processes.side_by_side import Part, allowed_processes, side_by_side

MODULE = """
import os, time
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.processes.side_by_side import allowed_processes

def square(x, console):
    console.progress(f"line of {x}")
    time.sleep(0.05 * (4 - x))  # the last one is ready first
    return x * x

def refuse(x, console):
    raise StudyError(f"no {x}", ExitCode.INFEASIBLE)

def die(console):
    os._exit(7)

def print_and_count(console):
    print("not an answer")
    return allowed_processes()

def unsent(console):
    return lambda: None

def wait(path, console):
    with open(path, "w") as file:
        file.write(str(os.getpid()))
    time.sleep(60)
"""


@pytest.fixture
def parts(tmp_path, monkeypatch):
    """A module that the processes can import, too."""
    (tmp_path / "side_parts.py").write_text(MODULE)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.syspath_prepend(tmp_path)
    return importlib.reload(importlib.import_module("side_parts"))


@pytest.mark.parametrize("processes", [1, 2, 3])
def test_answers_come_in_order_however_many_processes_there_are(parts, processes):
    told = io.StringIO()
    squares = [Part(parts.square, (x,)) for x in range(4)]
    assert list(side_by_side(squares, Console(told, told), processes)) == [0, 1, 4, 9]
    assert all(f"line of {x}\n" in told.getvalue() for x in range(4))


@pytest.mark.parametrize("processes", [1, 2])
def test_the_error_is_that_of_the_first_part_that_fails(parts, processes):
    some = [Part(parts.square, (0,)), Part(parts.refuse, ("a",)), Part(parts.refuse, ("b",))]
    found = []
    with pytest.raises(StudyError, match="no a") as caught:
        found.extend(side_by_side(some, silent(), processes))
    assert caught.value.exit_code is ExitCode.INFEASIBLE


def test_a_process_that_dies_is_said(parts):
    with pytest.raises(StudyError, match="ended with exit code 7 and without an answer") as caught:
        list(side_by_side([Part(parts.die, ())] * 2, silent(), 2))
    assert caught.value.exit_code is ExitCode.NOT_SOLVED
    assert MOST_PROCESSES in str(caught.value)


def test_an_answer_that_cannot_be_sent_is_a_defect(parts):
    with pytest.raises(TypeError, match="cannot be sent"):
        list(side_by_side([Part(parts.unsent, ())] * 2, silent(), 2))


def test_a_process_has_none_of_its_own_and_prints_no_answers(parts):
    assert list(side_by_side([Part(parts.print_and_count, ())] * 2, silent(), 2)) == [1, 1]


@pytest.mark.skipif(os.name != "posix", reason="asks whether processes live")
def test_what_is_not_waited_for_is_ended(parts, tmp_path):
    files = [tmp_path / "one", tmp_path / "two"]
    running = side_by_side(
        [Part(parts.square, (3,))] + [Part(parts.wait, (f,)) for f in files], silent(), 3
    )
    assert next(running) == 9
    while not all(file.is_file() and file.read_text() for file in files):
        time.sleep(0.01)
    running.close()
    for file in files:
        with pytest.raises(ProcessLookupError):
            os.kill(int(file.read_text()), 0)


def test_the_environment_limits_the_processes(monkeypatch):
    monkeypatch.setenv(MOST_PROCESSES, "1")
    assert allowed_processes() == 1
    monkeypatch.delenv(MOST_PROCESSES)
    most = allowed_processes()
    monkeypatch.setenv(MOST_PROCESSES, "100000")
    assert allowed_processes() == most
    monkeypatch.setenv(MOST_PROCESSES, "many")
    with pytest.raises(StudyError, match="give a whole number, 1 or more"):
        allowed_processes()
