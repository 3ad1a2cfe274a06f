"""First-order optimality: costates, multipliers, the Hamiltonian, and dual warm starts."""
