"""A parameter fit: stiffness and damping from a measured oscillation.

A mass of 1 kg on a spring swings freely. Its position has been measured 40 times, with noise.
Stiffness, damping and the first position are sought so that the squared differences are least.

The parameters are `Unknown`, the first position is a state whose initial value is left free, and
`misfit` is the sum of squares. There is no control at all.
For this motion the solution of the differential equation is known, so a curve fit by SciPy finds
the same parameters without any optimal control.
"""

import matplotlib.pyplot as plt
import numpy as np

from ocp import Phase, Problem, State, Unknown, solve

measured = np.linspace(0.0, 6.0, 40)
true_rate = np.sqrt(4.0 - 0.15**2)
noise = np.random.default_rng(1).normal(0.0, 0.02, measured.size)
data = np.exp(-0.15 * measured) * np.cos(true_rate * measured) + noise

stiffness = Unknown("stiffness", "N/m", lower=0.5, upper=20, guess=2)
damping = Unknown("damping", "N s/m", lower=0, upper=5, guess=0.1)
x = State("position", "m")
v = State("speed", "m/s")

swing = Phase(
    "swing",
    dynamics={x: v, v: -stiffness * x - damping * v},
    end=6.0,
    guess={x: (measured, data), v: (measured, np.gradient(data, measured))},
)
problem = Problem("fit", swing, minimise=swing.misfit(x, measured, data))
solution = solve(problem)
print(f"stiffness {solution.value(stiffness):.6f} N/m")
print(f"damping   {solution.value(damping):.6f} N s/m")
print(f"root mean square error {np.sqrt(solution.objective / measured.size):.6f} m")

times = np.linspace(0, 6, 401)
figure, panel = plt.subplots(figsize=(6, 3.2), layout="constrained")
panel.plot(measured, data, "o", markersize=4, label="measured")
panel.plot(times, solution.sample(x, times), label="fitted motion")
panel.set_xlabel("time [s]")
panel.set_ylabel("position [m]")
panel.legend()
figure.savefig("parameter_fit.png", dpi=120)
