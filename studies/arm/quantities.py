"""What can be minimised, by name; without CasADi, so that help and errors are fast."""

OBJECTIVES = {
    "smoothness": "mean square of the torque's second derivative, under a torque cap",
    "peak-torque": "largest absolute torque",
    "tip-acceleration": "largest acceleration of the tip",
    "energy": "mean square of the torque: what a motor's winding dissipates",
    "root-reaction": "largest force at the root",
    "deflection": "largest strain energy of the links: their elastic deflection",
}
