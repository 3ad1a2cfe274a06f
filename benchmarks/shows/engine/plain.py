"""A plain collocation of a variant: Radau points of degree 3 on stated intervals, by IPOPT.

It shares no code with the engine: points, rows, scaling and starts are made anew here. There is no
refinement and no verification, as in most scripts. The intervals are equal.

Symbols: tau points of an interval; D slopes of the Lagrange polynomials through its start and its
points, at the points; b weights of the quadrature.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import Legendre

from benchmarks.shows.engine.variant import Variant, evaluated

DEGREE = 3
ITERATIONS = 600
SECONDS = 20.0  # of the processor, for a run

Values = np.ndarray[Any, np.dtype[np.float64]]
Motion = Mapping[str, tuple[float, float, Callable[[Values], Mapping[str, Any]]]]


@dataclass(frozen=True, eq=False)
class Start:
    """Where a run starts.

    Attributes
    ----------
    phases : by name, start and end time and a function from fractions of the phase to signals
    unknowns : by name, peaks included
    """

    phases: Motion
    unknowns: Mapping[str, float]


def radau() -> tuple[Values, Values, Values]:
    """Points (d,) with the end of the interval, slopes (d + 1, d) and weights (d,)."""
    legendre = Legendre.basis(DEGREE) - Legendre.basis(DEGREE - 1)
    roots = np.sort(legendre.roots().real)
    # the roots hold the end 1; flipped points hold it too: (1 - x) of the left ones
    points = 0.5 * (1.0 + roots)
    nodes = np.concatenate([[0.0], points])
    slopes = np.empty((DEGREE + 1, DEGREE))
    weights = np.empty(DEGREE)
    for j in range(DEGREE + 1):
        others = np.delete(nodes, j)
        basis = Polynomial.fromroots(others) / np.prod(nodes[j] - others)
        slopes[j] = basis.deriv()(points)
    for j in range(DEGREE):
        others = np.delete(points, j)
        basis = Polynomial.fromroots(others) / np.prod(points[j] - others)
        weights[j] = basis.integ()(1.0)
    return points, slopes, weights


class Plain:
    """The program of a variant on so many intervals in all.

    Parameters
    ----------
    variant : Variant
    intervals : int
        Shared evenly by the phases.
    """

    def __init__(self, variant: Variant, intervals: int) -> None:
        self.variant = variant
        self.count = intervals // len(variant.phases)
        self.points, self.slopes, self.weights = radau()
        self._columns: list[tuple[Any, Values, Values, Values]] = []  # symbol, scale, limits
        self._rows: list[Any] = []
        self._limits: list[tuple[Values, Values]] = []

        self.extra = [
            *variant.stated.get("unknowns", {}),
            *(name for phase in variant.phases for name in phase.get("peaks", {})),
        ]
        self.unknowns = {name: self._unknown(name) for name in self.extra}
        values = {phase["name"]: self._phase(phase) for phase in variant.phases}
        names = {**variant.at_ends(values), **self.unknowns}
        if variant.samples:
            names["misfit"] = self._misfit(values[variant.phases[0]["name"]])
        for row in variant.stated.get("rows", []):
            lower, upper = variant.limits(row)
            scale = row.get("scale", 1.0)
            self._row(evaluated(row["expression"], names) / scale, lower / scale, upper / scale)
        self._join(values)

        objective = evaluated(variant.stated["objective"], names)
        columns = ca.vertcat(*[ca.vec(symbol) for symbol, *_ in self._columns])
        self.lower = np.concatenate([entry[2] for entry in self._columns])
        self.upper = np.concatenate([entry[3] for entry in self._columns])
        self.row_lower = np.concatenate([lower for lower, _ in self._limits])
        self.row_upper = np.concatenate([upper for _, upper in self._limits])
        options = {
            "print_time": False,
            "ipopt.print_level": 0,
            "ipopt.sb": "yes",
            "ipopt.max_iter": ITERATIONS,
            "ipopt.max_cpu_time": SECONDS,
            "ipopt.mu_strategy": "adaptive",
        }
        close = {"ipopt.mu_strategy": "monotone", "ipopt.mu_init": 1e-4, "ipopt.bound_push": 1e-6}
        program = {"x": columns, "f": objective, "g": ca.vertcat(*self._rows)}
        self._solvers = {
            False: ca.nlpsol("plain", "ipopt", program, options),
            True: ca.nlpsol("plain", "ipopt", program, {**options, **close}),
        }

    def fractions(self) -> tuple[Values, Values]:
        """Fractions of the phase of the first point and all points of states, and of controls."""
        places = ((np.arange(self.count)[:, None] + self.points) / self.count).ravel()
        return np.concatenate([[0.0], places]), places

    def solve(self, start: Start, *, close: bool = False) -> float:
        """The objective of a run from a start, nan where it finds no motion.

        Where the start is close to an optimum, the barrier is small.
        """
        columns = self._packed(start)
        solver = self._solvers[close]
        result = solver(
            x0=np.clip(columns, self.lower, self.upper),
            lbx=self.lower,
            ubx=self.upper,
            lbg=self.row_lower,
            ubg=self.row_upper,
        )
        return float(result["f"]) if solver.stats()["success"] else math.nan

    def _column(self, symbol: Any, scale: Values, lower: Values, upper: Values) -> None:
        self._columns.append((symbol, scale, lower / scale, upper / scale))

    def _row(self, expression: Any, lower: float, upper: float) -> None:
        size = ca.vec(expression).shape[0]
        self._rows.append(ca.vec(expression))
        self._limits.append((np.full(size, lower), np.full(size, upper)))

    def _unknown(self, name: str) -> Any:
        entry = self.variant.stated.get("unknowns", {}).get(name, {"lower": 0.0})
        symbol, scale = ca.MX.sym(name), np.array([max(abs(entry.get("guess", 1.0)), 1.0)])
        lower, upper = self.variant.limits(entry)
        self._column(symbol, scale, np.array([lower]), np.array([upper]))
        return symbol * scale[0]

    def _time(self, phase: Mapping[str, Any], end: str) -> Any:
        lower, upper, guess = self.variant.times(phase, end)
        symbol, scale = ca.MX.sym(end), np.array([max(abs(guess), 1e-3)])
        self._column(symbol, scale, np.array([lower]), np.array([upper]))
        return symbol * scale[0]

    def scale(self, signal: Mapping[str, Any]) -> float:
        """Typical size of a signal: its scale, else its guess, else its limits."""
        if "scale" in signal:
            return float(signal["scale"])
        guess = max(abs(self.variant.guess(signal, s)) for s in (0.0, 0.5, 1.0))
        finite = [abs(v) for v in self.variant.limits(signal) if math.isfinite(v)]
        return guess or min(max(finite, default=1.0), 10.0) or 1.0

    def _phase(self, phase: Mapping[str, Any]) -> dict[str, Any]:
        """Columns and rows of a phase; its boundary values, integrals and misfits by name."""
        variant, n, d = self.variant, self.count, DEGREE
        times = [self._time(phase, end) for end in ("start", "end")]
        step = (times[1] - times[0]) / n
        self._row(times[1] - times[0], 0.0, math.inf)

        states, controls = phase["states"], phase["controls"]
        x_scale = np.array([self.scale(entry) for entry in states.values()])
        x = self._signals("X", states, n * d + 1)
        u = self._signals("U", controls, n * d)

        fractions = self.fractions()[1]
        time = times[0] + (times[1] - times[0]) * ca.DM(fractions[None, :])
        unknown = ca.vertcat(*self.unknowns.values(), ca.MX(0, 1))
        kernel = self._kernel(phase).map(n * d)
        rates, integrands, path, peaks = kernel(x[:, 1:], u, time, ca.repmat(unknown, 1, n * d))

        # slopes of the polynomial through the start of each interval and its points
        parts = [x[:, 0 : n * d : d], *(x[:, 1 + j :: d] for j in range(d))]
        for i in range(d):
            slope = sum(self.slopes[j, i] * parts[j] for j in range(d + 1))
            miss = slope - step * rates[:, i::d]
            self._row(ca.DM(np.diag(1 / x_scale)) @ miss, 0.0, 0.0)
        for k, row in enumerate(phase.get("path", [])):
            least, most = variant.limits(row)
            scale = row.get("scale", 1.0)
            self._row(path[k, :] / scale, least / scale, most / scale)
        for k, name in enumerate(phase.get("peaks", {})):
            self._row(peaks[k, :] - self.unknowns[name], -math.inf, 0.0)
            self._row(-peaks[k, :] - self.unknowns[name], -math.inf, 0.0)

        weights = step * ca.DM(np.tile(self.weights, n))
        values: dict[str, Any] = {"t_i": times[0], "t_f": times[1], "states": parts}
        for i, name in enumerate(states):
            values |= {f"{name}_i": x[i, 0], f"{name}_f": x[i, -1]}
        for k, name in enumerate(phase.get("integrals", {})):
            values[name] = integrands[k, :] @ weights
        return values

    def _signals(self, name: str, entries: Mapping[str, Any], count: int) -> Any:
        """Signals (n, count) with their limits; those with boundary values are fixed there."""
        scale = np.array([self.scale(entry) for entry in entries.values()])
        limits = np.array([self.variant.limits(e) for e in entries.values()]).reshape(-1, 2)
        lower, upper = (np.repeat(limits[:, [k]], count, axis=1) for k in (0, 1))
        for i, entry in enumerate(entries.values()):
            for key, column in (("first", 0), ("last", -1)):
                if key in entry:
                    lower[i, column] = upper[i, column] = self.variant.value(entry[key])

        symbol = ca.MX.sym(name, len(entries), count)
        self._column(symbol, np.tile(scale, count), lower.ravel(order="F"), upper.ravel(order="F"))
        return ca.DM(np.diag(scale)) @ symbol if entries else symbol

    def _kernel(self, phase: Mapping[str, Any]) -> ca.Function:
        """``(x, u, t, unknowns) -> rates, integrands, path, peaks`` at one point."""
        x, u = ca.SX.sym("x", len(phase["states"])), ca.SX.sym("u", len(phase["controls"]))
        t, p = ca.SX.sym("t"), ca.SX.sym("p", len(self.extra))
        names: dict[str, Any] = {**self.variant.numbers, "t": t}
        names |= {name: x[i] for i, name in enumerate(phase["states"])}
        names |= {name: u[i] for i, name in enumerate(phase["controls"])}
        names |= {name: p[i] for i, name in enumerate(self.extra)}
        for name, expression in phase.get("let", {}).items():
            names[name] = evaluated(expression, names)

        def column(expressions: Sequence[Any]) -> Any:
            values = [ca.SX(evaluated(e, names)) for e in expressions]
            return ca.densify(ca.vertcat(*values, ca.SX(0, 1)))

        rates = column([phase["rates"][name] for name in phase["states"]])
        integrands = column(list(phase.get("integrals", {}).values()))
        path = column([row["expression"] for row in phase.get("path", [])])
        peaks = column(list(phase.get("peaks", {}).values()))
        return ca.Function("point", [x, u, t, p], [rates, integrands, path, peaks])

    def _misfit(self, values: Mapping[str, Any]) -> Any:
        """Sum of squared distances from the samples, by the polynomial of each interval."""
        phase, samples = self.variant.phases[0], self.variant.samples
        start, _, end = (self.variant.times(phase, key)[0] for key in ("start", "end", "end"))
        nodes = np.concatenate([[0.0], self.points])
        total = 0.0
        for place, time in enumerate(samples["times"]):
            passed = (time - start) / (end - start) * self.count
            k = min(int(passed), self.count - 1)
            tau = passed - k
            basis = [float(np.prod([(tau - b) / (a - b) for b in nodes if b != a])) for a in nodes]
            for i, name in enumerate(phase["states"]):
                value = sum(w * part[i, k] for w, part in zip(basis, values["states"], strict=True))
                total += (value - samples[name][place]) ** 2
        return total

    def _join(self, values: Mapping[str, Mapping[str, Any]]) -> None:
        """Rows that make time and states continuous from phase to phase."""
        phases = self.variant.phases
        for one, other in pairwise(phases):
            before, after = values[one["name"]], values[other["name"]]
            self._row(after["t_i"] - before["t_f"], 0.0, 0.0)
            for name, entry in other["states"].items():
                gap = after[f"{name}_i"] - before[f"{name}_f"]
                self._row(gap / self.scale(entry), 0.0, 0.0)

    def _packed(self, start: Start) -> Values:
        """The columns of a start, in the order in which they were made."""
        pieces = [np.array([start.unknowns[name]]) for name in self.extra]
        for phase in self.variant.phases:
            first, last, signals = start.phases[phase["name"]]
            pieces += [np.array([first]), np.array([last])]
            for names, at in zip(
                (phase["states"], phase["controls"]), self.fractions(), strict=True
            ):
                values = signals(at)
                rows = [np.broadcast_to(values[name], at.shape) for name in names]
                pieces.append(np.array(rows).reshape(-1, at.size).ravel(order="F"))
        scales = [scale for _, scale, *_ in self._columns]
        return np.concatenate([p / s for p, s in zip(pieces, scales, strict=True)])


def crude_start(variant: Variant, random: np.random.Generator | None = None) -> Start:
    """The crude guess of the file; with a generator, waves and other times are added to it."""
    phases: dict[str, Any] = {}
    shift = 1.0 if random is None else 2.0 ** random.uniform(-1.0, 1.0)
    for phase in variant.phases:
        ends = []
        for key in ("start", "end"):
            lower, upper, guess = variant.times(phase, key)
            ends.append(float(np.clip(guess * shift, lower, upper)))
        waves = {
            name: None if random is None else random.normal(0.0, [0.5, 0.25, 0.12])
            for name in (*phase["states"], *phase["controls"])
        }
        phases[phase["name"]] = (*ends, _signals(variant, phase, waves))
    entries = variant.stated.get("unknowns", {})
    unknowns = {name: float(entry["guess"]) for name, entry in entries.items()}
    unknowns |= {name: 1.0 for phase in variant.phases for name in phase.get("peaks", {})}
    return Start(phases, unknowns)


def _signals(
    variant: Variant, phase: Mapping[str, Any], waves: Mapping[str, Any]
) -> Callable[[Values], Mapping[str, Values]]:
    """Signals at fractions of a phase: the guess, and sines of the given heights on top."""

    def at(fractions: Values) -> dict[str, Values]:
        values = {}
        for name, entry in (*phase["states"].items(), *phase["controls"].items()):
            guess = np.array([variant.guess(entry, float(s)) for s in fractions])
            if waves[name] is not None:
                lower, upper = variant.limits(entry)
                narrow = math.isfinite(upper - lower)
                size = 0.5 * (upper - lower) if narrow else max(np.abs(guess).max(), 1.0)
                for k, height in enumerate(waves[name], start=1):
                    guess = guess + height * size * np.sin(k * math.pi * fractions)
                guess = np.clip(guess, lower, upper)
            values[name] = guess
        return values

    return at
