"""rockit: multiple shooting with its Runge-Kutta integrator, as in its hello-world example."""

import casadi as ca
import problems
import row
from rockit import MultipleShooting, Ocp

IMPORTED = row.now()
SIZE = {"A": 56, "B": 210}  # intervals


def solve(problem, size):
    """Return edges, places in an interval and the jerk there."""
    n = size or SIZE[problem]

    # States, control and the peak as a free variable, in unit time.
    ocp = Ocp(T=1)
    angle, speed, acc = ocp.state(), ocp.state(), ocp.state()
    jerk, peak = ocp.control(), ocp.variable()
    ocp.set_der(angle, speed)
    ocp.set_der(speed, acc)
    ocp.set_der(acc, problems.UNIT_JERK[problem] * jerk)

    # From rest to rest.
    for at, value in ((ocp.at_t0, problems.START), (ocp.at_tf, problems.END)):
        ocp.subject_to(at(angle) == value)
        ocp.subject_to(at(speed) == 0)
        ocp.subject_to(at(acc) == 0)

    # Caps.
    ocp.subject_to(-1 <= (jerk <= 1))
    if problem == "A":
        ocp.subject_to(-peak <= (acc / problems.UNIT_ACCELERATION <= peak))
    else:
        force = problems.unit_force(ca, ca.if_else, angle, speed, acc)
        ocp.subject_to(0 <= (force <= peak))
        ocp.subject_to(speed >= 0)

    ocp.add_objective(peak)
    ocp.set_initial(angle, problems.START + (problems.END - problems.START) * ocp.t)
    ocp.solver("ipopt", {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False})
    ocp.method(MultipleShooting(N=n, intg="rk"))

    solution = ocp.solve()
    times, values = solution.sample(jerk, grid="control")
    edges, jerks = problems.in_si_units(problem, times, values[:-1])
    return edges, (0.5,), jerks[:, None]


if __name__ == "__main__":
    row.answer(IMPORTED, *solve(*row.asked()))
