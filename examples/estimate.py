"""Record the sensors of a walk, then estimate from the file where the robot went.

The gait is its own estimator: fed with the recorded frames and commands it takes the same steps,
and its status has the odometry and the torso's orientation of that walk.
"""

import argparse
import math
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from nao_lipm_gait import Gait, SensorFrame, Simulation, Velocity


def record(file: Path, seconds: int) -> None:
    """Walk a curve and write stamps, sensors, commands and the true poses at these stamps."""
    gait, rows = Gait("nao_h21_v33"), []
    with Simulation("nao_h21_v33", seed=40) as sim:
        obs, targets = sim.reset(), None
        truths = {obs.truth.stamp: obs.truth.base_footprint}
        for tick in range(100 * seconds):
            obs = sim.step(targets)
            truths[obs.truth.stamp] = obs.truth.base_footprint
            if obs.frame:
                command = Velocity(0.15, 0.0, 0.3) if tick > 199 else Velocity()
                targets = gait.step(obs.frame, command)
                rows.append((*obs.frame[:4], command, truths[obs.frame.stamp]))
    names = "stamp", "joint_position", "angular_velocity", "linear_acceleration"
    columns = zip((*names, "command", "truth"), zip(*rows, strict=True), strict=True)
    with file.open("wb") as out:
        np.savez(out, allow_pickle=False, **{name: np.array(column) for name, column in columns})


def estimate(file: Path) -> tuple[float, float, float]:
    """Errors at the end of the walk: place [m] and yaw [rad]; and its length [m]."""
    gait, log = Gait("nao_h21_v33"), np.load(file)
    sensors = "joint_position", "angular_velocity", "linear_acceleration"
    frames = zip(log["stamp"].tolist(), *(log[name] for name in sensors), strict=True)
    for frame, command in zip(frames, log["command"].tolist(), strict=True):
        gait.step(SensorFrame(*frame), Velocity(*command))
    x, y, yaw = gait.status.base_footprint_in_odom
    true_x, true_y, true_yaw = log["truth"][-1].tolist()
    way = float(np.hypot(*np.diff(log["truth"][::50, :2], axis=0).T).sum())
    return math.hypot(x - true_x, y - true_y), math.remainder(yaw - true_yaw, math.tau), way


def main(args: Sequence[str] | None = None) -> tuple[float, float, float]:
    """Print and return the errors of the estimate."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("log", nargs="?", type=Path, help="a file of an earlier run")
    parser.add_argument("--quick", action="store_true", help="5 s, not 20 s")
    options = parser.parse_args(args)
    with tempfile.TemporaryDirectory() as folder:
        file = options.log or Path(folder) / "walk.npz"
        if not file.exists():
            record(file, 5 if options.quick else 20)
        place, yaw, way = estimate(file)
    print(f"after {way:.2f} m: place {100 * place:.1f} cm, yaw {math.degrees(yaw):.1f} deg off")
    return place, yaw, way


if __name__ == "__main__":
    try:
        main()
    except ValueError as error:
        raise SystemExit(str(error)) from None
