"""Where the searches of the arm's studies begin, refine and give up: all such limits in one place.

A motion that is "not found" was not found within these limits. Physical limits (how far a link may
bend, what counts as still) stand with the checks that use them.
"""

from __future__ import annotations

from typing import Literal

# One stage on one mesh
INTERVALS = (150, 200)  # where the root alone turns, and where the elbow does
Barrier = Literal["monotone", "adaptive"]  # of IPOPT
Attempt = tuple[float, Barrier]
ATTEMPTS: tuple[Attempt, ...] = ((1.0, "adaptive"), (1.5, "monotone"))  # mesh, IPOPT's barrier
ITERATIONS = 120  # of IPOPT in each attempt
ROUNDS = 7  # of a refinement, that of the finer mesh not counted
# by which the smoothness is made lighter at once, where the root alone turns and where the elbow
# does: lightened by 100, the elbow's torque swings the big arm to and fro, which no mesh resolves
LIGHTER = (100.0, 10.0)
CALMER_ROUNDS = 4  # of a smoothness made heavier where a finer full model disagrees
CORRECTIONS = 4  # of a round's torque on the full model
HOPELESS = 300.0  # times the residual allowed, above which a motion is not aimed anew

# Least time of one stage
TIME_WINDOW = (0.5, 1.05)  # of a least time, over a duration in which the arm can turn
SPARE_DURATION = 1.1  # first duration over the rigid arm's least under the same caps

# Shapers whose frequency varies along the stage
FREQUENCIES_TRIED = 32
FREQUENCIES_OF_BOTH = 9  # where both joints turn, whose motions take longer
FREQUENCIES_REFINED = 8  # tried between the best one's neighbours
LONGEST_SHAPER = 0.8  # of the stage's duration

# Optima beside baselines
HIGHEST_CAP = 7.5  # [J D/T^2] above which a looser cap brings nothing: Step5's own peak
JUMP_STEPS = (0.004, 0.002, 0.001, 0.0005)  # [s] fixed steps tried for a law that jumps

# Least durations
SHORTEST_SCANNED = 0.5  # times the stage's duration at which a scan begins at the earliest
LONGEST_SCANNED = 2.5  # the same at which it gives up
DURATIONS_A_BEAT = 6.0  # scanned
COARSE_RATIO = 1.1  # of neighbouring durations where the shaper is sought at each
NEAR = 4.0  # times the limit that B21 may leave where the full model is asked
CANDIDATES = 3  # dips of a scan at which the full model is asked
BISECTIONS = 4  # between a duration that passes and one that does not
HALVINGS = 40  # for the shortest duration of a law under the cap
OPTIMUM_FACTORS = (4.04, 5.0)  # caps in J D/T^2 between which the optimum's duration is sought
OPTIMUM_SEARCHES = 6

# Fronts
FRONT_DURATIONS = (0.8, 1.5)  # of the stage's duration
FRONT_POINTS = 20  # that either walk may take
FRONT_LAWS = 9  # durations at which laws are set beside a front
# parts above the least peak torque at which a front begins, the first that is found: nearer to it
# there is hardly room for anything
ABOVE_THE_LEAST = (0.01, 0.02, 0.05)
ABOVE_REST = (1.0, 10.0, 100.0)  # times what counts as still, the same for the energy left
WIDEST_AT_LEAST = 1.1  # of the highest limit on the torque over the lowest one
# of the energy at the mean rate of the turn, the highest limit on what is left: an arm that has
# more was hardly stopped
OF_TURNING = 0.1
CALMER = 10.0  # by which the smoothness is made heavier where the full model does not rest

# Both stages as one problem
SEQUENCE_INTERVALS = (150, 10, 200)  # of big arm, dwell and small arm
SEQUENCE_SECONDS = 300.0  # that a search may take, unless stated: some times what it takes
UNRESOLVED = 10.0  # times the residual allowed, above which no more replays are made
LONGEST_DWELL = 1000.0  # [s]; its vibration is resolved by the replays, however little it is
SEQUENCE_WINDOW = (0.3, 3.0)  # of the guessed durations, between which the optimiser chooses

# One motion for a spread of arms
# where the root turns, and where the elbow does; with 120 and 200 the elbow's arms on an angle
# believed in a rest that a replay missed by 0.5 and 0.02 sqrt(J)
ROBUST_INTERVALS = {"torque": (100, 120), "angle": (100, 300)}
ROBUST_MESHES = 2  # each twice as fine as the one before, until a replay agrees with the solver
ROBUST_ITERATIONS = 300  # 20 to 150 are usual; the last digits decide over them
CAP_CORRECTIONS = 3  # solves at most until the cap holds between the points of the mesh too

# What only memory would end
MOST_ELEMENTS = 1000
MOST_MODES = 1000
