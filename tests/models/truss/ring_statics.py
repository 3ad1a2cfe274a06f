"""Equilibrium of every bar, slider, joint and vertical bar of the whole ring, as one linear system.

It shares no formula with the models: it knows where the parts are and which of them are pinned to
each other. The ring rests, and the ropes run over frictionless pulleys.

Forces are in the plane of their module: x along its side, z upward. Unknown for each half of a
cross-bar: the force of its bar end on it (x, z), the push of its link, the force of its middle
joint on it (x, z).
"""

import itertools
import math

import numpy as np

UNKNOWN = 5  # of each half of a cross-bar
HALVES = tuple(itertools.product((0, 1), (0, 1)))  # left or right, upper or lower


def of_all_joints(truss, alpha, tension):
    """Compression (link, outer, inner) of each half cross-bar of the ring [N]."""
    ring = Ring(truss, alpha, tension)
    for module in range(truss.modules):
        for half in HALVES:
            ring.half_bar(module, half)
        for lower in (0, 1):
            ring.middle_joint(module, lower)
        for lower in (0, 1):
            ring.slider(module, lower)
        ring.vertical_bar(module)
    return ring.compressions()


class Ring:
    """Equations of equilibrium, collected part by part."""

    def __init__(self, truss, alpha, tension):
        self.truss, self.tension = truss, tension
        self.sine, self.cosine = math.sin(alpha), math.cos(alpha)
        c, d = truss.crank, truss.link
        self.to_slider = c * self.cosine + math.sqrt(d**2 - c**2 * self.sine**2)
        self.spring = truss.spring_stiffness * (truss.spring_free_length - self.to_slider)
        self.rows, self.known = [], []

    def columns(self, module, half):
        first = UNKNOWN * (len(HALVES) * (module % self.truss.modules) + HALVES.index(half))
        return range(first, first + UNKNOWN)

    def add(self, terms, known):
        """One equation: the sum of coefficient times unknown, and what is known, vanish."""
        row = np.zeros(UNKNOWN * len(HALVES) * self.truss.modules)
        for where, coefficient in terms:
            row[where] += coefficient
        self.rows.append(row)
        self.known.append(-known)

    def geometry(self, half):
        """Direction of the half from its bar end, its slider, and the direction of its link."""
        side, lower = half
        along = np.array([self.sine * (1 - 2 * side), -self.cosine * (1 - 2 * lower)])
        slider = np.array([0.0, -self.to_slider * (1 - 2 * lower)])
        return along, slider, (self.truss.crank * along - slider) / self.truss.link

    def half_bar(self, module, half):
        """Two forces, and the moment about the bar end."""
        along, _, push = self.geometry(half)
        at, c, b = self.columns(module, half), self.truss.crank, self.truss.half_cross_bar
        for k in (0, 1):
            self.add([(at[k], 1), (at[2], push[k]), (at[3 + k], 1)], 0.0)
        of_link = c * (along[0] * push[1] - along[1] * push[0])
        self.add([(at[2], of_link), (at[3], -b * along[1]), (at[4], b * along[0])], 0.0)

    def middle_joint(self, module, lower):
        """The halves push back, and the rope pulls its pulley along both of them."""
        pair = [(0, lower), (1, lower)]
        rope = -self.tension * sum(self.geometry(half)[0] for half in pair)
        for k in (0, 1):
            self.add([(self.columns(module, half)[3 + k], -1.0) for half in pair], rope[k])

    def meeting(self, vertex):
        """Modules that meet at a vertical bar, by their sides, with their horizontal directions."""
        for module, side in ((vertex - 1, 1), (vertex, 0)):
            turn = 2 * math.pi * module / self.truss.modules
            yield module, side, (math.cos(turn), math.sin(turn))

    def slider(self, vertex, lower):
        """The rope pulls it to the bar end on both sides; spring and links push it away."""
        links = [
            (self.columns(module, (side, lower))[2], -self.geometry((side, lower))[2][1])
            for module, side, _ in self.meeting(vertex)
        ]
        self.add(links, (1 - 2 * lower) * (2 * self.tension - self.spring))

    def vertical_bar(self, vertex):
        """Three forces, and the moments that tilt it."""
        force, torque = [[], [], []], [[], []]
        load, moment = np.zeros(3), np.zeros(2)
        for lower in (0, 1):
            height = -self.truss.bar_length * lower
            load[2] += (1 - 2 * lower) * (self.spring - 2 * self.tension)
            for module, side, direction in self.meeting(vertex):
                along, slider, push = self.geometry((side, lower))
                at = self.columns(module, (side, lower))
                # the bar end pushes back, the link presses its slider against the vertical bar
                for k, part in enumerate(direction):
                    force[k] += [(at[0], -part), (at[2], -push[0] * part)]
                    torque[k] += [(at[0], -part * height)]
                    torque[k] += [(at[2], -push[0] * part * (height + slider[1]))]
                rope = self.tension * along
                force[2] += [(at[1], -1.0)]
                load += [*(rope[0] * np.array(direction)), rope[1]]
                moment += rope[0] * np.array(direction) * height
            load[:2] += self.net_pull(vertex)
            moment += self.net_pull(vertex) * height
        for terms, known in zip((*force, *torque), (*load, *moment), strict=True):
            self.add(terms, known)

    def net_pull(self, vertex):
        """Of the net on one bar end, towards the axis of the ring."""
        truss = self.truss
        growth = truss.half_cross_bar * (self.sine - math.sin(truss.net_angle))
        pull = truss.net_stiffness * growth / math.sin(math.pi / truss.modules)
        (_, _, before), (_, _, after) = self.meeting(vertex)
        inward = np.subtract(after, before)
        return pull * inward / np.hypot(*inward)

    def compressions(self):
        matrix, known = np.array(self.rows), np.array(self.known)
        found = np.linalg.lstsq(matrix, known, rcond=None)[0]
        assert np.abs(matrix @ found - known).max() < 1e-9 * np.abs(known).max()
        for module, half in itertools.product(range(self.truss.modules), HALVES):
            along, forces = self.geometry(half)[0], found[list(self.columns(module, half))]
            yield [forces[2], -float(forces[3:] @ along), float(forces[:2] @ along)]
