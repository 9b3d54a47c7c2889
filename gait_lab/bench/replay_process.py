"""The process that stands for the robot in a replay: sends messages and takes the answers.

Command line: python -m gait_lab.bench.replay_process SCRIPT
SCRIPT is JSON: the control period [s], and topic, type and fields of the messages of each tick. The
times that were measured (`ReplayTimes`) go to the standard output as JSON.
"""

import gc
import json
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import rclpy
from geometry_msgs.msg import Twist, WrenchStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Imu, JointState

from gait_lab.bench.ros_replay import ReplayTimes
from gait_lab.bench.wake_up import Sleeper, sleep_until
from gait_lab.faults.messages import Message
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput, LoadInput, TwistInput
from robot_core.ros.messages import to_time
from robot_core.ros.patience import START
from robot_core.ros.process import stay_local
from robot_core.ros.topics import publisher, subscription

SETTLE_TIME, LAST_TIME = 1.0, 10.0
"""[s] to wait after the gait was found, and at most for the last answers."""
GUARD = 0.001
"""[s] before the next tick, in which this process only sleeps."""
INPUTS = {ImuInput: Imu, JointInput: JointState, TwistInput: Twist, LoadInput: WrenchStamped}
"""Messages that a script may hold, and the type of their topics."""
_SECOND = 1_000_000_000


class ReplayNode(Node):
    """Publishes the topics of a robot and keeps the times of the answers.

    Args:
        script: The messages of each tick; their topics are published.

    Attributes:
        answered: Stamp [ns] of a command -> when the gait sent it [s of the system clock].
    """

    def __init__(self, script: list[list[Message]]) -> None:
        super().__init__("replay")
        self.answered: dict[int, float] = {}
        kinds = {each.topic: type(each.content) for messages in script for each in messages}
        self._topics = {
            topic: publisher(self, INPUTS[kind], topic) for topic, kind in kinds.items()
        }
        # The gait takes wrenches of the soles only while it needs them.
        self._awaited = [self._topics[name] for name in kinds if kinds[name] is not LoadInput]
        self._commands = subscription(
            self, JointState, "joint_command", self._on_command, QoSProfile(depth=1000)
        )

    @property
    def connected(self) -> bool:
        """The gait receives all topics, and its commands are received."""
        heard = all(topic.get_subscription_count() for topic in self._awaited)
        return heard and self._commands.get_publisher_count() > 0

    def sending(self, message: Message) -> Callable[[], None]:
        """A call that publishes the message; the conversion is done before."""
        topic, converted = self._topics[message.topic], _converted(message)
        return lambda: topic.publish(converted)

    def _on_command(self, message: JointState, info: Mapping[str, int]) -> None:
        stamp = message.header.stamp.sec * _SECOND + message.header.stamp.nanosec
        self.answered.setdefault(stamp, info["source_timestamp"] * 1e-9)


def _converted(message: Message) -> Any:
    content = message.content
    if isinstance(content, ImuInput):
        imu = Imu()
        imu.header.stamp = to_time(content.sec * _SECOND + content.nanosec)
        turn, pull = imu.angular_velocity, imu.linear_acceleration
        turn.x, turn.y, turn.z = content.angular_velocity
        pull.x, pull.y, pull.z = content.linear_acceleration
        imu.orientation_covariance[0] = content.orientation_covariance
        return imu
    if isinstance(content, JointInput):
        joints = JointState(name=content.names, position=content.position)
        joints.header.stamp = to_time(content.sec * _SECOND + content.nanosec)
        return joints
    if isinstance(content, TwistInput):
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.linear.z = content.linear
        twist.angular.x, twist.angular.y, twist.angular.z = content.angular
        return twist
    if isinstance(content, LoadInput):
        wrench = WrenchStamped()
        wrench.header.stamp = to_time(content.sec * _SECOND + content.nanosec)
        wrench.wrench.force.z = content.force
        return wrench
    raise TypeError(type(content).__name__)


def _stamp(message: Message) -> int | None:
    """Stamp [ns] of a joint state; None for other messages."""
    content = message.content
    if isinstance(content, JointInput):
        return content.sec * _SECOND + content.nanosec
    return None


def replay(period: float, script: list[list[Message]]) -> ReplayTimes:
    """Send the messages of each tick at its time; the times of sending and of the answers."""
    node = ReplayNode(script)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    ticks = [[(node.sending(each), _stamp(each)) for each in messages] for messages in script]
    deadline = time.monotonic() + START
    while not node.connected:
        if time.monotonic() > deadline:
            raise SystemExit("the gait was not found")
        executor.spin_once(timeout_sec=0.1)
    gc.collect()
    gc.freeze()
    gc.disable()
    sent: dict[int, float] = {}
    begin = time.monotonic() + SETTLE_TIME
    with Sleeper(begin, period, len(ticks)) as sleeper:
        for index, messages in enumerate(ticks):
            due = begin + index * period
            _serve(executor, due - GUARD)
            sleep_until(due)
            for send, stamp in messages:
                if stamp is not None:
                    sent[stamp] = time.time()
                send()
        end = time.monotonic() + LAST_TIME
        while time.monotonic() < end and not sent.keys() <= node.answered.keys():
            executor.spin_once(timeout_sec=0.1)
        machine = sleeper.lateness()
    answered = tuple(node.answered.get(stamp) for stamp in sent)
    return ReplayTimes(tuple(sent.values()), answered, machine)


def _serve(executor: SingleThreadedExecutor, until: float) -> None:
    """Take answers until this time on the monotonic clock [s]."""
    while (left := until - time.monotonic()) > 0.0:
        executor.spin_once(timeout_sec=left)


def main() -> None:
    """Replay the script of the command line."""
    period, ticks = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    kinds = {kind.__name__: kind for kind in INPUTS}
    script = [
        [Message(topic, kinds[kind](**fields)) for topic, kind, fields in messages]
        for messages in ticks
    ]
    stay_local()
    rclpy.init()
    json.dump(replay(period, script), sys.stdout)
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
