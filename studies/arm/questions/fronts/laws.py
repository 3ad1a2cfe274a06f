"""The paper's laws beside a front of the arm, on the full model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from studies.arm.laws.unit_laws import unit_law
from studies.arm.questions.baselines import replay_law
from studies.arm.questions.fronts.point import values_of
from studies.arm.stage import Stage
from studies.arm.trade_off import RESIDUAL_ENERGY
from studies.common.console import Console

LAWS = ("Step5", "Bezier")


@dataclass(frozen=True)
class TimedLaw:
    """A law in one duration.

    Attributes
    ----------
    values : of all quantities of a front, by their keys.
    """

    name: str
    values: Mapping[str, float]

    def place(self, keys: Sequence[str], still: float) -> tuple[float, ...]:
        """Where it is beside a front of some quantities.

        Parameters
        ----------
        still : energy up to which the arm counts as still [J]: a law that leaves less has it.
        """
        values = {**self.values, RESIDUAL_ENERGY: max(still, self.values[RESIDUAL_ENERGY])}
        return tuple(values[key] for key in keys)

    def left(self, still: float) -> str:
        """What it leaves, beside an energy up to which the arm counts as still [J]."""
        energy = self.values[RESIDUAL_ENERGY]
        return (
            f"Its residual energy is {energy:.2g} J; that of a point of the front is at most "
            f"{still:g} J."
        )


def laws_in(stage: Stage, durations: Sequence[float], console: Console) -> list[TimedLaw]:
    """The paper's laws in several durations [s]."""
    found = []
    for duration in durations:
        at = stage.lasting(duration)
        for name in LAWS:
            console.live(f"{name} in {duration:.4g} s")
            replayed = replay_law(at, unit_law(name, duration), "torque", follow=False)
            found.append(TimedLaw(name, values_of(replayed, replayed.peak_torque)))
    return found


def places_of(
    laws: Sequence[TimedLaw], keys: Sequence[str], still: float
) -> dict[str, list[tuple[float, ...]]]:
    """Where laws are beside a front of some quantities, by their names; see `TimedLaw.place`."""
    return {name: [law.place(keys, still) for law in laws if law.name == name] for name in LAWS}
