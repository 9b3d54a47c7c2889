"""Record the sensors of a walk, then estimate from the file where the robot went.

`nao_gait estimate walk.npz --robot nao_v6` does the same, with a figure.
"""

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gait_lab.estimate.command import errors, truth_of
from gait_lab.estimate.estimator import estimate
from gait_lab.estimate.recorded_body import RecordedBody
from gait_lab.estimate.sensor_log import load_log
from nao_lipm_gait import Gait, Simulation, Velocity

ROBOT = "nao_v6"


def record(file: Path, seconds: int) -> None:
    """Walk a curve; write sensors, and the true pose of the torso at their stamps."""
    gait, rows = Gait(ROBOT), []
    with Simulation(ROBOT, seed=40) as sim:
        targets, truths = None, {0: sim.reset().truth}
        for tick in range(100 * seconds):
            obs = sim.step(targets)
            truths[obs.truth.stamp] = obs.truth
            if obs.frame:
                walks = tick > 199
                targets = gait.step(obs.frame, Velocity(0.15 * walks, 0.0, 0.3 * walks))
                truth = truths[obs.frame.stamp]
                x, y, z, w = truth.torso_quaternion
                rpy = (
                    np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
                    np.arcsin(2 * (w * y - z * x)),
                    np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
                )
                rows.append((1e-9 * obs.frame.stamp, *obs.frame[1:4], *truth.sole_force,
                             truth.torso_position, rpy))  # fmt: skip
    names = ("time", "joint_position", "imu_angular_velocity", "imu_specific_force",
             "left_force_z", "right_force_z", "base_position", "base_rpy")  # fmt: skip
    columns = zip(names, map(np.array, zip(*rows, strict=True)), strict=True)
    np.savez(file, allow_pickle=False, joint_names=gait.robot.joint_names, **dict(columns))


def main(args: Sequence[str] | None = None) -> dict[str, tuple[float, str]]:
    """Print and return the errors of the estimate: value and unit."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("log", nargs="?", type=Path, help="a file of an earlier run")
    parser.add_argument("--quick", action="store_true", help="5 s, not 20 s")
    options = parser.parse_args(args)
    with tempfile.TemporaryDirectory() as folder:
        file = options.log or Path(folder) / "walk.npz"
        if not file.exists():
            record(file, 5 if options.quick else 20)
        log = load_log(file)
    body = RecordedBody(ROBOT, log.joint_names)
    off = errors(estimate(log, body), truth_of(log.reference, body))
    for name, (value, unit) in off.items():
        print(f"{name}: {value:.2f} {unit}")
    return off


if __name__ == "__main__":
    try:
        main()
    except ValueError as error:
        raise SystemExit(str(error)) from None
