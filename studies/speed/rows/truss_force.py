"""The rope force of the ring truss for any algebra: CasADi, NumPy, SymPy.

The dynamic set of the paper (DOI 10.1109/ACCESS.2019.2918614) with pulley friction 0.01. It stands
alone so that every contestant, in whatever environment, states the same problem; a test holds it
against `models.truss`.

    J acc + J' omega^2 / 2 + D omega + U' = T1 f, with functions of the angle alpha [rad]
"""

import math

START, END = math.radians(4.4), math.pi / 2  # alpha [rad]
N, B, C, LINK = 24, 0.45, 0.1, 0.15  # modules; half cross-bar, crank, link [m]
MU, XI1, XI2 = 0.01, 0.1, 0.1  # friction of pulleys [-], joints [N m s/rad], sliders [N s/m]
K1, K2, FREE, NET = 100.0, 200.0, 0.3, math.radians(80)  # [N/m], [m], alpha of the taut net

# J = cosine cos^2 + sine sin^2 + slide e'^2 - mixed sin e', (23) summed over the modules
COSINE, SINE, SLIDE, MIXED = 207.64031227463002, 0.3183336, 0.51552, 0.051552


def rope_force(lib, where, alpha, omega, acc):
    """T1 [N] at angle, speed and acceleration [rad, s].

    `lib` has sin, cos, exp and sqrt; where(condition, this, else_that) is elementwise.
    """
    s, co = lib.sin(alpha), lib.cos(alpha)
    height = lib.sqrt(LINK**2 - (C * s) ** 2)
    g = C * co / height
    e = C * co + height
    slope = -C * s * (1 + g)  # e'
    bend = (C * s) ** 2 * (1 - g**2) / height - C * co * (1 + g)  # e''
    j = COSINE * co**2 + SINE * s**2 + SLIDE * slope**2 - MIXED * s * slope
    j_slope = (
        2 * (SINE - COSINE) * s * co + 2 * SLIDE * slope * bend - MIXED * (co * slope + s * bend)
    )
    d = N * (XI1 * (12 + 4 * g**2 + 4 * (1 + g) ** 2) + 2 * XI2 * slope**2)
    net = 2 * N * K2 * (B / math.sin(math.pi / N)) ** 2 * (s - math.sin(NET)) * co
    u_slope = -2 * N * K1 * (FREE - e) * slope + where(alpha >= NET, net, 0 * net)
    x = 4 * MU * (math.pi - alpha)
    series = (1 - lib.exp(-N * x)) / (1 - lib.exp(-x))
    f = -2 * slope * series * (1 + lib.exp(-MU * (3 * math.pi - 4 * alpha)))
    return (j * acc + j_slope * omega**2 / 2 + d * omega + u_slope) / f
