"""The arm with its ring on ANCF elements: Lagrange's equations as they stand, implicit steps.

Of the project it takes the elements alone. Nodes are shared by neighbours, so that elbow and root
hold; slopes may stretch.

Symbols: e node coordinates (4 N,), a second rates; T kinetic energy of the hoop, U strain energy.
"""

from __future__ import annotations

import math

import casadi as ca
import numpy as np

from models.ancf.element import mass_matrix, strain_energy


def bezier_angle(law, t):
    """Angle of a Bezier law as an expression of time."""
    degree, s = len(law.points) - 1, t / law.duration
    return sum(
        math.comb(degree, i) * point * s**i * (1 - s) ** (degree - i)
        for i, point in enumerate(law.points)
    )


def tip_and_energy(model, law, times, *, elements=2, step=4e-3):
    """Tip's displacement (2, m) [m] at increasing times, and the energy at the last one [J].

    Newmark's average acceleration, with Newton's method in each step.
    """
    arm, truss = model.arm, model.truss
    links = [arm.big] * elements + [arm.small] * elements
    size = 4 * (len(links) + 1)
    e, v, a = (ca.SX.sym(name, size) for name in "eva")
    t = ca.SX.sym("t")

    strain, mass, straight = 0, np.zeros((size, size)), [0.0, 0.0, 1.0, 0.0]
    for k, link in enumerate(links):
        length, own = link.length / elements, slice(4 * k, 4 * k + 8)
        strain += strain_energy(e[own], link.axial_stiffness, link.bending_stiffness, length)
        mass[own, own] += mass_matrix(length, link.linear_density)
        straight += [straight[-4] + length, 0.0, 1.0, 0.0]
    mass[[-4, -3], [-4, -3]] += arm.tip_mass - model.ring_mass

    radius = truss.half_cross_bar * ca.sin(bezier_angle(law, t)) / math.sin(math.pi / truss.modules)
    turn = ca.atan2(e[-1], e[-2])
    along = turn + model.reaction_angle
    centre = e[-4:-2] + radius * ca.vertcat(ca.cos(along), ca.sin(along))
    moved, turned = ca.jtimes(centre, e, v) + ca.jacobian(centre, t), ca.jtimes(turn, e, v)
    hoop = model.ring_mass * (ca.sumsqr(moved) + radius**2 * turned**2) / 2

    momentum = ca.gradient(hoop, v)
    rate = ca.jtimes(momentum, v, a) + ca.jtimes(momentum, e, v) + ca.jacobian(momentum, t)
    lagrange = ca.DM(mass) @ a + rate - ca.gradient(hoop, e) + ca.gradient(strain, e)

    # the root is clamped: its place, and the direction of its slope
    free = [2, *range(4, size)]
    x, w, acc = (ca.SX.sym(name, len(free)) for name in ("x", "w", "acc"))
    whole = [ca.vertcat(0, 0, part[0], 0, part[1:]) for part in (x, w, acc)]
    clamped = ca.substitute(lagrange[free], ca.vertcat(e, v, a), ca.vertcat(*whole))

    h, known_x, known_w = ca.SX.sym("h"), *(ca.SX.sym(n, len(free)) for n in ("kx", "kw"))
    after = ca.vertcat(known_x + h**2 / 4 * acc, known_w + h / 2 * acc)
    miss = ca.substitute(clamped, ca.vertcat(x, w), after)
    inputs = [acc, known_x, known_w, t, h]
    newton = ca.Function("newton", inputs, [miss, ca.jacobian(miss, acc)], {"cse": True})

    place, now, tips = np.array(straight)[free], 0.0, []
    speed, force = np.zeros(len(free)), np.zeros(len(free))
    for end in times:
        steps = math.ceil((end - now) / step)
        h_now = (end - now) / steps
        for _ in range(steps):
            known = place + h_now * speed + h_now**2 / 4 * force, speed + h_now / 2 * force
            now += h_now
            for _ in range(5):
                missed, slope = (found.full() for found in newton(force, *known, now, h_now))
                change = np.linalg.solve(slope, missed[:, 0])
                force = force - change
                if np.abs(change).max() <= 1e-8 * max(1.0, np.abs(force).max()):
                    break
            place, speed = known[0] + h_now**2 / 4 * force, known[1] + h_now / 2 * force
        tips.append(place[-4:-2] - np.array(straight)[-4:-2])

    energy = ca.dot(v, ca.DM(mass) @ v) / 2 + hoop + strain
    energy = ca.substitute(energy, ca.vertcat(e, v), ca.vertcat(*whole[:2]))
    left = ca.Function("energy", [x, w, t], [energy])(place, speed, now)
    return np.array(tips).T, float(left)
