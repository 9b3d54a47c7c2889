"""The swing foot stays smooth while the end of the step and the step size change."""

import math
from itertools import islice
from math import cos, sin

import numpy as np
import pytest

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.walks.swing_foot import SwingFoot
from sim_bridge.trials.rollout import RolloutSpec, make_pair
from sim_bridge.trials.tasks import walk
from sim_bridge.trials.trial import TimedCommands, run

DT = 0.01


def swing(changes: bool, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, z and pitch of a foot; with `changes`, t_e and the landing point move in every tick."""
    rng = np.random.default_rng(seed)
    foot = SwingFoot((-0.05, -0.05, 0.0), 0.02, 0.4, 0.95, toe_lift=0.5)
    left, landing, rows = 0.2, 0.05, [(-0.05, 0.0, 0.0)]
    while left > 1e-9:
        foot.move_towards((landing, -0.05, 0.1), min(DT, left), left)
        left -= min(DT, left)
        rows.append((foot.pose_in_q[0], foot.height, foot.pitch))
        if changes and left > 0.05:
            left += rng.uniform(-0.004, 0.004)
            landing += rng.uniform(-0.002, 0.002)
    way = np.array(rows)
    return way[:, 0], way[:, 1], way[:, 2]


def test_arrives_at_the_landing_pose_on_the_ground() -> None:
    foot = SwingFoot((0.0, -0.05, 0.0), 0.02, 0.4, 0.95)
    left = 0.2
    while left > 1e-9:
        foot.move_towards((0.06, -0.07, 0.3), min(DT, left), left)
        left -= DT
    assert foot.pose_in_q == pytest.approx((0.06, -0.07, 0.3))
    assert foot.height == 0.0


def test_lifts_to_the_wanted_height_and_keeps_it() -> None:
    _, height, _ = swing(changes=False)
    assert height.max() == pytest.approx(0.02)
    assert height[0] == height[-1] == 0.0
    assert np.count_nonzero(height > 0.0199) >= 3


@pytest.mark.parametrize("seed", range(10))
def test_never_jumps_when_the_plan_moves(seed: int) -> None:
    steady, steady_z, steady_pitch = swing(changes=False)
    moving, moving_z, moving_pitch = swing(changes=True, seed=seed)
    assert np.abs(np.diff(moving)).max() < 1.3 * np.abs(np.diff(steady)).max()
    assert np.abs(np.diff(moving_z)).max() < 1.5 * np.abs(np.diff(steady_z)).max()
    assert np.all(np.diff(moving) >= -1e-6)
    assert np.abs(np.diff(moving_pitch)).max() < 1.3 * np.abs(np.diff(steady_pitch)).max()


def test_a_landing_that_jumps_ahead_does_not_jerk_the_toes() -> None:
    foot = SwingFoot((-0.05, -0.05, 0.0), 0.02, 0.4, 0.95, toe_lift=0.5)
    left = 0.2
    while left > 0.1:
        foot.move_towards((0.05, -0.05, 0.0), DT, left)
        left -= DT
    before = foot.pitch
    foot.move_towards((0.15, -0.05, 0.0), DT, left)
    assert abs(foot.pitch - before) < 0.01, "0.05 rad more are wanted at once"


def pitches(way: float, yaw: float = 0.0) -> list[float]:
    """Of a sole that goes `way` [m] along its heading."""
    foot = SwingFoot((0.0, 0.0, yaw), 0.02, 0.4, 0.95, toe_lift=0.5)
    landing = (way * cos(yaw), way * sin(yaw), yaw)
    found, left = [foot.pitch], 0.2
    while left > 1e-9:
        foot.move_towards(landing, DT, left)
        left -= DT
        found.append(foot.pitch)
    return found


def test_even_turn_has_a_constant_rate_and_ends_where_the_sole_does() -> None:
    foot = SwingFoot((0.0, -0.05, -0.3), 0.02, 0.4, 0.9)
    even, ticks = [-0.3], 20
    for tick in range(ticks):
        foot.move_towards((0.0, -0.05, 0.5), DT, (ticks - tick) * DT)
        even.append(foot.pose_in_q[2] + foot.yaw_behind)
    np.testing.assert_allclose(np.diff(even), 0.8 / ticks)
    assert foot.yaw_behind == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.0])
def test_toes_go_up_halfway_and_lie_flat_at_both_ends(yaw: float) -> None:
    found = pitches(0.16, yaw)
    assert found[0] == found[-1] == 0.0
    assert min(found) == pytest.approx(-0.5 * 0.16, rel=0.02)
    assert max(found) <= 0.0
    assert abs(found[1]) < 0.1 * abs(min(found)), "the heel does not push off"


@pytest.mark.parametrize("landing", [(-0.1, 0.0, 0.0), (0.0, 0.05, 0.0), (0.0, 0.0, 0.5)])
def test_only_a_forward_step_lifts_the_toes(landing: tuple[float, float, float]) -> None:
    foot = SwingFoot((0.0, 0.0, 0.0), 0.02, 0.4, 0.95, toe_lift=0.5)
    for left in (0.2, 0.19, 0.1, 0.09):
        foot.move_towards(landing, DT, left)
        assert foot.pitch == 0.0


def lowest_toes(toe_lift: float) -> float:
    """[m] above the floor, of feet that are well in the air; mean over the strides of a walk."""
    parameters = GaitParameters(swing_toe_lift=toe_lift)
    task = walk("forward", x=0.35, axis="x")
    spec = RolloutSpec(task, robot_seed=3, parameters=parameters, engine="mujoco")
    simulation, gait = make_pair(spec)
    toe = np.array((0.1, 0.0, 0.0))
    lowest = [math.inf]
    try:
        for tick in islice(run(simulation, gait, TimedCommands(spec.task.command_at)), 700, 1000):
            assert not tick.fallen
            left = tick.truth.soles[0]
            if left.position[2] < 0.01:
                lowest.append(math.inf)
            else:
                toes = float((left.position + left.rotation @ toe)[2])
                lowest[-1] = min(lowest[-1], toes)
    finally:
        simulation.close()
    found = [height for height in lowest if height < math.inf]
    assert len(found) >= 5
    return float(np.mean(found))


def test_lifted_toes_clear_the_floor() -> None:
    pytest.importorskip("mujoco")
    assert lowest_toes(0.5) > lowest_toes(0.0) + 0.003
