"""What is proven before a motion is sought: caps that none meets, limits, lower bounds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Literal

from studies.common.console import Console
from studies.common.exit_codes import StudyError
from studies.drive.motor import rotor_mass
from studies.truss.config import TrussStudy
from studies.truss.limits.bounds import has_rotor, lower_bounds
from studies.truss.limits.feasibility import (
    Unattained,
    check_feasible,
    force_cap,
    motor_force_cap,
    unattained,
)

if TYPE_CHECKING:  # SciPy loads with it, and only where it is needed
    from studies.truss.motions.phase_plane import LeastForce, PhasePlane


# what is said before each bound is worked out
LEAST = {
    "rope": "minimum force without other caps",
    "motor": "minimum force of the motor with its rotor",
}


@dataclass(frozen=True, eq=False)
class PhasePlanes:
    """The phase planes of a study; each number is worked out once, when it is first asked for.

    Attributes
    ----------
    study : TrussStudy
    progress : callable
        Receives a line before work that takes seconds.
    """

    study: TrussStudy
    progress: Callable[[str], None]
    _known: dict[str, LeastForce | StudyError] = field(default_factory=dict, init=False)

    def least_force(self) -> LeastForce:
        """The bound of the rope force.

        Raises
        ------
        StudyError
            If it cannot be had for this truss.
        """
        return self._least("rope")

    def least_pull(self) -> LeastForce:
        """The bound of the force of a motor with a rotor.

        Raises
        ------
        StudyError
            If it cannot be had for this truss or drum.
        """
        return self._least("motor")

    @cached_property
    def least_time(self) -> float:
        """T_min [s] under the caps on the forces of rope and motor; 0 without such caps."""
        cap, motor_cap = force_cap(self.study), motor_force_cap(self.study)
        times = [0.0] if cap is None else [self._of_the_rope.least_time(cap)]
        if motor_cap is not None and has_rotor(self.study):
            times.append(self._of_the_motor.least_time(motor_cap))
        return max(times)

    @cached_property
    def _of_the_rope(self) -> PhasePlane:
        from studies.truss.motions.phase_plane import PhasePlane

        return PhasePlane(self.study.truss, opening=self.study.opening)

    @cached_property
    def _of_the_motor(self) -> PhasePlane:
        """That of a motor with a rotor, which is a mass on the rope if its drum has one layer."""
        from studies.truss.motions.phase_plane import PhasePlane

        drive = self.study.drive
        if drive is not None and drive.rope_diameter is not None:
            raise StudyError("The phase plane gives no bound for a drum of several layers.")
        return PhasePlane(self.study.truss, rotor_mass(drive, 0.0), self.study.opening)

    def _least(self, plane: Literal["rope", "motor"]) -> LeastForce:
        """The least force in the longest duration; why there is none is raised again, too."""
        if plane not in self._known:
            self.progress(f"phase plane: {LEAST[plane]}")
            try:
                of = self._of_the_rope if plane == "rope" else self._of_the_motor
                self._known[plane] = of.least_force(self.study.duration[1])
            except StudyError as error:
                self._known[plane] = error
        found = self._known[plane]
        if isinstance(found, StudyError):
            raise found
        return found


def check_some_motion(planes: PhasePlanes) -> None:
    """Refuse caps that no motion meets.

    Raises
    ------
    StudyError
        With the nearest value that works.
    """
    check_feasible(planes.study, planes.least_force, planes.least_pull)


def open_limit(planes: PhasePlanes) -> Unattained | None:
    """The least value of a study's only objective where no motion attains it."""
    return unattained(planes.study, planes.least_force, planes.least_pull)


def check_some_optimum(study: TrussStudy, console: Console) -> PhasePlanes:
    """Refuse caps that no motion meets, and optima that none attains; return what was worked out.

    Raises
    ------
    StudyError
        With the nearest value that works.
    """
    planes = PhasePlanes(study, console.progress)
    check_some_motion(planes)
    if (limit := open_limit(planes)) is not None:
        raise limit.refusal
    return planes


@dataclass(frozen=True)
class ProvenBounds:
    """What no motion beats.

    Attributes
    ----------
    values : by quantity.
    remarks : what to say of bounds that could not be had.
    interrupted : whether the user stopped it, so that only closed forms are among them.
    """

    values: Mapping[str, float]
    remarks: tuple[str, ...] = ()
    interrupted: bool = False

    def first(self, study: TrussStudy) -> float | None:
        """That of a study's first objective; None where there is none, as of a weighted sum."""
        first = study.minimise[0]
        return self.values.get(next(iter(first))) if len(first) == 1 else None


def bounds_in_closed_form(study: TrussStudy, *, interrupted: bool = False) -> ProvenBounds:
    """Bounds that take no work."""
    return ProvenBounds(lower_bounds(study, None), interrupted=interrupted)


def proven_bounds(planes: PhasePlanes) -> ProvenBounds:
    """Lower bounds by quantity; the phase plane only where it can matter."""
    study = planes.study
    if study.arm is not None:  # the phase plane is that of a ring whose fixed bar is held
        return bounds_in_closed_form(study)

    objectives, rotor = set(study.objectives), has_rotor(study)
    of_the_motor = {"peak-motor-force", "peak-motor-torque", "peak-factored-force"}
    least_time, force, motor = 0.0, None, None
    remarks, interrupted = tuple[str, ...](), False
    try:
        least_time = planes.least_time
        if rotor and objectives & of_the_motor:
            motor = planes.least_pull()
        of_the_rope = {"peak-force"} if rotor else {"peak-force", *of_the_motor}
        force = planes.least_force() if objectives & of_the_rope else None
    except KeyboardInterrupt:  # the motions found so far are worth more than this bound
        interrupted = True
    except StudyError as error:  # none to be had
        remarks = (str(error),)
    return ProvenBounds(lower_bounds(study, force, least_time, motor=motor), remarks, interrupted)
