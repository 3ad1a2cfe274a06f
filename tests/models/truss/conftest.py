"""A second ring truss, in NumPy alone, that shares no formula with the first.

It places every part of the ring in space, counts each part that exists once (or each module's
parts, "as printed"), follows the rope pulley by pulley, and differentiates positions, lengths
and energies by Cauchy's integral on a circle in the complex plane.
"""

import itertools
from dataclasses import dataclass

import numpy as np
import pytest

CIRCLE = 32  # samples; the nearest singularity lies 0.9 rad off the real axis
RADIUS = 0.05  # [rad], so that the circle about the stowed angle stays clear of 0
GAUSS = ((0.5 - 0.5 / 3**0.5, 0.5), (0.5 + 0.5 / 3**0.5, 0.5))  # exact for velocities squared


def taylor(function, alpha, orders=3):
    """Values of `function` and its derivatives at alpha, stacked along the first axis."""
    turn = np.exp(2j * np.pi * np.arange(CIRCLE) / CIRCLE)
    samples = np.array([function(alpha + RADIUS * z) for z in turn])
    coefficients = np.tensordot(
        np.array([turn**-k / RADIUS**k / CIRCLE for k in range(orders)]), samples, axes=1
    )
    factorials = np.array([1.0, 1.0, 2.0, 6.0][:orders])
    return coefficients.real * factorials.reshape(-1, *[1] * (samples.ndim - 1))


@dataclass(frozen=True)
class TrussTwin:
    p: object

    def ring(self, alpha):
        """Columns of the ring (n, 3) at the top, seen from the first, complex alpha allowed."""
        n = self.p.modules
        radius = self.p.half_cross_bar * np.sin(alpha) / np.sin(np.pi / n)
        # The first side runs along +x and the ring is walked anticlockwise.
        turn = -np.pi / 2 - np.pi / n + 2 * np.pi / n * np.arange(n)
        corners = radius * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
        return corners - corners[0]

    def module(self, alpha, i):
        """Nodes 1..14 of module i = 0..n-1 in space, by interpolation between two columns."""
        p = self.p
        a, b, c, d = p.bar_length, p.half_cross_bar, p.crank, p.link
        top = self.ring(alpha)
        left, right = top[i], top[(i + 1) % p.modules]
        down = np.array([0, 0, -1.0])
        low_left, low_right = left + a * down, right + a * down

        sink = b * np.cos(alpha)
        upper = (left + right) / 2 + sink * down
        lower = (low_left + low_right) / 2 - sink * down

        near = c / b
        crank = {
            7: left + near * (upper - left),
            13: right + near * (upper - right),
            9: low_left + near * (lower - low_left),
            11: low_right + near * (lower - low_right),
        }

        sideways = c * np.sin(alpha)  # of a crank joint from its column
        reach = c * np.cos(alpha) + np.sqrt(d * d - sideways * sideways)
        return crank | {
            1: left,
            2: low_left,
            3: lower,
            4: low_right,
            5: right,
            6: upper,
            8: left + reach * down,
            10: low_left - reach * down,
            14: right + reach * down,
            12: low_right - reach * down,
        }

    def material(self, alpha):
        """Positions and masses of points that move as the whole truss: (m, 3), (m,)."""
        parts = [part for i in range(self.p.modules) for part in self.parts(alpha, i)]
        return np.array([place for place, _ in parts]), np.array([mass for _, mass in parts])

    def parts(self, alpha, i):
        """(position, mass) of what module i adds to the ring: its left column, or both."""
        p, m = self.p, self.p.joint_masses
        u = self.module(alpha, i)
        columns = [(1, 2, 8, 10), (5, 4, 14, 12)][: 1 if p.counting == "once" else 2]
        rods = [(j, k, p.half_cross_bar) for j, k in ((2, 3), (3, 4), (5, 6), (6, 1))]
        rods += [(j, k, p.link) for j, k in ((7, 8), (9, 10), (11, 12), (13, 14))]
        rods += [(head, foot, p.bar_length) for head, foot, _, _ in columns]
        joints = [(j, m.middle) for j in (3, 6)] + [(j, m.crank) for j in (7, 9, 11, 13)]
        for head, foot, upper, lower in columns:
            joints += [(head, m.bar_end), (foot, m.bar_end), (upper, m.slider), (lower, m.slider)]
        return [(u[j], mass) for j, mass in joints] + [
            (u[j] + s * (u[k] - u[j]), weight * p.linear_density * length)
            for j, k, length in rods
            for s, weight in GAUSS
        ]

    def kinetics(self, alpha):
        """J and J', and momentum per unit of omega and its derivative by alpha, (3,) each."""
        masses = self.material(alpha)[1]
        _, v, a = taylor(lambda z: self.material(z)[0], alpha)
        inertia = masses @ np.sum(v * v, axis=1)
        slope = 2 * masses @ np.sum(v * a, axis=1)
        return inertia, slope, masses @ v, masses @ a

    def mass(self):
        return float(self.material(1.0)[1].sum())

    def potential(self, alpha, taut=None):
        """U and U', with the branch of the net chosen by the real angle."""
        p = self.p
        taut = alpha >= p.net_angle if taut is None else taut

        def energy(z):
            u = self.module(z, 0)
            springs = 2 * p.modules  # two on each of the n columns
            total = springs * p.spring_stiffness / 2 * (p.spring_free_length - length(u, 1, 8)) ** 2
            if taut:
                radius = 1 / (2 * np.sin(np.pi / p.modules))
                stretch = radius * (length(u, 1, 5) - 2 * p.half_cross_bar * np.sin(p.net_angle))
                total += 2 * p.modules * p.net_stiffness / 2 * stretch**2
            return total

        value, slope, _ = taylor(energy, alpha)
        return float(value), float(slope)

    def damping(self, alpha):
        """D from the rates of the joint angles listed below (27)."""
        p = self.p

        def joints(z):
            tilt = np.arcsin(p.crank * np.sin(z) / p.link)
            return np.array([z, np.pi - tilt, z + tilt, 2 * z, length(self.module(z, 0), 1, 8)])

        rate = taylor(joints, alpha)[1]
        turning = 4 * rate[0] ** 2 + 4 * rate[1] ** 2 + 4 * rate[2] ** 2 + 2 * rate[3] ** 2
        return p.modules * (p.joint_friction * turning + 2 * p.slider_friction * rate[4] ** 2)

    def rope(self, alpha):
        """Ratios T_k/T1 (4n,), rates dl_k/dalpha (4n,) and the leverage f of both ropes."""
        p = self.p

        def lengths(z):
            nodes = [self.module(z, i) for i in range(p.modules)]
            path = ((10, 2), (2, 3), (3, 4), (4, 12))
            return np.array([length(u, j, k) for u in nodes for j, k in path])

        rates = taylor(lengths, alpha)[1]
        ratios = [1.0]
        enclosed = itertools.cycle([alpha, 2 * alpha, alpha, 0.0])  # phi at nodes 2, 3, 4, 12
        others = {4 * (module - 1) + pulley: mu for module, pulley, mu in p.other_pulleys}
        for k, phi in enumerate(itertools.islice(enclosed, 4 * p.modules - 1), start=1):
            mu = others.get(k, p.pulley_friction)
            ratios.append(ratios[-1] * np.exp(-mu * (np.pi - phi)))
        return np.array(ratios), rates, -2 * float(np.array(ratios) @ rates)

    def pulley_loss(self, alpha, omega, tension):
        """Sum over the pulleys of both ropes of tension drop times passing speed [W]."""
        ratios, rates, _ = self.rope(alpha)
        passing = [-omega * rates[k + 1 :].sum() for k in range(rates.size - 1)]
        return 2 * tension * float(-np.diff(ratios) @ passing)


def length(nodes, j, k):
    """Distance of two nodes, analytic in complex coordinates."""
    return np.sqrt(np.sum((nodes[k] - nodes[j]) ** 2))


@pytest.fixture
def twin():
    """The class of the second truss: `twin(parameters)`."""
    return TrussTwin
