"""Optimal control by direct collocation on CasADi and IPOPT."""
