"""Why nodes are not enough: a polynomial that keeps a bound at its nodes and breaks it between."""

import matplotlib.pyplot as plt
import numpy as np
from numpy.polynomial import Polynomial

# Radau points: where two neighbouring Legendre polynomials agree, the end of the interval included
legendre = [np.polynomial.legendre.Legendre.basis(k, domain=[0, 1]) for k in (3, 4)]
nodes = np.sort((legendre[1] - legendre[0]).roots().real)
values = np.array([1.0, 1.0, -1.0, -1.0])
curve = Polynomial.fit(nodes, values, 3)

dense = np.linspace(0, 1, 801)
figure, panel = plt.subplots(figsize=(7, 3.2), layout="constrained")
panel.axhspan(-1, 1, color="0.93", label="allowed")
panel.plot(dense, curve(dense), label="polynomial through the nodes")
panel.plot(nodes, values, "o", label="value at a node")
panel.set_xlabel("time in the interval [-]")
panel.set_ylabel("control [-]")
panel.legend(loc="upper right")
figure.savefig("between_nodes.png", dpi=130)
print(f"largest value {np.abs(curve(dense)).max():.3f}, at the nodes {np.abs(values).max():.3f}")
