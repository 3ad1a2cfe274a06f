"""A slider that a rope pulls along a rail: a study of `antenna-ocp` in a package of its own."""
