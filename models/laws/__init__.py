"""Motion laws of the deployment angle, each with exact derivatives up to the jerk.

`motion` says what a law is and finds its peaks. The paper's laws are `step5` and `bezier`;
`jerk_limited` has the least peak acceleration under a jerk cap, by the bounds of `bounds`.
`piecewise`, `tabulated` and `hermite` state laws by polynomials, by points or by rows with rates,
`rests` puts one between two rests, and `straight_line` serves as a guess.
"""

from models.laws.bezier import PAPER_POINTS, Bezier, paper_points
from models.laws.bounds import least_jerk_cap, least_peak_acceleration, least_speed_cap
from models.laws.hermite import Hermite
from models.laws.jerk_limited import JerkLimited
from models.laws.motion import AngularMotion, DerivedLaw, Law, Peaks, peaks
from models.laws.piecewise import Piecewise, constant_acceleration, constant_jerk, linear_jerk
from models.laws.rests import BetweenRests
from models.laws.step5 import Step5
from models.laws.straight_line import StraightLine
from models.laws.tabulated import Tabulated

__all__ = [
    "PAPER_POINTS",
    "AngularMotion",
    "BetweenRests",
    "Bezier",
    "DerivedLaw",
    "Hermite",
    "JerkLimited",
    "Law",
    "Peaks",
    "Piecewise",
    "Step5",
    "StraightLine",
    "Tabulated",
    "constant_acceleration",
    "constant_jerk",
    "least_jerk_cap",
    "least_peak_acceleration",
    "least_speed_cap",
    "linear_jerk",
    "paper_points",
    "peaks",
]
