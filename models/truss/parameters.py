"""Parameters of the ring truss and the two sets of the paper.

Source: Lu, Qi, Hu, Li, Zhang, "Deployment Dynamics of Large Space Antenna and Supporting
Arms", IEEE Access 2019, DOI 10.1109/ACCESS.2019.2918614; "(n)" is its equation n.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
import numbers
import types
import warnings
from dataclasses import dataclass, field
from reprlib import repr as shortened
from typing import Any, Literal, cast

from models.errors import require

TUBE_OUTER_DIAMETER = 0.020  # [m], assumed: the paper prints no section
TUBE_INNER_DIAMETER = 0.018  # [m], assumed
TUBE_DENSITY = 1800.0  # [kg/m^3], printed, though there called a linear density
TUBE_ELASTIC_MODULUS = 70e9  # [Pa], assumed: of aluminium, or of a common carbon laminate
TUBE_LINEAR_DENSITY = round(
    TUBE_DENSITY * math.pi / 4 * (TUBE_OUTER_DIAMETER**2 - TUBE_INNER_DIAMETER**2), 4
)  # [kg/m], 0.1074: to the four digits that the assumption deserves


@dataclass(frozen=True)
class JointMasses:
    """Point masses of the joints [kg], one value for each of the four types of node.

    Attributes
    ----------
    bar_end : nodes 1, 2, 4, 5, the ends of the vertical bars [kg].
    middle : nodes 3, 6, where the two halves of a cross-bar meet [kg].
    crank : nodes 7, 9, 11, 13, where the links meet the cross-bars [kg].
    slider : nodes 8, 10, 12, 14, on the vertical bars [kg].

    Raises
    ------
    ModelError
        If a mass is negative or not finite.
    """

    bar_end: float = 0.0
    middle: float = 0.0
    crank: float = 0.0
    slider: float = 0.0

    def __post_init__(self) -> None:
        for item in dataclasses.fields(self):
            _require_number(f"joint mass {item.name}", getattr(self, item.name), zero=True)


@dataclass(frozen=True, kw_only=True)
class TrussParameters:
    """Ring truss of n identical modules; the defaults are the paper's dynamic set.

    The assumed values are `linear_density`, `elastic_modulus` and `joint_masses`: the paper gives
    none of them.

    Attributes
    ----------
    bar_length : a [m], vertical bar.
    half_cross_bar : b [m], half of a cross-bar.
    crank : c [m], from the end of the vertical bar along the cross-bar to the link.
    link : d [m], from the crank joint to the slider.
    modules : n [-], number of modules.
    stowed_angle : alpha0 [rad], between vertical bar and cross-bar before deployment.
    net_angle : alpha_c [rad], from which the cable net is taut.
    spring_stiffness : k1 [N/m], springs between slider and end of the bar.
    net_stiffness : k2 [N/m], equivalent springs of the cable net.
    spring_free_length : l0 [m], of these springs at rest.
    joint_friction : xi1 [N m s/rad], viscous friction of the rotating joints.
    slider_friction : xi2 [N s/m], viscous friction of the sliders.
    pulley_friction : mu [-], between rope and pulley.
    other_pulleys : [-], rows (module, pulley, mu) of pulleys that differ, on both ropes; a module
        has pulley 1 to 4 behind its segments: bar end, middle joint, bar end, slider.
    joint_coulomb : [N m], Coulomb torque of each rotating joint, at full value at rest.
    slider_coulomb : [N], Coulomb friction of each slider, at full value at rest.
    measured_torque : [rad, N m], rows (angle, torque) of a measured load against the opening, by
        rising angles; between them it is a monotone cubic.
    gravity : [m/s^2], in the ring's frame: from the fixed bar towards the ring's centre, across
        that in the plane of the ring, and along its axis. Only the first does work.
    off_load : [-], share of the weight that a test bench carries.
    off_load_friction : [N], with which the bench holds each vertical bar back on its path.
    linear_density : rho [kg/m], of all rods.
    elastic_modulus : E [Pa], of all rods, which are tubes of 20 and 18 mm; for buckling only.
    joint_masses : point masses at the nodes [kg].
    counting : "once" counts what neighbours share (vertical bars, their ends and sliders)
        once; "as printed" counts it in both modules, as (22)-(23) do.

    Raises
    ------
    ModelError
        If the geometry cannot work or a value is not finite or has the wrong sign.

    Warns
    -----
    UserWarning
        If the spring pulls while stowed: l0 < e(alpha0).
    """

    bar_length: float = 1.0
    half_cross_bar: float = 0.45
    crank: float = 0.1
    link: float = 0.15
    modules: int = 24
    stowed_angle: float = math.radians(4.4)
    net_angle: float = math.radians(80.0)
    spring_stiffness: float = 100.0
    net_stiffness: float = 200.0
    spring_free_length: float = 0.3
    joint_friction: float = 0.1
    slider_friction: float = 0.1
    pulley_friction: float = 0.0
    other_pulleys: tuple[tuple[int, int, float], ...] = ()
    joint_coulomb: float = 0.0
    slider_coulomb: float = 0.0
    measured_torque: tuple[tuple[float, float], ...] = ()
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    off_load: float = 0.0
    off_load_friction: float = 0.0
    linear_density: float = TUBE_LINEAR_DENSITY
    elastic_modulus: float = TUBE_ELASTIC_MODULUS
    joint_masses: JointMasses = field(default_factory=JointMasses)
    counting: Literal["once", "as printed"] = "once"

    def __post_init__(self) -> None:
        _check_values(self)
        _check_geometry(self)


_POSITIVE = (
    "bar_length",
    "half_cross_bar",
    "crank",
    "link",
    "stowed_angle",
    "net_angle",
    "spring_free_length",
    "linear_density",
    "elastic_modulus",
)
_NOT_NEGATIVE = (
    "spring_stiffness",
    "net_stiffness",
    "joint_friction",
    "slider_friction",
    "pulley_friction",
    "joint_coulomb",
    "slider_coulomb",
    "off_load",
    "off_load_friction",
)


def _is_finite(value: object) -> bool:
    return isinstance(value, int | float) and math.isfinite(value)


def _require_number(name: str, value: object, *, zero: bool = False) -> None:
    number = isinstance(value, numbers.Real) and not isinstance(value, bool)
    try:
        size = float(cast(float, value)) if number else math.nan
    except OverflowError:  # a whole number of more than 308 digits
        size = math.inf
    sign = "non-negative" if zero else "positive"
    require(
        math.isfinite(size) and (size > 0 or (zero and size == 0)),
        f"{name} is {shortened(value)}; give a finite {sign} number.",
    )


def _check_values(p: TrussParameters) -> None:
    for name in _POSITIVE:
        _require_number(name, getattr(p, name))
    for name in _NOT_NEGATIVE:
        _require_number(name, getattr(p, name), zero=True)

    require(
        p.off_load <= 1,
        f"off_load is {p.off_load:g}; give the share of the weight that is carried, from 0 to 1.",
    )
    gravity: object = p.gravity
    require(
        isinstance(gravity, tuple) and len(gravity) == 3 and all(map(_is_finite, gravity)),
        f"gravity is {shortened(gravity)}; give three finite numbers in m/s^2: towards the ring's "
        "centre, across that, and along its axis.",
    )

    modules: object = p.modules
    require(
        isinstance(modules, int) and modules >= 3,
        f"modules is {shortened(modules)}; a closed ring needs a whole number of at least 3.",
    )
    _check_curve(p.measured_torque)
    _check_pulleys(p.other_pulleys, p.modules)
    require(
        p.counting in ("once", "as printed"),
        f'counting is {shortened(p.counting)}; choose "once" or "as printed".',
    )
    require(
        isinstance(p.joint_masses, JointMasses),
        f"joint_masses is {shortened(p.joint_masses)}; give a JointMasses.",
    )


def _check_curve(rows: object) -> None:
    table: list[Any] = list(rows) if isinstance(rows, tuple) else [rows]
    pairs = all(
        isinstance(one, tuple) and len(one) == 2 and all(map(_is_finite, one)) for one in table
    )
    rising = pairs and all(before[0] < after[0] for before, after in itertools.pairwise(table))
    require(
        not table or (rising and len(table) > 1),
        f"measured_torque is {shortened(rows)}; give two or more rows of angle in rad and torque "
        "in N m, by rising angles.",
    )


def _check_pulleys(rows: object, modules: int) -> None:
    require(
        isinstance(rows, tuple) and all(isinstance(one, tuple) and len(one) == 3 for one in rows),
        f"other_pulleys is {shortened(rows)}; give rows of module, pulley and mu.",
    )
    known: set[tuple[int, int]] = set()
    for module, pulley, mu in rows if isinstance(rows, tuple) else ():
        require(
            isinstance(module, int) and 1 <= module <= modules,
            f"other_pulleys names module {shortened(module)}, but the ring has the modules 1 to "
            f"{modules}; name one of them.",
        )
        most = 3 if module == modules else 4  # behind the last segment the rope is fixed
        require(
            isinstance(pulley, int) and 1 <= pulley <= most,
            f"other_pulleys names pulley {shortened(pulley)} of module {module}, which has the "
            f"pulleys 1 to {most}; name one of them.",
        )
        require(
            (module, pulley) not in known,
            f"other_pulleys names pulley {pulley} of module {module} twice; leave one row out.",
        )
        known.add((module, pulley))
        _require_number(f"other_pulleys: mu of pulley {pulley} of module {module}", mu, zero=True)


def _angle(value: float) -> str:
    """An angle in both units: parameters are in radians, studies may state degrees."""
    return f"{math.degrees(value):g} deg ({value:g} rad)"


def _check_geometry(p: TrussParameters) -> None:
    a, b, c, d = p.bar_length, p.half_cross_bar, p.crank, p.link
    alpha0, alpha_c = p.stowed_angle, p.net_angle
    require(d > c, f"link {d:g} m is not longer than the crank {c:g} m; lengthen the link.")
    require(c <= b, f"crank {c:g} m exceeds the half cross-bar {b:g} m; shorten the crank.")

    require(
        alpha0 < alpha_c < math.pi / 2,
        f"net_angle {_angle(alpha_c)} is not between stowed_angle {_angle(alpha0)} and 90 deg; "
        "choose 0 < stowed_angle < net_angle < 90 deg.",
    )

    # room for what is folded between the vertical bar's ends
    height = 2 * b * math.cos(alpha0)
    require(
        height <= a,
        f"stowed cross-bars need {height:g} m but bar_length is {a:g} m; lengthen the bar.",
    )
    e0 = c * math.cos(alpha0) + math.sqrt(d**2 - (c * math.sin(alpha0)) ** 2)  # (16)
    require(
        2 * e0 <= a,
        f"stowed sliders need {2 * e0:g} m but bar_length is {a:g} m; shorten crank or link.",
    )

    # The geometry works, but at first the rope would have to push.
    if p.spring_free_length < e0:
        warnings.warn(
            f"spring_free_length {p.spring_free_length:g} m is below the stowed slider distance "
            f"{e0:g} m, so the spring pulls at first; lengthen it to keep the rope taut.",
            stacklevel=4,
        )


def with_symbols(parameters: TrussParameters, **symbols: Any) -> TrussParameters:
    """Stand-in for parameters (or another stand-in), some attributes replaced by CasADi symbols.

    Nothing is checked: this serves derivatives and optimisation with respect to parameters.
    `modules` and `counting` stay plain.

    Raises
    ------
    ModelError
        If a name is not one of the attributes that may be symbols.
    """
    values = {f.name: getattr(parameters, f.name) for f in dataclasses.fields(TrussParameters)}
    unknown = symbols.keys() - (values.keys() - {"modules", "counting"})
    require(not unknown, f"{sorted(unknown)} cannot be symbols; name attributes of the truss.")
    return cast(TrussParameters, types.SimpleNamespace(**(values | symbols)))


DYNAMIC_SET = TrussParameters()  # Figs 17-20 of the paper, mu = 0
# Figs 11-13: only the half cross-bar differs; what the paper leaves open there is as above.
KINEMATIC_SET = dataclasses.replace(DYNAMIC_SET, half_cross_bar=0.5)
