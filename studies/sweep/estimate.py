"""What a sweep will take, said before anything runs."""

from __future__ import annotations

import statistics

from studies.sweep.cases.plan import Plan
from studies.sweep.cases.store import CaseStore, DamagedCase
from studies.sweep.driver import in_words
from studies.sweep.subjects import SUBJECTS

READ = 200  # files whose times are looked at


def plan_text(plan: Plan, store: CaseStore, workers: int) -> str:
    """How many cases, how many of them are there, and about how long the others will take."""
    present = store.keys()
    keys = {case.key for case in plan.cases if not case.refusal}
    known, refused = keys & present, [case for case in plan.cases if case.refusal]
    missing = len(keys - present)
    seconds, source = _seconds(plan, store, sorted(known))
    lines = [
        plan.study.question,
        f"{len(plan.cases)} cases, {len(known)} of which are in {store.folder}"
        + (f"; {len(refused)} are refused, such as: {refused[0].refusal}" if refused else ""),
        f"about {in_words(missing * seconds / workers)} for the other {missing} on {workers} "
        f"worker{'s' if workers > 1 else ''}, at {seconds:.3g} s a case ({source})",
    ]
    lines += [f"left out: {count} cases of {name}" for name, count in store.others().items()]
    return "\n".join(lines)


def _seconds(plan: Plan, store: CaseStore, known: list[str]) -> tuple[float, str]:
    """Time of a case [s], and where that is known from."""
    times = []
    for key in known[:READ]:
        try:
            times.append(float(store.read(key)["seconds"]))
        except (DamagedCase, KeyError, TypeError):
            continue
    if times:
        return statistics.fmean(times), f"mean of {len(times)} cases in the folder"
    full, coarse = SUBJECTS[plan.study.subject].seconds
    return (coarse if plan.study.coarse else full), "a rough guess: no case has run yet"
