"""Push a robot that steps on the spot from its left, harder and harder, until it falls."""

import argparse
import math
from collections.abc import Sequence

from nao_lipm_gait import Gait, NaoGaitError, Simulation, Velocity

STEP_ON_THE_SPOT = Velocity(yaw=1e-3)  # zero would stand


def survives(impulse: float, seed: int) -> bool:
    """Whether the robot is upright 3 s after a push [N s] to its right."""
    gait = Gait("nao_h21_v33")
    with Simulation("nao_h21_v33", seed=seed) as sim:
        obs, targets = sim.reset(), None
        for tick in range(700):
            if tick == 400:
                sim.push(impulse, direction=-math.pi / 2.0)
            obs = sim.step(targets)
            if obs.fallen:
                return False
            if obs.frame:
                targets = gait.step(obs.frame, STEP_ON_THE_SPOT if tick > 99 else Velocity())
    return True


def main(args: Sequence[str] | None = None) -> dict[float, bool]:
    """Print and return which impulses [N s] the robot survives."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0, help="the individual robot")
    parser.add_argument("--quick", action="store_true", help="two pushes only")
    options = parser.parse_args(args)
    found = {}
    for impulse in (1.0, 20.0) if options.quick else (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0):
        found[impulse] = survives(impulse, options.seed)
        print(f"{impulse:4.1f} N s: {'stays up' if found[impulse] else 'falls'}")
        if not found[impulse]:
            break
    return found


if __name__ == "__main__":
    try:
        main()
    except NaoGaitError as error:
        raise SystemExit(str(error)) from None
