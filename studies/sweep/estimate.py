"""What a sweep will take, said before anything runs."""

from __future__ import annotations

import statistics
from collections.abc import Iterable
from dataclasses import replace

from studies.sweep.cases.plan import Plan
from studies.sweep.cases.store import CaseStore, DamagedCase
from studies.sweep.driver import in_words
from studies.sweep.subjects import subject

_SAMPLED = 3  # cases that are solved to measure how long one takes


def plan_text(plan: Plan, store: CaseStore, workers: int) -> str:
    """How many cases, how many of them are there, and about how long the others will take."""
    keys = {case.key for case in plan.cases if not case.refusal}
    refused = [case for case in plan.cases if case.refusal]
    times, damaged = _read(store, keys & store.keys())
    missing = len(keys) - len(times)
    seconds, source = _seconds(plan, times)
    lines = [
        plan.study.question,
        f"{len(plan.cases)} cases, {len(times)} of which are in {store.folder}"
        + (f"; {len(refused)} are refused, such as: {refused[0].refusal}" if refused else ""),
        f"about {in_words(missing * seconds / workers)} for the other {missing} on {workers} "
        f"worker{'s' if workers > 1 else ''}, at {seconds:.3g} s a case ({source})",
    ]
    if damaged:
        lines.append(f"computed again: {damaged} cases whose files are damaged")
    lines += [f"not used: {count} cases of {name}" for name, count in store.others().items()]
    return "\n".join(lines)


def sample(plan: Plan, store: CaseStore) -> Plan | None:
    """A plan of a few cases, evenly from all, to be solved first; None if some were solved."""
    known, _ = _read(store, {case.key for case in plan.cases} & store.keys())
    first = [case for case in plan.cases if not case.refusal and case.parent is None]
    if known or not first:
        return None
    count = min(_SAMPLED, len(first))
    places = [(2 * k + 1) * len(first) // (2 * count) for k in range(count)]
    return replace(plan, cases=tuple(first[place] for place in places))


def _read(store: CaseStore, keys: Iterable[str]) -> tuple[list[float | None], int]:
    """Times of the cases whose files can be trusted [s], and how many cannot."""
    times, damaged = [], 0
    for key in keys:
        try:
            times.append(store.read(key).get("seconds"))
        except DamagedCase:
            damaged += 1
    return times, damaged


def _seconds(plan: Plan, times: Iterable[float | None]) -> tuple[float, str]:
    """Time of a case [s], and where that is known from."""
    known = [seconds for seconds in times if seconds is not None]
    if known:
        return statistics.fmean(known), f"mean of {len(known)} cases in the folder"
    full, coarse = subject(plan.study.subject)[1].seconds
    return (coarse if plan.study.coarse else full), "a rough guess: no case has run yet"
