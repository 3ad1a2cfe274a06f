"""Motion laws of the deployment angle, each with exact derivatives up to the jerk.

`motion` says what a law is and finds its peaks. The paper's laws are `step5` and `bezier`;
`jerk_limited` has the least peak acceleration under a jerk cap, by the bounds of `bounds`, and
`least_time` says how fast a stroke may be, from rest or under way.
`piecewise`, `tabulated` and `hermite` state laws by polynomials, by points or by rows with rates,
`rests` puts one between two rests, `under_way` lets one begin at a speed, and `straight_line`
serves as a guess.
"""

from models.laws.bezier import PAPER_POINTS, Bezier, paper_points
from models.laws.bounds import least_jerk_cap, least_peak_acceleration, least_speed_cap
from models.laws.hermite import Hermite
from models.laws.jerk_limited import JerkLimited
from models.laws.least_time import RateCaps, greatest_start_speed, least_cap, least_time
from models.laws.motion import AngularMotion, DerivedLaw, Law, Peaks, peaks
from models.laws.piecewise import Piecewise, constant_acceleration, constant_jerk, linear_jerk
from models.laws.rests import BetweenRests
from models.laws.step5 import Step5
from models.laws.straight_line import StraightLine
from models.laws.tabulated import Tabulated
from models.laws.under_way import UnderWay

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
    "RateCaps",
    "Step5",
    "StraightLine",
    "Tabulated",
    "UnderWay",
    "constant_acceleration",
    "constant_jerk",
    "greatest_start_speed",
    "least_cap",
    "least_jerk_cap",
    "least_peak_acceleration",
    "least_speed_cap",
    "least_time",
    "linear_jerk",
    "paper_points",
    "peaks",
]
