"""Forces in the bars by two routes of their own: virtual work, and every pin of every module.

Both are written from the mechanism alone. Each face of the ring has one rope: from the pulley at a
middle joint along the half cross-bar to the bar end, down to the slider, back to the bar end, and
on along the next half cross-bar. Springs push the sliders away from the bar ends; the net pulls the
vertical bars to the middle of the ring.
"""

import cmath
import math

import numpy as np
import pytest

from models.truss import DYNAMIC_SET, TrussParameters, bar_forces

STEP = 1e-30  # of complex steps: derivatives without a difference


def energy(truss: TrussParameters, tension: complex, alpha: complex, **lengths: complex) -> complex:
    """Of springs, net and a constant pull on both ropes [J], with other lengths of the members.

    The net's own size is that of the stated truss.
    """
    crank = lengths.get("crank", truss.crank)
    outer = lengths.get("outer", truss.half_cross_bar - truss.crank)
    link = lengths.get("link", truss.link)
    half, n = crank + outer, truss.modules

    # slider on the vertical bar, the link's length from the crank's joint
    slider = crank * cmath.cos(alpha) + cmath.sqrt(link**2 - (crank * cmath.sin(alpha)) ** 2)
    sides = math.sin(math.pi / n)
    radius = half * cmath.sin(alpha) / sides
    slack = truss.half_cross_bar * math.sin(truss.net_angle) / sides
    springs = n * truss.spring_stiffness * (truss.spring_free_length - slider) ** 2
    net = n * truss.net_stiffness * (radius - slack) ** 2
    return springs + net + tension * 4 * n * (slider + half)


def slope(truss: TrussParameters, tension: float, alpha: float, name: str = "") -> float:
    """Derivative of the energy by a member's length [N], by the angle [N m] without a name."""
    if not name:
        return energy(truss, tension, complex(alpha, STEP)).imag / STEP
    stated = {
        "crank": truss.crank,
        "outer": truss.half_cross_bar - truss.crank,
        "link": truss.link,
    }
    return energy(truss, tension, alpha, **{name: complex(stated[name], STEP)}).imag / STEP


def drawn(index: int) -> tuple[TrussParameters, float]:
    """A truss, and an angle at which its net is taut."""
    rng = np.random.default_rng([55, index])
    half = rng.uniform(0.3, 0.8)
    crank = half * rng.uniform(0.15, 0.4)
    truss = TrussParameters(
        bar_length=4.0 * half,
        half_cross_bar=half,
        crank=crank,
        link=crank * rng.uniform(1.2, 2.0),
        modules=int(rng.integers(5, 40)),
        net_angle=math.radians(rng.uniform(70.0, 82.0)),
        spring_stiffness=rng.uniform(50.0, 400.0),
        net_stiffness=rng.uniform(50.0, 400.0),
        spring_free_length=crank * rng.uniform(3.1, 4.0),
    )
    return truss, rng.uniform(truss.net_angle + 0.02, math.pi / 2 - 0.02)


def tension_at_rest(truss: TrussParameters, alpha: float) -> float:
    """Pull on each rope at which the energy is stationary [N]; it is linear in the pull."""
    alone = slope(truss, 0.0, alpha)
    return alone / (alone - slope(truss, 1.0, alpha))


@pytest.mark.parametrize("index", range(50))
def test_forces_are_the_derivatives_of_the_energy_by_the_members_lengths(index: int) -> None:
    truss, alpha = drawn(index)
    tension = tension_at_rest(truss, alpha)
    found = [float(force) for force in bar_forces(truss, alpha, 0.0, 0.0, tension)]
    worked = [
        slope(truss, tension, alpha, name) / (4 * truss.modules)
        for name in ("link", "outer", "crank")
    ]
    assert min(abs(force) for force in worked) > 1e-3  # all of them act
    assert found == pytest.approx(worked, rel=1e-8)


@pytest.mark.parametrize(
    ("degrees", "expected"),
    [(82.0, (10.81, 31.07, 25.13)), (84.34, (14.93, 47.18, 38.43)), (88.0, (7.87, 53.60, 48.56))],
)
def test_every_pin_of_every_module_is_in_equilibrium(
    degrees: float, expected: tuple[float, float, float]
) -> None:
    alpha = math.radians(degrees)
    tension, links, outer, inner = pin_forces(DYNAMIC_SET, alpha)
    for forces, value in zip((links, outer, inner), expected, strict=True):
        assert forces == pytest.approx(np.full(forces.shape, value), abs=5e-3)
    found = [float(force) for force in bar_forces(DYNAMIC_SET, alpha, 0.0, 0.0, tension)]
    assert found == pytest.approx([links.max(), outer.max(), inner.max()], rel=1e-8)


class Balance:
    """Equations of equilibrium, row by row; the last unknown is the pull on the ropes."""

    def __init__(self, unknowns: int) -> None:
        self.unknowns = unknowns
        self.rows: list[np.ndarray] = []

    def known(self, force: np.ndarray) -> np.ndarray:
        """A force (3,) [N] as columns of the unknowns, the last one for what is known."""
        columns = np.zeros((3, self.unknowns + 1))
        columns[:, -1] = force
        return columns

    def unknown(self, place: int, direction: np.ndarray) -> np.ndarray:
        """An unknown force along a direction (3,)."""
        columns = np.zeros((3, self.unknowns + 1))
        columns[:, place] = direction
        return columns

    def pull(self, direction: np.ndarray) -> np.ndarray:
        """The pull of the rope along a direction (3,)."""
        return self.unknown(self.unknowns - 1, direction)

    def body(self, about: np.ndarray, loads: list[tuple[np.ndarray, np.ndarray]]) -> None:
        """Forces and moments of loads (where, a (3, unknowns + 1) force) on a body."""
        total = sum(force for _, force in loads)
        moment = sum(
            np.cross((where - about)[:, None], force, axis=0)  # column by column
            for where, force in loads
        )
        self.rows += [*total, *moment]

    def solve(self) -> np.ndarray:
        """The unknowns, of which the equations leave none free."""
        table = np.array(self.rows)
        found, _, rank, _ = np.linalg.lstsq(table[:, :-1], -table[:, -1], rcond=1e-10)
        assert rank == self.unknowns
        residual = table[:, :-1] @ found + table[:, -1]
        assert np.abs(residual).max() < 1e-9
        return found


def pin_forces(
    truss: TrussParameters, alpha: float
) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
    """Pull on the ropes and compressions of all links, outer and inner parts of cross-bars [N]."""
    n, a, b, c = truss.modules, truss.bar_length, truss.half_cross_bar, truss.crank
    slider = c * math.cos(alpha) + math.sqrt(truss.link**2 - (c * math.sin(alpha)) ** 2)
    radius = b * math.sin(alpha) / math.sin(math.pi / n)
    spring = truss.spring_stiffness * (truss.spring_free_length - slider)
    slack = b * math.sin(truss.net_angle) / math.sin(math.pi / n)
    net = truss.net_stiffness * (radius - slack)  # on each end of a vertical bar

    turn = 2 * math.pi * np.arange(n + 1) / n
    posts = radius * np.array([np.cos(turn), np.sin(turn), np.zeros(n + 1)]).T
    up, count = np.array([0.0, 0.0, 1.0]), 20 * n + 1
    balance = Balance(count)

    on_post = [[] for _ in range(n)]  # loads on each vertical bar
    on_slider = [([], []) for _ in range(n)]  # and on its two sliders
    axes = []  # unknowns of each half cross-bar, and its directions

    for module in range(n):
        along = posts[module + 1] - posts[module]
        along /= np.linalg.norm(along)
        for face, side in enumerate((1.0, -1.0)):
            first = 20 * module + 8 * face
            halves = []
            for end, forwards in enumerate((1.0, -1.0)):
                corner = posts[module + end] + side * up * a / 2
                ray = forwards * along * math.sin(alpha) - side * up * math.cos(alpha)
                halves.append((corner, ray))
            at_middle = balance.pull(-halves[0][1] - halves[1][1])  # of the pulley there
            pin = balance.unknown(first + 6, along) + balance.unknown(first + 7, up)
            if module == face == 0:  # the ring's own stress is free: the halves here are alike
                balance.rows.append((pin - at_middle / 2)[2])

            for end, (corner, ray) in enumerate(halves):
                post = (module + end) % n
                seat = corner - side * up * slider
                joint, middle = corner + c * ray, corner + b * ray
                push = (joint - seat) / truss.link
                place = first + 3 * end
                of_corner = balance.unknown(place, along) + balance.unknown(place + 1, up)
                of_link = balance.unknown(place + 2, push)
                of_middle = pin if end == 0 else at_middle - pin
                balance.body(corner, [(corner, of_corner), (joint, of_link), (middle, of_middle)])
                foot = posts[post] + side * up * a / 2
                on_post[post] += [
                    (foot, -of_corner),
                    (foot, balance.pull(ray)),
                    (foot, balance.pull(-side * up)),
                ]
                on_slider[post][face].extend([-of_link, balance.pull(side * up)])
                axes.append((place, ray, of_corner, of_middle))

    for post in range(n):
        inwards = -posts[post] / radius
        for face, side in enumerate((1.0, -1.0)):
            foot = posts[post] + side * up * a / 2
            seat = foot - side * up * slider
            place = 20 * post + 16 + 2 * face
            contact = balance.unknown(place, np.array([1.0, 0.0, 0.0]))
            contact = contact + balance.unknown(place + 1, np.array([0.0, 1.0, 0.0]))
            on_slider[post][face].extend([contact, balance.known(-side * up * spring)])
            balance.rows += list(sum(on_slider[post][face]))
            on_post[post] += [
                (seat, -contact),
                (foot, balance.known(side * up * spring)),
                (foot, balance.known(inwards * net)),
            ]
        balance.body(posts[post], on_post[post])

    found = balance.solve()
    values = np.append(found, 1.0)
    links = np.array([found[place + 2] for place, *_ in axes])
    inner = np.array([(of_corner @ values) @ ray for _, ray, of_corner, _ in axes])
    outer = np.array([-(of_middle @ values) @ ray for _, ray, _, of_middle in axes])
    return float(found[-1]), links, outer, inner
