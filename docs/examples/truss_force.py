"""The antenna itself: least rope force in 5 s, from the model's own functions.

The command `antenna-ocp truss` states this problem for you. This script states it by hand, with the
ring truss of the package `models`: it opens in 5 s, pulleys have a friction of 0.01, and the jerk
is at most 200/T³. The largest force on a rope shall be as small as possible.

There are two phases, because the cable net becomes taut at 80 degrees. `rope_force` is told which
side of this kink it is on. The instant is free, and the jerk may jump there, but nothing else.

The peak force is flat at its top: the motor pulls with the same force for a while.
"""

import dataclasses

import matplotlib.pyplot as plt
import numpy as np

from models.truss import DYNAMIC_SET, rope_force
from ocp import Between, Bound, Control, Phase, Problem, State, joined, peak, solve

T = 5.0
truss = dataclasses.replace(DYNAMIC_SET, pulley_friction=0.01)
cap = 200 / T**3

angle = State("angle", "rad", lower=0.05, upper=2)
speed = State("speed", "rad/s", lower=0)
acceleration = State("acceleration", "rad/s^2")
jerk = Control("jerk", "rad/s^3", lower=-cap, upper=cap)

slack_force, taut_force = (
    rope_force(truss, angle.symbol, speed.symbol, acceleration.symbol, net)
    for net in ("slack", "taut")
)
dynamics = {angle: speed, speed: acceleration, acceleration: jerk}
slack = Phase(
    "slack",
    dynamics=dynamics,
    initial={angle: truss.stowed_angle, speed: 0, acceleration: 0},
    final={angle: truss.net_angle},
    end=Between(0.1, 4.9, guess=3.5),
    bounds=[Bound("slack rope force", slack_force, "N", lower=0)],
)
taut = Phase(
    "taut",
    dynamics=dynamics,
    final={angle: np.pi / 2, speed: 0, acceleration: 0},
    start=Between(0.1, 4.9, guess=3.5),
    end=T,
    bounds=[Bound("taut rope force", taut_force, "N", lower=0)],
)
highest = peak((slack, slack_force), (taut, taut_force), name="peak force", unit="N")
problem = Problem("truss", (slack, taut), minimise=highest, links=joined(slack, taut))
solution = solve(problem)
print(f"peak force {solution.objective:.5f} N, {solution.verdict}")
print(f"between the points {solution.value(highest):.5f} N")

instant = solution.value(slack.end_time)
figure, panels = plt.subplots(2, 1, sharex=True, figsize=(6, 4.4), layout="constrained")
for phase, force, times in (
    (slack, slack_force, np.linspace(0, instant, 301)),
    (taut, taut_force, np.linspace(instant, T, 301)),
):
    degrees = np.degrees(solution.sample(angle, times, phase=phase))
    panels[0].plot(times, degrees, label=f"net {phase.name}")
    panels[1].plot(times, solution.sample(force, times, phase=phase))
panels[0].set_ylabel("angle [deg]")
panels[0].legend()
panels[1].set_ylabel("force on each rope [N]")
panels[1].set_xlabel("time [s]")
figure.savefig("truss_force.png", dpi=120)
