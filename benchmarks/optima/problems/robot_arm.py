"""Fastest turn of a robot arm with a telescopic link."""

import casadi as ca
import numpy as np

from benchmarks.optima.benchmark import Benchmark
from ocp import Between, Constant, Control, Phase, Problem, State

LENGTH = 5.0  # of the link [m]
EARLY = 9.0  # guess of the final time [s]


def robot_arm() -> Benchmark:
    """Least time between two poses at rest; six bang arcs.

    ``rho'' = u_rho / L, theta'' = u_theta / (I sin^2 phi), phi'' = u_phi / I`` with
    ``I = ((L - rho)^3 + rho^3) / 3``, |u| <= 1, ``(4.5, 0, pi/4) -> (4.5, 2 pi/3, pi/4)``.

    Source: COPS 3.0 (2004), "robot" (9.14138 on 200 intervals); Betts (9.14093620).  The exact
    switches lie at 2.285227936, 2.79604321, 4.570455873, 6.344868536 and 6.855683809 s.
    """
    angle = Constant("angle", "rad", 2 * np.pi / 3)
    rho = State("rho", "m", lower=0, upper=LENGTH)
    theta = State("theta", "rad", lower=-ca.pi, upper=ca.pi)
    phi = State("phi", "rad", lower=0, upper=ca.pi)
    d_rho, d_theta, d_phi = (State(f"d_{s.name}", f"{s.unit}/s") for s in (rho, theta, phi))
    u_rho, u_theta, u_phi = (Control(f"u_{s.name}", lower=-1, upper=1) for s in (rho, theta, phi))
    inertia = ((LENGTH - rho) ** 3 + rho.symbol**3) / 3

    turn = Phase(
        "turn",
        {
            rho: d_rho,
            theta: d_theta,
            phi: d_phi,
            d_rho: u_rho / LENGTH,
            d_theta: u_theta / (inertia * ca.sin(phi) ** 2),
            d_phi: u_phi / inertia,
        },
        initial={rho: 4.5, theta: 0, phi: ca.pi / 4, d_rho: 0, d_theta: 0, d_phi: 0},
        final={rho: 4.5, theta: angle, phi: ca.pi / 4, d_rho: 0, d_theta: 0, d_phi: 0},
        end=Between(0.5, 100, guess=EARLY),
        guess={
            rho: 4.5,
            theta: lambda t: 2 * np.pi / 3 * (t / EARLY) ** 2,
            phi: ca.pi / 4,
            d_rho: 0,
            d_theta: lambda t: 4 * np.pi / 3 * t / EARLY,
            d_phi: 0,
            u_rho: 0,
            u_theta: 0,
            u_phi: 0,
        },
    )

    return Benchmark(
        Problem("robot_arm", (turn,), minimise=turn.end_time),
        optimum=9.14091174593,
        tolerance=1e-6,
        source="COPS 3.0, robot; Betts (9.14093620); two computations with exact switches",
    )
