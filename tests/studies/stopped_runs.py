"""Runs of a command that get a signal at a moment of their own."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[2]
# The process sends itself the signal as it prints the words. One from outside comes some time
# later, and a start takes a third of a second: the study may then have ended.
COMMAND = """
import os, signal, sys
import studies.cli
import studies.common.console as console

console.QUIET = 0.0  # every line of progress is shown
number, words = int(sys.argv.pop(1)), sys.argv.pop(1)
if sys.argv.pop(1) == "background":  # as a shell starts it
    signal.signal(signal.SIGINT, signal.SIG_IGN)
else:
    signal.signal(signal.SIGINT, signal.default_int_handler)
write, sent = sys.stderr.write, []

def heard(text):
    count = write(text)
    if words in text and not sent:
        sent.append(number)
        sys.stderr.flush()
        os.kill(os.getpid(), number)
    return count

sys.stderr.write = heard
sys.exit(studies.cli.main())
"""


def stopped_at(
    study: Sequence[str], words: str, number: int, out: Path, where: str = "foreground"
) -> tuple[int, str]:
    """Exit code and messages of a study that gets a signal when it first prints `words`."""
    signalled = [sys.executable, "-c", COMMAND, str(int(number)), words, where]
    done = subprocess.run(
        [*signalled, *study, "--results", str(out)],
        cwd=ROOT,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        timeout=300,
        check=False,
    )
    assert words in done.stderr
    return done.returncode, done.stderr
