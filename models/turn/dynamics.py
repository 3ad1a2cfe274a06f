"""Equation of motion of stage 2, without damping.

Symbols: psi [rad] angle of the antenna; beta [rad] angle of the drive; J2 [kg m^2], k [N m/rad].

    J2 psiddot = k (beta - psi)

Every function takes numbers, arrays or CasADi expressions.
"""

from __future__ import annotations

from typing import Any

from models.turn.parameters import TurnParameters


def torque(turn: TurnParameters, psi: Any, beta: Any) -> Any:
    """Torque in the big arm, which the drive gives [N m]: k (beta - psi)."""
    return turn.stiffness * (beta - psi)


def antenna_acceleration(turn: TurnParameters, psi: Any, beta: Any) -> Any:
    """Angular acceleration of the antenna [rad/s^2]."""
    return torque(turn, psi, beta) / turn.inertia


def swing_energy(turn: TurnParameters, psi: Any, psi_rate: Any, beta: Any) -> Any:
    """Energy of the antenna's swing about a drive that stands [J]."""
    return turn.inertia * psi_rate**2 / 2 + turn.stiffness * (beta - psi) ** 2 / 2
