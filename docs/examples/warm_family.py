"""A family of problems, each started from the one before.

The ceiling of [Bryson and Denham's problem](bryson_denham.md) is lowered from 0.3 m to 0.05 m.
It is stated as a `Constant`, which may be changed between solves. `homotopy` walks along the
values: each solve starts from the variables and the multipliers of the one before.

`prepare` is for the other case, many solves on one and the same mesh: it builds the program once.
Nothing is refined then, so a loose answer is marked "unverified".

In closed form the optimum is 2 while the ceiling is not touched (l ≥ 1/4), 2 + 6 (1 - 4 l)² while
it is touched at one instant (1/6 ≤ l ≤ 1/4), and 4/(9 l) below.
"""

import matplotlib.pyplot as plt
import numpy as np

from ocp import Constant, Control, Phase, Problem, State, homotopy, prepare

ceiling = Constant("ceiling", "m", 0.3)
x = State("position", "m", upper=ceiling)
v = State("speed", "m/s")
u = Control("thrust", "m/s^2")
ride = Phase(
    "ride",
    dynamics={x: v, v: u},
    initial={x: 0, v: 1},
    final={x: 0, v: -1},
    end=1.0,
)
problem = Problem("family", ride, minimise=ride.integral(u**2 / 2))

heights = [0.3, 0.25, 0.2, 1 / 6, 0.14, 1 / 9, 0.08, 0.05]
family = homotopy(problem, ceiling, heights)
optima = [solution.objective for solution in family.solutions]
for height, solution in zip(heights, family.solutions, strict=True):
    print(f"{height:.4f} m: {solution.objective:.6f} in {solution.iterations} iterations")

prepared = prepare(problem, guess=family.solution)
again = prepared.solve(constants={ceiling: 0.052}, guess=family.solution)
print(f"0.0520 m: {again.objective:.6f} in {again.iterations} iterations, on the same mesh")

dense = np.linspace(0.05, 0.3, 200)
closed = np.where(dense >= 1 / 6, 2 + 6 * np.maximum(1 - 4 * dense, 0) ** 2, 4 / (9 * dense))
figure, panel = plt.subplots(figsize=(6, 3.2), layout="constrained")
panel.plot(dense, closed, label="closed form")
panel.plot(heights, optima, "o", label="solved")
panel.set_xlabel("ceiling [m]")
panel.set_ylabel("least effort [m²/s³]")
panel.legend()
figure.savefig("warm_family.png", dpi=120)
