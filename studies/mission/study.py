"""A mission from its configuration to its result.

Each stage has a least utilisation in a given time, by its own optimal motion, verified as that of a
study of its own. Stages follow each other from rest to rest, so that only their times couple them:
`studies.mission.split` shares these out.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from models.laws import Law
from models.ring_on_arm import arm_motion
from ocp.arrays import Array
from studies.common.comparison_table import TableRow
from studies.common.configuration import as_stated
from studies.common.console import Console, at_work
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.common.folder import provenance
from studies.common.processes.side_by_side import Part, side_by_side
from studies.common.result import Criterion, Result, Series, Verdict
from studies.common.rounding import up
from studies.common.stops import kept_anyway
from studies.mission.config import MissionStudy
from studies.mission.split import EQUAL, StageCurve, durations_at_the_caps, equal_split
from studies.mission.stages import (
    RING,
    STAGES,
    TURN,
    StageMotion,
    move,
    move_from,
    move_ring,
    move_ring_alone,
    rigid_duration,
)
from studies.mission.vibration import ArmResponse, arm_response
from studies.truss.bars import bars_of
from studies.truss.config import DEPLOYED
from studies.truss.limits.caps import Caps
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import paper_laws
from studies.truss.parts import Parts

UNFELT = 5e-3  # [%] of what a stage uses, which a per cent more time saves: nothing that one feels
WITHOUT = "optimum without arm"  # name of the best law that leaves the arm out
# The turn by 90 deg makes the axis of the elbow normal to that of the root. The ring is in the
# plane of the arm that carries it.
AXES = {"root": ("big arm",), "big arm": (TURN,), "elbow": ("small arm", RING)}
SHORTLY = 1e-6  # [s] after a stage, when its moment at the root is over
WITHIN = 1e-6  # relative: a cap that is exceeded by less is kept, as elsewhere


@dataclass(frozen=True, eq=False)
class Mission:
    """What was found, before it is a result.

    Attributes
    ----------
    study : that was asked.
    curves : part of the caps by which time is shared out, against duration, of each stage that
        has a motion.
    motions : the stages in the durations that were found, in order; if the user stopped, perhaps
        only the first ones.
    responses : of the arm to the ring, by law; empty without a motion of the ring.
    particle : energy left by the same laws if the ring's mass were a particle at the tip [J].
    alone : the best motion of the ring in its time that leaves the arm out; None without a ring.
    bars : forces in the bars of the ring, as of a study of the truss.
    stopped : whether the user stopped the search.
    """

    study: MissionStudy
    curves: Sequence[StageCurve]
    motions: Sequence[StageMotion]
    responses: Mapping[str, ArmResponse]
    particle: Mapping[str, float]
    alone: StageMotion | None
    bars: Parts
    stopped: bool = False

    @property
    def whole(self) -> bool:
        """Whether each stage has a motion."""
        return len(self.motions) == len(STAGES)

    @property
    def starts(self) -> list[float]:
        """When each stage begins [s]."""
        lasting = [motion.duration + self.study.dwell for motion in self.motions]
        return [0.0, *np.cumsum(lasting[:-1]).tolist()]

    @property
    def total(self) -> float:
        """Of all stages and dwells [s]."""
        return math.fsum(motion.duration + self.study.dwell for motion in self.motions)

    @property
    def largest(self) -> StageMotion:
        """The stage that uses most of the caps by which time is shared out."""
        return max(self.motions, key=lambda motion: motion.shared_by)


def run(
    study: MissionStudy, console: Console | None = None, *, kept: FinishedSteps = NOTHING_KEPT
) -> Result:
    """Share the time of a mission out among its stages.

    Parameters
    ----------
    study : MissionStudy
        What is asked.
    console : Console, optional
        Where lines of progress go: standard error by default. `silent()` shows none.
    kept : FinishedSteps, optional
        Where motions of stages go to, and where those of an earlier run are read.

    Returns
    -------
    Result
        Of the kind "mission", with the timeline as arrays.

    Raises
    ------
    StudyError
        If a stage has no motion in a time that it is given, or the user stopped before there was
        a motion.
    """
    with at_work(console) as told:
        return _answer(study, told, kept)


def _answer(study: MissionStudy, console: Console, kept: FinishedSteps) -> Result:
    found = _FoundMotions(study, console, kept)
    curves = list(found.curves.values())
    rigid = [rigid_duration(study, name) for name in STAGES]
    try:
        if study.least == "time":
            durations = durations_at_the_caps(curves, rigid, found.announce)
        else:
            durations = equal_split(curves, study.moving, rigid, found.announce)
        found.announce(durations)
        for one, duration in zip(curves, durations, strict=True):
            one.at(duration)
    except KeyboardInterrupt as stop:
        motions = list((found.whole or found.latest).values())
        if not motions:
            raise StudyError(
                "stopped before a motion of a stage was found; the inputs are kept",
                ExitCode.INTERRUPTED,
            ) from stop
        return _result_of(study, curves, motions, console, kept, stopped=True)

    motions = [
        found.known[name, duration] for name, duration in zip(STAGES, durations, strict=True)
    ]
    return _result_of(study, curves, motions, console, kept, stopped=False)


def _result_of(
    study: MissionStudy,
    curves: Sequence[StageCurve],
    motions: Sequence[StageMotion],
    console: Console,
    kept: FinishedSteps,
    *,
    stopped: bool,
) -> Result:
    def result(whole: bool) -> Result:
        del whole  # what follows from the motions takes seconds
        return _result(_mission(study, curves, motions, console, kept, stopped=stopped))

    return kept_anyway(result, stopped)


@dataclass(eq=False)
class _FoundMotions:
    """The motions that were found so far.

    Attributes
    ----------
    known : by stage and duration [s].
    latest : of each stage.
    whole : the latest of all stages, which belong together.
    curves : of all stages, by name.
    """

    study: MissionStudy
    console: Console
    kept: FinishedSteps = NOTHING_KEPT
    known: dict[tuple[str, float], StageMotion] = field(default_factory=dict)
    latest: dict[str, StageMotion] = field(default_factory=dict)
    whole: dict[str, StageMotion] = field(default_factory=dict)
    curves: dict[str, StageCurve] = field(init=False)

    def __post_init__(self) -> None:
        self.curves = {
            name: StageCurve(name, functools.partial(self.shared_by, name)) for name in STAGES
        }

    def shared_by(self, name: str, duration: float) -> float:
        """Largest part of a cap by which time is shared out, of a stage in a duration [s]."""
        self._move([(name, duration)])
        return self.known[name, duration].shared_by

    def announce(self, durations: Sequence[float]) -> None:
        """Find the motions of all stages in their durations [s], side by side."""
        self._move(list(zip(STAGES, durations, strict=True)))

    def _move(self, asked: Sequence[tuple[str, float]]) -> None:
        new = [one for one in asked if one not in self.known]
        motions = side_by_side([self._part(*one) for one in new], self.console)
        for (name, duration), motion in zip(new, motions, strict=True):
            self.latest[name] = self.known[name, duration] = motion
            self.curves[name].known[duration] = motion.shared_by
            if name == STAGES[-1]:
                self.whole.update(self.latest)
            share, most = 100 * motion.utilisation, motion.governing.title
            self.console.progress(f"{name} in {duration:.5g} s: {share:.4g} % ({most})")

    def _part(self, name: str, duration: float) -> Part:
        """Finds a motion, from the latest one of the stage where that is near."""
        latest, step = self.latest.get(name), f"{name} in {duration:.12g} s"
        if name == RING and latest is not None and latest.deployment is not None:
            law = latest.deployment.law
            return self.kept.part(step, move_ring, self.study, duration, law)
        if latest is None or latest.start is None or not latest.start.near(duration):
            return self.kept.part(step, move, self.study, name, duration)
        return self.kept.part(step, move_from, self.study, name, duration, latest.start)


def _mission(
    study: MissionStudy,
    curves: Sequence[StageCurve],
    motions: Sequence[StageMotion],
    console: Console,
    kept: FinishedSteps,
    *,
    stopped: bool,
) -> Mission:
    """The motions of all stages, or of the first ones, with what follows from them."""
    names = {motion.name for motion in motions}
    begun = [curve for curve in curves if curve.name in names]
    ring = motions[-1].deployment
    if ring is None:
        return Mission(study, begun, motions, {}, {}, None, Parts(), stopped)

    alone = None
    if not stopped:
        console.progress("ring: the same time without the arm, for comparison")
        alone = kept.step(
            WITHOUT,
            lambda: move_ring_alone(study, ring.law.duration, console),
            say=console.progress,
        )
    laws = _laws(study, ring, alone)
    model = study.carrier.with_ring(study.truss)
    responses = {name: arm_response(model, law) for name, law in laws.items()}
    particle = dict[str, float]()
    if study.satellite_inertia is None:  # on which the particle has a model
        still = dataclasses.replace(model, turns=False)
        particle = {name: arm_motion(still, law).residual_energy for name, law in laws.items()}
    bars = bars_of(ring, Caps())
    return Mission(study, begun, motions, responses, particle, alone, bars, stopped)


def _laws(study: MissionStudy, ring: Deployment, alone: StageMotion | None) -> dict[str, Law]:
    """Laws of the ring: its best one, the best one that leaves the arm out, and the paper's."""
    without = None if alone is None else alone.deployment
    papers = paper_laws(study.truss, ring.law.duration)
    return {
        "optimal": ring.law,
        **({} if without is None else {WITHOUT: without.law}),
        **{paper.name: paper.law for paper in papers},
    }


def _result(mission: Mission) -> Result:
    study = mission.study
    stages = [
        {
            "stage": motion.name,
            "start": start,
            "duration": motion.duration,
            "utilisation": motion.utilisation,
            "uses": [{**dataclasses.asdict(use), "share": use.share} for use in motion.uses],
            "known": {f"{d:.9g}": u for d, u in sorted(curve.known.items())},
        }
        for motion, start, curve in zip(
            mission.motions, mission.starts, mission.curves, strict=True
        )
    ]

    table = _rows(mission)
    parts = tuple(dict.fromkeys(name for row in table for name in row.values if name != "mission"))
    return Result(
        kind="mission",
        question=study.question,
        configuration=as_stated(study),
        arrays=_arrays(mission),
        table=table,
        also_found=parts,
        verdict=_verdict(mission),
        checks=_checks(mission),
        remarks=tuple(_remarks(mission)),
        details={
            "stages": stages,
            "arm_frequencies_Hz": _frequencies(study),
        },
        provenance=provenance(),
    )


def _frequencies(study: MissionStudy) -> dict[str, list[float]]:
    """Of the arm with the ring stowed and open [Hz]."""
    model = study.carrier.with_ring(study.truss)
    angles = {"stowed": study.truss.stowed_angle, "open": DEPLOYED}
    return {name: model.frequencies(angle).tolist() for name, angle in angles.items()}


def _arrays(mission: Mission) -> dict[str, Series]:
    """The timeline: what each drive does from the first start to the end of the last dwell."""
    pieces = [
        motion.history["time"] + s
        for motion, s in zip(mission.motions, mission.starts, strict=True)
    ]
    right_after = [min(piece[-1] + SHORTLY, mission.total) for piece in pieces]
    time = np.unique(np.concatenate([[0.0, mission.total], right_after, *pieces]))
    arrays = {"time": Series("s", "time", time, "from the start of the big arm")}

    # a rope is held before and after its motion, a joint is locked
    for motion, at in zip(mission.motions, pieces, strict=True):
        name = motion.name.replace(" ", "_")
        unit = "N" if motion.name == RING else "N m"
        held = motion.history["drive"][-1] if motion.name == RING else 0.0
        before = motion.history["drive"][0] if motion.name == RING else 0.0
        arrays[f"{name}_angle"] = Series(
            "rad",
            "time",
            np.interp(time, at, motion.history["angle"]),
            f"angle of the {motion.name}",
        )
        arrays[f"{name}_drive"] = Series(
            unit,
            "time",
            np.interp(time, at, motion.history["drive"], before, held),
            "force on one rope" if motion.name == RING else f"torque of the {motion.name}",
        )

    arrays |= _at_the_root(mission, time, pieces)
    if not mission.responses:
        return arrays
    arrays["reaction"] = Series(
        "N",
        "time",
        np.interp(time, pieces[-1], mission.motions[-1].history["reaction"], 0.0, 0.0),
        "of the ring on the arm",
    )
    return arrays | _vibrations(mission)


def _at_the_root(mission: Mission, time: Array, pieces: Sequence[Array]) -> dict[str, Series]:
    """Moment and momentum that the root passes on, and the satellite's angle about each axis."""
    at_each = list(zip(mission.motions, pieces, strict=True))

    def over_all(name: str, stages: Sequence[str], after: float | None) -> Array:
        """The sum of histories, which are zero before and `after`, or stay what they are."""
        parts = [
            np.interp(time, at, motion.history[name], 0.0, after)
            for motion, at in at_each
            if motion.name in stages
        ]
        return np.sum([0.0 * time, *parts], axis=0)

    moment, momentum = (over_all(name, STAGES, 0.0) for name in ("moment", "momentum"))
    arrays = {
        "root_moment": Series("N m", "time", moment, "of the satellite on the arm"),
        "root_momentum": Series("N m s", "time", momentum, "of arm and ring about the root"),
    }
    if mission.study.satellite_inertia is None:
        return arrays
    for joint, names in AXES.items():
        meaning = f"turn of the satellite about the axis of the {joint}"
        angle = over_all("turn", names, None)
        arrays[f"satellite_about_{joint.replace(' ', '_')}"] = Series("rad", "time", angle, meaning)
    return arrays


def _vibrations(mission: Mission) -> dict[str, Series]:
    first: Array = next(iter(mission.responses.values())).times
    axis = "since the ring's start"
    return {axis: Series("s", axis, first, "time")} | {
        f"tip/{name}": Series("m", axis, response.tip, f"tip across the arm, ring by {name}")
        for name, response in mission.responses.items()
    }


def _rows(mission: Mission) -> tuple[TableRow, ...]:
    """Durations, uses and utilisation by stage, then what the ring does to the arm by law."""
    motions = {motion.name: motion for motion in mission.motions}
    titles = dict.fromkeys(use.title for motion in mission.motions for use in motion.uses)
    units = {use.title: use.unit for motion in mission.motions for use in motion.uses}

    def row(key: str, title: str, unit: str, values: Mapping[str, float]) -> TableRow:
        return TableRow(key, title, unit, {"mission": math.nan, **values})

    rows = [
        TableRow(
            "total",
            "total time",
            "s",
            {"mission": mission.total},
            cap=mission.study.total,
            minimised=mission.study.least == "time",
        ),
        TableRow(
            "utilisation",
            "utilisation (largest fraction of a cap)",
            "1",
            {"mission": max(motion.utilisation for motion in mission.motions)}
            | {name: motion.utilisation for name, motion in motions.items()},
            cap=1.0,
            minimised=mission.study.least == "utilisation",
        ),
        row("duration", "duration", "s", {n: m.duration for n, m in motions.items()}),
    ]
    if not mission.whole:
        rows = rows[1:]  # a part has no total
    for title in titles:
        used = {n: u.value for n, m in motions.items() for u in m.uses if u.title == title}
        rows.append(row(title.replace(" ", "-"), title, units[title], used))
    rows += _rows_of_the_root(mission, row)
    for key, title, unit, of in (
        ("arm-peak", "tip of the arm while the ring opens", "m", lambda r: r.peak),
        ("arm-amplitude", "amplitude of the tip afterwards", "m", lambda r: r.amplitude),
        ("arm-energy", "energy of the arm afterwards", "J", lambda r: r.energy),
    ):
        values = {f"ring by {name}": of(r) for name, r in mission.responses.items()}
        if values:
            rows.append(row(key, title, unit, values))
    left = {f"ring by {name}": energy for name, energy in mission.particle.items()}
    if left:
        rows.append(row("arm-energy-particle", "the same, ring as a particle", "J", left))
    return tuple(rows)


def _rows_of_the_root(
    mission: Mission, row: Callable[[str, str, str, Mapping[str, float]], TableRow]
) -> list[TableRow]:
    """What the root passes on in each stage, and how far that turns a free satellite."""
    histories = {motion.name: motion.history for motion in mission.motions}
    peaks = [
        row(
            f"root-{name}",
            title,
            unit,
            {n: float(np.abs(h[name]).max()) for n, h in histories.items()},
        )
        for name, title, unit in (
            ("moment", "peak moment about the root", "N m"),
            ("momentum", "peak angular momentum at the root", "N m s"),
        )
    ]
    if mission.study.satellite_inertia is None:
        return peaks
    turned = {name: float(np.degrees(h["turn"][-1])) for name, h in histories.items()}
    return [*peaks, row("satellite-turn", "turn of the satellite", "deg", turned)]


def _turned_in_words(mission: Mission) -> str:
    """How far a free satellite turns about each axis, or that it is held."""
    H = mission.study.satellite_inertia
    left_out = "The model does not include the translation of the satellite."
    if H is None:
        return f"The satellite is held. {left_out}"
    turned = {motion.name: motion.history["turn"][-1] for motion in mission.motions}
    degrees = {
        joint: math.degrees(sum(turned.get(name, 0.0) for name in names))
        for joint, names in AXES.items()
    }
    about = ", ".join(f"{d:.4g} deg about the axis of the {j}" for j, d in degrees.items())
    return (
        f"The satellite of {H:g} kg m^2 about each axis turns by {about}. Each of these turns is "
        f"computed separately. {left_out}"
    )


def _verdict(mission: Mission) -> Verdict:
    if mission.stopped:
        found = " and the ".join(motion.name for motion in mission.motions)
        return Verdict("unverified", f"unverified: stopped after motions of the {found} were found")
    failed = [motion.name for motion in mission.motions if not motion.passed]
    if failed:
        return Verdict("unverified", f"unverified: the motion of the {' and the '.join(failed)}")
    if mission.largest.shared_by > 1.0 + WITHIN:
        return Verdict("unverified", f"unverified: {_broken_caps(mission)}")
    broken = [check.name for check in _checks(mission) if not check.passed]
    if broken:
        return Verdict("unverified", f"unverified: above the cap: {', '.join(broken)}")
    stages = ", ".join(f"{m.name} {m.duration:.5g} s" for m in mission.motions)
    return Verdict(
        "local",
        f"local: {stages}; the motion of each stage is one optimum, confirmed by a replay, and "
        "the split is optimal among motions of these kinds",
    )


def _broken_caps(mission: Mission) -> str:
    """That the caps are not kept in the mission's time, and in what time they would be."""
    needed = sum(curve.duration_for(1.0) + mission.study.dwell for curve in mission.curves)
    worst = mission.largest
    over = f"the {worst.name} uses {100 * worst.shared_by:.4g} % of its cap"
    by_time = mission.study.least == "time"
    found = (
        f"in the minimum time found, {mission.total:.5g} s, a cap is exceeded: {over}"
        if by_time
        else f"no split of {mission.total:.5g} s was found that keeps all caps, {over}"
    )

    # a cap that a stage breaks in any time is what stops the mission
    if hopeless := [curve.name for curve in mission.curves if curve.least > 1.0 + WITHIN]:
        motion = next(one for one in mission.motions if one.name == hopeless[0])
        broken = [use.title for use in motion.uses if use.counts and use.share > 1.0 + WITHIN]
        caps = "caps" if len(broken) > 1 else "cap"
        return (
            f"{found}; more time does not help the {motion.name}, so raise its {caps} on the "
            f"{' and the '.join(broken)}"
        )

    if by_time:
        return f"{found}; use --total {needed:.3g} or slightly more"
    over = ", ".join(
        f"{up(use.value)} {use.unit} for the {use.title} of the {motion.name}"
        for motion in mission.motions
        for use in motion.uses
        if use.share > 1.0 + WITHIN
    )
    return (
        f"{found}; use a total of about {needed:.3g} s (see --least time), or in this time caps of "
        f"{over}"
    )


def _checks(mission: Mission) -> tuple[Criterion, ...]:
    uses = [
        Criterion(
            f"{motion.name}: {use.title}",
            use.unit,
            use.value,
            use.cap,
            bool(use.value <= use.cap * (1 + WITHIN)),
        )
        for motion in mission.motions
        for use in motion.uses
    ]
    total = mission.study.total
    if mission.whole and total is not None:
        kept = bool(mission.total <= total * (1 + WITHIN))
        uses.append(Criterion("total time", "s", mission.total, total, kept))
    return (*uses, *mission.bars.checks)


def _of_more_time(name: str, slope: float) -> str:
    """What one per cent more time saves of a stage, by the slope of log u against log T."""
    saved = "hardly lowers its utilisation"
    if -slope > UNFELT:
        saved = f"lowers its utilisation by {-slope:.3g} %"
    return f"1 % more time for the {name} {saved}."


def _cost_of_rest(mission: Mission) -> tuple[str, ...]:
    """What it costs the ring that the arm is left at rest."""
    ring, alone = mission.motions[-1], mission.alone
    if alone is None or alone.deployment is None or ring.deployment is None:
        return ()
    with_arm, without = ring.deployment.values, alone.deployment.values
    left = mission.responses[WITHOUT].energy
    more = 100 * (with_arm["peak-reaction"] / without["peak-reaction"] - 1)
    return (
        "The residual energy of the arm after the ring's motion is "
        f"{mission.responses['optimal'].energy:.3g} J. This needs a peak reaction of "
        f"{with_arm['peak-reaction']:.4g} N instead of {without['peak-reaction']:.4g} N "
        f"({more:.2g} % more) and a utilisation of {ring.shared_by:.4g} instead of "
        f"{alone.shared_by:.4g} in the same time. After the best motion planned without the arm, "
        f"the residual energy is {left:.3g} J.",
    )


def _remarks(mission: Mission) -> list[str]:
    used = {motion.name: motion.shared_by for motion in mission.motions}
    least, most = min(used.values()), max(used.values())
    said = ", ".join(f"{name} {100 * u:.4g} %" for name, u in used.items())
    remarks = [
        f"{m.name}: {m.governing.title} governs, {m.governing.value:.5g} of "
        f"{m.governing.cap:.5g} {m.governing.unit}."
        for m in mission.motions
    ]

    if mission.stopped:
        remarks.insert(0, f"Stopped before the time was divided; utilisation so far: {said}.")
    elif most / least <= 1.0 + EQUAL:
        remarks.insert(0, f"All stages have the same utilisation: {said}.")
    else:
        slow = [
            c.name
            for c, m in zip(mission.curves, mission.motions, strict=True)
            if m.duration >= c.floor
        ]
        why = (
            f"more time hardly lowers that of the {' and the '.join(slow)}"
            if slow
            else "the search for the split ended before they were equal"
        )
        remarks.insert(0, f"The stages have different utilisations: {said}; {why}.")

    more = [m for m in mission.motions if m.utilisation > m.shared_by]
    if more:
        beside = ", ".join(f"{m.name} {100 * m.utilisation:.4g} %" for m in more)
        remarks[0] += (
            " This does not include the residual energy, because no motion of the arm was refined; "
            f"with it: {beside}."
        )

    for curve, motion in zip(mission.curves, mission.motions, strict=True):
        slope = curve.slope(math.nextafter(motion.duration, math.inf))  # of what more time gives
        remarks.append(_of_more_time(curve.name, slope))
    remarks += [*_cost_of_rest(mission), *mission.bars.sentences, _turned_in_words(mission)]
    remarks.append(
        "The antenna turns by 90 deg about the big arm, which then twists but does not bend; the "
        "drive is at its root. The ring's centre is seen from the tip at "
        f"{mission.study.reaction_angle_deg:g} deg to the straight arm, and the reaction is that "
        "of a ring on a fixed tip."
    )
    return remarks
