"""Statements of large problems from the literature, with crude guesses.

Each function makes one. What a source leaves open is chosen here, and said.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca

from benchmarks.large.repeated import arm, distillation, heated_rod, launch
from benchmarks.shows.engine.engine_problem import problem_of
from benchmarks.shows.engine.variant import Variant
from ocp import TIME, Algebraic, Between, Bound, Control, Phase, Problem, State


@dataclass(frozen=True)
class Large:
    """A large problem.

    Attributes
    ----------
    title : str
        As in the documents.
    make : callable
        Gives the statement.
    optimum : float
        Best objective known, by meshes that are finer than any in the table [its unit].
    source : str
    """

    title: str
    make: Callable[[], Problem]
    optimum: float
    source: str

    def error(self, objective: float) -> float:
        """How far an objective is from the best one known, relative."""
        return abs(objective - self.optimum) / abs(self.optimum)


def crane() -> Problem:
    """A trolley moves a rope of four links by 4 m, rest to rest, in least time."""
    links, length, bob, trolley, gravity = 4, 0.5, 0.25, 2.0, 9.81
    x, v = State("x", "m"), State("v", "m/s")
    angle = [State(f"angle{i}", "rad") for i in range(links)]
    rate = [State(f"rate{i}", "rad/s") for i in range(links)]
    a = Algebraic("a", "m/s^2")
    spin = [Algebraic(f"spin{i}", "rad/s^2") for i in range(links)]
    force = Control("force", "N", lower=-20, upper=20)

    # Lagrange's equations of point masses below each other, all angles from the vertical
    below = [bob * (links - i) for i in range(links)]
    swing = sum(
        below[i] * length * (spin[i] * ca.cos(angle[i]) - rate[i] ** 2 * ca.sin(angle[i]))
        for i in range(links)
    )
    equations = [("trolley", (trolley + below[0]) * a + swing - force, 20.0)]
    for j in range(links):
        torque = below[j] * length * (ca.cos(angle[j]) * a + gravity * ca.sin(angle[j]))
        for i in range(links):
            turned = angle[j] - angle[i]
            bent = spin[i] * ca.cos(turned) + rate[i] ** 2 * ca.sin(turned)
            torque += below[max(i, j)] * length**2 * bent
        equations.append((f"link{j}", torque, 2.0))

    rest: dict[State, Any] = dict.fromkeys([v, *angle, *rate], 0)
    phase = Phase(
        "move",
        {x: v, v: a, **dict(zip(angle, rate, strict=True)), **dict(zip(rate, spin, strict=True))},
        initial={x: 0, **rest},
        final={x: 4, **rest},
        end=Between(1, 10, guess=4),
        bounds=[Bound(name, row, lower=0, upper=0, scale=size) for name, row, size in equations],
    )
    return Problem("crane", [phase], minimise=phase.duration)


def race_car() -> Problem:
    """A racing car over 500 m with four bends in least time; the way is the free variable."""
    mass, gravity, a, b, half = 800.0, 9.8, 1.8, 1.6, 0.73
    inertia, air, drag, lift, press = 450.0, 1.2, 2.0, 4.0, 1.6
    height, roll, stiff, bias, grip, lag = 0.3, 0.5, 44.0, 0.62, 1.68, 0.2
    clock = State("clock", "s")
    n = State("n", "m", lower=-4, upper=4)
    speed = State("speed", "m/s", lower=5, upper=80)
    heading, slip = State("heading", "rad", scale=0.15), State("slip", "rad", scale=0.05)
    yaw = State("yaw", "rad/s", scale=0.5)
    ax, ay = State("ax", "m/s^2", scale=8), State("ay", "m/s^2", scale=8)
    steer = Control("steer", "rad", lower=-0.5, upper=0.5, scale=0.05)
    drive = Control("drive", lower=0, upper=3)
    brake = Control("brake", lower=0, upper=3)

    # loads of the wheels (front left, front right, rear left, rear right) by the accelerations
    down, base = 0.5 * air * lift * speed**2, a + b
    front = mass * gravity / 2 * b / base - mass / 4 * ax * height / base
    rear = mass * gravity / 2 * a / base + mass / 4 * ax * height / base
    front, rear = front + down * (1 - press / base) / 2, rear + down * press / base / 2
    side_front = mass / 4 * ay * roll * height / half
    side_rear = mass / 4 * ay * (1 - roll) * height / half
    load = [front + side_front, front - side_front, rear + side_rear, rear - side_rear]

    # forces along and across the wheels
    along_front = -mass * gravity / 2 * brake * bias
    along_rear = mass * gravity / 2 * (drive - brake * (1 - bias))
    along = [along_front, along_front, along_rear, along_rear]
    turn = [a + slip * half, a - slip * half, -b + slip * half, -b - slip * half]
    angle = [slip + (steer if i < 2 else 0) - yaw * turn[i] / speed for i in range(4)]
    across = [load[i] * stiff * angle[i] for i in range(4)]

    # four bends, to the left and to the right by turns
    bends = ((80, 0.02), (190, -0.025), (300, 0.03), (410, -0.02))
    bend = sum(k * ca.exp(-(((TIME - s) / 25) ** 2)) for s, k in bends)
    pace = (1 - n * bend) / (speed * ca.cos(heading - slip))  # time per way
    push = sum(along) - steer * (across[0] + across[1]) - 0.5 * air * drag * speed**2
    faster = push / mass - yaw * speed * slip
    sideways = (steer * 2 * along_front + sum(across)) / (mass * speed)
    torque = a * (across[0] + across[1]) - b * (across[2] + across[3])
    phase = Phase(
        "track",
        {
            clock: pace,
            n: pace * speed * ca.sin(heading - slip),
            speed: pace * faster,
            heading: pace * yaw - bend,
            slip: pace * (yaw - faster * slip / speed - sideways),
            yaw: pace * torque / inertia,
            ax: pace * (faster + yaw * speed * slip - ax) / lag,
            ay: pace * (yaw * speed - ay) / lag,
        },
        initial={clock: 0, n: 0, speed: 30, heading: 0, slip: 0, yaw: 0, ax: 0, ay: 0},
        final={n: 0, heading: 0},
        end=500,
        bounds=[
            *(
                Bound(f"tyre{i}", (along[i] ** 2 + across[i] ** 2) / (grip * load[i]) ** 2, upper=1)
                for i in range(4)
            ),
            Bound("power", speed * sum(along) / 1e5, upper=9.6),
        ],
        guess={speed: 30, clock: (0, 17), drive: 0.3, brake: 0.1},
    )
    return Problem("race car", [phase], minimise=phase.at_end(clock))


def orbit_transfer() -> Problem:
    """A low-thrust transfer from an inclined orbit to a higher equatorial one in least time."""
    thrust, exhaust = 0.007, 1.0  # of the weight at the first orbit; of the speed there
    p = State("p", lower=0.5, upper=5)
    f, g = State("f", lower=-0.5, upper=0.5), State("g", lower=-0.5, upper=0.5)
    h, k = State("h", lower=-1, upper=1), State("k", lower=-1, upper=1)
    turn = State("turn", "rad", lower=0, upper=100)
    mass = State("mass", lower=0.1, upper=1)
    radial, along, normal = (Control(n, lower=-1, upper=1) for n in ("radial", "along", "normal"))

    # Gauss's equations in modified equinoctial elements, gravity and first radius 1
    sin, cos = ca.sin(turn), ca.cos(turn)
    w, s2 = 1 + f * cos + g * sin, 1 + h**2 + k**2
    root, tilt = ca.sqrt(p), h * sin - k * cos
    ur, ut, un = (thrust / mass * u for u in (radial, along, normal))
    phase = Phase(
        "thrust",
        {
            p: 2 * p * root / w * ut,
            f: root * (sin * ur + ((w + 1) * cos + f) / w * ut - g * tilt / w * un),
            g: root * (-cos * ur + ((w + 1) * sin + g) / w * ut + f * tilt / w * un),
            h: root * s2 * cos / (2 * w) * un,
            k: root * s2 * sin / (2 * w) * un,
            turn: root * (w / p) ** 2 + root * tilt / w * un,
            mass: -thrust / exhaust * ca.sqrt(radial**2 + along**2 + normal**2 + 1e-12),
        },
        initial={p: 1, f: 0, g: 0, h: -0.1, k: 0, turn: math.pi, mass: 1},
        final={p: 2, f: 0, g: 0, h: 0, k: 0},
        end=Between(10, 100, guess=45),
        bounds=[Bound("thrust", radial**2 + along**2 + normal**2, upper=1)],
        guess={p: (1, 2), f: 0, g: 0, h: (-0.1, 0), k: 0, turn: (math.pi, 36), along: 0.9},
    )
    return Problem("orbit transfer", [phase], minimise=phase.duration)


def bioreactor() -> Problem:
    """Bacteria in a fed batch make most protein, less the price of what induces it."""
    volume, cells = State("volume", "l", lower=0.1), State("cells", "g/l", lower=0)
    nutrient, protein = State("nutrient", "g/l", lower=0), State("protein", "g/l")
    inducer = State("inducer", "g/l", lower=0)
    shock, recovery = State("shock"), State("recovery")
    feed, induction = (Control(n, "l/h", lower=0, upper=1) for n in ("feed", "induction"))

    dilution = (feed + induction) / volume
    taken = nutrient / (14.35 + nutrient * (1 + nutrient / 111.5))
    growth = taken * (shock + recovery * 0.22 / (0.22 + inducer))
    making = 0.233 * taken * (0.0005 + inducer) / (0.022 + inducer)
    change = 0.09 * inducer / (0.034 + inducer)
    phase = Phase(
        "batch",
        {
            volume: feed + induction,
            cells: (growth - dilution) * cells,
            nutrient: 100 * feed / volume - dilution * nutrient - growth * cells / 0.51,
            protein: making * cells - dilution * protein,
            inducer: 4 * induction / volume - dilution * inducer,
            shock: -change * shock,
            recovery: change * (1 - recovery),
        },
        initial={
            volume: 1,
            cells: 0.1,
            nutrient: 40,
            protein: 0,
            inducer: 0,
            shock: 1,
            recovery: 0,
        },
        end=10,
        guess={cells: (0.1, 5), protein: (0, 2), volume: (1, 3), nutrient: (40, 10)},
    )
    price, made = 2.5, phase.at_end(volume) * phase.at_end(protein)
    return Problem("bioreactor", [phase], maximise=made - price * phase.integral(induction))


def _read(title: str, name: str, optimum: float) -> Large:
    """A problem that is stated as text, with its crude guess."""
    variant = Variant.nominal(name, "large")
    return Large(
        title, lambda: problem_of(variant, guessed=True), optimum, variant.stated["source"]
    )


PROBLEMS = {
    "crane": Large(
        "crane, rope of four links, least time",
        crane,
        2.4847951,
        "least-time transfer of a load on a rope that swings: Y. Sakawa, Y. Shindo, Optimal "
        "control of container cranes, Automatica 18 (1982); the rope as four links, numbers here",
    ),
    "race car": Large(
        "racing car, 500 m with four bends",
        race_car,
        11.3146,
        "dymos, example racecar: single-track model with loads and friction circles of four "
        "wheels, after F. Christ et al., Vehicle System Dynamics 59 (2021); track of 500 m here",
    ),
    "orbit transfer": Large(
        "low-thrust transfer, five revolutions",
        orbit_transfer,
        45.0908034,
        "low-thrust transfer in modified equinoctial elements: J. T. Betts, Practical Methods for "
        "Optimal Control, sec. 6.3, without oblateness; a thrust for five revolutions here",
    ),
    "bioreactor": Large(
        "fed-batch bioreactor, most protein",
        bioreactor,
        5.757109,
        "induced protein in a fed batch: J. Lee, W. F. Ramirez, AIChE J. 40 (1994), with the "
        "kinetics of A. Tholudur, W. F. Ramirez (1997); the price of the inducer is 2.5",
    ),
    "powered landing": _read("powered landing", "powered_landing", -1666.257154),
    "rigid body": _read("rigid body, turned in least time", "rigid_body_turn", 3.2430834),
    "launch": Large(
        "Delta III to orbit, four phases",
        launch,
        1.1454209567,
        "D. A. Benson, A Gauss pseudospectral transcription for optimal control, MIT 2005, ch. 7: "
        "Delta III, 7529.71 kg into orbit, so 924.14 s or 1.145421; from memory",
    ),
    "free-flying robot": _read("free-flying robot, least thrust", "free_flying_robot", 7.9101439),
    "distillation": Large(
        "distillation column, 32 states",
        distillation,
        6.497789,
        "binary distillation column of J. D. Hedengren (nonlinear model library, column with 32 "
        "stages), after J. Hahn, T. F. Edgar, Computers and Chemical Engineering 26 (2002); from "
        "memory",
    ),
    "heated rod": Large(
        "heated rod, 20 states",
        heated_rod,
        0.421439097,
        "J. T. Betts, S. L. Campbell, Discretize then optimize, in Mathematics in Industry, SIAM "
        "2005: heat equation with limits of the state; twenty points here",
    ),
    "quadrotor": _read("quadrotor through four gates", "quadrotor_gates", 4.0638229),
    "five-link arm": Large(
        "arm of five links",
        arm,
        0.017335735,
        "a chain of rigid links, equations as in R. M. Murray, Z. Li, S. S. Sastry, A Mathematical "
        "Introduction to Robotic Manipulation, ch. 4; numbers chosen here",
    ),
}
