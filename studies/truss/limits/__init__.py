"""What a motion has to keep: caps that a user states, bounds by proof, tolerances of the checks."""
