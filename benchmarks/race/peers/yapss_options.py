"""What both scripts for yapss, of the race and of the large problems, ask of it alike."""


def complete(ocp, intervals, points):
    """Set the same uniform mesh in each phase, exact derivatives, and silence.

    Parameters
    ----------
    intervals : of each phase
    points : in an interval
    """
    for mesh in ocp.mesh.phase:
        mesh.collocation_points = intervals * [points]
        mesh.fraction = intervals * [1.0 / intervals]

    ocp.derivatives.method, ocp.derivatives.order = "auto", "second"
    ocp.ipopt_options.print_level = 0
    ocp.ipopt_options.print_user_options = "no"
    ocp.ipopt_options.sb = "yes"
