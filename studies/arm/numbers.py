"""Numbers a study of the arm may state, with what they are and which of them may be what."""

NUMBERS = {
    "duration": "of the stage [s]",
    "torque_cap": "on each driven joint [N m]",
    "rate_cap": "on the torque's rate [N m/s]",
    "latch": "a joint that misses its end angle by more fails to lock [rad]",
    "sample_time": "of the exported profile [s]",
    "big_length": "[m]", "small_length": "[m]",
    "big_diameter": "of the tube [m]", "small_diameter": "of the tube [m]",
    "big_wall": "of the tube [m]", "small_wall": "of the tube [m]",
    "modulus": "Young's modulus of both tubes [Pa]", "density": "of both tubes [kg/m^3]",
    "tip_mass": "the antenna as a particle [kg]", "elbow_mass": "[kg]",
    "hub_inertia": "that turns with the big arm, a drive's [kg m^2]",
    "satellite_inertia": "about the root: replay the motion where the satellite is not held "
    "but turns [kg m^2]",
    "damping_ratio": "at damping_frequency", "damping_frequency": "[Hz]",
    "pointing_error": "of the tip, for the settling time [m]",
    "elements": "of the full model, a link; 8 by default",
    "modes": "locked modes whose amplitudes are reported; 3 by default",
    "root_start_deg": "[deg]", "root_end_deg": "[deg]",
    "elbow_start_deg": "[deg]", "elbow_end_deg": "[deg]",
}  # fmt: skip
ARM = (
    "big_length", "small_length", "big_diameter", "small_diameter", "big_wall", "small_wall",
    "modulus", "density", "tip_mass", "elbow_mass", "hub_inertia", "damping_ratio",
    "damping_frequency",
)  # fmt: skip
POSITIVE = (
    "torque_cap", "rate_cap", "latch", "sample_time", "pointing_error", "duration",
    "big_length", "small_length", "big_diameter", "small_diameter", "big_wall", "small_wall",
    "modulus", "density", "satellite_inertia", "elements", "modes", "damping_frequency",
)  # fmt: skip
NOT_NEGATIVE = ("tip_mass", "elbow_mass", "hub_inertia", "damping_ratio")
MOST = {"elements": 1000, "modes": 1000}  # beyond which only memory would end the run
WHOLE = ("elements", "modes")
