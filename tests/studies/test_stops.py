"""Ctrl-C is neither lost inside CasADi nor waited for behind a long step of a library."""

import argparse
import math
import os
import signal
import subprocess
import sys
from types import SimpleNamespace

import pytest

from ocp import OcpError, Trial
from studies.common.console import Console, silent
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.finished import FinishedSteps
from studies.common.result import Result, Verdict
from studies.common.running import carry_out
from studies.common.stops import kept_anyway
from studies.common.study import Study
from studies.truss.config import SolverOptions, TrussStudy
from studies.truss.study import run

FOUND = Result("test", "Is it kept?", {}, {}, verdict=Verdict("measured", "it was measured"))
posix = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")

# CasADi's wrapper returns None for an error that is raised inside it
SWALLOWING = """
import os, signal, time, types
from studies.common.console import silent
from studies.common.stops import interrupt, stops_heard
signal.signal(signal.SIGINT, TAKEN)
library = types.ModuleType("casadi.library")
exec('''
import os, signal, time
def call():
    try:
        os.kill(os.getpid(), signal.SENT)
        time.sleep(0.05)
    except KeyboardInterrupt:
        print("lost")
''', library.__dict__)
try:
    with stops_heard(silent()):
        library.call()
        time.sleep(5.0)
except KeyboardInterrupt:
    print("heard")
"""

# a long step of a library, which goes on whatever Python makes of the signal
LONG = """
import signal, time
from studies.common.console import Console
from studies.common.stops import stops_heard
signal.signal(signal.SIGINT, lambda number, frame: None)
with stops_heard(Console()):
    print("begun", flush=True)
    time.sleep(20.0)
"""


# how Ctrl-C is taken when the command begins, and the signal that comes: a shell lets what runs in
# its background ignore Ctrl-C, and a program that calls the command leaves it to Python
TAKEN = {
    "command": ("interrupt", "SIGINT"),
    "background": ("signal.SIG_IGN", "SIGTERM"),
    "program": ("signal.default_int_handler", "SIGINT"),
    "program that is ended": ("signal.default_int_handler", "SIGTERM"),
}


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="Windows has no such timer")
@pytest.mark.parametrize("how", TAKEN)
def test_an_interrupt_inside_casadi_comes_out_behind_it(how):
    taken, sent = TAKEN[how]
    done = subprocess.run(
        [sys.executable, "-c", SWALLOWING.replace("TAKEN", taken).replace("SENT", sent)],
        capture_output=True,
        text=True,
        timeout=20,
        check=True,
    )
    assert done.stdout.split() == ["heard"]


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_second_interrupt_ends_the_process_during_a_long_step():
    with subprocess.Popen(
        [sys.executable, "-c", LONG], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as run:
        assert run.stdout.readline() == "begun\n"
        run.send_signal(signal.SIGINT)
        assert "press Ctrl-C again to stop immediately" in run.stderr.readline()
        run.send_signal(signal.SIGINT)
        assert run.wait(timeout=8) == 130
        assert "interrupted twice" in run.stderr.read()


def stop() -> None:
    signal.raise_signal(signal.SIGINT)


@pytest.fixture
def listening():
    """Ctrl-C as Python takes it, whatever runs the tests in the background."""
    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, former)


def test_a_result_that_is_being_made_is_made_anew_and_shorter(listening):
    asked = []

    def result(whole):
        asked.append(whole)
        stop()  # twice, and the second time nothing is taken away
        return FOUND

    assert kept_anyway(result).interrupted
    assert asked == [True, False]


def test_a_search_that_was_stopped_is_not_asked_for_the_whole():
    asked = []
    assert kept_anyway(lambda whole: asked.append(whole) or FOUND, stopped=True).interrupted
    assert asked == [False]
    assert not kept_anyway(lambda whole: FOUND).interrupted


def test_a_result_that_is_being_written_is_written_to_the_end(listening, tmp_path):
    def files(result):
        stop()
        return {"rows.csv": "x"}

    out = tmp_path / "out"
    study = Study(
        name="test",
        summary="",
        keys={},
        state=lambda stated: {},
        run=lambda stated, console: FOUND,
        files=files,
    )
    options = argparse.Namespace(results=out, overwrite=False, no_figures=False)
    stated = argparse.Namespace(question="Is it kept?")
    assert carry_out(study, stated, "test", options, silent()) is ExitCode.INTERRUPTED
    assert (out / "rows.csv").read_text() == "x"
    assert Result.load(out).verdict == FOUND.verdict


@posix
def test_no_search_begins_after_the_stop(listening):
    """The optimum of this study without the rope's pull would be sought again with it."""

    lines = []

    class Stopping(Console):
        def progress(self, text):
            lines.append(text)
            if text.startswith("start 1 of 1"):
                os.kill(os.getpid(), signal.SIGINT)

        def live(self, text):
            pass

    solver = SolverOptions(intervals=8, starts=("straight",))
    study = TrussStudy(minimise="peak-acceleration", duration=2.0, solver=solver)
    with pytest.raises(StudyError, match="interrupted before a motion was found"):
        run(study, Stopping())
    assert not any("again with the rope forces" in line for line in lines)


def test_a_start_that_was_stopped_is_no_finished_one(tmp_path):
    starts = FinishedSteps(tmp_path)
    starts.keep("motion", Trial("stopped", SimpleNamespace(interrupted=True), None, 1.0, 0.0))
    starts.keep("motion", Trial("failed", None, OcpError("no motion"), math.nan, 0.0))
    assert starts.names("motion") == ("failed",)
