"""The swing foot stays smooth while the end of the step and the step size move."""

import numpy as np
import pytest

from nao_lipm_gait.lipm_walk.swing_foot import SwingFoot

DT = 0.01


def swing(changes: bool, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Way (x, z) of a foot; with `changes`, t_e and the landing point move in every tick."""
    rng = np.random.default_rng(seed)
    foot = SwingFoot((-0.05, -0.05, 0.0), 0.02, 0.4, 0.95)
    left, landing, rows = 0.2, 0.05, [(-0.05, 0.0)]
    while left > 1e-9:
        foot.move_towards((landing, -0.05, 0.1), min(DT, left), left)
        left -= min(DT, left)
        rows.append((foot.pose_in_q[0], foot.height))
        if changes and left > 0.05:
            left += rng.uniform(-0.004, 0.004)
            landing += rng.uniform(-0.002, 0.002)
    way = np.array(rows)
    return way[:, 0], way[:, 1]


def test_arrives_at_the_landing_pose_on_the_ground() -> None:
    foot = SwingFoot((0.0, -0.05, 0.0), 0.02, 0.4, 0.95)
    left = 0.2
    while left > 1e-9:
        foot.move_towards((0.06, -0.07, 0.3), min(DT, left), left)
        left -= DT
    assert foot.pose_in_q == pytest.approx((0.06, -0.07, 0.3))
    assert foot.height == 0.0


def test_lifts_to_the_wanted_height_and_keeps_it() -> None:
    _, height = swing(changes=False)
    assert height.max() == pytest.approx(0.02)
    assert height[0] == height[-1] == 0.0
    assert np.count_nonzero(height > 0.0199) >= 3


@pytest.mark.parametrize("seed", range(10))
def test_never_jumps_when_the_plan_moves(seed: int) -> None:
    steady, steady_z = swing(changes=False)
    moving, moving_z = swing(changes=True, seed=seed)
    assert np.abs(np.diff(moving)).max() < 1.3 * np.abs(np.diff(steady)).max()
    assert np.abs(np.diff(moving_z)).max() < 1.5 * np.abs(np.diff(steady_z)).max()
    assert np.all(np.diff(moving) >= -1e-6)
