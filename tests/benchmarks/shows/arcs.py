"""Optima of singular problems whose arcs are known: the lengths of the arcs are all that is open.

Where the file of a problem says which arcs its control has, each with the control as a function of
time and states, a motion is a plain simulation and the optimum is the least objective over a few
lengths. So it is known to more digits than a collocation gives. Nothing is shared with the engine.

Whatever the lengths, a motion within the limits has an objective that is not below the optimum.
That the arcs are the right ones is known from the literature or from the minimum principle.

Symbols: z states and integrals; h length of a step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from scipy.optimize import minimize

from benchmarks.shows.engine.variant import Variant, evaluated

# Steps of an arc by the classical method of Runge and Kutta. The difference from half as many takes
# most of the error away (Richardson), and bounds what is left.
STEPS, ORDER = 500, 4

# largest slope of the objective in a length at which it is a minimum to twelve digits
_FLAT = 1e-6


@dataclass(frozen=True)
class KnownOptimum:
    """The optimum of a problem with known arcs.

    Attributes
    ----------
    objective : float
    lengths : tuple of float
        Of the arcs [s].
    error : float
        What Richardson's step has changed of the objective.
    """

    objective: float
    lengths: tuple[float, ...]
    error: float


def optimum_of(variant: Variant) -> KnownOptimum:
    """The least objective over the lengths of the arcs.

    Raises
    ------
    KeyError
        The file says nothing of arcs.
    ArithmeticError
        The search ended away from a minimum.
    """
    guess = np.array([arc["lasts"] for arc in variant.stated["arcs"][:-1]])
    lengths = ca.MX.sym("lengths", guess.size)
    coarse, fine = (_objective(variant, lengths, steps) for steps in (STEPS // 2, STEPS))
    correction = (fine - coarse) / (2**ORDER - 1)

    objective = fine + correction
    curvature, slope = ca.hessian(objective, lengths)
    values = ca.Function("values", [lengths], [objective, slope])
    curvatures = ca.Function("curvatures", [lengths], [curvature])

    def valued(d: Any) -> tuple[float, Any]:
        value, gradient = values(d)
        return float(value), np.array(gradient).ravel()

    found = minimize(
        valued,
        guess,
        jac=True,
        hess=lambda d: np.array(curvatures(d)),
        method="trust-exact",
        options={"gtol": 1e-2 * _FLAT},
    )
    if np.abs(found.jac).max() > _FLAT:
        raise ArithmeticError(
            f"no least objective over the arcs of '{variant.name}': {found.message}"
        )

    rest = variant.value(variant.phases[0]["end"]) - found.x.sum()
    error = abs(float(ca.Function("error", [lengths], [correction])(found.x)))
    return KnownOptimum(float(found.fun), (*found.x.tolist(), float(rest)), error)


def _objective(variant: Variant, lengths: Any, steps: int) -> Any:
    """The objective at lengths of all arcs but the last, by so many steps an arc."""
    (phase,) = variant.phases
    first = [variant.value(entry["first"]) for entry in phase["states"].values()]
    integrals = phase.get("integrals", {})
    z, time = ca.MX(first + [0.0] * len(integrals)), ca.MX(0.0)

    durations = [*ca.vertsplit(lengths), variant.value(phase["end"]) - ca.sum1(lengths)]
    for arc, duration in zip(variant.stated["arcs"], durations, strict=True):
        h = duration / steps
        march = _step(variant, arc["control"]).mapaccum(steps)
        times = (time + h * ca.DM(np.arange(steps))).T
        z = march(z, times, ca.repmat(h, 1, steps))[:, -1]
        time = time + duration

    names = dict(zip([*phase["states"], *integrals], ca.vertsplit(z), strict=True))
    final = {f"{name}_f": names[name] for name in phase["states"]}
    ends = {phase["name"]: final | {name: names[name] for name in integrals}}
    return evaluated(variant.stated["objective"], variant.at_ends(ends))


def _step(variant: Variant, control: str) -> Any:
    """A step of Runge and Kutta with the control of an arc: z, time, h to z."""
    (phase,) = variant.phases
    states, (name,) = list(phase["states"]), phase["controls"]
    integrals = phase.get("integrals", {})
    z, t, h = ca.SX.sym("z", len(states) + len(integrals)), ca.SX.sym("t"), ca.SX.sym("h")

    def rate(at: Any, time: Any) -> Any:
        signals = zip(states, ca.vertsplit(at)[: len(states)], strict=True)
        names = {**variant.numbers, **dict(signals), "t": time}
        for key, expression in variant.stated.get("arcs_let", {}).items():
            names[key] = evaluated(expression, names)
        names[name] = evaluated(control, names)
        right = [phase["rates"][state] for state in states] + list(integrals.values())
        return ca.vertcat(*(evaluated(expression, names) for expression in right))

    one = rate(z, t)
    two = rate(z + h / 2 * one, t + h / 2)
    three = rate(z + h / 2 * two, t + h / 2)
    four = rate(z + h * three, t + h)
    return ca.Function("step", [z, t, h], [z + h / 6 * (one + 2 * two + 2 * three + four)])
