"""Two phases with a jump: a cart picks up a load.

A cart of 1 kg starts at rest. At 0.5 m a load of 1 kg lies on the track. The cart takes it along,
and momentum is kept: the speed right after is half the speed right before. Both shall be at rest
at 1 m after 2 s. The integral of the squared force shall be least.

Each half of the motion is a phase, because the mass differs. `joined` links time and states from
one phase to the next, and `jump` says what a state becomes. When the load is picked up is free.

Within a phase the least effort is known in closed form. The best instant and the best speed at the
load follow by minimising the sum of both, without any optimal control. The result is 27/8 N² s.
"""

import matplotlib.pyplot as plt
import numpy as np

from ocp import Between, Control, Phase, Problem, State, joined, solve

x = State("position", "m")
v = State("speed", "m/s")
force = Control("force", "N")

alone = Phase(
    "alone",
    dynamics={x: v, v: force / 1.0},
    initial={x: 0, v: 0},
    final={x: 0.5},
    end=Between(0.2, 1.8),
)
loaded = Phase(
    "loaded",
    dynamics={x: v, v: force / 2.0},
    final={x: 1, v: 0},
    start=Between(0.2, 1.8),
    end=2.0,
)
problem = Problem(
    "pick up",
    (alone, loaded),
    minimise=alone.integral(force**2) + loaded.integral(force**2),
    links=joined(alone, loaded, jump={v: v / 2}),
)
solution = solve(problem)
instant = solution.value(alone.end_time)
before = float(solution.sample(v, instant, phase=alone))
after = float(solution.sample(v, instant, phase=loaded))
print(f"effort {solution.objective:.6f} N² s, {solution.verdict}")
print(f"picked up at {instant:.6f} s, speed {before:.6f} m/s before, {after:.6f} m/s after")

figure, panels = plt.subplots(2, 1, sharex=True, figsize=(6, 4), layout="constrained")
for phase, times in (
    (alone, np.linspace(0, instant, 201)),
    (loaded, np.linspace(instant, 2, 201)),
):
    for panel, signal in zip(panels, (v, force), strict=True):
        panel.plot(times, solution.sample(signal, times, phase=phase), label=phase.name)
        panel.set_ylabel(f"{signal.name} [{signal.unit}]")
panels[0].legend()
panels[-1].set_xlabel("time [s]")
figure.savefig("pick_up.png", dpi=120)
