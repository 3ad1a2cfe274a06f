"""Readers of the sizes of a mechanism: numbers that its models can square and cube."""

from __future__ import annotations

from typing import Any

from studies.common.configuration import Described, Reader, positive
from studies.common.exit_codes import StudyError

LARGEST = 1e12  # [kg, kg m^2, m/s^2, rad/s]


def between(least: float, most: float) -> Reader:
    """Reader of a positive number that the models can square and cube without overflow."""

    def read(name: str, value: Any) -> float:
        number = positive(name, value)
        if not least <= number <= most:
            raise StudyError(f"{name} is {number:g}; give a number from {least:g} to {most:g}")
        return number

    return Described(read, {"type": "number", "minimum": least, "maximum": most})


def limited(read: Reader) -> Reader:
    """Reader of a number whose size stays below what the models can square."""

    def bounded(name: str, value: Any) -> float:
        number = float(read(name, value))
        if abs(number) > LARGEST:
            raise StudyError(f"{name} is {number:g}; give a number of at most {LARGEST:g}")
        return number

    return Described(bounded, read.schema if isinstance(read, Described) else {"type": "number"})


LENGTH, SECTION = between(1e-4, 1e5), between(1e-6, 1e3)  # [m]
TIME = between(1e-6, 1e8)  # [s]
MODULUS, DENSITY = between(1e3, 1e14), between(1e-3, 1e6)  # [Pa], [kg/m^3]
