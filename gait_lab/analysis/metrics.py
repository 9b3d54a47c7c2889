"""How well a robot walked, from ground truth: metrics that cannot flatter.

No physics engine and no ROS in here: a `Trace` of arrays at the control rate goes in, `Metrics`
come out. Speeds are taken in the torso's own heading, so a robot that walks in circles shows its
speed and, beside it, its yaw drift.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from nao_lipm_gait.errors import NaoGaitError
from sim_bridge.ball import SHOE_HEIGHT

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

LOADED = 2.0
"""Normal force from which a sole counts as loaded [N]."""
FALL_TILT = math.radians(45.0)
"""Torso tilt from which a robot has fallen [rad]."""
FALL_HEIGHT_SHARE = 0.5
"""Share of the standing torso height below which a robot has fallen."""
FLIGHT_LIMIT = 0.05
"""Largest share of ticks without a loaded sole that is still walking."""
SLIP_LIMIT = 0.03
"""Largest mean speed of the loaded sole that is still walking [m/s]."""

DOUBLE, LEFT, RIGHT = 0, 1, 2
ALARM_STATES = frozenset({"fallen"})
"""States of the gait that say that the robot falls or has fallen."""
SUPPORT_CODES = {"double": DOUBLE, "left": LEFT, "right": RIGHT}
_SOLE_OF_SUPPORT = {LEFT: 0, RIGHT: 1}


@dataclass(frozen=True, slots=True)
class Trace:
    """Ground truth and gait status of one walk, one row per control tick (t rows).

    Pairs are left, right. Frames: `world` has z up; `torso` is the torso link; Q is the gait's own
    coordinate system of the single support phase, on the ground plane.
    """

    stamp: IntArray
    """(t,) [ns] strictly rising."""
    torso_position: FloatArray
    """(t, 3) [m] in world."""
    torso_quaternion: FloatArray
    """(t, 4) xyzw, torso to world."""
    torso_velocity: FloatArray
    """(t, 3) [m/s] in the torso frame."""
    com: FloatArray
    """(t, 3) [m] in world."""
    sole_position: FloatArray
    """(t, 2, 3) [m] in world."""
    sole_yaw: FloatArray
    """(t, 2) [rad] in world."""
    sole_force: FloatArray
    """(t, 2) [N] normal force."""
    sole_slip: FloatArray
    """(t, 2) [m/s] horizontal speed."""
    legs_touch: BoolArray
    """(t,) the legs touch each other."""
    saturated: IntArray
    """(t,) number of motors at their torque limit."""
    alarm: BoolArray
    """(t,) the gait says that it falls or has fallen."""
    command: FloatArray
    """(t, 3) asked velocity [m/s, m/s, rad/s]."""
    odometry: FloatArray
    """(t, 3) the gait's own base_footprint in odom [m, m, rad]; NaN before the first frame."""
    status_stamp: IntArray
    """(t,) [ns] sampling time that the gait's values belong to; -1 before the first frame."""
    support: IntArray
    """(t,) DOUBLE, LEFT or RIGHT: the support leg as the gait has it."""
    support_sole_in_q: FloatArray
    """(t, 3) sole frame of the support leg in Q [m, m, rad]; NaN without single support."""
    com_expected_in_q: FloatArray
    """(t, 3) [m]."""
    com_measured_in_q: FloatArray
    """(t, 3) [m]."""
    com_estimated_in_q: FloatArray
    """(t, 3) [m]."""

    def __post_init__(self) -> None:
        ticks = len(self.stamp)
        for field in fields(self):
            rows = len(getattr(self, field.name))
            if rows != ticks:
                raise NaoGaitError(f"trace.{field.name}", f"{rows} rows", f"{ticks} rows")
        if ticks > 1 and not np.all(np.diff(self.stamp) > 0):
            raise NaoGaitError("trace.stamp", "one that does not rise", "strictly rising stamps")

    def __len__(self) -> int:
        return len(self.stamp)

    @property
    def time(self) -> FloatArray:
        """(t,) seconds since the first tick."""
        return (self.stamp - self.stamp[0]) * 1e-9

    def between(self, start: float, end: float) -> "Trace":
        """The ticks with start <= time < end [s since the first tick]."""
        time = self.time
        # Half a tick of slack: the ends are sums of floats, the ticks are integers.
        slack = 0.5e-9 * float(np.diff(self.stamp).min()) if len(self) > 1 else 0.0
        return self[(time >= start - slack) & (time < end - slack)]

    def __getitem__(self, rows: BoolArray | slice) -> "Trace":
        return Trace(**{field.name: getattr(self, field.name)[rows] for field in fields(self)})


@dataclass(frozen=True, slots=True)
class Metrics:
    """What one walk scored over its window; NaN where nothing could be measured."""

    duration: float
    """[s] that was measured; shorter than asked after a fall."""
    fell: bool
    fall_time: float | None
    """[s] since the first tick of the trace."""
    speed_x: float
    """Mean forward velocity in the torso's heading [m/s]."""
    speed_y: float
    """Mean leftward velocity in the torso's heading [m/s]."""
    turn_rate: float
    """Yaw gained per time [rad/s]: the speed of a turn, the drift of a straight walk."""
    flight_share: float
    """Share of ticks with no loaded sole."""
    slip_speed: float
    """Mean horizontal speed of the loaded sole [m/s]."""
    contact_ticks: int
    """Ticks in which the legs touched each other."""
    com_error_x: float
    """Mean |expected - true| CoM relative to the support foot, along Q's x [m]."""
    com_error_y: float
    """The same along y [m]."""
    com_error_x_measured: float
    """The paper's own error: mean |expected - measured| along Q's x [m]."""
    com_error_y_measured: float
    """The same along y [m]."""
    saturated_share: float
    """Share of ticks with a motor at its torque limit."""
    support_changes: int
    """Changes of the support leg, as the gait has them."""
    alarm_time: float | None
    """[s] since the first tick of the trace: when the gait said that it falls; what it took back
    before the robot fell counts only where none fell."""

    @property
    def fall_lead(self) -> float | None:
        """How long before the fall the gait said so [s]; 0 if it did not; None without a fall."""
        if self.fall_time is None:
            return None
        return 0.0 if self.alarm_time is None else self.fall_time - self.alarm_time

    @property
    def false_alarm(self) -> bool:
        """The gait said that it falls, and it did not."""
        return self.alarm_time is not None and not self.fell

    @property
    def walks(self) -> bool:
        """True for walking: no hopping, no skating, no leg against leg."""
        return not self.faults

    @property
    def faults(self) -> tuple[str, ...]:
        """What keeps this from being an honest walk."""
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
    """Velocities (t, 3) in the body frame -> (t, 2) forward and left in the body's heading.

    The heading frame has the yaw of the body and a vertical z axis.
    """
    axis, w = quaternion[:, :3], quaternion[:, 3:]
    cross = np.cross(axis, velocity)
    in_world = velocity + 2.0 * (w * cross + np.cross(axis, cross))
    yaw = yaw_of(quaternion)
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.stack(
        (cos * in_world[:, 0] + sin * in_world[:, 1], cos * in_world[:, 1] - sin * in_world[:, 0]),
        axis=1,
    )


def turn_rate(stamp: IntArray, quaternion: FloatArray) -> float:
    """Yaw gained per time [rad/s], over any number of turns."""
    if len(stamp) < 2:
        return math.nan
    yaw = np.unwrap(yaw_of(quaternion))
    return float((yaw[-1] - yaw[0]) / ((stamp[-1] - stamp[0]) * 1e-9))


def flight_share(sole_force: FloatArray) -> float:
    """Share of ticks with less than `LOADED` under both soles; forces (t, 2) [N]."""
    if not len(sole_force):
        return math.nan
    return float(np.mean(np.all(sole_force < LOADED, axis=1)))


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
    """(t,) ticks in which the soles overlap, seen from above, and none is above the other's shoe.

    Two convex outlines are apart if an edge of one has all corners of the other outside.
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
    """(t,) where an edge of the outline `one` (t, n, 2) has all of `other` (t, m, 2) outside."""
    edge = np.roll(one, -1, axis=1) - one
    away = other[:, None, :, :] - one[:, :, None, :]
    across = edge[:, :, None, 0] * away[..., 1] - edge[:, :, None, 1] * away[..., 0]
    return np.asarray(np.any(np.all(across <= 0.0, axis=2), axis=1))


def fall_tick(
    torso_position: FloatArray, quaternion: FloatArray, standing_height: float
) -> int | None:
    """First row in which the torso tilts over 45 deg or sinks under half its standing height."""
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
    """(t, 3) the true CoM in Q [m] at each `status_stamp`; NaN outside single support.

    The true support sole ties the two worlds together: it is put where the gait believes that its
    support sole is in Q. Only the sole's yaw is used, so that a sole that tilts shows as an error
    of the CoM and not as a rotation of the world.
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
        cos, sin = np.cos(turn), np.sin(turn)
        result[ticks, 0] = sole[:, 0] + cos * offset[:, 0] - sin * offset[:, 1]
        result[ticks, 1] = sole[:, 1] + sin * offset[:, 0] + cos * offset[:, 1]
        result[ticks, 2] = offset[:, 2]
    return result


def _mean_abs(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.mean(np.abs(finite))) if len(finite) else math.nan


def measure(
    trace: Trace, start: float, end: float, outline: Sequence[tuple[float, float]] = ()
) -> Metrics:
    """Score the window start..end [s since the first tick] of a trace.

    outline: of the left sole in its frame [m], convex, counter-clockwise. With it soles also touch
    where their outlines overlap, which are larger than the plates that collide in the engines.

    The first tick gives the standing height, so a trace begins with the robot standing. A fall is
    looked for in the whole trace; from the fall on nothing is measured any more.
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
    # Truth is looked up in the whole trace: at the window's start the sensors are older than it.
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
    """[s] since the first tick: of the alarm in whose course the robot fell in the tick `fall`, or
    of the first one if it did not fall; None without one.
    """
    if fall is None:
        return float(trace.time[np.argmax(trace.alarm)]) if trace.alarm.any() else None
    calm = np.flatnonzero(~trace.alarm[: fall + 1])
    begin = int(calm[-1]) + 1 if len(calm) else 0
    return float(trace.time[begin]) if begin <= fall else None
