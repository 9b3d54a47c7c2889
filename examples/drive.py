"""Drive the simulated robot: forward, sideways, and turn on the spot."""

import argparse
import math
from collections.abc import Sequence

from nao_lipm_gait import Gait, NaoGaitError, Simulation, Velocity

TOUR = (
    ("stand", Velocity()),
    ("forward", Velocity(x=0.25)),
    ("left", Velocity(y=0.12)),
    ("turn", Velocity(yaw=1.0)),
    ("stand", Velocity()),
)


def main(args: Sequence[str] | None = None) -> list[tuple[float, float, float]]:
    """Print where the robot is after each part; its poses x, y [m], yaw [rad]."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robot", default="nao_h21_v33", help="a shipped name or a URDF file")
    parser.add_argument("--engine", default="mujoco", choices=("mujoco", "pybullet"))
    parser.add_argument("--seed", type=int, default=0, help="the individual robot")
    parser.add_argument("--quick", action="store_true", help="2 s of each part, not 5 s")
    options = parser.parse_args(args)
    gait, poses = Gait(options.robot), []
    with Simulation(options.robot, engine=options.engine, seed=options.seed) as sim:
        obs, targets = sim.reset(), None
        for name, command in TOUR:
            for _ in range(200 if options.quick else 500):
                obs = sim.step(targets)
                if obs.frame:
                    targets = gait.step(obs.frame, command)
            x, y, yaw = obs.truth.base_footprint
            poses.append((x, y, yaw))
            print(f"{name:8s} x {x:5.2f} m   y {y:5.2f} m   yaw {math.degrees(yaw):4.0f} deg")
    return poses


if __name__ == "__main__":
    try:
        main()
    except NaoGaitError as error:
        raise SystemExit(str(error)) from None
