"""A profile of the truss held against caps, model, optimum and the paper's laws.

Nothing of the profile is optimised. A cap counts as broken only if it is broken wherever within
its bounds the true motion lies.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from models.laws import Law
from ocp.arrays import Array
from studies.check.ends import Most, at_rest, end_rate
from studies.check.floors import (
    estimated_floors,
    exact_rows,
    floors_of_noise,
    proven_floors,
    sign,
)
from studies.check.judgement import PROFILE, judged
from studies.check.optimum import optimum_of
from studies.check.reading.profile import MeasuredProfile
from studies.check.smoothing.recovery import how_smoothed, sure
from studies.check.truss_profile import TrussProfile, recover_truss
from studies.common.comparison_table import TableRow
from studies.common.console import Console, number
from studies.common.result import Criterion, Result, Series, at_most, outcome
from studies.truss.bars import bars_of
from studies.truss.carrier import refuse_arm
from studies.truss.checks import broken_caps, cap_of, end_names, restart_in_words, table_rows
from studies.truss.config import DEPLOYED, TrussStudy, as_dictionary
from studies.truss.limits.bounds import lower_bounds
from studies.truss.limits.tolerances import (
    BACKWARD,
    IMBALANCE,
    PROFILE_MISS,
    REST,
)
from studies.truss.margins import margins_of
from studies.truss.motions.deployment import COLUMNS, Deployment, profile
from studies.truss.motions.laws import BEFORE, OPTIMUM, RATES, deployment_of, paper_laws_of
from studies.truss.quantities import QUANTITIES, Quantity

MOST_ROWS = 4000  # of the file that are kept for the figures
ALIKE = 0.005  # relative: peaks that differ by less are called equal
UNSURE = 1e-3  # of a cap: by which the highest that a peak may be is beyond it and leaves it open


@dataclass(frozen=True)
class PeakRange:
    """A peak of the profile.

    Attributes
    ----------
    value, time : of the recovered motion, and when it is taken [s].
    low, high : least and greatest that it may be.
    estimated : whether the lower one, or of a least value the upper one, is estimated from the
        rows, as it is wherever they are noisy, without a proof.
    """

    value: float
    time: float
    low: float
    high: float
    estimated: bool = False

    @property
    def bound(self) -> float:
        """By how much it may be wrong, relative to its value."""
        size = abs(self.value) or 1.0
        return max(self.high - self.value, self.value - self.low) / size


def check_truss(
    measured: MeasuredProfile,
    study: TrussStudy,
    stated: tuple[float, float] | None = None,
    console: Console | None = None,
    optimum: bool = True,
) -> Result:
    """Hold a profile against the caps and the model of a study.

    Parameters
    ----------
    measured : MeasuredProfile
    study : TrussStudy
        Of the profile's own duration.
    stated : (float, float), optional
        Least and longest duration that the user asks for [s].
    console : Console, optional
        Where progress is said.
    optimum : bool
        Whether the optimum is put beside it.

    Returns
    -------
    Result
        Of the kind "check".

    Raises
    ------
    StudyError
        If its columns make no motion of this truss.
    """
    refuse_arm(study.arm, "a check of a profile")
    found = recover_truss(measured, study.truss)
    law = found.reachable(study.truss)
    deployment = deployment_of(PROFILE, law, study)
    ranges = peak_ranges(found, deployment)
    best, remark = optimum_of(study, console or Console()) if optimum else (None, "")
    beside = [*([best] if best else []), *paper_laws_of(study, measured.duration)]

    bounds = lower_bounds(study, None, longest=measured.duration)
    broken = broken_caps(study, _extremes(ranges, worst=False))
    table = _table(study, [deployment, *beside], bounds, broken)
    margins, bars = margins_of(deployment), bars_of(deployment, study.caps)
    return judged(
        measured,
        kind="check",
        question=f"Does the profile {measured.path.name} keep the caps of this study? "
        f"{study.question}",
        configuration=as_dictionary(study),
        arrays=_series(found, deployment, beside),
        table=table,
        bounds=bounds,
        checks=(
            *_criteria(study, found, deployment, ranges, broken, stated),
            *bars.checks,
            *margins.checks,
        ),
        size=_size(study, table, ranges),
        remarks=[
            *margins.sentences,
            *bars.sentences,
            *restart_in_words(deployment),
            *_about(found),
            remark,
            *comparison(table, ranges),
        ],
        details={
            "noise": found.recovered.noise._asdict() | {"of": found.source},
            "bias_of_peak_acceleration_relative": found.recovered.bias,
            "peaks": {key: dataclasses.asdict(peak) for key, peak in ranges.items()},
            **margins.details,
        },
    )


def peak_ranges(found: TrussProfile, deployment: Deployment) -> dict[str, PeakRange]:
    """Every peak of the profile with its bounds."""
    truss, recovered = deployment.truss, found.recovered

    def heights(law: Law, time: Array) -> dict[str, Array]:
        history = dataclasses.replace(deployment, law=found.reachable(truss, law)).histories(time)
        return {key: sign(key) * values for key, values in history.items()}

    times = np.array([time for _, time in deployment.extremes.values()])
    drawn = recovered.ranges(heights, times[np.isfinite(times)])
    proven, estimated = {}, {}
    if recovered.fit is None:
        proven, estimated = proven_floors(found, deployment), estimated_floors(found, deployment)
    else:
        estimated = floors_of_noise(found, deployment)

    ranges = {}
    for key, (value, time) in deployment.extremes.items():
        if key in drawn:
            low, high = drawn[key]
            unknown = low if found.smooth else -math.inf
            ends = (min(low, estimated.get(key, unknown)), high)
        else:  # only the drawn curve is known to be as high
            height = sign(key) * value
            floor = proven.get(key, estimated.get(key, -math.inf if sign(key) < 0 else 0.0))
            ends = (min(floor, height), height)
        if sign(key) > 0:  # noise alone makes no peak negative
            ends = (max(ends[0], 0.0), ends[1])
        low, high = sorted(sign(key) * end for end in ends)
        ranges[key] = PeakRange(value, time, min(low, value), max(high, value), key not in proven)
    return ranges


def _extremes(ranges: Mapping[str, PeakRange], *, worst: bool) -> dict[str, float]:
    """The worst, or the best, that each peak may be: of a least value that is the lowest."""
    return {
        key: p.high if worst is (QUANTITIES[key].kind != "least") else p.low
        for key, p in ranges.items()
    }


def _table(
    study: TrussStudy,
    laws: Sequence[Deployment],
    bounds: Mapping[str, float],
    broken: Mapping[str, float],
) -> tuple[TableRow, ...]:
    """The table, with the profile's own caps judged within its bounds."""
    own = laws[0].name

    def marked(row: TableRow) -> TableRow:
        others = tuple(law for law in row.broken_by if law != own)
        return dataclasses.replace(row, broken_by=(own, *others) if row.key in broken else others)

    return tuple(map(marked, table_rows(study, laws, bounds)))


def _criteria(
    study: TrussStudy,
    found: TrussProfile,
    deployment: Deployment,
    ranges: Mapping[str, PeakRange],
    broken: Mapping[str, float],
    stated: tuple[float, float] | None,
) -> tuple[Criterion, ...]:
    held = [*_at_the_ends(study, found, ranges, broken), *_within_reach(found)]
    if stated is not None:
        held.append(_duration(found, stated))
    drawn = broken_caps(study, {key: peak.value for key, peak in ranges.items()})
    worst = broken_caps(study, _extremes(ranges, worst=True))
    possible = {key for key, part in worst.items() if part > UNSURE}
    for key, peak in ranges.items():
        cap = cap_of(study, key)
        if cap is not None:
            part = broken.get(key, 0.0)
            held.append(_cap(key, peak, cap, part, beyond=key in drawn, possible=key in possible))

    law = found.recovered.law.motion(np.linspace(0.0, deployment.law.duration, MOST_ROWS))
    noisy = law.speed.min() < 0 or law.angle.max() > DEPLOYED
    if not noisy:  # noise that was taken back has no energy of its own
        imbalance = deployment.energies.imbalance
        held.append(at_most("energy imbalance", "1", imbalance, IMBALANCE))
    return tuple(held)


def _at_the_ends(
    study: TrussStudy,
    found: TrussProfile,
    ranges: Mapping[str, PeakRange],
    broken: Mapping[str, float],
) -> list[Criterion]:
    """Between the right angles, from rest or the stated rate to rest, but for noise.

    The acceleration of a motion that is under way at its start may be any.
    """
    recovered, opening = found.recovered, study.opening
    duration = recovered.law.duration
    ends = recovered.law.motion(np.array([0.0, duration]))
    wanted = zip((0.0, duration), (opening.start, opening.end), end_names(study), strict=True)

    held = []
    for place, (time, angle, word) in enumerate(wanted):
        miss = abs(float(ends.angle[place]) - angle)
        limit = PROFILE_MISS + recovered.deviation(time, 0) + float(found.rounding[-place])
        held.append(at_most(f"miss of the {word} angle", "rad", miss, limit))
    most = _most(study, ranges, broken)
    speeds = ends.speed - np.array([opening.rate, 0.0])
    rates = [("speed", 1, "rad/s", speeds, "peak-speed")]
    if study.jerk_limited:  # else zero acceleration means nothing
        accelerations = ends.acceleration * np.array([not opening.rate, True])
        rates.append(("acceleration", 2, "rad/s^2", accelerations, "peak-acceleration"))
    for word, order, unit, values, key in rates:
        peak = ranges[key].value
        if not found.smooth and not found.stated:
            limit, drawn = REST * peak, np.abs(values)
            held.append(_by_rows(found, opening.rate, word, order, unit, drawn, limit, most))
            continue
        place = int(np.argmax(np.abs(values)))
        limit = REST * peak + recovered.deviation((0.0, duration)[place], order)
        worst = abs(float(values[place]))
        held.append(at_most(f"{word} at the {('start', 'end')[place]}", unit, worst, limit))
    return held


def _most(
    study: TrussStudy, ranges: Mapping[str, PeakRange], broken: Mapping[str, float]
) -> tuple[Most, ...]:
    """What the motion does at most: its caps, or if there is none or it is broken, as drawn.

    Without a limit on the jerk the acceleration may jump, and the drawn curve's jerk says nothing.
    """
    orders = {"acceleration": 2} | ({"jerk": 3} if study.jerk_limited else {})
    found = []
    for name, order in orders.items():
        key = f"peak-{name}"
        cap = None if key in broken else cap_of(study, key)
        most = ranges[key].high if cap is None else cap
        found.append(Most(name, f"rad/s^{order}", order, most))
    return tuple(found)


def _by_rows(
    found: TrussProfile,
    start_rate: float,
    word: str,
    order: int,
    unit: str,
    drawn: Array,
    limit: float,
    most: tuple[Most, ...],
) -> Criterion:
    """Rest at the worse end (2,) by the rows: the curve between them alone breaks nothing.

    At the start the speed counts by what it differs from the stated rate [rad/s].
    """
    time, angle, wrong = exact_rows(found)
    rates = [
        end_rate(time, angle - start_rate * (time - time[0]), wrong, order, most),
        end_rate(time[::-1], angle[::-1], wrong[::-1], order, most),
    ]
    beyond = [max(abs(rate.value) - rate.wrong, 0.0) for rate in rates]
    if start_rate and order > 1:
        beyond[0] = 0.0
    place = int(np.argmax(beyond if max(beyond) > limit else drawn))
    name = f"{word} at the {('start', 'end')[place]}"
    return at_rest(name, unit, float(drawn[place]), rates[place], limit)


def _within_reach(found: TrussProfile) -> list[Criterion]:
    """No motion backwards and none beyond the open truss, but for noise."""
    recovered, time = found.recovered, found.measured.time
    if not found.smooth:
        time, angle, wrong = exact_rows(found)
        width = PROFILE_MISS + (0.0 if found.recovered.fit is None else wrong)
        back = np.append(np.maximum.accumulate(angle)[:-1] - angle[1:], 0.0)
        most = float(wrong.max()) if recovered.fit is not None else 0.0
        back_limit = np.full(time.size, PROFILE_MISS * 1e-4 + 2 * most)
        width, unit, what = width * np.ones(time.size), "rad", "backward motion"
    else:
        time, width = recovered.band(0)
        _, back_limit = recovered.band(1)
        motion = recovered.law.motion(time)
        angle, back, unit, what = motion.angle, -motion.speed, "rad/s", "backward speed"
        # a spline that ends at rest does so to rounding
        back_limit = back_limit + BACKWARD * float(np.max(np.abs(motion.speed)))
        width = width + PROFILE_MISS

    held = []
    for name, size, value, limit in (
        (what, unit, back, back_limit),
        ("overshoot beyond 90 deg", "rad", angle - DEPLOYED, width),
    ):
        place = int(np.argmax(value - limit))
        amount, allowed = max(float(value[place]), 0.0), float(limit[place])
        passed = float(value[place]) <= allowed
        sentence = (
            f"{outcome(passed)}: {name} of {amount:.3g} {size} at {time[place]:.5g} s "
            f"(noise may make {allowed:.3g})"
        )
        held.append(Criterion(name, size, amount, allowed, passed, sentence))
    return held


def _duration(found: TrussProfile, stated: tuple[float, float]) -> Criterion:
    low, high = stated
    own, slack = found.measured.duration, found.measured.spacing / 2
    passed = low - slack <= own <= high + slack
    asked = f"{low:.6g} s" if low == high else f"{low:.6g} to {high:.6g} s"
    sentence = f"{outcome(passed)}: duration {own:.6g} s (asked for {asked})"
    return Criterion("duration", "s", own, high, passed, sentence)


def _cap(
    key: str, peak: PeakRange, cap: float, excess: float, *, beyond: bool, possible: bool
) -> Criterion:
    quantity = QUANTITIES[key]
    within = f", in [{peak.low:.6g}, {peak.high:.6g}]" if peak.high > peak.low else ""
    value = f"{quantity.title} {peak.value:.6g} {quantity.unit} at {peak.time:.5g} s{within}"
    passed = excess <= 0
    decided = not (passed and (beyond or possible))
    more = ""
    if not passed:
        more = f", {_by_how_much(quantity, cap, excess, peak.estimated)}"
    elif not decided:  # beyond it is the drawn curve alone, or no more than the noise
        more = f", a motion within the bounds may {'keep' if beyond else 'exceed'} it"
    sentence = f"{outcome(passed, decided)}: {value} (cap {cap:.6g}{more})"
    return Criterion(quantity.title, quantity.unit, peak.value, cap, passed, sentence, decided)


def _by_how_much(quantity: Quantity, cap: float, excess: float, estimated: bool) -> str:
    """In words, by how much a cap is broken."""
    part = f"{100 * excess:.3g} %"
    if quantity.kind == "least":
        how = "an estimated" if estimated else "at least"
        return (
            f"short by {how} {part}"
            if cap > 0
            else f"the rope would have to push, by {how} {part} of its force"
        )
    return f"{'exceeded by an estimated' if estimated else 'broken by at least'} {part}"


def _about(found: TrussProfile) -> list[str]:
    """What the noise is, what was done about it, and what that does to the peaks."""
    recovered, unit = found.recovered, {"angle": "rad", "rope_length": "m"}[found.source]
    noise, rest = recovered.noise, recovered.rest
    lines = []
    if recovered.fit is None:
        seen = noise.deviation
        lines.append(f"noise: negligible ({seen:.1e} {unit}); {sure(recovered)}")
    else:
        rounded = f", at least the rounding to {noise.step:.3g} {unit}" if noise.step else ""
        lines.append(
            f"noise: {recovered.fit.noise:.3g} {unit} (standard deviation{rounded}); "
            f"{how_smoothed(recovered.fit)}; bias of the peak acceleration "
            f"about {100 * recovered.bias:+.2g} %; {sure(recovered)}"
        )
    words = ("moving", "at rest in speed", "at rest in speed and acceleration")
    lines.append(f"the start is taken as {words[rest[0]]}, the end as {words[rest[1]]}")
    return lines


def comparison(table: Sequence[TableRow], ranges: Mapping[str, PeakRange]) -> list[str]:
    """For each peak: how large, when, how sure, and how far from that of each other law."""
    lines = []
    for row in table:
        peak = ranges.get(row.key)
        if peak is None or not math.isfinite(peak.value):
            continue
        _, *others = row.values
        beside = [_against(peak.value, row.values[law], law) for law in others]
        sure_to = f" +- {100 * peak.bound:.2g} %" if peak.high > peak.low else ""
        lines.append(
            f"{row.title} {number(peak.value, 6)} {row.unit}{sure_to} at {peak.time:.5g} s: "
            f"{', '.join(words for words in beside if words)}"
        )
    return lines


def _against(value: float, other: float, law: str) -> str:
    if not math.isfinite(other) or other == 0:
        return ""
    ratio = value / other - 1
    if abs(ratio) < ALIKE:
        return f"that of {law}"
    return f"{abs(100 * ratio):.3g} % {'above' if ratio > 0 else 'below'} {law}"


def _size(study: TrussStudy, table: Sequence[TableRow], ranges: Mapping[str, PeakRange]) -> str:
    """What the profile comes to in the first objective of the study, for its verdict."""
    first = study.objectives[0]
    row = next(row for row in table if row.key == first)
    (_, own), *others = row.values.items()
    bound = f" +- {100 * ranges[first].bound:.2g} %" if first in ranges else ""
    beside = [_against(own, other, law) for law, other in others[:1]]
    return ", ".join([f"{row.title} {number(own, 4)} {row.unit}{bound}", *beside])


def _series(
    found: TrussProfile, deployment: Deployment, beside: Sequence[Deployment]
) -> dict[str, Series]:
    """The recovered profile, the file's rows, the bands, and the optimum for the figures."""
    arrays = {
        name: Series(COLUMNS[name][0], "time", values, COLUMNS[name][1])
        for name, values in profile(deployment).items()
    }
    time, recovered = found.measured.time, found.recovered
    kept = np.unique(np.linspace(0, time.size - 1, min(time.size, MOST_ROWS)).round().astype(int))
    arrays |= _axis("rows", time[kept], "as in the file", {"angle": ("rad", found.angle[kept])})

    if recovered.fit is not None:
        units = {"angle": "rad", "speed": "rad/s", "acceleration": "rad/s^2"}
        bands = {
            name: (unit, recovered.band(order)[1])
            for order, (name, unit) in enumerate(units.items())
        }
        meaning = "half-width of the band that contains the true motion"
        arrays |= _axis("band", recovered.band(0)[0], meaning, bands)
    for columns in (profile(other) for other in beside if other.name == OPTIMUM):
        names = ("angle", *RATES, BEFORE, "angular_jerk")
        taken = {name: (COLUMNS[name][0], columns[name]) for name in names}
        arrays |= _axis(OPTIMUM, columns["time"], "of the optimum", taken)
    return arrays


def _axis(
    prefix: str, axis: Array, meaning: str, columns: Mapping[str, tuple[str, Array]]
) -> dict[str, Series]:
    """Series of a prefix along their own time, each by its unit and values."""
    name = f"{prefix}/time"
    series = {name: Series("s", name, axis, "since the start")}
    for key, (unit, values) in columns.items():
        series[f"{prefix}/{key}"] = Series(unit, name, values, meaning)
    return series
