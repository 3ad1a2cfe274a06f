"""Many starts: on which side of an obstacle.

A robot crosses a room of 4 m in 1 s. A round pillar of 1 m radius stands almost in the middle of
the straight line: its centre is 0.2 m above it. The integral of the squared speed shall be least.

There are two ways round, so there are two optima. A solver finds the one that its guess leads to.
`audit` starts many times, each time from another guess, and lists the distinct optima.
Here the least integral is the squared length of the shortest way divided by 1 s. This length is
that of two tangents and an arc of the circle.
"""

import matplotlib.pyplot as plt
import numpy as np

from ocp import Bound, Control, Phase, Problem, State, audit

x = State("x", "m", lower=-3, upper=3)
y = State("y", "m", lower=-3, upper=3)
u = Control("speed along x", "m/s", lower=-20, upper=20)
w = Control("speed along y", "m/s", lower=-20, upper=20)

crossing = Phase(
    "crossing",
    dynamics={x: u, y: w},
    initial={x: -2, y: 0},
    final={x: 2, y: 0},
    end=1.0,
    bounds=[Bound("pillar", x**2 + (y - 0.2) ** 2, "m^2", lower=1.0)],
    guess={x: (-2, 2), y: lambda t: 3 * t * (1 - t), u: 4.0},
)
problem = Problem("crossing", crossing, minimise=crossing.integral(u**2 + w**2))
result = audit(problem, starts=6, seed=0)
print(result)

times = np.linspace(0, 1, 401)
turn = np.linspace(0, 2 * np.pi, 200)
figure, panel = plt.subplots(figsize=(6, 4), layout="constrained")
panel.fill(np.cos(turn), 0.2 + np.sin(turn), color="0.85", label="pillar")
for optimum in result.optima:
    way = optimum.solution
    panel.plot(way.sample(x, times), way.sample(y, times), label=f"{optimum.objective:.4f} m²/s")
panel.set_aspect("equal")
panel.set_xlabel("x [m]")
panel.set_ylabel("y [m]")
panel.legend()
figure.savefig("many_starts.png", dpi=120)
