"""A peak as the objective: the gentlest motion under a jerk limit.

A load moves 1 m in 2 s, from rest to rest. Its largest acceleration shall be as small as possible,
while the jerk (the rate of the acceleration) stays within 20 m/s³. `absolute=True` counts both
signs of the acceleration.

The result is a trapezoid: the acceleration rises at full jerk, stays at its peak, and falls again.
Its peak is known in closed form, (j T² - sqrt(j² T⁴ - 32 j T d)) / (4 T) with the jerk j, the
duration T and the distance d.
The value that the solver reports and the largest value between the mesh points agree: `value`
evaluates the peak between the points too.
"""

import matplotlib.pyplot as plt
import numpy as np

from ocp import Control, Phase, Problem, State, solve

x = State("position", "m")
v = State("speed", "m/s")
a = State("acceleration", "m/s^2")
jerk = Control("jerk", "m/s^3", lower=-20, upper=20)

move = Phase(
    "move",
    dynamics={x: v, v: a, a: jerk},
    initial={x: 0, v: 0, a: 0},
    final={x: 1, v: 0, a: 0},
    end=2.0,
)
peak = move.peak(a, absolute=True, name="peak acceleration", unit="m/s^2")
solution = solve(Problem("gentle move", move, minimise=peak))
print(f"reported peak       {solution.objective:.8f} m/s²")
print(f"between the points  {solution.value(peak):.8f} m/s²")
print(f"of the replay       {solution.value(peak, replayed=True):.8f} m/s²")

times = np.linspace(0, 2, 801)
figure, panels = plt.subplots(2, 1, sharex=True, figsize=(6, 4), layout="constrained")
for panel, signal in zip(panels, (a, jerk), strict=True):
    panel.plot(times, solution.sample(signal, times))
    panel.set_ylabel(f"{signal.name} [{signal.unit}]")
for sign in (-1, 1):
    panels[0].axhline(sign * solution.objective, color="0.5", linestyle="--")
panels[-1].set_xlabel("time [s]")
figure.savefig("peak_objective.png", dpi=120)
