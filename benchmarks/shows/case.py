"""One case of a show in a process: `python -m benchmarks.shows.case NAME SEED INDEX DIR FILE`.

The answer is written to FILE. DIR is the case's folder.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from benchmarks.shows.show import show


def main() -> None:
    """Draw the question, answer it, write."""
    name, seed, index, folder, path = sys.argv[1:]
    module = show(name)
    answer = module.answer(module.question(int(seed), int(index)), Path(folder))
    Path(path).write_text(json.dumps(dict(answer)), "utf-8")


if __name__ == "__main__":
    main()
