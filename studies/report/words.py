"""A result in sentences: its answer, gains and costs, the basis of its verdict, its limits."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from studies import registry
from studies.common.comparison_table import OUTSTANDING, WORSE, TableRow, behind
from studies.common.console import number
from studies.common.result import Criterion, Result

MOST_GAINS = 6
MOST_FAILED = 3  # checks that an answer names
NOTHING = 1e-9  # in SI units: less of any quantity of a table is rounding
MANY_TIMES = 1e6
SAME = 5e-4  # relative: closer is the same, to three digits of a percentage
MEETS = 1e-6  # relative: closer to a bound is on it, to the digits that are printed
KINDS = {
    "global": ("Proven optimum", "good"),
    "local": ("Best of several starts", "unsure"),
    "measured": ("Evaluated, not optimised", "good"),
    "unverified": ("Not verified", "bad"),
    "infeasible": ("No feasible motion", "bad"),
    "none": ("No answer", "bad"),
}
_ANSWERS = {
    "global": "A motion was found, and it is proven to be optimal.",
    "local": "A motion was found that meets all requirements.",
    "measured": "The motion was evaluated; the table below lists its numbers.",
    "unverified": "A motion was computed, but a check of it failed.",
    "infeasible": "No motion meets all requirements.",
    "none": "There is no answer yet.",
}
_MEANS = {
    "global": "The motion reaches a proven bound, so no other motion under these caps is better.",
    "local": "No better motion was found near this one. A very different motion may be better: "
    "there is no proof of the contrary.",
    "measured": "Nothing was optimised. The numbers describe the given motion.",
    "unverified": "A check failed. Do not use this motion before you know why.",
    "infeasible": "It is proven that no motion meets all requirements.",
    "none": "The study found no motion.",
}


# the same for many cases, whose columns are not laws to compare
_MEANS_OF_CASES = {
    "global": "Each case reaches a proven bound, so no other motion under its caps is better.",
    "local": "Each case is the best of its starts. In at least one case there is no proof that no "
    "other motion is better.",
    "measured": "Nothing was optimised. The numbers describe the given motions.",
    "none": "No case found a motion.",
}


def answers(result: Result) -> str:
    """The content of the columns of a result's table."""
    study = registry.study_of(result.kind)
    return "motion" if study is None else study.answers


def answer(result: Result) -> list[str]:
    """The answer to the question of a result: first what failed, then what was found."""
    if answers(result) == "cases":
        return _of_cases(result)
    first = _of_checks(result)
    sentences = [_least(result, row) for row in result.table if row.minimised]
    if sentences and result.also_found and answers(result) != "parts":
        first += _ends(result)
        first.append(f"The numbers below belong to one motion between them, {result.laws[0]}.")
    if not sentences:
        sentences = [] if first else [_ANSWERS[result.verdict.kind]]
        sentences += [f"{gain}." for gain in gains(result)[:3]] or _first_values(result)
    elif _no_other_law(result):
        sentences.append(_no_other_law(result))
    if result.verdict.kind in ("global", "local"):
        bounded = [row for row in result.table if row.minimised and row.bound]
        sentences += [_bounded(row, result) for row in bounded if not _stated_limit(row, result)]
    return first + sentences


def _of_checks(result: Result) -> list[str]:
    """Whether a profile keeps its checks; of other results, which checks failed."""
    checks = result.checks
    failed = [_plain(check) for check in checks if not check.passed]
    open_still = [_plain(check) for check in checks if not check.decided]
    if failed:
        begun = "No: it violates" if answers(result) == "profile" else "The motion fails"
        more = f"; and {len(failed) - MOST_FAILED} more" if len(failed) > MOST_FAILED else ""
        named = "; ".join(failed[:MOST_FAILED])
        return [f"{begun} {len(failed)} of {len(checks)} checks: {named}{more}."]
    if answers(result) != "profile" or not checks:
        return []
    if open_still:
        return [f"Not decided, because of noise or rounding: {'; '.join(open_still)}."]
    return [f"Yes: it keeps {_all(len(checks)).lower()}."]


def _plain(check: Criterion) -> str:
    """The sentence of a check without its outcome."""
    return check.sentence.partition(": ")[2] or check.sentence


def _ends(result: Result) -> list[str]:
    """The ends of a Pareto front, by its objectives."""
    rows = [row for row in result.table if row.minimised]
    places = [
        ", ".join(f"{row.title} {number(row.values[end], 6)}{behind(row.unit)}" for row in rows)
        for end in result.also_found
        if all(math.isfinite(row.values.get(end, math.nan)) for row in rows)
    ]
    return [f"The Pareto front has these ends: {'; '.join(places)}."] if places else []


def _stated_limit(row: TableRow, result: Result) -> bool:
    """Whether a bound is the least duration that the study itself allows."""
    stated = result.configuration.get("duration")
    low = stated[0] if isinstance(stated, list) and stated else stated
    return row.key == "time" and row.bound == low


def _breaking(result: Result) -> dict[str, TableRow]:
    """Laws that break a cap, each with the row of the first one."""
    found: dict[str, TableRow] = {}
    for row in result.table:
        for law in row.broken_by:
            found.setdefault(law, row)
    return found


def _no_other_law(result: Result) -> str:
    """That only the result's own law keeps the caps; empty if that is not so."""
    breaking = _breaking(result)
    others = [law for law in result.compared_with if law in breaking]
    own = next(iter(result.laws), "")
    if not others or own in breaking or len(others) < len(result.compared_with):
        return ""
    words = [
        f"{law} has a {row.title} of {number(row.values[law], 6)}{behind(row.unit)} "
        f"(cap {number(row.cap, 6)})"
        for law in others
        for row in [breaking[law]]
    ]
    return f"No other law of the table keeps the caps: {', '.join(words)}."


def _of_cases(result: Result) -> list[str]:
    """The range of the answers: of the objectives, the quantities shown, or the first ones."""
    names = result.configuration.get("show") or [row.key for row in result.table if row.minimised]
    rows = [row for row in result.table if row.key in names] or result.table
    sentences = [_ANSWERS["none"]] if not rows else []
    for row in rows[:3]:
        least, most = row.values["least"], row.values["greatest"]
        if least == most:
            sentences.append(
                f"The {row.title} is {number(least, 6)}{behind(row.unit)} in all cases."
            )
            continue
        # cases that differ only by rounding share the minimum
        reach = least + MEETS * abs(least)
        first, *others = np.flatnonzero(result.arrays[row.key].values <= reach).tolist()
        more = f", with the same value in {len(others)} more" if others else ""
        sentences.append(
            f"The {row.title} lies between {number(least, 6)} and {number(most, 6)}"
            f"{behind(row.unit)}. The minimum is at {_stated(result, first)}{more}."
        )
    return sentences


def _stated(result: Result, case: int) -> str:
    """The keys that vary, as a case has them."""
    units = result.details["units"]
    point = zip(result.configuration["parameters"], result.details["points"][case], strict=True)
    words = []
    for key, value in point:
        if value is not None:
            text = number(value, 6) if isinstance(value, float) else str(value)
            words.append(f"{key} = {text} {units.get(key, '')}".rstrip())
    return ", ".join(words) or "the base study"


def _first_values(result: Result) -> list[str]:
    """The first quantities of a result that has nothing to be compared with."""
    rows = [row for row in result.table if math.isfinite(next(iter(row.values.values()), math.nan))]
    judged = [row for row in rows if row.better != "neither"] or rows
    return [
        f"{_begun(row.title)}: {number(next(iter(row.values.values())), 6)}{behind(row.unit)}."
        for row in judged[:3]
    ]


def _least(result: Result, row: TableRow) -> str:
    value, unit = row.values.get(result.laws[0], math.nan), behind(row.unit)
    in_parts = answers(result) == "parts"
    breaking = _breaking(result)
    keeping = [law for law in result.compared_with if law not in breaking]
    beside = result.also_found if in_parts else keeping
    others = {law: row.values.get(law, math.nan) for law in beside}
    known = {law: other for law, other in others.items() if math.isfinite(other)}
    sentence = f"The {row.title} is {number(value, 6)}{unit}"
    if known and in_parts:
        parts = ", ".join(f"{part} {number(other, 6)}{unit}" for part, other in known.items())
        return f"{sentence}: {parts}."
    if not known or not math.isfinite(value):
        return f"{sentence}."

    best = min(known, key=lambda law: known[law])
    if known[best] <= 0.0:
        return f"{sentence}; {best} has {number(known[best], 6)}{unit}."
    change = 1 - value / known[best]
    word = "less" if change >= 0 else "more"
    much = f"{number(100 * abs(change), 3)} % {word} than" if abs(change) > SAME else "the same as"
    kept = " that keep the caps" if breaking else ""
    return (
        f"{sentence}: {much} that of {best} ({number(known[best], 6)}{unit}), the best of the "
        f"other laws{kept}."
    )


def _bounded(row: TableRow, result: Result) -> str:
    value, bound = row.values[result.laws[0]], row.bound or math.nan
    gap = value / bound - 1
    close = f"is above it by {100 * gap:.2g} %" if gap > MEETS else "meets it"
    return f"The proven lower bound is {number(bound, 6)}{behind(row.unit)}; this motion {close}."


def gains(result: Result) -> list[str]:
    """Quantities in which the result is clearly better than the best other law, greatest first."""
    found = [(math.inf, "A motion within the caps: no other law of the table keeps them")]
    found = found if _no_other_law(result) else []
    for row in result.table:
        ratio, best = _gain(row, result.compared_with)
        if ratio > WORSE:
            own = next(iter(row.values))
            times = f"{_times(ratio)} times {'less' if row.better == 'less' else 'more'}"
            if ratio < 2 and row.better == "less":
                times = f"{100 * (1 - 1 / ratio):.0f} % less"
            values = f"{number(row.values[own], 4)} instead of {number(row.values[best], 4)}"
            # a ratio to almost zero has no meaning
            said = f"{times} than {best}, " if ratio < MANY_TIMES else ""
            of = "" if said else f" of {best}"
            found.append((ratio, f"{_begun(row.title)}: {said}{values}{behind(row.unit)}{of}"))
    found.sort(key=lambda item: -item[0])
    return [sentence for _, sentence in found[:MOST_GAINS]]


def _times(ratio: float) -> str:
    """A ratio with three digits, and without a power of ten below a million."""
    text = f"{ratio:.3g}"
    return f"{float(text):.0f}" if 100 <= ratio < 1e6 else text


def _begun(text: str) -> str:
    return text[:1].upper() + text[1:]


def _gain(row: TableRow, laws: Sequence[str]) -> tuple[float, str]:
    """How many times better the first law is than the best of others; 0 if nothing is known."""
    own = next(iter(row.values), "")
    others = {k: v for k, v in row.values.items() if k in laws and math.isfinite(v)}
    value = row.values.get(own, math.nan)
    if row.better == "neither" or not others or not math.isfinite(value):
        return 0.0, ""
    sign = 1.0 if row.better == "less" else -1.0
    best = min(others, key=lambda law: sign * others[law])
    worse, better = (others[best], value) if row.better == "less" else (value, others[best])
    least = max(row.negligible, NOTHING)
    return (worse / max(better, least) if worse > least else 0.0), best


def costs(result: Result) -> list[str]:
    """The quantities in which the result is worse."""
    return [_begun(cost.sentence) for cost in result.costs_elsewhere]


def outstanding(result: Result) -> bool:
    """Whether a cost is so large that the page highlights it."""
    return any(cost.ratio > OUTSTANDING for cost in result.costs_elsewhere)


def compared(result: Result) -> bool:
    """Whether there is anything to compare with."""
    several = bool(result.compared_with) and answers(result) != "cases"
    return several and any(row.better != "neither" for row in result.table)


def _passed(checks: Sequence[Criterion]) -> str:
    """The sentence on checks none of which failed."""
    open_still = [check.sentence for check in checks if not check.decided]
    if not open_still:
        return f"{_all(len(checks))} passed; see Verification."
    return f"{len(open_still)} of {len(checks)} checks are not decided: {'; '.join(open_still)}."


def rests_on(result: Result) -> list[str]:
    """The reasons for the verdict, and its limits."""
    means = {**_MEANS, **_MEANS_OF_CASES} if answers(result) == "cases" else _MEANS
    sentences = [means[result.verdict.kind]]
    checks = result.checks
    if checks:
        failed = [check for check in checks if not check.passed]
        sentences.append(
            f"{len(failed)} of {len(checks)} checks failed: "
            + "; ".join(check.sentence for check in failed)
            if failed
            else _passed(checks)
        )
    sentences += _starts(result.details.get("starts"), result.details.get("basins"))
    accuracy = result.details.get("accuracy")
    miss = accuracy.get("replay_miss_relative") if isinstance(accuracy, dict) else None
    if isinstance(miss, float):
        sentences.append(
            f"An independent integrator replayed the motion and missed its end by {miss:.1g} of "
            "the displacement."
        )
    return sentences


def _all(count: int) -> str:
    return "The one check" if count == 1 else f"All {count} checks"


def _starts(starts: object, basins: object) -> list[str]:
    if not isinstance(starts, list) or not starts:
        return []
    count = f"{len(starts)} start{'s' if len(starts) > 1 else ''}"
    if isinstance(basins, list) and basins:
        optima = (
            f"{len(basins)} local optimum"
            if len(basins) == 1
            else f"{len(basins)} different local optima"
        )
        return [f"The search had {count} and found {optima}."]
    return [f"The search had {count}."]


def limits(result: Result) -> list[str]:
    """Assumptions and remarks of the result, and the limits of its mechanism."""
    sentences = list(result.remarks)
    if result.interrupted:
        sentences.append("The study was interrupted: a longer one may find a better motion.")
    mechanism = registry.mechanism_of(result.kind)
    return [*sentences, *(mechanism.limits if mechanism is not None else ())]
