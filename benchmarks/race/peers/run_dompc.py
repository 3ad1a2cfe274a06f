"""do-mpc: its controller's nonlinear program, solved once; the peak is a single soft slack."""

import casadi as ca
import do_mpc
import numpy as np
import problems
import row

IMPORTED = row.now()
SIZE = {"A": 56, "B": 210}  # steps


def model(problem):
    """States, jerk and what is to have the least peak (A: the square of the acceleration)."""
    plant = do_mpc.model.Model("continuous", "SX")
    angle, speed, acc = (plant.set_variable("_x", name) for name in ("angle", "speed", "acc"))
    jerk = plant.set_variable("_u", "jerk")

    plant.set_rhs("angle", speed)
    plant.set_rhs("speed", acc)
    plant.set_rhs("acc", problems.UNIT_JERK[problem] * jerk)

    if problem == "A":
        plant.set_expression("peaked", (acc / problems.UNIT_ACCELERATION) ** 2)
    else:
        plant.set_expression("peaked", problems.unit_force(ca, ca.if_else, angle, speed, acc))
    plant.setup()
    return plant


def controller(problem, n):
    """The controller over n steps of unit time in all, with a straight line as guess."""
    plant = model(problem)
    mpc = do_mpc.controller.MPC(plant)
    mpc.settings.n_horizon, mpc.settings.t_step = n, 1 / n
    mpc.settings.collocation_deg = 3
    mpc.settings.nl_cons_single_slack = True
    mpc.settings.use_terminal_bounds = True
    mpc.settings.nlpsol_opts = {"ipopt.max_iter": 3000}
    mpc.settings.supress_ipopt_output()

    # The objective is the slack of the soft constraint below, and nothing else.
    zero = ca.DM(0)
    mpc.set_objective(mterm=zero, lterm=zero)
    mpc.set_rterm(jerk=0.0)

    mpc.bounds["lower", "_u", "jerk"], mpc.bounds["upper", "_u", "jerk"] = -1, 1
    for name, value in (("angle", problems.END), ("speed", 0), ("acc", 0)):
        mpc.terminal_bounds["lower", name] = mpc.terminal_bounds["upper", name] = value
    peaked = plant.aux["peaked"]
    mpc.set_nl_cons("peak", peaked, ub=0, soft_constraint=True, penalty_term_cons=1)
    if problem == "B":
        mpc.bounds["lower", "_x", "speed"] = 0
        mpc.set_nl_cons("pull", -peaked, ub=0)
    mpc.setup()

    mpc.x0 = np.array([problems.START, 0, 0])
    mpc.set_initial_guess()
    for k in range(n + 1):
        angle = problems.START + (problems.END - problems.START) * k / n
        mpc.opt_x_num["_x", k, 0] = [np.array([angle, 0, 0])] * len(mpc.opt_x_num["_x", k, 0])
    return mpc


def solve(problem, size):
    """Return edges, places in an interval, the jerk there, and a note."""
    n = size or SIZE[problem]
    mpc = controller(problem, n)
    mpc.make_step(np.array([problems.START, 0, 0]))

    jerk = np.array([float(mpc.opt_x_num["_u", k, 0]) for k in range(n)])
    edges, jerks = problems.in_si_units(problem, np.linspace(0, 1, n + 1), jerk)
    return edges, (0.5,), jerks[:, None], mpc.solver_stats["return_status"]


if __name__ == "__main__":
    *control, words = solve(*row.asked())
    row.answer(IMPORTED, *control, note=words)
