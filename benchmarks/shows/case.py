"""One case of a show in a process: `python -m benchmarks.shows.case NAME SEED INDEX DIR FILE`.

The answer is written to FILE. DIR is the case's folder.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import time
from pathlib import Path

from benchmarks.shows.show import show

WATCHED = 0.5  # [s] between two looks at the parent


def end_with_parent() -> None:
    """End this process group once the process that started it is gone.

    A show that was killed outright cannot end its case. Without this the case would go on, and
    disturb the same case of the run that goes on.
    """
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(WATCHED)
        os.killpg(0, signal.SIGKILL)

    threading.Thread(target=watch, daemon=True).start()


def main() -> None:
    """Draw the question, answer it, write."""
    end_with_parent()
    name, seed, index, folder, path = sys.argv[1:]
    module = show(name)
    answer = module.answer(module.question(int(seed), int(index)), Path(folder))
    Path(path).write_text(json.dumps(dict(answer)), "utf-8")


if __name__ == "__main__":
    main()
