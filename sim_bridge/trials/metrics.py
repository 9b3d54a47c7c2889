"""How well a robot walked: `measure` turns a `Trace` into `Metrics`.

Speeds are mean velocities in the torso's own heading, with the yaw drift beside them: the
displacement over time would say nothing about a robot that walks in circles.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.geometry import rotate_each
from sim_bridge.ball import SHOE_HEIGHT
from sim_bridge.trials.trace import DOUBLE, LEFT, RIGHT, BoolArray, FloatArray, IntArray, Trace

LOADED = 2.0
"""[N] normal force from which a sole counts as loaded."""
FALL_TILT = math.radians(45.0)
"""[rad] torso tilt from which a robot has fallen."""
FALL_HEIGHT_SHARE = 0.5
"""Share of the standing torso height below which a robot has fallen."""
FLIGHT_LIMIT = 0.05
"""Largest share of ticks without a loaded sole that counts as walking."""
SLIP_LIMIT = 0.03
"""[m/s] largest mean speed of the loaded sole that counts as walking."""

_SOLE_OF_SUPPORT = {LEFT: 0, RIGHT: 1}


@dataclass(frozen=True, slots=True)
class Metrics:
    """What one walk scored over its window; NaN where nothing could be measured.

    Attributes:
        duration: [s] that was measured; shorter than the window after a fall.
        fell: The robot fell.
        fall_time: [s] since the first tick of the trace; None without a fall.
        speed_x: [m/s] mean forward velocity in the torso's heading.
        speed_y: [m/s] mean leftward velocity in the torso's heading.
        turn_rate: [rad/s] yaw gained over time: the speed of a turn, the drift of a straight walk.
        flight_share: Share of the ticks without a loaded sole.
        slip_speed: [m/s] mean horizontal speed of the loaded sole.
        contact_ticks: Ticks in which the legs touched each other.
        com_error_x: [m] mean |expected - true| CoM relative to the support foot, along Q's x.
        com_error_y: [m] the same along y.
        com_error_x_measured: [m] the paper's own error: mean |expected - measured| along Q's x.
        com_error_y_measured: [m] the same along y.
        saturated_share: Share of the ticks with a motor at its torque limit.
        support_changes: Changes of the support leg, as the gait has them.
        alarm_time: [s] since the first tick of the trace: when the gait reported a fall. An alarm
            that it withdrew before a fall does not count; None without one.
    """

    duration: float
    fell: bool
    fall_time: float | None
    speed_x: float
    speed_y: float
    turn_rate: float
    flight_share: float
    slip_speed: float
    contact_ticks: int
    com_error_x: float
    com_error_y: float
    com_error_x_measured: float
    com_error_y_measured: float
    saturated_share: float
    support_changes: int
    alarm_time: float | None

    @property
    def fall_lead(self) -> float | None:
        """[s] from the alarm to the fall; 0 without an alarm, None without a fall."""
        if self.fall_time is None:
            return None
        return 0.0 if self.alarm_time is None else self.fall_time - self.alarm_time

    @property
    def false_alarm(self) -> bool:
        """The gait reported a fall that did not happen."""
        return self.alarm_time is not None and not self.fell

    @property
    def walks(self) -> bool:
        """No fall, no hopping, no sliding, no contact between the legs."""
        return not self.faults

    @property
    def faults(self) -> tuple[str, ...]:
        """Why this does not count as walking: of `fall`, `flight`, `slip`, `contact`."""
        found = []
        if self.fell:
            found.append("fall")
        if not self.flight_share <= FLIGHT_LIMIT:
            found.append("flight")
        if not self.slip_speed <= SLIP_LIMIT:
            found.append("slip")
        if self.contact_ticks:
            found.append("contact")
        return tuple(found)


def yaw_of(quaternion: FloatArray) -> FloatArray:
    """Yaw [rad] of quaternions xyzw (..., 4), ZYX convention."""
    x, y, z, w = np.moveaxis(quaternion, -1, 0)
    return np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def tilt_of(quaternion: FloatArray) -> FloatArray:
    """Angle [rad] between the body's z axis and the vertical, for quaternions xyzw (..., 4)."""
    x, y, _, _ = np.moveaxis(quaternion, -1, 0)
    return np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0))


def velocity_in_heading(quaternion: FloatArray, velocity: FloatArray) -> FloatArray:
    """Velocities (t, 3) [m/s] in the body frame -> (t, 2) forward and left in its heading.

    The heading frame has the yaw of the body and a vertical z axis.
    """
    axis, w = quaternion[:, :3], quaternion[:, 3:]
    cross = np.cross(axis, velocity)
    in_world = velocity + 2.0 * (w * cross + np.cross(axis, cross))
    return np.stack(rotate_each(in_world[:, 0], in_world[:, 1], -yaw_of(quaternion)), axis=1)


def turn_rate(stamp: IntArray, quaternion: FloatArray) -> float:
    """Yaw gained per time [rad/s], over any number of turns."""
    if len(stamp) < 2:
        return math.nan
    yaw = np.unwrap(yaw_of(quaternion))
    return float((yaw[-1] - yaw[0]) / ((stamp[-1] - stamp[0]) * 1e-9))


def flight_share(sole_force: FloatArray) -> float:
    """Share of the ticks of known forces (t, 2) [N] with less than `LOADED` under both soles."""
    known = sole_force[np.isfinite(sole_force).all(axis=1)]
    return float(np.mean(np.all(known < LOADED, axis=1))) if len(known) else math.nan


def slip_speed(sole_force: FloatArray, sole_slip: FloatArray) -> float:
    """Mean horizontal speed [m/s] of the sole that carries more, over ticks where it is loaded."""
    if not len(sole_force):
        return math.nan
    ticks = np.arange(len(sole_force))
    bearer = np.argmax(sole_force, axis=1)
    loaded = sole_force[ticks, bearer] >= LOADED
    if not loaded.any():
        return math.nan
    slip = sole_slip[ticks, bearer][loaded]
    known = ~np.isnan(slip)  # a sole that has just landed has no slip yet
    return float(np.mean(slip[known])) if known.any() else math.nan


def soles_overlap(trace: Trace, outline: Sequence[tuple[float, float]]) -> BoolArray:
    """Ticks in which the soles overlap seen from above, and none is above the other's shoe.

    Two convex outlines are apart if all corners of one are outside an edge of the other.

    Args:
        trace: The walk.
        outline: Outline of the left sole in its frame [m], convex, counter-clockwise.

    Returns:
        (t,).
    """
    height = trace.sole_position[:, :, 2]
    beside = np.abs(height[:, 0] - height[:, 1]) < SHOE_HEIGHT
    if len(outline) < 3 or not beside.any():
        return np.zeros(len(trace), dtype=bool)
    left = np.array(outline)
    soles = (left, (left * (1.0, -1.0))[::-1])
    cos, sin = np.cos(trace.sole_yaw), np.sin(trace.sole_yaw)
    corners = []
    for side, points in enumerate(soles):
        turn = np.stack((cos[:, side], -sin[:, side], sin[:, side], cos[:, side]), axis=-1)
        turned = points @ turn.reshape(-1, 2, 2).transpose(0, 2, 1)
        corners.append(turned + trace.sole_position[:, None, side, :2])
    return beside & ~(_apart(corners[0], corners[1]) | _apart(corners[1], corners[0]))


def _apart(one: FloatArray, other: FloatArray) -> BoolArray:
    """(t,) where all of `other` (t, m, 2) is outside an edge of the outline `one` (t, n, 2)."""
    edge = np.roll(one, -1, axis=1) - one
    away = other[:, None, :, :] - one[:, :, None, :]
    across = edge[:, :, None, 0] * away[..., 1] - edge[:, :, None, 1] * away[..., 0]
    return np.asarray(np.any(np.all(across <= 0.0, axis=2), axis=1))


def fall_tick(
    torso_position: FloatArray, quaternion: FloatArray, standing_height: float
) -> int | None:
    """First row in which the torso tilts over 45 deg or sinks under half its standing height.

    Args:
        torso_position: (t, 3) [m] in the world.
        quaternion: (t, 4) xyzw of the torso.
        standing_height: [m] of the torso.

    Returns:
        Its index; None without a fall.
    """
    fallen = (tilt_of(quaternion) > FALL_TILT) | (
        torso_position[:, 2] < FALL_HEIGHT_SHARE * standing_height
    )
    return int(np.argmax(fallen)) if fallen.any() else None


def has_fallen(torso_position: FloatArray, quaternion: FloatArray, standing_height: float) -> bool:
    """`fall_tick` for one row, torso position (3,) [m] and quaternion xyzw (4,)."""
    x, y = float(quaternion[0]), float(quaternion[1])
    upright = 1.0 - 2.0 * (x * x + y * y)
    low = float(torso_position[2]) < FALL_HEIGHT_SHARE * standing_height
    return low or upright < math.cos(FALL_TILT)


def true_com_in_q(trace: Trace) -> FloatArray:
    """(t, 3) [m] the true CoM in Q at each `status_stamp`; NaN outside single support.

    The true support sole is placed in Q where the gait has its support sole. Only the sole's yaw is
    used, so that a tilted sole shows as an error of the CoM and not as a rotation of the world.
    """
    result = np.full((len(trace), 3), math.nan)
    row = np.searchsorted(trace.stamp, trace.status_stamp)
    row = np.minimum(row, len(trace) - 1)
    known = (trace.stamp[row] == trace.status_stamp) & (trace.support != DOUBLE)
    for support, side in _SOLE_OF_SUPPORT.items():
        ticks = np.flatnonzero(known & (trace.support == support))
        at = row[ticks]
        offset = trace.com[at] - trace.sole_position[at, side]
        sole = trace.support_sole_in_q[ticks]
        turn = sole[:, 2] - trace.sole_yaw[at, side]
        x, y = rotate_each(offset[:, 0], offset[:, 1], turn)
        result[ticks, 0], result[ticks, 1] = sole[:, 0] + x, sole[:, 1] + y
        result[ticks, 2] = offset[:, 2]
    return result


def _mean_abs(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.mean(np.abs(finite))) if len(finite) else math.nan


def measure(
    trace: Trace, start: float, end: float, outline: Sequence[tuple[float, float]] = ()
) -> Metrics:
    """Score a window of a trace.

    The first tick gives the standing height, so a trace begins with the robot standing. The whole
    trace is searched for a fall; nothing is measured after it.

    Args:
        trace: The walk.
        start: Start of the window [s since the first tick].
        end: End of the window [s since the first tick].
        outline: Outline of the left sole in its frame [m], convex, counter-clockwise. If given,
            soles also touch where their outlines overlap; these are larger than the plates that
            collide in the engines.

    Returns:
        The metrics.

    Raises:
        NaoGaitError: The trace is empty.
    """
    if not len(trace):
        raise NaoGaitError("trace", "no ticks", "at least one tick")
    height = float(trace.torso_position[0, 2])
    fall = fall_tick(trace.torso_position, trace.torso_quaternion, height)
    fall_time = None if fall is None else float(trace.time[fall])
    upto = end if fall_time is None else min(end, fall_time)
    window = trace.between(start, upto)
    period = float(np.diff(trace.stamp).mean()) * 1e-9 if len(trace) > 1 else 0.0

    if len(window):
        velocity = velocity_in_heading(window.torso_quaternion, window.torso_velocity).mean(axis=0)
        saturated = float(np.mean(window.saturated > 0))
    else:
        velocity, saturated = np.array((math.nan, math.nan)), math.nan
    # Truth is searched in the whole trace: at the window's start the sensors are older than it.
    time = trace.time
    ticks = (time >= start) & (time < upto) & (trace.support != DOUBLE)
    from_truth = (trace.com_expected_in_q - true_com_in_q(trace))[ticks]
    from_measured = (trace.com_expected_in_q - trace.com_measured_in_q)[ticks]
    return Metrics(
        duration=len(window) * period,
        fell=fall is not None,
        fall_time=fall_time,
        speed_x=float(velocity[0]),
        speed_y=float(velocity[1]),
        turn_rate=turn_rate(window.stamp, window.torso_quaternion),
        flight_share=flight_share(window.sole_force),
        slip_speed=slip_speed(window.sole_force, window.sole_slip),
        contact_ticks=int(np.count_nonzero(window.legs_touch | soles_overlap(window, outline))),
        com_error_x=_mean_abs(from_truth[:, 0]),
        com_error_y=_mean_abs(from_truth[:, 1]),
        com_error_x_measured=_mean_abs(from_measured[:, 0]),
        com_error_y_measured=_mean_abs(from_measured[:, 1]),
        saturated_share=saturated,
        support_changes=int(np.count_nonzero(np.diff(window.support))),
        alarm_time=alarm_time(trace, fall),
    )


def alarm_time(trace: Trace, fall: int | None) -> float | None:
    """[s] since the first tick: start of the alarm that leads to the fall; None without one.

    Without a fall (`fall`, its tick, is None) the first alarm counts.
    """
    if fall is None:
        return float(trace.time[np.argmax(trace.alarm)]) if trace.alarm.any() else None
    calm = np.flatnonzero(~trace.alarm[: fall + 1])
    begin = int(calm[-1]) + 1 if len(calm) else 0
    return float(trace.time[begin]) if begin <= fall else None
