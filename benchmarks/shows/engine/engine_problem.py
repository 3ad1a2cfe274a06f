"""A variant as a user of the engine states it, with a crude guess or with none."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from benchmarks.shows.engine.variant import Variant, evaluated
from ocp import (
    TIME,
    Between,
    Bound,
    ByFraction,
    Control,
    Phase,
    Problem,
    State,
    Unknown,
    joined,
)
from ocp.problem.symbols import Symbol


def problem_of(variant: Variant, guessed: bool) -> Problem:
    """The problem of a variant.

    Parameters
    ----------
    guessed : bool
        Whether the crude guess of the file is handed over.
    """
    unknowns = {
        name: Unknown(
            name,
            **_limits(variant, entry),
            guess=entry["guess"] if guessed else None,
            scale=entry.get("scale"),
        )
        for name, entry in variant.stated.get("unknowns", {}).items()
    }
    signals: dict[str, Symbol] = {}
    stated = [_Stated(variant, entry, unknowns, signals, guessed) for entry in variant.phases]
    values = variant.at_ends({one.phase.name: one.values for one in stated}) | unknowns
    if variant.samples:
        values["misfit"] = sum(
            (stated[0].phase.at(time, stated[0].symbols[name]) - measured) ** 2
            for name, column in variant.samples.items()
            if name != "times"
            for time, measured in zip(variant.samples["times"], column, strict=True)
        )

    rows = [
        Bound(f"row {i}", evaluated(row["expression"], values), **_limits(variant, row))
        for i, row in enumerate(variant.stated.get("rows", []), start=1)
    ]
    links = [link for one, other in pairwise(stated) for link in joined(one.phase, other.phase)]
    return Problem(
        variant.name,
        tuple(one.phase for one in stated),
        minimise=evaluated(variant.stated["objective"], values),
        bounds=tuple(rows),
        links=tuple(links),
    )


class _Stated:
    """One phase, its symbols and its boundary values, integrals and peaks by name."""

    def __init__(
        self,
        variant: Variant,
        entry: Mapping[str, Any],
        unknowns: Mapping[str, Unknown],
        signals: dict[str, Symbol],
        guessed: bool,
    ) -> None:
        # a signal of several phases is one signal
        for kind, key in ((State, "states"), (Control, "controls")):
            for name, own in entry[key].items():
                if name not in signals:
                    signals[name] = kind(name, **_limits(variant, own), scale=own.get("scale"))
        self.symbols = {name: signals[name] for name in (*entry["states"], *entry["controls"])}
        names: dict[str, Any] = {**variant.numbers, **self.symbols, **unknowns, "t": TIME}
        names = {k: v.symbol if isinstance(v, Symbol) else v for k, v in names.items()}
        for name, expression in entry.get("let", {}).items():
            names[name] = evaluated(expression, names)

        own = {**entry["states"], **entry["controls"]}
        self.phase = Phase(
            entry["name"],
            {self.symbols[name]: evaluated(rate, names) for name, rate in entry["rates"].items()},
            initial=self._boundary(variant, entry, "first"),
            final=self._boundary(variant, entry, "last"),
            start=_time(variant, entry, "start", guessed),
            end=_time(variant, entry, "end", guessed),
            bounds=[
                Bound(
                    f"path {i}",
                    evaluated(row["expression"], names),
                    **_limits(variant, row),
                    scale=row.get("scale"),
                )
                for i, row in enumerate(entry.get("path", []), start=1)
            ],
            guess={
                self.symbols[name]: ByFraction(_line(variant, signal))
                for name, signal in own.items()
            }
            if guessed
            else {},
        )

        self.values: dict[str, Any] = {"t_i": self.phase.start_time, "t_f": self.phase.end_time}
        for state in self.phase.states:
            self.values |= {
                f"{state.name}_i": self.phase.at_start(state),
                f"{state.name}_f": self.phase.at_end(state),
            }
        for name, expression in entry.get("integrals", {}).items():
            self.values[name] = self.phase.integral(evaluated(expression, names), name)
        for name, expression in entry.get("peaks", {}).items():
            self.values[name] = self.phase.peak(
                evaluated(expression, names), name=name, absolute=True
            )

    def _boundary(self, variant: Variant, entry: Mapping[str, Any], end: str) -> dict[Any, float]:
        return {
            self.symbols[name]: variant.value(own[end])
            for name, own in entry["states"].items()
            if end in own
        }


def _limits(variant: Variant, entry: Mapping[str, Any]) -> dict[str, Any]:
    """Finite limits of a signal, an unknown or a row, as keywords."""
    sides = zip(("lower", "upper"), variant.limits(entry), strict=True)
    return {side: value for side, value in sides if math.isfinite(value)}


def _time(variant: Variant, entry: Mapping[str, Any], end: str, guessed: bool) -> Any:
    lower, upper, guess = variant.times(entry, end)
    return lower if lower == upper else Between(lower, upper, guess if guessed else None)


def _line(variant: Variant, signal: Mapping[str, Any]) -> Any:
    """The guess of a signal as a function of fractions of the phase."""
    # one by one, thousands of fractions would take as long as a solve
    return lambda fractions: np.array(variant.guess(signal, fractions), dtype=float).squeeze()
