"""Everything that is measured in one bag; a missing topic costs only its part."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gait_lab.analysis.body import BodyTrack, follow_body, footprint_of, robot_of
from gait_lab.analysis.recorded_percepts import RecordedPercepts, find_percepts
from gait_lab.analysis.recorded_trace import (
    Step,
    SupportPhase,
    find_phases,
    find_steps,
    make_trace,
    origins_under_sole,
)
from gait_lab.analysis.recorded_walk import RecordedWalk, read_walk
from gait_lab.analysis.recorded_world import RecordedWorld, find_world
from gait_lab.report.signals import (
    Innovation,
    MotorUse,
    Timing,
    find_innovation,
    find_timing,
    motor_use,
)
from robot_core.geometry import wrapped
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray, VelocityCommand
from sim_bridge.trials.metrics import Metrics, fall_tick, measure
from sim_bridge.trials.trace import DOUBLE, LEFT, RIGHT, IntArray, Trace, from_start

SETTLE = 2.5
"""[s] after a change of the command before a stretch is measured."""
SHORTEST = 1.0
"""[s] shortest measured stretch."""
TIMEOUT = 500_000_000
"""[ns] without a command after which the gait stops."""
LATE = 1_500_000_000
"""[ns] the same between two equal commands: a busy recorder delays messages."""
SMOOTHING = 0.5
"""[s] between the points of the path whose length is measured: the torso sways between them."""


@dataclass(frozen=True, slots=True)
class Event:
    """A marked moment.

    Attributes:
        time: [s] since the origin of the recording.
        kind: `fall`, `push` or `alarm`.
    """

    time: float
    kind: str
    text: str


def find_events(walk: RecordedWalk, trace: Trace | None) -> tuple[Event, ...]:
    """Falls, alarms of the gait and pushes, in the order of time."""
    events = []
    if len(walk.truth) and trace is not None:
        tick = fall_tick(
            trace.torso_position, trace.torso_quaternion, float(trace.torso_position[0, 2])
        )
        if tick is not None:
            events.append(Event(float(walk.seconds(int(trace.stamp[tick]))), "fall", "fall"))
    for stamp, text in walk.support:
        if text.split(" ")[0] == "fallen":
            time = float(walk.seconds(stamp - walk.age))
            if len(walk.truth):
                events.append(Event(time, "alarm", "the gait reports a fall"))
            else:
                events.append(Event(time, "fall", "fall, as the gait reports it"))
    for stamp, force in zip(walk.push.stamp.tolist(), walk.push.value, strict=True):
        size = float(np.linalg.norm(force))
        direction = np.degrees(np.arctan2(force[1], force[0]))
        text = f"push {size:.0f} N towards {direction:.0f}°"
        events.append(Event(float(walk.seconds(stamp)), "push", text))
    return tuple(sorted(events, key=lambda event: event.time))


@dataclass(frozen=True, slots=True)
class Stretch:
    """A stretch of one command, without the settling at its start.

    Attributes:
        command: None for a bag without commands.
        start: [s] since the origin of the recording.
        end: [s] since the origin of the recording.
        stood: [s] that the gait stood under the command before it walked, as until it knows the
            gyro's bias; 0 if it set off at once.
    """

    command: VelocityCommand | None
    start: float
    end: float
    metrics: Metrics
    stood: float = 0.0

    @property
    def name(self) -> str:
        """The command in words."""
        command = self.command
        if command is None:
            return "whole bag"
        if command.is_zero:
            return "stand"
        parts = []
        if abs(command.x) >= 0.005:
            parts.append("forward" if command.x > 0 else "back")
        if abs(command.y) >= 0.005:
            parts.append("left" if command.y > 0 else "right")
        if abs(command.yaw) >= 0.02:
            parts.append("turn left" if command.yaw > 0 else "turn right")
        return " + ".join(parts) or "on the spot"

    @property
    def reached(self) -> float | None:
        """Achieved share of the commanded speed along its main axis; None while standing."""
        command = self.command
        if command is None or command.is_zero:
            return None
        axis = (command.x, command.y, 0.2 * command.yaw)
        main = int(np.argmax(np.abs(axis)))
        asked = (command.x, command.y, command.yaw)[main]
        got = (self.metrics.speed_x, self.metrics.speed_y, self.metrics.turn_rate)[main]
        small = (0.005, 0.005, 0.02)[main]
        return got / asked if abs(asked) >= small else None


def find_stretches(
    walk: RecordedWalk, phases: tuple[SupportPhase, ...], trace: Trace
) -> tuple[Stretch, ...]:
    """Every command that was held long enough; the whole bag if no command was recorded."""
    shift = float(walk.seconds(int(trace.stamp[0])))
    last = float(walk.seconds(int(trace.stamp[-1])))
    if not len(walk.command):
        return (Stretch(None, shift, last, measure(trace, 0.0, math.inf)),)
    stretches = []
    for begin, end, command in _held(walk, last):
        stood = 0.0 if command.is_zero else _stood(walk, phases, begin, end)
        begin += stood
        start = begin + min(SETTLE, 0.5 * (end - begin))
        if end - start < SHORTEST:
            continue
        start, end = max(start, shift), min(end, last)
        if end > start:
            metrics = measure(trace, start - shift, end - shift)
            stretches.append(Stretch(command, start, end, metrics, stood))
    return tuple(stretches)


def _stood(
    walk: RecordedWalk, phases: tuple[SupportPhase, ...], begin: float, end: float
) -> float:
    """[s] from `begin` to the first step if the gait stood when measuring would begin, else 0.

    A gait that does not walk until `end` misses the command and is measured.
    """
    for phase in phases:
        if phase.support != DOUBLE and float(walk.seconds(phase.end)) > begin:
            waited = float(walk.seconds(phase.stamp)) - begin
            return waited if waited > SETTLE and begin + waited < end - SHORTEST else 0.0
    return 0.0


def _held(walk: RecordedWalk, last: float) -> list[tuple[float, float, VelocityCommand]]:
    """(begin, end [s], command) of each stretch with the same command; `last` [s] ends the last."""
    events: list[tuple[int, tuple[float, ...]]] = []
    stamps, values = walk.command.stamp, walk.command.value
    zero = (0.0, 0.0, 0.0)
    for index, stamp in enumerate(stamps.tolist()):
        gap = stamp - int(stamps[index - 1]) if index else 0
        same = bool(np.array_equal(values[index], values[index - 1]))
        if gap > (LATE if same else TIMEOUT):
            events.append((int(stamps[index - 1]) + TIMEOUT, zero))
        events.append((stamp, tuple(np.round(values[index], 6).tolist())))
    events.append((int(stamps[-1]) + TIMEOUT, zero))
    held: list[tuple[float, float, VelocityCommand]] = []
    for (stamp, value), after in zip(events, [*events[1:], None], strict=True):
        begin = float(walk.seconds(stamp))
        end = last if after is None else float(walk.seconds(after[0]))
        if held and held[-1][2] == VelocityCommand(*value):
            held[-1] = (held[-1][0], end, held[-1][2])
        else:
            held.append((begin, end, VelocityCommand(*value)))
    return held


@dataclass(frozen=True, slots=True)
class Paths:
    """The path by truth and by odometry, t rows; both begin at (0, 0) with the heading 0.

    Attributes:
        stamp: (t,) [ns].
        truth: (t, 3) x, y [m], yaw [rad] of the middle between the soles; empty without ground
            truth.
        odometry: (t, 3) of base_footprint.
        length: [m] walked, by truth if it is known.
    """

    stamp: IntArray
    truth: FloatArray
    odometry: FloatArray
    length: float

    @property
    def error(self) -> FloatArray:
        """(t, 3) odometry minus truth; empty without ground truth."""
        if not len(self.truth):
            return np.empty((0, 3))
        difference = self.odometry - self.truth
        difference[:, 2] = wrapped(difference[:, 2])
        return difference


def find_paths(walk: RecordedWalk, body: BodyTrack | None) -> Paths | None:
    """The paths; None without odometry and without ground truth."""
    odometry = from_start(_unwrapped(walk.odometry.value))
    stamp = walk.odometry.stamp
    truth = np.empty((0, 3))
    if body is not None and body.from_truth:
        known = np.isfinite(body.sole[:, 0, 0, 3])
        middle = _unwrapped(footprint_of(body.sole[known]))
        if not len(stamp):
            stamp = body.stamp[known]
            odometry = np.full((len(stamp), 3), np.nan)
        shared, rows, own = np.intersect1d(stamp, body.stamp[known], return_indices=True)
        if len(shared):
            stamp, truth = shared, from_start(middle[own])
            odometry = from_start(odometry[rows])
    if len(stamp) < 2:
        return None
    return Paths(stamp, truth, odometry, _length(walk, truth if len(truth) else odometry))


def _unwrapped(pose: FloatArray) -> FloatArray:
    pose = pose.copy()
    pose[:, 2] = np.unwrap(pose[:, 2])
    return pose


def _length(walk: RecordedWalk, pose: FloatArray) -> float:
    every = max(1, round(SMOOTHING * 1e9 / max(1, walk.period)))
    points = pose[::every, :2]
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


@dataclass(frozen=True, slots=True)
class Analysis:
    """All measurements of one walk; None where the bag lacks the topics.

    Attributes:
        origins: Pendulum origins under the left and the right sole, see `origins_under_sole`.
    """

    walk: RecordedWalk
    robot: RobotDescription | None
    robot_remark: str
    body: BodyTrack | None
    phases: tuple[SupportPhase, ...]
    steps: tuple[Step, ...]
    origins: tuple[FloatArray, FloatArray]
    trace: Trace | None
    stretches: tuple[Stretch, ...]
    walking: Metrics | None
    events: tuple[Event, ...]
    innovation: Innovation | None
    motors: MotorUse | None
    timing: Timing | None
    paths: Paths | None
    percepts: RecordedPercepts | None
    world: RecordedWorld | None

    @property
    def fall(self) -> float | None:
        """[s since the origin] of the first fall; None without one."""
        return next((event.time for event in self.events if event.kind == "fall"), None)

    @property
    def walked(self) -> tuple[float, float] | None:
        """First and last moment of a single support [s since the origin]; None without one."""
        return _walked(self.walk, self.phases)

    @property
    def has_motion(self) -> bool:
        """Whether the bag has any motion to report."""
        walk = self.walk
        tables = (walk.position, walk.truth, walk.odometry, walk.expected, walk.measured,
                  walk.estimated, walk.targets)  # fmt: skip
        return any(len(table) > 1 for table in tables)


def analyse(path: Path, robot: str = "") -> Analysis:
    """Read and measure a bag.

    Args:
        path: A rosbag2 folder, or an .mcap or .db3 file.
        robot: Name of a robot out of several; "" for the only one.

    Raises:
        NaoGaitError: The path is no bag, or the bag has no such robot.
    """
    return analysis_of(read_walk(path, robot))


def analysis_of(walk: RecordedWalk) -> Analysis:
    """Measure a bag that was read."""
    model, remark = robot_of(walk)
    body = follow_body(walk, model) if model is not None and len(walk.position) > 1 else None
    phases = find_phases(walk)
    trace = make_trace(walk, phases, body)
    return Analysis(
        walk=walk,
        robot=model,
        robot_remark=remark,
        body=body,
        phases=phases,
        steps=find_steps(walk, phases),
        origins=(
            origins_under_sole(walk, phases, LEFT),
            origins_under_sole(walk, phases, RIGHT),
        ),
        trace=trace,
        stretches=() if trace is None else find_stretches(walk, phases, trace),
        walking=_measure_walking(walk, phases, trace),
        events=find_events(walk, trace),
        innovation=find_innovation(walk, phases),
        motors=motor_use(walk, model) if model is not None and len(walk.effort) > 1 else None,
        timing=find_timing(walk),
        paths=find_paths(walk, body),
        percepts=find_percepts(walk, body),
        world=find_world(walk, body),
    )


def _measure_walking(
    walk: RecordedWalk, phases: tuple[SupportPhase, ...], trace: Trace | None
) -> Metrics | None:
    """From the first step to the last; over the whole trace without steps."""
    if trace is None or not len(trace):
        return None
    shift = float(walk.seconds(int(trace.stamp[0])))
    begin, end = _walked(walk, phases) or (shift, math.inf)
    return measure(trace, max(0.0, begin - shift), end - shift)


def _walked(
    walk: RecordedWalk, phases: tuple[SupportPhase, ...]
) -> tuple[float, float] | None:
    """First and last moment of a single support [s since the origin]; None without one."""
    single = [phase for phase in phases if phase.support != DOUBLE]
    if not single:
        return None
    return float(walk.seconds(single[0].stamp)), float(walk.seconds(single[-1].end))
