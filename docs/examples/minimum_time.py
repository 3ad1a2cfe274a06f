"""Least time: from rest to rest over 1 m.

A cart is pushed with at most 2 m/s² in either direction. It shall be at rest 1 m away as soon as
possible. The end of the phase is free: `Between` gives its limits.

The optimum pushes forwards with all it has, then backwards. In closed form it takes
2 sqrt(d/a) = 1.414214 s, where d is the distance and a the largest acceleration. The mesh is not
told when to switch: the refinement finds the instant.
"""

import matplotlib.pyplot as plt
import numpy as np

from ocp import Between, Control, Phase, Problem, State, solve

x = State("position", "m")
v = State("speed", "m/s")
a = Control("acceleration", "m/s^2", lower=-2, upper=2)

drive = Phase(
    "drive",
    dynamics={x: v, v: a},
    initial={x: 0, v: 0},
    final={x: 1, v: 0},
    end=Between(0.1, 10, guess=3),
)
solution = solve(Problem("least time", drive, minimise=drive.end_time))
duration = solution.value(drive.end_time)
print(f"duration {duration:.6f} s, {solution.verdict}")

times = np.linspace(0, duration, 401)
figure, panels = plt.subplots(2, 1, sharex=True, figsize=(6, 4), layout="constrained")
for panel, signal in zip(panels, (v, a), strict=True):
    panel.plot(times, solution.sample(signal, times))
    panel.set_ylabel(f"{signal.name} [{signal.unit}]")
panels[-1].set_xlabel("time [s]")
figure.savefig("minimum_time.png", dpi=120)
