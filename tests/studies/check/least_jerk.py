"""The curve through rows whose peak jerk is least, by a linear programme: a witness for a verdict.

Its jerk is constant on a few cells between any two rows. Where its peak keeps a cap, no row can
tell that the cap is broken.
"""

import numpy as np
from scipy.optimize import linprog

CELLS = 4  # between two rows


def least_jerk(
    time: np.ndarray, values: np.ndarray, start: tuple[float, ...] = (), end: tuple[float, ...] = ()
) -> float:
    """Peak jerk of the curve; `start` and `end` are its speed and acceleration there, if stated.

    So the curve goes on as another motion does that has the same state there.
    """
    count = len(time)
    assert time[0] == 0.0
    length, size = time[-1], np.ptp(values)
    edges = np.interp(np.arange((count - 1) * CELLS + 1) / CELLS, np.arange(count), time) / length

    def row(at: float, order: int) -> np.ndarray:
        """What each unknown adds to a derivative: the jerks of cells, and the state at 0."""
        power, factor = 3 - order, (6.0, 2.0, 1.0)[order]
        steps = np.maximum(at - edges, 0.0) ** power / factor
        state = [np.polyder(np.poly1d([1.0] + k * [0.0]), order)(at) for k in range(3)]
        return np.concatenate([steps[:-1] - steps[1:], state, [0.0]])

    rows = [row(t / length, 0) for t in time]
    wanted = [(x - values[0]) / size for x in values]
    for at, rates in ((0.0, start), (1.0, end)):
        for order, rate in enumerate(rates, start=1):
            rows.append(row(at, order))
            wanted.append(rate * length**order / size)

    jerks, most = np.eye(edges.size - 1, edges.size + 3), np.zeros((edges.size - 1, edges.size + 3))
    most[:, -1] = 1.0
    found = linprog(
        np.eye(edges.size + 3)[-1],
        A_ub=np.concatenate([jerks - most, -jerks - most]),
        b_ub=np.zeros(2 * edges.size - 2),
        A_eq=np.array(rows),
        b_eq=np.array(wanted),
        bounds=(None, None),
    )
    assert found.success, found.message
    return float(found.x[-1]) * size / length**3
