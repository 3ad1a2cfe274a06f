"""A nonlinear program whose intervals share one kernel, with derivatives assembled from its own.

What the two baselines have in common. Unknowns: z_k (first three the state, unit time T) of each
interval, in time order, then one peak. Rows of interval k: its end state less the state of the
next interval, peak less what may not exceed it, and what may not be negative.
"""

import casadi as ca
import numpy as np
import problems

OPTIONS = {
    "print_time": False,
    "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-6, "mu_init": 1e-2},
}


def powers(problem, speed, acc):
    """Speed and acceleration in SI units from those of unit time."""
    return speed / problems.DURATION[problem], acc / problems.DURATION[problem] ** 2


def quintic(tau):
    """Rest-to-rest guess of angle, speed and acceleration at times tau of unit time, (3, n)."""
    stroke = problems.END - problems.START
    return np.array(
        [
            problems.START + stroke * tau**3 * (10 - 15 * tau + 6 * tau**2),
            stroke * 30 * tau**2 * (1 - tau) ** 2,
            stroke * 60 * tau * (1 - tau) * (1 - 2 * tau),
        ]
    )


def minimise(z, end, peaked, positive, guess, lower, upper, *, whole=None):
    """Solve and return (the unknowns (n_z, n), the peak, IPOPT's last word).

    Parameters
    ----------
    z : SX (n_z,); end, peaked, positive: SX expressions of it, the kernel.
    guess, lower, upper : (n_z, n).
    whole : index of the length of an interval in z, if these must add up to 1.
    """
    n_z, n = guess.shape
    sizes = (3, peaked.numel(), positive.numel())
    program, derivatives = _program(z, ca.vertcat(end, -peaked, positive), sizes, n, whole)
    solver = ca.nlpsol("by_hand", "ipopt", program, OPTIONS | derivatives)
    highest = np.tile(np.repeat([0.0, np.inf], [3, sum(sizes) - 3]), n)
    answer = solver(
        x0=np.append(guess.ravel("F"), 2.0),
        lbx=np.append(lower.ravel("F"), 0.0),
        ubx=np.append(upper.ravel("F"), np.inf),
        lbg=0.0,
        ubg=highest if whole is None else np.append(highest, 0.0),
    )
    found = answer["x"].full().ravel()
    stats = solver.stats()
    note = f"{stats['return_status']}, {stats['iter_count']} iterations"
    return found[:-1].reshape(n_z, n, order="F"), found[-1], note


def _program(z, rows, sizes, n, whole):
    """The program of n intervals, and its derivatives as IPOPT's options.

    Parameters
    ----------
    z, rows : SX (n_z,) and (m,), the kernel.
    sizes : numbers of its rows: end state, below the peak, not negative.
    """
    n_z, m = z.numel(), rows.numel()
    weight = ca.SX.sym("w", m)
    slope = ca.jacobian(rows, z)
    bend = ca.triu(ca.hessian(ca.dot(weight, rows), z)[0])
    value = ca.Function("value", [z], [rows]).map(n)
    first = ca.Function("first", [z], [rows, ca.vertcat(*slope.nonzeros())]).map(n)
    second = ca.Function("second", [z, weight], [ca.vertcat(*bend.nonzeros())]).map(n)

    count, n_rows = n_z * n + 1, m * n + (whole is not None)
    x, f_factor, no = ca.MX.sym("x", count), ca.MX.sym("f"), ca.MX.sym("p", 0)
    w = ca.MX.sym("w", n_rows)
    Z = ca.reshape(x[:-1], n_z, n)
    local, slopes = first(Z)
    jacobian = _sparse(n_rows, count, _jacobian_triplets(slope, sizes, n, whole), slopes)
    k = np.arange(n)[:, None]
    r, c = (np.array(i) for i in bend.sparsity().get_triplet())
    hessian = _sparse(
        count,
        count,
        [(r + n_z * k, c + n_z * k, None)],
        second(Z, ca.reshape(w[: m * n], m, n)),
    )
    names = (["x", "p", "lam_f", "lam_g"], ["triu_hess_gamma_x_x"])
    g, same = (_all_rows(own, Z, x[-1], sizes, whole) for own in (value(Z), local))
    return {"x": x, "f": x[-1], "g": g}, {
        "jac_g": ca.Function("jac_g", [x, no], [same, jacobian]),
        "hess_lag": ca.Function("hess_lag", [x, no, f_factor, w], [hessian], *names),
    }


def _all_rows(local, Z, peak, sizes, whole):
    """The rows of all intervals from the kernel's (m, n), with links and peak."""
    n = Z.shape[1]
    following = ca.horzcat(Z[:3, 1:], ca.DM([problems.END, 0, 0]))
    constant = ca.vertcat(-following, ca.repmat(peak, sizes[1], n), ca.MX(sizes[2], n))
    together = ca.vec(local + constant)
    return together if whole is None else ca.vertcat(together, ca.sum2(Z[whole, :]) - 1)


def _jacobian_triplets(slope, sizes, n, whole):
    """Those of the kernel, the links to the next interval, the peak, the sum of the lengths."""
    m, n_z = slope.shape
    k, link = np.arange(n)[:, None], np.arange(n - 1)[:, None]
    r, c = (np.array(i) for i in slope.sparsity().get_triplet())
    triplets = [
        (r + m * k, c + n_z * k, None),
        (np.arange(3) + m * link, np.arange(3) + n_z * (link + 1), -1.0),
        (3 + np.arange(sizes[1]) + m * k, np.full((n, sizes[1]), n_z * n), 1.0),
    ]
    if whole is not None:
        triplets.append((np.full((n, 1), m * n), whole + n_z * k, 1.0))
    return triplets


def _sparse(rows, columns, triplets, first):
    """MX matrix from (rows, columns, number) triplets; the first's values are `first`."""
    r = np.concatenate([t[0].ravel() for t in triplets])
    c = np.concatenate([np.broadcast_to(t[1], t[0].shape).ravel() for t in triplets])
    order = np.lexsort((r, c))
    sparsity = ca.Sparsity.triplet(rows, columns, r[order].tolist(), c[order].tolist())
    constants = [np.full(t[0].size, t[2]) for t in triplets[1:]]
    values = ca.vertcat(ca.vec(first), *(ca.DM(v) for v in constants))
    return ca.MX(sparsity, values[order.tolist()])
