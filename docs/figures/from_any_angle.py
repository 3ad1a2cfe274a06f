"""The least acceleration in 20 s, from stowed, half open and under way, with one cap on jerk."""

import matplotlib.pyplot as plt
import numpy as np

from studies.common.console import silent
from studies.truss import TrussStudy, run

DURATION = 20.0  # [s]
STARTS = {
    "stowed, at rest": {},
    "45 deg, at rest": {"start_deg": 45.0},
    "stowed, at 2 deg/s": {"start_rate_deg_per_s": 2.0},
}

figure, (plane, course) = plt.subplots(1, 2, figsize=(10, 3.8), layout="constrained")
for (name, ends), style in zip(STARTS.items(), ("-", "--", "-."), strict=True):
    study = TrussStudy(minimise="peak-acceleration", duration=DURATION, caps={"jerk": 0.03}, **ends)
    series = run(study, silent()).arrays
    time, angle, speed, acceleration = (
        series[key].values for key in ("time", "angle", "angular_speed", "angular_acceleration")
    )
    plane.plot(np.degrees(angle), np.degrees(speed), style, label=name)
    course.plot(time, np.degrees(acceleration), style, label=name)

plane.set_xlabel("deployment angle α [deg]")
plane.set_ylabel("angular speed [deg/s]")
plane.set_ylim(top=11)
plane.legend(loc="upper left")
course.set_xlabel("time [s]")
course.set_ylabel("angular acceleration [deg/s²]")
figure.savefig("from_any_angle.png", dpi=130)
