"""The courses of chained states: polynomials of time in the intervals of a group.

With ``x' = a y + b`` and the driver ``y`` a polynomial in local time ``tau``, the state is the
polynomial ``x(0) + h int (a y + b) dtau``; collocation of its degree has no other solution.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.problem.integrator_chains import Link, links
from ocp.problem.symbols import Control, State
from ocp.transcription.variables import Group, PhaseLayout

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
MOST_INTERVALS = 1000  # of a phase


@dataclass(frozen=True, eq=False)
class Chains:
    """The chained states in the intervals of a group.

    Attributes
    ----------
    states : (n,) drivers before what they drive.
    sizes : (unknowns,) of the program.
    """

    layout: PhaseLayout
    group: Group
    states: tuple[State, ...]
    links: Mapping[State, Link]
    sizes: Array

    @cached_property
    def numbers(self) -> list[int]:
        """Places of the states among those of the phase."""
        return [_place(s, self.layout.states) for s in self.states]

    @cached_property
    def inside(self) -> Integers:
        """(m, s - 1, n) unknowns at the support points within the intervals."""
        return self.group.support[:, 1:-1, self.numbers]

    @cached_property
    def right(self) -> Integers:
        """(m, n) unknowns at the right ends."""
        return self.group.support[:, -1, self.numbers]

    @cached_property
    def scales(self) -> Array:
        """(n,) sizes of the states."""
        return self.sizes[self.right[0]]

    @cached_property
    def linear(self) -> bool:
        """Whether the courses are linear in the unknowns, with numbers as factors."""
        return not self.group.moving and all(
            not ca.symvar(ca.vertcat(self.links[s].gain, self.links[s].offset))
            for s in self.states
        )  # fmt: skip

    def needed(self, states: Sequence[int]) -> tuple[int, ...]:
        """The given states (numbers in `states`) with all that drive them."""
        found = set(states)
        for i in sorted(found, reverse=True):
            driver = self.links[self.states[i]].driver
            while isinstance(driver, State):
                found.add(_place(driver, self.states))
                driver = self.links[driver].driver
        return tuple(sorted(found))

    def arguments(self, needed: Sequence[int]) -> list[Integers]:
        """The unknowns (m,) that courses of these states depend on, in the order of `courses`."""
        layout, k = self.layout, self.group.intervals
        found = [self.group.support[:, 0, self.numbers[i]] for i in needed]
        for control in self._controls(needed):
            if _steps(layout, control):
                found.append(layout.steps[k, _place(control, layout.constant)])
            else:
                ramps = layout.ramps[k, :, _place(control, layout.linear)]
                found += [ramps[:, 0], ramps[:, 1]]
        if self.group.moving:
            found += [layout.moved[k], layout.moved[k + 1]]
        return found

    @property
    def clocks(self) -> int:
        """Number of the last arguments, from which the length of an interval follows."""
        return 2 * self.group.moving

    @cached_property
    def kind(self) -> tuple[Any, ...]:
        """What the courses of chains of one problem may differ in."""
        return (
            self.layout.phase.name,
            tuple(s.name for s in self.states),
            self.group.scheme.degree,
            self.group.moving,
        )

    @property
    def gains(self) -> ca.SX:
        """(n, n) factors of each state in the rates of the others, all scaled."""
        n = len(self.states)
        found = ca.SX.zeros(n, n)
        for i, state in enumerate(self.states):
            link = self.links[state]
            if isinstance(link.driver, State):
                j = _place(link.driver, self.states)
                found[i, j] = link.gain * float(self.scales[j] / self.scales[i])
        return found

    @cached_property
    def widths(self) -> Array:
        """(m, 1) widths of the intervals as fractions of the phase."""
        return np.diff(self.layout.mesh.breakpoints)[self.group.intervals][:, None]

    def _controls(self, needed: Sequence[int]) -> list[Control]:
        drivers = [self.links[self.states[i]].driver for i in needed]
        return list(dict.fromkeys(d for d in drivers if isinstance(d, Control)))

    def length(self, clock: Sequence[Any], width: Any) -> Any:
        """Length of an interval from its last arguments, unscaled, and its width."""
        begin, end = self.layout.fixed_times
        return (clock[1] - clock[0] if clock else width) * (end - begin)

    def courses(
        self, needed: Sequence[int], arguments: Sequence[ca.SX], width: ca.SX
    ) -> dict[int, list[ca.SX]]:
        """Coefficients of the powers of local time, unscaled.

        Parameters
        ----------
        arguments : scaled unknowns in the order of `arguments`.
        """
        at = [ids[0] for ids in self.arguments(needed)]
        given = [a * float(self.sizes[i]) for a, i in zip(arguments, at, strict=True)]
        known: dict[State | Control, list[ca.SX]] = {}
        place = len(needed)
        for control in self._controls(needed):
            if _steps(self.layout, control):
                known[control], place = [given[place]], place + 1
            else:
                left, right = given[place : place + 2]
                known[control], place = [left, right - left], place + 2
        h = self.length(given[place:], width)
        for i, start in zip(needed, given, strict=False):
            link = self.links[self.states[i]]
            rate = [link.gain * c for c in known[link.driver]]
            rate[0] = rate[0] + link.offset
            known[self.states[i]] = [start, *(h * c / (m + 1) for m, c in enumerate(rate))]
        return {i: known[self.states[i]] for i in needed}


def _place(signal: State | Control, among: Sequence[State | Control]) -> int:
    return [s.name for s in among].index(signal.name)


def _steps(layout: PhaseLayout, control: Control) -> bool:
    """Whether a control is constant in each interval."""
    return control.name in {c.name for c in layout.constant}


def value(course: Sequence[ca.SX], tau: Any) -> ca.SX:
    """A polynomial of local time at `tau`."""
    total = course[-1]
    for coefficient in course[-2::-1]:
        total = coefficient + tau * total
    return total


def chains_of(layout: PhaseLayout, sizes: Array) -> list[Chains]:
    """The chained states of a phase, in each group whose degree follows them exactly.

    There are none in free time, on which every course would depend: rows with as many second
    derivatives as that lead the solver astray.  Nor are there on more than `MOST_INTERVALS`:
    on several thousand the condensed program was slower than the plain one or did not converge.
    """
    many = layout.intervals > MOST_INTERVALS
    if layout.groups[0].scheme.name != "radau" or layout.ends is not None or many:
        return []
    shapes = [*((c, 0) for c in layout.constant), *((c, 1) for c in layout.linear)]
    found = links(layout.phase, tuple(shapes))
    chains = []
    for group in layout.groups:
        states = tuple(s for s, link in found.items() if link.degree <= group.scheme.degree)
        if states and group.scheme.degree > 1:
            chains.append(Chains(layout, group, states, found, sizes))
    return chains
