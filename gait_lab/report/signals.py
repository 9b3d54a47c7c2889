"""Signals of a recorded walk: the innovation of the observer, joints and motors, timing."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_lab.analysis.recorded_trace import SupportPhase, supports_at
from gait_lab.analysis.recorded_walk import RecordedWalk
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray
from sim_bridge.individual import draw_individual
from sim_bridge.motors import TorqueLimits
from sim_bridge.plant import load_plant
from sim_bridge.robot import SATURATED
from sim_bridge.trials.trace import DOUBLE, IntArray

LAG = 1.0
"""[s] up to which the autocorrelation is shown."""
FEWEST = 200
"""Smallest number of ticks for an autocorrelation."""


@dataclass(frozen=True, slots=True)
class Innovation:
    """The innovation: measured minus expected CoM in Q, in single support.

    The innovation of a good observer is white noise. A constant part or a rhythm shows an error of
    the model: joint zeros, a wrong delay, a rocking torso.

    Attributes:
        stamp: (t,) [ns].
        value: (t, 2) [m].
        mean: [m].
        deviation: [m].
        lag: (l,) [s].
        correlation: (l, 2), 1 at lag 0; empty with too few ticks.
        band: 95 % of the correlations of white noise are within +-band.
        inside: Share of the lags over 0 that are within the band.
    """

    stamp: IntArray
    value: FloatArray
    mean: tuple[float, float]
    deviation: tuple[float, float]
    lag: FloatArray
    correlation: FloatArray
    band: float
    inside: tuple[float, float]


def find_innovation(walk: RecordedWalk, phases: tuple[SupportPhase, ...]) -> Innovation | None:
    """The innovation; None without expected or measured CoM, or without a single support."""
    if not (len(walk.expected) and len(walk.measured)):
        return None
    stamp = walk.expected.stamp
    if phases:
        stamp = stamp[supports_at(phases, stamp) != DOUBLE]
    value = (walk.measured.at(stamp) - walk.expected.at(stamp))[:, :2]
    known = np.isfinite(value).all(axis=1)
    stamp, value = stamp[known], value[known]
    if len(stamp) < 2:
        return None
    count = len(stamp)
    lags = round(LAG * 1e9 / max(1, walk.period)) if count >= FEWEST else 0
    correlation = np.empty((0, 2))
    inside = (float("nan"), float("nan"))
    band = 1.96 / np.sqrt(count)
    if lags and lags < count:
        correlation = np.stack([autocorrelation(column, lags) for column in value.T], axis=1)
        share = (np.abs(correlation[1:]) <= band).mean(axis=0)
        inside = float(share[0]), float(share[1])
    mean, deviation = value.mean(axis=0), value.std(axis=0)
    return Innovation(
        stamp=stamp,
        value=value,
        mean=(float(mean[0]), float(mean[1])),
        deviation=(float(deviation[0]), float(deviation[1])),
        lag=np.arange(len(correlation), dtype=float) * (walk.period * 1e-9),
        correlation=correlation,
        band=float(band),
        inside=inside,
    )


def autocorrelation(values: FloatArray, lags: int) -> FloatArray:
    """(lags + 1,) of (t,) values about their mean; 1 at lag 0."""
    centred = values - values.mean()
    size = 1 << (2 * len(values) - 1).bit_length()
    power = np.abs(np.fft.rfft(centred, size)) ** 2
    result = np.fft.irfft(power, size)[: lags + 1]
    return np.asarray(result / result[0] if result[0] > 0.0 else np.eye(1, lags + 1)[0])


LONGEST_LAG = 0.2
"""[s] largest lag of a joint behind its target that is searched."""

STILL = 0.01
"""[rad] standard deviation of a target below which the joint's lag is unknown."""


@dataclass(frozen=True, slots=True)
class JointUse:
    """One joint over the whole bag.

    Attributes:
        tracking: RMS of target minus angle, the lag taken out [rad]; NaN without targets.
        lag: [s] from target sent to the angle that fits it best; NaN without motion.
        torque_share: Largest share of the torque that the motor has at that speed; NaN without
            efforts.
        torque_saturated: Share of the ticks at the torque limit.
        speed_share: Largest share of the joint's speed limit.
        speed_saturated: Share of the ticks in which the target asks for more than the joint's
            speed.
    """

    name: str
    tracking: float
    lag: float
    torque_share: float
    torque_saturated: float
    speed_share: float
    speed_saturated: float


@dataclass(frozen=True, slots=True)
class MotorUse:
    """All joints of the robot.

    Attributes:
        stamp: (t,) [ns].
        torque: (t, n) share of the torque limit.
        saturated: (t,) number of motors at their torque limit.
    """

    joints: tuple[JointUse, ...]
    stamp: IntArray
    torque: FloatArray
    saturated: FloatArray

    @property
    def saturated_share(self) -> float:
        """Share of the ticks with any motor at its torque limit; NaN without efforts."""
        known = np.isfinite(self.torque).any(axis=1)
        return float((self.saturated[known] > 0).mean()) if known.any() else float("nan")


def motor_use(walk: RecordedWalk, robot: RobotDescription) -> MotorUse:
    """All joints, against the nominal motors of the reference plant: a bag names no individual."""
    columns = [walk.joint_names.index(name) for name in robot.joint_names]
    velocity, effort = walk.velocity.value[:, columns], walk.effort.value[:, columns]
    plant = load_plant("reference")
    limits = TorqueLimits(robot, plant, draw_individual(plant, robot, -1))
    torque = np.full(effort.shape, np.nan)
    leaders = dict((follower, leader) for leader, follower in robot.coupled_joints)
    for row in range(len(effort)):
        lowest, highest = limits.span(np.nan_to_num(velocity[row]))
        limit = np.where(effort[row] < 0.0, -lowest, highest)
        torque[row] = np.abs(effort[row]) / np.where(limit > 0.0, limit, np.nan)
    period = max(1, walk.period) * 1e-9
    joints = []
    for index, name in enumerate(robot.joint_names):
        if name in leaders:
            continue
        tracking, lag, fast = _tracking(walk, name, robot.velocity_limit[index], period)
        joints.append(
            JointUse(
                name,
                tracking,
                lag,
                _largest(torque[:, index]),
                _share(torque[:, index] >= SATURATED, torque[:, index]),
                _largest(np.abs(velocity[:, index]) / robot.velocity_limit[index]),
                fast,
            )
        )
    return MotorUse(
        tuple(joints), walk.effort.stamp, torque, (torque >= SATURATED).sum(axis=1).astype(float)
    )


def _tracking(
    walk: RecordedWalk, name: str, limit: float, period: float
) -> tuple[float, float, float]:
    """RMS error [rad], lag [s], share of ticks with a target beyond the joint's speed."""
    if name not in walk.target_names or len(walk.targets) < 10:
        return float("nan"), float("nan"), float("nan")
    target = walk.targets.value[:, walk.target_names.index(name)]
    measured = walk.position.value[:, walk.joint_names.index(name)]
    # A target takes effect when it arrives; its stamp is that of the older sensors.
    sent = (walk.targets.stamp + walk.age - walk.origin) * 1e-9
    time = (walk.position.stamp - walk.origin) * 1e-9
    if float(np.nanstd(target)) < STILL:
        error = measured - np.interp(time, sent, target)
        return float(np.sqrt(np.nanmean(error**2))), float("nan"), 0.0
    best = (np.inf, 0.0)
    for lag in np.arange(0.0, LONGEST_LAG, period):
        inside = (time >= sent[0] + lag) & (time <= sent[-1] + lag)
        if inside.sum() < 10:
            break
        error = measured[inside] - np.interp(time[inside] - lag, sent, target)
        best = min(best, (float(np.sqrt(np.nanmean(error**2))), float(lag)))
    fast = np.abs(np.diff(target)) > limit * np.maximum(np.diff(walk.targets.stamp) * 1e-9, period)
    return best[0], best[1], float(fast.mean())


def _largest(values: FloatArray) -> float:
    return float(np.nanmax(values)) if np.isfinite(values).any() else float("nan")


def _share(hits: NDArray[np.bool_], values: FloatArray) -> float:
    known = np.isfinite(values)
    return float(hits[known].mean()) if known.any() else float("nan")


@dataclass(frozen=True, slots=True)
class Timing:
    """Timing of sensors and answers; in seconds unless noted otherwise.

    Attributes:
        unanswered: Joint states without a joint_command of the same stamp.
        age: Median age of a joint state when it was recorded; NaN if none has a stamp.
        answer: (t,) from a joint state's recording to that of its answer.
        interval_time: (t,) on the report's axis.
        interval: (t,) between two joint states.
        tick_time: (d,) on the report's axis.
        tick: (d, 2) the gait's own p50 and p99 [us] of one tick, from its diagnostics.
    """

    period: float
    missed: int
    unanswered: int
    age: float
    answer: FloatArray
    interval_time: FloatArray
    interval: FloatArray
    tick_time: FloatArray
    tick: FloatArray


def find_timing(walk: RecordedWalk) -> Timing | None:
    """The timing; None without joint states."""
    joints = walk.position
    if len(joints) < 2 or not walk.period:
        return None
    gaps = np.diff(joints.stamp)
    ticks = np.maximum(1, np.rint(gaps / walk.period))
    unanswered, answer = 0, np.empty(0)
    if len(walk.targets):
        first, last = walk.targets.stamp[0], walk.targets.stamp[-1]
        asked = (joints.stamp >= first) & (joints.stamp <= last)
        row = np.searchsorted(walk.targets.stamp, joints.stamp[asked])
        found = walk.targets.stamp[row] == joints.stamp[asked]
        unanswered = int((~found).sum())
        answer = (walk.targets.arrived[row] - joints.arrived[asked])[found] * 1e-9
    age = (joints.arrived - joints.stamp) * 1e-9
    ticked = [
        (float(walk.seconds(stamp)), p50, p99)
        for stamp, values in walk.diagnostics
        if (p50 := _number(values.get("tick p50 [us]"))) is not None
        and (p99 := _number(values.get("tick p99 [us]"))) is not None
    ]
    table = np.array(ticked) if ticked else np.empty((0, 3))
    return Timing(
        period=walk.period * 1e-9,
        missed=int((ticks - 1).sum()),
        unanswered=unanswered,
        age=float(np.median(age)) if age.any() else float("nan"),
        answer=answer,
        interval_time=walk.seconds(joints.stamp[1:]),
        interval=gaps * 1e-9,
        tick_time=table[:, 0],
        tick=table[:, 1:],
    )


def _number(text: str | None) -> float | None:
    try:
        return float(text) if text else None
    except ValueError:
        return None
