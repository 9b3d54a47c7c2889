"""The standing robot kicks a ball."""

import argparse
import math
from collections.abc import Sequence

from nao_lipm_gait import Gait, GaitState, NaoGaitError, Simulation, Velocity
from robot_core.motion.library import shipped_library


def main(args: Sequence[str] | None = None) -> tuple[float, bool]:
    """Print and return how far [m] the ball came, and whether the robot stands."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kick", default="kick_front_left", help="see config/motions")
    parser.add_argument("--seed", type=int, default=0, help="the individual robot")
    parser.add_argument("--quick", action="store_true", help="do not wait until the ball lies")
    options = parser.parse_args(args)
    gait = Gait("nao_h21_v33")
    spot = shipped_library(gait.robot).find(options.kick).kick
    if spot is None:
        raise NaoGaitError("kick", options.kick, "a motion that kicks")
    with Simulation("nao_h21_v33", seed=options.seed, ball=(spot.x, spot.y)) as sim:
        obs, targets = sim.reset(), None
        for tick in range(600 if options.quick else 1200):
            obs = sim.step(targets)
            if obs.frame:
                targets = gait.step(obs.frame, Velocity())
            if tick == 150:
                gait.request_motion(options.kick)
        ball = sim.world.ball
    assert ball is not None
    x, y = (ball.position[:2] - (spot.x, spot.y)).tolist()
    way, stands = math.hypot(x, y), gait.state is GaitState.STAND and not obs.fallen
    angle = math.degrees(math.atan2(y, x))
    print(f"{way:.2f} m at {angle:.0f} deg; {'the robot stands' if stands else 'it fell'}")
    return way, stands


if __name__ == "__main__":
    try:
        main()
    except NaoGaitError as error:
        raise SystemExit(str(error)) from None
