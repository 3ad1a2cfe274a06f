"""Numbers a study of the arm may state, with what they are."""

NUMBERS = {
    "duration": "of the stage [s]",
    "torque_cap": "on each driven joint [N m]",
    "rate_cap": "on the torque's rate [N m/s]",
    "latch": "a joint that misses its end angle by more fails to lock [rad]",
    "sample_time": "of the exported profile [s]",
    "big_length": "[m]", "small_length": "[m]",
    "big_diameter": "of the tube [m]", "small_diameter": "of the tube [m]",
    "big_wall": "of the tube [m]", "small_wall": "of the tube [m]",
    "tip_mass": "the antenna as a particle [kg]", "elbow_mass": "[kg]",
    "hub_inertia": "that turns with the root [kg m^2]",
    "damping_ratio": "at damping_frequency", "damping_frequency": "[Hz]",
    "pointing_error": "of the tip, for the settling time [m]",
    "root_start_deg": "[deg]", "root_end_deg": "[deg]",
    "elbow_start_deg": "[deg]", "elbow_end_deg": "[deg]",
}  # fmt: skip
