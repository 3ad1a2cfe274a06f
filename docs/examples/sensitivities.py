"""Sensitivities: what a constant of the problem is worth.

This is [Bryson and Denham's ride](bryson_denham.md) once more, for a cart of the mass m, with the
first speed w and the ceiling l. Each of the three is stated as a `Constant`.
After one solve `sensitivities` gives the change of the optimum per unit of every constant. It comes
from the multipliers, no further solve is needed.

In closed form the optimum is J = 4 m² w³/(9 l). So the sensitivities are 2 J/m, 3 J/w and -J/l.
"""

import matplotlib.pyplot as plt

from ocp import Constant, Control, Phase, Problem, State, solve

mass = Constant("mass", "kg", 1.5)
speed = Constant("first speed", "m/s", 1.0)
ceiling = Constant("ceiling", "m", 1 / 9)

x = State("position", "m", upper=ceiling)
v = State("speed", "m/s")
force = Control("force", "N")
ride = Phase(
    "ride",
    dynamics={x: v, v: force / mass},
    initial={x: 0, v: speed},
    final={x: 0, v: -speed},
    end=1.0,
)
solution = solve(Problem("ride", ride, minimise=ride.integral(force**2 / 2)))
print(f"effort {solution.objective:.6f} N² s")

slopes = solution.sensitivities()
constants = (mass, speed, ceiling)
for constant in constants:
    print(f"{slopes[constant.name]:+.5f} N² s per {constant.unit} of {constant.name}")

gains = [slopes[constant.name] * 0.01 * constant.value for constant in constants]
figure, panel = plt.subplots(figsize=(6, 2.4), layout="constrained")
panel.barh([constant.name for constant in constants], gains)
panel.axvline(0, color="0.3", linewidth=0.8)
panel.set_xlabel("change of the effort for 1 % more [N² s]")
figure.savefig("sensitivities.png", dpi=120)
