"""An infeasible problem, understood with `relaxed`.

A cart shall move 1 m in 1 s, from rest to rest, with at most 3 m/s² and at most 1.6 m/s. No motion
does that. `solve` raises an error. `relaxed` then finds out which limits would have to give way,
and by how much in their own units, if their sum shall be least.

`only` names the limits that may give way: first the acceleration, then the distance.
If only the acceleration gives way, the speed rises to 1.6 m/s, stays there and falls again. The
acceleration that this takes is v²/(v T - d) = 4.2667 m/s², with the speed limit v, the duration T
and the distance d. If only the distance gives way, a T²/4 = 0.75 m can be reached.
"""

import matplotlib.pyplot as plt
import numpy as np

from ocp import Control, Phase, Problem, SolveFailed, State, relaxed, solve

x = State("position", "m")
v = State("speed", "m/s", lower=-1.6, upper=1.6)
a = Control("acceleration", "m/s^2", lower=-3, upper=3)

dash = Phase(
    "dash",
    dynamics={x: v, v: a},
    initial={x: 0, v: 0},
    final={x: 1, v: 0},
    end=1.0,
)
problem = Problem("dash", dash, minimise=dash.integral(a**2))
try:
    solve(problem)
except SolveFailed as error:
    print(f"solve: {type(error).__name__}")

by_acceleration = relaxed(problem, only=["acceleration"])
by_distance = relaxed(problem, only=["dash: position final"])
for relaxation in (by_acceleration, by_distance):
    for item in relaxation.items:
        print(item)

times = np.linspace(0, 1, 401)
figure, panels = plt.subplots(2, 1, sharex=True, figsize=(6, 4), layout="constrained")
for panel, name, unit in zip(panels, ("position", "speed"), ("m", "m/s"), strict=True):
    panel.plot(times, by_acceleration.solution.sample(name, times), label="more acceleration")
    panel.plot(times, by_distance.solution.sample(name, times), "--", label="less distance")
    panel.set_ylabel(f"{name} [{unit}]")
panels[0].legend()
panels[-1].set_xlabel("time [s]")
figure.savefig("relaxed_limits.png", dpi=120)
