"""The benchmark problems, one a file, in the order in which the command solves them."""

from collections.abc import Callable, Mapping

from studies.benchmarks.benchmark import Benchmark
from studies.benchmarks.problems.brachistochrone import brachistochrone
from studies.benchmarks.problems.cartpole import cartpole
from studies.benchmarks.problems.catmix import catmix
from studies.benchmarks.problems.double_integrator import (
    bryson_denham,
    di_min_time,
    peak_accel,
    peak_accel_jerk,
    via_point,
)
from studies.benchmarks.problems.gas_oil import gas_oil
from studies.benchmarks.problems.goddard import goddard_betts, goddard_vmax
from studies.benchmarks.problems.robot_arm import robot_arm
from studies.benchmarks.problems.shuttle import shuttle
from studies.benchmarks.problems.stiff import alp_rider, hypersensitive

CATALOGUE: Mapping[str, Callable[[], Benchmark]] = {
    "brachistochrone": brachistochrone,
    "bryson_denham": bryson_denham,
    "di_min_time": di_min_time,
    "peak_accel": peak_accel,
    "peak_accel_jerk": peak_accel_jerk,
    "hypersensitive_50": hypersensitive,
    "alp_rider": alp_rider,
    "cartpole_kelly": cartpole,
    "goddard_vmax": goddard_vmax,
    "catmix": catmix,
    "robot_arm": robot_arm,
    "gas_oil": gas_oil,
    "shuttle": shuttle,
    "via_point": via_point,
    "goddard_betts_3ph": goddard_betts,
}
