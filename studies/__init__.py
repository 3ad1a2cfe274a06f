"""The studies of the antenna and the command `antenna-ocp` that runs them."""
