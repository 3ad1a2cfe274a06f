"""dymos: Radau transcription and SLSQP, the force as an explicit component of its model."""

import os

os.environ["OPENMDAO_REPORTS"] = "0"  # pages of HTML that are no part of a solve

import dymos as dm
import numpy as np
import openmdao.api as om
import problems
import row

IMPORTED = row.now()
SIZE = {"A": 30, "B": 30}  # segments
DEGREE = 3


class Margins(om.ExplicitComponent):
    """Rate of the acceleration and margins below the peak, with complex-step partials."""

    def initialize(self):
        """Options, as dymos asks for them."""
        self.options.declare("num_nodes", types=int)
        self.options.declare("problem", types=str)

    def setup(self):
        """Inputs and outputs at the nodes."""
        n = self.options["num_nodes"]
        for name in ("angle", "speed", "acc", "jerk", "peak"):
            self.add_input(name, shape=(n,))
        for name in ("rate", "above", "below"):
            self.add_output(name, shape=(n,))
        self.declare_coloring(wrt="*", method="cs", show_summary=False)
        diagonal = np.arange(n)
        self.declare_partials("*", "*", rows=diagonal, cols=diagonal, method="cs")

    def compute(self, inputs, outputs):
        """Margins: peak less the peaked, and for A the negative one, for B the force."""
        problem = self.options["problem"]
        outputs["rate"] = problems.UNIT_JERK[problem] * inputs["jerk"]
        if problem == "A":
            peaked = inputs["acc"] / problems.UNIT_ACCELERATION
            outputs["below"] = inputs["peak"] + peaked
        else:
            peaked = problems.unit_force(np, where, inputs["angle"], inputs["speed"], inputs["acc"])
            outputs["below"] = peaked
        outputs["above"] = inputs["peak"] - peaked


def where(condition, this, other):
    """NumPy compares the real parts of complex numbers first."""
    return np.where(condition, this, other)


def statement(problem, n):
    """The OpenMDAO problem with its trajectory of one phase."""
    p = om.Problem()
    p.driver = om.ScipyOptimizeDriver(optimizer="SLSQP", tol=1e-6, maxiter=500, disp=False)
    p.driver.declare_coloring(show_summary=False)

    trajectory = p.model.add_subsystem("traj", dm.Trajectory())
    phase = dm.Phase(
        ode_class=Margins,
        ode_init_kwargs={"problem": problem},
        transcription=dm.Radau(num_segments=n, order=DEGREE),
    )
    trajectory.add_phase("phase", phase)

    # States from rest to rest, the jerk free to jump between segments.
    phase.set_time_options(fix_initial=True, fix_duration=True)
    ends = {"fix_initial": True, "fix_final": True}
    phase.add_state("angle", rate_source="speed", targets=["angle"], **ends)
    slowest = {"lower": 0.0} if problem == "B" else {}
    phase.add_state("speed", rate_source="acc", targets=["speed"], **ends, **slowest)
    phase.add_state("acc", rate_source="rate", targets=["acc"], **ends)
    phase.add_control(
        "jerk", lower=-1.0, upper=1.0, continuity=False, rate_continuity=False, targets=["jerk"]
    )

    # The peak is a parameter that the margins keep above what is peaked.
    phase.add_parameter("peak", opt=True, static_target=False, lower=0.0, val=2.0, targets=["peak"])
    phase.add_path_constraint("above", lower=0.0)
    phase.add_path_constraint("below", lower=0.0)
    phase.add_objective("peak", loc="final")

    p.setup()
    phase.set_time_val(initial=0.0, duration=1.0)
    phase.set_state_val("angle", [problems.START, problems.END])
    phase.set_state_val("speed", [0.0, 0.0])
    phase.set_state_val("acc", [0.0, 0.0])
    phase.set_control_val("jerk", [0.0, 0.0])
    phase.set_parameter_val("peak", 2.0)
    return p


def solve(problem, size):
    """Return edges, places in a segment, the jerk there, and a note."""
    n = size or SIZE[problem]
    p = statement(problem, n)
    result = dm.run_problem(p, run_driver=True, simulate=False, make_plots=False)

    # Radau: the control has no value of its own at the end of a segment.
    times = p.get_val("traj.phase.timeseries.time")[:, 0].reshape(n, DEGREE + 1)
    jerk = p.get_val("traj.phase.timeseries.jerk")[:, 0].reshape(n, DEGREE + 1)
    edges, jerks = problems.in_si_units(
        problem, np.append(times[:, 0], times[-1, -1]), jerk[:, :-1]
    )
    first = times[0]
    places = (first[:-1] - first[0]) / (first[-1] - first[0])
    return edges, places, jerks, f"success: {getattr(result, 'success', result)}"


if __name__ == "__main__":
    *control, words = solve(*row.asked())
    row.answer(IMPORTED, *control, note=words)
