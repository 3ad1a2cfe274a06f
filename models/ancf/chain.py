"""Links and chains of links: what is given, checked on entry.

Symbols: L length [m], EA axial stiffness [N], EI bending stiffness [N m^2],
rho A linear density [kg/m], eta relaxation time of the damping [s].
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, pi
from numbers import Integral, Real

from models.errors import require, require_not_negative, require_positive


@dataclass(frozen=True)
class Link:
    """A uniform slender beam.

    Parameters
    ----------
    length : float
        L [m].
    axial_stiffness : float
        EA [N].
    bending_stiffness : float
        EI [N m^2].
    linear_density : float
        rho A [kg/m].

    Raises
    ------
    ModelError
        If a value is not finite and positive.
    """

    length: float
    axial_stiffness: float
    bending_stiffness: float
    linear_density: float

    def __post_init__(self) -> None:
        require_positive("Link", **vars(self))

    @classmethod
    def from_section(
        cls, length: float, *, area: float, second_moment: float, modulus: float, density: float
    ) -> Link:
        """Link from A [m^2], I [m^4], E [Pa] and rho [kg/m^3]."""
        require_positive(
            "Link", area=area, second_moment=second_moment, modulus=modulus, density=density
        )
        return cls(length, modulus * area, modulus * second_moment, density * area)


@dataclass(frozen=True)
class Chain:
    """Links hinged end to end, meshed with ANCF elements; joint 0 is the root at the origin.

    Parameters
    ----------
    links : tuple of Link
        From the root outward; joint `k` is at the start of link `k`.
    elements : int
        Elements a link.
    masses : tuple of float
        Particles [kg] at the root, at each later joint and at the tip, `len(links) + 1` of
        them; empty means none.
    hub_inertia : float
        Moment of inertia that turns with the start of link 0 [kg m^2]. It is carried by the
        slope vector of that node, so the mass matrix stays constant; the difference to a
        rigid hub is of the order of the axial strain there.
    gravity : tuple of float
        Acceleration of gravity (x, y) [m/s^2].
    damping_ratio : float
        Ratio to critical of the internal (Kelvin-Voigt) damping at `damping_frequency`;
        proportional to frequency elsewhere.
    damping_frequency : float
        Frequency at which the ratio is stated [Hz].
    pinned : bool
        False lets the root fly.

    Raises
    ------
    ModelError
        If there is no link, elements that are no whole number from one on, a gravity that is no
        tuple of two finite numbers, a negative mass, inertia or damping ratio, or a number of
        masses that does not fit.
    """

    links: tuple[Link, ...]
    elements: int = 8
    masses: tuple[float, ...] = ()
    hub_inertia: float = 0.0
    gravity: tuple[float, float] = (0.0, 0.0)
    damping_ratio: float = 0.0
    damping_frequency: float = 1.0
    pinned: bool = True

    def __post_init__(self) -> None:
        require(bool(self.links), "Chain: links is empty; give at least one Link.")
        require(
            _is_number(self.elements, Integral) and self.elements >= 1,
            f"Chain: elements is {self.elements!r}; give a whole number of 1 or more.",
        )
        require(
            _is_acceleration(self.gravity),
            f"Chain: gravity is {self.gravity!r}; give a tuple of two finite accelerations (x, y) "
            "in m/s^2.",
        )

        # no masses at all stand for massless joints
        ends = len(self.links) + 1
        require(
            len(self.masses) in (0, ends),
            f"Chain: {len(self.masses)} masses for {len(self.links)} links; give one for the "
            f"root, one for each later joint and one for the tip, {ends} in all.",
        )
        require_not_negative("Chain", **{f"mass_{k}": m for k, m in enumerate(self.masses)})
        require_not_negative(
            "Chain", hub_inertia=self.hub_inertia, damping_ratio=self.damping_ratio
        )
        require_positive("Chain", damping_frequency=self.damping_frequency)

    @property
    def relaxation_time(self) -> float:
        """Eta [s] of the internal damping: a mode of frequency f has the ratio pi f eta."""
        return self.damping_ratio / (pi * self.damping_frequency)

    @property
    def nodes(self) -> int:
        """Nodes a link."""
        return self.elements + 1

    @property
    def size(self) -> int:
        """Number of node coordinates of all links, each with nodes of its own."""
        return 4 * self.nodes * len(self.links)

    def slots(self, link: int, node: int) -> tuple[int, int, int, int]:
        """Places of `r_x, r_y, r'_x, r'_y` of a node (negative counts from the end) in `q`."""
        start = 4 * (self.nodes * link + node % self.nodes)
        return start, start + 1, start + 2, start + 3


def _is_acceleration(value: object) -> bool:
    """Whether a value is a tuple of two finite numbers; a chain must be hashable to be cached."""
    if not isinstance(value, tuple) or len(value) != 2:
        return False
    return all(_is_number(x, Real) and isfinite(x) for x in value)


def _is_number(value: object, kind: type) -> bool:
    """Whether a value is a number of a kind; Python counts True and False as whole numbers."""
    return not isinstance(value, bool) and isinstance(value, kind)
