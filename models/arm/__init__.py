"""The two-link supporting arm, in full and reduced to a few coordinates.

`parameters` holds the arm and the pendulums of the paper's Table 1; its `chain` is the full model
of `models.ancf`. `reduced` is the arm as a few ordinary differential equations, for optimisation,
and `driven` is the same with its moving joint on a given angle. `reduced_simulation` moves the
reduced arm under torques, finds its natural modes and locks it.
"""
