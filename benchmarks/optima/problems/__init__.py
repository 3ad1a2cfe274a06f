"""The benchmark problems, one a file, in the order in which the command solves them."""

from collections.abc import Callable, Mapping

from benchmarks.optima.benchmark import Benchmark
from benchmarks.optima.problems.brachistochrone import brachistochrone
from benchmarks.optima.problems.cartpole import cartpole
from benchmarks.optima.problems.catmix import catmix
from benchmarks.optima.problems.double_integrator import (
    bryson_denham,
    di_min_time,
    peak_accel,
    peak_accel_jerk,
    via_point,
)
from benchmarks.optima.problems.gas_oil import gas_oil
from benchmarks.optima.problems.goddard import goddard_betts, goddard_vmax
from benchmarks.optima.problems.robot_arm import robot_arm
from benchmarks.optima.problems.shuttle import shuttle
from benchmarks.optima.problems.stiff import alp_rider, hypersensitive

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
