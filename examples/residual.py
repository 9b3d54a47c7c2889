"""Learn on top of the gait: random search for a residual, a gain from the gyro to the joints."""

import argparse
from collections.abc import Sequence

import gymnasium
import numpy as np

import nao_lipm_gait.gym  # registers the environment
from nao_lipm_gait import NaoGaitError

GYRO_SIDE = 0.05  # [rad/s] per unit of action; scales the gains to a size near 1


def episode(env: gymnasium.Env, gains: np.ndarray, individual: int, steps: int) -> float:
    """Sum of the rewards, about the way [m]; gains (n, 3) from the gyro [rad/s] to the action."""
    obs, _ = env.reset(options={"individual": individual})
    n, total = len(gains), 0.0
    for _ in range(steps):
        gyro = obs[n : n + 3]
        obs, reward, terminated, truncated, _ = env.step(np.clip(gains @ gyro, -1.0, 1.0))
        total += float(reward)
        if terminated or truncated:
            break
    return total


def main(args: Sequence[str] | None = None) -> tuple[float, float]:
    """Print and return the reward of the gait alone and of the best residual."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--iterations", type=int, default=20)
    parser.add_argument("--quick", action="store_true", help="2 iterations of 3 s")
    options = parser.parse_args(args)
    if options.iterations < 1:
        raise NaoGaitError("iterations", options.iterations, "at least 1")
    iterations, steps = (2, 300) if options.quick else (options.iterations, 1000)
    env = gymnasium.make(nao_lipm_gait.gym.WALK, velocity=(0.3, 0.0, 0.0), residual=0.03)
    random = np.random.default_rng(0)
    best = np.zeros((len(env.action_space.sample()), 3))
    alone = score = episode(env, best, 0, steps)
    print(f"the gait alone: {alone:.3f}")
    for iteration in range(iterations):
        tried = best + random.normal(0.0, GYRO_SIDE, best.shape)
        found = episode(env, tried, 0, steps)
        if found > score:
            best, score = tried, found
        print(f"{iteration + 1:3d}: {found:.3f}, best {score:.3f}")
    env.close()
    return alone, score


if __name__ == "__main__":
    try:
        main()
    except NaoGaitError as error:
        raise SystemExit(str(error)) from None
