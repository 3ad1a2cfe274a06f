"""Hands the cases of a sweep out, and keeps what comes back; it holds no result in memory."""

from __future__ import annotations

import functools
import queue
import time
from collections import deque
from collections.abc import Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any, Protocol

from studies.common.console import Console
from studies.sweep.cases.plan import Case, Plan
from studies.sweep.cases.store import CaseStore, DamagedCase

PATIENCE = 0.5  # [s] between two looks at where the sweep stands
Task = Mapping[str, Any]
Outcome = dict[str, Any]


class Place(Protocol):
    """Where cases are solved."""

    def slots(self) -> int:
        """How many cases may be in flight; it may change while they are."""

    def submit(self, task: Task, seconds: float | None) -> Future[Outcome]:
        """Have a case solved."""

    def close(self) -> None:
        """End all that is in flight."""


@dataclass
class Driver:
    """The cases of one run, on their way.

    Attributes
    ----------
    plan, store : of the sweep and its folder, whose lock the caller holds.
    place : where cases are solved.
    seconds : after which a case is ended; None for no limit.
    console : where progress goes.
    """

    plan: Plan
    store: CaseStore
    place: Place
    seconds: float | None
    console: Console

    done: set[str] = field(default_factory=set)
    failed: int = 0
    computed: int = 0
    _ready: deque[Case] = field(default_factory=deque)
    _waiting: dict[str, list[Case]] = field(default_factory=dict)  # by the key of their parent
    _alone: deque[Case] = field(default_factory=deque)  # whose process died, to be tried once more
    _tried: set[str] = field(default_factory=set)
    _flying: dict[str, Case] = field(default_factory=dict)
    _ended: queue.SimpleQueue[tuple[str, Future[Outcome]]] = field(
        default_factory=queue.SimpleQueue
    )
    _missing: int = 0
    _begin: float = field(default_factory=time.monotonic)

    def run(self) -> None:
        """Solve all cases that have no file; Ctrl-C leaves those in flight.

        Raises
        ------
        KeyboardInterrupt
            After Ctrl-C.
        StudyError
            If the folder cannot be written, or the cluster is lost.
        """
        self._sort()
        try:
            while self._ready or self._flying or self._alone:
                self._hand_out()
                self._collect()
        finally:
            self.place.close()

    def _sort(self) -> None:
        """Find what is done, and what waits for its parent."""
        present = self.store.keys()
        cases: dict[str, Case] = {}
        for case in self.plan.cases:
            if case.key in cases:
                continue  # a list may state a case twice; it is solved once
            cases[case.key] = case
            if case.key in present and self._trusted(case):
                self.done.add(case.key)
            else:
                self._queue(case, cases)

        self._missing = len(cases) - len(self.done)
        if self.done:
            self.console.progress(f"{len(self.done)} of {len(cases)} cases are already solved")

    def _queue(self, case: Case, cases: Mapping[str, Case]) -> None:
        """Put a case where it waits for its parent, or for its turn."""
        parent = case.parent
        if parent in self.done and not self.store.has_whole_motion(parent):
            self._discard(cases[parent], "its motion, from which another case starts, is damaged")
            self.done.remove(parent)
            self._queue(cases[parent], cases)
        if parent is None or parent in self.done:
            self._ready.append(case)
        else:
            self._waiting.setdefault(parent, []).append(case)

    def _discard(self, case: Case, reason: str) -> None:
        """Have a case computed again."""
        self.console.progress(f"case {case.number + 1} is computed again: {reason}")
        self.store.discard(case.key)

    def _trusted(self, case: Case) -> bool:
        """Whether a case that has a file need not be solved again."""
        try:
            record = self.store.read(case.key)
        except DamagedCase as damage:
            self._discard(case, f"its file is damaged ({damage})")
            return False
        hung, limit = record["status"] == "hung", record.get("seconds") or 0.0
        if hung and (self.seconds is None or self.seconds > limit):
            self._discard(case, f"its time limit was {limit:g} s and is higher now")
            return False
        self.failed += record["status"] != "solved"
        return True

    def _hand_out(self) -> None:
        """Put as many cases in flight as the place takes; one that killed a process flies alone."""
        while self._ready and len(self._flying) < self.place.slots():
            case = self._ready.popleft()
            if case.refusal:
                self._keep(case, {"record": {"status": "refused", "reason": case.refusal}})
            else:
                self._submit(case)
        if self._alone and not (self._ready or self._flying):
            self._submit(self._alone.popleft())

    def _submit(self, case: Case) -> None:
        self._flying[case.key] = case
        motion = None if case.parent is None else self.store.motion(case.parent)
        task = {
            "subject": self.plan.study.subject,
            "configuration": self.plan.configuration(case),
            "motion": motion,
            "keep_motion": self.plan.study.warm,
        }
        future = self.place.submit(task, self.seconds)
        future.add_done_callback(functools.partial(self._note, case.key))

    def _note(self, key: str, future: Future[Outcome]) -> None:
        """Called by the thread that waited for a case."""
        self._ended.put((key, future))

    def _collect(self) -> None:
        """Keep what has come back, waiting a moment for the first."""
        if not self._flying:
            return
        try:
            key, future = self._ended.get(timeout=PATIENCE)
        except queue.Empty:
            self._say()
            return
        case = self._flying.pop(key)
        outcome = future.result()
        if outcome["record"]["status"] == "killed" and key not in self._tried:
            self._tried.add(key)
            self._alone.append(case)
            self.console.progress(
                f"case {case.number + 1}: {outcome['record']['reason']}; it is "
                "tried once more, alone"
            )
        else:
            self._keep(case, outcome)
        self._say()

    def _keep(self, case: Case, outcome: Outcome) -> None:
        """Write what came of a case, and free those that waited for it."""
        record = {
            "key": case.key,
            "subject": self.plan.study.subject,
            "mode": self.plan.study.mode,
            "start": case.parent,
            "configuration": {} if case.refusal else self.plan.configuration(case),
            **outcome["record"],
        }
        self.store.write(record, outcome.get("motion"))
        self.done.add(case.key)
        self.computed += 1
        self.failed += record["status"] != "solved"
        self._ready.extend(self._waiting.pop(case.key, ()))

    def _say(self) -> None:
        """Where the sweep stands: rate and time left come from this run alone."""
        elapsed, missing = time.monotonic() - self._begin, self._missing - self.computed
        total = len(self.done) + missing
        line = f"{len(self.done)} of {total} cases"
        if self.computed:
            rate = self.computed / elapsed
            line += f", {60 * rate:.3g} a minute, about {in_words(missing / rate)} left"
        self.console.live(line + (f"; {self.failed} without a solution" if self.failed else ""))


def in_words(seconds: float) -> str:
    """A time as a person says it."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    if seconds < 5400.0:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"
