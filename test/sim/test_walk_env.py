"""The Gymnasium environment: its contract, and that a zero action is the gait itself."""

import re
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="the extra `gym` is not installed")
pytest.importorskip("mujoco")

import gymnasium
from gymnasium.utils.env_checker import check_env

import nao_lipm_gait.gym
from nao_lipm_gait import Gait, NaoGaitError, Simulation, Velocity

WALK = "nao_lipm_gait/Walk-v0"
JOINTS = 22


def test_it_passes_the_checker_of_gymnasium() -> None:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*infinity.*")
        check_env(gymnasium.make(WALK).unwrapped, skip_render_check=True)


def test_a_zero_action_walks_as_the_gait_does() -> None:
    env = gymnasium.make(WALK, velocity=(0.2, 0.0, 0.0))
    env.reset(options={"individual": 40})
    total = 0.0
    for _ in range(400):
        obs, reward, terminated, truncated, _ = env.step(np.zeros(JOINTS))
        total += reward
    assert not terminated
    assert not truncated
    end = env.unwrapped._simulation.world.robot.truth()  # type: ignore[attr-defined]

    gait = Gait("nao_h21_v33")
    with Simulation(seed=40) as sim:
        seen, targets = sim.reset(), None
        while seen.truth.stamp < end.stamp:
            seen = sim.step(targets)
            if seen.frame:
                targets = gait.step(seen.frame, Velocity(0.2 if seen.time > 1.001 else 0.0))
    assert seen.truth.base_footprint == end.base_footprint
    assert np.array_equal(seen.truth.joint_position, end.joint_position)
    assert total == pytest.approx(end.base_footprint[0], abs=0.03)
    assert total > 0.3, "it walked"
    assert seen.frame is not None
    assert np.array_equal(obs[:JOINTS], seen.frame.joint_position), "sensors, not the truth"


def test_the_lines_of_the_page_run() -> None:
    page = (Path(__file__).resolve().parents[2] / "docs" / "python.md").read_text()
    (lines,) = re.findall(r"```python\n(import gymnasium.*?)```", page, re.S)
    names: dict = {}
    exec(lines, names)
    assert names["obs"].shape == (2 * JOINTS + 9,)
    assert names["info"] == {"individual": names["env"].reset(seed=1)[1]["individual"]}


def test_the_seed_draws_the_individual() -> None:
    env = gymnasium.make(WALK)
    drawn = [env.reset(seed=seed)[1]["individual"] for seed in (1, 2, 3, 1)]
    assert drawn[0] == drawn[3]
    assert len(set(drawn)) > 1
    assert all(0 <= each < 40 for each in drawn)


def test_a_residual_changes_the_walk_within_its_bound() -> None:
    env = gymnasium.make(WALK, residual=0.05)
    env.reset(options={"individual": 1})
    inner = env.unwrapped
    base = inner._base.position.copy()  # type: ignore[attr-defined]
    env.step(np.ones(JOINTS))
    sent = inner._simulation.world.robot.last_command.position  # type: ignore[attr-defined]
    assert (sent - base).max() == pytest.approx(0.05)
    assert (sent - base).min() >= 0.0


def test_limp_legs_by_large_residuals_terminate_with_a_penalty() -> None:
    env = gymnasium.make(WALK, residual=1.0)
    env.reset(seed=0)
    bent = np.zeros(JOINTS)
    robot = Gait("nao_h21_v33").robot
    for leg in (robot.left_leg, robot.right_leg):
        bent[robot.index(leg.ankle_pitch)] = 1.0
    rewards = []
    for _ in range(300):
        _, reward, terminated, _, _ = env.step(bent)
        rewards.append(reward)
        if terminated:
            break
    assert terminated
    assert rewards[-1] < -0.9


@pytest.mark.parametrize(
    ("arguments", "field"),
    [({"residual": -0.1}, "residual"), ({"velocity": (0.1,)}, "velocity"),
     ({"velocity": (0.0, 0.0, 30.0)}, "velocity"), ({"residual": 5.0}, "residual.*3.14 rad"),
     ({"velocity": None}, "velocity"), ({"effort": "x"}, "effort"), ({"parameters": 3}, "preset"),
     ({"individuals": 0}, "individuals"), ({"individuals": 10**30}, "individuals"),
     ({"robot": "hans"}, "robot: got")],
)  # fmt: skip
def test_wrong_arguments_are_refused(arguments: dict, field: str) -> None:
    with pytest.raises(NaoGaitError, match=field):
        gymnasium.make(WALK, **arguments)


@pytest.mark.parametrize(
    ("arguments", "field"),
    [({"seed": "x"}, "seed: got 'x'"), ({"seed": -1}, "seed: got -1"), ({"options": 3}, "options"),
     ({"options": {"individual": 0.5}}, "options.individual: got 0.5"),
     ({"options": {"individual": None}}, "options.individual: got None")],
)  # fmt: skip
def test_a_wrong_reset_is_refused(arguments: dict, field: str) -> None:
    env = gymnasium.make(WALK).unwrapped
    with pytest.raises(NaoGaitError, match=field):
        env.reset(**arguments)


def test_an_unknown_option_of_reset_is_refused() -> None:
    env = gymnasium.make(WALK)
    with pytest.raises(NaoGaitError, match="did you mean individual"):
        env.reset(seed=1, options={"individul": 7})


@pytest.mark.parametrize("action", [np.full(JOINTS, np.nan), np.full(JOINTS, 1.1), [0.0], "x"])
def test_an_action_out_of_bounds_is_refused(action: np.ndarray) -> None:
    env = gymnasium.make(WALK).unwrapped
    with pytest.raises(NaoGaitError, match="step: got 'no reset before it'"):
        env.step(action)
    env.reset(seed=0)
    with pytest.raises(NaoGaitError, match="action"):
        env.step(action)


@pytest.mark.parametrize(
    "imports", ["import gymnasium, nao_lipm_gait", "import nao_lipm_gait.gym, gymnasium"]
)
def test_an_import_registers_it(imports: str) -> None:
    code = f"{imports}; gymnasium.spec('{nao_lipm_gait.gym.WALK}')"
    subprocess.run([sys.executable, "-c", code], check=True)
