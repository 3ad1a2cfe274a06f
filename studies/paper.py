"""`antenna-ocp paper`: the paper's figures and those that follow from it, beside the models'.

Symbols: T [s], D [rad] stroke, j [rad/s^3] jerk cap, mu pulley friction, e [m] slider distance.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from models.laws import PAPER_POINTS, Bezier, Step5, least_peak_acceleration, pinned
from models.truss import (
    DYNAMIC_SET,
    KINEMATIC_SET,
    TrussParameters,
    inertia,
    least_peak_reaction,
    least_peak_rope_acceleration,
    ring_radius,
    static_force,
    static_peak,
    total_mass,
)
from studies.common.console import Console, Table, number
from studies.common.exit_codes import ExitCode
from studies.truss.deployment import Deployment

T = 140.0  # [s]
DEPLOYED = math.pi / 2
D = DEPLOYED - DYNAMIC_SET.stowed_angle
STEP5 = Step5(T, DYNAMIC_SET.stowed_angle, DEPLOYED)
PRINTED = Bezier(T)
PINNED = Bezier(T, pinned(PAPER_POINTS, DYNAMIC_SET.stowed_angle, DEPLOYED))
WITH_FRICTION = dataclasses.replace(DYNAMIC_SET, pulley_friction=0.01)
AS_PRINTED = dataclasses.replace(DYNAMIC_SET, counting="as printed")


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes
    ----------
    quantity, unit : what.
    paper : printed in the paper, or None.
    formula : from a closed form written out here, independent of the models, or None.
    ours : what the models give.
    """

    quantity: str
    unit: str
    paper: float | None
    formula: float | None
    ours: float


def rows() -> list[Row]:
    """All lines, in the order of the paper."""
    return [*_laws(), *_bounds(), *_rope(), *_geometry(), *_forces(), *_masses()]


def _laws() -> list[Row]:
    acceleration, unit = "peak-acceleration", "rad/s^2"
    step5 = Deployment("Step5", STEP5, KINEMATIC_SET).values[acceleration]
    bezier = Deployment("Bezier", PRINTED, KINEMATIC_SET).values[acceleration]
    return [
        Row("peak angular acceleration, Step5", unit, 5.7e-4, 3.75 * 2 * D / T**2, step5),
        Row("peak angular acceleration, Bezier", unit, 4.28e-4, None, bezier),
        Row("  reduction", "%", 24.6, None, 100 * (1 - bezier / step5)),
        Row("  least of any Bezier of degree 8", unit, 4.28e-4, None, best_bezier()),
    ]


def best_bezier(grid: int = 4001) -> float:
    """Least peak acceleration [rad/s^2] of a Bezier law of degree 8 under (43)-(45).

    The acceleration is linear in the three free points, so that its peak on a grid is a linear
    program; the grid leaves less than 1e-6 of the peak between its points.
    """
    from scipy.optimize import linprog

    def acceleration(points: tuple[float, ...]) -> np.ndarray:
        law = Bezier(T, points)
        return law.motion(np.linspace(0, T, grid)).acceleration * T**2

    ends = pinned(PAPER_POINTS, DYNAMIC_SET.stowed_angle, DEPLOYED)
    fixed = acceleration((*ends[:3], 0.0, 0.0, 0.0, *ends[6:]))
    columns = [
        acceleration((*ends[:3], *(float(i == k) for i in range(3)), *ends[6:])) - fixed
        for k in range(3)
    ]
    slopes, ones = np.column_stack(columns), np.ones((grid, 1))
    found = linprog(
        [0, 0, 0, 1],
        A_ub=np.block([[slopes, -ones], [-slopes, -ones]]),
        b_ub=np.concatenate([-fixed, fixed]),
        bounds=[(None, None)] * 4,
    )
    return float(found.fun) / T**2


def _bounds() -> list[Row]:
    unit = "rad/s^2"
    infimum = least_peak_acceleration(D, T)
    found = [Row("its infimum without a jerk cap", unit, None, 4 * D / T**2, infimum)]
    for name, law in (("Bezier", PINNED), ("Step5", STEP5)):
        jerk = Deployment(name, law, DYNAMIC_SET).values["peak-jerk"]
        root = math.sqrt(1 - 32 * D / (jerk * T**3))
        title = f"  least at the jerk of {name}, {jerk * T**3:.2f}/T^3"
        least = least_peak_acceleration(D, T, jerk=jerk)
        found.append(Row(title, unit, None, jerk * T / 4 * (1 - root), least))
    return found


def _rope() -> list[Row]:
    unit, truss = "m/s^2", KINEMATIC_SET
    peak = "peak-rope-acceleration"

    bezier = Deployment("Bezier", PINNED, truss)
    _, history = bezier.at(np.linspace(0, T, 100_001))
    stroke = _slider(truss, truss.stowed_angle) - _slider(truss, DEPLOYED)
    infimum = least_peak_rope_acceleration(truss, T)
    step5 = Deployment("Step5", STEP5, truss).values[peak]

    # the paper's figure is below its law's own peak: perhaps it is that of one sign
    one_side = min(-history.rope_acceleration.min(), history.rope_acceleration.max())
    return [
        Row("peak rope acceleration, Step5", unit, 3.55e-3, None, step5),
        Row("peak rope acceleration, Bezier", unit, 2.51e-3, None, bezier.values[peak]),
        Row("  its smaller peak, of one sign", unit, 2.51e-3, None, float(one_side)),
        Row("  infimum without a jerk cap", unit, None, 8 * truss.modules * stroke / T**2, infimum),
    ]


def _geometry() -> list[Row]:
    def diameter(angle: float) -> tuple[float, float]:
        formula = 2 * 0.5 * math.sin(angle) / math.sin(math.pi / 24)
        return formula, 2 * float(ring_radius(KINEMATIC_SET, angle))

    return [
        Row("stowed diameter, b = 0.5 m", "m", 0.588, *diameter(KINEMATIC_SET.stowed_angle)),
        Row("deployed diameter, b = 0.5 m", "m", 7.660, *diameter(DEPLOYED)),
    ]


def _slider(truss: TrussParameters, angle: float) -> float:
    """Slider distance (16) [m], written out: an independent check of the models' one."""
    c, d = truss.crank, truss.link
    return c * math.cos(angle) + math.sqrt(d**2 - (c * math.sin(angle)) ** 2)


def _forces() -> list[Row]:
    truss = DYNAMIC_SET

    def at_rest(angle: float) -> tuple[float, float]:
        # without net and friction two springs share each pair of rope segments
        squeeze = truss.spring_free_length - _slider(truss, angle)
        return truss.spring_stiffness * squeeze / 2, float(static_force(truss, angle))

    bezier = Deployment("Bezier", PINNED, truss)
    peak = bezier.extremes["peak-force"]
    where = math.degrees(float(bezier.law.motion(peak.time).angle[0]))
    rubbing = Deployment("Bezier", PINNED, WITH_FRICTION).values["peak-force"]
    return [
        Row("motor force at the start, mu = 0", "N", None, *at_rest(truss.stowed_angle)),
        Row(f"  peak of Bezier, at {where:.1f} deg", "N", None, None, peak.value),
        Row("  at the end", "N", None, *at_rest(DEPLOYED)),
        Row("  static peak max U'/f", "N", None, None, static_peak(truss).force),
        Row("static peak max U'/f, mu = 0.01", "N", None, None, static_peak(WITH_FRICTION).force),
        Row("  peak of Bezier", "N", None, None, rubbing),
    ]


def _masses() -> list[Row]:
    truss = DYNAMIC_SET

    tubes = truss.modules * (truss.bar_length + 4 * truss.half_cross_bar + 4 * truss.link)
    mass = truss.linear_density * tubes
    infimum = 4 * mass * truss.half_cross_bar * (1 - math.sin(truss.stowed_angle))
    infimum /= math.sin(math.pi / truss.modules) * T**2

    bezier, step5 = (Deployment("", law, truss).values["peak-reaction"] for law in (PINNED, STEP5))
    return [
        Row("mass (m)", "kg", None, mass, float(total_mass(truss))),
        Row("inertia at 4.4 deg (m)", "kg m^2", None, None, _inertia(truss)),
        Row("  counted as printed in (22)-(23)", "kg m^2", None, None, _inertia(AS_PRINTED)),
        Row("inertia at 90 deg (m)", "kg m^2", None, None, _inertia(truss, DEPLOYED)),
        Row("peak reaction, Bezier (m)", "N", None, None, bezier),
        Row("peak reaction, Step5 (m)", "N", None, None, step5),
        Row("  infimum without a jerk cap", "N", None, infimum, least_peak_reaction(truss, T)),
    ]


def _inertia(truss: TrussParameters, angle: float | None = None) -> float:
    return float(inertia(truss, truss.stowed_angle if angle is None else angle))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The command has no arguments."""


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Print the table."""
    table = Table(
        title="Lu, Qi, Hu, Li, Zhang, IEEE Access 2019, DOI 10.1109/ACCESS.2019.2918614",
        head=("quantity", "unit", "paper", "formula", "ours", "to paper", "to formula"),
        rows=[_cells(row) for row in rows()],
        notes=(
            "paper: printed there.  formula: a closed form written out beside the models.",
            "T = 140 s.  (m): with our assumption on the tubes, whose section the paper omits:",
            "20 mm outer and 18 mm inner diameter, 1800 kg/m^3, joints without mass.",
        ),
    )
    console.say(table)
    return ExitCode.OK


def _cells(row: Row) -> tuple[str, ...]:
    return (
        row.quantity,
        row.unit,
        number(row.paper),
        number(row.formula, 6),
        number(row.ours, 6),
        _difference(row.paper, row.ours),
        _difference(row.formula, row.ours),
    )


def _difference(reference: float | None, ours: float) -> str:
    if reference is None:
        return "-"
    percent = 100 * (ours / reference - 1)
    return "< 1e-8 %" if abs(percent) < 1e-8 else f"{percent:+.2f} %"
