"""Ctrl-C is neither lost inside CasADi nor waited for behind a long step of a library."""

import signal
import subprocess
import sys

import pytest

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
        assert "Ctrl-C once more ends at once" in run.stderr.readline()
        run.send_signal(signal.SIGINT)
        assert run.wait(timeout=8) == 130
        assert "interrupted twice" in run.stderr.read()
