"""A store with losses that buys power when it is cheap and sells when it is expensive.

A battery of 4 MWh is charged or discharged with at most 1 MW, and 5 % are lost in each direction.
It is half full at the start and at the end of the day. The price of power changes every hour. The
cost of the day is the integral of price times power, and it is minimised. Within an hour it makes
no difference when the power is bought.

The losses have a kink in the rate of the stored energy, where the power changes its sign. You need
not do anything about it. `ocp` adds a control that is not below the power or its negative, and
checks after the solve that it equals the modulus. Here it does, because charging and discharging at
once would only lose what was paid for. If the price were negative, that would pay, and `solve`
says so.
"""

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np

from ocp import TIME, Control, Phase, Problem, State, solve

EFFICIENCY, LARGEST, MOST = 0.95, 4.0, 1.0  # -, MWh, MW
HOURS = 24  # the unit of time is one hour

energy = State("energy", "MWh", lower=0, upper=LARGEST)
power = Control("power", "MW", lower=-MOST, upper=MOST)
price = 50 + 20 * ca.sin(2 * ca.pi * ca.floor(TIME) / HOURS)  # EUR/MWh

day = Phase(
    "day",
    dynamics={energy: EFFICIENCY * ca.fmax(power, 0) - ca.fmax(-power, 0) / EFFICIENCY},
    initial={energy: LARGEST / 2},
    final={energy: LARGEST / 2},
    end=HOURS,
)
cost = day.integral(price * power, name="cost", unit="EUR")
solution = solve(Problem("lossy store", day, minimise=cost))
print(f"cost of the day: {solution.objective:.4f} EUR, {solution.verdict}")

times = np.linspace(0, HOURS, 1201)
figure, panels = plt.subplots(3, 1, sharex=True, figsize=(6, 5.5), layout="constrained")
hour = np.minimum(np.floor(times), HOURS - 1)
panels[0].plot(times, 50 + 20 * np.sin(2 * np.pi * hour / HOURS))
panels[0].set_ylabel("price [EUR/MWh]")
panels[1].plot(times, solution.sample(power, times))
panels[1].set_ylabel("power bought [MW]")
panels[2].plot(times, solution.sample(energy, times))
panels[2].set_ylabel("energy [MWh]")
panels[2].set_xlabel("time [h]")
panels[2].set_xticks(range(0, HOURS + 1, 4))
figure.savefig("lossy_store.png", dpi=120)
