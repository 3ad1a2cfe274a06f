"""The law of a profile that this program wrote: its columns say more than the angles.

Such a profile has the speed and the acceleration of each row, before and behind its jumps, or the
jerk. Where these give the angles of the rows, the law is theirs, and nothing has to be recovered.
"""

from __future__ import annotations

from models.errors import ModelError
from models.laws import Law
from ocp.arrays import Array
from studies.check.reading.digits import half_a_digit
from studies.check.reading.profile import MeasuredProfile
from studies.truss.motions.laws import BEFORE, JERKS, RATES, exact_law, rows_law


def stated_law(measured: MeasuredProfile) -> Law | None:
    """The law that a profile states with its rates; None where it states none that fits."""
    angles = measured.values.get("angle")
    if angles is None:
        return None
    columns = {"time": measured.time, **_rates(measured)}
    try:
        return exact_law(columns, angles) or rows_law(columns, angles)
    except ModelError:  # times or rates that make no law: the angles alone decide
        return None


def rounding_of_rates(measured: MeasuredProfile) -> dict[str, Array]:
    """Half of the last digit of each stated rate, (m,) each; none of what is not stated."""
    columns = _rates(measured)
    names = {"speed": RATES[0], "acceleration": RATES[1], "jerk": JERKS[0]}
    return {rate: half_a_digit(columns[name]) for rate, name in names.items() if name in columns}


def _rates(measured: MeasuredProfile) -> dict[str, Array]:
    """The columns of rates that this program writes, as far as they are there, in SI."""
    if (measured.kept < 0).any():
        return {}
    table = measured.table
    places = {header.split("[")[0].strip(): place for place, header in enumerate(table.headers)}
    rates: dict[str, Array] = {}
    for names in ((*RATES, BEFORE), JERKS):
        if set(names) <= set(places):
            arrays = table.column([places[name] for name in names])
            rates |= {name: x[measured.kept] for name, x in zip(names, arrays, strict=True)}
    return rates
