"""Swing-up of a pole on a cart.

A pole of 0.5 m with a mass of 0.3 kg at its end hangs from a cart of 1 kg. Within 2 s the cart
shall move 1 m to the side while the pole swings up, and all shall be at rest then. The integral of
the squared force shall be least.

The equations of motion follow from Lagrange's equations. The angle is zero while the pole hangs.
A straight line from the first to the last position is guess enough.

Source: M. Kelly, "An Introduction to Trajectory Optimization", SIAM Review 59, 2017. The optimum
58.8076674582 N² s was found by collocation and, independently, from the boundary value problem of
Pontryagin's principle.
"""

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np

from ocp import Control, Phase, Problem, State, solve

length, cart, bob, gravity = 0.5, 1.0, 0.3, 9.81

x = State("position", "m", lower=-2, upper=2)
q = State("angle", "rad")
v = State("speed", "m/s")
w = State("angular speed", "rad/s")
force = Control("force", "N", lower=-20, upper=20)

sin, cos = ca.sin(q), ca.cos(q)
mass = cart + bob * sin**2
push = force + bob * sin * (length * w**2 + gravity * cos)
swing = Phase(
    "swing",
    dynamics={
        x: v,
        q: w,
        v: push / mass,
        w: -(push * cos / mass + gravity * sin) / length,
    },
    initial={x: 0, q: 0, v: 0, w: 0},
    final={x: 1, q: ca.pi, v: 0, w: 0},
    end=2.0,
    guess={x: (0, 1), q: (0, ca.pi)},
)
problem = Problem("swing-up", swing, minimise=swing.integral(force**2))
solution = solve(problem)
print(f"effort {solution.objective:.7f} N² s, {solution.verdict}")

times = np.linspace(0, 2, 401)
figure, (above, below) = plt.subplots(
    2, 1, figsize=(6, 5), height_ratios=(3, 2), layout="constrained"
)
for time in np.linspace(0, 2, 15):
    cart_at, angle = (float(solution.sample(signal, time)) for signal in (x, q))
    tip = (cart_at + length * np.sin(angle), -length * np.cos(angle))
    shade = plt.get_cmap("viridis")(time / 2.3)
    above.plot([cart_at, tip[0]], [0, tip[1]], "o-", color=shade, markersize=3)
above.set_aspect("equal")
above.set_xlabel("x [m]")
above.set_ylabel("z [m]")
below.plot(times, solution.sample(force, times))
below.set_xlabel("time [s]")
below.set_ylabel("force [N]")
figure.savefig("cart_pole.png", dpi=120)
