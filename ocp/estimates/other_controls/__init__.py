"""Controls far from those of a motion.

`promise` says what they could gain, `trials` tries them, and `limits` keeps them within the limits
that controls share. `dependence` is what the statement alone says of that, worked out once.
"""
