"""Traces of walks that are computed, not simulated."""

from typing import Any

import numpy as np

from sim_bridge.trials.trace import LEFT, Trace

PERIOD = 10_000_000
HEIGHT = 0.33


def quaternion(roll: Any = 0.0, pitch: Any = 0.0, yaw: Any = 0.0) -> np.ndarray:
    """ZYX Euler angles, broadcast -> (t, 4) xyzw."""
    r, p, y = (np.asarray(angle, dtype=float) / 2 for angle in (roll, pitch, yaw))
    cr, sr, cp, sp, cy, sy = np.cos(r), np.sin(r), np.cos(p), np.sin(p), np.cos(y), np.sin(y)
    return np.stack(
        np.broadcast_arrays(
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ),
        axis=-1,
    )


def walk(ticks: int = 1000, **changes: Any) -> Trace:
    """A robot that stands still on both feet, except for what is changed."""
    values: dict[str, Any] = {
        "stamp": np.arange(ticks, dtype=np.int64) * PERIOD + 5 * PERIOD,
        "torso_position": np.tile((0.0, 0.0, HEIGHT), (ticks, 1)),
        "torso_quaternion": np.tile((0.0, 0.0, 0.0, 1.0), (ticks, 1)),
        "torso_velocity": np.zeros((ticks, 3)),
        "com": np.tile((0.0, 0.0, 0.26), (ticks, 1)),
        "sole_position": np.tile(((0.0, 0.05, 0.0), (0.0, -0.05, 0.0)), (ticks, 1, 1)),
        "sole_yaw": np.zeros((ticks, 2)),
        "sole_force": np.full((ticks, 2), 25.0),
        "sole_slip": np.zeros((ticks, 2)),
        "legs_touch": np.zeros(ticks, dtype=bool),
        "saturated": np.zeros(ticks, dtype=np.int64),
        "alarm": np.zeros(ticks, dtype=bool),
        "command": np.zeros((ticks, 3)),
        "odometry": np.zeros((ticks, 3)),
        "status_stamp": np.arange(ticks, dtype=np.int64) * PERIOD + PERIOD,
        "support": np.full(ticks, LEFT),
        "support_sole_in_q": np.tile((0.0, 0.05, 0.0), (ticks, 1)),
        "com_expected_in_q": np.tile((0.0, 0.0, 0.26), (ticks, 1)),
        "com_measured_in_q": np.tile((0.0, 0.0, 0.26), (ticks, 1)),
        "com_estimated_in_q": np.tile((0.0, 0.0, 0.26), (ticks, 1)),
    }
    return Trace(**{**values, **changes})
