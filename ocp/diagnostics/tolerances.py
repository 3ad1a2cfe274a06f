"""What a certificate allows."""

from __future__ import annotations

from dataclasses import dataclass, fields

from ocp.errors import StatementError
from ocp.estimates.promised_gain import CERTIFIED_GAIN
from ocp.keywords import checked_keywords


@checked_keywords()
@dataclass(frozen=True)
class Tolerances:
    """What a certificate allows, all relative.

    Attributes
    ----------
    replay : float
        Missed end state of the replay, and what the dynamics are off by between the points: what a
        solve promises by default.
    excess : float
        Excess of a path constraint or peak of the replay: ten times the default of a solve, because
        the replayed motion is off by a little, too.
    objective, bounds : float
        Difference of the replayed objective, and excess of the problem's bounds and links: ten
        times the default for the missed end state, as misses of all states act on them.
    feasible : float
        Violated rows and bounds of the scaled program. The solver stops at 1e-10.
    stationary : float
        Slope of the scaled Lagrangian. The solver stops at 1e-6.
    complementary : float
        Product of an inequality's multiplier and the distance to its limit. The solver accepts
        1e-8.
    shown : float
        Difference of the multipliers that the solution shows from those of the program: rounding.
    within : float
        Range of the Hamiltonian between two changes of the active set, where costates are as exact
        as the slope of the Lagrangian. Not where a path constraint acts: there `gain` counts.
    strict : float
        Worst interval mean of dH/du, in all intervals but those that hold a change of the active
        set or are next to one. It is relative to terms that cancel, hence wider than `within`.
    changes : float
        Part of the duration that these may take, those left out that meet `within` and `strict` all
        the same. Where it is most of it, little has been tested.
    hamiltonian : float
        Mean drift of the Hamiltonian over the whole phase, and its end values at free times.
        Costates are of first order only in intervals that hold a jump of theirs, so that this is
        far wider than what holds between changes.
    slope : float
        Interval means of dH/du, averaged over time, changes included.
    gain : float
        What a better motion promises to gain, relative to the objective: by finer or other
        controls, or by other breakpoints where a path constraint acts. It is ten times the default
        of a solve, because such a promise is of first order, and often ten times what is gained.
        The same for what a second solve reaches.
    steps : float
        Jump of a rate, integrand or constraint whose time depends on the motion, relative to its
        largest value: what is left where two branches are meant to be one function.
    peak : float
        Sum and sign of a peak's multipliers: ten times what the solver leaves of the slope of the
        Lagrangian by the peak.

    Raises
    ------
    StatementError
        For a tolerance that is no positive number.
    """

    replay: float = 1e-6
    excess: float = 1e-6
    objective: float = 1e-5
    bounds: float = 1e-5
    feasible: float = 1e-8
    stationary: float = 1e-5
    complementary: float = 1e-6
    shown: float = 1e-9
    hamiltonian: float = 5e-3
    slope: float = 1e-3
    within: float = 1e-5
    strict: float = 1e-4
    changes: float = 0.5
    gain: float = CERTIFIED_GAIN
    steps: float = 1e-6
    peak: float = 1e-5

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            # infinite switches a check off
            if not (isinstance(value, (int, float)) and value > 0):
                raise StatementError(
                    f"the tolerance '{entry.name}' of a certificate is {value!r}; "
                    "give a positive number"
                )
