"""The bridge as a ROS 2 node: the world behind the topics of a robot.

The node owns `/clock`; `stepping` calls `advance`, no timer does.
"""

import os
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

from geometry_msgs.msg import PointStamped, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_sensor_data,
)
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import load_robot
from nao_lipm_gait.ros.parameters import declare, of_type, unknown_overrides, used_as
from nao_lipm_gait.runtime.diagnostics import Throttle
from nao_lipm_gait.runtime.inputs import stamp_of
from sim_bridge.ball import Ball
from sim_bridge.command_input import CommandInput, read_push
from sim_bridge.plant import load_plant
from sim_bridge.robot import Reading
from sim_bridge.ros import parameters
from sim_bridge.ros.messages import ReadingWriter, TruthWriter
from sim_bridge.ros.monitors import PublisherMonitor
from sim_bridge.ros.parameters import NODE_PARAMETERS
from sim_bridge.world import World

CONTROL_PERIOD = 0.01
"""[s] between two readings; a NAO's own."""
RESET_SILENCE = 0.6
"""[s] of simulated time without sensors after a reset. The clock continues, so a controller notices
the reset by this gap: more than 0.5 s is a new start for it."""

_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_RELIABLE = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)


class BridgeNode(Node):
    """A world with one robot; takes commands, publishes its sensors and the ground truth.

    Attributes:
        control_period: [ns] simulated time of one step.
        factor: simulated seconds per wall second; 0 = as fast as possible.
        lockstep: physics waits for the command that answers the last reading.
    """

    def __init__(self) -> None:
        super().__init__("sim_bridge", automatically_declare_parameters_from_overrides=True)
        text = partial(of_type, kind=str)
        self._robot = used_as(parameters.URDF, load_robot, text(declare(self, parameters.URDF)))
        plant = used_as(parameters.PLANT, load_plant, text(declare(self, parameters.PLANT)))
        self.factor = of_type(declare(self, parameters.REAL_TIME_FACTOR), float)
        self.lockstep = of_type(declare(self, parameters.LOCKSTEP), bool)
        self._push_duration = of_type(declare(self, parameters.PUSH_DURATION), float)
        delay = declare(self, parameters.SENSOR_DELAY, plant.sensors.delay)
        self._world = World.single(
            self._robot,
            plant,
            robot_seed=of_type(declare(self, parameters.ROBOT_SEED), int),
            engine=text(declare(self, parameters.ENGINE)),
            sensor_delay=of_type(delay, float),
            control_period=CONTROL_PERIOD,
            gui=_check_display(of_type(declare(self, parameters.GUI), bool)),
            start_state=text(declare(self, parameters.START_STATE)),
            ball=Ball() if of_type(declare(self, parameters.BALL), bool) else None,
        )
        self.control_period = self._world.control_period
        self._commands = CommandInput(self._robot)
        self._sent: Reading | None = None
        self._awaited: int | None = None  # stamp [ns] of the reading that lockstep waits for
        self._answered: int | None = None  # stamp [ns] of the last reading that was answered
        self._silent_until = 0
        self._throttle = Throttle()
        self._readings = ReadingWriter(self._robot, self._world.robot.plant.sensors)
        self._truths = TruthWriter(self._robot)
        self._make_publishers()
        self._make_subscriptions()
        for name in unknown_overrides(self, frozenset(p.name for p in NODE_PARAMETERS)):
            self._warn(name, f"parameter {name}: unknown and ignored; see `ros2 param list`")
        self.get_logger().info(
            f"{self._robot.name}, plant {plant.name}, robot "
            f"{self._world.robot.individual.seed}: "
            + ("lockstep" if self.lockstep else f"real time factor {self.factor:g}")
        )

    def _make_publishers(self) -> None:
        self._clock_topic = None
        if of_type(declare(self, parameters.PUBLISH_CLOCK), bool):
            self._clock_topic = self.create_publisher(Clock, "/clock", 10)
        self._imu = self.create_publisher(Imu, "imu/data", _RELIABLE)
        self._joint_states = self.create_publisher(JointState, "joint_states", _RELIABLE)
        self._wrenches = tuple(
            self.create_publisher(WrenchStamped, f"{frame}/wrench", _RELIABLE)
            for frame in self._robot.sole_frames
        )
        self._odometry = self.create_publisher(Odometry, "ground_truth/odom", _RELIABLE)
        self._com = self.create_publisher(PointStamped, "ground_truth/com", _RELIABLE)
        self._ball = None
        if self._world.ball is not None:
            self._ball = self.create_publisher(PointStamped, "ground_truth/ball", _RELIABLE)
        description = self.create_publisher(String, "robot_description", _LATCHED)
        description.publish(String(data=self._robot.urdf))
        advice = {
            self._joint_states.topic_name: "is there another robot? Use another namespace or "
            "ROS_DOMAIN_ID"
        }
        if self._clock_topic is not None:
            advice["/clock"] = (
                "is there another simulator? Set publish_clock:=false for one of them"
            )
        self._publisher_monitor = PublisherMonitor(advice)
        self._watched_topics = tuple(advice)

    def _make_subscriptions(self) -> None:
        # Reliable in lockstep, where a lost command would stop the world.
        commands = _RELIABLE if self.lockstep else qos_profile_sensor_data
        subscriptions: list[tuple[Any, str, Callable[[Any], None], QoSProfile]] = [
            (JointState, "joint_command", self._on_command, commands),
            (WrenchStamped, "push", self._on_push, _RELIABLE),
        ]
        if self._ball is not None:
            subscriptions.append((PointStamped, "~/put_ball", self._on_put_ball, _RELIABLE))
        for kind, topic, callback, qos in subscriptions:
            self.create_subscription(kind, topic, partial(self._guarded, callback), qos)
        self.create_service(Trigger, "~/reset", self._on_reset)

    def destroy_node(self) -> None:
        """Free the engine too."""
        self._world.close()
        super().destroy_node()

    # -- stepping ----------------------------------------------------------------------------------

    @property
    def waits_for_answer(self) -> bool:
        """In lockstep, the last reading has not been answered yet."""
        return self.lockstep and self._awaited is not None

    def advance(self) -> None:
        """Step the world by one control period and publish the clock, sensors and ground truth."""
        self._world.step()
        now = self._world.time
        if self._clock_topic is not None:
            self._clock_topic.publish(self._truths.clock(now))
        reading = self._world.robot.read()
        if reading is not None and reading is not self._sent and now >= self._silent_until:
            self._sent = reading
            self._awaited = reading.frame.stamp
            self._send(reading)
        truth = self._world.robot.truth()
        self._odometry.publish(self._truths.odometry(truth))
        self._com.publish(self._truths.com(truth))
        ball = self._world.ball
        if self._ball is not None and ball is not None:
            self._ball.publish(self._truths.point(truth.stamp, ball.position))

    def resend(self) -> None:
        """Publish the last reading again, unchanged."""
        if self._sent is not None:
            self._send(self._sent)

    def release_control(self) -> None:
        """Let another gait answer, because the one in control does not."""
        self._commands.release()

    def report_wait(self, waited: float) -> None:
        """Log that lockstep has waited for an answer for `waited` [s] of wall time."""
        stamp = 0.0 if self._awaited is None else self._awaited * 1e-9
        subscribers = self._joint_states.get_subscription_count()
        self.get_logger().warning(
            f"lockstep: no joint_command with header.stamp {stamp:.3f} s for {waited:.0f} s; "
            f"{subscribers} subscriber(s) on joint_states"
        )

    def check_publishers(self) -> None:
        """Log topics of this bridge on which others publish too."""
        counts = {topic: self.count_publishers(topic) for topic in self._watched_topics}
        for message in self._publisher_monitor.update(counts):
            self.get_logger().warning(message)

    def _send(self, reading: Reading) -> None:
        # The IMU goes first: the joint state of the same stamp starts a tick of the gait.
        self._imu.publish(self._readings.imu(reading))
        self._joint_states.publish(self._readings.joints(reading))
        for side, publisher in enumerate(self._wrenches):
            publisher.publish(self._readings.wrench(reading, side))

    # -- inputs ------------------------------------------------------------------------------------

    def _guarded(self, callback: Callable[[Any], None], message: Any) -> None:
        """Turn the refusal of a message into a warning; the robot keeps its last targets."""
        try:
            callback(message)
        except NaoGaitError as error:
            self._warn(error.field, f"{error}; message ignored", burst=5)
        except Exception as error:
            self._warn(type(error).__name__, f"{type(error).__name__}: {error}; message ignored")

    def _on_command(self, message: JointState) -> None:
        header = message.header
        stamp = stamp_of(header.stamp.sec, header.stamp.nanosec, "joint_command header.stamp")
        answers = stamp == self._awaited
        if self.lockstep and not answers:
            if stamp == self._answered:
                return  # second answer, to a reading that was sent again
            raise NaoGaitError(
                "joint_command header.stamp",
                f"{stamp * 1e-9:.3f} s",
                "in lockstep, the stamp of the last joint_states"
                + ("" if self._awaited is None else f", {self._awaited * 1e-9:.3f} s"),
            )
        now = self._world.time * 1e-9
        self._commands.admit(header.frame_id, now)
        if answers:
            # Before the command is read: after a bad one the world continues with the last targets.
            self._awaited, self._answered = None, stamp
        targets, warning = self._commands.read(
            header.frame_id, now, stamp, message.name, message.position, message.effort
        )
        self._world.robot.command(targets)
        if warning is not None:
            self._warn("limits", warning)

    def _on_push(self, message: WrenchStamped) -> None:
        force, torque = message.wrench.force, message.wrench.torque
        push = read_push(
            (force.x, force.y, force.z), (torque.x, torque.y, torque.z), message.header.frame_id
        )
        self._world.robot.push(push, self._push_duration)

    def _on_put_ball(self, message: PointStamped) -> None:
        frame = message.header.frame_id
        if frame not in ("", "world"):
            raise NaoGaitError("~/put_ball header.frame_id", frame, "world, or empty")
        self._world.put_ball(message.point.x, message.point.y)

    def _on_reset(self, _request: Any, response: Trigger.Response) -> Trigger.Response:
        self._world.reset()
        self._commands.reset(self._world.time)
        self._sent = self._awaited = self._answered = None
        self._silent_until = self._world.time + round(RESET_SILENCE * 1e9)
        response.success = True
        response.message = (
            f"back at the start; no sensors for {RESET_SILENCE} s, so that controllers start again"
        )
        self.get_logger().info("reset")
        return response

    def _warn(self, key: str, message: str, burst: int = 1) -> None:
        held_back = self._throttle.allow(key, time.monotonic(), burst)
        if held_back is not None:
            more = f" ({held_back} more like it)" if held_back else ""
            self.get_logger().warning(message + more)


def _check_display(gui: bool) -> bool:
    """`gui`, if a window can be opened; without a display the engine would end the process."""
    if gui and sys.platform == "linux" and not os.environ.get("DISPLAY"):
        raise NaoGaitError("gui", gui, "false, because DISPLAY is not set")
    return gui
