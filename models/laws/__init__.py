"""Motion laws of the deployment angle, each with exact derivatives up to the jerk."""

from models.laws.bezier import PAPER_POINTS, Bezier, pinned
from models.laws.bounds import least_jerk_cap, least_peak_acceleration
from models.laws.motion import Law, Motion, Peaks, peaks
from models.laws.piecewise_jerk import JerkLimited, PiecewiseJerk
from models.laws.simple import Dwell, StraightLine
from models.laws.step5 import Step5
from models.laws.tabulated import Tabulated

__all__ = [
    "PAPER_POINTS",
    "Bezier",
    "Dwell",
    "JerkLimited",
    "Law",
    "Motion",
    "Peaks",
    "PiecewiseJerk",
    "Step5",
    "StraightLine",
    "Tabulated",
    "least_jerk_cap",
    "least_peak_acceleration",
    "peaks",
    "pinned",
]
