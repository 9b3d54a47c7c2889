"""The node `lola_bridge`: starts the driver, publishes its frames, passes on `joint_command`."""

import contextlib
import socket
import subprocess
import sys
import threading
import time
from functools import partial

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from rclpy.clock import Clock, ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import BatteryState, Imu, JointState, Joy, Temperature
from std_msgs.msg import Bool, String

from lola_bridge.codec import JOINTS, LolaSensors, decode_sensors
from lola_bridge.driver import DriverSettings
from lola_bridge.joints import JointMap, sitting_pose
from lola_bridge.link import (
    END,
    PACKET_BYTES,
    SETTINGS,
    SensorPacket,
    address,
    pack_command,
    unpack_from_driver,
)
from lola_bridge.motor_watch import MotorLimits
from lola_bridge.ros.messages import (
    SensorWriter,
    battery_state,
    diagnostics,
    silence_report,
    touch,
)
from lola_bridge.safety import Mode, SafetySettings
from robot_core.command_input import CommandInput
from robot_core.errors import NaoGaitError
from robot_core.log import SILENCE, Level, LogLine
from robot_core.robot import RobotDescription, load_robot
from robot_core.ros.messages import stamp_in, temperature_messages
from robot_core.ros.parameters import (
    declare,
    load_parameter_file,
    node_parameter,
    warn_of_unknown_overrides,
)
from robot_core.ros.patience import ANSWER
from robot_core.ros.process import StopRequest
from robot_core.ros.topics import (
    LATCHED,
    MOTORS,
    RELIABLE,
    Inputs,
    publisher,
    watch_senders,
    write_log,
)

SOCKET = node_parameter("socket", "/tmp/robocup", "LoLA's socket")
URDF = node_parameter("urdf", "nao_v6", "robot model: a shipped name or a URDF file")
CONTROL_PERIOD = node_parameter(
    "control_period", 0.012, "time between two frames of LoLA", "s", 0.002, 0.05
)
STIFFNESS_RAMP = node_parameter(
    "stiffness_ramp", 1.0, "time in which the stiffness rises at the start, and falls at the end",
    "s", 0.0, 60.0,
)  # fmt: skip
SILENCE_TIME = node_parameter(
    "silence_time", 0.12, "time without joint_command after which the robot sits down", "s",
    0.012, 10.0,
)  # fmt: skip
SIT_TIME = node_parameter("sit_time", 2.0, "time to sit down", "s", 0.5, 60.0)
LOCKSTEP = node_parameter(
    "lockstep", False, "the answer to a frame waits for its joint_command; only with lola_server"
)
DRY_RUN = node_parameter("dry_run", False, "publish and log everything, but send no stiffness")
WAIT_FOR_BUTTON = node_parameter(
    "wait_for_button", False, "no command passes until the chest button was held for a second"
)
MOTOR_HOT = node_parameter(
    "motor_hot", MotorLimits.hot,
    "temperature from which on a leg motor makes the robot sit down, another one goes limp",
    "deg C", 40.0, 120.0,
)  # fmt: skip
MOTOR_COOL = node_parameter(
    "motor_cool", MotorLimits.cool, "temperature below which it is used again", "deg C", 30.0, 120.0
)
MOTOR_ERROR = node_parameter(
    "motor_error", MotorLimits.error,
    "difference between command and measurement that counts as not following", "rad", 0.1, 3.0,
)  # fmt: skip
MOTOR_TIME = node_parameter(
    "motor_time", MotorLimits.time, "for so long, until the joint goes limp", "s", 0.1, 10.0
)
MOTOR_CURRENT = node_parameter(
    "motor_current", MotorLimits.current, "mean current over that time until it goes limp", "A",
    0.1, 20.0,
)  # fmt: skip
NODE_PARAMETERS = (
    SOCKET, URDF, CONTROL_PERIOD, STIFFNESS_RAMP, SILENCE_TIME, SIT_TIME, LOCKSTEP, DRY_RUN,
    WAIT_FOR_BUTTON, MOTOR_HOT, MOTOR_COOL, MOTOR_ERROR, MOTOR_TIME, MOTOR_CURRENT,
)  # fmt: skip
REPORT_PERIOD = 1.0
"""[s] between two messages about battery, temperatures and the bridge."""
RESTARTS_MAX = 5
"""Drivers in a row that end before a frame of the robot, after which the bridge gives up."""


class LolaBridgeNode(Node):
    """Frames of the driver become topics in a thread of their own; the executor takes commands."""

    def __init__(self) -> None:
        super().__init__("lola_bridge", automatically_declare_parameters_from_overrides=True)
        self._robot = load_parameter_file(self, URDF, load_robot)
        self._joints = JointMap(self._robot)
        self._settings = self._read_settings()
        warn_of_unknown_overrides(self, (p.name for p in NODE_PARAMETERS))
        watch_senders(self)
        self._writer = SensorWriter(
            self._robot, self._joints, self._settings.safety.period
        )
        self._commands = CommandInput(self._robot)
        self._inputs = Inputs(self)
        self._last: tuple[SensorPacket, LolaSensors] | None = None
        self._heard_at = 0.0
        self._ending = False
        self._failure: Exception | None = None
        self._restarts = 0
        self._reason = ""
        self._make_topics()
        self._process: subprocess.Popen[bytes] | None = None
        self._link = self._connect()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        state = ", dry run" if self._settings.safety.dry_run else ""
        self.get_logger().info(f"{self._robot.name} at {self._settings.socket}{state}")

    # -- making ------------------------------------------------------------------------------------

    def _read_settings(self) -> DriverSettings:
        value = partial(declare, self)
        lower, upper, speed = self._joints.limits()
        safety = SafetySettings(
            period=value(CONTROL_PERIOD),
            stiffness_ramp=value(STIFFNESS_RAMP),
            silence_time=value(SILENCE_TIME),
            sit_time=value(SIT_TIME),
            lower=lower,
            upper=upper,
            speed=speed,
            driven=self._joints.driven,
            sit=self._joints.from_gait(sitting_pose(self._robot)),
            dry_run=value(DRY_RUN),
            wait_for_button=value(WAIT_FOR_BUTTON),
            motors=MotorLimits(
                value(MOTOR_HOT), value(MOTOR_COOL), value(MOTOR_ERROR), value(MOTOR_TIME),
                value(MOTOR_CURRENT),
            ),
        )  # fmt: skip
        return DriverSettings(value(SOCKET), value(LOCKSTEP), safety)

    def _make_topics(self) -> None:
        robot: RobotDescription = self._robot
        self._imu = publisher(self, Imu, "imu/data")
        self._joint_states = publisher(self, JointState, "joint_states")
        self._wrenches = [
            publisher(self, WrenchStamped, f"{frame}/wrench") for frame in robot.sole_frames
        ]
        self._touch = publisher(self, Joy, "touch")
        self._motors_ready = publisher(self, Bool, "motors_ready", LATCHED)
        self._ready: bool | None = None
        self._battery = publisher(self, BatteryState, "battery")
        self._temperature = publisher(self, Temperature, "temperature", MOTORS)
        self._diagnostics = publisher(self, DiagnosticArray, "/diagnostics")
        description = publisher(self, String, "robot_description", LATCHED)
        description.publish(String(data=robot.urdf))
        qos = RELIABLE if self._settings.lockstep else qos_profile_sensor_data
        self._inputs.subscribe(JointState, "joint_command", self._on_command, qos)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(REPORT_PERIOD, self._report, clock=steady)

    def destroy_node(self) -> None:
        """Let the driver sit the robot down; it then ends."""
        self._ending = True
        with contextlib.suppress(OSError):
            self._link.send(END)
        self._reader.join(1.0)
        with contextlib.suppress(OSError):
            self._link.shutdown(socket.SHUT_RDWR)
        if self._process is not None:
            try:
                self._process.wait(ANSWER)
            except subprocess.TimeoutExpired:
                self._process.kill()
        super().destroy_node()

    # -- driver ------------------------------------------------------------------------------------

    def _connect(self) -> socket.socket:
        """Connect to the driver, which is started if there is none."""
        settings = self._settings
        until = time.monotonic() + ANSWER
        while not self._ending:
            link = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            try:
                link.connect(address(settings.socket))
            except OSError as error:
                link.close()
                if time.monotonic() > until:
                    where = f"driver of {settings.socket}"
                    allowed = "a driver that starts"
                    raise NaoGaitError(where, str(error), allowed) from error
            else:
                with contextlib.suppress(OSError):  # one that turned it away has said why
                    link.send(SETTINGS + settings.to_json().encode())
                return link
            if self._process is None or self._process.poll() is not None:
                self._process = subprocess.Popen(
                    [sys.executable, "-m", "lola_bridge.driver", settings.to_json()],
                    start_new_session=True,  # Ctrl-C in a terminal must not reach it
                )
            time.sleep(0.02)
        raise NaoGaitError("lola_bridge", "asked to end before its driver answered", "to run on")

    # -- frames ------------------------------------------------------------------------------------

    def check(self) -> None:
        """Raise here what has ended the thread that reads."""
        if self._failure is not None:
            raise self._failure

    def _read(self) -> None:
        """Publish what the driver sends until the end; an exception is left for `check`."""
        try:
            while not self._ending:
                self._serve_driver()
        except Exception as error:
            if not self._ending:
                self._failure = error

    def _serve_driver(self) -> None:
        """Publish a packet of the driver; start another one if it has died."""
        # A connection that was reset says that first, and then what was sent before.
        packet = self._receive() or self._receive()
        if not packet:
            self._reconnect()
            return
        message = unpack_from_driver(packet)
        if isinstance(message, LogLine):
            self._log(message)
        else:
            self._publish(message)

    def _receive(self) -> bytes:
        try:
            return self._link.recv(PACKET_BYTES)
        except OSError:
            return b""

    def _reconnect(self) -> None:
        if self._ending:
            return
        self._restarts += 1
        if self._restarts > RESTARTS_MAX:
            found = f"ended {self._restarts} times; {self._reason}".rstrip("; ")
            raise NaoGaitError("driver", found, "one that stays")
        self.get_logger().error("the driver has ended; starting it again")
        before, self._link = self._link, self._connect()
        before.close()

    def _publish(self, frame: SensorPacket) -> None:
        self._restarts = 0
        sensors, stamp, writer = decode_sensors(frame.sensors), frame.stamp, self._writer
        ready = frame.status.mode is Mode.ACTIVE
        if ready is not self._ready:
            self._ready = ready
            self._motors_ready.publish(Bool(data=ready))
        # The IMU goes first: the joint state of the same stamp starts a tick of the gait.
        self._imu.publish(writer.imu(stamp, sensors))
        self._joint_states.publish(writer.joints(stamp, sensors))
        for side, topic in enumerate(self._wrenches):
            topic.publish(writer.wrench(stamp, sensors, side))
        before = self._last
        self._heard_at = time.monotonic()  # before `_last`, because the other thread reads both
        self._last = frame, sensors
        if before is None or before[1].touch != sensors.touch:
            self._touch.publish(touch(stamp, sensors))

    def _log(self, line: LogLine) -> None:
        if line.level >= Level.WARN:
            self._reason = line.text
        write_log(self, line)

    # -- commands ----------------------------------------------------------------------------------

    def _on_command(self, message: JointState) -> None:
        header = message.header
        stamp = stamp_in(header, "joint_command")
        now = time.monotonic()  # stamps stand still while lockstep waits
        self._commands.admit(header.frame_id, now)
        targets, warning = self._commands.read(
            header.frame_id, now, stamp, message.name, message.position, message.effort
        )
        if warning is not None:
            self._inputs.warn("limits", warning)
        if targets is None:
            return
        each = targets.joint_stiffness
        shares = [targets.stiffness] * len(targets.position) if each is None else each.tolist()
        packet = pack_command(
            stamp, self._joints.from_gait(targets.position), self._joints.from_gait(shares)
        )
        try:
            self._link.send(packet, socket.MSG_DONTWAIT)
        except OSError as error:
            self._inputs.warn("driver", f"driver: {error}; command ignored")

    # -- once per second ---------------------------------------------------------------------------

    def _report(self) -> None:
        name = self.get_fully_qualified_name().lstrip("/")
        last = self._last
        silence = time.monotonic() - self._heard_at
        if last is None or silence > SILENCE:
            # The last temperatures and the last mode say nothing of a robot that is not heard.
            self._diagnostics.publish(silence_report(name, last, silence, self._reason))
            return
        frame, sensors = last
        self._battery.publish(battery_state(frame.stamp, sensors))
        # Late subscribers get the state, too.
        self._touch.publish(touch(frame.stamp, sensors))
        for message in temperature_messages(frame.stamp, JOINTS, sensors.temperature):
            self._temperature.publish(message)
        mode = frame.status.mode
        refused = "" if mode is Mode.ACTIVE else f"{mode.value}; {self._reason}".rstrip("; ")
        self._diagnostics.publish(
            diagnostics(name, frame.stamp, sensors, frame.status, refused)
        )


def serve(node: Node, executor: SingleThreadedExecutor, stop: StopRequest) -> None:
    """Take commands until a stop is requested; raises what the reading thread could not handle."""
    if not isinstance(node, LolaBridgeNode):
        raise TypeError(type(node).__name__)
    while not stop:
        executor.spin_once(timeout_sec=0.1)
        node.check()
