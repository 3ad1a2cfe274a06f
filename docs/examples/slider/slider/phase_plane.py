"""The least peak force from the phase plane, without any optimiser.

Under a peak force P, the square of the speed at a position is at most what P gives from the start,
and at most what spring and friction brake until the end. The fastest motion follows the lesser one:
full force up to a position, and then none. No motion in the same time needs less. Both squares are
in closed form, so the time is one integral.
"""

import numpy as np
from scipy.optimize import brentq

from .mechanics import GRAVITY, Slider

NODES, WEIGHTS = np.polynomial.legendre.leggauss(80)


def shortest_time(slider: Slider, travel: float) -> float:
    """In which spring and friction stop the slider [s]: no force of the rope makes it shorter.

    One of them has to be there.
    """
    braking = slider.friction * GRAVITY
    if slider.stiffness == 0:
        return float(np.sqrt(2 * travel / braking))

    frequency = np.sqrt(slider.stiffness / slider.mass)
    rest = braking / frequency**2
    return float(np.arccos(rest / (travel + rest)) / frequency)


def least_peak_for_ever(slider: Slider, travel: float) -> float:
    """The energy needs this force all along, however long the motion takes [N]."""
    return slider.work_of_resistance(travel) / slider.work_of_rope(travel)


def least_peak(slider: Slider, travel: float, duration: float) -> float:
    """Of the force of the rope, in a given duration [N]; that has to exceed `shortest_time`."""
    least = least_peak_for_ever(slider, travel)
    if _pace(slider, travel, least) >= 1 / duration:
        return least

    most = 2 * least
    while _pace(slider, travel, most) < 1 / duration:
        most *= 2
    return float(brentq(lambda peak: _pace(slider, travel, peak) - 1 / duration, least, most))


def _pace(slider: Slider, travel: float, peak: float) -> float:
    """One over the time of the fastest motion under a peak force [1/s]; 0 if it gets stuck."""
    needed = slider.work_of_resistance(travel)
    switch = (
        brentq(lambda s: peak * slider.work_of_rope(s) - needed, 0.0, travel)
        if peak * slider.work_of_rope(travel) > needed
        else travel
    )
    time = 0.0
    for first, last in ((0.0, switch), (switch, travel)):
        # the speed has a root at each end, which the square of a sine takes away
        angle = np.pi / 4 * (1 + NODES)
        s = first + (last - first) * np.sin(angle) ** 2
        driven = np.minimum(peak * slider.work_of_rope(s), needed)
        squared = 2 / slider.mass * (driven - slider.work_of_resistance(s))
        if last > first and np.any(squared <= 0):
            return 0.0
        if last > first:
            slope = (last - first) * np.sin(2 * angle)
            time += float(WEIGHTS @ (np.pi / 4 * slope / np.sqrt(squared)))
    return 1 / time
