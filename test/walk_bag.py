"""A rollout as a bag: what both nodes would publish in lockstep, without the nodes."""

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, WrenchStamped
from rclpy.serialization import serialize_message
from std_msgs.msg import String

from gait_lab.analysis.bag import BagWriter
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.ros.messages import JointStateWriter, StatusWriter, footsteps, support_text
from nao_lipm_gait.runtime.reports import TickTimes, walk_report
from robot_core.ros.messages import diagnostic_array
from robot_core.types import GaitStatus, JointTargets, SensorFrame, VelocityCommand
from sim_bridge.plant import load_plant
from sim_bridge.ros.messages import ReadingWriter, TruthWriter
from sim_bridge.trials.metrics import Metrics, measure
from sim_bridge.trials.rollout import RolloutSpec, make_pair, task_ticks
from sim_bridge.trials.trace import Recorder
from sim_bridge.trials.trial import CONTROL_PERIOD, TimedCommands, run

MARKER_TICKS = 10
"""As the gait node draws them."""


@dataclass
class WrittenWalk:
    """A walk in a bag.

    Attributes:
        bag: The folder.
        metrics: Metrics as the benchmark measures them for the same walk.
    """

    bag: Path
    metrics: Metrics


Message = tuple[str, int, str, bytes]
"""Topic, time [ns], type and content of a message."""


def write_walk(
    folder: Path,
    spec: RolloutSpec,
    *,
    without: Collection[str] = (),
    prefix: str = "",
    storage: str = "mcap",
    also: Iterable[tuple[str, int, Any]] = (),
) -> WrittenWalk:
    """Walk the task of a specification and write the topics of both nodes.

    Args:
        folder: Folder of the bag.
        spec: The walk.
        without: Topics to leave out.
        prefix: Namespace of the topics.
        storage: `mcap` or `sqlite3`.
        also: Other messages: full name of the topic, time [ns], message.

    Returns:
        The bag, and the metrics of the same walk.
    """
    messages, metrics = _walked(spec)
    rows = [
        ("" if each[0] == "/clock" else prefix, each) for each in messages if each[0] not in without
    ]
    rows += [("", _message(*each)) for each in also]
    known: set[str] = set()
    with BagWriter(folder, storage) as writer:
        for above, (topic, stamp, kind, content) in rows:
            name = above + topic
            if name not in known:
                known.add(name)
                writer.add_topic(name, kind)
            writer.write(name, stamp, content)
    return WrittenWalk(folder, metrics)


def _message(topic: str, stamp: int, message: Any) -> Message:
    package = type(message).__module__.split(".")[0]
    kind = f"{package}/msg/{type(message).__name__}"
    return topic, stamp, kind, serialize_message(message)


class _Out(list[Message]):
    """What the nodes publish."""

    def write(self, topic: str, stamp: int, message: Any) -> None:
        self.append(_message(topic, stamp, message))


@lru_cache(maxsize=2)
def _walked(spec: RolloutSpec) -> tuple[list[Message], Metrics]:
    """The messages of a walk; most tests need those of the same one."""
    world, gait = make_pair(spec)
    robot, task = gait.robot, spec.task
    recorder, out = Recorder(), _Out()
    out.write("/robot_description", 0, String(data=robot.urdf))
    gait_out = _GaitMessages(out, robot)
    readings = ReadingWriter(robot, load_plant(spec.plant).sensors)
    truths = TruthWriter(robot)
    walker = _KeepingTargets(gait)
    pushes = () if spec.push is None else (spec.push,)
    policy = TimedCommands(task.command_at, pushes, ahead=False)
    pushed = spec.push is None
    sent = -1
    with world:
        for tick in islice(run(world, walker, policy), task_ticks(task)):
            recorder.add(tick.truth, tick.command, tick.status)
            now = tick.truth.stamp
            out.write("/clock", now, truths.clock(now))
            out.write("/cmd_vel", now, _twist(tick.command))
            out.write("/ground_truth/odom", now, truths.odometry(tick.truth))
            out.write("/ground_truth/com", now, truths.com(tick.truth))
            if not pushed and now * 1e-9 > spec.push.time:  # type: ignore[union-attr]
                pushed = True
                push = WrenchStamped()
                push.wrench.force.y = 50.0
                out.write("/push", now, push)
            reading = world.robot.read()
            if reading is None or walker.targets is None or reading.frame.stamp == sent:
                continue
            assert tick.status is not None
            sent = reading.frame.stamp
            out.write("/imu/data", now, readings.imu(reading))
            out.write("/joint_states", now, readings.joints(reading))
            for side, topic in enumerate(("/l_sole/wrench", "/r_sole/wrench")):
                out.write(topic, now, readings.wrench(reading, side))
            gait_out.write(now, tick.status, walker.targets)
    return out, measure(recorder.trace(), task.start, task.end)


class _KeepingTargets:
    """A gait that keeps its last answer."""

    def __init__(self, gait: Gait) -> None:
        self._gait = gait
        self.targets: JointTargets | None = None

    def step(self, frame: SensorFrame, command: VelocityCommand) -> JointTargets:
        self.targets = self._gait.step(frame, command)
        return self.targets

    @property
    def status(self) -> GaitStatus:
        return self._gait.status


class _GaitMessages:
    def __init__(self, out: _Out, robot: Any) -> None:
        self._out = out
        self._writer = StatusWriter()
        self._commands = JointStateWriter(robot.joint_names, CONTROL_PERIOD)
        self._support, self._steps, self._ticks, self._diagnosed = "", -1, 0, 0

    def write(self, now: int, status: GaitStatus, targets: JointTargets) -> None:
        out, writer = self._out, self._writer
        out.write("/joint_command", now, self._commands.write(targets))
        out.write("/odom", now, writer.odometry(status))
        for name, point in (
            ("expected", status.com_expected_in_q),
            ("measured", status.com_measured_in_q),
            ("estimated", status.com_estimated_in_q),
        ):
            out.write(f"/gait/com_{name}", now, writer.point_in_q(point, status.stamp))
        if (text := support_text(status)) != self._support:
            self._support = text
            out.write("/gait/support", now, String(data=text))
        self._ticks += 1
        if status.step_count != self._steps or self._ticks >= MARKER_TICKS:
            self._steps, self._ticks = status.step_count, 0
            out.write("/gait/footsteps", now, footsteps(status))
        if now - self._diagnosed >= 1_000_000_000:
            self._diagnosed = now
            out.write("/diagnostics", now, _diagnostics(status))


def _diagnostics(status: GaitStatus) -> DiagnosticArray:
    ticks = TickTimes(0.01)
    ticks.add(0.0, 150e-6)
    report = walk_report(status, ticks.summarize())
    return diagnostic_array("gait", "nao", status.stamp, (report,))


def _twist(command: VelocityCommand) -> Twist:
    twist = Twist()
    twist.linear.x, twist.linear.y = command.x, command.y
    twist.angular.z = command.yaw
    return twist
