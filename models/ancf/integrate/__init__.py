"""Integration of the equations of motion over time.

`simulate` is the entry: a chain, its joints and a state in, the motion with energies, torques and
cost out. Below it, `integrator` takes the steps and `radau` holds the tables of the method.
"""

from models.ancf.integrate.integrator import StepControl
from models.ancf.integrate.simulate import Simulation, simulate

__all__ = ["Simulation", "StepControl", "simulate"]
