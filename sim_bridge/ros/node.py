"""The simulation as a ROS 2 node. It owns the clock; `driving` steps it, no timer does."""

import os
import sys
import time
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
from nao_lipm_gait.ros.parameters import (
    declare,
    of_type,
    unknown_overrides,
    used_as,
)
from nao_lipm_gait.runtime.diagnostics import Throttle
from nao_lipm_gait.runtime.inputs import stamp_of
from nao_lipm_gait.types import JointTargets
from sim_bridge.ball import Ball
from sim_bridge.command_input import CommandInput, read_push
from sim_bridge.plant import load_plant
from sim_bridge.robot import Reading
from sim_bridge.ros.messages import ReadingWriter, TruthWriter
from sim_bridge.ros.parameters import (
    BALL,
    ENGINE,
    GUI,
    LOCKSTEP,
    NODE_PARAMETERS,
    PLANT,
    PUSH_DURATION,
    REAL_TIME_FACTOR,
    ROBOT_SEED,
    SENSOR_DELAY,
    START_STATE,
    URDF,
)
from sim_bridge.world import World

CONTROL_PERIOD = 0.01
"""[s] between two readings; a NAO's own."""
RESET_SILENCE = 0.6
"""[s] without sensors after a reset. The clock goes on, so this gap is how a controller learns that
its past is void (it takes a gap over 0.5 s for a new beginning)."""

_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_RELIABLE = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)


class BridgeNode(Node):
    """Holds the simulation, takes commands and publishes what the robot feels and what is true."""

    def __init__(self) -> None:
        super().__init__("sim_bridge", automatically_declare_parameters_from_overrides=True)
        text = partial(of_type, kind=str)
        self._robot = used_as(URDF, load_robot, text(declare(self, URDF)))
        plant = used_as(PLANT, load_plant, text(declare(self, PLANT)))
        self.factor = of_type(declare(self, REAL_TIME_FACTOR), float)
        self.lockstep = of_type(declare(self, LOCKSTEP), bool)
        self._push_duration = of_type(declare(self, PUSH_DURATION), float)
        self._simulation = World.single(
            self._robot,
            plant,
            robot_seed=of_type(declare(self, ROBOT_SEED), int),
            engine=text(declare(self, ENGINE)),
            sensor_delay=of_type(declare(self, SENSOR_DELAY, plant.sensors.delay), float),
            control_period=CONTROL_PERIOD,
            gui=_needs_display(of_type(declare(self, GUI), bool)),
            start_state=text(declare(self, START_STATE)),
            ball=Ball() if of_type(declare(self, BALL), bool) else None,
        )
        self.control_period = self._simulation.control_period
        self._commands = CommandInput(self._robot)
        self._targets: JointTargets | None = None
        self._sent: Reading | None = None
        self._silent_until = 0
        self.awaited: int | None = None
        """Stamp of the reading whose answer lockstep waits for [ns]."""
        self._throttle = Throttle()
        self._readings = ReadingWriter(self._robot, self._simulation.robot.plant.sensors)
        self._truths = TruthWriter(self._robot)
        self._make_publishers()
        self._make_subscriptions()
        for name in unknown_overrides(self, frozenset(p.name for p in NODE_PARAMETERS)):
            self._warn(name, f"parameter {name}: unknown and ignored; see `ros2 param list`")
        self.get_logger().info(
            f"{self._robot.name}, plant {plant.name}, robot {self._simulation.robot.individual.seed}: "
            + ("lockstep" if self.lockstep else f"real time factor {self.factor:g}")
        )

    def _make_publishers(self) -> None:
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
        if self._simulation.ball is not None:
            self._ball = self.create_publisher(PointStamped, "ground_truth/ball", _RELIABLE)
        description = self.create_publisher(String, "robot_description", _LATCHED)
        description.publish(String(data=self._robot.urdf))

    def _make_subscriptions(self) -> None:
        # In lockstep a lost command would stop the world, so it is asked for reliably.
        commands = _RELIABLE if self.lockstep else qos_profile_sensor_data
        self.create_subscription(
            JointState, "joint_command", partial(self._fenced, self._on_command), commands
        )
        self.create_subscription(
            WrenchStamped, "push", partial(self._fenced, self._on_push), _RELIABLE
        )
        if self._ball is not None:
            self.create_subscription(
                PointStamped, "~/put_ball", partial(self._fenced, self._on_put_ball), _RELIABLE
            )
        self.create_service(Trigger, "~/reset", self._on_reset)

    def destroy_node(self) -> None:
        self._simulation.close()
        super().destroy_node()

    # -- the world moves ---------------------------------------------------------------------------

    def advance(self) -> None:
        """One control period of physics, then everything that can be known after it."""
        self._simulation.robot.command(self._targets)
        self._simulation.step()
        now = self._simulation.time
        self._clock_topic.publish(self._truths.clock(now))
        reading = self._simulation.robot.read()
        silent = now < self._silent_until
        if reading is not None and reading is not self._sent and not silent:
            self._sent = reading
            self.awaited = reading.frame.stamp
            self.send(reading)
        truth = self._simulation.robot.truth()
        self._odometry.publish(self._truths.odometry(truth))
        self._com.publish(self._truths.com(truth))
        ball = self._simulation.ball
        if self._ball is not None and ball is not None:
            self._ball.publish(self._truths.point(truth.stamp, ball.position))

    def send(self, reading: Reading) -> None:
        """The IMU goes first: the joint state of the same stamp makes the gait tick."""
        self._imu.publish(self._readings.imu(reading))
        self._joint_states.publish(self._readings.joints(reading))
        for side, publisher in enumerate(self._wrenches):
            publisher.publish(self._readings.wrench(reading, side))

    def resend(self) -> None:
        """The last reading once more, unchanged."""
        if self._sent is not None:
            self.send(self._sent)

    # -- inputs ------------------------------------------------------------------------------------

    def _fenced(self, work: Any, message: Any) -> None:
        """A bad message becomes a warning; the robot keeps its last targets."""
        try:
            work(message)
        except NaoGaitError as error:
            self._warn(error.field, f"{error}; message ignored", burst=5)
        except Exception as error:
            self._warn(type(error).__name__, f"{type(error).__name__}: {error}; message ignored")

    def _on_command(self, message: JointState) -> None:
        stamp = stamp_of(
            message.header.stamp.sec, message.header.stamp.nanosec, "joint_command header.stamp"
        )
        answers = stamp == self.awaited
        if self.lockstep and not answers:
            raise NaoGaitError(
                "joint_command header.stamp",
                f"{stamp * 1e-9:.3f} s",
                "in lockstep, the stamp of the last joint_states"
                + ("" if self.awaited is None else f", {self.awaited * 1e-9:.3f} s"),
            )
        sender, now = message.header.frame_id, time.monotonic()
        self._commands.admit(sender, now)
        if answers:
            # Even if refused below: the world goes on with the last good targets.
            self.awaited = None
        targets, remark = self._commands.read(
            sender, now, stamp, message.name, message.position, message.effort
        )
        if targets is not None:
            self._targets = targets
        if remark is not None:
            self._warn("limits", remark)

    def _on_push(self, message: WrenchStamped) -> None:
        force, torque = message.wrench.force, message.wrench.torque
        push = read_push(
            (force.x, force.y, force.z), (torque.x, torque.y, torque.z), message.header.frame_id
        )
        self._simulation.robot.push(push, self._push_duration)

    def _on_put_ball(self, message: PointStamped) -> None:
        if message.header.frame_id not in ("", "world"):
            raise NaoGaitError(
                "~/put_ball header.frame_id", message.header.frame_id, "world, or empty"
            )
        self._simulation.put_ball(message.point.x, message.point.y)

    def _on_reset(self, _request: Any, response: Trigger.Response) -> Trigger.Response:
        self._simulation.reset()
        self._commands.reset(self._simulation.time)
        self._targets = None
        self._sent = None
        self.awaited = None
        self._silent_until = self._simulation.time + round(RESET_SILENCE * 1e9)
        response.success = True
        response.message = (
            f"back at the start; no sensors for {RESET_SILENCE} s, so that controllers begin anew"
        )
        self.get_logger().info("reset")
        return response

    def _warn(self, key: str, message: str, burst: int = 1) -> None:
        held_back = self._throttle.allow(key, time.monotonic(), burst)
        if held_back is not None:
            more = f" ({held_back} more like it)" if held_back else ""
            self.get_logger().warning(message + more)

    def complain(self, waited: float) -> None:
        """Lockstep hangs: say for what."""
        stamp = 0.0 if self.awaited is None else self.awaited * 1e-9
        listeners = self._joint_states.get_subscription_count()
        self.get_logger().warning(
            f"lockstep: no joint_command with header.stamp {stamp:.3f} s for {waited:.0f} s; "
            f"{listeners} subscriber(s) on joint_states"
        )

    def fall_behind(self, lost: float) -> None:
        """Physics cannot keep up with the wall clock."""
        self._warn(
            "slow", f"slower than real_time_factor {self.factor:g}: {lost:.1f} s wall time let go"
        )


def _needs_display(gui: bool) -> bool:
    """The engine ends the process without a word where there is no display to open."""
    if gui and sys.platform == "linux" and not os.environ.get("DISPLAY"):
        raise NaoGaitError("gui", gui, "false, because DISPLAY is not set")
    return gui
