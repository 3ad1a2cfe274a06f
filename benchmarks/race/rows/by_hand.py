"""A nonlinear program whose intervals share one kernel, with derivatives assembled from its own.

What the two baselines have in common. Unknowns: z_k of each interval in time order (its first
three are the state, in unit time), then one peak. Rows of interval k: its end state less the state
of the next interval, the peak less what may not exceed it, and what may not be negative.
"""

import casadi as ca
import numpy as np
import problems

OPTIONS = {
    "print_time": False,
    "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-6, "mu_init": 1e-2},
}
FIRST_PEAK = 2.0  # guess, of a quantity near one


def quintic(tau):
    """Rest-to-rest guess of angle, speed and acceleration at times tau of unit time, (3, n)."""
    stroke = problems.END - problems.START
    angle = problems.START + stroke * tau**3 * (10 - 15 * tau + 6 * tau**2)
    speed = stroke * 30 * tau**2 * (1 - tau) ** 2
    acceleration = stroke * 60 * tau * (1 - tau) * (1 - 2 * tau)
    return np.array([angle, speed, acceleration])


def at_rest(guess):
    """Bounds of the shape of a guess: the first state as guessed, then speeds not negative."""
    lower = np.full(guess.shape, -np.inf)
    upper = -lower
    lower[:3, 0] = upper[:3, 0] = guess[:3, 0]
    lower[1, 1:] = 0.0
    return lower, upper


def minimise(z, end, peaked, positive, guess, lower, upper, *, whole=None):
    """Solve for the least peak.

    Parameters
    ----------
    z : SX (n_z,)
        Unknowns of one interval.
    end, peaked, positive : SX
        The kernel, expressions of z: end state, what the peak bounds, what may not be negative.
    guess, lower, upper : ndarray, shape (n_z, n)
        Of n intervals.
    whole : int or None
        Index of the length of an interval in z, if these must add up to 1.

    Returns
    -------
    unknowns, peak, note : ndarray (n_z, n), float, str
        `note` is IPOPT's last word.
    """
    n_z, n = guess.shape
    sizes = (3, peaked.numel(), positive.numel())
    rows = ca.vertcat(end, -peaked, positive)
    program, derivatives = _program(z, rows, sizes, n, whole)
    solver = ca.nlpsol("by_hand", "ipopt", program, OPTIONS | derivatives)

    # Links between intervals are equations, the other rows of an interval are not negative.
    highest = np.tile(np.repeat([0.0, np.inf], [3, sum(sizes) - 3]), n)
    answer = solver(
        x0=np.append(guess.ravel("F"), FIRST_PEAK),
        lbx=np.append(lower.ravel("F"), 0.0),
        ubx=np.append(upper.ravel("F"), np.inf),
        lbg=0.0,
        ubg=highest if whole is None else np.append(highest, 0.0),
    )

    values, stats = answer["x"].full().ravel(), solver.stats()
    note = f"{stats['return_status']}, {stats['iter_count']} iterations"
    return values[:-1].reshape(n_z, n, order="F"), values[-1], note


def _program(z, rows, sizes, n, whole):
    """The program of n intervals, and its derivatives as IPOPT's options.

    Parameters
    ----------
    z, rows : SX (n_z,) and (m,)
        The kernel.
    sizes : tuple of int
        Numbers of its rows: end state, below the peak, not negative.
    """
    # The kernel and its derivatives, written once and mapped over the intervals.
    n_z, m = z.numel(), rows.numel()
    weight = ca.SX.sym("w", m)
    slope = ca.jacobian(rows, z)
    bend = ca.triu(ca.hessian(ca.dot(weight, rows), z)[0])
    value = ca.Function("value", [z], [rows]).map(n)
    first = ca.Function("first", [z], [rows, ca.vertcat(*slope.nonzeros())]).map(n)
    second = ca.Function("second", [z, weight], [ca.vertcat(*bend.nonzeros())]).map(n)

    count, n_rows = n_z * n + 1, m * n + (whole is not None)
    x, w = ca.MX.sym("x", count), ca.MX.sym("w", n_rows)
    f_factor, nothing = ca.MX.sym("f"), ca.MX.sym("p", 0)
    Z = ca.reshape(x[:-1], n_z, n)

    # Links and peak are linear: they are constants of the Jacobian and absent from the Hessian.
    local, slopes = first(Z)
    jacobian = _sparse(n_rows, count, _jacobian_triplets(slope, sizes, n, whole), slopes)
    interval = np.arange(n)[:, None]
    r, c = (np.array(i) for i in bend.sparsity().get_triplet())
    hessian_triplets = [(r + n_z * interval, c + n_z * interval, None)]
    bends = second(Z, ca.reshape(w[: m * n], m, n))
    hessian = _sparse(count, count, hessian_triplets, bends)

    g, g_again = (_all_rows(kernel, Z, x[-1], sizes, whole) for kernel in (value(Z), local))
    inputs = ["x", "p", "lam_f", "lam_g"]  # the names by which `nlpsol` knows a Hessian
    hessian_function = ca.Function(
        "hess_lag", [x, nothing, f_factor, w], [hessian], inputs, ["triu_hess_gamma_x_x"]
    )
    derivatives = {
        "jac_g": ca.Function("jac_g", [x, nothing], [g_again, jacobian]),
        "hess_lag": hessian_function,
    }
    return {"x": x, "f": x[-1], "g": g}, derivatives


def _all_rows(local, Z, peak, sizes, whole):
    """The rows of all intervals from the kernel's (m, n), with links and peak."""
    n = Z.shape[1]
    following = ca.horzcat(Z[:3, 1:], ca.DM([problems.END, 0, 0]))
    constant = ca.vertcat(-following, ca.repmat(peak, sizes[1], n), ca.MX(sizes[2], n))
    rows = ca.vec(local + constant)
    return rows if whole is None else ca.vertcat(rows, ca.sum2(Z[whole, :]) - 1)


def _jacobian_triplets(slope, sizes, n, whole):
    """Those of the kernel, the links to the next interval, the peak, the sum of the lengths."""
    m, n_z = slope.shape
    interval, link = np.arange(n)[:, None], np.arange(n - 1)[:, None]
    r, c = (np.array(i) for i in slope.sparsity().get_triplet())

    below_peak = 3 + np.arange(sizes[1])
    triplets = [
        (r + m * interval, c + n_z * interval, None),
        (np.arange(3) + m * link, np.arange(3) + n_z * (link + 1), -1.0),
        (below_peak + m * interval, np.full((n, sizes[1]), n_z * n), 1.0),
    ]
    if whole is not None:
        triplets.append((np.full((n, 1), m * n), whole + n_z * interval, 1.0))
    return triplets


def _sparse(rows, columns, triplets, first):
    """MX matrix from (rows, columns, number) triplets; the first's values are `first`."""
    r = np.concatenate([t[0].ravel() for t in triplets])
    c = np.concatenate([np.broadcast_to(t[1], t[0].shape).ravel() for t in triplets])
    order = np.lexsort((r, c))  # CasADi's order: by column, then by row
    sparsity = ca.Sparsity.triplet(rows, columns, r[order].tolist(), c[order].tolist())

    constants = [np.full(t[0].size, t[2]) for t in triplets[1:]]
    values = ca.vertcat(ca.vec(first), *(ca.DM(v) for v in constants))
    return ca.MX(sparsity, values[order.tolist()])
