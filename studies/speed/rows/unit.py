"""The two problems in numbers near one, as the peers are given them: unit time, jerk in [-1, 1].

angle' = speed, speed' = acc, acc' = JERK[problem] * jerk, from START to END at rest
least peak of `relative`: of |acc| for A; for B of the rope force, with force and speed >= 0
"""

import row
import truss_force

START, END = row.START, row.END
JERK = {name: row.JERK_CAP[name] * row.DURATION[name] ** 3 for name in row.JERK_CAP}
FORCE = 40.0  # [N], the unit of force
ACCELERATION = 4 * (END - START)  # that of a bang-bang motion


def force(lib, where, angle, speed, acc):
    """Rope force over FORCE; `lib` and `where` as in `truss_force`."""
    duration = row.DURATION["B"]
    found = truss_force.rope_force(lib, where, angle, speed / duration, acc / duration**2)
    return found / FORCE


def control(problem, times, jerk):
    """Times in [0, 1] and relative jerk, in SI units."""
    return times * row.DURATION[problem], jerk * row.JERK_CAP[problem]
