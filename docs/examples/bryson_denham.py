"""A ride below a ceiling: the problem of Bryson and Denham.

A cart starts at the position 0 m with 1 m/s and comes back after 1 s with -1 m/s. It must not go
further than 1/9 m. The thrust is chosen so that the integral of its square is least.

In the middle of the ride the cart waits at the ceiling, and the thrust is zero.
The optimum is known in closed form: it is 4/(9 l), where l is the height of the ceiling. With
l = 1/9 m it is 4 m²/s³.

Source: A. E. Bryson and Y.-C. Ho, "Applied Optimal Control", 1975, section 3.11.
"""

import matplotlib.pyplot as plt
import numpy as np

from ocp import Control, Phase, Problem, State, solve

x = State("position", "m", upper=1 / 9)
v = State("speed", "m/s")
u = Control("thrust", "m/s^2")

ride = Phase(
    "ride",
    dynamics={x: v, v: u},
    initial={x: 0, v: 1},
    final={x: 0, v: -1},
    end=1.0,
)
problem = Problem("Bryson-Denham", ride, minimise=ride.integral(u**2 / 2))
solution = solve(problem)
print(f"objective {solution.objective:.6f} m²/s³, {solution.verdict}")

times = np.linspace(0, 1, 401)
figure, panels = plt.subplots(3, 1, sharex=True, figsize=(6, 5), layout="constrained")
for panel, signal in zip(panels, (x, v, u), strict=True):
    panel.plot(times, solution.sample(signal, times))
    panel.set_ylabel(f"{signal.name} [{signal.unit}]")
panels[0].axhline(1 / 9, color="0.5", linestyle="--")
panels[-1].set_xlabel("time [s]")
figure.savefig("bryson_denham.png", dpi=120)
