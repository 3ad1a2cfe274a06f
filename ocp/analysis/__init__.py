"""Questions about a solved problem, each answered by further solves or from its multipliers.

Sensitivities, several starts, the smallest relaxation, families of problems, several objectives.
"""
