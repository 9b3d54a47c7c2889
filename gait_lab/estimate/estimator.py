"""The gait's estimators over a recorded walk.

Where they differ from a tick of the gait, it is because a log is known as a whole, and no walk says
which foot stands: the forces say how much each sole carries. A foot that carries all the weight
gives way and tilts, while two loaded soles lie flat; so the soles correct the tilt as far as both
are loaded. The vertical is the mean of the filter's forward and its backward run. The gyro's bias
and the constant tilt of the soles are those of the longest quiet stand of the log.
"""

from dataclasses import dataclass
from math import atan2

import numpy as np

from gait_lab.estimate.recorded_body import RecordedBody
from gait_lab.estimate.sensor_log import SensorLog
from nao_lipm_gait.estimation.com_measurement import level_frame
from nao_lipm_gait.estimation.odometry import Odometry
from nao_lipm_gait.estimation.state_estimator import ACCELEROMETER_TIME
from nao_lipm_gait.estimation.torso_orientation import TorsoOrientation
from nao_lipm_gait.estimation.yaw_slip import YawOverSole, YawSlipFromYawGyro
from nao_lipm_gait.whole_body.body_model import SolePose
from robot_core.geometry import compose, planar_rotation
from robot_core.types import GRAVITY, LEFT, RIGHT, FloatArray, Point3

STANCE_TIME = 0.1
"""Time constant [s] of the correction of the tilt by two equally loaded soles."""
QUIET_WINDOW = 0.5
"""[s] windows in which a quiet stand is looked for."""
QUIET_RATE, QUIET_FORCE = 0.03, 1.0
"""Largest deviations of gyro [rad/s] and accelerometer [m/s^2] in a window of a quiet stand."""
QUIET_GRAVITY = 0.5
"""[m/s^2] Largest difference of the mean specific force from gravity in it."""
UNLOADED = 0.01
"""[m] height above the other one of a sole that carries nothing, where no forces were recorded."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """t samples; the world has its origin under the first pose of the base, looking along x.

    Attributes:
        up: (t, 3) unit vertical in the base.
        position: (t, 3) [m] of the base: on the ground, and its height above the support sole.
        yaw: (t,) [rad] of the base, without jumps.
        com: (t, 3) [m] in the world, above the support sole.
        load_share: (t,) share of the weight on the left sole.
        quiet_time: [s] of the longest quiet stand; 0 = none.
        yaw_by_gyro: A yaw gyro tells how the feet turn on the ground.
    """

    up: FloatArray
    position: FloatArray
    yaw: FloatArray
    com: FloatArray
    load_share: FloatArray
    quiet_time: float
    yaw_by_gyro: bool


class _Kinematics:
    """CoM and soles of each sample in the base."""

    def __init__(self, log: SensorLog, body: RecordedBody) -> None:
        self.com: list[Point3] = []
        self.soles: list[tuple[SolePose, SolePose]] = []
        for position in log.joint_position:
            com, left, right = body.set_joints(position)
            self.com.append(com)
            self.soles.append((left, right))
        self.normals: FloatArray = np.array(
            [[sole.normal for sole in pair] for pair in self.soles]
        )  # (t, 2, 3)


def estimate(log: SensorLog, body: RecordedBody) -> Estimate:
    """Estimate a recorded walk.

    Args:
        log: Recorded sensors.
        body: Body with the joints of the log.
    """
    kinematics = _Kinematics(log, body)
    rate = log.angular_velocity @ body.imu_rotation.T
    force = log.specific_force @ body.imu_rotation.T
    quiet = quiet_stand(log.time, rate, force)
    normals, has_yaw_gyro = kinematics.normals.copy(), bool(np.ptp(rate[:, 2]) > 0.0)
    if quiet.stop:
        rate = rate - rate[quiet].mean(axis=0)
        up = force[quiet].mean(axis=0)
        normals += up / np.linalg.norm(up) - normals[quiet].mean(axis=0)
    share = _load_share(log, kinematics)
    rate[1:] = 0.5 * (rate[1:] + rate[:-1])  # mean since the last sample
    vertical = _vertical(log.time, rate, force, normals, share)
    return _moved(log.time, kinematics, vertical, share, quiet, rate if has_yaw_gyro else None)


def by_legs_alone(log: SensorLog, body: RecordedBody) -> Estimate:
    """The same without IMU: the more loaded sole lies flat and stands still."""
    kinematics = _Kinematics(log, body)
    share = _load_share(log, kinematics)
    vertical = np.where(share[:, None] > 0.5, kinematics.normals[:, 0], kinematics.normals[:, 1])
    return _moved(log.time, kinematics, vertical, share, slice(0, 0), None)


def quiet_stand(time: FloatArray, rate: FloatArray, force: FloatArray) -> slice:
    """The samples of the longest quiet stand of a log; none if there is none."""
    longest, begin, at = slice(0, 0), 0, 0
    while (end := int(np.searchsorted(time, time[at] + QUIET_WINDOW))) < len(time):
        window = slice(at, end)
        deviation = float(rate[window].std(axis=0).max()), float(force[window].std(axis=0).max())
        heavy = abs(float(np.linalg.norm(force[window].mean(axis=0))) - GRAVITY)
        if deviation[0] > QUIET_RATE or deviation[1] > QUIET_FORCE or heavy > QUIET_GRAVITY:
            begin = end
        elif end - begin > longest.stop - longest.start:
            longest = slice(begin, end)
        at = end
    return longest


def _load_share(log: SensorLog, kinematics: _Kinematics) -> FloatArray:
    """(t,) share of the weight on the left sole; without forces by which sole is lower."""
    if log.load is not None:
        load = np.maximum(log.load, 0.0)
        whole = load.sum(axis=1)
        return np.where(whole > 0.0, load[:, 0] / np.where(whole > 0.0, whole, 1.0), 0.5)
    shares = []
    for left, right in kinematics.soles:
        higher = left.position[2] - right.position[2]
        shares.append(0.5 - 0.5 * higher / UNLOADED)
    return np.clip(np.array(shares), 0.0, 1.0)


def _vertical(
    time: FloatArray, rate: FloatArray, force: FloatArray, normals: FloatArray, share: FloatArray
) -> FloatArray:
    """(t, 3) unit vertical in the base: the mean of a forward and a backward run."""
    orientation = TorsoOrientation(ACCELEROMETER_TIME, STANCE_TIME)
    orientation.reset(tuple(force[time < time[0] + QUIET_WINDOW].mean(axis=0).tolist()))
    steps = np.diff(time, prepend=time[0] - (time[1] - time[0]))
    normal = share[:, None] * normals[:, 0] + (1.0 - share[:, None]) * normals[:, 1]
    flat = 4.0 * share * (1.0 - share)
    sums = np.zeros((len(time), 3))
    # The backward run begins with the state, and the age, with which the forward run ends.
    for indices, turn in ((range(len(time)), 1.0), (range(len(time) - 1, -1, -1), -1.0)):
        for index in indices:
            later = min(index + 1, len(time) - 1)  # backward, the step before is the next one
            step = steps[index] if turn > 0.0 else steps[later]
            turning = rate[index] if turn > 0.0 else -rate[later]
            weight = float(flat[index])
            if weight > 0.0:
                orientation.set_stance_time(max(STANCE_TIME / weight, float(step)))
            orientation.update(
                tuple(turning.tolist()), tuple(force[index].tolist()),
                tuple(normal[index].tolist()) if weight > 0.0 else None, float(step),
            )  # fmt: skip
            sums[index] += orientation.up_in_torso
    return sums / np.linalg.norm(sums, axis=1)[:, None]


def _moved(
    time: FloatArray, kinematics: _Kinematics, vertical: FloatArray, share: FloatArray,
    quiet: slice, rate: FloatArray | None,
) -> Estimate:  # fmt: skip
    """Odometry and CoM; at the `quiet` samples nothing turns; `rate` None: no yaw gyro."""
    odometry, over_sole, slip_by_gyro = Odometry(), YawOverSole(), YawSlipFromYawGyro()
    position, yaw, com = [], [], []
    for index in range(len(time)):
        up = tuple(vertical[index].tolist())
        dt = float(time[index] - time[index - 1]) if index else float(time[1] - time[0])
        support = LEFT if share[index] > 0.5 else RIGHT
        left, right = kinematics.soles[index]
        sole, other = (left, right) if support == LEFT else (right, left)
        level = level_frame(sole, up)
        turned, slip = over_sole.update(support, level, other), 0.0
        if rate is not None:
            slip = slip_by_gyro.update(
                turned, up, tuple(rate[index].tolist()), dt, quiet=False,
                at_rest=quiet.start <= index < quiet.stop,
            )
        odometry.update(support, level, other, dt, slip)
        x, y, z = level.coordinates((0.0, 0.0, 0.0))
        base = compose(odometry.support_sole_in_odom, (x, y, level.torso_yaw))
        position.append((base[0], base[1], z))
        yaw.append(base[2])
        x, y, z = level.coordinates(kinematics.com[index])
        com.append((*compose(odometry.support_sole_in_odom, (x, y, 0.0))[:2], z))
    return _from_the_first(
        np.array(position), np.unwrap(yaw), np.array(com), vertical, share,
        float(time[quiet.stop] - time[quiet.start]), rate is not None,
    )  # fmt: skip


def _from_the_first(
    position: FloatArray, yaw: FloatArray, com: FloatArray, vertical: FloatArray,
    share: FloatArray, quiet_time: float, yaw_by_gyro: bool,
) -> Estimate:  # fmt: skip
    """Everything in the world that begins under the base."""
    turn = planar_rotation(-yaw[0])
    origin = position[0, :2].copy()
    for points in (position, com):
        points[:, :2] = (points[:, :2] - origin) @ turn.T
    return Estimate(vertical, position, yaw - yaw[0], com, share, quiet_time, yaw_by_gyro)


def roll_and_pitch(up: FloatArray) -> FloatArray:
    """(t, 2) [rad] REP-103 roll and pitch of a base in which the vertical is `up` (t, 3)."""
    roll = [atan2(y, z) for _, y, z in up.tolist()]
    return np.stack([np.array(roll), -np.arcsin(np.clip(up[:, 0], -1.0, 1.0))], axis=1)
