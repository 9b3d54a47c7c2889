"""Tune three parameters of the gait with Optuna: the fastest walk on which no robot falls."""

import argparse
from collections.abc import Sequence

import optuna

from nao_lipm_gait import Gait, GaitParameters, NaoGaitError, Simulation, Velocity, load_preset


def speed(seed: int, seconds: int, parameters: GaitParameters) -> float:
    """Mean speed [m/s] of a robot after it has stood 1 s; 0 after a fall."""
    gait = Gait("nao_h21_v33", parameters)
    with Simulation("nao_h21_v33", seed=seed) as sim:
        obs, targets = sim.reset(), None
        for tick in range(100 * (seconds + 1)):
            obs = sim.step(targets)
            if obs.fallen:
                return 0.0
            if obs.frame:
                targets = gait.step(obs.frame, Velocity(0.3 if tick > 99 else 0.0))
    return obs.truth.base_footprint[0] / seconds


def main(args: Sequence[str] | None = None) -> optuna.Study:
    """Print the best parameters; the study."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=30)
    parser.add_argument("--robots", type=int, default=4, help="the slowest counts")
    parser.add_argument("--quick", action="store_true", help="3 trials of one robot, 4 s each")
    options = parser.parse_args(args)
    trials, robots, seconds = options.trials, options.robots, 10
    if min(trials, robots) < 1:
        raise NaoGaitError("trials, robots", (trials, robots), "at least 1 of each")
    if options.quick:
        trials, robots, seconds = 3, 1, 4

    def objective(trial: optuna.Trial) -> float:
        parameters = load_preset("default").replace(
            swing_lift=trial.suggest_float("swing_lift", 0.02, 0.05),
            torso_pitch=trial.suggest_float("torso_pitch", 0.0, 0.1),
            arm_swing=trial.suggest_float("arm_swing", 0.0, 12.0),
        )
        return min(speed(seed, seconds, parameters) for seed in range(robots))

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study(direction="maximize", sampler=optuna.samplers.TPESampler(seed=0))
    study.enqueue_trial({"swing_lift": 0.03, "torso_pitch": 0.04, "arm_swing": 5.5})
    study.optimize(objective, n_trials=trials)
    best = ", ".join(f"{name} {value:.3f}" for name, value in study.best_params.items())
    print(f"{100 * study.best_value:.1f} cm/s with {best}")
    return study


if __name__ == "__main__":
    try:
        main()
    except NaoGaitError as error:
        raise SystemExit(str(error)) from None
