"""Parts of a study in processes of their own."""

import importlib
import io
import os
import signal
import subprocess
import sys
import time
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from pickle import PicklingError

import pytest

from studies.common.console import Console, silent
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.processes.child import MOST_PROCESSES, OF_A_PART
from studies.common.processes.side_by_side import Part, allowed_processes, side_by_side

ROOT = Path(__file__).parent.parent.parent
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

def ask(path, console):
    console.progress("please")
    for _ in range(1000):
        if os.path.exists(path):
            return True
        time.sleep(0.01)
    return False

def unsent(console):
    return lambda: None

class Unread(Exception):
    def __init__(self, message, more):
        super().__init__(message)

def unread(console):
    raise Unread("this", "that")

def threads(console):
    import numpy
    matrix = numpy.ones((400, 400))
    matrix @ matrix
    return len(os.listdir("/proc/self/task"))

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


@pytest.mark.parametrize("processes", [1, 2, 3])
def test_what_follows_from_parts_comes_behind_them_in_their_order(parts, processes):
    def further(place, answer):
        return [Part(parts.square, (place + 1,))] * (answer % 3)

    squares = [Part(parts.square, (x,)) for x in (2, 3, 1)]
    found = list(side_by_side(squares, silent(), processes, further))
    assert found == [4, 9, 1, 1, 9]


def test_what_follows_from_a_part_begins_before_the_others_are_done(parts, tmp_path):
    class Obliging(Console):
        def progress(self, text):
            if text == "line of 2":
                (tmp_path / "go").touch()

    def further(place, answer):
        return [Part(parts.square, (2,))] if place else []

    both = [Part(parts.ask, (str(tmp_path / "go"),)), Part(parts.square, (0,))]
    assert list(side_by_side(both, Obliging(), 2, further)) == [True, 0, 4]


def test_lines_of_progress_are_shown_while_their_part_is_at_work(parts, tmp_path):
    class Obliging(Console):
        def progress(self, text):
            (tmp_path / text).touch()

    asking = [Part(parts.ask, (str(tmp_path / "please"),))] * 2
    assert list(side_by_side(asking, Obliging(), 2)) == [True, True]


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
    # which error that is, and its first words, depend on Python's version
    with pytest.raises((AttributeError, PicklingError), match=r"local object.*unsent"):
        list(side_by_side([Part(parts.unsent, ())] * 2, silent(), 2))


def test_an_error_that_cannot_be_read_is_a_defect_and_no_death(parts):
    with pytest.raises(BrokenProcessPool) as caught:
        list(side_by_side([Part(parts.unread, ())] * 2, silent(), 2))
    assert "required positional argument: 'more'" in str(caught.value.__cause__)


def test_a_process_has_none_of_its_own_and_prints_no_answers(parts):
    assert list(side_by_side([Part(parts.print_and_count, ())] * 2, silent(), 2)) == [1, 1]


@pytest.mark.skipif(sys.platform != "linux", reason="counts threads in /proc")
def test_a_process_has_one_thread_for_linear_algebra(parts, monkeypatch):
    for name in OF_A_PART:
        monkeypatch.delenv(name, raising=False)
    assert list(side_by_side([Part(parts.threads, ())] * 2, silent(), 2)) == [1, 1]


SCRIPT = """
import signal

import side_parts
from studies.common.console import Console
from studies.common.processes.side_by_side import Part, side_by_side

# a shell makes its background jobs ignore Ctrl-C, and so what they start, as these tests may be
signal.signal(signal.SIGINT, signal.default_int_handler)
print("the script runs")
parts = [Part(getattr(side_parts, name), arguments) for name, arguments in {parts}]
print(list(side_by_side(parts, Console(), len(parts))))
"""


def started(tmp_path, *parts):
    """A script without a guard, in a session of its own, that does parts side by side."""
    script = tmp_path / "unguarded.py"
    script.write_text(SCRIPT.format(parts=parts))
    paths = os.pathsep.join((str(tmp_path), str(ROOT)))
    return subprocess.Popen(
        (sys.executable, script),
        env=os.environ | {"PYTHONPATH": paths, MOST_PROCESSES: "2"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def test_a_script_needs_no_guard(parts, tmp_path):
    out, _ = started(tmp_path, ("square", (2,)), ("square", (3,))).communicate(timeout=120)
    assert out.splitlines() == ["the script runs", "[4, 9]"]


@pytest.mark.skipif(sys.platform != "linux", reason="what they are is read in /proc")
@pytest.mark.parametrize("how", ["Ctrl-C", "killed"])
def test_processes_end_with_the_one_that_waits_for_them(how, parts, tmp_path):
    files = [tmp_path / "one", tmp_path / "two"]
    waiting = [("wait", (str(file),)) for file in files]
    running = started(tmp_path, ("square", (4,)), *waiting)  # and one that has nothing to do
    while not all(file.is_file() and file.read_text() for file in files):
        time.sleep(0.01)
    time.sleep(1.0)  # for the one with nothing to do
    if how == "killed":
        running.kill()
    else:
        os.killpg(running.pid, signal.SIGINT)  # as a terminal does, to all of them
    _, complaints = running.communicate(timeout=30)  # which ends when nobody can write any more
    assert complaints.count("Traceback") == (how == "Ctrl-C")
    for file in files:
        assert ended(int(file.read_text()))


def ended(process):
    """Whether a process has ended, or does so soon."""
    for _ in range(1000):
        try:
            os.kill(process, 0)
        except ProcessLookupError:
            return True
        if "\nState:\tZ" in Path(f"/proc/{process}/status").read_text():
            return True  # nobody has asked yet what became of it
        time.sleep(0.01)
    return False


@pytest.mark.skipif(os.name != "posix", reason="asks whether processes live")
def test_what_is_not_waited_for_is_ended(parts, tmp_path):
    files = [tmp_path / "one", tmp_path / "two"]
    running = side_by_side(
        [Part(parts.square, (3,))] + [Part(parts.wait, (f,)) for f in files], silent(), 3
    )
    assert next(running) == 9
    while not all(file.is_file() and file.read_text() for file in files):
        time.sleep(0.01)
    begin = time.monotonic()
    running.close()
    assert time.monotonic() - begin < 30  # they would sleep for 60 s
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
