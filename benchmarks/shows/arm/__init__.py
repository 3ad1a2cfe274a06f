"""Shows of the arm: stages drawn at random, and exports replayed by other code."""
