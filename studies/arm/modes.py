"""Which flags of `antenna-ocp arm` go together: what a question does not use is refused."""

from __future__ import annotations

import argparse

from studies.arm.numbers import ARM, NUMBERS
from studies.common.exit_codes import StudyError

_ONE = ("objective", "torque_cap", "rate_cap", "sample_time", "satellite_inertia",
        "pointing_error", "elements", "modes")  # fmt: skip
_SEVERAL = ("total", "dwell", "lock_energy")  # of a sequence
_QUESTIONS = {
    "sequence": tuple(
        name for name in ("stage", "objective", *NUMBERS)
        if name not in (*ARM, "torque_cap", "sample_time")
    ),
    "baselines": (*_ONE, *_SEVERAL),
    "trade_off": (*_ONE, "latch", *_SEVERAL),
    "least_duration": (*_ONE, "latch", *_SEVERAL),
}  # fmt: skip


def check_flags(options: argparse.Namespace) -> None:
    """Refuse flags that what is asked for would ignore.

    Raises
    ------
    StudyError
        Naming the flag.
    """
    asked = [name for name in _QUESTIONS if getattr(options, name)]
    if len(asked) > 1:
        raise StudyError(f"{_flag(asked[0])} and {_flag(asked[1])} are two questions; ask one")
    unused = _QUESTIONS[asked[0]] if asked else _SEVERAL
    for name in unused:
        if getattr(options, name) is not None:
            where = f"{_flag(asked[0])} has" if asked else "without --sequence there is"
            raise StudyError(f"{where} no use for {_flag(name)}; leave it out")


def _flag(name: str) -> str:
    return f"--{name.replace('_', '-')}"
