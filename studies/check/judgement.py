"""What a check of any profile comes to: criteria, a verdict in one sentence, and a result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from studies.check.reading.profile import MeasuredProfile
from studies.common.comparison_table import TableRow, costs_elsewhere
from studies.common.folder import provenance
from studies.common.result import Criterion, Result, Series, Verdict, outcome

PROFILE = "profile"  # name of the profile as a law among others


def verdict_of(checks: Sequence[Criterion], size: str) -> Verdict:
    """The verdict on a profile, which is measured and never optimal: whether it keeps its checks.

    Parameters
    ----------
    checks : what the profile was held against.
    size : what it comes to, in words.
    """
    failed = [check for check in checks if not check.passed]
    open_still = [check for check in checks if not check.decided]
    if failed:
        more = f" and {len(failed) - 1} more" if len(failed) > 1 else ""
        answer = f"no, it fails {len(failed)} of {len(checks)} checks: {_plain(failed[0])}{more}"
    elif open_still:
        named = "; ".join(map(_plain, open_still))
        answer = (
            f"not decided: it fails none of {len(checks)} checks for certain, but "
            f"{len(open_still)} {'is' if len(open_still) == 1 else 'are'} not decided: {named}"
        )
    else:
        answer = f"yes, it passes all {len(checks)} checks"
    return Verdict("measured", f"{answer}; {size}")


def _plain(check: Criterion) -> str:
    """The sentence of a check without its outcome."""
    return check.sentence.removeprefix(f"{outcome(check.passed, check.decided)}: ")


def judged(
    measured: MeasuredProfile,
    *,
    kind: str,
    question: str,
    configuration: Mapping[str, Any],
    arrays: Mapping[str, Series],
    table: tuple[TableRow, ...],
    checks: tuple[Criterion, ...],
    size: str,
    remarks: Sequence[str],
    details: Mapping[str, Any],
    bounds: Mapping[str, float] | None = None,
) -> Result:
    """The result of a check.

    Parameters
    ----------
    measured : MeasuredProfile
        As it was read; what was noticed then comes first among the remarks.
    kind, question, configuration : of the study that it was held against.
    arrays, table : the profile beside the other laws.
    checks : what it was held against.
    size : what it comes to, for the verdict.
    remarks : in the order in which they are read; empty ones are left out.
    details : what belongs to this kind of profile.
    bounds : proven, by quantity, where there are any.
    """
    return Result(
        kind=kind,
        question=question,
        configuration=configuration,
        arrays=arrays,
        table=table,
        bounds=bounds or {},
        verdict=verdict_of(checks, size),
        checks=checks,
        costs_elsewhere=costs_elsewhere(table),
        remarks=(*measured.notes, *(remark for remark in remarks if remark)),
        details={"profile_of": PROFILE, **details},
        provenance=provenance(),
    )
