"""A trade-off: what a smaller force costs in heat.

A drive moves a load of 1 kg by 1 m in 2 s, from rest to rest. Its peak force decides on the size of
the motor. The integral of the force squared decides on the heat. No motion has the least of both.

The peak is *limited* by a `Constant`, and the heat is minimised. `family` walks along the limit:
each motion starts from its neighbour and takes some milliseconds. The result is a *front*: no point
of it is beaten in both objectives by another motion.

`Family.solution` refines and verifies one of the points. Its sensitivity to the limit is the price:
what one newton more would save.

In closed form the force is a straight line in time, cut off at the limit a. It is below the limit
for 2 b, with b² = 3 (T²/4 - d/a), and the heat is 2 a² (T/2 - 2 b/3).
"""

import matplotlib.pyplot as plt
import numpy as np

from ocp import Constant, Control, Phase, Problem, State, family

limit = Constant("force limit", "N", 1.5)
x, v = State("position", "m"), State("speed", "m/s")
force = Control("force", "N", lower=-limit, upper=limit)
move = Phase(
    "move",
    dynamics={x: v, v: force},
    initial={x: 0, v: 0},
    final={x: 1, v: 0},
    end=2.0,
)
problem = Problem("load", move, minimise=move.integral(force**2))

# the least heat of all has a peak of 1.5 N, and no motion has less than 1 N
limits = np.linspace(1.5, 1.01, 50)
front = family(problem, limit, limits)
heat = front.objectives

# the knee: farthest below the line between both ends, in parts of both ranges
below = (limits[0] - limits) / np.ptp(limits) - (heat - heat[0]) / np.ptp(heat)
knee = int(below.argmax())
chosen = front.solution(knee)
price = chosen.sensitivities()["force limit"]
print(f"knee: {limits[knee]:.2f} N, {chosen.objective:.4f} N² s, {chosen.verdict}")
print(f"price there: 0.1 N more saves {-0.1 * price:.4f} N² s")

figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3), layout="constrained")
left.plot(limits, heat)
left.plot(limits[knee], heat[knee], "o", label="knee")
left.set_xlabel("limit of the force [N]")
left.set_ylabel("force squared, integrated [N² s]")
left.legend()
times = np.linspace(0, 2, 801)
for number, name in ((0, "least heat"), (knee, "knee"), (len(limits) - 1, "1.01 N")):
    motion = front.members[number].trajectory.phase("move")
    right.plot(times, motion.sample(times)[:, motion.signals.index("force")], label=name)
right.set_xlabel("time [s]")
right.set_ylabel("force [N]")
right.legend()
figure.savefig("trade_off.png", dpi=120)
