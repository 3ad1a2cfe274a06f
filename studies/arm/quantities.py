"""What can be minimised, by name; without CasADi, so that help and errors are fast."""

OBJECTIVES = {
    "smoothness": "mean square of the torque's second derivative, under a torque cap",
    "peak-torque": "largest absolute torque",
    "energy": "mean square of the torque: what a motor's winding dissipates",
}
