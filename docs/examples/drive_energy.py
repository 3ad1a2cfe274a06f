"""Least energy of a drive that feeds nothing back.

A crane trolley of 500 kg shall travel 12 m from rest to rest in 8 s. Its drive gives at most 1000 N
in either direction, and 100 N are lost to friction. What it draws from the supply is its power,
force times speed. What it feeds back while it brakes is lost in a resistor. So the energy is the
integral of the larger of two: of the power, and of zero.

Such a cost has a kink where the power is zero, and there the optimum stays for most of the time:
the trolley coasts. Nothing has to be done about it. `ocp` states the larger of two as a control of
its own, which is nowhere below either of them.

The drive accelerates with all it has, coasts, and brakes with all it has. In closed form the speed
from which it coasts follows from the distance and the time. Beside it is the motion with the least
integral of the squared force, which heats the motor least. It draws more energy.
"""

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np

from ocp import Control, Phase, Problem, State, solve

MASS, FRICTION, MOST = 500.0, 100.0, 1000.0  # kg, N, N
DISTANCE, DURATION = 12.0, 8.0  # m, s

x = State("position", "m")
v = State("speed", "m/s", lower=0)
force = Control("force", "N", lower=-MOST, upper=MOST)

travel = Phase(
    "travel",
    dynamics={x: v, v: (force - FRICTION) / MASS},
    initial={x: 0, v: 0},
    final={x: DISTANCE, v: 0},
    end=DURATION,
)
energy = travel.integral(ca.fmax(force * v, 0), name="energy", unit="J")
heat = travel.integral(force**2, name="squared force", unit="N^2 s")

motions = {
    "least energy": solve(Problem("least energy", travel, minimise=energy)),
    "least squared force": solve(Problem("least heat", travel, minimise=heat)),
}
energies = {name: solution.value(energy) for name, solution in motions.items()}
for name, solution in motions.items():
    print(f"{name}: {energies[name]:.1f} J, {solution.verdict}")

times = np.linspace(0, DURATION, 1001)
figure, panels = plt.subplots(2, 1, sharex=True, figsize=(6, 4.5), layout="constrained")
for (name, solution), style in zip(motions.items(), ("-", "--"), strict=True):
    speed = solution.sample(v, times)
    panels[0].plot(times, speed, style, label=f"{name}, {energies[name]:.0f} J")
    panels[1].plot(times, 1e-3 * speed * solution.sample(force, times), style)
panels[0].set_ylabel("speed [m/s]")
panels[0].legend()
panels[1].set_ylabel("power of the drive [kW]")
panels[1].set_xlabel("time [s]")
figure.savefig("drive_energy.png", dpi=120)
