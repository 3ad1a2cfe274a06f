"""The study: its keys, what it finds, and how `antenna-ocp` comes to know it."""

from dataclasses import dataclass, replace

import numpy as np

from studies.common.configuration import check, key, not_negative, positive, whole
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.study import Mechanism, Study, Swept

from .mechanics import GRAVITY, Slider
from .phase_plane import least_peak, shortest_time


@dataclass(frozen=True, kw_only=True)
class SliderStudy:
    """A slider that a rope pulls from rest to rest."""

    mass: float = key(positive, "kg", "of the slider", default=20.0)
    stiffness: float = key(not_negative, "N/m", "of the spring that holds it back", default=30.0)
    friction: float = key(not_negative, "1", "coefficient of Coulomb friction", default=0.2)
    pulley_distance: float = key(positive, "m", "from the start, along the rail", default=3.0)
    pulley_height: float = key(positive, "m", "above the rail", default=1.0)
    travel: float = key(positive, "m", "of the slider", default=2.0)
    duration: float = key(positive, "s", "of the motion", default=1.6)
    intervals: int = key(whole(2, 1000), "", "of the first mesh", default=20)

    def __post_init__(self):
        check(self)
        if self.travel >= self.pulley_distance:
            raise StudyError(
                f"travel is {self.travel:g} m, which leads below the pulley or beyond; give less "
                f"than the pulley_distance of {self.pulley_distance:g}"
            )

    @property
    def question(self):
        """What is asked, in one line."""
        return (
            f"Slider of {self.mass:g} kg, {self.travel:g} m in {self.duration:g} s: "
            "least peak force of the rope"
        )

    @property
    def slider(self):
        """Its mechanics."""
        return Slider(
            mass=self.mass,
            stiffness=self.stiffness,
            friction=self.friction,
            distance=self.pulley_distance,
            height=self.pulley_height,
        )


def check_possible(study, console=None):
    """Refuse what no rope can do: to brake, or to pull a spring by a slider that it lifts off."""
    if study.stiffness == study.friction == 0:
        raise StudyError(
            "stiffness and friction are 0, and a rope cannot brake: nothing stops the slider; give "
            "one of them",
            ExitCode.INFEASIBLE,
        )
    least = shortest_time(study.slider, study.travel)
    if study.duration <= least:
        raise StudyError(
            f"duration is {study.duration:g} s, and a rope cannot brake: spring and friction take "
            f"{least:.4g} s to stop the slider within {study.travel:g} m; give more than that, a "
            "stiffer spring or more friction",
            ExitCode.INFEASIBLE,
        )

    # the work of a rope that bears the whole weight, so that there is no friction
    most = study.slider.stiffest_spring(study.travel)
    if study.stiffness >= most:
        raise StudyError(
            f"stiffness is {study.stiffness:g} N/m, and the rope lifts the slider off before it "
            f"stretches that spring by {study.travel:g} m; give less than {most:.4g}, or a lower "
            "pulley",
            ExitCode.INFEASIBLE,
        )


def run(study, console=None):
    """The motion of least peak force, beside that of a polynomial of fifth degree."""
    from ocp import Bound, Control, OcpError, Phase, Problem, Settings, State, solve
    from studies.common.console import at_work

    check_possible(study)
    slider = study.slider
    s, v = State("position", "m"), State("speed", "m/s", lower=0)
    force = Control("force", "N", lower=0)
    pull = Phase(
        "pull",
        dynamics={s: v, v: slider.acceleration(s, force)},
        initial={s: 0, v: 0},
        final={s: study.travel, v: 0},
        end=study.duration,
        guess={s: (0, study.travel)},
        bounds=[Bound("load on the rail", slider.load_on_rail(s, force), "N", lower=0)],
    )
    problem = Problem("slider", pull, minimise=pull.peak(force, unit="N"))
    with at_work(console) as told:
        told.progress("the motion of least peak force")
        try:
            solution = solve(problem, settings=Settings(intervals=study.intervals))
        except OcpError as error:
            raise StudyError(str(error), ExitCode.NOT_SOLVED) from error

    time = np.linspace(0.0, study.duration, 2001)
    optimum = tuple(solution.sample([s, v, force], time))
    return _found(study, time, optimum, float(solution.objective))


def _found(study, time, optimum, peak):
    """The optimum, against the phase plane and the balance of energy."""
    from studies.common.result import Verdict, at_most

    slider = study.slider
    s, v, force = optimum
    bound = least_peak(slider, study.travel, study.duration)
    needed = slider.work_of_resistance(study.travel)
    given = float(np.trapezoid(force * slider.leverage(s) * v, time))
    proven = peak <= bound * (1 + 1e-5)
    verdict = f"no motion in {study.duration:g} s needs less than {bound:.6g} N, by the phase plane"
    if not proven:
        verdict += f"; this one needs {100 * (peak / bound - 1):.2g} % more"
    checks = (
        # by the trapezoids over the step of the force
        at_most(
            "work of the rope against resistance, relative", "1", abs(given / needed - 1), 1e-3
        ),
        at_most("bound against peak force, relative", "1", bound / peak - 1, 1e-5),
    )
    verdict = Verdict("global" if proven else "local", verdict)
    return _result(study, time, {"optimum": optimum}, bound, verdict, checks)


def judge(study, columns, console=None):
    """Whether a rope can move the slider as a profile says, and what force that takes."""
    from studies.common.result import Verdict, at_most

    time, s = columns["time"] - columns["time"][0], columns["position"]
    study = replace(study, duration=float(time[-1]))
    check_possible(study)
    slider = study.slider
    v = np.gradient(s, time)
    force = slider.force(s, np.gradient(v, time))
    load = slider.load_on_rail(s, force)
    bound = least_peak(slider, study.travel, study.duration)
    # a hundredth, for differences of rounded positions
    checks = (
        at_most(
            "miss of the travel", "m", float(abs(s[-1] - s[0] - study.travel)), study.travel / 100
        ),
        at_most("speed backwards", "m/s", float(-v.min()), float(v.max()) / 100),
        at_most("push of the rope", "N", float(-force.min()), float(force.max()) / 100),
        at_most("pull off the rail", "N", float(-load.min()), study.mass * GRAVITY / 100),
    )
    verdict = Verdict("measured", "the profile is given; nothing was optimised")
    return _result(study, time, {"profile": (s, v, force)}, bound, verdict, checks)


def _result(study, time, laws, bound, verdict, checks):
    """A law beside the polynomial of fifth degree."""
    from studies.common.configuration import as_stated
    from studies.common.folder import provenance
    from studies.common.result import Result, Series

    slider = study.slider
    laws = {**laws, "polynomial": _polynomial(study, time)}
    arrays = {"time": Series("s", "time", time, "time")}
    for head, (s, v, force) in zip(("", "polynomial/"), laws.values(), strict=True):
        columns = {
            "position": ("m", s, "of the slider, from its start"),
            "speed": ("m/s", v, "of the slider"),
            "force": ("N", force, "of the rope"),
            "rope_length": ("m", slider.rope_length(s), "up to the pulley"),
            "rope_speed": ("m/s", slider.rope_rate(s) * v, "change of the rope's length"),
        }
        arrays |= {
            f"{head}{name}": Series(unit, "time", values, meaning)
            for name, (unit, values, meaning) in columns.items()
        }
    return Result(
        kind="slider",
        question=study.question,
        configuration=as_stated(study),
        arrays=arrays,
        table=_table(laws, bound),
        bounds={"peak-force": bound},
        verdict=verdict,
        checks=checks,
        provenance=provenance(),
    )


def _table(laws, bound):
    """Peaks of all laws."""
    from studies.common.comparison_table import TableRow

    forces = {name: force for name, (_, _, force) in laws.items()}
    peaks = {name: float(force.max()) for name, force in forces.items()}
    speeds = {name: float(v.max()) for name, (_, v, _) in laws.items()}
    least = {name: float(force.min()) for name, force in forces.items()}
    return (
        TableRow(
            "peak-force",
            "peak force of the rope",
            "N",
            peaks,
            bound=bound,
            minimised=True,
            better="less",
        ),
        TableRow("peak-speed", "peak speed of the slider", "m/s", speeds, better="less"),
        TableRow("least-force", "least force of the rope", "N", least, better="more"),
    )


def _polynomial(study, time):
    """Position, speed and force of the polynomial of fifth degree from rest to rest."""
    x = time / study.duration
    s = study.travel * x**3 * (10 - 15 * x + 6 * x**2)
    v = study.travel / study.duration * 30 * x**2 * (1 - x) ** 2
    acceleration = study.travel / study.duration**2 * 60 * x * (1 - x) * (1 - 2 * x)
    return s, v, study.slider.force(s, acceleration)


STUDY = Study(
    name="slider",
    summary="a slider that a rope pulls along a rail with the least peak force",
    description="Finds the motion from rest to rest whose peak force of the rope is least.",
    keys={"": SliderStudy},
    run=run,
    check=check_possible,
    folder="slider-{0.duration:g}s",
    figures="slider.pictures:draw",
    mechanism=Mechanism(
        title="Slider",
        model=(
            "A slider on a rail, on a rope that has no mass and does not stretch.",
            "A spring holds it back, and Coulomb friction under the load that the rope leaves.",
        ),
        limits=("It slides towards the pulley only: static friction and a way back are left out.",),
        parameters="slider.pictures:parameters",
        page="slider.pictures",
        signals={"rope": ("rope_length", "rope_speed"), "slider": ("position", "speed")},
    ),
    profile={"time": "s", "position": "m"},
    judge=judge,
    sweep=Swept(coarse={"intervals": 6}, seconds=(1.0, 0.5)),
)
