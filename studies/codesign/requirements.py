"""What every design has to meet whatever its motion, and whether any design does."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, Literal

import casadi as ca
import numpy as np

from models.truss import (
    TrussParameters,
    far_end_ratio,
    largest_bar_force,
    rope_length,
    slider_distance,
    static_force,
    static_peak,
    with_symbols,
)
from ocp import Bound
from ocp.arrays import Array
from studies.codesign.config import CodesignStudy
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.rounding import down, up
from studies.truss.config import DEPLOYED
from studies.truss.limits.ridge import ridge_force

# The link has to be longer than the crank, or the truss jams before it is open. At this ratio the
# open link still stands 8 degrees off the cross-bar.
LEAST_RATIO = 1.01
MOST_HELP = 0.1  # part of the static ridge that momentum may take off; beyond it nothing is known
CREEP_SLACK = 1e-4  # relative, of caps; what is lost between the angles is a fifth of it
CREEP_ANGLES = 161
KEPT = 1e-7  # relative: a requirement that a design misses by less is met


@dataclass(frozen=True, eq=False)
class Requirement:
    """A number of the design with a limit.

    Attributes
    ----------
    title, unit : of the number.
    key : of the limit.
    limit : least or largest value [unit].
    side : which of the two.
    expression : the number, of a truss or of a stand-in.
    at_rest : whether a limit on the motion implies it, since the motion begins and ends at rest.
    """

    title: str
    unit: str
    key: str
    limit: float
    side: Literal["least", "most"]
    expression: Callable[[TrussParameters], Any]
    at_rest: bool = False

    @property
    def is_least(self) -> bool:
        """Whether the number may not be less than the limit."""
        return self.side == "least"

    def bound(self, truss: TrussParameters) -> Bound:
        """The same for the problem of a truss with unknowns."""
        lower, upper = (self.limit, math.inf) if self.is_least else (-math.inf, self.limit)
        return Bound(self.title, self.expression(truss), self.unit, lower=lower, upper=upper)

    def slack(self, truss: TrussParameters) -> Any:
        """How far a design is within the limit, relative to its size; negative beyond it."""
        room = self.expression(truss) - self.limit
        return (room if self.is_least else -room) / max(abs(self.limit), 1e-3)

    @property
    def words(self) -> str:
        """The requirement, as a sentence names it."""
        return f"{self.title} of at {self.side} {self.limit:.6g} {self.unit}"


def requirements(study: CodesignStudy) -> tuple[Requirement, ...]:
    """All requirements; the given truss sets those that the design does not have."""
    return (*_of_the_design(study), *_at_rest(study), *_while_it_creeps(study))


def _of_the_design(study: CodesignStudy) -> Iterator[Requirement]:
    truss, design = study.deployment.truss, study.design

    def stated(limit: float | None, number: Callable[[TrussParameters], Any]) -> float:
        return float(number(truss)) if limit is None else limit

    yield Requirement(
        "link per crank", "1", "truss.link", LEAST_RATIO, "least", lambda t: t.link / t.crank
    )
    holding = stated(design.holding_force, _holding_force)
    yield Requirement(
        "holding force", "N", "design.holding_force", holding, "least", _holding_force
    )
    stroke = stated(design.stroke, _stroke)
    yield Requirement("stroke of the rope", "m", "design.stroke", stroke, "most", _stroke)

    # the bars and the folded cross-bars are no part of what is free
    height = design.stowed_height or truss.bar_length
    yield Requirement(
        "stowed height", "m", "design.stowed_height", height, "most", _room_of_the_sliders
    )


def _at_rest(study: CodesignStudy) -> Iterator[Requirement]:
    """Limits on forces, applied to the truss at rest at both ends of every motion."""
    stowed = study.deployment.truss.stowed_angle

    def least_pull(t: TrussParameters) -> Any:
        return static_force(t, stowed, "slack") * far_end_ratio(t, stowed)

    def open_bars(t: TrussParameters) -> Any:
        return largest_bar_force(t, DEPLOYED, 0.0, 0.0, _holding_force(t), "taut")

    yield from _under_caps(
        study,
        ("tension of the stowed rope", "least_tension", "least", least_pull),
        ("rope force of the open truss", "force", "most", _holding_force),
        ("largest force in a bar of the open truss", "bar_force", "most", open_bars),
    )


def _under_caps(
    study: CodesignStudy, *rows: tuple[str, str, Literal["least", "most"], Callable[..., Any]]
) -> Iterator[Requirement]:
    """What limits on the motion imply: the number's title, the key of its cap, its side, itself."""
    for title, key, side, number in rows:
        cap = getattr(study.deployment.caps, key)
        if cap is not None:
            yield Requirement(title, "N", f"caps.{key}", cap, side, number, at_rest=True)


def _while_it_creeps(study: CodesignStudy) -> Iterator[Requirement]:
    """What caps on forces ask of a truss that is hardly moved, where no motion does much better.

    The bound of the ridge of the given design shows how much momentum can reduce the force. For
    other designs in the range twice that part is allowed.
    """
    caps, truss = study.deployment.caps, study.deployment.truss
    ridge, static = ridge_force(truss, caps), static_peak(truss).force
    helped = 1.0 if ridge is None else max(1.0 - ridge.force / static, 0.0)
    if helped > MOST_HELP:
        return
    left = (1.0 - 2.0 * helped) / (1.0 + CREEP_SLACK)

    def rope(t: TrussParameters) -> Any:
        return left * ca.mmax(static_force(t, _taut(t), "taut"))

    def bars(t: TrussParameters) -> Any:
        return left * _bars_at_rest(t)

    yield from _under_caps(
        study,
        ("rope force in slow motion", "force", "most", rope),
        ("largest force in a bar in slow motion", "bar_force", "most", bars),
    )


def _bars_at_rest(truss: TrussParameters) -> Any:
    """Largest force in a bar while the truss creeps under its taut net [N]."""
    angles = _taut(truss)
    held = static_force(truss, angles, "taut")
    return largest_bar_force(truss, angles, 0.0, 0.0, held, "taut")


def _taut(truss: TrussParameters) -> ca.DM:
    """Angles at which the net is taut [rad], in a row; no design changes them."""
    return ca.DM(np.linspace(truss.net_angle, DEPLOYED, CREEP_ANGLES)).T


def _holding_force(truss: TrussParameters) -> Any:
    return static_force(truss, DEPLOYED, "taut")


def _stroke(truss: TrussParameters) -> Any:
    return rope_length(truss, truss.stowed_angle) - rope_length(truss, DEPLOYED)


def _room_of_the_sliders(truss: TrussParameters) -> Any:
    """What the stowed sliders need of the vertical bar [m], from both ends."""
    return 2 * slider_distance(truss, truss.stowed_angle)


def check_some_design(study: CodesignStudy, held: Sequence[Requirement]) -> None:
    """Refuse requirements for which no design in the range is found that meets them together.

    Each in turn is brought as far within its limit as those before it allow, from every corner of
    the range and from the given design. The search is local, so that its failure proves nothing.

    Raises
    ------
    StudyError
        Naming the first that cannot be met together with those before it, and the nearest value.
    """
    for count, requirement in enumerate(held):
        reached, design = _furthest(study, held[:count], requirement)
        if reached >= -KEPT:
            continue
        value = float(requirement.expression(with_symbols(study.deployment.truss, **design)))
        kept = [one.words for one in held[1:count] if abs(_slack_at(study, one, design)) <= 1e-4]
        beside = f" together with {' and '.join(kept)}" if kept else ""
        extreme, typed = ("most", down) if requirement.is_least else ("least", up)
        raise StudyError(
            f"no design within {100 * study.design.range:g} % was found with a "
            f"{requirement.words}{beside}: the {extreme} found is {typed(value)} "
            f"{requirement.unit}; change {requirement.key} to this value, or widen design.range",
            ExitCode.NOT_SOLVED,
        )


def _slack_at(study: CodesignStudy, one: Requirement, design: Mapping[str, float]) -> float:
    return float(one.slack(with_symbols(study.deployment.truss, **design)))


def _furthest(
    study: CodesignStudy, kept: Sequence[Requirement], wanted: Requirement
) -> tuple[float, dict[str, float]]:
    """Largest slack of a requirement under others, and the design that has it."""
    limits = study.design.limits(study.deployment.truss)
    symbols = {name: ca.SX.sym(name) for name in limits}
    truss = with_symbols(study.deployment.truss, **symbols)
    x = ca.vertcat(*symbols.values())
    sizes = np.array([high for _, high in limits.values()])
    scaled = ca.SX.sym("x", len(limits))

    def of(expression: Any) -> Any:
        return ca.substitute(ca.SX(expression), x, scaled * sizes)

    rows = ca.vertcat(*(of(one.slack(truss)) for one in kept))
    program = {"x": scaled, "f": -of(wanted.slack(truss)), "g": rows}
    # where the link is shorter than the crank nothing is defined: IPOPT then takes a shorter step
    quiet = {"print_time": False, "error_on_fail": False, "show_eval_warnings": False}
    ipopt = {"print_level": 0, "sb": "yes", "max_iter": 200, "tol": 1e-10}
    solver = ca.nlpsol("furthest", "ipopt", program, {**quiet, "ipopt": ipopt})

    low, high = np.array(list(limits.values())).T / sizes
    best: tuple[float, dict[str, float]] | None = None
    for start in (*product(*zip(low, high, strict=True)), (low + high) / 2):
        if not _jams(study, _named(limits, start * sizes)):
            found = solver(x0=start, lbx=low, ubx=high, lbg=0.0, ubg=math.inf)
            point = np.clip(found["x"].full().ravel(), low, high)
            design = _named(limits, point * sizes)
            slacks = [_slack_at(study, one, design) for one in (*kept, wanted)]
            met = not _jams(study, design) and all(slack >= -KEPT for slack in slacks[:-1])
            if met and (best is None or slacks[-1] > best[0]):
                best = slacks[-1], design
        if best is not None and best[0] >= 0.0:
            break
    return best or (-math.inf, _named(limits, high * sizes))


def _named(names: Iterable[str], values: Array) -> dict[str, float]:
    return dict(zip(names, values.tolist(), strict=True))


def _jams(study: CodesignStudy, design: Mapping[str, float]) -> bool:
    """Whether the link is so short that nothing else of the truss is defined."""
    truss = with_symbols(study.deployment.truss, **design)
    return bool(truss.link <= truss.crank)
